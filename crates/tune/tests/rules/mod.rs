//! The rules for a parameter on any machine.

use sapwise_tune::{How, Parameter};

/// Checks a parameter of a measurement that keeps up to `most_raw` samples of each.
pub(crate) fn check(p: &Parameter, most_raw: usize) {
    assert!(!p.source.is_empty(), "{p:?}");
    assert_eq!(p.value.is_none(), p.how == How::Missing, "{p:?}");
    assert_eq!(p.samples == 0, p.how == How::Missing, "{p:?}");
    assert!(p.value.is_none_or(|value| value.is_finite() && value >= 0.0), "{p:?}");
    assert!(p.dispersion.is_none_or(|dispersion| dispersion.is_finite() && dispersion >= 0.0), "{p:?}");
    assert!(p.dispersion.is_none() || p.samples >= 4, "{p:?}");
    assert!(p.foreign_load.is_none_or(|share| (0.0..=1.0).contains(&share)), "{p:?}");
    // The value follows from the raw samples, which are few enough for a file.
    assert_eq!(p.raw.is_empty(), p.how != How::Measured, "{p:?}");
    assert!(p.raw.len() <= most_raw, "{p:?}");
    assert!(p.how != How::Measured || p.recomputed() == p.value, "{p:?}");
    if p.how == How::Reported {
        assert_eq!((p.dispersion, p.spoiled, p.foreign_load), (None, 0, None), "{p:?}");
    }
}

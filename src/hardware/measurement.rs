//! When and how hardware was measured for tuning that is kept, and whether it is to be measured again.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// After this time the machine may have another firmware, another cooler or other neighbours.
const LASTS: Duration = Duration::from_secs(30 * 24 * 60 * 60);
/// Frames that take so many times what was predicted, or so small a part of it, tell of a machine that was not itself. The model is off by less
/// than that on most machines held out.
const TOO_FAR: f64 = 2.0;
/// What disturbed it may last so long, and processes that start together are not to measure one after the other.
const RESTS: Duration = Duration::from_secs(10 * 60);
/// What is disturbed or contradicted this often within that time is what the machine is like, or what the model can't do better.
const MOST_ATTEMPTS: u32 = 3;

/// When and how hardware was measured: [`Setup::measured`](crate::Setup::measured).
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Measurement {
    /// When it ended, in seconds since 1970-01-01 UTC.
    pub at_unix_s: u64,
    /// What disturbed it, in words: other programs, cores that moved.
    pub disturbed: Vec<String>,
    /// How many times as long as predicted frames take on the CPU, as far as they told until the last [`save`](crate::Adaptive::save).
    pub frames_over_predicted: f64,
    /// How many measurements were made since the last one that was neither disturbed nor contradicted, or since that became old.
    pub attempt: u32,
}

impl Measurement {
    /// One that ended now. `before` was measured again for it.
    pub(crate) fn now(disturbed: Vec<String>, before: Option<&Self>) -> Self {
        let at_unix_s = now_unix_s();
        let attempt = before.filter(|b| !b.is_old(at_unix_s)).map_or(1, |b| b.attempt + 1);
        Self { at_unix_s, disturbed, frames_over_predicted: 1.0, attempt }
    }

    /// Why the hardware is to be measured again; `None` where it need not be.
    pub(crate) fn doubt(&self) -> Option<String> {
        self.doubt_at(now_unix_s())
    }

    /// Whether frames took much longer or shorter than predicted from it.
    pub(crate) fn is_contradicted(&self) -> bool {
        !(1.0 / TOO_FAR..=TOO_FAR).contains(&self.frames_over_predicted)
    }

    fn doubt_at(&self, now_unix_s: u64) -> Option<String> {
        if self.is_old(now_unix_s) {
            Some(format!("it is over {} days old", LASTS.as_secs() / (24 * 60 * 60)))
        } else if self.attempt >= MOST_ATTEMPTS || now_unix_s.saturating_sub(self.at_unix_s) < RESTS.as_secs() {
            None
        } else if let Some(why) = self.disturbed.first() {
            Some(format!("it was disturbed: {why}"))
        } else if self.is_contradicted() {
            Some(format!("frames take {:.2} times as long as predicted from it", self.frames_over_predicted))
        } else {
            None
        }
    }

    /// Not where the clock was set back since, or is not set yet: some boards have none while they are off.
    fn is_old(&self, now_unix_s: u64) -> bool {
        now_unix_s.saturating_sub(self.at_unix_s) > LASTS.as_secs()
    }
}

fn now_unix_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY: u64 = 24 * 60 * 60;

    #[test]
    fn it_holds_for_a_month_unless_it_was_disturbed_or_frames_contradict_it() {
        let good = Measurement { at_unix_s: 1000, ..Measurement::now(Vec::new(), None) };
        let doubt = |m: &Measurement, at: u64| m.doubt_at(at).unwrap_or_default();
        assert_eq!((doubt(&good, 1000), doubt(&good, 1000 + 30 * DAY)), (String::new(), String::new()));
        assert!(doubt(&good, 1001 + 30 * DAY).contains("30 days") && doubt(&good, 999).is_empty());
        let disturbed = Measurement { disturbed: vec!["a game".to_owned()], ..good.clone() };
        assert_eq!(
            (doubt(&disturbed, 1599), doubt(&disturbed, 1600)),
            (String::new(), "it was disturbed: a game".to_owned())
        );
        for (over, far) in [(1.9, false), (0.55, false), (2.1, true), (0.4, true)] {
            let m = Measurement { frames_over_predicted: over, ..good.clone() };
            assert_eq!(!doubt(&m, 1600).is_empty(), far, "{over}");
        }
    }

    #[test]
    fn what_is_never_better_is_believed_in_the_end() {
        let disturbed = || vec!["a game".to_owned()];
        let mut m = Measurement::now(disturbed(), None);
        let mut attempts = 1;
        let later = |m: &Measurement| m.at_unix_s + 1000;
        while m.doubt_at(later(&m)).is_some() {
            m = Measurement::now(disturbed(), Some(&m));
            attempts += 1;
        }
        assert_eq!((attempts, m.attempt, m.doubt()), (3, 3, None));
        // Until it is old.
        m.at_unix_s -= 31 * DAY;
        assert!(m.doubt().is_some());
        assert_eq!(Measurement::now(Vec::new(), Some(&m)).attempt, 1);
    }
}

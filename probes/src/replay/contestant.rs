//! A fixed algorithm that takes part in a replay.

use super::samples::Samples;
use sapwise::{AlgorithmId, BroadPhase, Error, Registry};

/// A fixed algorithm of which even the fastest of two samples at a frame takes this many times as long as the best there is
/// not timed at that frame again: its total is told, and it can't be the best. One sample alone may have been a cold one.
const HOPELESS: f64 = 10.0;

/// A fixed algorithm is not timed at frames with as many objects as one that takes it longer than this ...
const TOO_LONG_NS: f64 = 1e9;
/// ... and this many times as long as the best: a total that takes hours tells no more than the frame does.
const TOO_SLOW: f64 = 100.0;

/// An algorithm and its times.
pub(super) struct Contestant {
    pub(super) id: AlgorithmId,
    /// `None` once it failed.
    pub(super) algorithm: Option<Box<dyn BroadPhase>>,
    /// Of each frame.
    pub(super) samples: Vec<Samples>,
    /// It is not timed at frames with this many objects or more.
    too_many: usize,
}

impl Contestant {
    /// # Errors
    /// As [`Registry::create`].
    pub(super) fn new(id: AlgorithmId, frames: usize, registry: &Registry) -> Result<Self, Error> {
        let algorithm = Some(registry.create(&id)?);
        Ok(Self { id, algorithm, samples: vec![Samples::default(); frames], too_many: usize::MAX })
    }

    /// Starts again without what it kept from frame to frame, unless it failed before.
    ///
    /// # Errors
    /// When it can't be made again; it takes no part any more.
    pub(super) fn renew(&mut self, registry: &Registry) -> Result<(), Error> {
        // Before the next one is made: what a GPU holds for it may not fit there twice.
        if self.algorithm.take().is_some() {
            self.algorithm = Some(registry.create(&self.id)?);
        }
        Ok(())
    }

    /// Whether another sample at this frame would tell nothing. `best` is the fastest sample of all contestants there.
    pub(super) fn is_skipped(&self, frame: usize, objects: usize, best: f64) -> bool {
        let samples = &self.samples[frame];
        self.algorithm.is_none()
            || objects >= self.too_many
            || samples.len() >= 2 && samples.fastest() > HOPELESS * best
    }

    /// Notes whether a frame with so many objects took too long.
    pub(super) fn judge(&mut self, frame: usize, objects: usize, best: f64) {
        let ns = self.samples[frame].fastest();
        if ns.is_finite() && ns > TOO_LONG_NS && ns > TOO_SLOW * best {
            self.too_many = self.too_many.min(objects);
        }
    }
}

/// The fastest sample of any contestant at a frame.
pub(super) fn best(contestants: &[Contestant], frame: usize) -> f64 {
    contestants.iter().map(|c| c.samples[frame].fastest()).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timed(ns: &[f64]) -> Contestant {
        let mut contestant = Contestant::new("brute@cpu1".parse().unwrap(), 1, &Registry::with_cores(1)).unwrap();
        ns.iter().enumerate().for_each(|(repeat, &ns)| contestant.samples[0].push(repeat, ns));
        contestant
    }

    #[test]
    fn a_hopeless_one_is_not_timed_again_and_one_cold_sample_is_no_proof() {
        assert!(!timed(&[500.0]).is_skipped(0, 9, 10.0));
        assert!(!timed(&[500.0, 90.0]).is_skipped(0, 9, 10.0));
        assert!(timed(&[500.0, 110.0]).is_skipped(0, 9, 10.0));
        assert_eq!(best(&[timed(&[500.0, 110.0]), timed(&[300.0])], 0), 110.0);
    }

    #[test]
    fn too_long_a_frame_is_the_last_with_as_many_objects() {
        let too_many = |ns: f64| {
            let mut contestant = timed(&[ns]);
            contestant.judge(0, 1000, 10e6);
            (contestant.is_skipped(0, 999, 10e6), contestant.is_skipped(0, 1000, 10e6))
        };
        assert_eq!(too_many(900e6), (false, false));
        assert_eq!(too_many(1.1e9), (false, true));
        // Slow as it is, it is not far behind the best.
        let mut contestant = timed(&[1.1e9]);
        contestant.judge(0, 1000, 100e6);
        assert!(!contestant.is_skipped(0, 1000, 100e6));
    }

    #[test]
    fn one_that_failed_is_not_made_again() {
        let registry = Registry::with_cores(1);
        let mut contestant = timed(&[1.0]);
        contestant.renew(&registry).unwrap();
        assert!(contestant.algorithm.is_some());
        contestant.algorithm = None;
        contestant.renew(&registry).unwrap();
        assert!(contestant.algorithm.is_none() && contestant.is_skipped(0, 1, 1.0));
    }
}

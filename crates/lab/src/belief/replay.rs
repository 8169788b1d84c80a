//! Samples out of a report, as if its machine were there.

use super::effort::{Effort, IncrementalMethods};
use super::sampling::{Answer, Sample, Source};
use sapwise::{AlgorithmId, Load};

/// What a report holds of one load.
#[derive(Debug, Clone)]
pub struct ReplayPoint {
    /// The load.
    pub load: Load,
    /// Median times in nanoseconds.
    pub timings: Vec<(AlgorithmId, f64)>,
}

/// How far away the nearest timing of an algorithm may be, in natural logarithms of objects: the sizes of a sweep are a factor of 2.2
/// apart at most.
const NEAR_LN: f64 = 0.8;

/// Answers with the timing at the nearest number of objects, each of them once.
#[derive(Debug)]
pub struct Replay<'a> {
    points: &'a [ReplayPoint],
    given: Vec<(AlgorithmId, usize)>,
    incremental: IncrementalMethods,
}

impl<'a> Replay<'a> {
    /// Of one report, by its points.
    #[must_use]
    pub fn new(points: &'a [ReplayPoint]) -> Self {
        Self { points, given: Vec::new(), incremental: IncrementalMethods::find() }
    }

    /// Position of the point nearest to a load at which the algorithm was timed: with that load itself where there is one, else by objects.
    fn nearest(&self, algorithm: &AlgorithmId, load: &Load) -> Option<usize> {
        let distance = |p: &ReplayPoint| {
            let objects = (f64::from(p.load.objects.max(1)) / f64::from(load.objects.max(1))).ln().abs();
            if p.load == *load { -1.0 } else { objects }
        };
        let timed = |p: &ReplayPoint| p.timings.iter().any(|t| t.0 == *algorithm);
        let near = (0..self.points.len()).filter(|&k| distance(&self.points[k]) <= NEAR_LN && timed(&self.points[k]));
        near.min_by(|&a, &b| distance(&self.points[a]).total_cmp(&distance(&self.points[b])))
    }
}

impl Source for Replay<'_> {
    fn effort(&self, algorithm: &AlgorithmId, load: &Load) -> Option<Effort> {
        let at = self.nearest(algorithm, load)?;
        if self.given.iter().any(|g| g.0 == *algorithm && g.1 == at) {
            return None;
        }
        Some(Effort { objects: self.points[at].load.objects, is_incremental: self.incremental.contain(algorithm) })
    }

    fn sample(&mut self, algorithm: &AlgorithmId, load: &Load) -> anyhow::Result<Answer> {
        let (Some(at), Some(effort)) = (self.nearest(algorithm, load), self.effort(algorithm, load)) else {
            return Ok(Answer::Over);
        };
        self.given.push((algorithm.clone(), at));
        let point = &self.points[at];
        let ns = point.timings.iter().find(|t| t.0 == *algorithm).map_or(0.0, |t| t.1);
        Ok(Answer::Taken(Sample { load: point.load, ns, noise_ln: 0.0, seconds: effort.seconds(ns) }))
    }
}

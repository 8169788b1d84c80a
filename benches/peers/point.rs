//! Measurements of one scenario at one size.

use crate::contestants::{Contestant, Side};
use sapwise_scenes::Scenario;
use sapwise_tune::stats::quantile;

/// Times of a contestant.
pub(crate) struct Lane {
    pub(crate) name: String,
    pub(crate) side: Side,
    /// Whether it keeps state from frame to frame.
    pub(crate) keeps: bool,
    /// Seconds of each timed frame.
    pub(crate) seconds: Vec<f64>,
    pub(crate) tail: Option<Tail>,
}

/// A long stream of frames, run several times.
pub(crate) struct Tail {
    /// Median over the runs, for each frame.
    pub(crate) seconds: Vec<f64>,
    pub(crate) runs: usize,
}

impl Tail {
    /// Returns the median, the 99th percentile and the slowest frame, in seconds.
    pub(crate) fn quantiles(&self) -> [f64; 3] {
        [0.5, 0.99, 1.0].map(|q| quantile(&self.seconds, q).unwrap_or(f64::NAN))
    }
}

/// The contestants that finished a race, all on the same frames.
pub(crate) struct Point {
    pub(crate) scenario: Scenario,
    pub(crate) objects: usize,
    pub(crate) lanes: Vec<Lane>,
    /// Names of those that left because a frame took too long.
    pub(crate) left: Vec<String>,
    /// Share of the CPU, 0 to 1, that other programs took during the timed frames. `None` if the frames were too short
    /// to know it.
    pub(crate) foreign_load: Option<f64>,
}

/// First quartile, median and third quartile.
pub(crate) type Quartiles = [f64; 3];

fn quartiles(samples: &[f64]) -> Quartiles {
    [0.25, 0.5, 0.75].map(|q| quantile(samples, q).unwrap_or(f64::NAN))
}

impl Lane {
    /// Makes the lane of a contestant without times.
    pub(crate) fn of(contestant: &Contestant) -> Self {
        let Contestant { name, side, keeps, .. } = contestant;
        Self { name: name.clone(), side: *side, keeps: *keeps, seconds: Vec::new(), tail: None }
    }

    /// Returns the quartiles of the seconds.
    pub(crate) fn quartiles(&self) -> Quartiles {
        quartiles(&self.seconds)
    }

    /// Returns the median of the seconds.
    pub(crate) fn median(&self) -> f64 {
        self.quartiles()[1]
    }

    /// Returns the quartiles of the ratio of this lane's time to another's in each frame.
    pub(crate) fn over(&self, other: &Self) -> Quartiles {
        let ratios: Vec<f64> = self.seconds.iter().zip(&other.seconds).map(|(a, b)| a / b).collect();
        quartiles(&ratios)
    }
}

impl Point {
    /// Returns the lane with the lowest median among those that `among` accepts.
    pub(crate) fn fastest(&self, among: impl Fn(&Lane) -> bool) -> Option<&Lane> {
        self.lanes.iter().filter(|lane| among(lane)).min_by(|a, b| a.median().total_cmp(&b.median()))
    }

    /// Returns the lane with the lowest median on a side.
    pub(crate) fn best(&self, side: Side) -> Option<&Lane> {
        self.fastest(|lane| lane.side == side)
    }

    /// Returns the ratio of the fastest peer's time to the adaptive one's.
    pub(crate) fn gain(&self) -> Option<Quartiles> {
        Some(self.best(Side::Peer)?.over(self.best(Side::Adaptive)?))
    }
}

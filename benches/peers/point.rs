//! What was measured of one scenario at one size.

use crate::contestants::{Contestant, Side};
use sapwise_scenes::Scenario;
use sapwise_tune::stats::quantile;

/// How a contestant did.
pub(crate) struct Lane {
    pub(crate) name: String,
    pub(crate) side: Side,
    /// Whether it keeps something from frame to frame.
    pub(crate) keeps: bool,
    /// Seconds of each timed frame.
    pub(crate) seconds: Vec<f64>,
    pub(crate) tail: Option<Tail>,
}

/// A long stream of frames, run several times.
pub(crate) struct Tail {
    /// Of each frame the median over the runs.
    pub(crate) seconds: Vec<f64>,
    pub(crate) runs: usize,
}

impl Tail {
    /// Median, 99th percentile and slowest frame, in seconds.
    pub(crate) fn quantiles(&self) -> [f64; 3] {
        [0.5, 0.99, 1.0].map(|q| quantile(&self.seconds, q).unwrap_or(f64::NAN))
    }
}

/// All contestants of a race that were there to the end, so that all have the same frames.
pub(crate) struct Point {
    pub(crate) scenario: Scenario,
    pub(crate) objects: usize,
    pub(crate) lanes: Vec<Lane>,
    /// Names of those who left, since a frame took too long.
    pub(crate) left: Vec<String>,
    /// Share of the CPU, 0 to 1, that other programs took during the timed frames. `None` where they were too short
    /// to tell.
    pub(crate) foreign_load: Option<f64>,
}

/// First quartile, median and third quartile.
pub(crate) type Quartiles = [f64; 3];

fn quartiles(samples: &[f64]) -> Quartiles {
    [0.25, 0.5, 0.75].map(|q| quantile(samples, q).unwrap_or(f64::NAN))
}

impl Lane {
    /// Nothing is timed yet.
    pub(crate) fn of(contestant: &Contestant) -> Self {
        let Contestant { name, side, keeps, .. } = contestant;
        Self { name: name.clone(), side: *side, keeps: *keeps, seconds: Vec::new(), tail: None }
    }

    /// Of the seconds.
    pub(crate) fn quartiles(&self) -> Quartiles {
        quartiles(&self.seconds)
    }

    /// Of the seconds.
    pub(crate) fn median(&self) -> f64 {
        self.quartiles()[1]
    }

    /// Of this one's time over another's, frame by frame.
    pub(crate) fn over(&self, other: &Self) -> Quartiles {
        let ratios: Vec<f64> = self.seconds.iter().zip(&other.seconds).map(|(a, b)| a / b).collect();
        quartiles(&ratios)
    }
}

impl Point {
    /// The one with the lowest median among some.
    pub(crate) fn fastest(&self, among: impl Fn(&Lane) -> bool) -> Option<&Lane> {
        self.lanes.iter().filter(|lane| among(lane)).min_by(|a, b| a.median().total_cmp(&b.median()))
    }

    /// The one with the lowest median on a side.
    pub(crate) fn best(&self, side: Side) -> Option<&Lane> {
        self.fastest(|lane| lane.side == side)
    }

    /// The time of the fastest peer over that of the adaptive one.
    pub(crate) fn gain(&self) -> Option<Quartiles> {
        Some(self.best(Side::Peer)?.over(self.best(Side::Adaptive)?))
    }
}

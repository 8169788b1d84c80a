//! Tuning in files.

use super::wire;
use crate::tuning::{AlgorithmCost, Crossover, Observation, Source, Step, TuningError};
use crate::{AlgorithmId, CostCurve};

wire! {
    /// Which algorithm to run under which load, and where that knowledge came from.
    Tuning = crate::Tuning, checked TuningError {
        /// Where the tuning came from.
        source: Source,
        /// Name of the model that predicted the costs; null where there was no prediction.
        model: Option<String>,
        /// Whether the machine lies outside what the model was trained on.
        extrapolated: bool,
        /// In words, what was outside and what that means.
        warnings: Vec<String>,
        /// Scenario of the slice that `steps` and `crossovers` show.
        scenario: String,
        /// The cheapest algorithm over the number of objects in that scenario, ascending.
        steps: Vec<Step>,
        /// Where one step gives way to the next.
        crossovers: Vec<Crossover>,
        /// What `low` and `high` of the crossovers are made of, and why some have none.
        interval_basis: String,
        /// The cost of each algorithm. Empty: `steps` decide.
        costs: Vec<AlgorithmCost>,
        /// The samples by which a prediction was corrected before the first frame.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        samples: Vec<Observation>,
    }
}

wire! {
    /// From this many objects up, this algorithm.
    StepKeys = Step {
        /// First number of objects.
        from_objects: u32,
        /// The algorithm.
        algorithm: AlgorithmId,
    }
}

wire! {
    /// The number of objects at which two algorithms cost the same.
    CrossoverKeys = Crossover {
        /// The cheaper algorithm with fewer objects.
        below: AlgorithmId,
        /// The cheaper algorithm with more objects.
        above: AlgorithmId,
        /// Number of objects at which both cost the same.
        objects: f64,
        /// Lower end of the interval; null, like `high`, where no interval can be claimed.
        low: Option<f64>,
        /// Upper end of the interval.
        high: Option<f64>,
    }
}

wire! {
    /// The cost of one algorithm.
    AlgorithmCostKeys = AlgorithmCost {
        /// The algorithm.
        algorithm: AlgorithmId,
        /// Revision of the algorithm that the curve was measured or predicted for.
        revision: u32,
        /// Its cost over the load.
        curve: CostCurve,
        /// Standard deviation of the natural logarithm of measured over modelled time.
        spread_ln: f64,
    }
}

wire! {
    /// One algorithm, timed on some frames.
    ObservationKeys = Observation {
        /// The algorithm.
        algorithm: AlgorithmId,
        /// Number of objects.
        objects: u32,
        /// What the model predicted for it, without any sample.
        predicted_ns: f64,
        /// Median over the frames.
        measured_ns: f64,
    }
}

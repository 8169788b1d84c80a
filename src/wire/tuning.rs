//! Tuning in files.

use super::wire;
use crate::cost::{CostTerm, Fallback, Helpers, Places, Residual};
use crate::tuning::{AlgorithmCost, Crossover, Source, Step, TuningError};
use crate::{AlgorithmId, CostCurve, Load, Tuning, Work};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::sync::Arc;

/// Which algorithm to run under which load, and where that knowledge came from.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "Tuning", deny_unknown_fields))]
struct TuningKeys {
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
    /// Loads at which residuals are known.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    places: Vec<Load>,
    /// What methods take on one thread, or on GPUs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    works: Vec<WorkKeys>,
    /// The cost of each algorithm. Empty: `steps` decide.
    costs: Vec<AlgorithmCostKeys>,
}

/// What a method takes on one thread, or on some GPUs.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "Work", deny_unknown_fields))]
struct WorkKeys {
    /// Terms of the sum; none is negative.
    terms: Vec<CostTerm>,
    /// What is done instead where that is cheaper; null where nothing is.
    fallback: Option<FallbackKeys>,
    /// Last-level cache of the machine.
    cache_bytes: f64,
    /// What the terms leave unexplained: for each of `places` what its likeness counts, as the logarithm of a factor.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    residual: Vec<f64>,
    /// Whether the residual tells loads apart by how far boxes move.
    #[serde(default)]
    residual_by_motion: bool,
}

/// Other work that is done instead.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "Fallback", deny_unknown_fields))]
struct FallbackKeys {
    /// That work: a position in `works` before this one, from 0.
    work: usize,
    /// How many times as much it costs here.
    factor: f64,
}

/// The cost of one algorithm.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "AlgorithmCost", deny_unknown_fields))]
struct AlgorithmCostKeys {
    /// The algorithm.
    algorithm: AlgorithmId,
    /// Revision of the algorithm that its cost was measured or predicted for.
    revision: u32,
    /// What it takes on one thread: a position in `works`, from 0.
    work: usize,
    /// What several threads make of that; null of one thread and of GPUs.
    helpers: Option<Helpers>,
    /// What frames that ran told of this algorithm; null where none told anything.
    observed: Option<ObservedKeys>,
    /// Standard deviation of the natural logarithm of measured over modelled time.
    spread_ln: f64,
}

/// What frames told of an algorithm.
#[derive(Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(rename = "Observed", deny_unknown_fields))]
struct ObservedKeys {
    /// The logarithm of a factor everywhere.
    constant: f64,
    /// For each of the first `places` what its likeness counts beside, as the logarithm of a factor.
    weights: Vec<f64>,
    /// Whether loads are told apart by how far boxes move.
    by_motion: bool,
}

impl WorkKeys {
    /// With the position of the work that it falls back to.
    fn new(work: &Work, fallback: Option<usize>) -> Self {
        let residual = work.residual.as_ref();
        Self {
            terms: work.terms.clone(),
            fallback: work.fallback.as_ref().zip(fallback).map(|(f, work)| FallbackKeys { work, factor: f.factor }),
            cache_bytes: work.cache_bytes,
            residual: residual.map_or_else(Vec::new, |r| r.weights.clone()),
            residual_by_motion: residual.is_some_and(|r| r.by_motion),
        }
    }
}

/// Works, each once, and where they stand; what one falls back to stands before it.
#[derive(Default)]
struct Works {
    known: Vec<Arc<Work>>,
    keys: Vec<WorkKeys>,
}

impl Works {
    fn position(&mut self, work: &Arc<Work>) -> usize {
        if let Some(known) = self.known.iter().position(|w| Arc::ptr_eq(w, work)) {
            return known;
        }
        let fallback = work.fallback.as_ref().map(|f| self.position(&f.work));
        self.keys.push(WorkKeys::new(work, fallback));
        self.known.push(Arc::clone(work));
        self.known.len() - 1
    }
}

impl From<&Tuning> for TuningKeys {
    fn from(tuning: &Tuning) -> Self {
        let mut works = Works::default();
        let costs = tuning.costs.iter().map(|cost| AlgorithmCostKeys {
            algorithm: cost.algorithm.clone(),
            revision: cost.revision,
            work: works.position(&cost.curve.work),
            helpers: cost.curve.helpers,
            observed: cost.curve.observed.as_ref().map(|r| ObservedKeys {
                constant: r.constant,
                weights: r.weights.clone(),
                by_motion: r.by_motion,
            }),
            spread_ln: cost.spread_ln,
        });
        let costs = costs.collect();
        let residual = tuning.costs.iter().flat_map(AlgorithmCost::residuals).next();
        Self {
            source: tuning.source,
            model: tuning.model.clone(),
            extrapolated: tuning.extrapolated,
            warnings: tuning.warnings.clone(),
            scenario: tuning.scenario.clone(),
            steps: tuning.steps.clone(),
            crossovers: tuning.crossovers.clone(),
            interval_basis: tuning.interval_basis.clone(),
            places: residual.map_or_else(Vec::new, |r| r.places.loads().to_vec()),
            works: works.keys,
            costs,
        }
    }
}

impl TryFrom<TuningKeys> for Tuning {
    type Error = TuningError;

    fn try_from(keys: TuningKeys) -> Result<Self, TuningError> {
        let places = Arc::new(Places::new(keys.places));
        let mut works: Vec<Arc<Work>> = Vec::new();
        for w in keys.works {
            let residual = Residual::new(Arc::clone(&places), w.residual, w.residual_by_motion);
            let fallback = match w.fallback {
                None => None,
                Some(FallbackKeys { work, factor }) => {
                    let other = works.get(work).ok_or(TuningError::NoFallback { work })?;
                    Some(Fallback { work: Arc::clone(other), factor })
                }
            };
            works.push(Arc::new(Work {
                terms: w.terms,
                fallback,
                cache_bytes: w.cache_bytes,
                residual: Some(residual).filter(|r| !r.weights.is_empty()),
            }));
        }
        let cost = |cost: AlgorithmCostKeys| {
            let Some(work) = works.get(cost.work) else {
                return Err(TuningError::NoWork { algorithm: cost.algorithm, work: cost.work });
            };
            let observed = cost
                .observed
                .map(|o| Residual::new(Arc::clone(&places), o.weights, o.by_motion).with_constant(o.constant));
            let curve = CostCurve { work: Arc::clone(work), helpers: cost.helpers, observed };
            Ok(AlgorithmCost::new(cost.algorithm, cost.revision, curve, cost.spread_ln))
        };
        let tuning = Self {
            source: keys.source,
            model: keys.model,
            extrapolated: keys.extrapolated,
            warnings: keys.warnings,
            scenario: keys.scenario,
            steps: keys.steps,
            crossovers: keys.crossovers,
            interval_basis: keys.interval_basis,
            costs: keys.costs.into_iter().map(cost).collect::<Result<_, _>>()?,
        };
        tuning.defect().map_or(Ok(tuning), Err)
    }
}

impl Serialize for Tuning {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        TuningKeys::from(self).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Tuning {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::try_from(TuningKeys::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Tuning {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Tuning".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        TuningKeys::json_schema(generator)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::json;
    use crate::{Model, Registry};
    use serde_json::Value;

    /// What the built-in model predicts for a machine of two cores, as a file.
    fn file() -> Value {
        use crate::{Hardware, Machine, Parameter, ParameterId};
        let figure = |id: ParameterId| match id {
            ParameterId::CacheLlcBytes => 3.2e7,
            ParameterId::ForkJoinColdNs => 60_000.0,
            ParameterId::UsableCores => 2.0,
            ParameterId::ScalingTwoThreadsRatio | ParameterId::ScalingAllThreadsRatio => 1.9,
            ParameterId::SimdLanes => 8.0,
            _ => 3.0,
        };
        let parameters = ParameterId::ALL.map(|id| Parameter::reported(id, figure(id), "test")).to_vec();
        let loads: Vec<Load> = (3..20).map(|k| Load::of_objects(1 << k)).collect();
        let hardware = Hardware::new(Machine::default(), parameters);
        let model = Model::built_in().unwrap();
        let prediction = model.predict(&hardware, Registry::with_cores(2).entries()).unwrap();
        serde_json::from_str(&json::write_tuning(&prediction.tuning("uniform", &loads)).unwrap()).unwrap()
    }

    #[test]
    fn works_are_written_once_and_shared_again_when_they_are_read() {
        let file = file();
        let tuning = json::tuning(&file.to_string()).unwrap();
        assert!(file["works"].as_array().unwrap().len() < tuning.costs.len());
        let work = |id: &str| &tuning.costs.iter().find(|c| c.algorithm.to_string() == id).unwrap().curve.work;
        if cfg!(feature = "parallel") {
            assert!(Arc::ptr_eq(work("pair-cache@cpu1"), work("pair-cache@cpu2")));
        }
        let fallback = work("pair-cache@cpu1").fallback.as_ref().unwrap();
        assert!(Arc::ptr_eq(&fallback.work, work("bvh@cpu1")));
        assert_eq!(serde_json::from_str::<Value>(&json::write_tuning(&tuning).unwrap()).unwrap(), file);
    }

    #[test]
    fn what_is_cut_repeated_or_of_other_places_is_refused_by_name() {
        let refused = |change: &dyn Fn(&mut Value)| {
            let mut file = file();
            change(&mut file);
            json::tuning(&file.to_string()).unwrap_err().to_string()
        };
        let cut = refused(&|f| f["works"].as_array_mut().unwrap().truncate(1));
        assert!(cut.contains("there is no work") && cut.contains("@cpu"), "{cut}");
        let places = refused(&|f| f["places"].as_array_mut().unwrap().truncate(3));
        assert!(places.contains("more weights than places"), "{places}");
        let huge = refused(&|f| f["works"][0]["residual"][0] = 1e300.into());
        assert!(huge.contains("beyond every measurement"), "{huge}");
        let repeated = refused(&|f| {
            let first = f["costs"][0].clone();
            f["costs"].as_array_mut().unwrap().push(first);
        });
        assert!(repeated.contains("stands there twice"), "{repeated}");
        let itself = refused(&|f| {
            let last = f["works"].as_array().unwrap().len() - 1;
            f["works"][last]["fallback"] = serde_json::json!({ "work": last, "factor": 1.0 });
        });
        assert!(itself.contains("does not stand before it"), "{itself}");
        let threads = refused(&|f| {
            let none = serde_json::json!({
                "threads": 1, "call_ns": 0.0, "late_ns": 0.0, "speed_up": 1.0, "boxes_per_thread": 0
            });
            f["costs"][0]["helpers"] = none;
        });
        assert!(threads.contains("helpers of fewer than two threads"), "{threads}");
    }
}

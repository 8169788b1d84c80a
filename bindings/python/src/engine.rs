//! The engines of `pairs` and `pairs_between`, kept from call to call.

use crate::memory::most_pairs;
use crate::{Corners, PyDecision, start, unusable};
use numpy::IntoPyArray;
use numpy::PyArray2;
use numpy::ndarray::Array2;
use pyo3::prelude::*;
use sapwise::algorithm::Load;
use sapwise::{Aabb, Adaptive, Between, BroadPhase, Error, Filter, PairOrder, Pairs, Worlds};
use sapwise_tune::StartOptions;
use std::sync::{Arc, Mutex, PoisonError};

/// Fewest boxes for an estimate of how they lie. For fewer it costs more than it saves.
const WORTH_AN_ESTIMATE: usize = 2500;

/// Boxes from which on each call reads the free memory for its default limit. Fewer have at most 50 million pairs.
const MANY: usize = 10_000;

/// Largest call whose buffers are kept for the next: a few hundred megabytes.
const MOST_BOXES_KEPT: usize = 2_000_000;
const MOST_PAIRS_KEPT: usize = 16_000_000;
/// Most engines that are kept, one for each thread that calls at the same time.
const MOST_KEPT: usize = 8;

/// A call.
pub(crate) struct Search<'a> {
    pub(crate) what: What<'a>,
    pub(crate) order: PairOrder,
    pub(crate) limit: Option<usize>,
    pub(crate) filter: Option<Filter>,
    /// Drops the pairs that only rounding has made.
    pub(crate) exactly: Option<Exactly<'a>>,
    /// The box of the caller at each position, if they were put in another order.
    pub(crate) places: Option<Vec<u32>>,
    /// Subtracted from the second member of each pair.
    pub(crate) from_second: u32,
}

/// What is searched.
pub(crate) enum What<'a> {
    All(&'a [Aabb]),
    By(&'a str, &'a [Aabb]),
    Worlds(&'a [Aabb], Vec<usize>),
    Between(&'a [Aabb], &'a [Aabb]),
}

/// The corners of both boxes of a pair as the caller gave them, and the most that they may be apart.
pub(crate) struct Exactly<'a> {
    pub(crate) corners: [Corners<'a>; 2],
    pub(crate) margin: f64,
}

/// The searches with their lists of pairs, used by one call at a time.
struct Engine {
    adaptive: Adaptive,
    /// Each algorithm that callers have named, with the name.
    named: Vec<(String, Adaptive)>,
    between: Between,
    worlds: Worlds,
    /// The list in any order, and the one in canonical order.
    pairs: [Option<Pairs>; 2],
    ran: Ran,
}

/// The search that ran last.
#[derive(Clone, Copy)]
enum Ran {
    Adaptive,
    /// The one at this position.
    Named(usize),
    Between(Load),
    Worlds(Load),
}

/// Engines that no call uses. Locked only by a thread with the interpreter's lock, and for an instant: no fork finds
/// it locked.
struct Idle {
    /// The process that made the engines. Their threads are not in a forked one.
    pid: u32,
    engines: Vec<Engine>,
    /// The decision of the last call, if its engine was dropped. Otherwise its engine is the last one.
    decision: Option<PyDecision>,
}

static IDLE: Mutex<Idle> = Mutex::new(Idle { pid: 0, engines: Vec::new(), decision: None });

fn idle<T>(_: Python<'_>, with: impl FnOnce(&mut Idle) -> T) -> T {
    let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
    let pid = std::process::id();
    if idle.pid != pid {
        // After a fork. Dropping them would wait for threads that are not in this process.
        std::mem::forget(std::mem::take(&mut idle.engines));
        idle.pid = pid;
    }
    with(&mut idle)
}

/// Drops the idle engines, so that later calls use the tuning that was saved since.
pub(crate) fn start_again(py: Python<'_>) {
    let engines = idle(py, |idle| {
        idle.decision = idle.take_decision();
        std::mem::take(&mut idle.engines)
    });
    py.detach(|| drop(engines));
}

/// Returns what was decided for the last call.
pub(crate) fn last_decision(py: Python<'_>) -> Option<PyDecision> {
    idle(py, |idle| {
        let decision = idle.take_decision();
        idle.decision.clone_from(&decision);
        decision
    })
}

impl What<'_> {
    /// Number of boxes.
    fn len(&self) -> usize {
        match self {
            Self::All(boxes) | Self::By(_, boxes) | Self::Worlds(boxes, _) => boxes.len(),
            Self::Between(a, b) => a.len() + b.len(),
        }
    }
}

impl Idle {
    fn take_decision(&mut self) -> Option<PyDecision> {
        self.decision.take().or_else(|| self.engines.last().and_then(Engine::decision))
    }
}

impl Engine {
    /// With the tuning that was kept of this machine, or with built-in thresholds. Nothing is measured.
    fn new() -> Result<Self, Error> {
        let registry = Arc::new(start::registry(None));
        let options = StartOptions::new().background(false).measure(None).registry(Arc::clone(&registry));
        let mut adaptive = sapwise_tune::for_this_machine(&options)?;
        adaptive.set_exploring(false);
        Ok(Self {
            adaptive,
            named: Vec::new(),
            between: Between::new(&registry),
            worlds: Worlds::new(&registry),
            pairs: [None, None],
            ran: Ran::Adaptive,
        })
    }

    /// Searches, and returns the pairs flat, as in NumPy.
    fn find(&mut self, search: Search<'_>) -> Result<Vec<u32>, Error> {
        // Pairs of boxes in another order are sorted once they have their own numbers.
        let order = if search.places.is_some() { PairOrder::Any } else { search.order };
        let list = &mut self.pairs[usize::from(order == PairOrder::Canonical)];
        let mut pairs = list.take().unwrap_or_else(|| start::pairs(order, None));
        let usual_limit = usual_limit(search.what.len(), &pairs);
        let limit = search.limit.or(usual_limit);
        // Pairs that only rounding has made do not count: memory alone limits those that are found.
        let room = limit.zip(usual_limit).map(|(limit, usual)| limit.max(usual));
        pairs.set_limit(if search.exactly.is_some() { room } else { limit });
        pairs.set_filter(search.filter);
        let found = self.run(search.what, &mut pairs);
        pairs.set_limit(usual_limit);
        pairs.set_filter(None);
        let Search { exactly, places, from_second, .. } = search;
        let made = found.and_then(|()| {
            if exactly.is_none() && places.is_none() {
                return flat(&pairs, from_second);
            }
            let mut kept = Vec::new();
            let refused = |_| Error::OutOfMemory { what: "pairs", elements: pairs.len() };
            kept.try_reserve_exact(pairs.len()).map_err(refused)?;
            let place = |at: u32| places.as_ref().map_or(at, |places| places[at as usize]);
            let own = pairs.iter().map(|&(a, b)| (place(a), place(b)));
            let own = own.map(|(a, b)| [a.min(b), a.max(b) - from_second]);
            let wanted = |[a, b]: &[u32; 2]| {
                exactly.as_ref().is_none_or(|by| by.corners[0].meet(*a, &by.corners[1], *b, by.margin))
            };
            kept.extend(own.filter(wanted));
            if let Some(limit) = limit.filter(|&limit| kept.len() > limit) {
                return Err(Error::TooManyPairs { limit });
            }
            if places.is_some() && search.order == PairOrder::Canonical {
                kept.sort_unstable();
            }
            Ok(kept.into_flattened())
        });
        self.pairs[usize::from(order == PairOrder::Canonical)] = Some(pairs);
        made
    }

    fn run(&mut self, what: What<'_>, pairs: &mut Pairs) -> Result<(), Error> {
        match what {
            What::All(boxes) if self.adaptive.tuning().costs.is_empty() && lie_on_one_axis(boxes) => {
                let steps = &self.adaptive.tuning().steps;
                let step = steps.iter().rfind(|step| step.from_objects as usize <= boxes.len());
                let sweep = format!("sap@cpu{}", step.map_or(1, |step| step.algorithm.threads()));
                self.run(What::By(&sweep, boxes), pairs)
            }
            What::All(boxes) => {
                self.ran = Ran::Adaptive;
                self.adaptive.find_pairs(boxes, pairs)
            }
            What::By(name, boxes) => {
                let at = match self.named.iter().position(|(known, _)| known == name) {
                    Some(at) => at,
                    None => {
                        self.named.push((name.to_owned(), start::only(name, None)?));
                        self.named.len() - 1
                    }
                };
                self.ran = Ran::Named(at);
                self.named[at].1.find_pairs(boxes, pairs)
            }
            What::Worlds(boxes, starts) => {
                let found = self.worlds.find_pairs(boxes, &starts, pairs);
                self.ran = Ran::Worlds(load(boxes.len(), pairs));
                found
            }
            What::Between(a, b) => {
                let found = self.between.find_pairs(a, b, pairs);
                self.ran = Ran::Between(load(a.len() + b.len(), pairs));
                found
            }
        }
    }

    fn decision(&self) -> Option<PyDecision> {
        match self.ran {
            Ran::Adaptive => self.adaptive.last_decision().map(PyDecision::from),
            Ran::Named(at) => self.named[at].1.last_decision().map(PyDecision::from),
            Ran::Between(load) => Some(PyDecision::alone("between", "the one search of two lists", load)),
            Ran::Worlds(load) => Some(PyDecision::alone("worlds", "the one search of many worlds", load)),
        }
    }

    fn is_small(&self) -> bool {
        self.pairs.iter().flatten().map(Pairs::len).sum::<usize>() <= MOST_PAIRS_KEPT
    }
}

/// Returns the default limit on the pairs of a number of boxes. Few boxes take the limit of the previous call if it
/// allows all their possible pairs: reading the free memory would cost more than the search.
fn usual_limit(boxes: usize, previous: &Pairs) -> Option<usize> {
    let possible = boxes.saturating_mul(boxes) / 2;
    let suffices = boxes < MANY && previous.limit().is_none_or(|limit| possible <= limit);
    if suffices { previous.limit() } else { most_pairs() }
}

/// Returns whether most boxes that overlap on the best axis overlap in space. Then a sweep along that axis is the
/// fastest search, which thresholds don't know.
fn lie_on_one_axis(boxes: &[Aabb]) -> bool {
    boxes.len() >= WORTH_AN_ESTIMATE && {
        let load = Load::estimate(boxes, None, None);
        load.axis_candidates <= 2.0 * load.pairs
    }
}

fn load(boxes: usize, pairs: &Pairs) -> Load {
    Load::of_objects(u32::try_from(boxes).unwrap_or(u32::MAX)).with_pairs(pairs.len() as f64)
}

/// Converts pairs to numbers, two each.
pub(crate) fn flat(pairs: &Pairs, from_second: u32) -> Result<Vec<u32>, Error> {
    let mut numbers = Vec::new();
    let refused = |_| Error::OutOfMemory { what: "pairs", elements: pairs.len() };
    numbers.try_reserve_exact(2 * pairs.len()).map_err(refused)?;
    numbers.extend(pairs.iter().flat_map(|&(a, b)| [a, b - from_second]));
    Ok(numbers)
}

/// Makes an array with two numbers a row.
pub(crate) fn two_columns<'py, T: numpy::Element>(
    py: Python<'py>,
    numbers: Vec<T>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let rows = Array2::from_shape_vec([numbers.len() / 2, 2], numbers);
    rows.map(|rows| rows.into_pyarray(py)).map_err(|why| unusable(py, why.to_string()))
}

/// Runs a call on `objects` boxes, without the interpreter's lock. Checks for Ctrl-C before and after.
pub(crate) fn search<'py>(
    py: Python<'py>,
    objects: usize,
    search: Search<'_>,
    error: impl FnOnce(Error) -> PyErr,
) -> PyResult<Bound<'py, PyArray2<u32>>> {
    py.check_signals()?;
    let engine = idle(py, |idle| idle.engines.pop());
    let (found, engine, decision) = py.detach(|| {
        let mut engine = match engine.map_or_else(Engine::new, Ok) {
            Ok(engine) => engine,
            Err(why) => return (Err(why), None, None),
        };
        let found = engine.find(search);
        let kept = objects <= MOST_BOXES_KEPT && engine.is_small();
        if kept { (found, Some(engine), None) } else { (found, None, engine.decision()) }
    });
    let over = idle(py, |idle| {
        idle.decision = decision;
        idle.engines.extend(engine);
        (idle.engines.len() > MOST_KEPT).then(|| idle.engines.remove(0))
    });
    if over.is_some() {
        py.detach(|| drop(over));
    }
    py.check_signals()?;
    two_columns(py, found.map_err(error)?)
}

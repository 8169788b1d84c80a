//! Times every algorithm on the same frames, over scenarios and sizes.

use crate::clock::milliseconds;
use sapwise::algorithm::{Displacement, Entry, Load};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Error, Pairs, Registry};
use sapwise_gpu::AsyncBroadPhase;
use sapwise_scenes::{Random, Scenario};
use sapwise_tune::stats::median;
use serde_json::{Value, json};

/// The scenarios: the usual one, one with many pairs, and one with boxes of all sizes.
const SCENARIOS: [Scenario; 3] = [Scenario::Uniform, Scenario::Clustered, Scenario::Mixed];
/// Objects: two sizes a decade.
const SIZES: [u32; 9] = [10, 32, 100, 316, 1000, 3162, 10_000, 31_623, 100_000];
/// Samples of each algorithm at a point, and the fewest if time runs out.
const ROUNDS: usize = 7;
const FEWEST: usize = 3;
/// Warm-up frames of an incremental algorithm, as in a probe by the command.
const WARM_UP: usize = 24;
/// Time limit of a scenario, and the assumed growth of the time from one size to the next.
const SCENARIO_MS: f64 = 14_000.0;
const GROWTH: f64 = 4.0;
/// From `JUDGED_FROM` objects on, an algorithm leaves a scenario if it takes this many times the best. `brute` stays
/// until `BRUTE_FROM`, because the paper's crossovers need its curve.
const HOPELESS: f64 = 8.0;
const JUDGED_FROM: u32 = 1000;
const BRUTE_FROM: u32 = 3000;
/// Approximate number of objects in all frames of a point.
const OBJECTS: usize = 20_000;
const MOST_PAIRS: usize = 16 << 20;

/// An algorithm on the GPU leaves only if a frame takes this long too. A shorter frame may be mostly the transfers,
/// which pay off with more objects.
const GPU_NS: f64 = 20e6;

/// An algorithm and where it runs.
enum Algorithm {
    Cpu(Box<dyn BroadPhase>),
    Gpu(AsyncBroadPhase),
}

/// An algorithm in the race.
struct Racer {
    id: AlgorithmId,
    algorithm: Algorithm,
    /// Frames that it ran at this point, and the times of those that count.
    frames: usize,
    samples: Vec<u64>,
    error: Option<String>,
    out: bool,
}

/// The sweep under way.
pub(super) struct Sweep {
    least_ms: f64,
    seed: u64,
    shuffle: Random,
    /// One for each algorithm; new ones for each scenario.
    racers: Vec<Racer>,
    /// Frames of the point, visited forth and back, so that boxes never jump.
    frames: Vec<Vec<Aabb>>,
    pairs: Pairs,
    load: Load,
    /// Pairs of the first frame, and their fingerprint, once an algorithm has found them.
    answer: Option<(u64, u64)>,
    /// Points that are done, and when the scenario and the point began.
    pub(super) done: usize,
    began_ms: [f64; 2],
    pub(super) points: Vec<(Load, Value)>,
    pub(super) remarks: Vec<String>,
}

impl Racer {
    fn new(id: AlgorithmId, algorithm: Algorithm) -> Self {
        Self { id, algorithm, frames: 0, samples: Vec::new(), error: None, out: false }
    }

    /// An incremental algorithm settles in some frames.
    fn is_warm(&self) -> bool {
        let settles = matches!(&self.algorithm, Algorithm::Cpu(algorithm) if algorithm.is_incremental());
        self.frames > if settles { WARM_UP } else { 1 }
    }

    fn median_ns(&self) -> Option<f64> {
        median(&self.samples.iter().map(|&ns| ns as f64).collect::<Vec<_>>())
    }

    /// Runs frames until the clock can time them; the first one alone. Returns the nanoseconds of one.
    async fn run(&mut self, frames: &[Vec<Aabb>], pairs: &mut Pairs, least_ms: f64) -> Result<f64, Error> {
        let (started, round, mut ran, mut look) = (milliseconds(), 2 * frames.len() - 2, 0, 1);
        loop {
            let at = self.frames % round;
            let boxes = &frames[at.min(round - at)];
            match &mut self.algorithm {
                Algorithm::Cpu(algorithm) => algorithm.find_pairs(boxes, pairs)?,
                Algorithm::Gpu(algorithm) => algorithm.find_pairs(boxes, pairs).await?,
            }
            (self.frames, ran) = (self.frames + 1, ran + 1);
            if ran == look {
                let ms = milliseconds() - started;
                if ms >= least_ms || self.frames == 1 {
                    return Ok(ms * 1e6 / f64::from(ran));
                }
                look *= 2;
            }
        }
    }
}

impl Sweep {
    /// Number of points.
    pub(super) const POINTS: usize = SCENARIOS.len() * SIZES.len();

    pub(super) fn new(least_ms: f64, seed: u64) -> Self {
        let mut pairs = Pairs::new();
        pairs.set_limit(Some(MOST_PAIRS));
        Self {
            least_ms,
            seed,
            shuffle: Random::new(seed),
            racers: Vec::new(),
            frames: Vec::new(),
            pairs,
            load: Load::default(),
            answer: None,
            done: 0,
            began_ms: [0.0; 2],
            points: Vec::new(),
            remarks: Vec::new(),
        }
    }

    /// Adds an algorithm on the GPU. It stays for all scenarios.
    pub(super) fn add(&mut self, algorithm: AsyncBroadPhase) {
        self.racers.push(Racer::new(algorithm.id().clone(), Algorithm::Gpu(algorithm)));
    }

    /// Begins a point, or runs each algorithm once, or ends the point. Returns it in words.
    pub(super) async fn step(&mut self) -> String {
        let (scenario, objects) = (SCENARIOS[self.done / SIZES.len()], SIZES[self.done % SIZES.len()]);
        let racing = |racer: &&Racer| !racer.out;
        let rounds = self.racers.iter().filter(racing).map(|racer| racer.samples.len()).min().unwrap_or(ROUNDS);
        if self.frames.is_empty() {
            self.begin(scenario, objects);
        } else if rounds < if self.spent_ms(0) > SCENARIO_MS { FEWEST } else { ROUNDS } {
            self.round().await;
        } else {
            self.end(scenario, objects);
        }
        format!("Timing {scenario} with {objects} objects")
    }

    /// Milliseconds since the beginning of the scenario or of the point.
    fn spent_ms(&self, of: usize) -> f64 {
        milliseconds() - self.began_ms[of]
    }

    fn begin(&mut self, scenario: Scenario, objects: u32) {
        self.began_ms[1] = milliseconds();
        if self.done.is_multiple_of(SIZES.len()) {
            self.began_ms[0] = self.began_ms[1];
            let registry = Registry::new();
            let made = |entry: Entry| {
                let algorithm = registry.create(&entry.id).ok()?;
                Some(Racer::new(entry.id, Algorithm::Cpu(algorithm)))
            };
            self.racers.retain(|racer| matches!(racer.algorithm, Algorithm::Gpu(_)));
            self.racers.iter_mut().for_each(|racer| racer.out = false);
            self.racers.extend(registry.available().into_iter().filter_map(made));
        }
        let mut scene = scenario.start(objects as usize, self.seed);
        for _ in 0..(OBJECTS / objects as usize).clamp(3, 512) {
            self.frames.push(scene.boxes().to_vec());
            scene.advance();
        }
        let mut displacement = Displacement::default();
        displacement.watch(&self.frames[0]);
        self.load = Load::estimate(&self.frames[1], None, displacement.motion(&self.frames[1]));
        self.answer = None;
        self.racers.iter_mut().for_each(|racer| (racer.frames, racer.samples) = (0, Vec::new()));
    }

    /// Runs each algorithm once, in random order. Counts when all are warm.
    async fn round(&mut self) {
        let counts = self.racers.iter().all(|racer| racer.out || racer.is_warm());
        for k in self.shuffle.shuffled(self.racers.len()) {
            let racer = &mut self.racers[k];
            if racer.out || !counts && racer.is_warm() {
                continue;
            }
            match racer.run(&self.frames, &mut self.pairs, self.least_ms).await {
                Ok(ns) if counts => {
                    racer.samples.push((ns as u64).max(1));
                    // One sample of a software GPU is enough: its frames would take the time of all others.
                    racer.out = matches!(racer.algorithm, Algorithm::Gpu(_)) && ns > GPU_NS;
                }
                Ok(_) => {}
                Err(error) => (racer.error, racer.out) = (Some(error.to_string()), true),
            }
            // All answers for the first frame must be the same.
            if racer.frames == 1 && racer.error.is_none() {
                let answer = (self.pairs.len() as u64, self.pairs.fingerprint());
                let right = *self.answer.get_or_insert(answer);
                if answer != right {
                    let text = format!("WRONG ANSWER: {} pairs, and {} by another algorithm", answer.0, right.0);
                    self.remarks.push(format!("{}: {text}", racer.id));
                    (racer.error, racer.out) = (Some(text), true);
                }
            }
        }
    }

    /// Writes the point, and goes on to the next.
    fn end(&mut self, scenario: Scenario, objects: u32) {
        let best = self.racers.iter().filter_map(Racer::median_ns).fold(f64::INFINITY, f64::min);
        let mut timings = Vec::new();
        for racer in &mut self.racers {
            if let Some(error) = racer.error.take() {
                timings.push(json!({"algorithm": racer.id, "samples_ns": [], "error": error}));
            } else if let Some(ns) = racer.median_ns() {
                timings.push(json!({"algorithm": racer.id, "samples_ns": racer.samples}));
                let from = if racer.id.method() == "brute" { BRUTE_FROM } else { JUDGED_FROM };
                let judged = match racer.algorithm {
                    Algorithm::Cpu(_) => objects >= from,
                    Algorithm::Gpu(_) => ns > GPU_NS,
                };
                racer.out = judged && ns > HOPELESS * best;
            }
        }
        let (pairs, fingerprint) = self.answer.unwrap_or_default();
        let load = self.load.with_pairs(pairs as f64);
        let point = json!({
            "scenario": scenario.as_str(), "load": load, "pairs": pairs, "fingerprint": format!("{fingerprint:016x}"),
            "foreign_load": null, "spoiled": 0, "timings": timings,
        });
        self.points.push((load, point));
        self.frames.clear();
        self.done += 1;
        let next = self.done % SIZES.len();
        if next > 0 && self.spent_ms(0) + GROWTH * self.spent_ms(1) > SCENARIO_MS {
            let (size, seconds) = (SIZES[next], SCENARIO_MS / 1e3);
            self.remarks
                .push(format!("{scenario} ends after {objects} objects: {size} objects would exceed its {seconds} s"));
            self.done += SIZES.len() - next;
        }
    }
}

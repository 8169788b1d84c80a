//! The process that takes samples.

use super::request::{Reply, SampleRequest, Session};
use crate::algorithms::Algorithms;
use crate::sweep::{PAIR_LIMIT, add_gpus};
use crate::{child, output};
use anyhow::Context;
use sapwise::measure::Watch;
use sapwise::stats::relative_iqr;
use sapwise::{Aabb, AlgorithmId, BackendClass, BroadPhase, Pairs, Registry};
use sapwise_lab::belief::{FEWEST_FRAMES, TIMED};
use sapwise_lab::sweep::{WARM_UP, median, next_frame};
use sapwise_scenes::Scenario;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Standard deviation of a median over that of a mean, for a normal distribution, and interquartile range over its standard deviation.
const MEDIAN_OVER_MEAN: f64 = 1.2533;
const IQR_OVER_DEVIATION: f64 = 1.349;

/// Takes samples as long as standard input holds requests.
///
/// # Errors
/// When the scenario is unknown, or standard output can't be written.
pub(crate) fn sample(session: &Session, algorithms: &Algorithms) -> anyhow::Result<()> {
    let requests = child::requests();
    let scenario: Scenario = session.scenario.parse().map_err(anyhow::Error::msg)?;
    let mut registry = algorithms.registry(session.cores);
    registry.pin_threads();
    let remarks = add_gpus(&mut registry, &session.gpus);
    let mut sampler = Sampler::new(scenario, session.seed, registry);
    // A driver takes seconds to open a GPU and to compile for it, which is not the time of any sample.
    let on_gpus = session.algorithms.iter().filter(|id| id.backend().class() == BackendClass::Gpu);
    for id in on_gpus {
        // One that can't be made says so when it is asked for.
        let _ = sampler.algorithm(id);
    }
    output::print_json(&Reply::Ready(remarks))?;
    let watch = Watch::begin();
    for line in requests {
        let request: SampleRequest = serde_json::from_str(&line).context("a request that can't be read")?;
        let mut reply = sampler.answer(&request);
        if let Reply::Taken { foreign_load, .. } = &mut reply {
            *foreign_load = if watch.is_long_enough() { watch.foreign_load() } else { None };
        }
        output::print_json(&reply)?;
    }
    Ok(())
}

struct Sampler {
    scenario: Scenario,
    seed: u64,
    registry: Registry,
    /// What was made so far.
    algorithms: BTreeMap<AlgorithmId, Box<dyn BroadPhase>>,
    pairs: Pairs,
    /// Fingerprints of the answers to the second frames, by the number of objects.
    fingerprints: BTreeMap<u32, u64>,
}

impl Sampler {
    fn new(scenario: Scenario, seed: u64, registry: Registry) -> Self {
        let mut pairs = Pairs::new();
        pairs.set_limit(Some(PAIR_LIMIT));
        Self { scenario, seed, registry, algorithms: BTreeMap::new(), pairs, fingerprints: BTreeMap::new() }
    }

    fn algorithm(&mut self, id: &AlgorithmId) -> Result<&mut Box<dyn BroadPhase>, sapwise::Error> {
        if !self.algorithms.contains_key(id) {
            let made = self.registry.create(id)?;
            self.algorithms.insert(id.clone(), made);
        }
        let unknown = || sapwise::Error::UnknownAlgorithm { text: id.to_string(), hint: String::new() };
        self.algorithms.get_mut(id).ok_or_else(unknown)
    }

    fn answer(&mut self, request: &SampleRequest) -> Reply {
        self.timed(request).unwrap_or_else(|error| Reply::Failed { why: error.to_string(), wrong: false })
    }

    fn timed(&mut self, request: &SampleRequest) -> Result<Reply, sapwise::Error> {
        let end = Instant::now() + Duration::try_from_secs_f64(request.seconds).unwrap_or_default();
        let mut scene = self.scenario.start(request.objects as usize, self.seed);
        next_frame(&mut scene);
        // The same frame that the pairs were counted in.
        self.frame(&request.algorithm, scene.boxes())?;
        if let Some(why) = self.mismatch(request) {
            return Ok(Reply::Failed { why, wrong: true });
        }
        if self.algorithm(&request.algorithm)?.is_incremental() {
            for _ in 0..WARM_UP {
                if Instant::now() >= end {
                    return Ok(Reply::TooSlow);
                }
                next_frame(&mut scene);
                self.frame(&request.algorithm, scene.boxes())?;
            }
        }
        let mut samples: Vec<u64> = Vec::new();
        let began = Instant::now();
        while (samples.len() < FEWEST_FRAMES || began.elapsed() < TIMED) && Instant::now() < end {
            next_frame(&mut scene);
            samples.push(self.frame(&request.algorithm, scene.boxes())?);
        }
        let Some(ns) = median(&samples) else { return Ok(Reply::TooSlow) };
        let spread = relative_iqr(&samples.iter().map(|&s| s as f64).collect::<Vec<f64>>());
        // With fewer than four frames there is no range between quartiles; a tenth is what single frames differ by.
        let noise_ln =
            MEDIAN_OVER_MEAN * spread.map_or(0.1, |s| s / IQR_OVER_DEVIATION) / (samples.len() as f64).sqrt();
        Ok(Reply::Taken { ns, noise_ln, foreign_load: None })
    }

    /// Nanoseconds of a frame, at least one.
    fn frame(&mut self, id: &AlgorithmId, boxes: &[Aabb]) -> Result<u64, sapwise::Error> {
        let mut pairs = std::mem::take(&mut self.pairs);
        let algorithm = self.algorithm(id)?;
        let began = Instant::now();
        let found = algorithm.find_pairs(boxes, &mut pairs);
        let elapsed = began.elapsed();
        self.pairs = pairs;
        found?;
        Ok((elapsed.as_nanos() as u64).max(1))
    }

    /// How the answer to the first frame differs from what others found, if it does.
    fn mismatch(&mut self, request: &SampleRequest) -> Option<String> {
        let (found, fingerprint) = (self.pairs.len() as u64, self.pairs.fingerprint());
        if found != request.pairs {
            return Some(format!("wrong pairs: {found} where {} are right", request.pairs));
        }
        let known = *self.fingerprints.entry(request.objects).or_insert(fingerprint);
        (known != fingerprint).then(|| {
            format!("wrong pairs: their fingerprint is {fingerprint:016x}, that of another algorithm {known:016x}")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Finds one pair too many.
    struct Wrong;

    impl BroadPhase for Wrong {
        fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), sapwise::Error> {
            Registry::with_cores(1).create(&"brute@cpu1".parse().unwrap())?.find_pairs(boxes, pairs)?;
            pairs.push(0, 1);
            pairs.push(0, 1);
            pairs.finish()
        }
    }

    fn sampler() -> Sampler {
        let mut registry = Registry::with_cores(1);
        registry.add("wrong@cpu1".parse().unwrap(), 1, || Ok(Box::new(Wrong)));
        Sampler::new(Scenario::Uniform, 1, registry)
    }

    fn request(algorithm: &str, objects: u32) -> SampleRequest {
        let loads = sapwise_lab::sweep::loads(Scenario::Uniform, &[objects], 1, |_| Ok(())).unwrap();
        SampleRequest { algorithm: algorithm.parse().unwrap(), objects, pairs: loads[0].pairs as u64, seconds: 5.0 }
    }

    #[test]
    fn samples_are_medians_of_right_answers() {
        let mut sampler = sampler();
        for id in ["brute@cpu1", "pair-cache@cpu1", "sap@cpu1"] {
            let Reply::Taken { ns, noise_ln, .. } = sampler.answer(&request(id, 300)) else {
                panic!("{id} returned no sample")
            };
            assert!(ns >= 1.0 && (0.0..1.0).contains(&noise_ln), "{id}: {ns} {noise_ln}");
        }
    }

    #[test]
    fn wrong_answers_unknown_algorithms_and_no_time_yield_no_sample() {
        let mut sampler = sampler();
        let failed =
            |reply: Reply| if let Reply::Failed { why, wrong } = reply { (why, wrong) } else { panic!("{reply:?}") };
        let (why, wrong) = failed(sampler.answer(&request("wrong@cpu1", 300)));
        assert!(wrong && why.contains("wrong pairs"), "{why}");
        let (why, wrong) = failed(sampler.answer(&request("octree@cpu1", 300)));
        assert!(!wrong && why.contains("brute@cpu1"), "{why}");
        assert_eq!(sampler.answer(&SampleRequest { seconds: 0.0, ..request("brute@cpu1", 300) }), Reply::TooSlow);
        // As many pairs as are right, but not the same.
        sampler.fingerprints.insert(300, 1);
        assert!(failed(sampler.answer(&request("brute@cpu1", 300))).0.contains("fingerprint"));
    }
}

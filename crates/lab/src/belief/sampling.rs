//! A handful of samples: which algorithm to time at which size, and what that tells about all of them.

use super::effort::Effort;
use super::knowledge_gradient::KnowledgeGradient;
use sapwise::{AlgorithmCost, AlgorithmId, Backend, Load, Observation, Observed};

/// Time for all samples together.
pub const SECONDS: f64 = 2.0;

/// No sample is taken that promises less than this, as a share of a frame's time.
const LEAST_GAIN: f64 = 1e-5;

/// Standard deviation of the logarithm of a sample around what the same load takes in another run and in other scenes, beside its own noise. Judged on another
/// run than they came from, eight samples that were believed to a third of that did harm.
const NOISE_LN: f64 = 0.2;

/// How long a sample will take is forecast with a cost this many standard deviations above the expected one.
const CAUTION: f64 = 1.0;

/// Where samples come from: this machine, or a report of another.
pub trait Source {
    /// What it takes to time an algorithm there, beside its frames. `None` where no sample can be had.
    fn effort(&self, algorithm: &AlgorithmId, load: &Load) -> Option<Effort>;

    /// Times an algorithm on frames of that load.
    ///
    /// # Errors
    /// When no further sample can be taken at all.
    fn sample(&mut self, algorithm: &AlgorithmId, load: &Load) -> anyhow::Result<Answer>;
}

/// What became of a sample.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// It was taken.
    Taken(Sample),
    /// Not this one, but others may be.
    Skipped,
    /// The algorithm can't be used, nor can any other on these GPUs.
    Failed {
        /// What happened, in words that follow the name of the algorithm.
        why: String,
        /// The GPUs that are lost with it.
        gpus: Vec<u32>,
    },
    /// Nothing more is to be had: the time is over, or the user stopped it.
    Over,
}

/// One algorithm, timed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The load of the frames.
    pub load: Load,
    /// Median over the frames.
    pub ns: f64,
    /// Standard deviation of the logarithm of that median.
    pub noise_ln: f64,
    /// Wall clock that it took, everything included.
    pub seconds: f64,
}

/// A sample beside what the model had predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken {
    /// The algorithm.
    pub algorithm: AlgorithmId,
    /// What was measured.
    pub sample: Sample,
    /// What the model had predicted, without any sample.
    pub predicted_ns: f64,
}

impl Taken {
    /// As it stands in a file.
    pub fn observation(&self) -> Observation {
        Observation::new(self.algorithm.clone(), self.sample.load.objects, self.predicted_ns, self.sample.ns)
    }
}

/// Costs that samples have corrected.
#[derive(Debug, Clone)]
pub struct Learned {
    /// What is known of all algorithms.
    pub observed: Observed,
    /// Which of them did not fail.
    pub usable: Vec<bool>,
    /// What was sampled, in that order.
    pub taken: Vec<Taken>,
    /// Why algorithms were left out.
    pub remarks: Vec<String>,
}

/// Takes up to `most` samples on loads of `slice`, each where it promises to lower the expected regret over the slice the most,
/// as long as they fit into [`SECONDS`].
///
/// # Errors
/// As [`Source::sample`].
pub fn learn(mut observed: Observed, slice: &[Load], source: &mut dyn Source, most: usize) -> anyhow::Result<Learned> {
    let count = observed.predicted().len();
    let mut usable = vec![true; count];
    // Several threads of which one does the work are the algorithm of one thread, which is sampled itself.
    let runs_as_one = |a: usize, at: usize| {
        let (curve, load) = (&observed.predicted()[a].curve, &slice[at]);
        curve.helpers.is_some_and(|h| {
            let work_ns = curve.work.ns(load);
            h.cost_ns(load.objects, work_ns) == work_ns
        })
    };
    let mut open: Vec<(usize, usize)> = (0..count).flat_map(|a| (0..slice.len()).map(move |at| (a, at))).collect();
    open.retain(|&(a, at)| !runs_as_one(a, at));
    let mut gradient = KnowledgeGradient::new(&observed, slice, &usable);
    let mut expected = Vec::new();
    let (mut taken, mut remarks, mut left) = (Vec::new(), Vec::new(), SECONDS);
    while taken.len() < most {
        gradient.refresh(&observed, &usable);
        cautious_ns(&mut observed, slice, &mut expected);
        // One sample may take two shares of what is left, so that the dear ones don't use up the time of the others.
        let longest = left * 2.0 / (most - taken.len() + 1) as f64;
        let mut next: Option<(f64, usize)> = None;
        for (k, &(a, at)) in open.iter().enumerate() {
            let effort = source.effort(&observed.predicted()[a].algorithm, &slice[at]);
            if effort.is_none_or(|e| e.seconds(expected[at][a]) > longest) {
                continue;
            }
            let gain = gradient.gain(&mut observed, a, &slice[at], NOISE_LN);
            if gain > next.map_or(LEAST_GAIN, |n| n.0) {
                next = Some((gain, k));
            }
        }
        let Some((_, k)) = next else { break };
        let (a, at) = open.swap_remove(k);
        let algorithm = observed.predicted()[a].algorithm.clone();
        match source.sample(&algorithm, &slice[at])? {
            Answer::Over => break,
            Answer::Skipped => {}
            Answer::Failed { why, gpus } => {
                for (other, usable) in observed.predicted().iter().zip(&mut usable) {
                    let lost = matches!(other.algorithm.backend(), Backend::Gpu(used) if used.iter().any(|k| gpus.contains(k)));
                    *usable &= !lost && other.algorithm != algorithm;
                }
                open.retain(|o| usable[o.0]);
                let with =
                    if gpus.is_empty() { String::new() } else { format!(" with all on {}", algorithm.backend()) };
                remarks.push(format!("{algorithm} is left out{with}: {why}"));
            }
            Answer::Taken(sample) => {
                left -= sample.seconds;
                let predicted_ns = observed.predicted()[a].curve.cost_ns(&sample.load);
                if observed.observe(a, &sample.load, sample.ns, NOISE_LN.hypot(sample.noise_ln)) {
                    taken.push(Taken { algorithm, sample, predicted_ns });
                }
            }
        }
    }
    Ok(Learned { observed, usable, taken, remarks })
}

impl Learned {
    /// The corrected costs of the algorithms that did not fail.
    pub fn costs(&self) -> Vec<AlgorithmCost> {
        let mut usable = self.usable.iter();
        let mut costs = self.observed.costs();
        costs.retain(|_| usable.next() == Some(&true));
        costs
    }
}

/// What algorithms may cost under each load, so that a sample that turns out dear seldom exceeds its time.
fn cautious_ns(observed: &mut Observed, slice: &[Load], expected: &mut Vec<Vec<f64>>) {
    let count = observed.predicted().len();
    expected.clear();
    expected.extend(slice.iter().map(|load| {
        let mut of = |a: usize| {
            let (ln, slope) = observed.expected_ln(a, load);
            (ln + CAUTION * observed.prepare(&slope).sqrt()).exp()
        };
        (0..count).map(&mut of).collect::<Vec<f64>>()
    }));
}

#[cfg(test)]
mod tests;

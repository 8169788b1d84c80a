//! What a report holds.

use sapwise::AlgorithmId;
use sapwise::algorithm::Load;
use sapwise::tuning::Term;
use sapwise_tune::Hardware;
use sapwise_tune::model::Scale;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The hardware parameters of a machine and the raw timings of every algorithm on it.
///
/// Facts only: cost curves, crossovers and tunings are derived from it and never stored in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Report {
    /// What kind of evidence this is.
    pub label: Label,
    /// How the report was made.
    pub provenance: Provenance,
    /// The machine, restricted as the label says.
    pub hardware: Hardware,
    /// The algorithms that were timed.
    pub algorithms: Vec<Timed>,
    /// What was timed where, round after round of each scenario, the sizes of a round ascending. Empty with
    /// `--hardware-only`.
    pub points: Vec<Point>,
    /// Whether the measurement was cut short, and what went wrong. Empty when all went well.
    pub remarks: Vec<String>,
}

/// What kind of evidence a report is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Label {
    /// A whole machine, undisturbed.
    RealFull,
    /// A real machine with fewer threads or a lower SIMD level than it has.
    RealRestricted,
    /// A real machine that other programs disturbed.
    RealContended,
    /// A real machine whose GPU is a software adapter on its CPU.
    RealSoftwareGpu,
    /// A real machine, measured by a page in its browser.
    RealBrowser,
    /// Parameters from a publication, without timings.
    Published,
}

/// How a report was made.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Provenance {
    /// Version of the command.
    pub version: String,
    /// Date of the measurement, UTC, as `yyyy-mm-dd`.
    pub date: String,
    /// The arguments of the command, paths left out.
    pub command: String,
    /// Seed of the scenarios.
    pub seed: u64,
    /// Threads that `--threads` allowed; `None` without it.
    pub threads: Option<u32>,
    /// SIMD level that was forced; `None` when none was.
    pub simd: Option<String>,
    /// Threads of the software adapter lavapipe, if it is among the GPUs and `LP_NUM_THREADS` sets them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gpu_threads: Option<u32>,
    /// What was taken from the machine for this report; `None` when nothing was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restriction: Option<Restriction>,
    /// Whether the program was built with optimisation. Timings of a debug build are refused by `train`.
    pub optimised: bool,
    /// Seconds that the whole measurement took.
    pub seconds: f64,
}

/// What was taken from a machine, and whether its parameters show it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Restriction {
    /// What was taken, each kind once.
    pub kinds: Vec<Restricted>,
    /// One entry for each parameter that must show it. Empty when there was no report to compare with.
    pub proof: Vec<Proof>,
}

/// What can be taken from a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Restricted {
    /// Cores, by [`Provenance::threads`].
    Threads,
    /// Vector lanes, by [`Provenance::simd`].
    Simd,
    /// Memory bandwidth, by programs beside it.
    ContendedMemory,
    /// Last-level cache, by programs beside it.
    ContendedCache,
    /// Threads of a software adapter, by [`Provenance::gpu_threads`].
    GpuThreads,
}

/// One parameter with and without a restriction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Proof {
    /// The restriction.
    pub kind: Restricted,
    /// Name of the parameter that must show it.
    pub parameter: String,
    /// The GPU of this report whose parameter it is; `None` for one of the CPU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gpu: Option<u32>,
    /// Its value in the report without this restriction. `None` when it is missing there.
    pub without: Option<f64>,
    /// Its value in this report. `None` when it is missing here.
    pub with: Option<f64>,
    /// Whether that shows the restriction.
    pub shows: bool,
}

/// An algorithm that was timed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Timed {
    /// The algorithm.
    pub id: AlgorithmId,
    /// Its revision at the time.
    pub revision: u32,
    /// The terms that its author named; a cost model is fitted with them. Empty for the usual terms.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<TimedTerm>,
}

/// One term of a time: a count of the load, and the hardware parameter that it scales with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct TimedTerm {
    /// What is counted.
    pub term: Term,
    /// What one of it costs.
    pub scale: Scale,
}

/// One scenario at one size: every algorithm on the same frames, in random order within each frame.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Point {
    /// Name of the scenario.
    pub scenario: String,
    /// Mean load of the timed frames, each as a program estimates it, with the pairs of the previous frame.
    pub load: Load,
    /// Pairs in the last frame.
    pub pairs: u64,
    /// [`Pairs::fingerprint`](sapwise::Pairs::fingerprint) of the last frame, equal for every algorithm, as 16 hex
    /// digits.
    pub fingerprint: String,
    /// Highest share of the CPU, 0 to 1, that other programs took meanwhile. `None` when the system does not report it.
    pub foreign_load: Option<f64>,
    /// Frames that were dropped because of foreign load.
    pub spoiled: u32,
    /// [`ParameterId::CoreToCoreNs`](sapwise_tune::ParameterId::CoreToCoreNs) before and after the samples. It
    /// changes when a hypervisor moves the cores of a guest, and with it the speed-up of several threads. Absent on
    /// one core.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub core_to_core_ns: Option<[f64; 2]>,
    /// One entry for each algorithm that had not left the sweep.
    pub timings: Vec<Timing>,
}

/// Raw timings of one algorithm at one point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Timing {
    /// The algorithm.
    pub algorithm: AlgorithmId,
    /// Wall clock of each frame from boxes in memory to pairs in memory. The k-th sample of every algorithm at a
    /// point is the same frame. An algorithm that was clearly beaten has fewer samples: it stopped early.
    pub samples_ns: Vec<u64>,
    /// Why there are no samples. Absent when there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Timed {
    /// Makes an entry with the usual terms of the method.
    pub fn new(id: AlgorithmId, revision: u32) -> Self {
        Self { id, revision, terms: Vec::new() }
    }
}

impl Report {
    /// Returns whether the measurement was cut short, as the remarks say.
    pub fn is_unfinished(&self) -> bool {
        self.remarks.iter().any(|remark| Self::is_cut_short(remark))
    }

    /// Begins the remark about an algorithm that found other pairs than the rest.
    pub const WRONG_ANSWER: &str = "WRONG ANSWER: ";
    /// Stands between a scenario and what became of its process in the remark about points that are missing.
    pub const INCOMPLETE: &str = " is incomplete: its process ";

    /// Returns whether the measurement has gaps or wrong answers, as the remarks say.
    pub fn has_gaps(&self) -> bool {
        let gap = |remark: &String| remark.starts_with(Self::WRONG_ANSWER) || remark.contains(Self::INCOMPLETE);
        self.is_unfinished() || self.remarks.iter().any(gap)
    }

    /// Returns whether a remark says that the measurement was cut short.
    pub fn is_cut_short(remark: &str) -> bool {
        remark.starts_with("unfinished") || remark.starts_with("interrupted")
    }

    /// Returns what makes this report unusable, if anything.
    pub fn defect(&self) -> Option<String> {
        if let Some(defect) = self.hardware.defect() {
            return Some(defect.to_string());
        }
        for (k, point) in self.points.iter().enumerate() {
            let at = format!("point {k} ({} at {} objects)", point.scenario, point.load.objects);
            if !point.load.is_sound() {
                return Some(format!("{at}: a load that is negative or not finite"));
            }
            if !point.core_to_core_ns.iter().flatten().all(|ns| ns.is_finite() && *ns > 0.0) {
                return Some(format!("{at}: a latency between cores that is not above 0"));
            }
            for timing in &point.timings {
                let id = &timing.algorithm;
                if !self.algorithms.iter().any(|t| t.id == *id) {
                    return Some(format!("{at}: {id} is not among the report's algorithms"));
                }
                if timing.samples_ns.contains(&0) {
                    return Some(format!("{at}: {id} has a sample of 0 ns"));
                }
            }
        }
        None
    }
}

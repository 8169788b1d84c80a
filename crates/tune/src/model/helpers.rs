//! The effect of several threads of a machine.

use super::PredictError;
use super::needed::needed;
use super::scale::cycle;
use crate::hardware::{Hardware, ParameterId};
use sapwise::internals::Helpers;

/// How a method calls its helpers, shared by machines and numbers of threads.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
pub struct HelpersModel {
    /// Cycles of the caller for each helper that it calls.
    pub call_cycles: f64,
    /// Share of a cold fork and join ([`ParameterId::ForkJoinColdNs`]) by which helpers are late: that much work of
    /// one thread is lost.
    pub late_share: f64,
    /// Share of the work of one thread that stays serial (Amdahl, Validity of the single processor approach, 1967).
    /// The rest scales as measured ([`ParameterId::ScalingTwoThreadsRatio`] and
    /// [`ParameterId::ScalingAllThreadsRatio`]).
    pub serial_share: f64,
    /// Boxes that keep one thread busy: a frame uses one thread for each so many boxes. 0: it uses all threads.
    pub boxes_per_thread: u32,
}

/// What a number of threads of a machine can do.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ThreadFigures {
    /// One cycle of one core.
    pub cycle_ns: f64,
    /// One fork and join of all usable cores after they were idle.
    pub fork_join_cold_ns: f64,
    /// Work of that many threads over work of one.
    pub scaling: f64,
}

impl ThreadFigures {
    /// Creates the figures from a cycle and a cold fork and join in nanoseconds, and work of several threads over
    /// work of one.
    pub const fn new(cycle_ns: f64, fork_join_cold_ns: f64, scaling: f64) -> Self {
        Self { cycle_ns, fork_join_cold_ns, scaling }
    }

    /// Returns the figures of `threads` threads of a machine.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing.
    pub fn of(hardware: &Hardware, threads: u32) -> Result<Self, PredictError> {
        let fork_join_cold_ns = needed(hardware, ParameterId::ForkJoinColdNs)?;
        Ok(Self { cycle_ns: cycle(hardware)?, fork_join_cold_ns, scaling: scaling(hardware, threads)? })
    }
}

impl HelpersModel {
    /// The hardware parameters of the machine that [`on`](Self::on) reads.
    pub const PARAMETERS: &[ParameterId] = &[
        ParameterId::ClockMeasuredGhz,
        ParameterId::ClockReportedGhz,
        ParameterId::UsableCores,
        ParameterId::ForkJoinColdNs,
        ParameterId::ScalingTwoThreadsRatio,
        ParameterId::ScalingAllThreadsRatio,
    ];

    /// Creates a model from the values of its fields.
    pub const fn new(call_cycles: f64, late_share: f64, serial_share: f64, boxes_per_thread: u32) -> Self {
        Self { call_cycles, late_share, serial_share, boxes_per_thread }
    }

    /// Returns the helpers of `threads` threads on a machine; `None` for one thread.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing.
    pub fn on(&self, hardware: &Hardware, threads: u32) -> Result<Option<Helpers>, PredictError> {
        (threads > 1).then(|| Ok(self.with(ThreadFigures::of(hardware, threads)?, threads))).transpose()
    }

    /// Returns the helpers of `threads` threads with these figures.
    pub fn with(&self, figures: ThreadFigures, threads: u32) -> Helpers {
        let mut helpers = Helpers::new(threads);
        helpers.call_ns = self.call_cycles * f64::from(threads.max(1) - 1) * figures.cycle_ns;
        helpers.late_ns = self.late_share * figures.fork_join_cold_ns;
        helpers.speed_up = 1.0 / (self.serial_share + (1.0 - self.serial_share) / figures.scaling);
        helpers.boxes_per_thread = self.boxes_per_thread;
        helpers
    }

    pub(super) fn is_sound(&self) -> bool {
        [self.call_cycles, self.late_share].iter().all(|x| x.is_finite() && *x >= 0.0)
            && (0.0..=1.0).contains(&self.serial_share)
    }
}

/// Work of `threads` threads over work of one: the geometric mean of `threads` and the measured value, interpolated on
/// logarithmic axes between two and all. Two reports of one host had 1.06 and 1.83 on two threads: a hypervisor may put
/// two virtual cores on one core for a while.
fn scaling(hardware: &Hardware, threads: u32) -> Result<f64, PredictError> {
    let cores = needed(hardware, ParameterId::UsableCores)?;
    let mut ln = needed(hardware, ParameterId::ScalingAllThreadsRatio)?.ln();
    let k = f64::from(threads).min(cores);
    if k < cores {
        let two = needed(hardware, ParameterId::ScalingTwoThreadsRatio)?.ln();
        let share = if cores > 2.0 { (k / 2.0).ln() / (cores / 2.0).ln() } else { 1.0 };
        ln = two * (1.0 - share) + ln * share;
    }
    Ok((0.5 * (ln.min(k.ln()) + k.ln())).exp())
}

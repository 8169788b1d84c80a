//! Parts of a cost that algorithms share.

use super::own::OWN_FRAMES;
use crate::algorithm::BackendClass;

/// Standard deviations of shared parts before anything was observed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Deviations {
    /// Of what all algorithms on the CPU have in common, and of what all on GPUs have.
    cpu_ln: f64,
    gpu_ln: f64,
    kept_ln: f64,
    width_ln: f64,
    calls_ln: f64,
}

impl Deviations {
    /// Of a prediction for this machine, about as on machines held out.
    pub(crate) const PREDICTED: Self = Self { cpu_ln: 0.3, gpu_ln: 0.3, kept_ln: 0.1, width_ln: 0.1, calls_ln: 0.3 };
    /// Of a machine unlike those of the training.
    pub(crate) const UNLIKE: Self = Self { cpu_ln: 0.8, gpu_ln: 0.8, kept_ln: 0.5, width_ln: 0.2, calls_ln: 0.7 };
    /// In line: tuning may be of another machine, and a core that is taken doubles the time of those that use it.
    /// What algorithms on the CPU have in common was off by a few percent on a machine that the model had not seen,
    /// and single algorithms by 0.2 to 0.3; at 0.8 one whose scene was dearer than predicted made all others look as
    /// dear, and they were not tried. Tuning that is off by a factor of several for all is believed to be after some
    /// batches more. GPUs of a kind that the model had not seen were four to eight times as fast as predicted. What
    /// keeping work spares is predicted as well for other machines: where it was doubted more, incremental algorithms
    /// were left after a few dear frames.
    pub(crate) const IN_LINE: Self =
        Self { cpu_ln: 0.4, kept_ln: Self::PREDICTED.kept_ln, width_ln: 0.25, ..Self::UNLIKE };
}

/// Of what a method has for all of its algorithms: about what was left of predictions on machines held out.
const METHOD_LN: f64 = 0.1;

/// Frames after which what was observed counts for less than half. In a hundred frames a class may change by 8 %,
/// what keeping saves by 11 %, a width by 8 % (standard deviations); a faster change shows in surprises.
const CLASS_FRAMES: f64 = 10_000.0;
const KEPT_FRAMES: f64 = 3000.0;
const WIDTH_FRAMES: f64 = 800.0;

/// By how much what keeping work spares may be off once that is forgotten, at least. It is believed as it is
/// predicted at first; but frames of what keeps work never tell it from the speed of the machine, and in the end it
/// is to be tried whether another algorithm is cheaper.
const KEPT_LATER_LN: f64 = 0.6;

/// A shared part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Part<'a> {
    Class(BackendClass),
    Kept(usize),
    Width(BackendClass, u32),
    Calls(BackendClass, u32),
    Method(BackendClass, &'a str),
}

impl Part<'_> {
    pub(super) fn deviation_ln(&self, deviations: Deviations) -> f64 {
        match self {
            Self::Class(BackendClass::Cpu) => deviations.cpu_ln,
            Self::Class(BackendClass::Gpu) => deviations.gpu_ln,
            Self::Kept(_) => deviations.kept_ln,
            Self::Width(..) => deviations.width_ln,
            Self::Calls(..) => deviations.calls_ln,
            Self::Method(..) => METHOD_LN,
        }
    }

    /// By how much it may be off once what was observed is forgotten.
    pub(super) fn later_ln(&self, deviations: Deviations) -> f64 {
        match self {
            Self::Kept(_) => deviations.kept_ln.max(KEPT_LATER_LN),
            _ => self.deviation_ln(deviations),
        }
    }

    pub(super) fn frames(&self) -> f64 {
        match self {
            Self::Class(_) => CLASS_FRAMES,
            Self::Kept(_) => KEPT_FRAMES,
            Self::Width(..) | Self::Calls(..) => WIDTH_FRAMES,
            Self::Method(..) => OWN_FRAMES,
        }
    }
}

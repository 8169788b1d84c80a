//! What the residual of a cost model may depend on.

use super::PredictError;
use super::needed::needed;
use crate::hardware::{Hardware, ParameterId};
use crate::named::named;
use crate::{Backend, BackendClass, Load};

named! {
    /// What a residual may depend on.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Feature("feature of a residual") {
        /// Base-2 logarithm of the number of objects.
        Log2Objects = "log2_objects",
        /// Its square.
        Log2ObjectsSquared = "log2_objects_squared",
        /// Base-2 logarithm of the SIMD lanes of the CPU. Not of a GPU, whose lanes are in its arithmetic rate.
        Log2Lanes = "log2_lanes",
        /// Base-2 logarithm of the threads of the algorithm, or of the number of its GPUs.
        Log2Threads = "log2_threads",
        /// The base-2 logarithms of the number of objects and of the threads multiplied: what threads cost a frame beyond their terms weighs
        /// most where there are few objects. Not of a GPU.
        Log2ObjectsTimesThreads = "log2_objects_times_threads",
    }
}

impl Feature {
    /// Every feature of a class of processor.
    #[must_use]
    pub fn of(class: BackendClass) -> &'static [Self] {
        match class {
            BackendClass::Cpu => &[
                Self::Log2Objects,
                Self::Log2ObjectsSquared,
                Self::Log2Lanes,
                Self::Log2Threads,
                Self::Log2ObjectsTimesThreads,
            ],
            BackendClass::Gpu => &[Self::Log2Objects, Self::Log2ObjectsSquared, Self::Log2Threads],
        }
    }

    pub(super) fn is_of(self, class: BackendClass) -> bool {
        Self::of(class).contains(&self)
    }

    /// The hardware parameters that it looks at.
    #[must_use]
    pub fn parameters(self) -> &'static [ParameterId] {
        match self {
            Self::Log2Lanes => &[ParameterId::SimdLanes],
            Self::Log2Objects | Self::Log2ObjectsSquared | Self::Log2Threads | Self::Log2ObjectsTimesThreads => &[],
        }
    }

    /// The feature of an algorithm on a backend of a machine under a load.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing, or says that the feature is not one of that processor.
    pub fn value(self, hardware: &Hardware, backend: &Backend, load: &Load) -> Result<f64, PredictError> {
        match self.of_octaves(f64::from(load.objects.max(1)).log2(), backend) {
            Some(value) => Ok(value),
            None => self.of_machine(hardware, backend),
        }
    }

    /// The feature on a backend at a base-2 logarithm of the number of objects, where it depends on that.
    pub(super) fn of_octaves(self, octaves: f64, backend: &Backend) -> Option<f64> {
        match self {
            Self::Log2ObjectsTimesThreads => Some(octaves * f64::from(backend.width()).log2()),
            Self::Log2Objects => Some(octaves),
            Self::Log2ObjectsSquared => Some(octaves * octaves),
            Self::Log2Lanes | Self::Log2Threads => None,
        }
    }

    /// The feature of a backend of a machine, where it does not depend on the load.
    ///
    /// # Errors
    /// Names the hardware parameter that is missing, or says that the feature is not one of that processor.
    pub(super) fn of_machine(self, hardware: &Hardware, backend: &Backend) -> Result<f64, PredictError> {
        match self {
            Self::Log2Threads => Ok(f64::from(backend.width()).log2()),
            Self::Log2Lanes if self.is_of(backend.class()) => Ok(needed(hardware, ParameterId::SimdLanes)?.log2()),
            _ => Err(PredictError::NotOfProcessor { backend: backend.to_string(), what: format!("feature {self}") }),
        }
    }
}

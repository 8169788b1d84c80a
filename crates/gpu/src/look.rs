//! Statistics of a sample of boxes, by which a frame is planned.

use super::division::Parts;
use sapwise::internals::{SampledBoxes, SceneStats};

/// Statistics of a sample of boxes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Look {
    pub(super) sample: SceneStats,
    /// Parts of each axis in which the boxes lie evenly.
    pub(super) parts: [Parts; 3],
}

impl Look {
    /// The look of sampled boxes whose statistics are known.
    pub(super) fn of(chosen: &SampledBoxes, sample: SceneStats) -> Self {
        let boxes = chosen.as_slice();
        let parts = |axis: usize| {
            let centre = |low: f32, high: f32| low + (high - low) * 0.5;
            let mut centres: Vec<f32> = boxes.iter().map(|b| centre(tame(b.min[axis]), tame(b.max[axis]))).collect();
            centres.sort_unstable_by(f32::total_cmp);
            Parts::of(&centres)
        };
        Self { sample, parts: [parts(0), parts(1), parts(2)] }
    }

    /// The look of sampled boxes.
    pub(super) fn at(chosen: &SampledBoxes) -> Self {
        Self::of(chosen, SceneStats::of_sample(chosen))
    }
}

/// Clamps a bound as `tame` of `shaders/division.wgsl` does.
fn tame(bound: f32) -> f32 {
    bound.clamp(-1.0e38, 1.0e38)
}

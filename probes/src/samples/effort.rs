//! How many frames a sample takes, and how long.

/// Frames in a sample: as many as fit into this time, within bounds.
const FRAMES_NS: f64 = 20e6;
const FEWEST_FRAMES: f64 = 3.0;
const MOST_FRAMES: f64 = 40.0;

/// Time to make a scene and to advance it by a frame, for each object: what `uniform` takes on the first machine, rounded up.
const START_NS: f64 = 60.0;
const ADVANCE_NS: f64 = 15.0;

/// Time of a sample beside scene and frames: orders and answers.
const FIXED_NS: f64 = 0.5e6;

/// The first frame allocates buffers and wakes threads.
const FIRST_FRAME: f64 = 3.0;

/// Frames before the samples for algorithms that keep work from frame to frame, as in a sweep.
pub(super) const WARM_UP: u32 = 24;

/// What a sample needs beside the frames that are timed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Effort {
    /// Objects of its scene.
    pub(crate) objects: u32,
    /// Whether the algorithm keeps work from frame to frame.
    pub(crate) keeps_work: bool,
}

impl Effort {
    /// How long a sample will take where a frame takes `ns`.
    pub(crate) fn seconds(self, ns: f64) -> f64 {
        let before = FIRST_FRAME + if self.keeps_work { f64::from(WARM_UP) } else { 0.0 };
        let frames = before + f64::from(frames(ns));
        let scene = f64::from(self.objects) * (START_NS + frames * ADVANCE_NS);
        (FIXED_NS + scene + frames * ns) / 1e9
    }
}

/// How many frames are timed where one takes `ns`.
pub(super) fn frames(ns: f64) -> u32 {
    (FRAMES_NS / ns).clamp(FEWEST_FRAMES, MOST_FRAMES) as u32
}

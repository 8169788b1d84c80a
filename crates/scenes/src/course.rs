//! Courses: scenes whose load changes from one frame to the next, as in games.

use crate::Scenario;
use sapwise::named;

named! {
    /// A scene of which a frame may have fewer boxes, and which may make several steps a frame.
    ///
    /// ```
    /// use sapwise_scenes::Course;
    ///
    /// let course = Course::Fight;
    /// let mut scene = course.scenario().start(1000, 1);
    /// for frame in 0..250 {
    ///     let boxes = &scene.boxes()[..course.boxes(frame, 1000)];
    ///     assert_eq!(boxes.len(), 1000);
    ///     (0..course.steps(frame)).for_each(|_| scene.advance());
    /// }
    /// assert_eq!(scene.frame(), 200 + 50 * 12);
    /// ```
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Course("course") {
        /// A menu of 40 boxes for 150 frames, then the level.
        Level = "level",
        /// For 200 frames in the middle all goes twelve times as fast.
        Fight = "fight",
        /// Every 50 frames half of the objects leave or come back.
        Pooled = "pooled",
    }
}

impl Course {
    /// Returns the scenario of its boxes.
    pub fn scenario(self) -> Scenario {
        match self {
            Self::Level => Scenario::Mixed,
            Self::Fight => Scenario::Uniform,
            Self::Pooled => Scenario::Clustered,
        }
    }

    /// Returns how many of `objects` boxes a frame has.
    pub fn boxes(self, frame: usize, objects: usize) -> usize {
        match self {
            Self::Level if frame < 150 => 40,
            Self::Pooled if (frame / 50).is_multiple_of(2) => objects / 2,
            _ => objects,
        }
    }

    /// Returns the number of steps that the scene makes after a frame.
    pub fn steps(self, frame: usize) -> usize {
        if self == Self::Fight && (200..400).contains(&frame) { 12 } else { 1 }
    }
}

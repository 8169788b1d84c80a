//! Where the frames of a simulation come from.

use crate::boxes::{Frames, write_frames};
use crate::interrupt;
use sapwise::{Aabb, Scenario, Scene};
use std::path::Path;

/// A seeded scene, or a stream that was recorded.
#[derive(Debug, Clone)]
pub(crate) enum Footage {
    Scene { scenario: Scenario, objects: usize, seed: u64 },
    Stream { name: String, frames: Frames },
}

/// A [`Footage`] at one of its frames.
pub(crate) enum Reel<'a> {
    Scene(Box<Scene>),
    Stream { frames: &'a Frames, at: usize },
}

impl Footage {
    /// The name of the scenario or of the file.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Scene { scenario, .. } => scenario.name(),
            Self::Stream { name, .. } => name,
        }
    }

    /// Begins at the first frame.
    pub(crate) fn start(&self) -> Reel<'_> {
        match self {
            Self::Scene { scenario, objects, seed } => Reel::Scene(Box::new(scenario.start(*objects, *seed))),
            Self::Stream { frames, .. } => Reel::Stream { frames, at: 0 },
        }
    }

    /// Writes the first frames as a stream. One frame at a time is in memory.
    ///
    /// # Errors
    /// Names the file; on Ctrl-C. Nothing is left half-written.
    pub(crate) fn record(&self, path: &Path, frames: usize) -> anyhow::Result<()> {
        // The rows of a frame must be known before the first is written.
        let mut most = 0;
        self.each(frames, &mut |boxes| {
            most = most.max(boxes.len());
            Ok(())
        })?;
        write_frames(path, frames, most, |frame| self.each(frames, frame))
    }

    fn each(&self, frames: usize, frame: &mut dyn FnMut(&[Aabb]) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let mut reel = self.start();
        for _ in 0..frames {
            interrupt::check()?;
            frame(reel.boxes())?;
            reel.advance();
        }
        Ok(())
    }
}

impl Reel<'_> {
    /// The boxes of this frame; none after the last of a stream.
    pub(crate) fn boxes(&self) -> &[Aabb] {
        match self {
            Self::Scene(scene) => scene.boxes(),
            Self::Stream { frames, at } => frames.frame(*at),
        }
    }

    /// Goes on to the next frame.
    pub(crate) fn advance(&mut self) {
        match self {
            Self::Scene(scene) => scene.advance(),
            Self::Stream { at, .. } => *at += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boxes::read_frames;

    #[test]
    fn a_scene_that_was_recorded_shows_the_same_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.npy");
        // The number of boxes goes up and down.
        let scene = Footage::Scene { scenario: Scenario::Fragmentation, objects: 300, seed: 3 };
        scene.record(&path, 90).unwrap();
        let stream = Footage::Stream { name: "scene.npy".to_owned(), frames: read_frames(&path).unwrap() };
        let (mut first, mut second) = (scene.start(), stream.start());
        let mut counts = Vec::new();
        for frame in 0..90 {
            assert_eq!(first.boxes(), second.boxes(), "frame {frame}");
            counts.push(first.boxes().len());
            first.advance();
            second.advance();
        }
        assert!(second.boxes().is_empty());
        counts.dedup();
        assert!(counts.len() > 3, "{counts:?}");
        assert_eq!((scene.name(), stream.name()), ("fragmentation", "scene.npy"));
    }
}

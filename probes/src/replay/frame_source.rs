//! The source of a replay's frames.

use crate::interrupt;
use sapwise::Aabb;
use sapwise_lab::write::write_atomically;
use sapwise_scenes::{FrameWriter, Frames, Scenario, Scene};
use std::path::Path;

/// A seeded scene, or a stream that was recorded.
#[derive(Debug, Clone)]
pub(crate) enum FrameSource {
    Scene { scenario: Scenario, objects: usize, seed: u64, swing: Option<Swing> },
    Stream { name: String, frames: Frames },
}

/// A number of objects that grows and shrinks: a frame shows the first ones of its scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Swing {
    /// Objects of the first frame and of the last.
    pub(crate) least: usize,
    /// Frames from the least to the most and back.
    pub(crate) frames: usize,
}

impl Swing {
    /// Objects of a frame of `most`: a straight line in their logarithm, up and down.
    fn objects(self, at: usize, most: usize) -> usize {
        let last = self.frames.saturating_sub(1);
        // Of an even number of frames the two in the middle show all objects.
        let steps = (last / 2).max(1);
        let share = at.min(last.saturating_sub(at)) as f64 / steps as f64;
        let (low, high) = ((self.least.max(1) as f64).ln(), (most.max(1) as f64).ln());
        ((low + share * (high - low)).exp().round() as usize).min(most)
    }
}

/// A [`FrameSource`] at one of its frames.
pub(crate) enum Cursor<'a> {
    Scene { scene: Box<Scene>, swing: Option<Swing>, at: usize },
    Stream { frames: &'a Frames, at: usize },
}

impl FrameSource {
    /// The name of the scenario or of the file.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Scene { scenario, .. } => scenario.as_str(),
            Self::Stream { name, .. } => name,
        }
    }

    /// Begins at the first frame.
    pub(crate) fn start(&self) -> Cursor<'_> {
        match self {
            Self::Scene { scenario, objects, seed, swing } => {
                Cursor::Scene { scene: Box::new(scenario.start(*objects, *seed)), swing: *swing, at: 0 }
            }
            Self::Stream { frames, .. } => Cursor::Stream { frames, at: 0 },
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
        write_atomically(path, |out| {
            let mut writer = FrameWriter::new(out, frames, most)?;
            self.each(frames, &mut |boxes| Ok(writer.write(boxes)?))?;
            writer.finish()?;
            Ok(())
        })
    }

    fn each(&self, frames: usize, frame: &mut dyn FnMut(&[Aabb]) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let mut cursor = self.start();
        for _ in 0..frames {
            interrupt::check()?;
            frame(cursor.boxes())?;
            cursor.advance();
        }
        Ok(())
    }
}

impl Cursor<'_> {
    /// The boxes of this frame; none after the last of a stream.
    pub(crate) fn boxes(&self) -> &[Aabb] {
        match self {
            Self::Scene { scene, swing, at } => {
                let all = scene.boxes();
                &all[..swing.map_or(all.len(), |s| s.objects(*at, all.len()))]
            }
            Self::Stream { frames, at } => frames.frame(*at),
        }
    }

    /// Goes on to the next frame.
    pub(crate) fn advance(&mut self) {
        match self {
            Self::Scene { scene, at, .. } => {
                scene.advance();
                *at += 1;
            }
            Self::Stream { at, .. } => *at += 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_goes_from_the_least_to_all_and_back() {
        let swing = Some(Swing { least: 10, frames: 41 });
        let source = FrameSource::Scene { scenario: Scenario::Clustered, objects: 1000, seed: 1, swing };
        let mut cursor = source.start();
        let mut counts = Vec::new();
        for _ in 0..41 {
            counts.push(cursor.boxes().len());
            cursor.advance();
        }
        assert_eq!([counts[0], counts[10], counts[20], counts[30], counts[40]], [10, 100, 1000, 100, 10]);
        assert!(counts[..21].is_sorted() && counts[20..].is_sorted_by(|a, b| a >= b));
        let even = Swing { least: 10, frames: 6 };
        assert_eq!([0, 1, 2, 3, 4, 5].map(|at| even.objects(at, 1000)), [10, 100, 1000, 1000, 100, 10]);
        let short = [1, 2].map(|frames| Swing { least: 10, frames }.objects(frames - 1, 1000));
        assert_eq!(short, [10, 10]);
    }

    #[test]
    fn a_scene_that_was_recorded_shows_the_same_frames() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.npy");
        // The number of boxes goes up and down.
        let scene = FrameSource::Scene { scenario: Scenario::Fragmentation, objects: 300, seed: 3, swing: None };
        scene.record(&path, 90).unwrap();
        let stream = FrameSource::Stream { name: "scene.npy".to_owned(), frames: Frames::read(&path).unwrap() };
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

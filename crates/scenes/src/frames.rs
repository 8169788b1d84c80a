//! Boxes and pairs in `.npy` files, the format of numpy.
//!
//! A stream of frames with a varying number of boxes is stored as `frames x n x 6` float32 with the most boxes of any
//! frame as `n`. Rows at the end of a frame that are NaN throughout are absent boxes.

mod error;
mod header;
mod read;
mod write;

pub use error::{FramesError, InvalidFrame, NpyError};
pub use write::{FrameWriter, write_pairs};

use sapwise::Aabb;

/// Bounds of a box: lowest x, y, z, then highest x, y, z.
const BOUNDS: u64 = 6;

/// The boxes of each frame of a recorded stream.
///
/// ```
/// use sapwise_scenes::{FrameWriter, Frames, Scenario};
///
/// let scene = Scenario::Uniform.start(100, 1);
/// let mut file = Vec::new();
/// let mut writer = FrameWriter::new(&mut file, 1, 100)?;
/// writer.write(scene.boxes())?;
/// writer.finish()?;
/// let frames = Frames::parse(file.as_slice(), file.len() as u64)?; // or `Frames::read` with a path
/// assert_eq!(frames.frame(0), scene.boxes());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// The boxes of all frames, one frame after the other.
    boxes: Vec<Aabb>,
    /// The end of each frame in `boxes`.
    ends: Vec<usize>,
}

impl Frames {
    /// Returns the number of frames.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is no frame. A frame without boxes counts as one.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Returns the largest number of boxes in a frame.
    pub fn objects(&self) -> usize {
        self.iter().map(<[Aabb]>::len).max().unwrap_or(0)
    }

    /// Returns the boxes of a frame; none beyond the last frame.
    pub fn frame(&self, frame: usize) -> &[Aabb] {
        let Some(&end) = self.ends.get(frame) else { return &[] };
        let start = frame.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.boxes[start..end]
    }

    /// Iterates over the boxes of each frame.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[Aabb]> {
        (0..self.len()).map(|frame| self.frame(frame))
    }

    /// Refuses boxes that every algorithm refuses.
    ///
    /// # Errors
    /// Names the first frame and the first box in it that no algorithm can order.
    pub fn check(&self) -> Result<(), InvalidFrame> {
        for (frame, boxes) in self.iter().enumerate() {
            if let Some((index, defect)) = boxes.iter().enumerate().find_map(|(k, b)| Some((k, b.defect()?))) {
                return Err(InvalidFrame { frame, error: sapwise::Error::InvalidBox { index, defect } });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;

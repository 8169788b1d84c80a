//! Writing frames and pairs.

use std::io::{self, Write};

use super::BOUNDS;
use super::header::Header;
use sapwise::Aabb;
use sapwise::internals::Pair;

/// Writes a stream of frames for [`Frames::read`](super::Frames::read), one frame at a time.
///
/// ```
/// use sapwise_scenes::{FrameWriter, Scenario};
///
/// let mut scene = Scenario::Uniform.start(100, 1);
/// let mut file = Vec::new();
/// let mut writer = FrameWriter::new(&mut file, 3, 100)?;
/// for _ in 0..3 {
///     writer.write(scene.boxes())?;
///     scene.advance();
/// }
/// writer.finish()?;
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct FrameWriter<W> {
    out: W,
    /// Frames still to come.
    frames: usize,
    objects: usize,
}

impl<W: Write> FrameWriter<W> {
    /// Starts a stream of `frames` frames of up to `objects` boxes each.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new(mut out: W, frames: usize, objects: usize) -> io::Result<Self> {
        let shape = vec![frames as u64, objects as u64, BOUNDS];
        Header { descr: "<f4".to_owned(), fortran_order: false, shape }.write(&mut out)?;
        Ok(Self { out, frames, objects })
    }

    /// Writes the next frame and fills it up with absent boxes.
    ///
    /// # Errors
    /// Those of the writer; [`io::ErrorKind::InvalidInput`] for more frames or more boxes than were announced.
    pub fn write(&mut self, boxes: &[Aabb]) -> io::Result<()> {
        let Some(absent) = self.objects.checked_sub(boxes.len()) else {
            return Err(invalid(format!("a frame of {} boxes in a stream of up to {}", boxes.len(), self.objects)));
        };
        self.frames = self.frames.checked_sub(1).ok_or_else(|| invalid("a frame more than were announced"))?;
        for b in boxes {
            b.min.iter().chain(&b.max).try_for_each(|x| self.out.write_all(&x.to_le_bytes()))?;
        }
        let row = [f32::NAN.to_le_bytes(); BOUNDS as usize];
        (0..absent).try_for_each(|_| self.out.write_all(row.as_flattened()))
    }

    /// Ends the stream and returns the writer, which is not flushed.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidInput`] if frames are missing.
    pub fn finish(self) -> io::Result<W> {
        if self.frames > 0 {
            return Err(invalid(format!("{} frames are missing that were announced", self.frames)));
        }
        Ok(self.out)
    }
}

fn invalid(why: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why.into())
}

/// Writes pairs as a `.npy` file of uint32, of shape `m x 2`.
///
/// # Errors
/// Those of the writer.
pub fn write_pairs(mut out: impl Write, pairs: &[Pair]) -> io::Result<()> {
    let shape = vec![pairs.len() as u64, 2];
    Header { descr: "<u4".to_owned(), fortran_order: false, shape }.write(&mut out)?;
    pairs.iter().flat_map(|&(first, second)| [first, second]).try_for_each(|id| out.write_all(&id.to_le_bytes()))
}

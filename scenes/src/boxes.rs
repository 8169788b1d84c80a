//! Boxes and pairs of a user, as numpy reads and writes them.
//!
//! A stream of frames with a varying number of boxes is stored as `frames x n x 6` float32 with the most boxes of any frame as `n`.
//! Rows at the end of a frame that are NaN throughout are absent boxes.

mod header;

use std::fs::{self, File};
use std::io::{BufReader, Read};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use ndarray::ArrayView2;
use ndarray_npy::WriteNpyExt;
use sapwise::Aabb;

use crate::files::write_atomically;
use header::Header;

/// Bounds of a box: lowest x, y, z, then highest x, y, z.
const BOUNDS: u64 = 6;

/// Frames without a box take no room in a file, but time and an entry of the answer each.
const MOST_EMPTY_FRAMES: u64 = 1_000_000;

/// The boxes of each frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frames {
    /// Of all frames, one after the other.
    boxes: Vec<Aabb>,
    /// Where each frame ends.
    ends: Vec<usize>,
}

impl Frames {
    /// How many frames there are.
    pub(crate) fn len(&self) -> usize {
        self.ends.len()
    }

    /// The most boxes that a frame has.
    pub(crate) fn objects(&self) -> usize {
        self.iter().map(<[Aabb]>::len).max().unwrap_or(0)
    }

    /// The boxes of a frame; none beyond the last.
    pub(crate) fn frame(&self, frame: usize) -> &[Aabb] {
        let Some(&end) = self.ends.get(frame) else { return &[] };
        let start = frame.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.boxes[start..end]
    }

    /// The boxes of each frame in turn.
    pub(crate) fn iter(&self) -> impl ExactSizeIterator<Item = &[Aabb]> {
        (0..self.len()).map(|frame| self.frame(frame))
    }

    /// Refuses what every algorithm refuses, before the first of them runs.
    ///
    /// # Errors
    /// Names the first frame and the first box in it that no algorithm can order.
    pub(crate) fn check(&self) -> Result<()> {
        for (frame, boxes) in self.iter().enumerate() {
            if let Some((index, defect)) = boxes.iter().enumerate().find_map(|(k, b)| Some((k, b.defect()?))) {
                let why = sapwise::Error::InvalidBox { index, defect };
                bail!("frame {frame}: {why}; only rows at the end of a frame may be NaN throughout, which are absent boxes");
            }
        }
        Ok(())
    }
}

/// Reads a `.npy` file of little-endian float32, of shape `n x 6` (one frame) or `frames x n x 6`, in C or Fortran order.
///
/// In the second, rows of NaN at the end of a frame are absent boxes. The boxes themselves aren't checked: the algorithms refuse NaN
/// and inverted ones, and say which.
///
/// # Errors
/// Names the file, and what is wrong with it. Memory is taken for what the file holds, never for what its header claims, and the
/// file is not held beside its boxes.
pub(crate) fn read_frames(path: &Path) -> Result<Frames> {
    let frames = || {
        // A pipe or a device has no size, and some never end.
        let found = fs::metadata(path)?;
        ensure!(found.is_file(), "it is no regular file");
        parse(BufReader::with_capacity(1 << 16, File::open(path)?), found.len())
    };
    frames().with_context(|| format!("can't read boxes from {}", path.display()))
}

/// The frames in a file of `length` bytes.
fn parse(mut file: impl Read, length: u64) -> Result<Frames> {
    ensure!(length > 0, "the file is empty");
    let mut counted = Counted { file: &mut file, bytes: 0 };
    let header = Header::read(&mut counted)?;
    let held = length.saturating_sub(counted.bytes);
    match header.descr.as_str() {
        "<f4" => {}
        ">f4" => bail!("its elements are big-endian (>f4); save it with .astype('<f4')"),
        other => bail!("its elements are {other}, where float32 (<f4) is needed; save it with .astype('<f4')"),
    }
    let (frames, objects) = match header.shape[..] {
        [objects, BOUNDS] => (1, objects),
        [frames, objects, BOUNDS] => (frames, objects),
        _ => bail!("its shape is {:?}, where [n, 6] or [frames, n, 6] is needed", header.shape),
    };
    // An axis beside one of length 0 takes no room in a file, so that only this bounds it.
    let most = u64::from(u32::MAX);
    ensure!(frames <= most && objects <= most, "its header claims a shape of {:?}, more than can be numbered", header.shape);
    ensure!(objects > 0 || frames <= MOST_EMPTY_FRAMES, "its header claims {frames} frames without a box");
    let bytes = frames.checked_mul(objects).and_then(|boxes| boxes.checked_mul(4 * BOUNDS));
    let bytes =
        bytes.with_context(|| format!("its header claims a shape of {:?}, more than any file holds", header.shape))?;
    ensure!(held >= bytes, "it is truncated: {} bytes of {bytes} are missing", bytes - held);
    ensure!(held == bytes, "{} bytes follow its {bytes} bytes of data", held - bytes);

    let (frames, objects) = (usize::try_from(frames)?, usize::try_from(objects)?);
    let boxes = if header.fortran_order {
        in_fortran_order(&mut file, frames, objects)?
    } else {
        in_c_order(&mut file, frames * objects)?
    };
    // One frame has no other that could have more boxes, so that a row of NaN in it is a mistake.
    if header.shape.len() == 2 {
        return Ok(Frames { ends: vec![boxes.len()], boxes });
    }
    without_absent(boxes, frames, objects)
}

/// A reader that knows how far it has come.
struct Counted<'a, R> {
    file: &'a mut R,
    bytes: u64,
}

impl<R: Read> Read for Counted<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.file.read(buffer)?;
        self.bytes += read as u64;
        Ok(read)
    }
}

fn room(boxes: usize) -> Result<Vec<Aabb>> {
    let mut room = Vec::new();
    room.try_reserve_exact(boxes).context("its boxes don't fit into memory")?;
    Ok(room)
}

fn in_c_order(file: &mut impl Read, count: usize) -> Result<Vec<Aabb>> {
    let mut boxes = room(count)?;
    for _ in 0..count {
        let mut bounds = [0.0; BOUNDS as usize];
        for bound in &mut bounds {
            *bound = element(file)?;
        }
        let [min_x, min_y, min_z, max_x, max_y, max_z] = bounds;
        boxes.push(Aabb::new([min_x, min_y, min_z], [max_x, max_y, max_z]));
    }
    Ok(boxes)
}

fn in_fortran_order(file: &mut impl Read, frames: usize, objects: usize) -> Result<Vec<Aabb>> {
    let mut boxes = room(frames * objects)?;
    boxes.resize(frames * objects, Aabb::default());
    for bound in 0..BOUNDS as usize {
        for object in 0..objects {
            for frame in 0..frames {
                let b = &mut boxes[frame * objects + object];
                let corner = if bound < 3 { &mut b.min } else { &mut b.max };
                corner[bound % 3] = element(file)?;
            }
        }
    }
    Ok(boxes)
}

fn element(file: &mut impl Read) -> Result<f32> {
    let mut bytes = [0; 4];
    file.read_exact(&mut bytes).context("it changed while it was read")?;
    Ok(f32::from_le_bytes(bytes))
}

/// Frames of `objects` rows each, without the absent boxes.
fn without_absent(mut boxes: Vec<Aabb>, frames: usize, objects: usize) -> Result<Frames> {
    let absent = |b: &Aabb| b.min.iter().chain(&b.max).all(|x| x.is_nan());
    let mut ends = Vec::with_capacity(frames);
    let mut kept = 0;
    for frame in 0..frames {
        let first = frame * objects;
        let rows = &boxes[first..first + objects];
        let present = rows.iter().rposition(|b| !absent(b)).map_or(0, |last| last + 1);
        if let Some(row) = rows[..present].iter().position(absent) {
            bail!(
                "frame {frame}: row {row} is NaN, and row {} is not; absent boxes stand at the end of a frame",
                present - 1
            );
        }
        boxes.copy_within(first..first + present, kept);
        kept += present;
        ends.push(kept);
    }
    boxes.truncate(kept);
    Ok(Frames { boxes, ends })
}

/// Writes `frames` frames of up to `objects` boxes each as a stream that [`read_frames`] reads, through [`write_atomically`].
///
/// `each` calls what it is given once for each frame. Only one of them need be in memory at a time.
///
/// # Errors
/// Names the file. Nothing is left half-written.
pub(crate) fn write_frames(
    path: &Path,
    frames: usize,
    objects: usize,
    each: impl FnOnce(&mut dyn FnMut(&[Aabb]) -> Result<()>) -> Result<()>,
) -> Result<()> {
    write_atomically(path, |out| {
        let shape = vec![frames as u64, objects as u64, BOUNDS];
        Header { descr: "<f4".to_owned(), fortran_order: false, shape }.write(out)?;
        each(&mut |boxes| {
            for b in boxes {
                b.min.iter().chain(&b.max).try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
            }
            let absent = [f32::NAN.to_le_bytes(); BOUNDS as usize];
            (boxes.len()..objects).try_for_each(|_| out.write_all(absent.as_flattened()))?;
            Ok(())
        })
    })
}

/// Writes pairs as a `.npy` file of uint32, of shape `m x 2`, through [`write_atomically`].
///
/// # Errors
/// Names the file. Nothing is left half-written.
pub(crate) fn write_pairs(path: &Path, pairs: &[(u32, u32)]) -> Result<()> {
    write_atomically(path, |out| {
        let mut members = Vec::new();
        members.try_reserve_exact(pairs.len() * 2).context("the pairs don't fit into memory a second time")?;
        members.extend(pairs.iter().flat_map(|&(first, second)| [first, second]));
        ArrayView2::from_shape((pairs.len(), 2), &members)?.write_npy(out)?;
        Ok(())
    })
}

#[cfg(test)]
mod tests;

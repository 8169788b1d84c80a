//! Reading a stream of frames.

use std::fs::{self, File};
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

use super::error::{FramesError, NpyError};
use super::header::Header;
use super::{BOUNDS, Frames};
use sapwise::Aabb;

/// Limit on empty frames: they take no room in a file, but each takes time and memory.
const MOST_EMPTY_FRAMES: u64 = 1_000_000;

impl Frames {
    /// Reads a `.npy` file of little-endian float32 of shape `n x 6` (one frame) or `frames x n x 6`, in C or Fortran
    /// order. A row is a box: lowest x, y and z, then highest x, y and z.
    ///
    /// In the second shape, rows of NaN at the end of a frame are absent boxes. [`Frames::check`] looks at the boxes
    /// themselves.
    ///
    /// # Errors
    /// Names the file and its defect. Allocates for what the file holds, never for what its header claims.
    pub fn read(path: &Path) -> Result<Self, FramesError> {
        let frames = || {
            let found = fs::metadata(path)?;
            if !found.is_file() {
                return Err(NpyError::NotAFile);
            }
            Self::parse(BufReader::with_capacity(1 << 16, File::open(path)?), found.len())
        };
        frames().map_err(|source| FramesError { path: path.to_owned(), source })
    }

    /// Reads the same from any source of `length` bytes.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(mut file: impl Read, length: u64) -> Result<Self, NpyError> {
        if length == 0 {
            return Err(NpyError::Empty);
        }
        let (Header { descr, fortran_order, shape }, taken) = Header::read(&mut file)?;
        let held = length.saturating_sub(taken);
        if descr != "<f4" {
            return Err(NpyError::Elements(descr));
        }
        let (frames, objects) = match shape[..] {
            [objects, BOUNDS] => (1, objects),
            [frames, objects, BOUNDS] => (frames, objects),
            _ => return Err(NpyError::Shape(shape)),
        };
        let single = shape.len() == 2;
        // Beside an axis of length 0 the size of the file limits nothing.
        let numbered = |count: u64| u32::try_from(count).ok().map(|count| count as usize);
        let (Some(frames), Some(objects)) = (numbered(frames), numbered(objects)) else {
            return Err(NpyError::TooLarge { shape, limit: "can be numbered" });
        };
        if objects == 0 && frames as u64 > MOST_EMPTY_FRAMES {
            return Err(NpyError::EmptyFrames(frames as u64));
        }
        let count = frames.checked_mul(objects);
        let Some(bytes) = count.and_then(|boxes| (boxes as u64).checked_mul(4 * BOUNDS)) else {
            return Err(NpyError::TooLarge { shape, limit: "any file holds" });
        };
        if held < bytes {
            return Err(NpyError::Truncated { missing: bytes - held, bytes });
        }
        if held > bytes {
            return Err(NpyError::Trailing { extra: held - bytes, bytes });
        }
        let boxes = boxes(&mut file, fortran_order, frames, objects)?;
        // Only a stream of several frames needs absent boxes: in one frame a row of NaN is a mistake.
        if single {
            return Ok(Frames { ends: vec![boxes.len()], boxes });
        }
        without_absent(boxes, frames, objects)
    }
}

/// Reads the boxes of all frames, whose bounds stand in this order.
fn boxes(file: &mut impl Read, fortran_order: bool, frames: usize, objects: usize) -> Result<Vec<Aabb>, NpyError> {
    let mut boxes: Vec<Aabb> = Vec::new();
    boxes.try_reserve_exact(frames * objects)?;
    boxes.resize(frames * objects, Aabb::default());
    let bounds = BOUNDS as usize;
    let [outer, inner] = if fortran_order { [bounds, frames] } else { [frames, bounds] };
    for first in 0..outer {
        for object in 0..objects {
            for last in 0..inner {
                let [frame, bound] = if fortran_order { [last, first] } else { [first, last] };
                let b = &mut boxes[frame * objects + object];
                let corner = if bound < 3 { &mut b.min } else { &mut b.max };
                let mut bytes = [0; 4];
                file.read_exact(&mut bytes)
                    .map_err(|e| if e.kind() == ErrorKind::UnexpectedEof { NpyError::Changed } else { e.into() })?;
                corner[bound % 3] = f32::from_le_bytes(bytes);
            }
        }
    }
    Ok(boxes)
}

/// Returns frames of `objects` rows each without the absent boxes.
fn without_absent(mut boxes: Vec<Aabb>, frames: usize, objects: usize) -> Result<Frames, NpyError> {
    let absent = |b: &Aabb| b.min.iter().chain(&b.max).all(|x| x.is_nan());
    let mut ends = Vec::with_capacity(frames);
    let mut kept = 0;
    for frame in 0..frames {
        let first = frame * objects;
        let rows = &boxes[first..first + objects];
        let present = rows.iter().rposition(|b| !absent(b)).map_or(0, |last| last + 1);
        if let Some(row) = rows[..present].iter().position(absent) {
            return Err(NpyError::AbsentInside { frame, row, last: present - 1 });
        }
        boxes.copy_within(first..first + present, kept);
        kept += present;
        ends.push(kept);
    }
    boxes.truncate(kept);
    Ok(Frames { boxes, ends })
}

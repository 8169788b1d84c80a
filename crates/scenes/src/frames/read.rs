//! Reading a stream of frames.

use std::fs::{self, File};
use std::io::{self, BufReader, Read};
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
        let mut counted = Counted { file: &mut file, bytes: 0 };
        let Header { descr, fortran_order, shape } = Header::read(&mut counted)?;
        let held = length.saturating_sub(counted.bytes);
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
        let Some((count, bytes)) = count.and_then(|boxes| Some((boxes, (boxes as u64).checked_mul(4 * BOUNDS)?)))
        else {
            return Err(NpyError::TooLarge { shape, limit: "any file holds" });
        };
        if held < bytes {
            return Err(NpyError::Truncated { missing: bytes - held, bytes });
        }
        if held > bytes {
            return Err(NpyError::Trailing { extra: held - bytes, bytes });
        }
        let boxes =
            if fortran_order { in_fortran_order(&mut file, frames, objects)? } else { in_c_order(&mut file, count)? };
        // Only a stream of several frames needs absent boxes: in one frame a row of NaN is a mistake.
        if single {
            return Ok(Frames { ends: vec![boxes.len()], boxes });
        }
        without_absent(boxes, frames, objects)
    }
}

/// A reader that counts its bytes.
struct Counted<'a, R> {
    file: &'a mut R,
    bytes: u64,
}

impl<R: Read> Read for Counted<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read(buffer)?;
        self.bytes += read as u64;
        Ok(read)
    }
}

fn room(boxes: usize) -> Result<Vec<Aabb>, NpyError> {
    let mut room = Vec::new();
    room.try_reserve_exact(boxes)?;
    Ok(room)
}

fn in_c_order(file: &mut impl Read, count: usize) -> Result<Vec<Aabb>, NpyError> {
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

fn in_fortran_order(file: &mut impl Read, frames: usize, objects: usize) -> Result<Vec<Aabb>, NpyError> {
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

fn element(file: &mut impl Read) -> Result<f32, NpyError> {
    let mut bytes = [0; 4];
    file.read_exact(&mut bytes)
        .map_err(|e| if e.kind() == io::ErrorKind::UnexpectedEof { NpyError::Changed } else { e.into() })?;
    Ok(f32::from_le_bytes(bytes))
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

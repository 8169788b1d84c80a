//! Boxes of many frames as numpy reads them.

use sapwise::Aabb;
use std::io::{self, Write};

/// The boxes of a course of frames, to be written as one array.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    boxes: Vec<Aabb>,
    /// Where each frame ends among them.
    ends: Vec<usize>,
}

impl Recording {
    /// Adds a frame.
    pub fn push(&mut self, boxes: &[Aabb]) {
        self.boxes.extend_from_slice(boxes);
        self.ends.push(self.boxes.len());
    }

    /// The boxes of each frame in turn.
    pub fn frames(&self) -> impl Iterator<Item = &[Aabb]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.boxes[start..end])
    }

    /// The most boxes of any frame.
    #[must_use]
    pub fn most_boxes(&self) -> usize {
        self.frames().map(<[Aabb]>::len).max().unwrap_or(0)
    }

    /// Writes a `.npy` array of little-endian float32, of shape frames x most boxes x 6: lowest x, y and z, then
    /// highest x, y and z, in the unit of length of the boxes. A frame with fewer boxes ends in rows of six NaN.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_npy(&self, out: &mut impl Write) -> io::Result<()> {
        let most = self.most_boxes();
        let shape = format!("({}, {most}, 6)", self.ends.len());
        let dict = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
        // The data begin at a multiple of 64 bytes: after ten bytes of prefix, the text, blanks and a line feed.
        let length = (10 + dict.len() + 1).next_multiple_of(64) - 10;
        out.write_all(b"\x93NUMPY\x01\x00")?;
        out.write_all(&(length as u16).to_le_bytes())?;
        writeln!(out, "{dict:width$}", width = length - 1)?;
        for frame in self.frames() {
            for b in frame {
                b.min.iter().chain(&b.max).try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
            }
            for _ in frame.len() * 6..most * 6 {
                out.write_all(&f32::NAN.to_le_bytes())?;
            }
        }
        Ok(())
    }
}

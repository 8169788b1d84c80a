//! The header of a `.npy` file.
//!
//! Format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>. Parsed here and not by
//! ndarray-npy 0.9, which panics on a shape such as `(0, 2**40, 2**40)` and runs out of stack on a header of ten
//! thousand brackets.

use std::io::{self, Read, Write};

use super::error::NpyError;

/// The first bytes of every file.
const MAGIC: &[u8] = b"\x93NUMPY";

/// The description of the data that follow.
#[derive(Debug, PartialEq)]
pub(super) struct Header {
    /// Type of the elements in numpy's notation, such as `<f4`.
    pub(super) descr: String,
    /// Whether the first index varies fastest.
    pub(super) fortran_order: bool,
    /// Length of each axis, as claimed.
    pub(super) shape: Vec<u64>,
}

impl Header {
    /// Reads the header at the start of a file and nothing after it. Returns the number of its bytes too.
    pub(super) fn read(file: &mut impl Read) -> Result<(Self, u64), NpyError> {
        let mut magic = Vec::new();
        file.take(6).read_to_end(&mut magic)?;
        if magic != MAGIC {
            return Err(if magic.is_empty() { NpyError::Empty } else { NpyError::NotNpy });
        }
        let (before, length) = match bytes(file)? {
            [1, _] => (10, u64::from(u16::from_le_bytes(bytes(file)?))),
            [2 | 3, _] => (12, u64::from(u32::from_le_bytes(bytes(file)?))),
            [other, _] => return Err(NpyError::Version(other)),
        };
        let mut header = Vec::new();
        file.take(length).read_to_end(&mut header)?;
        if header.len() as u64 != length {
            return Err(NpyError::CutHeader);
        }
        let text = str::from_utf8(&header).map_err(|e| NpyError::Header(format!("it is no text: {e}")))?;
        Ok((Self::parse(text).map_err(NpyError::Header)?, before + length))
    }

    /// Writes the header of a file whose data begin at a multiple of 64 bytes, as numpy does. The shape has two axes
    /// or more.
    pub(super) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let axes: Vec<String> = self.shape.iter().map(u64::to_string).collect();
        let order = if self.fortran_order { "True" } else { "False" };
        let descr = &self.descr;
        let dict = format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': ({}), }}", axes.join(", "));
        // Magic, version and length before the text, and a line end after it.
        let used = MAGIC.len() + 4 + dict.len() + 1;
        let text = format!("{dict}{}\n", " ".repeat(used.next_multiple_of(64) - used));
        out.write_all(MAGIC)?;
        out.write_all(&[1, 0])?;
        out.write_all(&u16::try_from(text.len()).map_err(io::Error::other)?.to_le_bytes())?;
        out.write_all(text.as_bytes())
    }

    /// Reads `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 6), }` with the keys in any order.
    fn parse(text: &str) -> Result<Self, String> {
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        let mut rest = after(text, '{')?;
        while !rest.starts_with('}') {
            let (key, value) = quoted(rest)?;
            let value = after(value, ':')?;
            rest = match key {
                "descr" if value.starts_with(['\'', '"']) => {
                    let (name, rest) = quoted(value)?;
                    descr = Some(name.to_owned());
                    rest
                }
                "descr" => return Err("its elements are records, where plain float32 is needed".to_owned()),
                "fortran_order" => {
                    let (flag, length) = if value.starts_with("True") { (true, 4) } else { (false, 5) };
                    if !flag && !value.starts_with("False") {
                        return Err("fortran_order is neither True nor False".to_owned());
                    }
                    fortran_order = Some(flag);
                    value[length..].trim_start()
                }
                "shape" => {
                    let (axes, rest) = after(value, '(')?.split_once(')').ok_or("no ) after the shape")?;
                    // Python 2 wrote an L after long integers; a comma may follow the last.
                    let axes =
                        axes.split(',').map(|axis| axis.trim().trim_end_matches('L')).filter(|axis| !axis.is_empty());
                    let axes: Result<Vec<u64>, _> = axes.map(str::parse).collect();
                    shape = Some(axes.map_err(|e| format!("the shape holds something other than lengths: {e}"))?);
                    rest.trim_start()
                }
                other => return Err(format!("it has an unknown key {other:?}")),
            };
            rest = match rest.strip_prefix(',') {
                Some(next) => next.trim_start(),
                None => rest,
            };
        }
        if !rest[1..].trim().is_empty() {
            return Err("something follows the closing brace".to_owned());
        }
        let missing = |key| move || format!("it has no {key}");
        Ok(Self {
            descr: descr.ok_or_else(missing("descr"))?,
            fortran_order: fortran_order.ok_or_else(missing("fortran_order"))?,
            shape: shape.ok_or_else(missing("shape"))?,
        })
    }
}

fn bytes<const N: usize>(file: &mut impl Read) -> Result<[u8; N], NpyError> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)
        .map_err(|e| if e.kind() == io::ErrorKind::UnexpectedEof { NpyError::CutHeader } else { e.into() })?;
    Ok(bytes)
}

/// Returns the text after the mark that it must begin with, without blanks.
fn after(text: &str, mark: char) -> Result<&str, String> {
    let rest = text.trim_start().strip_prefix(mark).ok_or_else(|| format!("no {mark} where one is due"))?;
    Ok(rest.trim_start())
}

/// Returns the quoted text that `text` must begin with, and the rest.
fn quoted(text: &str) -> Result<(&str, &str), String> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"')).ok_or("no quoted text where one is due")?;
    let (inside, rest) = text[1..].split_once(quote).ok_or("a quotation mark is missing")?;
    Ok((inside, rest.trim_start()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spellings_of_numpy_are_read() {
        let header =
            |fortran_order, shape: &[u64]| Header { descr: "<f4".into(), fortran_order, shape: shape.to_vec() };
        let read = |text| Header::parse(text).unwrap();
        assert_eq!(read("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 6), }  \n"), header(false, &[3, 6]));
        assert_eq!(read("{\"shape\":(7L,),\"descr\":\"<f4\",\"fortran_order\":True}"), header(true, &[7]));
        assert_eq!(read("{'descr': '<f4', 'fortran_order': False, 'shape': ()}"), header(false, &[]));
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_read_or_refused() {
        let mut file = b"\x93NUMPY\x01\x00\x3a\x00{'descr': '<f4', 'fortran_order': False, 'shape': (3, 6), }".to_vec();
        for length in 0..file.len() {
            let cut = Header::read(&mut &file[..length]);
            assert!(cut.is_err() || length >= 68, "{length}: {cut:?}");
        }
        for at in 0..file.len() {
            for byte in 0..=255 {
                let old = std::mem::replace(&mut file[at], byte);
                // The result may be anything but a panic.
                let _ = Header::read(&mut &file[..]);
                file[at] = old;
            }
        }
    }

    #[test]
    fn deep_brackets_and_huge_lengths_are_refused() {
        for text in ["(".repeat(60_000), "{".repeat(60_000), format!("{{'shape': ({}", "(".repeat(60_000))] {
            assert!(Header::parse(&text).is_err());
        }
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999, 6), }";
        assert!(Header::parse(text).is_err());
        assert!(Header::read(&mut &b"\x93NUMPY\x02\x00\xff\xff\xff\xff{"[..]).is_err());
    }
}

//! The header of a `.npy` file.
//!
//! Format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>. Parsed here and not by ndarray-npy 0.9,
//! which panics on a shape such as `(0, 2**40, 2**40)` and runs out of stack on a header of ten thousand brackets.

use anyhow::{Context, Result, bail, ensure};

/// What a header says of the data that follow it.
#[derive(Debug, PartialEq)]
pub(super) struct Header {
    /// Type of the elements as numpy writes it, such as `<f4`.
    pub(super) descr: String,
    /// Whether the first index runs fastest.
    pub(super) fortran_order: bool,
    /// Length of each axis, as claimed.
    pub(super) shape: Vec<u64>,
}

impl Header {
    /// The header at the beginning of `file`, and the bytes after it.
    pub(super) fn split(file: &[u8]) -> Result<(Self, &[u8])> {
        ensure!(!file.is_empty(), "the file is empty");
        let Some(rest) = file.strip_prefix(b"\x93NUMPY") else {
            bail!("it is no .npy file: the first bytes aren't \\x93NUMPY");
        };
        let truncated = "the file ends within its header";
        let (version, rest) = rest.split_first_chunk::<2>().context(truncated)?;
        let (length, rest) = match version[0] {
            1 => rest.split_first_chunk().map(|(length, rest)| (u32::from(u16::from_le_bytes(*length)), rest)),
            2 | 3 => rest.split_first_chunk().map(|(length, rest)| (u32::from_le_bytes(*length), rest)),
            other => bail!("version {other} of the .npy format is unknown"),
        }
        .context(truncated)?;
        let (header, data) = rest.split_at_checked(usize::try_from(length)?).context(truncated)?;
        let text = str::from_utf8(header).context("the header is no text")?;
        Ok((Self::parse(text).context("the header is malformed")?, data))
    }

    /// Reads `{'descr': '<f4', 'fortran_order': False, 'shape': (3, 6), }` with the keys in any order.
    fn parse(text: &str) -> Result<Self> {
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
                "descr" => bail!("its elements are records, where plain float32 is needed"),
                "fortran_order" => {
                    let (flag, length) = if value.starts_with("True") { (true, 4) } else { (false, 5) };
                    ensure!(flag || value.starts_with("False"), "fortran_order is neither True nor False");
                    fortran_order = Some(flag);
                    value[length..].trim_start()
                }
                "shape" => {
                    let (axes, rest) = after(value, '(')?.split_once(')').context("no ) after the shape")?;
                    // Python 2 wrote an L after long integers; a comma may follow the last.
                    let axes = axes.split(',').map(|axis| axis.trim().trim_end_matches('L')).filter(|axis| !axis.is_empty());
                    let axes: Result<Vec<u64>, _> = axes.map(str::parse).collect();
                    shape = Some(axes.context("the shape holds something other than lengths")?);
                    rest.trim_start()
                }
                other => bail!("it has an unknown key {other:?}"),
            };
            rest = match rest.strip_prefix(',') {
                Some(next) => next.trim_start(),
                None => rest,
            };
        }
        ensure!(rest[1..].trim().is_empty(), "something follows the closing brace");
        let missing = |key| move || format!("it has no {key}");
        Ok(Self {
            descr: descr.with_context(missing("descr"))?,
            fortran_order: fortran_order.with_context(missing("fortran_order"))?,
            shape: shape.with_context(missing("shape"))?,
        })
    }
}

/// The text after the mark that it must begin with, blanks left out.
fn after(text: &str, mark: char) -> Result<&str> {
    let rest = text.trim_start().strip_prefix(mark).with_context(|| format!("no {mark} where one is due"))?;
    Ok(rest.trim_start())
}

/// The quoted text that `text` must begin with, and what follows it.
fn quoted(text: &str) -> Result<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"')).context("no quoted text where one is due")?;
    let (inside, rest) = text[1..].split_once(quote).context("a quotation mark is missing")?;
    Ok((inside, rest.trim_start()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spellings_of_numpy_are_read() {
        let header = |fortran_order, shape: &[u64]| Header { descr: "<f4".into(), fortran_order, shape: shape.to_vec() };
        let read = |text| Header::parse(text).unwrap();
        assert_eq!(read("{'descr': '<f4', 'fortran_order': False, 'shape': (3, 6), }  \n"), header(false, &[3, 6]));
        assert_eq!(read("{\"shape\":(7L,),\"descr\":\"<f4\",\"fortran_order\":True}"), header(true, &[7]));
        assert_eq!(read("{'descr': '<f4', 'fortran_order': False, 'shape': ()}"), header(false, &[]));
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_read_or_refused() {
        let mut file = b"\x93NUMPY\x01\x00\x3a\x00{'descr': '<f4', 'fortran_order': False, 'shape': (3, 6), }".to_vec();
        for length in 0..file.len() {
            let cut = Header::split(&file[..length]);
            assert!(cut.is_err() || length >= 68, "{length}: {cut:?}");
        }
        for at in 0..file.len() {
            for byte in 0..=255 {
                let old = std::mem::replace(&mut file[at], byte);
                // Whatever comes of it, it is no panic.
                let _ = Header::split(&file);
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
        assert!(Header::split(b"\x93NUMPY\x02\x00\xff\xff\xff\xff{").is_err());
    }
}

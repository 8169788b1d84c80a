//! Boxes and pairs of a user, as numpy reads and writes them.

mod header;

use std::fs;
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

/// Frames with the same number of boxes each.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frames {
    boxes: Vec<Aabb>,
    frames: usize,
    objects: usize,
}

impl Frames {
    /// How many frames there are.
    pub(crate) fn len(&self) -> usize {
        self.frames
    }

    /// How many boxes each frame has.
    pub(crate) fn objects(&self) -> usize {
        self.objects
    }

    /// The boxes of each frame in turn.
    pub(crate) fn iter(&self) -> impl ExactSizeIterator<Item = &[Aabb]> {
        (0..self.frames).map(|frame| &self.boxes[frame * self.objects..][..self.objects])
    }
}

/// Reads a `.npy` file of little-endian float32, of shape `n x 6` (one frame) or `frames x n x 6`, in C or Fortran order.
///
/// The boxes themselves aren't checked: the algorithms refuse NaN and inverted ones, and say which.
///
/// # Errors
/// Names the file, and what is wrong with it. Memory is taken for what the file holds, never for what its header claims.
pub(crate) fn read_frames(path: &Path) -> Result<Frames> {
    let frames = || {
        // A pipe or a device has no size, and some never end.
        ensure!(fs::metadata(path)?.is_file(), "it is no regular file");
        parse(&fs::read(path)?)
    };
    frames().with_context(|| format!("can't read boxes from {}", path.display()))
}

fn parse(file: &[u8]) -> Result<Frames> {
    let (header, data) = Header::split(file)?;
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
    let held = data.len() as u64;
    ensure!(held >= bytes, "it is truncated: {} bytes of {bytes} are missing", bytes - held);
    ensure!(held == bytes, "{} bytes follow its {bytes} bytes of data", held - bytes);

    let (frames, objects) = (usize::try_from(frames)?, usize::try_from(objects)?);
    let mut boxes = Vec::new();
    boxes.try_reserve_exact(frames * objects).context("its boxes don't fit into memory")?;
    // Distance in the file between two elements that are neighbours along each axis.
    let (by_frame, by_object, by_bound) =
        if header.fortran_order { (1, frames, frames * objects) } else { (objects * 6, 6, 1) };
    let (elements, _) = data.as_chunks::<4>();
    for frame in 0..if objects == 0 { 0 } else { frames } {
        for object in 0..objects {
            let first = frame * by_frame + object * by_object;
            let bound = |k: usize| f32::from_le_bytes(elements[first + k * by_bound]);
            boxes.push(Aabb::new([bound(0), bound(1), bound(2)], [bound(3), bound(4), bound(5)]));
        }
    }
    Ok(Frames { boxes, frames, objects })
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
mod tests {
    use super::*;
    use ndarray::{Array2, Array3, ShapeBuilder};
    use std::path::PathBuf;

    /// A file with version 1 of the header around `dict`, padded as numpy does.
    fn npy(dict: &str, data: &[u8]) -> Vec<u8> {
        let padding = 64 - (10 + dict.len() + 1) % 64;
        let length = u16::try_from(dict.len() + padding + 1).unwrap();
        let prefix = [b"\x93NUMPY\x01\x00", &length.to_le_bytes()[..]].concat();
        [&prefix, dict.as_bytes(), &vec![b' '; padding], b"\n", data].concat()
    }

    fn dict(descr: &str, order: &str, shape: &str) -> String {
        format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}")
    }

    fn floats(count: u8) -> Vec<u8> {
        (0..count).flat_map(|v| f32::from(v).to_le_bytes()).collect()
    }

    fn stored(folder: &tempfile::TempDir, bytes: &[u8]) -> PathBuf {
        let path = folder.path().join("boxes.npy");
        fs::write(&path, bytes).unwrap();
        path
    }

    #[test]
    fn one_frame_and_several_are_read_in_either_order() {
        let folder = tempfile::tempdir().unwrap();
        let one = read_frames(&stored(&folder, &npy(&dict("<f4", "False", "(2, 6)"), &floats(12)))).unwrap();
        assert_eq!((one.len(), one.objects()), (1, 2));
        let first: Vec<&[Aabb]> = one.iter().collect();
        assert_eq!(first[0][1], Aabb::new([6.0, 7.0, 8.0], [9.0, 10.0, 11.0]));

        let three = read_frames(&stored(&folder, &npy(&dict("<f4", "False", "(3, 2, 6)"), &floats(36)))).unwrap();
        assert_eq!((three.len(), three.objects()), (3, 2));
        assert_eq!(three.iter().nth(2).unwrap()[1].min[0], 30.0);

        // The same numbers, written by another implementation of the format in the order of Fortran.
        for shape in [(3, 2, 6), (1, 6, 6)] {
            let c = Array3::from_shape_fn(shape, |(f, i, k)| (f * shape.1 * 6 + i * 6 + k) as f32);
            let mut fortran = Array3::zeros(shape.f());
            fortran.assign(&c);
            let mut bytes = [Vec::new(), Vec::new()];
            c.write_npy(&mut bytes[0]).unwrap();
            fortran.write_npy(&mut bytes[1]).unwrap();
            let [c, fortran] = bytes.map(|bytes| read_frames(&stored(&folder, &bytes)).unwrap());
            assert_eq!(c, fortran);
        }
        let flat = Array2::from_shape_fn((4, 6).f(), |(i, k)| (i * 6 + k) as f32);
        let mut bytes = Vec::new();
        flat.write_npy(&mut bytes).unwrap();
        let flat = read_frames(&stored(&folder, &bytes)).unwrap();
        assert_eq!(flat.iter().next().unwrap()[3], Aabb::new([18.0, 19.0, 20.0], [21.0, 22.0, 23.0]));
    }

    #[test]
    fn no_boxes_and_no_frames_are_legal() {
        let folder = tempfile::tempdir().unwrap();
        for (shape, frames, objects) in [("(0, 6)", 1, 0), ("(0, 5, 6)", 0, 5), ("(4, 0, 6)", 4, 0)] {
            for order in ["False", "True"] {
                let read = read_frames(&stored(&folder, &npy(&dict("<f4", order, shape), &[]))).unwrap();
                assert_eq!((read.len(), read.objects()), (frames, objects));
                assert!(read.iter().all(<[Aabb]>::is_empty));
            }
        }
    }

    #[test]
    fn data_at_odd_addresses_are_read() {
        let dict = dict("<f4", "False", "(1, 6)");
        for blanks in 0..4 {
            let length = u16::try_from(dict.len() + blanks).unwrap().to_le_bytes();
            let header = [dict.as_bytes(), &vec![b' '; blanks]].concat();
            let file = [b"\x93NUMPY\x01\x00", &length[..], &header, &floats(6)].concat();
            assert_eq!(parse(&file).unwrap().boxes, [Aabb::new([0.0, 1.0, 2.0], [3.0, 4.0, 5.0])]);
        }
    }

    #[test]
    fn bad_files_are_errors_that_name_the_file_and_the_defect() {
        let folder = tempfile::tempdir().unwrap();
        let cases: [(&[u8], &str); 22] = [
            (b"", "empty"),
            (b"PK\x03\x04 an archive", "no .npy file"),
            (b"\x93NUMPY\x01", "ends within its header"),
            (b"\x93NUMPY\x01\x00\x80\x00{'descr'", "ends within its header"),
            (b"\x93NUMPY\x09\x00\x80\x00{'descr'", "version 9"),
            (&npy("garbage", &[]), "malformed"),
            (&npy("{'descr': '<f4'}", &[]), "no fortran_order"),
            (&npy("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1, 6), }", &floats(6)), "records"),
            (&npy(&dict("<f4", "False", "(2, 6)"), &floats(11)), "truncated: 4 bytes of 48"),
            (&npy(&dict("<f4", "False", "(2, 6)"), &floats(13)), "4 bytes follow"),
            (&npy(&dict(">f4", "False", "(1, 6)"), &floats(6)), "big-endian"),
            (&npy(&dict("<f8", "False", "(1, 6)"), &floats(12)), "<f8, where float32"),
            (&npy(&dict("<i4", "False", "(1, 6)"), &floats(6)), "<i4, where float32"),
            (&npy(&dict("<f4", "False", "(6,)"), &floats(6)), "shape is [6]"),
            (&npy(&dict("<f4", "False", "(2, 3)"), &floats(6)), "shape is [2, 3]"),
            (&npy(&dict("<f4", "False", "(1, 1, 1, 6)"), &floats(6)), "shape is [1, 1, 1, 6]"),
            (&npy(&dict("<f4", "False", "(1000000000000000000, 6)"), &floats(6)), "more than can be numbered"),
            (&npy(&dict("<f4", "False", "(4000000000, 6)"), &floats(6)), "truncated"),
            (&npy(&dict("<f4", "False", "(4000000000, 4000000000, 6)"), &floats(6)), "more than any file holds"),
            (&npy(&dict("<f4", "True", "(0, 9223372036854775807, 6)"), &[]), "more than can be numbered"),
            (&npy(&dict("<f4", "False", "(1000000000000000000, 0, 6)"), &[]), "more than can be numbered"),
            (&npy(&dict("<f4", "False", "(1000001, 0, 6)"), &[]), "1000001 frames without a box"),
        ];
        for (bytes, defect) in cases {
            let path = stored(&folder, bytes);
            let text = format!("{:#}", read_frames(&path).unwrap_err());
            assert!(text.contains(&path.display().to_string()) && text.contains(defect), "{defect}: {text}");
        }
        for path in [folder.path(), &folder.path().join("missing.npy")] {
            let text = format!("{:#}", read_frames(path).unwrap_err());
            assert!(text.contains(&path.display().to_string()), "{text}");
        }
    }

    #[test]
    fn pairs_are_written_as_numpy_writes_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pairs.npy");
        for pairs in [&[][..], &[(0, 1), (2, u32::MAX)]] {
            write_pairs(&path, pairs).unwrap();
            let file = fs::read(&path).unwrap();
            let (header, data) = Header::split(&file).unwrap();
            let shape = vec![pairs.len() as u64, 2];
            assert_eq!(header, Header { descr: "<u4".into(), fortran_order: false, shape });
            let expected: Vec<u8> = pairs.iter().flat_map(|&(a, b)| [a, b]).flat_map(u32::to_le_bytes).collect();
            assert_eq!(data, expected);
            assert!((file.len() - data.len()).is_multiple_of(64));
        }
        let missing = folder.path().join("missing").join("pairs.npy");
        assert!(format!("{:#}", write_pairs(&missing, &[]).unwrap_err()).contains("pairs.npy"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

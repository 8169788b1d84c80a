//! Tests of the files of boxes and pairs.

use super::header::Header;
use super::*;
use ndarray::{Array2, Array3, ShapeBuilder};
use ndarray_npy::WriteNpyExt;
use std::error::Error;
use std::fs;
use std::path::PathBuf;

/// The messages of an error and of what caused it.
fn told(error: &dyn Error) -> String {
    let cause = error.source().map_or_else(String::new, |source| format!(": {}", told(source)));
    format!("{error}{cause}")
}

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
    let one = Frames::read(&stored(&folder, &npy(&dict("<f4", "False", "(2, 6)"), &floats(12)))).unwrap();
    assert_eq!((one.len(), one.objects()), (1, 2));
    let first: Vec<&[Aabb]> = one.iter().collect();
    assert_eq!(first[0][1], Aabb::new([6.0, 7.0, 8.0], [9.0, 10.0, 11.0]));

    let three = Frames::read(&stored(&folder, &npy(&dict("<f4", "False", "(3, 2, 6)"), &floats(36)))).unwrap();
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
        let [c, fortran] = bytes.map(|bytes| Frames::read(&stored(&folder, &bytes)).unwrap());
        assert_eq!(c, fortran);
    }
    let flat = Array2::from_shape_fn((4, 6).f(), |(i, k)| (i * 6 + k) as f32);
    let mut bytes = Vec::new();
    flat.write_npy(&mut bytes).unwrap();
    let flat = Frames::read(&stored(&folder, &bytes)).unwrap();
    assert_eq!(flat.iter().next().unwrap()[3], Aabb::new([18.0, 19.0, 20.0], [21.0, 22.0, 23.0]));
}

#[test]
fn no_boxes_and_no_frames_are_legal() {
    let folder = tempfile::tempdir().unwrap();
    for (shape, frames, objects) in [("(0, 6)", 1, 0), ("(0, 5, 6)", 0, 0), ("(4, 0, 6)", 4, 0)] {
        for order in ["False", "True"] {
            let read = Frames::read(&stored(&folder, &npy(&dict("<f4", order, shape), &[]))).unwrap();
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
        let read = Frames::parse(&file[..], file.len() as u64).unwrap();
        assert_eq!(read.boxes, [Aabb::new([0.0, 1.0, 2.0], [3.0, 4.0, 5.0])]);
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
        let text = told(&Frames::read(&path).unwrap_err());
        assert!(text.contains(&path.display().to_string()) && text.contains(defect), "{defect}: {text}");
    }
    for path in [folder.path(), &folder.path().join("missing.npy")] {
        let text = told(&Frames::read(path).unwrap_err());
        assert!(text.contains(&path.display().to_string()), "{text}");
    }
}

#[test]
fn pairs_are_written_as_numpy_writes_them() {
    for pairs in [&[][..], &[(0, 1), (2, u32::MAX)]] {
        let mut file = Vec::new();
        write_pairs(&mut file, pairs).unwrap();
        let numbers = pairs.iter().flat_map(|&(a, b)| [a, b]).collect();
        let mut expected = Vec::new();
        Array2::from_shape_vec((pairs.len(), 2), numbers).unwrap().write_npy(&mut expected).unwrap();
        assert_eq!(Header::read(&mut &file[..]).unwrap(), Header::read(&mut &expected[..]).unwrap());
        let data = 8 * pairs.len();
        assert_eq!(file[file.len() - data..], expected[expected.len() - data..]);
        assert!((file.len() - data).is_multiple_of(64));
    }
}

/// `objects` boxes, each at a place of its own.
fn scene(frame: usize, objects: usize) -> Vec<Aabb> {
    (0..objects).map(|k| Aabb::cube([k as f32, frame as f32, -0.5], 0.25)).collect()
}

#[test]
fn a_stream_with_a_varying_number_of_boxes_comes_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stream.npy");
    let counts = [3, 0, 5, 1];
    let mut writer = FrameWriter::new(fs::File::create(&path).unwrap(), counts.len(), 5).unwrap();
    for (at, &count) in counts.iter().enumerate() {
        writer.write(&scene(at, count)).unwrap();
    }
    drop(writer.finish().unwrap());
    let read = Frames::read(&path).unwrap();
    assert_eq!((read.len(), read.objects()), (4, 5));
    for (at, &count) in counts.iter().enumerate() {
        assert_eq!(read.frame(at), scene(at, count), "frame {at}");
    }
    assert!(read.frame(4).is_empty());
    assert!(read.check().is_ok());
    let bytes = fs::read(&path).unwrap();
    assert_eq!((bytes.len() - 4 * 5 * 24) % 64, 0);
    // The same stream in the order of Fortran, by another implementation of the format.
    let row =
        |f: usize, i: usize| scene(f, counts[f]).get(i).copied().unwrap_or(Aabb::new([f32::NAN; 3], [f32::NAN; 3]));
    let bound = |b: Aabb, k: usize| if k < 3 { b.min[k] } else { b.max[k - 3] };
    let fortran = Array3::from_shape_fn((4, 5, 6).f(), |(f, i, k)| bound(row(f, i), k));
    let mut bytes = Vec::new();
    fortran.write_npy(&mut bytes).unwrap();
    assert_eq!(Frames::read(&stored(&folder, &bytes)).unwrap(), read);
}

#[test]
fn a_stream_has_as_many_frames_and_boxes_as_were_announced() {
    let mut writer = FrameWriter::new(Vec::new(), 1, 2).unwrap();
    assert!(writer.write(&scene(0, 3)).unwrap_err().to_string().contains("3 boxes in a stream of up to 2"));
    writer.write(&scene(0, 2)).unwrap();
    assert!(writer.write(&[]).is_err());
    let writer = FrameWriter::new(Vec::new(), 2, 0).unwrap();
    assert!(writer.finish().unwrap_err().to_string().contains("2 frames are missing"));
}

#[test]
fn absent_boxes_stand_at_the_end_of_a_frame_only() {
    let folder = tempfile::tempdir().unwrap();
    let [one, nan] = [[1.0_f32; 6], [f32::NAN; 6]];
    let file = |shape: &str, rows: &[[f32; 6]]| {
        let data: Vec<u8> = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        Frames::read(&stored(&folder, &npy(&dict("<f4", "False", shape), &data)))
    };
    let text = told(&file("(2, 3, 6)", &[one, nan, nan, one, nan, one]).unwrap_err());
    assert!(text.contains("frame 1: row 1 is NaN, and row 2 is not"), "{text}");
    // In a file of one frame a row of NaN is a mistake, which the algorithms report, and no absent box.
    let single = file("(2, 6)", &[one, nan]).unwrap();
    assert_eq!(single.objects(), 2);
    let text = single.check().unwrap_err().to_string();
    assert!(text.contains("frame 0") && text.contains("box 1"), "{text}");
    // One bound that is NaN is a defect wherever it stands.
    let mut partly = one;
    partly[4] = f32::NAN;
    let text = file("(1, 3, 6)", &[one, partly, nan]).unwrap().check().unwrap_err().to_string();
    assert!(text.contains("box 1") && text.contains("NaN"), "{text}");
}

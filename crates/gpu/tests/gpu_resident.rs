//! Boxes and pairs that stay on the GPU.

mod common;

use common::gpu::upload;
use common::{METHODS, Random, gpus, naive, naive_filtered};
use sapwise::error::BoxDefect;
use sapwise::internals::Pair;
use sapwise::{Aabb, Error, Filter, Membership};
use sapwise_gpu::{Gpu, Resident, wgpu30 as wgpu};

fn buffer(gpu: &Gpu, boxes: &[Aabb]) -> wgpu::Buffer {
    upload(gpu, boxes, wgpu::BufferUsages::STORAGE)
}

/// Downloads pairs, and sorts them.
fn download(gpu: &Gpu, pairs: &wgpu::Buffer, count: u32) -> Vec<Pair> {
    let words = gpu.read_words(pairs, 2 * u64::from(count)).unwrap();
    let mut pairs: Vec<Pair> = words.chunks(2).map(|p| (p[0], p[1])).collect();
    pairs.sort_unstable();
    pairs
}

#[test]
fn resident_frames_equal_the_oracle() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(21);
    for index in 0..gpus.len() as u32 {
        let gpu = gpus.open(index).unwrap();
        for method in METHODS {
            let mut resident = Resident::new(&gpu, method).unwrap();
            for count in [0, 1, 2, 33, 1000, 2000, 700] {
                let boxes = random.cubes(count, [14.0, 16.0, 12.0], 0.6);
                let on_gpu = buffer(&gpu, &boxes);
                for frame in 0..2 {
                    let pairs = resident.find_pairs(&on_gpu, count as u32).unwrap();
                    let pairs = download(&gpu, pairs.buffer, pairs.count);
                    assert!(pairs == naive(&boxes), "{method} on gpu{index}, {count} boxes, frame {frame}");
                }
            }
            let dense = buffer(&gpu, &[Aabb::cube([1.0; 3], 1.0); 600]);
            assert_eq!(resident.find_pairs(&dense, 600).unwrap().count, 600 * 599 / 2, "{method}: the list grows");
        }
    }
}

#[test]
fn resident_frames_are_filtered() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(23);
    let boxes = random.cubes(900, [9.0, 12.0, 9.0], 0.8);
    let memberships: Vec<Membership> = (0..850).map(|_| random.membership()).collect();
    for index in 0..gpus.len() as u32 {
        let gpu = gpus.open(index).unwrap();
        let on_gpu = buffer(&gpu, &boxes);
        for method in METHODS {
            let mut resident = Resident::new(&gpu, method).unwrap();
            for memberships in [&memberships[..], &[], &memberships[..300]] {
                let filter = Filter::new(memberships.to_vec());
                resident.set_filter((!memberships.is_empty()).then_some(&filter)).unwrap();
                let expected = naive_filtered(&boxes, memberships);
                let pairs = resident.find_pairs(&on_gpu, 900).unwrap();
                assert!(download(&gpu, pairs.buffer, pairs.count) == expected, "{method} on gpu{index}");
                let submitted = resident.submit(&on_gpu, 900).unwrap();
                let counts = gpu.read_words(submitted.counts, 9).unwrap();
                assert_eq!(counts[0] as usize, expected.len(), "{method} on gpu{index}");
                assert!(download(&gpu, submitted.pairs, counts[0]) == expected, "{method} on gpu{index}, submitted");
            }
        }
    }
}

#[test]
fn submitted_frames_leave_pairs_and_counts_on_the_gpu() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(22);
    for index in 0..gpus.len() as u32 {
        let gpu = gpus.open(index).unwrap();
        for method in METHODS {
            let mut resident = Resident::new(&gpu, method).unwrap();
            assert_eq!(resident.last(), None);
            for frame in 0..4 {
                let boxes = random.cubes(800, [14.0, 16.0, 12.0], 0.7);
                let expected = naive(&boxes);
                let count = expected.len() as u32;
                let submitted = resident.submit(&buffer(&gpu, &boxes), 800).unwrap();
                let counts = gpu.read_words(submitted.counts, 9).unwrap();
                assert_eq!(counts[..4], [count, 0, u32::MAX, 0], "{method}, frame {frame}");
                assert_eq!(counts[5..], [count.div_ceil(64), 1, 1, count], "{method}");
                let found = download(&gpu, submitted.pairs, count);
                assert!(found == expected, "{method} on gpu{index}, frame {frame}");
                // The download waited for the previous frame too.
                if frame > 0 {
                    let last = resident.last().unwrap();
                    assert!(last.whole && last.invalid.is_none() && last.pairs > 0, "{last:?}");
                }
            }
            // If the list is too small, the counts say so, and a later frame has a larger one.
            let dense = buffer(&gpu, &[Aabb::cube([1.0; 3], 1.0); 600]);
            let words = |of: &mut Resident| gpu.read_words(of.submit(&dense, 600).unwrap().counts, 9).unwrap();
            let first = words(&mut resident);
            assert!(first[0] == 600 * 599 / 2 && first[8] < first[0], "{method}: {first:?}");
            let second = words(&mut resident);
            let last = resident.last().unwrap();
            assert!(!last.whole && last.pairs == 600 * 599 / 2, "{method}: {last:?}");
            assert_eq!((second[0], second[8]), (600 * 599 / 2, 600 * 599 / 2), "{method}");
            // The counts name an invalid box.
            let mut bad = random.cubes(100, [9.0; 3], 0.5);
            bad[42].max[1] = f32::NAN;
            let on_gpu = buffer(&gpu, &bad);
            let counts = gpu.read_words(resident.submit(&on_gpu, 100).unwrap().counts, 9).unwrap();
            assert_eq!(counts[2], 42 << 1, "{method}");
            let none = resident.submit(&on_gpu, 0).unwrap();
            assert_eq!(gpu.read_words(none.counts, 9).unwrap()[5..], [0, 1, 1, 0], "{method}");
            assert_eq!(resident.last().unwrap().invalid, Some((42, BoxDefect::NotANumber)), "{method}");
        }
    }
    let gpu = gpus.open(0).unwrap();
    let mut brute = Resident::new(&gpu, "brute").unwrap();
    let many = buffer(&gpu, &random.cubes(60_000, [99.0; 3], 0.1));
    assert!(brute.submit(&many, 60_000).unwrap_err().to_string().contains("use bvh"));
}

#[test]
fn wrong_input_is_an_error() {
    let Some(gpus) = gpus() else { return };
    let gpu = gpus.open(0).unwrap();
    let mut resident = Resident::new(&gpu, "grid-sap").unwrap();
    let mut boxes = Random(5).cubes(100, [9.0; 3], 0.5);
    let uniform = upload(&gpu, &boxes, wgpu::BufferUsages::UNIFORM);
    let error = resident.find_pairs(&uniform, 100).unwrap_err().to_string();
    assert!(error.contains("STORAGE"), "{error}");
    let storage = buffer(&gpu, &boxes);
    assert!(resident.find_pairs(&storage, 101).unwrap_err().to_string().contains("2424 bytes"));
    assert_eq!(resident.find_pairs(&storage, 100).unwrap().count as usize, naive(&boxes).len());
    boxes[77] = Aabb::new([1.0; 3], [0.0; 3]);
    let error = resident.find_pairs(&buffer(&gpu, &boxes), 100).unwrap_err();
    assert_eq!(error, Error::InvalidBox { index: 77, defect: BoxDefect::Inverted });
    assert!(matches!(Resident::new(&gpu, "octree"), Err(Error::Unavailable { .. })));
}

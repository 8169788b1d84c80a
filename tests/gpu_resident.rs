//! Boxes and pairs that stay on the GPU.

mod common;

use common::{Random, gpus, naive};
use sapwise::gpu::{Gpu, Resident, wgpu30 as wgpu};
use sapwise::{Aabb, BoxDefect, Error, Pair};

fn buffer(gpu: &Gpu, boxes: &[Aabb], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let size = (size_of_val(boxes) as u64).max(24);
    let descriptor = wgpu::BufferDescriptor {
        label: None,
        size,
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    };
    let buffer = gpu.device().create_buffer(&descriptor);
    let bytes: Vec<u8> = boxes.iter().flat_map(|b| [b.min, b.max]).flatten().flat_map(f32::to_le_bytes).collect();
    gpu.queue().write_buffer(&buffer, 0, &bytes);
    buffer
}

/// The pairs of a frame, brought back for the comparison only.
fn found(gpu: &Gpu, resident: &mut Resident, boxes: &wgpu::Buffer, objects: usize) -> Vec<Pair> {
    let pairs = resident.find_pairs(boxes, objects as u32).unwrap();
    let bytes = u64::from(pairs.count) * 8;
    if bytes == 0 {
        return Vec::new();
    }
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let copy = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: bytes,
        usage,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(pairs.buffer, 0, &copy, 0, bytes);
    let submission = gpu.queue().submit([encoder.finish()]);
    copy.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait(submission).unwrap();
    let view = copy.get_mapped_range(..).unwrap();
    let number = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let mut list: Vec<Pair> = view.chunks(8).map(|p| (number(&p[..4]), number(&p[4..]))).collect();
    list.sort_unstable();
    list
}

#[test]
fn resident_frames_equal_the_oracle() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(21);
    for index in 0..gpus.len() as u32 {
        let gpu = gpus.open(index).unwrap();
        for method in ["brute", "sap", "grid-sap", "bvh"] {
            let mut resident = Resident::new(&gpu, method).unwrap();
            for count in [0, 1, 2, 33, 1000, 5000, 700] {
                let boxes = random.cubes(count, [14.0, 16.0, 12.0], 0.6);
                let on_gpu = buffer(&gpu, &boxes, wgpu::BufferUsages::STORAGE);
                for frame in 0..2 {
                    let pairs = found(&gpu, &mut resident, &on_gpu, count);
                    assert!(pairs == naive(&boxes), "{method} on gpu{index}, {count} boxes, frame {frame}");
                }
            }
            let dense = vec![Aabb::cube([1.0; 3], 1.0); 600];
            let pairs = found(&gpu, &mut resident, &buffer(&gpu, &dense, wgpu::BufferUsages::STORAGE), 600);
            assert_eq!(pairs.len(), 600 * 599 / 2, "{method}: more pairs than there was room for");
        }
    }
}

/// What stands in a buffer of ours, as words.
fn words(gpu: &Gpu, from: &wgpu::Buffer, count: u64) -> Vec<u32> {
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let copy = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: count * 4,
        usage,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(from, 0, &copy, 0, count * 4);
    let submission = gpu.queue().submit([encoder.finish()]);
    copy.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait(submission).unwrap();
    let view = copy.get_mapped_range(..).unwrap();
    view.chunks(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[test]
fn frames_that_nobody_waits_for_leave_their_number_on_the_gpu() {
    let Some(gpus) = gpus() else { return };
    let mut random = Random(22);
    for index in 0..gpus.len() as u32 {
        let gpu = gpus.open(index).unwrap();
        for method in ["brute", "sap", "grid-sap", "bvh"] {
            let mut resident = Resident::new(&gpu, method).unwrap();
            assert_eq!(resident.last(), None);
            for frame in 0..4 {
                let boxes = random.cubes(800, [14.0, 16.0, 12.0], 0.7);
                let expected = naive(&boxes);
                let submitted = resident.submit(&buffer(&gpu, &boxes, wgpu::BufferUsages::STORAGE), 800).unwrap();
                let counts = words(&gpu, submitted.counts, 9);
                let count = expected.len() as u32;
                assert_eq!(
                    (counts[0], counts[1], counts[2], counts[3]),
                    (count, 0, u32::MAX, 0),
                    "{method}, frame {frame}"
                );
                assert_eq!((counts[5], counts[6], counts[7], counts[8]), (count.div_ceil(64), 1, 1, count), "{method}");
                let found = words(&gpu, submitted.pairs, 2 * u64::from(count));
                let mut found: Vec<Pair> = found.chunks(2).map(|p| (p[0], p[1])).collect();
                found.sort_unstable();
                assert!(found == expected, "{method} on gpu{index}, frame {frame}");
                // The waiting above let the frame come back.
                if frame > 0 {
                    let last = resident.last().unwrap();
                    assert!(last.whole && last.invalid.is_none() && last.pairs > 0, "{last:?}");
                }
            }
            // More pairs than there is room for are told of, and fit later.
            let dense = buffer(&gpu, &[Aabb::cube([1.0; 3], 1.0); 600], wgpu::BufferUsages::STORAGE);
            let counts = |resident: &mut Resident| words(&gpu, resident.submit(&dense, 600).unwrap().counts, 9);
            let first = counts(&mut resident);
            assert!(first[0] == 600 * 599 / 2 && first[8] < first[0], "{method}: {first:?}");
            let second = counts(&mut resident);
            let told = resident.last().unwrap();
            assert!(!told.whole && told.pairs == 600 * 599 / 2, "{method}: {told:?}");
            assert_eq!((second[0], second[8]), (600 * 599 / 2, 600 * 599 / 2), "{method}");
            // So are boxes that are none.
            let mut bad = random.cubes(100, [9.0; 3], 0.5);
            bad[42].max[1] = f32::NAN;
            let on_gpu = buffer(&gpu, &bad, wgpu::BufferUsages::STORAGE);
            assert_eq!(words(&gpu, resident.submit(&on_gpu, 100).unwrap().counts, 9)[2], 42 << 1, "{method}");
            let none = resident.submit(&on_gpu, 0).unwrap();
            assert_eq!(words(&gpu, none.counts, 9)[5..], [0, 1, 1, 0], "{method}");
            assert_eq!(resident.last().unwrap().invalid, Some((42, BoxDefect::NotANumber)), "{method}");
        }
    }
    let gpu = gpus.open(0).unwrap();
    let mut brute = Resident::new(&gpu, "brute").unwrap();
    let many = buffer(&gpu, &random.cubes(60_000, [99.0; 3], 0.1), wgpu::BufferUsages::STORAGE);
    assert!(brute.submit(&many, 60_000).unwrap_err().to_string().contains("use bvh"));
}

#[test]
fn wrong_input_is_an_error() {
    let Some(gpus) = gpus() else { return };
    let gpu = gpus.open(0).unwrap();
    let mut resident = Resident::new(&gpu, "grid-sap").unwrap();
    let mut boxes = Random(5).cubes(100, [9.0; 3], 0.5);
    let uniform = buffer(&gpu, &boxes, wgpu::BufferUsages::UNIFORM);
    let error = resident.find_pairs(&uniform, 100).unwrap_err().to_string();
    assert!(error.contains("STORAGE"), "{error}");
    let storage = buffer(&gpu, &boxes, wgpu::BufferUsages::STORAGE);
    assert!(resident.find_pairs(&storage, 101).unwrap_err().to_string().contains("2424 bytes"));
    assert_eq!(resident.find_pairs(&storage, 100).unwrap().count as usize, naive(&boxes).len());
    boxes[77] = Aabb::new([1.0; 3], [0.0; 3]);
    let error = resident.find_pairs(&buffer(&gpu, &boxes, wgpu::BufferUsages::STORAGE), 100).unwrap_err();
    assert_eq!(error, Error::InvalidBox { index: 77, defect: BoxDefect::Inverted });
    assert!(matches!(Resident::new(&gpu, "octree"), Err(Error::Unavailable { .. })));
}

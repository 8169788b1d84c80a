#[path = "../../../../tests/common/mod.rs"]
mod common;

use super::{Engine, Pending};
use crate::kernel::dispatched;
use crate::{Failure, Gpus, Header, Look, Output, Params, Storage, first_for_tests};
use bytemuck::{bytes_of, cast_slice};
use common::naive;
use pollster::block_on;
use sapwise::algorithm::FramePlan;
use sapwise::error::GpuErrorKind;
use sapwise::internals::{SampledBoxes, Workers};
use sapwise::{Aabb, Filter, Membership, PairOrder, Pairs};
use sapwise_scenes::Scenario;
use wgpu::util::DeviceExt;

const METHODS: [&str; 4] = ["brute", "sap", "grid-sap", "bvh"];
const SORTING: [&str; 3] = ["sap", "grid-sap", "bvh"];

/// Returns boxes of all sizes, each among many: every row has more candidates than the budgets below.
fn crowded() -> Vec<Aabb> {
    let mut scene = Scenario::Mixed.start(700, 9);
    scene.advance();
    let far = (0..50).map(|k| Aabb::cube([1.0e6, k as f32, 0.0], 3.0));
    scene.boxes().iter().copied().chain(far).collect()
}

/// Returns a row of boxes with 299 pairs.
fn row() -> Vec<Aabb> {
    (0..300).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.6)).collect()
}

fn plan(engine: &Engine, boxes: &[Aabb]) -> Params {
    engine.plan(boxes.len() as u32, || Look::at(&SampledBoxes::from(boxes)))
}

fn start(engine: &mut Engine, boxes: &[Aabb]) {
    block_on(engine.start(boxes, None, |engine| plan(engine, boxes), &Workers::one())).unwrap();
}

fn finish(engine: &mut Engine) -> Result<usize, Failure> {
    let mut pairs = Pairs::new();
    block_on(engine.finish(&mut pairs, &Workers::one())).map(|()| pairs.len())
}

fn assert_inert(found: Result<usize, Failure>) {
    assert!(matches!(&found, Err(Failure::Gpu(error)) if error.kind() == GpuErrorKind::Inert), "{found:?}");
}

#[test]
fn rows_go_on_after_their_budget() {
    let gpus = Gpus::find();
    let boxes = crowded();
    let expected = naive(&boxes);
    for index in 0..gpus.len() as u32 {
        for method in SORTING {
            let mut engine = Engine::new(gpus.open(index).unwrap(), method).unwrap();
            for budget in [7, 100] {
                let plan = |engine: &Engine| Params { budget, ..plan(engine, &boxes) };
                block_on(engine.start(&boxes, None, plan, &Workers::one())).unwrap();
                let mut pairs = Pairs::with_order(PairOrder::Canonical);
                block_on(engine.finish(&mut pairs, &Workers::one())).unwrap();
                pairs.finish().unwrap();
                assert!(pairs.as_slice() == expected, "{method} on gpu{index}, {budget} candidates at a time");
            }
        }
    }
}

#[test]
fn resident_pairs_of_several_submissions_are_contiguous() {
    let Some(gpu) = first_for_tests() else { return };
    let boxes = crowded();
    let expected = naive(&boxes);
    let contents = cast_slice(&boxes);
    let usage = wgpu::BufferUsages::STORAGE;
    let buffer = gpu.device().create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage });
    for method in SORTING {
        let mut engine = Engine::resident(gpu.clone(), method).unwrap();
        // The list of pairs grows in the middle of the first frame, and has room for the second.
        for _ in 0..2 {
            let params = Params { budget: 20, ..plan(&engine, &boxes) };
            block_on(engine.start_resident(&buffer, params)).unwrap();
            let (count, sample) = block_on(engine.finish_resident()).unwrap();
            assert_eq!(count as usize, expected.len(), "{method}");
            assert!(Look::at(&sample).sample.extent[0] > 0.0);
            assert_eq!(pairs_on_cpu(&engine, count), expected, "{method}");
        }
    }
}

/// Returns the pairs that stayed on the GPU, sorted.
fn pairs_on_cpu(engine: &Engine, count: u32) -> Vec<(u32, u32)> {
    let list = engine.gpu.read_words(engine.output.pairs(), 2 * u64::from(count)).unwrap();
    let mut pairs: Vec<(u32, u32)> = list.chunks(2).map(|pair| (pair[0], pair[1])).collect();
    pairs.sort_unstable();
    pairs
}

/// The position behind the last block ends the pairs of that block.
#[test]
fn positions_of_any_number_of_blocks_are_the_sums_before_them() {
    let Some(gpu) = first_for_tests() else { return };
    let write = |to: &wgpu::Buffer, bytes: &[u8]| gpu.queue().write_buffer(to, 0, bytes);
    let mut output = Output::new(&gpu).unwrap();
    output.ensure_blocks(&gpu, 1 << 14).unwrap();
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    let mut params = Storage::with_usage(&gpu, "parameters", usage).unwrap();
    params.ensure(&gpu, size_of::<Params>() as u64).unwrap();
    let header = Storage::new(&gpu, "header").unwrap();
    output.bind(&gpu, params.buffer(), header.buffer()).unwrap();
    let near = |blocks: u32| blocks - 1..=blocks + 1;
    // 16 counts for each of 256 invocations.
    for blocks in (0..=8).flat_map(|k| near(16 << k).chain(near(8192 + (16 << k)))).chain([0, 1, 48, 12_288]) {
        let counts: Vec<u32> = (0..blocks).map(|k| (k * 7 + 1) % 5).collect();
        write(params.buffer(), bytes_of(&Params { blocks, ..Params::default() }));
        // What an earlier frame left behind the counts.
        write(output.sums(), cast_slice(&[0xdead_beef_u32; 1 << 14]));
        write(output.sums(), cast_slice(&counts));
        let mut encoder = gpu.record();
        output.record(&mut encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()));
        gpu.submit(encoder).unwrap();
        let sums = |end: u32| counts[..end as usize].iter().sum::<u32>();
        let expected: Vec<u32> = (0..=blocks).map(sums).collect();
        assert!(gpu.read_words(output.sums(), u64::from(blocks) + 1).unwrap() == expected, "{blocks} blocks");
        assert_eq!(gpu.read_words(header.buffer(), 2).unwrap(), [sums(blocks), 0], "{blocks} blocks");
    }
}

/// Each dispatch waits for the previous one: a frame of few boxes takes as long as its dispatches.
#[test]
fn no_method_takes_more_dispatches() {
    let Some(gpu) = first_for_tests() else { return };
    // The third level of a tree of 40 000 boxes has more nodes than a walk tests one by one.
    for (boxes, expected) in [(1000, [9, 8, 8]), (40_000, [13, 10, 13])] {
        let boxes: Vec<Aabb> = (0..boxes).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.4)).collect();
        for (method, expected) in SORTING.into_iter().zip(expected) {
            let mut engine = Engine::new(gpu.clone(), method).unwrap();
            let before = dispatched();
            start(&mut engine, &boxes);
            assert_eq!(dispatched() - before, expected, "{method}, {} boxes", boxes.len());
            assert_eq!(finish(&mut engine), Ok(0));
        }
    }
}

/// 600 boxes overlap, and only the pairs of the last box are wanted.
#[test]
fn unwanted_pairs_take_no_room_and_a_filter_is_uploaded_once() {
    let Some(gpu) = first_for_tests() else { return };
    let boxes = [Aabb::cube([1.0; 3], 1.0); 600];
    let still = Membership { fixed: true, ..Membership::ALL };
    for method in METHODS {
        let mut engine = Engine::new(gpu.clone(), method).unwrap();
        let mut pairs = Pairs::new();
        pairs.set_filter(Some(Filter::new(vec![still; 599])));
        let found = |engine: &mut Engine, pairs: &mut Pairs| {
            pairs.clear();
            block_on(engine.find(&FramePlan::default(), &boxes, pairs, &Workers::one())).unwrap();
            pairs.len()
        };
        assert_eq!(found(&mut engine, &mut pairs), 599, "{method}");
        assert!(engine.output.capacity() < 2000, "{method}");
        // An unchanged filter does not replace this one.
        engine.memberships.set(&gpu, Some(&Filter::default())).unwrap();
        assert_eq!(found(&mut engine, &mut pairs), 600 * 599 / 2, "{method}");
        let _ = pairs.filter_mut();
        assert_eq!(found(&mut engine, &mut pairs), 599, "{method}");
    }
}

#[test]
fn a_frame_without_a_kernel_is_the_fault_of_the_gpu() {
    for method in METHODS {
        let Some(gpu) = first_for_tests() else { return };
        let mut engine = Engine::new(gpu.clone(), method).unwrap();
        for _ in 0..3 {
            start(&mut engine, &row());
            assert_eq!(finish(&mut engine), Ok(299), "{method}");
        }
        // A new output of the same size is not bound, and what is not bound is not dispatched.
        let mut output = Output::new(&gpu).unwrap();
        output.ensure_blocks(&gpu, 1 << 16).unwrap();
        output.ensure_pairs(&gpu, u64::from(engine.output.capacity())).unwrap();
        engine.output = output;
        start(&mut engine, &row());
        assert_inert(finish(&mut engine));
        let fault = gpu.fault().unwrap();
        assert!(fault.contains("gpu0 (") && fault.contains("executes nothing"), "{method}: {fault}");
        assert_eq!(gpu.check().unwrap_err().kind(), GpuErrorKind::Inert);
    }
}

#[test]
fn the_answer_to_another_submission_does_not_count() {
    let Some(gpu) = first_for_tests() else { return };
    let mut engine = Engine::new(gpu, "sap").unwrap();
    start(&mut engine, &row());
    assert_eq!(finish(&mut engine), Ok(299));
    start(&mut engine, &row());
    let number = engine.next_submission();
    let Pending::Frame(frame) = &mut engine.pending else { panic!("no frame is pending") };
    frame.params.submission = number;
    assert_inert(finish(&mut engine));
}

#[test]
fn no_submission_has_the_number_of_an_untouched_header() {
    let Some(gpu) = first_for_tests() else { return };
    let mut engine = Engine::new(gpu, "brute").unwrap();
    engine.submissions = u32::MAX;
    assert_eq!(engine.next_submission(), 1);
    assert_ne!(engine.next_submission(), Header::START.ran);
}

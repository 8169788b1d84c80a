use super::{Engine, Piece};
use crate::aabb::Aabb;
use crate::gpu::look::Look;
use crate::gpu::params::Params;
use crate::gpu::{Gpus, first_for_tests};
use crate::load::SampledBoxes;
use crate::pairs::{PairOrder, Pairs};
use crate::scene::{Scenario, Scene};
use wgpu::util::DeviceExt;

const SORTING: [&str; 3] = ["sap", "grid-sap", "bvh"];

/// Boxes of all sizes, each among many: every row has more candidates than the budgets below.
fn crowded() -> Vec<Aabb> {
    let mut scene = Scene::start(Scenario::Mixed, 700, 9);
    scene.advance();
    let far = (0..50).map(|k| Aabb::cube([1.0e6, k as f32, 0.0], 3.0));
    scene.boxes().iter().copied().chain(far).collect()
}

fn oracle(boxes: &[Aabb]) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    for j in 0..boxes.len() {
        pairs.extend((0..j).filter(|&i| boxes[i].overlaps(&boxes[j])).map(|i| (i as u32, j as u32)));
    }
    pairs.sort_unstable();
    pairs
}

fn plan(engine: &Engine, boxes: &[Aabb], budget: u32) -> Params {
    Params { budget, ..engine.plan(boxes.len() as u32, || Look::at(&SampledBoxes::from(boxes))) }
}

#[test]
fn rows_go_on_where_their_budget_ends() {
    let gpus = Gpus::find();
    let boxes = crowded();
    let expected = oracle(&boxes);
    for index in 0..gpus.len() as u32 {
        for method in SORTING {
            let mut engine = Engine::new(gpus.open(index).unwrap(), method).unwrap();
            for budget in [7, 100] {
                let params = plan(&engine, &boxes, budget);
                engine.start(Piece { boxes: &boxes, ids: None }, params).unwrap();
                let mut pairs = Pairs::with_order(PairOrder::Canonical);
                engine.finish(&mut pairs).unwrap();
                pairs.finish().unwrap();
                assert!(pairs.as_slice() == expected, "{method} on gpu{index}, {budget} candidates at a time");
            }
        }
    }
}

#[test]
fn pairs_that_stay_on_the_gpu_follow_each_other_where_a_frame_takes_several_submissions() {
    let Some(gpu) = first_for_tests() else { return };
    let boxes = crowded();
    let expected = oracle(&boxes);
    let contents = bytemuck::cast_slice(&boxes);
    let usage = wgpu::BufferUsages::STORAGE;
    let buffer = gpu.device().create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage });
    for method in SORTING {
        let mut engine = Engine::resident(gpu.clone(), method).unwrap();
        // The second frame knows how many pairs there are; the first has to grow in the middle.
        for _ in 0..2 {
            let params = plan(&engine, &boxes, 20);
            engine.start_resident(&buffer, params).unwrap();
            let (count, look) = engine.finish_resident().unwrap();
            assert_eq!(count as usize, expected.len(), "{method}");
            assert!(look.sample.extent[0] > 0.0);
            assert_eq!(engine.pairs_on_cpu(count), expected, "{method}");
        }
    }
}

impl Engine {
    /// The pairs that stayed on the GPU, in order.
    fn pairs_on_cpu(&self, count: u32) -> Vec<(u32, u32)> {
        let size = u64::from(count) * 8;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
        let copy = self.gpu.device().create_buffer(&descriptor);
        let mut encoder = self.gpu.record();
        encoder.copy_buffer_to_buffer(self.pairs_buffer(), 0, &copy, 0, size);
        let submission = self.gpu.submit(encoder).unwrap();
        copy.map_async(wgpu::MapMode::Read, .., |_| {});
        self.gpu.wait(submission).unwrap();
        let view = copy.get_mapped_range(..).unwrap();
        let list: &[[u32; 2]] = bytemuck::cast_slice(&view);
        let mut pairs: Vec<(u32, u32)> = list.iter().map(|&[i, j]| (i, j)).collect();
        pairs.sort_unstable();
        pairs
    }
}

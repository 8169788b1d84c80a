//! What goes wrong on GPUs: never a missing pair, never a hang, never a panic.

mod common;

use common::{METHODS, Random, gpus, naive, naive_filtered, programs_own, with_gpus};
use sapwise::{Aabb, Adaptive, BroadPhase, Error, Filter, Membership, PairOrder, Pairs, Reason, Registry, Tuning};
use sapwise_gpu::kernel::Kernel;
use sapwise_gpu::{Gpu, GpuIdentity, GpuKind, Gpus, Resident, broad_phase, wgpu30 as wgpu};
use sapwise_scenes::Scenario;

/// Opens the first GPU with buffers of at most that many bytes.
fn small(gpus: &Gpus, bytes: u64) -> Gpu {
    let limits = gpus.adapter(0).unwrap().limits();
    let limits = wgpu::Limits { max_buffer_size: bytes, max_storage_buffer_binding_size: bytes, ..limits };
    programs_own(gpus, 0, &wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() })
}

fn pairs_of(algorithm: &mut dyn BroadPhase, boxes: &[Aabb]) -> Result<Vec<(u32, u32)>, Error> {
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    algorithm.find_pairs(boxes, &mut pairs)?;
    Ok(pairs.as_slice().to_vec())
}

/// Returns a tuning in which each algorithm has a fixed cost.
fn tuning(costs: &[(&str, f64)]) -> Tuning {
    let any = GpuIdentity::new(0, "any", GpuKind::Software);
    let entries = [Registry::with_cores(1).entries(), &sapwise_gpu::algorithms([&any])].concat();
    let costs: Vec<(&str, f64, f64)> = costs.iter().map(|&(id, call)| (id, call, 0.0)).collect();
    common::tuning(&entries, 0.0, &costs)
}

#[test]
fn a_lost_device_is_an_error_from_then_on() {
    let Some(gpus) = gpus() else { return };
    let boxes = Random(1).cubes(3000, [15.0; 3], 0.5);
    for method in METHODS {
        for devices in [1, 2] {
            let opened: Vec<Gpu> = (0..devices).map(|_| gpus.open_another(0).unwrap()).collect();
            let lost = opened[devices - 1].clone();
            let mut algorithm = broad_phase(method, opened).unwrap();
            assert!(pairs_of(algorithm.as_mut(), &boxes).unwrap() == naive(&boxes));
            lost.device().destroy();
            for _ in 0..2 {
                let error = pairs_of(algorithm.as_mut(), &boxes).unwrap_err();
                assert!(matches!(error, Error::Unavailable { .. }), "{method}: {error}");
            }
        }
    }
}

#[test]
fn adaptive_falls_back_in_the_frame_that_loses_a_device() {
    let Some(found) = gpus() else { return };
    // A device that we opened, then one of the program, whose handlers don't report to us.
    goes_on_without(&found);
    goes_on_without(&Gpus::of([small(&found, 128 << 20)]));
}

/// Returns an `Adaptive` that runs `grid-sap` on the first GPU, and on the CPU without it.
fn on_first_gpu(gpus: &Gpus) -> Adaptive {
    let tuning = tuning(&[("grid-sap@gpu0", 1.0), ("sap@gpu0", 2.0), ("grid-sap@cpu1", 3.0), ("brute@cpu1", 9.0)]);
    let mut adaptive = Adaptive::new(tuning, &with_gpus(gpus)).unwrap();
    // Without this the first frames run on the CPU, until the GPU is ready.
    adaptive.prepare(4096);
    // With learning, a software adapter soon loses to the CPU.
    adaptive.set_learning(false);
    adaptive
}

fn goes_on_without(gpus: &Gpus) {
    let mut adaptive = on_first_gpu(gpus);
    let mut scene = Scenario::Uniform.start(2000, 3);
    let mut chosen = Vec::new();
    for frame in 0..6 {
        if frame == 3 {
            gpus.open(0).unwrap().device().destroy();
        }
        scene.advance();
        assert!(pairs_of(&mut adaptive, scene.boxes()).unwrap() == naive(scene.boxes()), "frame {frame}");
        let decision = adaptive.last_decision().unwrap();
        chosen.push((decision.algorithm.to_string(), decision.reason));
    }
    assert_eq!(chosen[2].0, "grid-sap@gpu0");
    assert_eq!(chosen[3], ("grid-sap@cpu1".to_owned(), Reason::FellBack));
    assert_eq!(chosen[5].0, "grid-sap@cpu1");
}

/// Loses the same GPU in five frames, and finds it again some frames later.
#[test]
fn a_revived_device_is_used_at_once() {
    let Some(mut gpus) = gpus() else { return };
    let mut adaptive = on_first_gpu(&gpus);
    let mut scene = Scenario::Fragmentation.start(400, 5);
    for frame in 0..100 {
        scene.advance();
        let (lost, back) = (frame % 20 == 7, frame % 20 == 15);
        if lost {
            gpus.open(0).unwrap().device().destroy();
        }
        if back {
            gpus = Gpus::find();
            adaptive.revive(&with_gpus(&gpus)).unwrap();
        }
        assert!(pairs_of(&mut adaptive, scene.boxes()).unwrap() == naive(scene.boxes()), "frame {frame}");
        let decision = adaptive.last_decision().unwrap();
        let expected = if (7..15).contains(&(frame % 20)) { "grid-sap@cpu1" } else { "grid-sap@gpu0" };
        assert_eq!(decision.algorithm.to_string(), expected, "frame {frame}");
        assert!(!lost || decision.reason == Reason::FellBack, "frame {frame}: {:?}", decision.reason);
    }
}

#[test]
fn a_gpu_that_does_not_answer_in_time_is_lost() {
    if gpus().is_none() {
        return;
    }
    let boxes = Random(3).cubes(100, [8.0; 3], 0.5);
    let limit = std::time::Duration::from_millis(1);
    for limited in ["the GPU", "opened GPUs", "GPUs to be opened"] {
        // A GPU that did not answer stays lost, so find it again.
        let gpus = Gpus::find();
        let opened = (limited != "GPUs to be opened").then(|| gpus.open(0).unwrap());
        match &opened {
            Some(gpu) if limited == "the GPU" => gpu.set_wait_limit(limit),
            // Clones share their GPUs.
            _ => gpus.clone().set_wait_limit(limit),
        }
        let mut algorithm = with_gpus(&gpus).create(&"brute@gpu0".parse().unwrap()).unwrap();
        // The GPU of the algorithm.
        let gpu = gpus.open(0).unwrap();
        occupy(&gpu);
        for text in ["did not answer within 1 ms", "did not answer"] {
            let error = algorithm.find_pairs(&boxes, &mut Pairs::new()).unwrap_err().to_string();
            assert!(error.contains(text), "{limited}: {error}");
        }
        drop((algorithm, opened));
        finish(&gpu);
    }
}

/// Keeps the queue of a GPU busy for well over a millisecond, however fast it is: 20 million operations that depend on
/// each other take at least 20 million clock cycles. No watchdog of a driver ends so short a submission.
fn occupy(gpu: &Gpu) {
    const CHAIN: &str = "
        @group(0) @binding(0) var<storage, read_write> word: u32;
        @compute @workgroup_size(1)
        fn chain() {
            var x = word;
            for (var k = 0u; k < 50000u; k++) {
                x = (x ^ (x << 13u)) + (x >> 17u) + k;
            }
            word = x;
        }";
    const TIMES: usize = 400;
    let usage = wgpu::BufferUsages::STORAGE;
    let descriptor = wgpu::BufferDescriptor { label: None, size: 4, usage, mapped_at_creation: false };
    let word = gpu.device().create_buffer(&descriptor);
    let bound = Kernel::compile(gpu, CHAIN.to_owned(), "chain", &[]).unwrap().bind(gpu, &[(0, &word)]).unwrap();
    let mut recording = gpu.record();
    let mut pass = recording.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    (0..TIMES).for_each(|_| bound.dispatch(&mut pass, 1));
    drop(pass);
    gpu.submit(recording).unwrap();
}

/// Waits for a GPU. A software adapter that still works when its process ends would crash.
fn finish(gpu: &Gpu) {
    gpu.device().poll(wgpu::PollType::wait_indefinitely()).unwrap();
}

#[test]
fn without_its_gpu_adaptive_uses_the_cpu() {
    let tuning = tuning(&[("grid-sap@gpu0", 1.0), ("grid-sap@gpu6+7", 2.0), ("grid-sap@cpu1", 3.0)]);
    let mut adaptive = Adaptive::new(tuning, &with_gpus(&Gpus::none())).unwrap();
    let boxes = Random(2).cubes(500, [9.0; 3], 0.5);
    assert!(pairs_of(&mut adaptive, &boxes).unwrap() == naive(&boxes));
    assert_eq!(adaptive.last_decision().unwrap().algorithm.to_string(), "grid-sap@cpu1");
    assert!(Gpus::none().open(0).unwrap_err().to_string().contains("no GPU was found"));
}

#[test]
fn frames_beyond_the_limits_of_a_device_come_in_pieces() {
    let Some(gpus) = gpus() else { return };
    // 256 KiB hold 6553 sorted boxes with their share of a tree, and 32 768 pairs.
    let gpu = small(&gpus, 256 << 10);
    let mut scene = Scenario::Uniform.start(25_000, 4);
    scene.advance();
    let oracle =
        pairs_of(Registry::with_cores(1).create(&"grid-sap@cpu1".parse().unwrap()).unwrap().as_mut(), scene.boxes());
    let oracle = oracle.unwrap();
    for method in ["sap", "grid-sap", "bvh"] {
        let mut algorithm = broad_phase(method, vec![gpu.clone()]).unwrap();
        assert!(pairs_of(algorithm.as_mut(), scene.boxes()).unwrap() == oracle, "{method}");
    }
    // Fewer boxes for brute force, which a software adapter is slow at.
    let gpu = small(&gpus, 64 << 10);
    let boxes = Random(6).cubes(4000, [25.0; 3], 0.5);
    assert!(pairs_of(broad_phase("brute", vec![gpu]).unwrap().as_mut(), &boxes).unwrap() == naive(&boxes));
}

#[test]
fn the_first_invalid_box_is_named_across_pieces() {
    let Some(gpus) = gpus() else { return };
    let mut algorithm = broad_phase("grid-sap", vec![small(&gpus, 64 << 10)]).unwrap();
    let mut boxes: Vec<Aabb> = (0..9000).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.4)).collect();
    boxes.reverse();
    // The first invalid box of the list is the last along the axis, so that the piece of the other one comes first.
    boxes[3].max[1] = f32::NAN;
    boxes[8990].min[2] = f32::NAN;
    let error = pairs_of(algorithm.as_mut(), &boxes).unwrap_err();
    assert_eq!(error, Error::InvalidBox { index: 3, defect: sapwise::error::BoxDefect::NotANumber });
}

#[test]
fn several_threads_share_a_gpu() {
    let Some(gpus) = gpus() else { return };
    let gpu = gpus.open(0).unwrap();
    let boxes = Random(12).cubes(300, [8.0; 3], 0.5);
    let oracle = naive(&boxes);
    std::thread::scope(|scope| {
        for method in ["grid-sap", "brute", "grid-sap"] {
            let (gpu, boxes, oracle) = (gpu.clone(), &boxes, &oracle);
            scope.spawn(move || {
                let mut algorithm = broad_phase(method, vec![gpu]).unwrap();
                for frame in 0..50 {
                    let pairs = pairs_of(algorithm.as_mut(), boxes);
                    assert!(pairs.as_ref() == Ok(oracle), "{method}, frame {frame}: {pairs:?}");
                }
            });
        }
    });
}

#[test]
fn more_pairs_than_a_buffer_holds_come_in_windows() {
    let Some(gpus) = gpus() else { return };
    let gpu = small(&gpus, 1 << 20);
    let boxes: Vec<Aabb> = (0..1500).map(|k| Aabb::cube([k as f32 * 1e-4, 0.0, 0.0], 1.0)).collect();
    let oracle = naive(&boxes);
    assert!(oracle.len() > 8 * 131_072);
    for method in METHODS {
        let mut algorithm = broad_phase(method, vec![gpu.clone()]).unwrap();
        for _ in 0..2 {
            assert!(pairs_of(algorithm.as_mut(), &boxes).unwrap() == oracle, "{method}");
        }
    }
}

/// 64 KiB hold 4096 memberships. The frame comes in pieces.
#[test]
fn filters_too_large_for_a_device_are_tested_on_the_host() {
    let Some(gpus) = gpus() else { return };
    let gpu = small(&gpus, 64 << 10);
    let mut random = Random(15);
    let boxes = random.cubes(4000, [18.0; 3], 0.6);
    for method in METHODS {
        let mut algorithm = broad_phase(method, vec![gpu.clone()]).unwrap();
        let mut pairs = Pairs::with_order(PairOrder::Canonical);
        for memberships in [5000, 4000, 4500] {
            let memberships: Vec<Membership> = (0..memberships).map(|_| random.membership()).collect();
            pairs.set_filter(Some(Filter::new(memberships.clone())));
            algorithm.find_pairs(&boxes, &mut pairs).unwrap();
            assert!(pairs.as_slice() == naive_filtered(&boxes, &memberships), "{method}, {}", memberships.len());
            let all_wanted = pairs.overlapping() == pairs.len() as u64;
            assert_eq!(all_wanted, memberships.len() == 4000, "{method}, {}", memberships.len());
        }
        let error = Resident::new(&gpu, method).unwrap().set_filter(pairs.filter()).unwrap_err().to_string();
        assert!(error.contains("72000 bytes for memberships"), "{error}");
    }
}

#[test]
fn boxes_that_can_not_be_cut_into_pieces_are_an_error() {
    let Some(gpus) = gpus() else { return };
    let gpu = small(&gpus, 64 << 10);
    let boxes = vec![Aabb::cube([0.0; 3], 1.0); 5000];
    let mut pairs = Pairs::new();
    pairs.set_limit(Some(10));
    let error = broad_phase("grid-sap", vec![gpu]).unwrap().find_pairs(&boxes, &mut pairs).unwrap_err();
    assert!(error.to_string().contains("cut into pieces"), "{error}");
}

#[test]
fn a_steady_state_creates_no_buffer() {
    let Some(gpus) = gpus() else { return };
    for index in 0..gpus.len() as u32 {
        for method in METHODS {
            let gpu = gpus.open_another(index).unwrap();
            let mut algorithm = broad_phase(method, vec![gpu.clone()]).unwrap();
            let mut scene = Scenario::Uniform.start(3000, 1);
            let mut frames = |count: usize| {
                for _ in 0..count {
                    scene.advance();
                    algorithm.find_pairs(scene.boxes(), &mut Pairs::new()).unwrap();
                }
                gpu.device().generate_allocator_report().map(|r| (r.allocations.len(), r.total_allocated_bytes))
            };
            let before = frames(5);
            assert_eq!(frames(20), before, "{method} on gpu{index}");
        }
    }
}

//! Our algorithms on the device and the queue of a program that uses wgpu itself, beside its own work.
//!
//! Without a GPU the tests print that and pass, unless `SAPWISE_REQUIRE_GPU=1`.

mod common;

use common::gpu::upload;
use common::{METHODS, Random, gpus, naive, programs_own, with_gpus};
use sapwise::error::{GpuErrorKind, Unavailable};
use sapwise::{Aabb, BroadPhase, Error, PairOrder, Pairs};
use sapwise_gpu::{Gpu, Gpus, Resident, broad_phase, wgpu30 as wgpu};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

/// Opens a device as a program does: with wgpu's default limits and no feature.
fn shared(gpus: &Gpus, index: u32) -> Gpu {
    programs_own(gpus, index, &wgpu::DeviceDescriptor::default())
}

/// The program's own work: numbers go to one buffer, to another and back.
struct Own {
    gpu: Gpu,
    buffers: [wgpu::Buffer; 2],
    back: wgpu::Buffer,
    turn: u32,
}

impl Own {
    const WORDS: usize = 4096;

    fn new(gpu: &Gpu) -> Self {
        use wgpu::BufferUsages as U;
        let buffer = |usage| {
            let size = 4 * Self::WORDS as u64;
            let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
            gpu.device().create_buffer(&descriptor)
        };
        let buffers = [0, 1].map(|_| buffer(U::COPY_SRC | U::COPY_DST));
        Self { gpu: gpu.clone(), buffers, back: buffer(U::MAP_READ | U::COPY_DST), turn: 0 }
    }

    /// Does one round, and compares what came back.
    fn work(&mut self) {
        let (device, queue) = (self.gpu.device(), self.gpu.queue());
        self.turn += 1;
        let sent: Vec<u8> = (0..Self::WORDS as u32).flat_map(|k| (k ^ self.turn << 16).to_le_bytes()).collect();
        queue.write_buffer(&self.buffers[0], 0, &sent);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.buffers[0], 0, &self.buffers[1], 0, sent.len() as u64);
        encoder.copy_buffer_to_buffer(&self.buffers[1], 0, &self.back, 0, sent.len() as u64);
        queue.submit([encoder.finish()]);
        let (mapped, told) = std::sync::mpsc::channel();
        self.back.slice(..).map_async(wgpu::MapMode::Read, move |result| mapped.send(result).unwrap());
        // Whoever polls first runs the callback: it may have been another thread.
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        told.recv().unwrap().unwrap();
        assert!(*self.back.slice(..).get_mapped_range().unwrap() == *sent, "the program's own work went wrong");
        self.back.unmap();
    }
}

fn agree(id: &str, algorithm: &mut dyn BroadPhase, boxes: &[Aabb], expected: &[(u32, u32)]) {
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    algorithm.find_pairs(boxes, &mut pairs).unwrap_or_else(|e| panic!("{id}: {e}"));
    assert!(pairs.as_slice() == expected, "{id}: {} pairs, not {}", pairs.len(), expected.len());
}

#[test]
fn our_work_and_the_programs_share_a_queue() {
    let Some(gpus) = gpus() else { return };
    let boxes = Random(21).cubes(2500, [14.0; 3], 0.5);
    let expected = naive(&boxes);
    for index in gpus.identities().map(|g| g.index) {
        let gpu = shared(&gpus, index);
        let registry = with_gpus(&Gpus::of([gpu.clone()]));
        let ids = registry.available().into_iter().map(|e| e.id).filter(|id| id.to_string().contains("@gpu"));
        let mut algorithms: Vec<_> = ids.map(|id| (id.to_string(), registry.create(&id).unwrap())).collect();
        assert_eq!(algorithms.len(), 4);
        let mut own = Own::new(&gpu);
        // In turn, as within a frame.
        for (id, algorithm) in &mut algorithms {
            own.work();
            agree(id, algorithm.as_mut(), &boxes, &expected);
            own.work();
        }
        // At the same time, from another thread.
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let own = scope.spawn(|| {
                while !done.load(Relaxed) {
                    own.work();
                }
                own
            });
            for (id, algorithm) in &mut algorithms {
                (0..3).for_each(|_| agree(id, algorithm.as_mut(), &boxes, &expected));
            }
            done.store(true, Relaxed);
            let turns = own.join().unwrap().turn;
            println!("gpu{index}: {turns} rounds of the program's own work");
        });
    }
}

/// Handlers that a program sets, and what they got.
#[derive(Clone, Default)]
struct Handlers {
    errors: Arc<Mutex<Vec<String>>>,
    losses: Arc<AtomicU32>,
}

impl Handlers {
    fn of(device: &wgpu::Device) -> Self {
        let handlers = Self::default();
        let (errors, losses) = (Arc::clone(&handlers.errors), Arc::clone(&handlers.losses));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| errors.lock().unwrap().push(error.to_string())));
        device.set_device_lost_callback(move |_, _| {
            losses.fetch_add(1, Relaxed);
        });
        handlers
    }

    fn errors(&self) -> Vec<String> {
        self.errors.lock().unwrap().clone()
    }
}

fn kind(error: &Error) -> Option<GpuErrorKind> {
    match error {
        Error::Unavailable { reason: Unavailable::Gpu(error), .. } => Some(error.kind()),
        _ => None,
    }
}

#[test]
fn the_programs_handlers_get_only_its_own_errors() {
    let Some(gpus) = gpus() else { return };
    let boxes = Random(22).cubes(800, [9.0; 3], 0.5);
    let expected = naive(&boxes);
    for index in gpus.identities().map(|g| g.index) {
        let gpu = shared(&gpus, index);
        let device = gpu.device();
        let handlers = Handlers::of(device);
        let mut algorithm = broad_phase("grid-sap", vec![gpu.clone()]).unwrap();
        let mut resident = Resident::new(&gpu, "sap").unwrap();
        agree("grid-sap", algorithm.as_mut(), &boxes, &expected);
        // Our errors: a submission with a destroyed buffer, and a kernel that is bound to one.
        let there = upload(&gpu, &boxes, wgpu::BufferUsages::STORAGE);
        assert_eq!(resident.find_pairs(&there, 800).unwrap().count as usize, expected.len());
        there.destroy();
        for _ in 0..2 {
            let error = resident.find_pairs(&there, 800).unwrap_err();
            assert_eq!(kind(&error), Some(GpuErrorKind::Refused), "gpu{index}: {error:#}");
        }
        let other = upload(&gpu, &boxes, wgpu::BufferUsages::STORAGE);
        other.destroy();
        assert_eq!(kind(&resident.find_pairs(&other, 800).unwrap_err()), Some(GpuErrorKind::Refused));
        assert!(handlers.errors().is_empty(), "gpu{index}: {:?}", handlers.errors());
        // The program's own error.
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::MAP_WRITE;
        let own = wgpu::BufferDescriptor { label: Some("its own"), size: 4, usage, mapped_at_creation: false };
        drop(device.create_buffer(&own));
        let told = handlers.errors();
        assert!(told.len() == 1 && told[0].contains("its own"), "gpu{index}: {told:?}");
        // Both go on.
        agree("grid-sap", algorithm.as_mut(), &boxes, &expected);
        assert_eq!(gpu.fault(), None);
        device.destroy();
        for _ in 0..2 {
            let mut pairs = Pairs::new();
            let error = algorithm.find_pairs(&boxes, &mut pairs).unwrap_err();
            assert_eq!(kind(&error), Some(GpuErrorKind::Lost), "gpu{index}: {error:#}");
        }
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        assert_eq!((handlers.errors().len(), handlers.losses.load(Relaxed)), (1, 1), "gpu{index}");
    }
}

#[test]
fn a_lost_device_of_the_program_is_an_error() {
    let Some(gpus) = gpus() else { return };
    let opened = shared(&gpus, 0);
    let (device, identity) = (opened.device().clone(), opened.identity().clone());
    let handlers = Handlers::of(&device);
    device.destroy();
    let gpu = Gpu::from_parts(device, opened.queue().clone(), identity);
    for method in METHODS {
        let made = broad_phase(method, vec![gpu.clone()]);
        let found = made.and_then(|mut algorithm| {
            algorithm.prepare(1000);
            algorithm.find_pairs(&Random(1).cubes(100, [9.0; 3], 0.5), &mut Pairs::new())
        });
        assert_eq!(found.as_ref().err().and_then(kind), Some(GpuErrorKind::Lost), "{method}: {found:?}");
    }
    assert!(handlers.errors().is_empty(), "{:?}", handlers.errors());
}

#[test]
fn given_gpus_are_listed_once_by_number() {
    let Some(gpus) = gpus() else { return };
    let found = gpus.identities().next().unwrap();
    let own = shared(&gpus, found.index);
    assert_eq!(own.identity(), found);
    let gpu = |index| {
        let identity = sapwise_gpu::identity(index, &own.device().adapter_info());
        Gpu::from_parts(own.device().clone(), own.queue().clone(), identity)
    };
    let given = Gpus::of([gpu(2), gpu(0), gpu(2)]);
    assert_eq!(given.identities().map(|g| g.index).collect::<Vec<_>>(), [0, 2]);
    assert!(given.adapter(0).is_none() && Gpus::of([]).is_empty());
    assert_eq!(given.open(2).unwrap().device(), own.device());
    let told = given.open_another(2).unwrap_err().to_string();
    assert!(told.contains("gpu2 is the program's own device"), "{told}");
    assert!(given.open(1).unwrap_err().to_string().contains("only gpu0, gpu2"));
}

//! The device and the queue of a program that draws or computes with wgpu itself: ours work on them, and its own work goes on.
//!
//! Without a GPU the tests say so and pass, unless `SAPWISE_REQUIRE_GPU=1`.

mod common;

use common::{Random, gpus, naive};
use sapwise::gpu::{Gpu, GpuErrorKind, Gpus, Resident, broad_phase, wgpu30 as wgpu};
use sapwise::{Aabb, BroadPhase, Error, GpuIdentity, PairOrder, Pairs, Registry, Unavailable};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

/// A device as a program opens it: no more than the limits that wgpu promises everywhere, no feature.
fn device(gpus: &Gpus, index: u32) -> (wgpu::Device, wgpu::Queue) {
    let adapter = gpus.adapter(index).unwrap();
    pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap()
}

/// The same as a GPU of a registry.
fn shared(index: u32, device: &wgpu::Device, queue: &wgpu::Queue) -> Gpu {
    Gpu::from_parts(device.clone(), queue.clone(), GpuIdentity::of(index, &device.adapter_info()))
}

/// Work of the program: numbers go up, from buffer to buffer, and come back.
struct Own {
    device: wgpu::Device,
    queue: wgpu::Queue,
    buffers: [wgpu::Buffer; 2],
    back: wgpu::Buffer,
    turn: u32,
}

impl Own {
    const WORDS: usize = 4096;

    fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        use wgpu::BufferUsages as U;
        let buffer = |usage| {
            let size = 4 * Self::WORDS as u64;
            device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        let buffers = [0, 1].map(|_| buffer(U::COPY_SRC | U::COPY_DST));
        Self { device: device.clone(), queue: queue.clone(), buffers, back: buffer(U::MAP_READ | U::COPY_DST), turn: 0 }
    }

    /// One round, held against what was sent.
    fn work(&mut self) {
        self.turn += 1;
        let sent: Vec<u8> = (0..Self::WORDS as u32).flat_map(|k| (k ^ self.turn << 16).to_le_bytes()).collect();
        self.queue.write_buffer(&self.buffers[0], 0, &sent);
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.buffers[0], 0, &self.buffers[1], 0, sent.len() as u64);
        encoder.copy_buffer_to_buffer(&self.buffers[1], 0, &self.back, 0, sent.len() as u64);
        self.queue.submit([encoder.finish()]);
        let (mapped, told) = std::sync::mpsc::channel();
        self.back.slice(..).map_async(wgpu::MapMode::Read, move |result| mapped.send(result).unwrap());
        // The first that polls the device calls back, so that another thread's wait may have done it.
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
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
fn ours_and_the_programs_own_work_share_a_queue() {
    let Some(gpus) = gpus() else { return };
    let boxes = Random(21).cubes(2500, [14.0; 3], 0.5);
    let expected = naive(&boxes);
    for index in gpus.identities().map(|g| g.index) {
        let (device, queue) = device(&gpus, index);
        let mut registry = Registry::with_cores(1);
        registry.add_gpus(&Gpus::of([shared(index, &device, &queue)]));
        let ids = registry.available().into_iter().map(|e| e.id).filter(|id| id.to_string().contains("@gpu"));
        let mut algorithms: Vec<_> = ids.map(|id| (id.to_string(), registry.create(&id).unwrap())).collect();
        assert_eq!(algorithms.len(), 4);
        let mut own = Own::new(&device, &queue);
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

/// Handlers as a program sets them, and what they have heard.
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

/// Boxes of the program on its own device.
fn boxes_of(device: &wgpu::Device, queue: &wgpu::Queue, boxes: &[Aabb]) -> wgpu::Buffer {
    let floats = boxes.iter().flat_map(|b| b.min.into_iter().chain(b.max));
    let bytes: Vec<u8> = floats.flat_map(f32::to_le_bytes).collect();
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
    let descriptor = wgpu::BufferDescriptor { label: None, size: bytes.len() as u64, usage, mapped_at_creation: false };
    let buffer = device.create_buffer(&descriptor);
    queue.write_buffer(&buffer, 0, &bytes);
    buffer
}

fn kind(error: &Error) -> Option<GpuErrorKind> {
    match error {
        Error::Unavailable { reason: Unavailable::Gpu(error), .. } => Some(error.kind()),
        _ => None,
    }
}

#[test]
fn the_handlers_of_the_program_stay_and_hear_of_its_own_errors_only() {
    let Some(gpus) = gpus() else { return };
    let boxes = Random(22).cubes(800, [9.0; 3], 0.5);
    let expected = naive(&boxes);
    for index in gpus.identities().map(|g| g.index) {
        let (device, queue) = device(&gpus, index);
        let handlers = Handlers::of(&device);
        let gpu = shared(index, &device, &queue);
        let mut algorithm = broad_phase("grid-sap", vec![gpu.clone()]).unwrap();
        let mut resident = Resident::new(&gpu, "sap").unwrap();
        agree("grid-sap", algorithm.as_mut(), &boxes, &expected);
        // Ours: a submission with a buffer that is gone, and a kernel that is bound to one.
        let there = boxes_of(&device, &queue, &boxes);
        assert_eq!(resident.find_pairs(&there, 800).unwrap().count as usize, expected.len());
        there.destroy();
        for _ in 0..2 {
            let error = resident.find_pairs(&there, 800).unwrap_err();
            assert_eq!(kind(&error), Some(GpuErrorKind::Refused), "gpu{index}: {error:#}");
        }
        let other = boxes_of(&device, &queue, &boxes);
        other.destroy();
        assert_eq!(kind(&resident.find_pairs(&other, 800).unwrap_err()), Some(GpuErrorKind::Refused));
        assert!(handlers.errors().is_empty(), "gpu{index}: {:?}", handlers.errors());
        // The program's own.
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::MAP_WRITE;
        let own = wgpu::BufferDescriptor { label: Some("its own"), size: 4, usage, mapped_at_creation: false };
        drop(device.create_buffer(&own));
        let told = handlers.errors();
        assert!(told.len() == 1 && told[0].contains("its own"), "gpu{index}: {told:?}");
        // And neither keeps the other from going on.
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
fn nothing_can_be_made_on_a_device_of_the_program_that_is_gone() {
    let Some(gpus) = gpus() else { return };
    let (device, queue) = device(&gpus, 0);
    let handlers = Handlers::of(&device);
    device.destroy();
    let gpu = shared(0, &device, &queue);
    for method in ["brute", "sap", "grid-sap", "bvh"] {
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
fn given_gpus_stand_under_their_numbers_once() {
    let Some(gpus) = gpus() else { return };
    let found = gpus.identities().next().unwrap();
    let (device, queue) = device(&gpus, found.index);
    let gpu = |index| shared(index, &device, &queue);
    assert_eq!(gpu(found.index).identity(), found);
    let given = Gpus::of([gpu(2), gpu(0), gpu(2)]);
    assert_eq!(given.identities().map(|g| g.index).collect::<Vec<_>>(), [0, 2]);
    assert!(given.adapter(0).is_none() && Gpus::of([]).is_empty());
    // The very device, and no other one.
    assert_eq!(given.open(2).unwrap().device(), &device);
    let told = given.open_another(2).unwrap_err().to_string();
    assert!(told.contains("gpu2 is the program's own device"), "{told}");
    assert!(given.open(1).unwrap_err().to_string().contains("only gpu0, gpu2"));
}

/// A program's device can be measured as it is, and within a limit: then all that predictions read is there.
#[cfg(feature = "measure-gpu")]
#[test]
fn a_given_gpu_is_measured_on_its_own_device() {
    use sapwise::hardware::GpuParameterId;
    use sapwise::measure::{self, Options};
    let Some(gpus) = gpus() else { return };
    let (device, queue) = device(&gpus, 0);
    let given = Gpus::of([shared(0, &device, &queue)]);
    let options = Options::default().with_limit(std::time::Duration::ZERO);
    let measured = measure::gpu(&given, 0, &options).unwrap();
    assert_eq!(measured.parameters.iter().map(|p| p.name.clone()).collect::<Vec<_>>(), GpuParameterId::OF_ONE);
    for name in [
        GpuParameterId::RoundTripNs,
        GpuParameterId::ReadBackNs,
        GpuParameterId::DispatchNs,
        GpuParameterId::UploadGbPerS,
        GpuParameterId::DownloadGbPerS,
        GpuParameterId::ReadGbPerS,
        GpuParameterId::CopyGbPerS,
        GpuParameterId::ArithmeticGflopPerS,
    ] {
        // One sample under the load of other tests may well be nought.
        assert!(measured.value(name).is_some(), "{name}: {:?}", measured.parameters);
    }
    let clock = measured.parameters.iter().find(|p| p.name == GpuParameterId::ClockGhz).unwrap();
    assert!(clock.source.contains("time limit"));
    assert!(gpus.adapter(0).is_some());
    Own::new(&device, &queue).work();
}

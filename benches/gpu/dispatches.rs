//! Where the time of a frame goes: timestamps on the GPU after each dispatch, clocks on the CPU around each stage.

use sapwise::Pairs;
use sapwise_gpu::watch::Place;
use sapwise_gpu::{Gpu, Gpus, Resident, broad_phase, wgpu30 as wgpu};
use sapwise_scenes::Scenario;
use sapwise_tune::GpuParameterId;
use sapwise_tune::measure::Options;
use sapwise_tune::stats::median;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Timestamps of one frame.
const MARKS: u32 = 256;

/// Frames of one method at one size, and the time after which no more begin.
const FRAMES: usize = 40;
const TIME: Duration = Duration::from_secs(2);

/// The part in which a submission ends.
const AFTER: &str = "copies after";

/// One name and duration in seconds for each part of a frame.
type Parts = Vec<(&'static str, f64)>;

/// A GPU whose frames are timed.
struct Clock {
    /// Watched, and the same device without a watch.
    watched: Gpu,
    plain: Gpu,
    queries: wgpu::QuerySet,
    marks: Arc<Mutex<Marks>>,
}

#[derive(Default)]
struct Marks {
    on_gpu: Vec<&'static str>,
    on_cpu: Vec<(&'static str, Instant)>,
}

impl Clock {
    fn new(gpus: &Gpus, index: u32) -> Result<Self, String> {
        let adapter = gpus.adapter(index).ok_or("no such GPU")?;
        let timestamps = wgpu::Features::TIMESTAMP_QUERY
            | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS
            | wgpu::Features::TIMESTAMP_QUERY_INSIDE_PASSES;
        let descriptor = wgpu::DeviceDescriptor {
            required_features: timestamps | adapter.features() & wgpu::Features::SUBGROUP,
            required_limits: adapter.limits(),
            memory_hints: wgpu::MemoryHints::Performance,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| e.to_string())?;
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count: MARKS,
        });
        let identity = sapwise_gpu::identity(index, &device.adapter_info());
        let plain = Gpu::from_parts(device.clone(), queue.clone(), identity.clone());
        let watched = Gpu::from_parts(device, queue, identity);
        let marks: Arc<Mutex<Marks>> = Arc::default();
        let (noted, set) = (Arc::clone(&marks), queries.clone());
        watched.watch(Box::new(move |part, place| {
            let mut marks = noted.lock().unwrap_or_else(PoisonError::into_inner);
            let mark = marks.on_gpu.len() as u32;
            if part == AFTER {
                marks.on_cpu.push(("recording", Instant::now()));
            }
            match place {
                Place::Host => return marks.on_cpu.push((part, Instant::now())),
                Place::Commands(encoder) if mark < MARKS => encoder.write_timestamp(&set, mark),
                Place::Pass(pass) if mark < MARKS => pass.write_timestamp(&set, mark),
                _ => return,
            }
            marks.on_gpu.push(part);
        }));
        Ok(Self { watched, plain, queries, marks })
    }

    /// Times one frame: its parts on the GPU, its stages on the CPU, and its wall time.
    fn frame(&self, mut run: impl FnMut() -> Result<(), String>) -> Result<(Parts, Parts, f64), String> {
        *self.marks.lock().unwrap_or_else(PoisonError::into_inner) = Marks::default();
        let start = Instant::now();
        run()?;
        let end = Instant::now();
        let marks = std::mem::take(&mut *self.marks.lock().unwrap_or_else(PoisonError::into_inner));
        let times = self.read(marks.on_gpu.len() as u64)?;
        let on_gpu = times.windows(2).zip(&marks.on_gpu[1..]).map(|(t, &name)| (name, t[1] - t[0]));
        // Between two submissions the GPU waits for the CPU.
        let on_gpu = on_gpu.filter(|(name, _)| *name != "before").collect();
        let mut before = start;
        let stages = marks.on_cpu.into_iter().chain([("the rest", end)]);
        let on_cpu = stages.map(|(name, at)| (name, (at - std::mem::replace(&mut before, at)).as_secs_f64())).collect();
        Ok((on_gpu, on_cpu, (end - start).as_secs_f64()))
    }

    /// Returns the first timestamps, in seconds.
    fn read(&self, count: u64) -> Result<Vec<f64>, String> {
        use wgpu::BufferUsages as U;
        let resolved = super::buffer(&self.plain, count * 8, U::QUERY_RESOLVE | U::COPY_SRC)?;
        let mut encoder = self.plain.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.resolve_query_set(&self.queries, 0..count as u32, &resolved, 0);
        self.plain.queue().submit([encoder.finish()]);
        let words = self.plain.read_words(&resolved, 2 * count).map_err(|e| e.to_string())?;
        let period = f64::from(self.plain.queue().get_timestamp_period()) * 1e-9;
        Ok(words.chunks_exact(2).map(|w| (u64::from(w[1]) << 32 | u64::from(w[0])) as f64 * period).collect())
    }
}

/// Returns the fewest bytes that the dispatches of a kernel read and write in a frame, `None` for small kernels. Boxes
/// in random order count as whole sectors of 32 bytes. One cell of the grid is counted for each box.
fn bytes(method: &str, kernel: &str, dispatches: usize, boxes: usize, pairs: usize) -> Option<f64> {
    let of_box = match (method, kernel) {
        // Box; key, reach and rank; count.
        (_, "cell_keys") => 24 + 12 + 8,
        (_, "curve_keys") => 24 + 4,
        (_, "add_up") => 4,
        (_, "begin") => 8,
        // Key, rank; beginning; position.
        (_, "put") => 12 + 4 + 4,
        // Key and value, in and out; the first pass reads no value.
        (_, "scatter") => 16 * dispatches - 4,
        (_, "gather") => 4 + 32 + 32,
        (_, "gather_cells") => 4 + 32 + 32 + 8 + 32 + 4,
        ("bvh", "raise_all") => 32 + 4,
        // Box, cell and table or tree; number and state of the row.
        (_, "count") => 32 + 8 + 8,
        (_, "write") => 4,
        _ => return None,
    };
    let of_pair = match kernel {
        "count" => 4,
        // Kept pair, sector of the box, pair.
        "write" => 4 + 32 + 8,
        _ => 0,
    };
    Some((of_box * boxes + of_pair * pairs) as f64)
}

/// Runs frames of one method, and prints the table. `run` does a frame and returns the number of pairs.
fn table(
    clock: &Clock,
    (method, memory): (&str, &str),
    boxes: usize,
    [bandwidth, dispatch]: [f64; 2],
    mut run: impl FnMut(bool) -> Result<usize, String>,
) -> Result<(), String> {
    let mut pairs = 0;
    for _ in 0..3 {
        pairs = run(true)?;
        run(false)?;
    }
    let (mut on_gpu, mut on_cpu, mut walls, mut plain) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let begin = Instant::now();
    while walls.len() < FRAMES && (walls.len() < 3 || begin.elapsed() < TIME) {
        let (gpu, cpu, wall) = clock.frame(|| run(true).map(drop))?;
        on_gpu.push(gpu);
        on_cpu.push(cpu);
        walls.push(wall);
        let start = Instant::now();
        run(false)?;
        plain.push(start.elapsed().as_secs_f64());
    }
    println!("\n{boxes} boxes, {method}, {memory}, {pairs} pairs, {} frames\n", walls.len());
    println!("| part | number | µs | MB | µs by bytes | time over bound |\n|---|---|---|---|---|---|");
    let mut all = 0.0;
    for (name, count, seconds) in by_name(&on_gpu) {
        all += seconds;
        let bound = bytes(method, name, count as usize, boxes, pairs).map_or("| - | - | - |".to_owned(), |bytes| {
            let least = bytes / bandwidth;
            let over = seconds / (least + f64::from(count) * dispatch);
            format!("| {:.2} | {:.1} | {over:.1} |", bytes * 1e-6, least * 1e6)
        });
        println!("| {name} | {count} | {:.1} {bound}", seconds * 1e6);
    }
    println!("| **GPU** | | {:.1} | | | |", all * 1e6);
    for (name, count, seconds) in by_name(&on_cpu) {
        println!("| CPU: {name} | {count} | {:.1} | | | |", seconds * 1e6);
    }
    println!("| **wall** | | {:.1} | | | |", median(&walls).unwrap_or_default() * 1e6);
    println!("| **wall without timestamps** | | {:.1} | | | |", median(&plain).unwrap_or_default() * 1e6);
    Ok(())
}

/// Returns each name with its number in a frame and the median of its sums.
fn by_name(frames: &[Parts]) -> Vec<(&'static str, u32, f64)> {
    let mut names: Vec<&'static str> = Vec::new();
    for (name, _) in frames.iter().flatten() {
        if !names.contains(name) {
            names.push(name);
        }
    }
    let of = |name| {
        let parts = |frame: &Parts| frame.iter().filter(|p| p.0 == name).map(|p| p.1).collect::<Vec<f64>>();
        let sums: Vec<f64> = frames.iter().map(|frame| parts(frame).iter().sum()).collect();
        (name, frames.last().map_or(0, |frame| parts(frame).len() as u32), median(&sums).unwrap_or_default())
    };
    names.into_iter().map(of).collect()
}

/// Prints the tables of one GPU at these sizes.
pub(super) fn print(gpus: &Gpus, index: u32, sizes: &[usize]) -> Result<(), String> {
    let clock = Clock::new(gpus, index)?;
    let measured = sapwise_tune::measure::gpu(gpus, index, &Options::default()).map_err(|e| e.to_string())?;
    let value = |id: GpuParameterId| measured.value(id).ok_or_else(|| format!("{id} could not be measured"));
    let (bandwidth, dispatch) = (value(GpuParameterId::CopyGbPerS)? * 1e9, value(GpuParameterId::DispatchNs)? * 1e-9);
    println!(
        "\nA copy moves {:.0} GB/s, a dispatch takes {:.2} µs, a round trip {:.1} µs.",
        bandwidth * 1e-9,
        dispatch * 1e6,
        value(GpuParameterId::RoundTripNs)? * 1e-3
    );
    for &size in sizes {
        let scene = Scenario::Uniform.start(size, 1);
        let boxes = scene.boxes();
        let on_gpu = super::upload(&clock.plain, boxes, None)?;
        for method in ["grid-sap", "bvh"] {
            let make = |gpu: &Gpu| Resident::new(gpu, method).map_err(|e| e.to_string());
            let mut resident = [make(&clock.plain)?, make(&clock.watched)?];
            table(&clock, (method, "device"), size, [bandwidth, dispatch], |watched| {
                let found = resident[usize::from(watched)].find_pairs(&on_gpu, size as u32);
                Ok(found.map_err(|e| e.to_string())?.count as usize)
            })?;
        }
        let make = |gpu: &Gpu| broad_phase("grid-sap", vec![gpu.clone()]).map_err(|e| e.to_string());
        let mut hosted = [make(&clock.plain)?, make(&clock.watched)?];
        let mut pairs = Pairs::new();
        table(&clock, ("grid-sap", "host"), size, [bandwidth, dispatch], |watched| {
            hosted[usize::from(watched)].find_pairs(boxes, &mut pairs).map_err(|e| e.to_string())?;
            Ok(pairs.len())
        })?;
    }
    Ok(())
}

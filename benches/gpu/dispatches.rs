//! Where the time of a frame goes: timestamps on the GPU after each dispatch, clocks on the CPU around each stage.

use sapwise::{Aabb, Pairs};
use sapwise_gpu::kernel::Kernel;
use sapwise_gpu::watch::Place;
use sapwise_gpu::{Gpu, Gpus, Resident, broad_phase, wgpu30 as wgpu};
use sapwise_scenes::Scenario;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Timestamps of one frame.
const MARKS: u32 = 256;

/// Frames of one method at one size, and the time after which no more begin.
const FRAMES: usize = 40;
const TIME: Duration = Duration::from_secs(2);

/// Bytes of the copy that measures the bandwidth of the GPU's memory.
const COPIED: u64 = 256 << 20;

/// Dispatches of the kernel that measures what a dispatch takes.
const EMPTY: u32 = 64;

/// Bytes that a thread copies into mapped memory at once.
const CHUNK: usize = 64 << 10;

/// Threads that copy into mapped memory and out of it.
const THREADS: [usize; 5] = [1, 2, 4, 8, 16];

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
        let resolved = buffer(&self.plain, count * 8, U::QUERY_RESOLVE | U::COPY_SRC);
        let copy = buffer(&self.plain, count * 8, U::MAP_READ | U::COPY_DST);
        let mut encoder = self.plain.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.resolve_query_set(&self.queries, 0..count as u32, &resolved, 0);
        encoder.copy_buffer_to_buffer(&resolved, 0, &copy, 0, count * 8);
        self.plain.queue().submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |_| {});
        self.plain.wait_all().map_err(|e| e.to_string())?;
        let bytes = copy.get_mapped_range(..).map_err(|e| e.to_string())?;
        let period = f64::from(self.plain.queue().get_timestamp_period()) * 1e-9;
        Ok(bytes
            .chunks_exact(8)
            .map(|b| u64::from_ne_bytes(b.try_into().unwrap_or_default()) as f64 * period)
            .collect())
    }

    /// Returns the median time between two timestamps around some commands, in seconds.
    fn time(&self, mut record: impl FnMut(&mut wgpu::CommandEncoder)) -> Result<f64, String> {
        let mut seconds = Vec::new();
        for _ in 0..9 {
            let mut encoder = self.plain.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.write_timestamp(&self.queries, 0);
            record(&mut encoder);
            encoder.write_timestamp(&self.queries, 1);
            self.plain.wait(self.plain.queue().submit([encoder.finish()])).map_err(|e| e.to_string())?;
            let times = self.read(2)?;
            seconds.push(times[1] - times[0]);
        }
        Ok(median(&mut seconds))
    }

    /// Returns the bytes per second that a copy in the GPU's memory reads and writes.
    fn bandwidth(&self) -> Result<f64, String> {
        let size = self.plain.limits().max_storage_buffer_binding_size.min(COPIED);
        let text = "@group(0) @binding(0) var<storage, read> a: array<vec4u>;\n\
            @group(0) @binding(1) var<storage, read_write> b: array<vec4u>;\n\
            @compute @workgroup_size(256) fn copy(@builtin(workgroup_id) w: vec3u,\n\
            @builtin(num_workgroups) n: vec3u, @builtin(local_invocation_index) t: u32) {\n\
            let at = (w.y * n.x + w.x) * 256u + t; if (at < arrayLength(&b)) { b[at] = a[at]; } }";
        let kernel = Kernel::compile(&self.plain, text.to_owned(), "copy", &[]).map_err(|e| e.to_string())?;
        let [from, to] = [(); 2].map(|()| buffer(&self.plain, size, wgpu::BufferUsages::STORAGE));
        let bound = kernel.bind(&self.plain, &[(0, &from), (1, &to)]).map_err(|e| e.to_string())?;
        let seconds = self.time(|encoder| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            bound.dispatch(&mut pass, (size / 4096) as u32);
        })?;
        Ok(2.0 * size as f64 / seconds)
    }

    /// Returns the seconds of a dispatch of one workgroup that depends on the one before.
    fn dispatch(&self) -> Result<f64, String> {
        let text = "@group(0) @binding(0) var<storage, read_write> a: array<u32>;\n\
            @compute @workgroup_size(64) fn touch(@builtin(global_invocation_id) id: vec3u) { a[id.x] += 1u; }";
        let kernel = Kernel::compile(&self.plain, text.to_owned(), "touch", &[]).map_err(|e| e.to_string())?;
        let words = buffer(&self.plain, 256, wgpu::BufferUsages::STORAGE);
        let bound = kernel.bind(&self.plain, &[(0, &words)]).map_err(|e| e.to_string())?;
        let all = self.time(|encoder| {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            (0..EMPTY).for_each(|_| bound.dispatch(&mut pass, 1));
        })?;
        Ok(all / f64::from(EMPTY))
    }

    /// Returns the median wall time of a submission that does nothing, in seconds.
    fn submission(&self) -> Result<f64, String> {
        let mut seconds = Vec::new();
        for _ in 0..EMPTY {
            let start = Instant::now();
            let submission = self.plain.submit(self.plain.record()).map_err(|e| e.to_string())?;
            self.plain.wait(submission).map_err(|e| e.to_string())?;
            seconds.push(start.elapsed().as_secs_f64());
        }
        Ok(median(&mut seconds))
    }
}

fn buffer(gpu: &Gpu, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device().create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
}

fn median(samples: &mut [f64]) -> f64 {
    samples.sort_by(f64::total_cmp);
    samples.get(samples.len() / 2).copied().unwrap_or_default()
}

/// Returns the fewest bytes that the dispatches of a kernel read and write in a frame: whole sectors of 32 bytes where
/// boxes come in random order. `None` for small kernels. A cell of the grid is counted for each box.
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
    println!("| **wall** | | {:.1} | | | |", median(&mut walls) * 1e6);
    println!("| **wall without timestamps** | | {:.1} | | | |", median(&mut plain) * 1e6);
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
        let mut sums: Vec<f64> = frames.iter().map(|frame| parts(frame).iter().sum()).collect();
        (name, frames.last().map_or(0, |frame| parts(frame).len() as u32), median(&mut sums))
    };
    names.into_iter().map(of).collect()
}

/// Prints how fast threads copy as many bytes as the boxes have into mapped memory and out of it, and the GPU between
/// that memory and its own.
fn transfers(clock: &Clock, boxes: &[Aabb]) -> Result<(), String> {
    use wgpu::BufferUsages as U;
    let gpu = &clock.plain;
    let bytes = bytemuck::cast_slice::<Aabb, u8>(boxes);
    let size = bytes.len() as u64;
    let [up, down] = [U::MAP_WRITE | U::COPY_SRC, U::MAP_READ | U::COPY_DST].map(|usage| buffer(gpu, size, usage));
    let inside = buffer(gpu, size, U::COPY_SRC | U::COPY_DST);
    let to_gpu = clock.time(|encoder| encoder.copy_buffer_to_buffer(&up, 0, &inside, 0, size))?;
    let from_gpu = clock.time(|encoder| encoder.copy_buffer_to_buffer(&inside, 0, &down, 0, size))?;
    up.map_async(wgpu::MapMode::Write, .., |_| {});
    down.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait_all().map_err(|e| e.to_string())?;
    let mut own = vec![0_u8; bytes.len()];
    println!("\n{:.1} MB, µs\n\n| who | into | out of |\n|---|---|---|", size as f64 * 1e-6);
    println!("| GPU | {:.0} | {:.0} |", to_gpu * 1e6, from_gpu * 1e6);
    for threads in THREADS {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|e| e.to_string())?;
        let each = bytes.len().div_ceil(threads).next_multiple_of(64);
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..9 {
            let mut view = up.get_mapped_range_mut(..).map_err(|e| e.to_string())?;
            let start = Instant::now();
            let (chunks, _) = view.slice(..).into_chunks::<CHUNK>();
            pool.in_place_scope(|scope| {
                for (to, from) in chunks.into_iter().zip(bytes.chunks(CHUNK)) {
                    scope.spawn(move |_| wgpu::WriteOnly::<[u8]>::from(to).copy_from_slice(from));
                }
            });
            times[0].push(start.elapsed().as_secs_f64());
            let view = down.get_mapped_range(..).map_err(|e| e.to_string())?;
            let start = Instant::now();
            pool.scope(|scope| {
                for (to, from) in own.chunks_mut(each).zip(view.chunks(each)) {
                    scope.spawn(move |_| to.copy_from_slice(from));
                }
            });
            times[1].push(start.elapsed().as_secs_f64());
        }
        let [into, out] = times.map(|mut list| median(&mut list) * 1e6);
        println!("| {threads} threads | {into:.0} | {out:.0} |");
    }
    Ok(())
}

/// Prints the tables of one GPU at these sizes.
pub(super) fn print(gpus: &Gpus, index: u32, sizes: &[usize]) -> Result<(), String> {
    let clock = Clock::new(gpus, index)?;
    let (bandwidth, dispatch) = (clock.bandwidth()?, clock.dispatch()?);
    let submission = clock.submission()? * 1e6;
    println!(
        "\nA copy moves {:.0} GB/s, a dispatch takes {:.2} µs, an empty submission {submission:.1} µs.",
        bandwidth * 1e-9,
        dispatch * 1e6
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
        transfers(&clock, boxes)?;
    }
    Ok(())
}

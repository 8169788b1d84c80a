//! Every method on every GPU of this machine, beside `grid-sap` on one core and on all cores, interleaved on the same
//! boxes.
//!
//! ```sh
//! cargo bench -p sapwise-bench --bench gpu                            # all GPUs
//! SAPWISE_GPUS=gpu1,gpu0+1 cargo bench -p sapwise-bench --bench gpu   # these, numbered as in `sapwise devices`
//! cargo bench -p sapwise-bench --bench gpu -- --dispatches            # where a frame on one GPU spends its time
//! cargo bench -p sapwise-bench --bench gpu -- --dispatches 1000,5000  # at these sizes
//! cargo bench -p sapwise-bench --bench gpu -- --stream DIR            # the time of each frame, and its boxes
//! ```
//!
//! Prints a table in Markdown, each size as soon as it is measured: wall clock, median and quartiles over the frames.
//! The memory `host` means boxes and pairs in host memory, transfers included. `device` means boxes and pairs on the
//! GPU, with the number of pairs known to the host, for engines whose data never leave the GPU.
//!
//! The contestants take turns on each frame, so that a machine that slows down slows all of them. The speed-up is the
//! median of the ratios frame by frame. The pairs of all contestants are compared in every frame, outside the timed
//! part. A GPU that rests lowers its clocks, and in a program it would not rest: before each timed frame it runs
//! untimed ones for as long as it rested, up to half a second. Bias: one scenario; four frames, there and back again.
//!
//! Criterion can't interleave its candidates. Without `--bench`, which `cargo bench` passes, only the smallest size is
//! run. Exit status 1 if a contestant failed or found other pairs.

#[path = "gpu/dispatches.rs"]
mod dispatches;
#[path = "gpu/stream.rs"]
mod stream;

use sapwise::algorithm::{Backend, usable_cores};
use sapwise::{Aabb, AlgorithmId, BroadPhase, Pairs, Registry};
use sapwise_gpu::{Gpu, Gpus, Resident, ResidentPairs, wgpu30 as wgpu};
use sapwise_scenes::Scenario;
use sapwise_tune::stats::quantile;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::rc::Rc;
use std::time::{Duration, Instant};

const SIZES: [usize; 5] = [1_000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Sizes of `--dispatches` and `--stream`.
const LARGE_SIZES: &str = "100000,1000000,10000000";

/// Frames of a size.
const FRAMES: usize = 4;

/// Timed rounds of a size, unless time runs out.
const ROUNDS: usize = 60;

/// Fewest rounds of a size, even if time runs out, so that there are quartiles.
const FEWEST_ROUNDS: usize = 5;

/// Longest time of the untimed frames before a timed one on a GPU.
const LONGEST_STREAM: Duration = Duration::from_millis(500);

/// Time for all contestants at a size.
const TIME: Duration = Duration::from_secs(15);

/// A contestant leaves before a size if one frame is forecast to take longer.
const LONGEST_FRAME: Duration = Duration::from_secs(3);

/// A method, its largest size, and the power of the number of objects with which its time grows in `uniform`.
const METHODS: [(&str, usize, f64); 4] =
    [("brute", 100_000, 2.0), ("sap", 1_000_000, 5.0 / 3.0), ("grid-sap", 10_000_000, 1.1), ("bvh", 10_000_000, 1.1)];

/// Runs one frame. Returns its time and the fingerprint of the pairs.
type Turn = Box<dyn FnMut(&[Aabb]) -> Result<(Duration, u64), String>>;

struct Contestant {
    id: AlgorithmId,
    /// Where boxes and pairs are.
    memory: &'static str,
    turn: Turn,
    /// Seconds of each round of the current size.
    seconds: Vec<f64>,
    /// Median of the last size, and that size.
    last: Option<(f64, usize)>,
    /// Whether it has left the race.
    out: bool,
}

impl Contestant {
    fn new(id: AlgorithmId, memory: &'static str, turn: Turn) -> Self {
        Self { id, memory, turn, seconds: Vec::new(), last: None, out: false }
    }

    /// Returns whether it takes part at a size.
    fn takes_part(&self, objects: usize) -> bool {
        let Some(&(_, most, power)) = METHODS.iter().find(|m| m.0 == self.id.method()) else { return !self.out };
        let forecast = self.last.map_or(0.0, |(seconds, at)| seconds * (objects as f64 / at as f64).powf(power));
        !self.out && objects <= most && forecast <= LONGEST_FRAME.as_secs_f64()
    }
}

/// Returns a contestant from boxes in host memory to pairs in host memory.
fn host_resident(mut algorithm: Box<dyn BroadPhase>, gpus: Busy) -> Turn {
    let mut pairs = Pairs::new();
    Box::new(move |boxes| {
        gpus.stream(|| algorithm.find_pairs(boxes, &mut pairs).map_err(|e| e.to_string()))?;
        let start = Instant::now();
        algorithm.find_pairs(black_box(boxes), &mut pairs).map_err(|e| e.to_string())?;
        let elapsed = start.elapsed();
        gpus.worked();
        Ok((elapsed, pairs.fingerprint()))
    })
}

/// GPUs that take turns, and when each last worked.
#[derive(Clone, Default)]
struct Busy {
    gpus: Vec<u32>,
    last: Rc<RefCell<BTreeMap<u32, Instant>>>,
}

impl Busy {
    fn of(&self, backend: &Backend) -> Self {
        let gpus = if let Backend::Gpu(indices) = backend { indices.clone() } else { Vec::new() };
        Self { gpus, last: Rc::clone(&self.last) }
    }

    /// Runs frames until the clocks of GPUs that rested are up.
    fn stream(&self, mut frame: impl FnMut() -> Result<(), String>) -> Result<(), String> {
        let rested = |gpu| self.last.borrow().get(gpu).map_or(LONGEST_STREAM, Instant::elapsed).min(LONGEST_STREAM);
        let wanted = self.gpus.iter().map(rested).max().unwrap_or_default();
        let start = Instant::now();
        while start.elapsed() < wanted {
            frame()?;
        }
        Ok(())
    }

    /// Notes that they have just worked.
    fn worked(&self) {
        self.last.borrow_mut().extend(self.gpus.iter().map(|&gpu| (gpu, Instant::now())));
    }
}

/// Returns a contestant from boxes on a GPU to pairs on it. The transfers are not timed.
fn device_resident(gpus: &Gpus, index: u32, method: &str, busy: Busy) -> Result<Turn, String> {
    let gpu = gpus.open(index).map_err(|e| e.to_string())?;
    let mut resident = Resident::new(&gpu, method).map_err(|e| e.to_string())?;
    let mut on_gpu = None;
    Ok(Box::new(move |boxes| {
        let buffer = upload(&gpu, boxes, on_gpu.take())?;
        busy.stream(|| resident.find_pairs(&buffer, boxes.len() as u32).map(drop).map_err(|e| e.to_string()))?;
        let start = Instant::now();
        let pairs = resident.find_pairs(&buffer, boxes.len() as u32).map_err(|e| e.to_string())?;
        let elapsed = start.elapsed();
        let fingerprint = download(&gpu, pairs)?.fingerprint();
        busy.worked();
        on_gpu = Some(buffer);
        Ok((elapsed, fingerprint))
    }))
}

/// Uploads boxes to the last buffer, or to a new one if they don't fit, and waits for it.
fn upload(gpu: &Gpu, boxes: &[Aabb], last: Option<wgpu::Buffer>) -> Result<wgpu::Buffer, String> {
    let size = size_of_val(boxes) as u64;
    let buffer = match last {
        Some(buffer) if buffer.size() >= size => buffer,
        _ => {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
            buffer(gpu, size, usage)?
        }
    };
    for (piece, at) in boxes.chunks(1 << 20).zip(0_u64..) {
        let bytes: Vec<u8> = piece.iter().flat_map(|b| [b.min, b.max]).flatten().flat_map(f32::to_ne_bytes).collect();
        gpu.queue().write_buffer(&buffer, (at << 20) * size_of::<Aabb>() as u64, &bytes);
    }
    gpu.wait(gpu.queue().submit([])).map_err(|e| e.to_string())?;
    Ok(buffer)
}

/// Downloads pairs.
fn download(gpu: &Gpu, found: ResidentPairs<'_>) -> Result<Pairs, String> {
    let mut pairs = Pairs::new();
    let words = gpu.read_words(found.buffer, 2 * u64::from(found.count)).map_err(|e| e.to_string())?;
    words.chunks_exact(2).for_each(|pair| pairs.push(pair[0], pair[1]));
    pairs.finish().map_err(|e| e.to_string())?;
    Ok(pairs)
}

/// Returns the algorithms on the GPUs of `SAPWISE_GPUS`, or on all GPUs.
fn on_gpus(registry: &Registry) -> Result<Vec<AlgorithmId>, String> {
    let entries = registry.entries().iter().filter(|e| matches!(e.id.backend(), Backend::Gpu(_)));
    let known: Vec<AlgorithmId> = entries.map(|e| e.id.clone()).collect();
    let Ok(named) = std::env::var("SAPWISE_GPUS") else { return Ok(known) };
    let mut wanted = Vec::new();
    for text in named.split(',') {
        let backend: Backend = text.trim().parse().map_err(|e| format!("SAPWISE_GPUS: {e}"))?;
        let before = wanted.len();
        wanted.extend(known.iter().filter(|id| *id.backend() == backend).cloned());
        if wanted.len() == before {
            return Err(format!("SAPWISE_GPUS: nothing runs on {backend} here; see `sapwise devices`"));
        }
    }
    Ok(wanted)
}

/// Makes a buffer.
fn buffer(gpu: &Gpu, size: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer, String> {
    let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
    gpu.try_make(|device| device.create_buffer(&descriptor)).map_err(|e| e.to_string())
}

/// Returns the frames of a size.
fn frames_of(objects: usize) -> Vec<Vec<Aabb>> {
    let mut scene = Scenario::Uniform.start(objects, 1);
    let mut frames = vec![scene.boxes().to_vec()];
    while frames.len() < FRAMES {
        scene.advance();
        frames.push(scene.boxes().to_vec());
    }
    frames
}

/// Returns the frame of a round: there and back again, so that consecutive frames are neighbours in time.
fn there_and_back(round: usize) -> usize {
    let at = round % (2 * FRAMES - 2);
    if at < FRAMES { at } else { 2 * FRAMES - 2 - at }
}

/// Runs all contestants on frames of one size in turn, and prints their rows. Adds a remark for whatever went wrong.
fn measure(objects: usize, rounds: usize, contestants: &mut [Contestant], remarks: &mut Vec<String>) {
    let mut racing: Vec<&mut Contestant> = contestants.iter_mut().filter(|c| c.takes_part(objects)).collect();
    if racing.is_empty() {
        return;
    }
    let frames = frames_of(objects);
    racing.iter_mut().for_each(|c| c.seconds.clear());
    let mut expected = [None; FRAMES];
    let start = Instant::now();
    // Round 0 is the warm-up.
    for round in 0..=rounds {
        if round > FEWEST_ROUNDS && start.elapsed() > TIME {
            break;
        }
        let at = there_and_back(round);
        let count = racing.len();
        for place in 0..count {
            // Each begins in turn, and every other round goes backwards, so that no contestant always follows the
            // same one.
            let place = if round % 2 == 0 { place } else { count - 1 - place };
            let contestant = &mut racing[(round / 2 + place) % count];
            if contestant.out {
                continue;
            }
            let problem = match (contestant.turn)(&frames[at]) {
                Ok((_, found)) if *expected[at].get_or_insert(found) != found => "other pairs than the rest".to_owned(),
                Ok((elapsed, _)) => {
                    if round > 0 {
                        contestant.seconds.push(elapsed.as_secs_f64());
                    }
                    continue;
                }
                Err(error) => error,
            };
            contestant.out = true;
            remarks.push(format!("{} ({}) at {objects} objects: {problem}", contestant.id, contestant.memory));
        }
    }
    racing.retain(|c| !c.out && !c.seconds.is_empty());
    // The last contestant on the CPU has the most cores.
    let reference = racing.iter().rfind(|c| matches!(c.id.backend(), Backend::Cpu(_))).map(|c| c.seconds.clone());
    for contestant in racing {
        let [low, median, high] = [0.25, 0.5, 0.75].map(|q| quantile(&contestant.seconds, q).unwrap_or(f64::NAN));
        let speed_up = reference.as_ref().map_or("-".to_owned(), |reference| {
            let ratios: Vec<f64> = reference.iter().zip(&contestant.seconds).map(|(r, s)| r / s).collect();
            format!("{:.3}", quantile(&ratios, 0.5).unwrap_or(f64::NAN))
        });
        println!(
            "| {objects} | {} | {} | {:.3} | {:.3} to {:.3} | {} | {speed_up} |",
            contestant.id,
            contestant.memory,
            median * 1e3,
            low * 1e3,
            high * 1e3,
            contestant.seconds.len(),
        );
        contestant.last = Some((median, objects));
    }
    // A run that is interrupted keeps the sizes that it measured. An error means that nobody reads.
    let _ = std::io::stdout().flush();
}

fn bench() -> Result<Vec<String>, String> {
    let gpus = Gpus::find();
    let mut registry = Registry::new();
    registry.pin_threads();
    sapwise_gpu::add_to(&mut registry, &gpus);
    if gpus.is_empty() {
        println!("No GPU was found: the CPU alone.");
    }
    for gpu in gpus.identities() {
        println!("- gpu{}: {}, {}, {}", gpu.index, gpu.name, gpu.api, gpu.driver);
    }
    let words: Vec<String> = std::env::args().collect();
    let after = |option: &str| words.iter().position(|w| w == option).map(|at| &words[at + 1..]);
    let value = |word: Option<&String>| word.filter(|w| !w.starts_with('-')).cloned();
    let stream = after("--stream");
    if let Some(rest) = stream.or(after("--dispatches")) {
        let folder = stream.map(|rest| value(rest.first()).ok_or("--stream needs a folder")).transpose()?;
        let sizes = value(rest.get(usize::from(folder.is_some()))).unwrap_or_else(|| LARGE_SIZES.to_owned());
        let sizes = sizes.split(',').map(str::parse);
        let sizes = sizes.collect::<Result<Vec<usize>, _>>().map_err(|e| format!("sizes: {e}"))?;
        let first = on_gpus(&registry)?.first().and_then(|id| match id.backend() {
            Backend::Gpu(indices) => indices.first().copied(),
            _ => None,
        });
        let first = first.ok_or("there is no GPU")?;
        match folder {
            Some(folder) => stream::print(&gpus, first, &sizes, Path::new(&folder))?,
            None => dispatches::print(&gpus, first, &sizes)?,
        }
        return Ok(Vec::new());
    }
    let mut remarks = Vec::new();
    let mut cpu = vec![1, usable_cores()];
    cpu.dedup();
    let cpu = cpu.into_iter().map(|k| AlgorithmId::cpu("grid-sap", k));
    let mut contestants = Vec::new();
    let busy = Busy::default();
    for id in cpu.chain(on_gpus(&registry)?) {
        match registry.create(&id) {
            Ok(algorithm) => {
                contestants.push(Contestant::new(id.clone(), "host", host_resident(algorithm, busy.of(id.backend()))));
            }
            Err(error) => remarks.push(error.to_string()),
        }
        if let Backend::Gpu(indices) = id.backend()
            && let &[index] = indices.as_slice()
        {
            match device_resident(&gpus, index, id.method(), busy.of(id.backend())) {
                Ok(turn) => contestants.push(Contestant::new(id, "device", turn)),
                Err(error) => remarks.push(format!("{id} (device): {error}")),
            }
        }
    }
    println!(
        "\n| objects | algorithm | memory | median ms | quartiles ms | frames | times grid-sap@cpu{} |\n\
         |---|---|---|---|---|---|---|",
        usable_cores()
    );
    let full = words.iter().any(|word| word == "--bench");
    for &objects in if full { &SIZES[..] } else { &SIZES[..1] } {
        eprintln!("{objects} objects");
        measure(objects, if full { ROUNDS } else { FEWEST_ROUNDS }, &mut contestants, &mut remarks);
    }
    Ok(remarks)
}

fn main() -> ExitCode {
    match bench() {
        Ok(remarks) if remarks.is_empty() => ExitCode::SUCCESS,
        Ok(remarks) => {
            println!();
            remarks.iter().for_each(|remark| println!("- {remark}"));
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

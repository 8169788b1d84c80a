//! The time of each frame whose boxes and pairs stay on a GPU, and its boxes in files that other programs read.

use sapwise_gpu::{Gpus, Resident, wgpu30 as wgpu};
use sapwise_scenes::{FrameWriter, write_pairs};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::Instant;

/// Timed frames of a method at a size.
const TIMED: usize = 40;

/// Prints a line of CSV for each timed frame. Writes the frames to `uniform-SIZE.npy` in a folder and the pairs of the
/// last one to `METHOD-SIZE.npy`, unless these files exist.
///
/// Before each frame the boxes are copied, untimed, from another buffer of the GPU. Untimed frames come first, until
/// the clocks of a GPU that rested are up.
pub(super) fn print(gpus: &Gpus, index: u32, sizes: &[usize], folder: &Path) -> Result<(), String> {
    let gpu = gpus.open(index).map_err(|e| e.to_string())?;
    println!("algorithm,objects,frame,pairs,ms");
    for &size in sizes {
        let frames = super::frames_of(size);
        let file = folder.join(format!("uniform-{size}.npy"));
        if !file.exists() {
            write(&file, &frames).map_err(|e| format!("{}: {e}", file.display()))?;
        }
        let bytes = size as u64 * size_of::<sapwise::Aabb>() as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let boxes = super::buffer(&gpu, bytes, usage)?;
        let stored = frames.iter().map(|frame| super::upload(&gpu, frame, None));
        let stored = stored.collect::<Result<Vec<wgpu::Buffer>, String>>()?;
        let load = |at: usize| {
            let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(&stored[at], 0, &boxes, 0, bytes);
            gpu.wait(gpu.queue().submit([encoder.finish()])).map_err(|e| e.to_string())
        };
        for method in ["grid-sap", "bvh"] {
            let mut resident = Resident::new(&gpu, method).map_err(|e| e.to_string())?;
            let (begin, mut timed) = (Instant::now(), 0);
            for round in 0.. {
                let at = super::there_and_back(round);
                load(at)?;
                let start = Instant::now();
                let found = resident.find_pairs(&boxes, size as u32).map_err(|e| e.to_string())?.count;
                let elapsed = start.elapsed();
                if round > 0 && begin.elapsed() > super::LONGEST_STREAM {
                    timed += 1;
                    println!("{method}@gpu{index},{size},{at},{found},{:.6}", elapsed.as_secs_f64() * 1e3);
                }
                if timed == TIMED {
                    break;
                }
            }
            let file = folder.join(format!("{method}-{size}.npy"));
            if !file.exists() {
                load(frames.len() - 1)?;
                let found = resident.find_pairs(&boxes, size as u32).map_err(|e| e.to_string())?;
                let pairs = super::download(&gpu, found)?;
                let written = File::create(&file).and_then(|f| write_pairs(BufWriter::new(f), pairs.as_slice()));
                written.map_err(|e| format!("{}: {e}", file.display()))?;
            }
        }
    }
    Ok(())
}

fn write(file: &Path, frames: &[Vec<sapwise::Aabb>]) -> std::io::Result<()> {
    let most = frames.iter().map(Vec::len).max().unwrap_or_default();
    let mut writer = FrameWriter::new(BufWriter::with_capacity(1 << 20, File::create(file)?), frames.len(), most)?;
    frames.iter().try_for_each(|frame| writer.write(frame))?;
    writer.finish()?.into_inner()?;
    Ok(())
}

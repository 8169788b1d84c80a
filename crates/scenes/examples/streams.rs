//! Writes streams of boxes whose load changes from one frame to the next, as in games: `level.npy`, `fight.npy` and
//! `pooled.npy`.
//!
//! ```sh
//! cargo run --release -p sapwise-scenes --example streams -- DIR
//! ```

use sapwise_scenes::{FrameWriter, Scenario};
use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

const FRAMES: usize = 600;
const OBJECTS: usize = 3000;

/// Of each frame: how many of the boxes are there, and how many steps the scene makes after it.
type Course = fn(usize) -> (usize, usize);

/// A menu of 40 boxes for 150 frames, then the level.
fn level(frame: usize) -> (usize, usize) {
    (if frame < 150 { 40 } else { OBJECTS }, 1)
}

/// For 200 frames in the middle all goes twelve times as fast.
fn fight(frame: usize) -> (usize, usize) {
    (OBJECTS, if (200..400).contains(&frame) { 12 } else { 1 })
}

/// Every 50 frames half of the objects leave or come back.
fn pooled(frame: usize) -> (usize, usize) {
    (if (frame / 50).is_multiple_of(2) { OBJECTS / 2 } else { OBJECTS }, 1)
}

fn write(path: &Path, scenario: Scenario, course: Course) -> Result<(), Box<dyn Error>> {
    let mut scene = scenario.start(OBJECTS, 1);
    let mut frames = FrameWriter::new(BufWriter::new(File::create(path)?), FRAMES, OBJECTS)?;
    for frame in 0..FRAMES {
        let (count, steps) = course(frame);
        frames.write(&scene.boxes()[..count])?;
        (0..steps).for_each(|_| scene.advance());
    }
    frames.finish()?.into_inner()?;
    println!("{}", path.display());
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: streams DIR")?);
    write(&folder.join("level.npy"), Scenario::Mixed, level)?;
    write(&folder.join("fight.npy"), Scenario::Uniform, fight)?;
    write(&folder.join("pooled.npy"), Scenario::Clustered, pooled)
}

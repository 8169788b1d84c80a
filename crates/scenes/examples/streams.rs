//! Writes the [`Course`]s as streams of boxes: `level.npy`, `fight.npy` and `pooled.npy`.
//!
//! ```sh
//! cargo run --release -p sapwise-scenes --example streams -- DIR
//! ```

use sapwise_scenes::{Course, FrameWriter};
use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

const FRAMES: usize = 600;
const OBJECTS: usize = 3000;

fn write(path: &Path, course: Course) -> Result<(), Box<dyn Error>> {
    let mut scene = course.scenario().start(OBJECTS, 1);
    let mut frames = FrameWriter::new(BufWriter::new(File::create(path)?), FRAMES, OBJECTS)?;
    for frame in 0..FRAMES {
        frames.write(&scene.boxes()[..course.boxes(frame, OBJECTS)])?;
        (0..course.steps(frame)).for_each(|_| scene.advance());
    }
    frames.finish()?.into_inner()?;
    println!("{}", path.display());
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("usage: streams DIR")?);
    Course::ALL.into_iter().try_for_each(|course| write(&folder.join(format!("{}.npy", course.as_str())), course))
}

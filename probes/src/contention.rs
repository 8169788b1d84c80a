//! Other programs at work, made by ourselves: threads that stream through memory.

use sapwise::usable_cores;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// Numbers in the buffer of a thread: 64 MB, beyond the last-level cache of most machines.
const NUMBERS: usize = 8 << 20;

/// Half of the usable cores, at least one, kept busy until this is dropped.
pub(crate) struct Contention {
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Contention {
    /// Starts the threads.
    ///
    /// # Errors
    /// When the system refuses one.
    pub(crate) fn start() -> std::io::Result<Self> {
        let mut contention = Self { stop: Arc::new(AtomicBool::new(false)), threads: Vec::new() };
        for k in 0..usable_cores().div_ceil(2) {
            let stop = Arc::clone(&contention.stop);
            let name = format!("contention-{k}");
            contention.threads.push(std::thread::Builder::new().name(name).spawn(move || stream(&stop))?);
        }
        Ok(contention)
    }
}

impl Drop for Contention {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A thread that panicked has stopped, which is all that is wanted.
            let _ = thread.join();
        }
    }
}

fn stream(stop: &AtomicBool) {
    let mut numbers = vec![1.0_f64; NUMBERS];
    while !stop.load(Ordering::Relaxed) {
        for part in numbers.chunks_mut(1 << 16) {
            part.iter_mut().for_each(|x| *x = *x * 0.5 + 1.0);
            if stop.load(Ordering::Relaxed) {
                break;
            }
        }
        black_box(&mut numbers);
    }
}

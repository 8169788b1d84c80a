//! The slowest frames. Each stream runs several times, so that interruptions by the machine do not count.

use crate::contestants::{Contestant, Side};
use crate::point::{Lane, Point, Tail};
use crate::race::{Race, is_at_peak};
use crate::settings::Settings;
use sapwise_scenes::Scene;
use sapwise_tune::stats::quantile;
use std::time::{Duration, Instant};

/// Frames of a stream, and numbers of runs by preference.
const FRAMES: usize = 600;
const RUNS: [usize; 3] = [5, 3, 1];

/// Fewer frames have no 99th percentile. If time is short, runs are dropped first, then frames, then everything.
const FEWEST_FRAMES: usize = 100;

/// A contestant takes no part if its median exceeds this many times the fastest.
const RATIO: f64 = 8.0;

/// Returns the numbers of runs and of frames that fit into `affordable` frames in all.
fn plan(affordable: usize, warm_up: usize) -> Option<(usize, usize)> {
    let frames = |runs: usize| (affordable / runs).saturating_sub(warm_up);
    let runs = RUNS.into_iter().find(|&runs| frames(runs) >= FEWEST_FRAMES)?;
    Some((runs, frames(runs).min(FRAMES)))
}

/// Seconds of each frame in each run of one contestant.
struct Stream {
    name: String,
    runs: Vec<Vec<f64>>,
}

impl Stream {
    /// Returns the median over the runs for each frame.
    fn medians(&self) -> Vec<f64> {
        let frame = |k: usize| self.runs.iter().map(|run| run[k]).collect::<Vec<f64>>();
        (0..self.runs[0].len()).filter_map(|k| quantile(&frame(k), 0.5)).collect()
    }
}

/// Runs the stream that starts at `begin` several times, each time with new contestants. Adds the tails to the lanes
/// of our contestants and of the peers that keep state; other peers have no slow frames of their own.
///
/// # Errors
/// If a contestant fails or finds other pairs than the rest.
pub(crate) fn measure(
    make: &dyn Fn() -> Result<Vec<Contestant>, String>,
    begin: &Scene,
    warm_up: u64,
    point: &mut Point,
    settings: &Settings,
) -> Result<(), String> {
    let limit = point.fastest(|_| true).map_or(0.0, Lane::median) * RATIO;
    let takes_part = |lane: &&mut Lane| (lane.keeps || lane.side != Side::Peer) && lane.median() <= limit;
    let mut lanes: Vec<&mut Lane> = point.lanes.iter_mut().filter(takes_part).collect();
    let frame: f64 = lanes.iter().map(|lane| lane.median()).sum();
    let affordable = (settings.tail_time.as_secs_f64() / frame) as usize;
    let plan = if settings.full { plan(affordable, warm_up as usize) } else { Some((2, 5)) };
    let Some((runs, frames)) = plan else { return Ok(()) };
    let stream = |lane: &&mut Lane| Stream { name: lane.name.clone(), runs: Vec::new() };
    let mut streams: Vec<Stream> = lanes.iter().map(stream).collect();
    let started = Instant::now();
    for run in 0..runs {
        if run > 0 && started.elapsed() > settings.tail_time * 2 {
            break;
        }
        let mut contestants = make()?;
        contestants.retain(|c| streams.iter().any(|s| s.name == c.name));
        let mut race = Race::new(contestants, begin.clone(), run as u64);
        let mut left = race.warm_up(warm_up)?;
        streams.retain(|s| !left.contains(&s.name));
        streams.iter_mut().for_each(|s| s.runs.push(Vec::with_capacity(frames)));
        for _ in 0..frames {
            race.scene.advance();
            let timed = is_at_peak(&race.scene);
            let taken = race.frame(true)?;
            for (contestant, took) in race.contestants.iter().zip(&taken).filter(|_| timed) {
                let stream = streams.iter_mut().find(|s| s.name == contestant.name);
                if let Some(run) = stream.and_then(|s| s.runs.last_mut()) {
                    run.push(took.unwrap_or(Duration::ZERO).as_secs_f64());
                }
            }
            left = race.leave_out_slow(&taken);
            streams.retain(|s| !left.contains(&s.name));
        }
    }
    for stream in streams {
        if let Some(lane) = lanes.iter_mut().find(|lane| lane.name == stream.name) {
            lane.tail = Some(Tail { seconds: stream.medians(), runs: stream.runs.len() });
        }
    }
    Ok(())
}

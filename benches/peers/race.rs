//! One scenario at one size: all contestants on the same frames in turn.

use crate::contestants::Contestant;
use crate::point::{Lane, Point};
use crate::settings::Settings;
use sapwise::{Aabb, Pairs};
use sapwise_scenes::{Random, Scenario, Scene};
use sapwise_tune::measure::Watch;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Seed of the scenes and of the order of turns.
const SEED: u64 = 1;

/// Frames before the timed ones, for those who keep something from frame to frame.
const WARM_UP: u64 = 64;

/// The last of them, in which all run, to make their buffers.
const WARM_UP_OF_ALL: u64 = 2;

/// Who takes longer for a frame leaves.
const LONGEST_FRAME: Duration = Duration::from_secs(3);

/// A frame is hopeless that takes longer than this and [`HOPELESS_RATIO`] times as long as that of the fastest: trees
/// that are refitted and nothing else come to that where objects move far.
const HOPELESS_FRAME: Duration = Duration::from_millis(50);
const HOPELESS_RATIO: u32 = 20;

/// Who has so many hopeless frames in a row leaves. A single one may be the scheduler's fault.
const HOPELESS_FRAMES: u32 = 3;

/// Timed frames at least.
const FEWEST_FRAMES: usize = 5;

/// Timed frames at most: with up to a thousand objects, and beyond.
const MOST_FRAMES: [usize; 2] = [400, 60];

/// Those who race, and what they share.
struct Race {
    contestants: Vec<Contestant>,
    /// One list for all, so that its memory is equally warm for each.
    pairs: Pairs,
    random: Random,
}

impl Race {
    /// Runs all, or only those who keep something, on these boxes in random order. The time that each of them took,
    /// and `None` for those who did not run.
    fn frame(&mut self, boxes: &[Aabb], all: bool) -> Result<Vec<Option<Duration>>, String> {
        let mut taken = vec![None; self.contestants.len()];
        let mut expected: Option<u64> = None;
        for at in self.random.shuffled(self.contestants.len()) {
            let contestant = &mut self.contestants[at];
            if !(all || contestant.keeps) {
                continue;
            }
            let start = Instant::now();
            let result = contestant.find_pairs(black_box(boxes), &mut self.pairs);
            taken[at] = Some(start.elapsed());
            result.map_err(|e| format!("{}: {e}", contestant.name))?;
            let found = self.pairs.fingerprint();
            if *expected.get_or_insert(found) != found {
                return Err(format!("{} finds {} pairs, and others not the same", contestant.name, self.pairs.len()));
            }
        }
        Ok(taken)
    }

    /// Takes those out who take too long, and returns their names.
    fn leave_out_slow(&mut self, taken: &[Option<Duration>]) -> Vec<String> {
        let fastest = taken.iter().flatten().min().copied().unwrap_or_default();
        let hopeless = HOPELESS_FRAME.max(fastest * HOPELESS_RATIO);
        let mut taken = taken.iter().map(|took| took.unwrap_or_default());
        let leaves = |c: &mut Contestant| {
            let took = taken.next().unwrap_or_default();
            c.hopeless_frames = if took > hopeless { c.hopeless_frames + 1 } else { 0 };
            took > LONGEST_FRAME || c.hopeless_frames >= HOPELESS_FRAMES
        };
        self.contestants.extract_if(.., leaves).map(|c| c.name).collect()
    }
}

/// The frame in which a scenario first has as many objects as it ever has. It does not depend on their number.
fn first_peak(scenario: Scenario) -> u64 {
    let mut scene = scenario.start(100, SEED);
    while !is_at_peak(&scene) {
        scene.advance();
    }
    scene.frame()
}

/// Only in `fragmentation` the number of objects changes. Times of different numbers can't be put together.
fn is_at_peak(scene: &Scene) -> bool {
    scene.boxes().len() == scene.peak_objects()
}

/// Runs the contestants through a scenario at a size.
///
/// The scene goes on from frame to frame, so that who keeps the work of the last frame finds objects where they never
/// were before. In `fragmentation` the frames at the peak are timed; those who keep something go through the others
/// too.
///
/// # Errors
/// When a contestant fails or finds other pairs than the rest.
pub(crate) fn race(
    contestants: Vec<Contestant>,
    scenario: Scenario,
    objects: usize,
    settings: &Settings,
) -> Result<Point, String> {
    let told = |e| format!("{scenario} at {objects} objects: {e}");
    let mut race = Race { contestants, pairs: Pairs::new(), random: Random::new(SEED) };
    race.contestants.retain(|c| objects <= c.most);
    let mut scene = scenario.start(objects, SEED);
    let warm_up = if settings.full { WARM_UP } else { WARM_UP_OF_ALL };
    let peak = first_peak(scenario);
    while scene.frame() + warm_up + 1 < peak {
        scene.advance();
    }
    let mut left = Vec::new();
    for frame in 0..warm_up {
        scene.advance();
        let taken = race.frame(scene.boxes(), frame + WARM_UP_OF_ALL >= warm_up).map_err(told)?;
        left.extend(race.leave_out_slow(&taken));
    }
    let lane = |c: &Contestant| Lane { name: c.name.clone(), side: c.side, seconds: Vec::new() };
    let lanes = race.contestants.iter().map(lane).collect();
    let mut point = Point { scenario, objects, lanes, left, foreign_load: None };
    let watch = Watch::begin();
    let most = if settings.full { MOST_FRAMES[usize::from(objects > 1_000)] } else { FEWEST_FRAMES };
    let (started, mut frames) = (Instant::now(), 0);
    while frames < most && (frames < FEWEST_FRAMES || started.elapsed() < settings.time) {
        scene.advance();
        let timed = is_at_peak(&scene);
        let taken = race.frame(scene.boxes(), timed).map_err(told)?;
        if timed {
            frames += 1;
            for (lane, took) in point.lanes.iter_mut().zip(taken.into_iter().flatten()) {
                lane.seconds.push(took.as_secs_f64());
            }
        }
    }
    point.foreign_load = watch.is_long_enough().then(|| watch.foreign_load()).flatten();
    Ok(point)
}

//! One scenario at one size: all contestants on the same frames in turn.

use crate::contestants::Contestant;
use crate::point::{Lane, Point};
use crate::settings::Settings;
use crate::tails;
use sapwise::{Filter, Membership, Pairs};
use sapwise_scenes::{Random, Scenario, Scene};
use sapwise_tune::measure::Watch;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Seed of the scenes and of the order of turns.
const SEED: u64 = 1;

/// Warm-up frames, for contestants that keep state from frame to frame.
const WARM_UP: u64 = 64;

/// The last warm-up frames, in which all contestants run, to allocate their buffers.
const WARM_UP_OF_ALL: u64 = 2;

/// A contestant leaves if a frame takes longer.
const LONGEST_FRAME: Duration = Duration::from_secs(3);

/// A frame is hopeless if it takes longer than this and longer than [`HOPELESS_RATIO`] × the fastest. Trees that are
/// only refitted reach that if objects move far.
const HOPELESS_FRAME: Duration = Duration::from_millis(50);
const HOPELESS_RATIO: u32 = 20;

/// A contestant leaves after this many consecutive hopeless frames. A single one may be the scheduler's fault.
const HOPELESS_FRAMES: u32 = 3;

/// Fewest timed frames.
const FEWEST_FRAMES: usize = 5;

/// Most timed frames: with up to a thousand objects, and with more.
const MOST_FRAMES: [usize; 2] = [400, 60];

/// The contestants, and what they share.
pub(crate) struct Race {
    pub(crate) contestants: Vec<Contestant>,
    pub(crate) scene: Scene,
    /// Shared by all contestants, so that its memory is equally warm for each.
    pairs: Pairs,
    random: Random,
}

/// Returns the filter of a scene: in `city` objects are declared fixed.
fn filter(scene: &Scene) -> Option<Filter> {
    let membership = |k| Membership { fixed: scene.is_fixed(k), ..Membership::ALL };
    (scene.scenario() == Scenario::City).then(|| Filter::new((0..scene.boxes().len()).map(membership).collect()))
}

impl Race {
    pub(crate) fn new(contestants: Vec<Contestant>, scene: Scene, seed: u64) -> Self {
        let mut pairs = Pairs::new();
        pairs.set_filter(filter(&scene));
        Self { contestants, scene, pairs, random: Random::new(seed) }
    }

    /// Runs all contestants, or only those that keep state, on the current frame in random order. Returns the time of
    /// each; `None` for those that did not run.
    ///
    /// # Errors
    /// If a contestant fails or finds other pairs than the rest.
    pub(crate) fn frame(&mut self, all: bool) -> Result<Vec<Option<Duration>>, String> {
        let boxes = self.scene.boxes();
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

    /// Runs the warm-up frames. Returns the names of those that left.
    ///
    /// # Errors
    /// As in [`Race::frame`].
    pub(crate) fn warm_up(&mut self, frames: u64) -> Result<Vec<String>, String> {
        let mut left = Vec::new();
        for frame in 0..frames {
            self.scene.advance();
            let taken = self.frame(frame + WARM_UP_OF_ALL >= frames)?;
            left.extend(self.leave_out_slow(&taken));
        }
        Ok(left)
    }

    /// Removes the contestants that take too long, and returns their names.
    pub(crate) fn leave_out_slow(&mut self, taken: &[Option<Duration>]) -> Vec<String> {
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

/// Returns the first frame in which a scenario has its peak number of objects. It does not depend on that number.
fn first_peak(scenario: Scenario) -> u64 {
    let mut scene = scenario.start(100, SEED);
    while !is_at_peak(&scene) {
        scene.advance();
    }
    scene.frame()
}

/// Returns whether a scene has its peak number of objects. Times of different numbers of objects can't be combined,
/// and in `fragmentation` the number changes.
pub(crate) fn is_at_peak(scene: &Scene) -> bool {
    scene.boxes().len() == scene.peak_objects()
}

/// Runs the contestants through a scenario at a size, then again for their slowest frames.
///
/// The scene never repeats a frame, so a contestant that keeps state meets objects at new places. In `fragmentation`
/// the frames at the peak are timed; contestants that keep state run the other frames too.
///
/// # Errors
/// If a contestant fails or finds other pairs than the rest.
pub(crate) fn race(
    make: &dyn Fn() -> Result<Vec<Contestant>, String>,
    scenario: Scenario,
    objects: usize,
    settings: &Settings,
) -> Result<Point, String> {
    let warm_up = if settings.full { WARM_UP } else { WARM_UP_OF_ALL };
    let mut begin = scenario.start(objects, SEED);
    let peak = first_peak(scenario);
    while begin.frame() + warm_up + 1 < peak {
        begin.advance();
    }
    let mut contestants = make()?;
    contestants.retain(|c| objects <= c.most);
    let mut race = Race::new(contestants, begin.clone(), SEED);
    let left = race.warm_up(warm_up)?;
    let lanes = race.contestants.iter().map(Lane::of).collect();
    let mut point = Point { scenario, objects, lanes, left, foreign_load: None };
    let watch = Watch::begin();
    let most = if settings.full { MOST_FRAMES[usize::from(objects > 1_000)] } else { FEWEST_FRAMES };
    let (started, mut frames) = (Instant::now(), 0);
    while frames < most && (frames < FEWEST_FRAMES || started.elapsed() < settings.time) {
        race.scene.advance();
        let timed = is_at_peak(&race.scene);
        let taken = race.frame(timed)?;
        if timed {
            frames += 1;
            for (lane, took) in point.lanes.iter_mut().zip(taken.into_iter().flatten()) {
                lane.seconds.push(took.as_secs_f64());
            }
        }
    }
    point.foreign_load = watch.is_long_enough().then(|| watch.foreign_load()).flatten();
    drop(race);
    if !settings.tail_time.is_zero() {
        tails::measure(make, &begin, warm_up, &mut point, settings)?;
    }
    Ok(point)
}

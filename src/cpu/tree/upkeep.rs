//! Decides in each frame whether a tree is refitted or rebuilt.
//!
//! Refitting is cheaper than rebuilding, but the nodes of a refitted tree widen as boxes move, and searching it gets
//! more expensive. The excess of each search is taken to be that of the area of the leaves. The tree is rebuilt when
//! the sum of the excesses since the last build reaches the difference between a build and a refit. If the excess grows
//! at a constant rate, no other number of frames between two builds is cheaper; and however it grows, the cost is at
//! most twice that of the best decisions in hindsight (the ski-rental bound).

use super::{Input, Members, Tree};
use crate::clock::{Instant, elapsed_ns};
use crate::cpu::mean_time::MeanTime;
use crate::cpu::{Outputs, Workers};
use crate::{Aabb, Error, FramePlan, Pairs};

/// Frames in which no refit is tried after one that was in vain, at most.
const MOST_PAUSE: u32 = 64;

/// What a build costs over a refit, in searches, without a clock. In `uniform` and `clustered` with 1000 to 100 000
/// boxes on the Zen 3 host of `datasets/` it was 0.8 to 1.8.
const NO_CLOCK: f64 = 1.0;

/// See the module.
#[derive(Debug, Default)]
pub(crate) struct Upkeep {
    /// About the tree that the previous call left. `None`: it can't be refitted.
    tree: Option<Known>,
    /// Frames until a refit is tried again, and their number after the next refit in vain.
    pause: u32,
    next_pause: u32,
    /// Nanoseconds for each box.
    build: MeanTime,
    refit: MeanTime,
    search: MeanTime,
    /// Whether measured times decide.
    timed: bool,
    /// Number of trees that were built.
    #[cfg(test)]
    pub(crate) builds: u64,
}

#[derive(Debug, Clone, Copy)]
struct Known {
    boxes: usize,
    /// Half area of the leaves for each box when the tree was built, with edges up to `longest`.
    area: f64,
    longest: f32,
    /// Excess of the last search over the first one as a share of that, and the sum since the tree was built.
    excess: f64,
    sum: f64,
}

/// Returns the nanoseconds since then, for each box.
fn each_ns(since: Instant, boxes: usize) -> f64 {
    elapsed_ns(since) / boxes.max(1) as f64
}

impl Upkeep {
    /// `timed`: measured times decide, and not areas alone.
    pub(crate) fn new(timed: bool) -> Self {
        Self { timed, ..Self::default() }
    }

    /// Forgets the tree: the next frame builds it.
    pub(crate) fn forget(&mut self) {
        self.tree = None;
    }

    /// Adds the pairs of these boxes to `pairs`, with a tree that is refitted or built.
    ///
    /// # Errors
    /// Those of [`update`](Self::update), and of too many pairs.
    pub(crate) fn find(
        &mut self,
        tree: &mut Tree,
        workers: &Workers,
        (plan, boxes): (&FramePlan, &[Aabb]),
        outputs: &mut Outputs,
        pairs: &mut Pairs,
    ) -> Result<(), Error> {
        let input = Input { workers, boxes, screen: pairs.screen() };
        self.update(tree, input, plan)?;
        let started = Instant::now();
        outputs.find(workers, pairs, |k, parts, list| tree.self_pairs(k, parts, list));
        self.search.add(each_ns(started, boxes.len()));
        Ok(())
    }

    /// Refits or builds the tree of these boxes.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] for the first invalid box, and [`Error::OutOfMemory`].
    pub(crate) fn update(&mut self, tree: &mut Tree, input: Input<'_>, plan: &FramePlan) -> Result<(), Error> {
        if self.refitted(tree, input, plan).is_some() {
            return Ok(());
        }
        let boxes = input.boxes;
        self.tree = None;
        let started = Instant::now();
        let stats = plan.stats(boxes);
        tree.build(input, Members::From(0), &stats)?;
        #[cfg(test)]
        (self.builds += 1);
        let longest = stats.ranges.map(|r| r.1).into_iter().fold(0.0, f64::max) as f32;
        let area = tree.half_area(longest) / boxes.len().max(1) as f64;
        self.tree = Some(Known { boxes: boxes.len(), area, longest, excess: 0.0, sum: 0.0 });
        self.build.add(each_ns(started, boxes.len()));
        Ok(())
    }

    /// Refits the tree if that pays. If not, `None`: the tree is of no use.
    fn refitted(&mut self, tree: &mut Tree, input: Input<'_>, plan: &FramePlan) -> Option<()> {
        let (mut known, boxes) = (self.tree?, input.boxes);
        let price = self.price();
        if self.pause > 0 {
            self.pause -= 1;
            return None;
        }
        // The next excess is hardly less than the last one.
        if known.sum + known.excess > price || boxes.is_empty() {
            return None;
        }
        let started = Instant::now();
        if !tree.resize(input, known.boxes, plan) || !tree.refit(input) {
            return None;
        }
        let area = tree.half_area(known.longest) / boxes.len() as f64;
        // NaN, of 0 over 0, counts as 0.
        known.excess = (area / known.area - 1.0).max(0.0);
        let in_vain = known.sum + known.excess > price || tree.is_sparse(boxes.len());
        if in_vain {
            self.pause = self.next_pause;
            self.next_pause = (2 * self.next_pause + 1).min(MOST_PAUSE);
            return None;
        }
        self.refit.add(each_ns(started, boxes.len()));
        self.next_pause = 0;
        (known.boxes, known.sum) = (boxes.len(), known.sum + known.excess);
        self.tree = Some(known);
        Some(())
    }

    /// Returns what a build costs over a refit, in searches.
    fn price(&self) -> f64 {
        match (self.build.0, self.refit.0, self.search.0) {
            (Some(build), refit, Some(search)) if self.timed && search > 0.0 => {
                ((build - refit.unwrap_or(0.5 * build)) / search).clamp(0.05, 20.0)
            }
            _ => NO_CLOCK,
        }
    }
}

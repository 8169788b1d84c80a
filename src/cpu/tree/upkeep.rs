//! Decides in each frame whether a tree is refitted or rebuilt.
//!
//! Refitting is cheaper than rebuilding, but the nodes of a refitted tree widen as boxes move, and searching it gets
//! more expensive. The excess of each search is taken to be that of the area of the leaves. The tree is rebuilt when
//! the sum of the excesses since the last build reaches the difference between a build and a refit. If the excess
//! grows at a constant rate, no other number of frames between two builds is cheaper; and however it grows, the cost
//! is at most twice that of the best decisions in hindsight (the ski-rental bound).

use super::{Input, Members, Tree};
use crate::clock::{Instant, elapsed_ns};
use crate::cpu::mean_time::{MeanTime, is_as_many};
use crate::cpu::{Outputs, Workers};
use crate::{Aabb, Error, FramePlan, Pairs};

/// Most frames without a refit after a useless one.
const MOST_PAUSE: u32 = 64;

/// What a build costs over a refit, in searches, if that was not measured. In `uniform` and `clustered` with 1000 to
/// 100 000 boxes on the Zen 3 host of `datasets/` it was 0.8 to 1.8.
const UNMEASURED: f64 = 1.0;

/// See the module.
#[derive(Debug, Default)]
pub(crate) struct Upkeep {
    /// State of the tree that the previous call left; `None` if it can't be refitted.
    tree: Option<Known>,
    /// Frames until a refit is tried again, and their number after the next useless refit.
    pause: u32,
    next_pause: u32,
    costs: Costs,
    /// Whether measured times decide.
    timed: bool,
    /// Number of trees that were built.
    #[cfg(test)]
    pub(crate) builds: u64,
}

/// Nanoseconds for each box. A build of ten boxes takes up to forty times as long for each as one of thousands.
#[derive(Debug, Default)]
struct Costs {
    /// The number of boxes for which they were measured, and whether this is its first frame: that pays for memory.
    boxes: usize,
    is_first: bool,
    build: MeanTime,
    refit: MeanTime,
    search: MeanTime,
}

impl Costs {
    /// Begins a frame of `boxes` boxes. Forgets the costs if the known number of boxes is beyond half or twice that.
    fn begin(&mut self, boxes: usize) {
        let is_first = !is_as_many(self.boxes, boxes);
        if is_first {
            *self = Self { boxes, ..Self::default() };
        }
        self.is_first = is_first;
    }

    /// Adds the time of a build. A shorter one replaces the mean: an interrupted build would make builds so rare that
    /// it stayed in the mean.
    fn add_build(&mut self, now: f64) {
        if !self.is_first {
            self.build.add(now);
            self.build.0 = self.build.0.map(|mean| mean.min(now));
        }
    }

    fn add_search(&mut self, now: f64) {
        if !self.is_first {
            self.search.add(now);
        }
    }

    /// Returns what a build costs over a refit, in searches.
    fn price(&self) -> f64 {
        match (self.build.0, self.refit.0, self.search.0) {
            (Some(build), refit, Some(search)) if search > 0.0 => {
                ((build - refit.unwrap_or(0.5 * build)) / search).clamp(0.05, 20.0)
            }
            _ => UNMEASURED,
        }
    }
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
    /// Makes the upkeep of a tree. If `timed`, measured times decide too, and not areas alone.
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
        self.costs.add_search(each_ns(started, boxes.len()));
        Ok(())
    }

    /// Refits or builds the tree of these boxes.
    ///
    /// # Errors
    /// [`Error::InvalidBox`] for the first invalid box, and [`Error::OutOfMemory`].
    pub(crate) fn update(&mut self, tree: &mut Tree, input: Input<'_>, plan: &FramePlan) -> Result<(), Error> {
        let boxes = input.boxes;
        self.costs.begin(boxes.len());
        if self.refitted(tree, input, plan).is_some() {
            return Ok(());
        }
        self.tree = None;
        let started = Instant::now();
        let stats = plan.stats(boxes);
        tree.build(input, Members::From(0), &stats)?;
        #[cfg(test)]
        (self.builds += 1);
        let longest = stats.ranges.map(|r| r.1).into_iter().fold(0.0, f64::max) as f32;
        let area = tree.half_area(longest) / boxes.len().max(1) as f64;
        self.tree = Some(Known { boxes: boxes.len(), area, longest, excess: 0.0, sum: 0.0 });
        self.costs.add_build(each_ns(started, boxes.len()));
        Ok(())
    }

    /// Refits the tree if that pays. If not, `None`: the tree is of no use.
    fn refitted(&mut self, tree: &mut Tree, input: Input<'_>, plan: &FramePlan) -> Option<()> {
        let (mut known, boxes) = (self.tree?, input.boxes);
        let price = if self.timed { self.costs.price() } else { UNMEASURED };
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
        self.costs.refit.add(each_ns(started, boxes.len()));
        self.next_pause = 0;
        (known.boxes, known.sum) = (boxes.len(), known.sum + known.excess);
        self.tree = Some(known);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a frame of `boxes` boxes in which a build, a refit and a search took these nanoseconds for each box.
    fn frame(costs: &mut Costs, boxes: usize, [build, refit, search]: [f64; 3]) {
        costs.begin(boxes);
        costs.add_build(build);
        costs.refit.add(refit);
        costs.add_search(search);
    }

    #[test]
    fn costs_of_few_boxes_say_nothing_of_many() {
        let mut costs = Costs::default();
        (0..20).for_each(|_| frame(&mut costs, 10, [800.0, 20.0, 40.0]));
        assert_eq!(costs.price(), 19.5);
        // The first frame pays for memory.
        frame(&mut costs, 20_000, [60.0, 3.0, 40.0]);
        assert_eq!(costs.price(), UNMEASURED);
        frame(&mut costs, 20_000, [6.0, 3.0, 12.0]);
        assert_eq!(costs.price(), 0.25);
        frame(&mut costs, 11_000, [6.0, 3.0, 12.0]);
        assert_eq!(costs.price(), 0.25);
    }

    #[test]
    fn an_interrupted_build_is_forgotten_at_the_next_one() {
        let mut costs = Costs::default();
        for build in [6.0, 6000.0, 6.0] {
            frame(&mut costs, 1000, [6.0, 3.0, 12.0]);
            frame(&mut costs, 1000, [build, 3.0, 12.0]);
        }
        assert_eq!(costs.price(), 0.25);
    }
}

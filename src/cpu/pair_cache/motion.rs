//! Whether keeping pairs pays, and with which margin.

mod cost;
#[cfg(test)]
mod tests;

use super::grown::{Changes, Margin};
use super::prices::Prices;
use crate::cpu::Wear;
use crate::load::{Displacement, is_same_pace};
use crate::{Aabb, FramePlan};
use std::ops::Range;

/// Margins that are compared, as shares of a mean edge.
const MARGINS: [f32; 8] = [0.04, 0.07, 0.1, 0.15, 0.22, 0.33, 0.5, 0.75];

/// Kept pairs for each box, at most: keeping more would not pay, and takes memory.
const MOST_KEPT: f32 = 32.0;

/// No more pairs are kept than this many times what the margin promised and one for each box. A margin that was too
/// large then costs as much as a few frames from scratch, where it would cost as much as twenty.
const KEPT_OVER_PROMISED: f32 = 4.0;

/// Pairs that a box is taken to have at the least when a margin is chosen. Where none overlap yet, boxes may be
/// stacked a hair apart, and any margin would seem free.
const FEWEST_PAIRS: f32 = 0.5;

/// Frames over which the shares that decide the margin are averaged, and by how much it changes in a frame. After all
/// boxes got new grown boxes none leaves for some frames: a margin that followed at once would swing.
const LEARNING: f32 = 64.0;
const MARGIN_STEP: f32 = 1.005;

/// Of the boxes so many leave at once where the scene jumped, or where this method has not seen its last frames.
const JUMP: f32 = 0.5;

/// Boxes that leave a sorted tree, as a share of all and at least, from which it is learned how many nodes a query
/// looks at.
const FRESH: f32 = 0.02;
const FEWEST_FRESH: u64 = 64;

/// Where the boxes that leave cost less than this share of what the kept pairs do, they shake in place or have come to
/// rest. Then no rate of leaving says how many would leave a smaller grown box, and half the margin is tried.
const RARE: f32 = 0.5;

/// Frames over which grown boxes that are too wide are made smaller.
const SHRINKING: usize = 64;

/// Half the margin is given up once it has cost more than this share of a rebuild, and the next trial waits this many
/// times as long.
const LOST_BY_TRIAL: f32 = 0.1;
const PATIENCE: f32 = 4.0;

/// Frames for which the promised cost counts in the mean cost of a frame.
const PROMISED: f32 = 16.0;

/// Frames after which keeping has paid: when it ceases to, that is because the scene changed.
const PROVEN: u32 = 256;

/// Frames from scratch between two looks at whether keeping would pay, at most. A look at 100 boxes takes a tenth of a
/// frame.
const MOST_PAUSE: u32 = 7;

/// Nodes of a tree that are looked at for a box, before any was counted.
const NODES: f32 = 12.0;

/// What a frame in which pairs were kept has done.
#[derive(Debug, Clone, Copy)]
pub(super) struct Work {
    /// Kept pairs that were tested.
    pub(super) kept_pairs: usize,
    /// Boxes that counted as having left, to get a smaller grown box.
    pub(super) grown_again: usize,
    /// Nodes of the tree that were looked at for boxes that left.
    pub(super) nodes: u64,
    /// Whether tree and pairs were made again.
    pub(super) rebuilt: bool,
}

/// Watches how far boxes move, and what keeping costs.
#[derive(Debug)]
pub(super) struct Motion {
    /// Of the frame before, while pairs are not kept.
    displacement: Displacement,
    /// Pairs for each box in the last frame; `None` before the first.
    density: Option<f32>,
    keeping: Option<Keeping>,
    /// Frames until the next look at whether keeping would pay, and after it if it would not.
    pause: u32,
    next_pause: u32,
    /// How far they move in this frame, where that was told.
    told: Option<f32>,
    /// No larger margin is begun with: that one kept too many pairs, of boxes near one another that do not overlap
    /// yet.
    most_margin: f32,
    pub(super) prices: Prices,
}

/// What is known while pairs are kept.
#[derive(Debug, Clone, Copy)]
struct Keeping {
    margin: Margin,
    /// How far boxes moved in a frame when that was told last, in edges.
    pace: f32,
    /// Cost for each box, averaged over the last frames.
    cost: f32,
    /// What of that the kept pairs took in the last frame.
    tests: f32,
    /// Share of the boxes that leave in a frame without a jump and kept pairs for each box, averaged over the last
    /// [`LEARNING`] frames.
    leaving: f32,
    kept: f32,
    /// Nodes looked at for each box that left, averaged in the same way.
    nodes: f32,
    /// Of the tree. A new order is worth it when the excess has cost as much as that does (the ski-rental bound).
    wear: Wear,
    /// The first box that still has a grown box that is too wide.
    wide_from: Option<usize>,
    /// The margin that the grown boxes have in the mean, and what half of it would have saved for each box since it
    /// would.
    grown: f32,
    missed: f32,
    /// The trial of that half, while it is undecided.
    narrowing: Option<Narrowing>,
    /// How many times the price of a rebuild that has to be, after trials that failed.
    patience: f32,
    /// Frames since keeping began.
    frames: u32,
    /// Cost for each box in the last frame, and in the mean frame, rebuilds included.
    work: f32,
    mean_work: f32,
}

/// A trial of half the margin.
#[derive(Debug, Clone, Copy)]
struct Narrowing {
    /// The margin before, the share that left, and the cost for each box.
    margin: f32,
    leaving: f32,
    cost: f32,
    /// What the trial has cost for each box beyond that.
    lost: f32,
}

impl Keeping {
    /// Returns what the wear of the tree has cost for each box.
    fn excess(&self, objects: usize) -> f32 {
        cost::nodes(cost::far(objects), self.wear.excess as f32) / objects.max(1) as f32
    }

    /// Half the margin of the grown boxes.
    fn narrower(&self) -> f32 {
        (0.5 * self.grown).max(MARGINS[0])
    }

    /// Pairs that are kept with that over those that are kept now.
    fn narrower_keeps(&self) -> f32 {
        ((1.0 + 2.0 * self.narrower()) / (1.0 + 2.0 * self.grown)).powi(3).min(1.0)
    }

    /// What it would have saved for each box in a frame with so many kept pairs each, in which that share of the boxes
    /// left. As many more would have left as of boxes that wander.
    fn narrower_saves(&self, far: f32, kept: f32, left: f32) -> f32 {
        let more = (left * (self.grown / self.narrower()).powi(2)).min(1.0) - left;
        cost::tests(far, kept)
            - cost::tests(far, kept * self.narrower_keeps())
            - cost::left(far, self.nodes) * more.max(0.0)
    }

    /// Whether it would have saved by now what it costs to grow all boxes again. Boxes that come to rest never leave
    /// by themselves: without this their wide grown boxes would stay for ever, and with them five times the pairs.
    fn is_too_wide(&self, objects: usize) -> bool {
        self.missed > self.patience * cost::rebuild(cost::far(objects), self.kept * self.narrower_keeps())
    }

    /// Learns from a frame that cost this much for each box, without the boxes that were grown again, whether half the
    /// margin is the better one. Boxes that shake in place stay within a margin for ever and leave half of it in every
    /// few frames.
    fn judge_narrowing(&mut self, cost: f32, rebuild: f32) {
        let Some(trial) = &mut self.narrowing else { return };
        trial.lost += cost - trial.cost;
        if trial.lost > LOST_BY_TRIAL * rebuild {
            (self.margin.share, self.leaving) = (trial.margin, trial.leaving);
            self.patience *= PATIENCE;
            (self.wide_from, self.narrowing) = (None, None);
        } else if trial.lost < -rebuild {
            (self.patience, self.narrowing) = (1.0, None);
        }
    }
}

impl Motion {
    /// `timed`: measured times decide, and not the cost model alone.
    pub(super) fn new(timed: bool) -> Self {
        Self {
            displacement: Displacement::default(),
            density: None,
            keeping: None,
            pause: 0,
            next_pause: 0,
            told: None,
            most_margin: MARGINS[MARGINS.len() - 1],
            prices: Prices::new(timed),
        }
    }

    /// Returns the margin for boxes that get a new grown box in this frame; `None` if no pairs are to be kept.
    pub(super) fn advise(&mut self, plan: &FramePlan, boxes: &[Aabb]) -> Option<Margin> {
        self.told = plan.moved().map(|moved| moved as f32);
        if self.keeping.is_none() {
            self.look(plan, boxes);
        }
        self.keeping.map(|k| k.margin)
    }

    /// Begins to keep pairs if that promises to pay. Looks ever more rarely if it promises nothing.
    fn look(&mut self, plan: &FramePlan, boxes: &[Aabb]) {
        if self.pause > 0 {
            self.pause -= 1;
        } else {
            self.keeping = self.begin(plan, boxes);
            self.prices.fade(1 + u64::from(self.next_pause));
            if let Some(keeping) = self.keeping {
                self.prices.begin(keeping.cost, self.scratch(boxes.len()));
                (self.next_pause, self.displacement) = (0, Displacement::default());
                return;
            }
            (self.pause, self.next_pause) = (self.next_pause, (2 * self.next_pause + 1).min(MOST_PAUSE));
        }
        if self.pause == 0 {
            self.displacement.watch(boxes);
        }
    }

    /// Takes note of the pairs of a frame.
    pub(super) fn found(&mut self, objects: usize, pairs: u64) {
        self.density = Some(pairs as f32 / objects.max(1) as f32);
    }

    /// The cost of a box from scratch, by the model.
    fn scratch(&self, objects: usize) -> f32 {
        cost::scratch(cost::far(objects), self.density.unwrap_or_default())
    }

    /// Learns from a frame from scratch with this many pairs, which took `took` nanoseconds for each box, if the clock
    /// could tell.
    pub(super) fn found_from_scratch(&mut self, objects: usize, pairs: u64, took: Option<f32>) {
        self.found(objects, pairs);
        self.prices.add_scratch(took, self.scratch(objects));
    }

    /// Keeping failed, because there were too many pairs to keep or because it did not pay.
    pub(super) fn stop(&mut self, too_many: bool) {
        let Some(failed) = self.keeping.take() else { return };
        if too_many || failed.tests > 0.5 * failed.cost {
            self.most_margin = (0.5 * failed.margin.share).max(MARGINS[0]);
        }
        self.prices.failed(too_many);
        // The frame after the next one compares its boxes with those of the next one.
        self.pause = 1;
    }

    /// Other algorithms ran this many frames since the last one of this.
    pub(super) fn missed(&mut self, frames: u64) {
        // Of boxes before all of these.
        self.displacement = Displacement::default();
        (self.pause, self.next_pause) = (0, 0);
        self.prices.fade(frames);
        self.prices.searchers.resume();
    }

    /// The number of boxes has changed by a factor of two or more: what a box costs is to be learned again. `widths`:
    /// on how many threads pairs are kept and found from scratch at first.
    pub(super) fn resize(&mut self, widths: [usize; 2]) {
        self.interrupt();
        self.prices.forget(widths);
    }

    /// A frame failed for no fault of keeping.
    pub(super) fn interrupt(&mut self) {
        self.keeping = None;
    }

    /// How many pairs this many boxes may keep. More are not what the margin promised.
    pub(super) fn most_kept(&self, objects: usize) -> usize {
        let promised = self.keeping.map_or(MOST_KEPT, |k| k.kept);
        let each = (KEPT_OVER_PROMISED * (promised + 1.0)).min(MOST_KEPT);
        (each * objects as f32) as usize + 1024
    }

    /// Work of the last frame in which pairs were kept, over that of the mean one.
    pub(super) fn work_over_mean(&self) -> f32 {
        self.keeping.map_or(1.0, |k| k.work / k.mean_work)
    }

    /// Whether tree and pairs are made again in this frame, in which boxes left as `changes` says.
    pub(super) fn wants_rebuild(&self, objects: usize, changes: &Changes) -> bool {
        let Some(keeping) = self.keeping else { return false };
        changes.left as f32 > JUMP * objects as f32
            || keeping.excess(objects) > cost::rebuild(cost::far(objects), keeping.kept)
    }

    /// Whether the boxes in the tree are to be sorted anew, over some frames.
    pub(super) fn wants_renewal(&self, objects: usize) -> bool {
        self.keeping.is_some_and(|k| k.excess(objects) > cost::renewal(cost::far(objects)))
    }

    /// The boxes in the tree stand in a new order.
    pub(super) fn renewed(&mut self) {
        self.keeping.iter_mut().for_each(|k| k.wear = Wear::default());
    }

    /// Returns the boxes whose grown boxes are made smaller in this frame. When the margin is too wide they all are, a
    /// few in each frame.
    pub(super) fn next_to_shrink(&mut self, objects: usize) -> Range<usize> {
        let Some(keeping) = self.keeping.as_mut().filter(|k| k.wide_from.is_some() || k.is_too_wide(objects)) else {
            return 0..0;
        };
        let first = keeping.wide_from.unwrap_or_else(|| {
            let Keeping { grown: margin, leaving, cost, .. } = *keeping;
            keeping.narrowing = Some(Narrowing { margin, leaving, cost, lost: 0.0 });
            (keeping.margin.share, keeping.missed) = (keeping.narrower(), 0.0);
            0
        });
        let end = (first + objects / SHRINKING + 1).min(objects);
        keeping.wide_from = Some(end).filter(|&end| end < objects);
        first.min(end)..end
    }

    /// The margin with which all boxes are grown again in a frame in which boxes left as `changes` says: the scene may
    /// have changed its sizes since the last time.
    pub(super) fn renew(&mut self, plan: &FramePlan, boxes: &[Aabb], changes: &Changes) -> Margin {
        let jumped = changes.left as f32 > JUMP * boxes.len() as f32;
        // At the same pace the margin stays, for it was found in many frames: boxes that are only taken from a pool
        // and put back move as before.
        let another = |keeping: Keeping| plan.moved().is_some_and(|now| !is_same_pace(keeping.pace.into(), now));
        if jumped && self.keeping.is_some_and(another) {
            self.keeping = self.begin(plan, boxes).or(self.keeping);
        }
        let longest_edge = longest_edge(plan, boxes);
        self.keeping.as_mut().map_or(Margin { share: MARGINS[0], longest_edge }, |keeping| {
            keeping.margin.longest_edge = longest_edge;
            keeping.margin
        })
    }

    /// Learns from a frame in which boxes left as `changes` says and which took `took` nanoseconds for each box, if the
    /// clock could tell.
    /// `false` when keeping does not pay any more.
    pub(super) fn learn(&mut self, objects: usize, changes: &Changes, did: &Work, took: Option<f32>) -> bool {
        let far = cost::far(objects);
        let scratch = self.scratch(objects);
        let Some(k) = &mut self.keeping else { return false };
        let share = |count: usize| count as f32 / objects.max(1) as f32;
        let (left, kept, rebuilt) = (share(changes.left), share(did.kept_pairs), did.rebuilt);
        let outgrown = share(changes.left - changes.jumped);
        let nodes = did.nodes as f32 / changes.left.max(1) as f32;
        let leaving = |left: f32| if left > 0.0 { cost::AGAIN + cost::left(far, nodes) * left } else { 0.0 };
        let work = if rebuilt { cost::rebuild(far, kept) } else { leaving(left) };
        k.tests = cost::tests(far, kept);
        let now = k.tests + work;
        k.cost += (now - k.cost) / 16.0;
        k.work = now;
        k.mean_work += (now - k.mean_work) / (PROMISED + k.frames as f32).min(LEARNING);
        k.kept += (kept - k.kept) / LEARNING;
        // Boxes that move alike leave together, in frames in which all is made again.
        k.leaving += if k.frames > 0 { (outgrown - k.leaving) / LEARNING } else { 0.0 };
        if rebuilt {
            (k.grown, k.missed, k.wide_from, k.narrowing) = (k.margin.share, 0.0, None, None);
            k.wear = Wear::default();
        } else {
            k.wear.note(changes.left as u64, did.nodes, FEWEST_FRESH.max((FRESH * objects as f32) as u64));
            k.grown += (k.margin.share - k.grown) * left.min(1.0);
            k.nodes += if changes.left > 0 { (nodes - k.nodes) / LEARNING } else { 0.0 };
            k.missed = (k.missed + k.narrower_saves(far, kept, outgrown)).max(0.0);
            let by_themselves = share(changes.left.saturating_sub(did.grown_again));
            k.judge_narrowing(k.tests + leaving(by_themselves), cost::rebuild(far, k.kept));
        }
        // At the best margin the two costs grow at the same rate: kept pairs as (1 + 2 m)^3, boxes that leave as m^-p
        // with p between 1, for those that fly straight on, and 2, for those that wander.
        let m = k.margin.share;
        let (keep, leave) = (
            (cost::tests(far, k.kept) - cost::BOX) * 6.0 * m / (1.0 + 2.0 * m),
            1.5 * cost::left(far, k.nodes) * k.leaving,
        );
        if leave > 1.2 * keep {
            k.margin.share = (m * MARGIN_STEP).min(MARGINS[MARGINS.len() - 1]);
        } else if keep > 1.2 * leave && leave > RARE * keep {
            k.margin.share = (m / MARGIN_STEP).max(MARGINS[0]);
        }
        k.pace = self.told.unwrap_or(k.pace);
        k.frames = k.frames.saturating_add(1);
        if k.frames == PROVEN {
            self.most_margin = MARGINS[MARGINS.len() - 1];
        }
        self.prices.pays(took, now, scratch)
    }

    /// How far the boxes moved since the frame before, and how many pairs for each there are; `None` where nobody
    /// knows.
    fn known(&self, plan: &FramePlan, boxes: &[Aabb]) -> Option<(f32, f32)> {
        // The motion in the plan may be some frames old.
        let moved = self.displacement.motion(boxes).map(|m| m.moved).or(plan.moved())?;
        // What this method has found itself may be of long ago.
        let density = plan.pairs().map(|pairs| pairs as f32 / boxes.len().max(1) as f32).or(self.density)?;
        Some((moved as f32, density))
    }

    /// Returns how to keep pairs if that promises to pay.
    fn begin(&mut self, plan: &FramePlan, boxes: &[Aabb]) -> Option<Keeping> {
        let (motion, density) = self.known(plan, boxes)?;
        self.density = Some(density);
        let far = cost::far(boxes.len());
        let scratch = self.scratch(boxes.len());
        let density = density.max(FEWEST_PAIRS);
        let kept = |m: f32| density * (1.0 + 2.0 * m).powi(3);
        let cost = |m: f32| cost::tests(far, kept(m)) + cost::AGAIN + cost::left(far, NODES) * cost::leaving(motion, m);
        let margins = MARGINS.into_iter().filter(|&m| m <= self.most_margin);
        let best = margins.min_by(|&a, &b| cost(a).total_cmp(&cost(b))).unwrap_or(MARGINS[0]);
        let kept = kept(best);
        if kept >= MOST_KEPT || !self.prices.promise(motion, cost(best), scratch) {
            return None;
        }
        Some(Keeping {
            margin: Margin { share: best, longest_edge: longest_edge(plan, boxes) },
            pace: motion,
            cost: cost(best),
            tests: 0.0,
            leaving: cost::leaving(motion, best),
            kept,
            nodes: NODES,
            wear: Wear::default(),
            wide_from: None,
            grown: best,
            missed: 0.0,
            narrowing: None,
            patience: 1.0,
            frames: 0,
            work: cost(best),
            mean_work: cost(best),
        })
    }
}

/// Mean edges count as no longer than four times that which nine boxes in ten don't exceed.
fn longest_edge(plan: &FramePlan, boxes: &[Aabb]) -> f32 {
    4.0 * (plan.stats(boxes).extent.iter().sum::<f64>() / 3.0) as f32
}

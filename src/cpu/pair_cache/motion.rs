//! Decides whether keeping pairs pays, and with which margin.

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
const WIDEST: f32 = MARGINS[MARGINS.len() - 1];

/// If testing kept pairs costs this many times what the margin promised when a try fails, the margin was too large.
const OVER_PROMISED: f32 = 1.5;

/// Frames without kept pairs over which the largest margin to begin with grows by a factor of e. The next try comes
/// sooner, with the smaller margin.
const RELAXING: f32 = 4096.0;

/// Kept pairs for each box, at most: keeping more would not pay, and takes memory.
const MOST_KEPT: f32 = 32.0;

/// Upper bound on kept pairs per box, over one plus what the margin promised. It limits the cost of a margin that is
/// too large to a few frames from scratch; without it, to twenty.
const KEPT_OVER_PROMISED: f32 = 4.0;

/// Pairs per box assumed at least when a margin is chosen. Boxes without pairs may be stacked a hair apart: any margin
/// would seem free.
const FEWEST_PAIRS: f32 = 0.5;

/// Frames over which the shares that decide the margin are averaged, and the factor by which it changes in a frame. No
/// box leaves in the first frames after a rebuild: a margin that followed at once would swing.
const LEARNING: f32 = 64.0;
const MARGIN_STEP: f32 = 1.005;

/// Share of the boxes that leave at once when the scene jumped or this method missed frames.
const JUMP: f32 = 0.5;

/// Departures from a sorted tree that teach how many nodes a query visits: as a share of all boxes, and at least.
const FRESH: f32 = 0.02;
const FEWEST_FRESH: u64 = 64;

/// If departures cost less than this share of the kept pairs, boxes shake in place or rest. Then the rate of
/// departures does not show how many would leave a smaller grown box, and half the margin is tried.
const RARE: f32 = 0.5;

/// Frames over which grown boxes that are too wide shrink.
const SHRINKING: usize = 64;

/// Half the margin is given up once it has cost more than this share of a rebuild, and the next trial waits this many
/// times as long.
const LOST_BY_TRIAL: f32 = 0.1;
const PATIENCE: f32 = 4.0;

/// Weight of the promised cost in the mean cost of a frame, in frames.
const PROMISED: f32 = 16.0;

/// Frames after which keeping has proven itself: if it fails later, the scene has changed.
const PROVEN: u32 = 256;

/// Most frames from scratch between two estimates of whether keeping would pay. An estimate for 100 boxes takes a
/// tenth of a frame.
const MOST_PAUSE: u32 = 7;

/// Nodes assumed per query before any was counted.
const NODES: f32 = 12.0;

/// What a frame in which pairs were kept has done.
#[derive(Debug, Clone, Copy)]
pub(super) struct Work {
    /// Kept pairs that were tested.
    pub(super) kept_pairs: usize,
    /// Boxes that were given a smaller grown box, which count as having left.
    pub(super) grown_again: usize,
    /// Nodes visited by the queries of boxes that left.
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
    /// Frames until the next estimate of whether keeping would pay, and from that one to the one after it.
    pause: u32,
    next_pause: u32,
    /// Speed in this frame, if the plan has it.
    told: Option<f32>,
    /// Largest margin to begin with: larger ones kept too many pairs of near boxes that do not overlap.
    most_margin: f32,
    pub(super) prices: Prices,
}

/// What is known while pairs are kept.
#[derive(Debug, Clone, Copy)]
struct Keeping {
    margin: Margin,
    /// Last known speed, in edges a frame.
    pace: f32,
    /// Cost per box, averaged over the last frames.
    cost: f32,
    /// Part of the last frame's cost per box that tested kept pairs, and what the margin promised at first.
    tests: f32,
    promised_tests: f32,
    /// Share of the boxes that leave in a frame without a jump, and kept pairs per box, both averaged over
    /// [`LEARNING`] frames.
    leaving: f32,
    kept: f32,
    /// Nodes visited per box that left, averaged in the same way.
    nodes: f32,
    /// Wear of the tree. Sorting pays once the wear has cost as much as sorting (the ski-rental bound).
    wear: Wear,
    /// The first box whose grown box is still too wide.
    wide_from: Option<usize>,
    /// Mean margin of the grown boxes, and what half of it would have saved per box by now.
    grown: f32,
    missed: f32,
    /// The trial of that half, while it is undecided.
    narrowing: Option<Narrowing>,
    /// Rebuilds that this saving must exceed before half the margin is tried. Grows with each failed trial.
    patience: f32,
    /// Frames since keeping began.
    frames: u32,
    /// Cost per box in the last frame, and in the mean frame with rebuilds.
    work: f32,
    mean_work: f32,
}

/// A trial of half the margin.
#[derive(Debug, Clone, Copy)]
struct Narrowing {
    /// Margin, share of departures and cost per box before the trial.
    margin: f32,
    leaving: f32,
    cost: f32,
    /// Cost of the trial per box beyond that.
    lost: f32,
}

impl Keeping {
    /// Returns what the wear of the tree has cost per box.
    fn excess(&self, objects: usize) -> f32 {
        cost::nodes(cost::far(objects), self.wear.excess as f32) / objects.max(1) as f32
    }

    /// Half the margin of the grown boxes.
    fn narrower(&self) -> f32 {
        (0.5 * self.grown).max(MARGINS[0])
    }

    /// Kept pairs with that margin over those with the present one.
    fn narrower_keeps(&self) -> f32 {
        ((1.0 + 2.0 * self.narrower()) / (1.0 + 2.0 * self.grown)).powi(3).min(1.0)
    }

    /// Estimated saving per box with half the margin, in a frame with `kept` pairs per box in which the share `left`
    /// left. Assumes a random walk: departures scale with margin⁻².
    fn narrower_saves(&self, far: f32, kept: f32, left: f32) -> f32 {
        let more = (left * (self.grown / self.narrower()).powi(2)).min(1.0) - left;
        cost::tests(far, kept)
            - cost::tests(far, kept * self.narrower_keeps())
            - cost::left(far, self.nodes) * more.max(0.0)
    }

    /// Whether half the margin would have paid for growing all boxes again by now. Boxes at rest never leave by
    /// themselves: without this check their wide grown boxes would stay for ever, with five times the pairs.
    fn is_too_wide(&self, objects: usize) -> bool {
        self.missed > self.patience * cost::rebuild(cost::far(objects), self.kept * self.narrower_keeps())
    }

    /// Learns from a frame of a trial whether half the margin is cheaper. `cost`: per box, without the boxes that were
    /// given a smaller grown box. Boxes that shake in place never leave the whole margin but leave half of it every
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
    /// `timed`: measured times decide, not the cost model alone.
    pub(super) fn new(timed: bool) -> Self {
        Self {
            displacement: Displacement::default(),
            density: None,
            keeping: None,
            pause: 0,
            next_pause: 0,
            told: None,
            most_margin: WIDEST,
            prices: Prices::new(timed),
        }
    }

    /// Returns the margin of new grown boxes in this frame; `None` if no pairs are kept.
    pub(super) fn advise(&mut self, plan: &FramePlan, boxes: &[Aabb]) -> Option<Margin> {
        self.told = plan.moved().map(|moved| moved as f32);
        if self.keeping.is_none() {
            self.look(plan, boxes);
        }
        self.keeping.map(|k| k.margin)
    }

    /// Begins to keep pairs if the estimate promises a gain. Estimates become rarer as long as it does not.
    fn look(&mut self, plan: &FramePlan, boxes: &[Aabb]) {
        if self.pause > 0 {
            self.pause -= 1;
        } else {
            self.keeping = self.begin(plan, boxes);
            self.fade(1 + u64::from(self.next_pause));
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

    /// Notes the number of pairs of a frame.
    pub(super) fn found(&mut self, objects: usize, pairs: u64) {
        self.density = Some(pairs as f32 / objects.max(1) as f32);
    }

    /// Returns the model's cost of a box from scratch.
    fn scratch(&self, objects: usize) -> f32 {
        cost::scratch(cost::far(objects), self.density.unwrap_or_default())
    }

    /// Learns from a frame from scratch. `took`: nanoseconds per box, if the clock is fine enough.
    pub(super) fn found_from_scratch(&mut self, objects: usize, pairs: u64, took: Option<f32>) {
        self.found(objects, pairs);
        self.prices.add_scratch(took, self.scratch(objects));
    }

    /// Stops keeping, because it did not pay or there were `too_many` pairs.
    pub(super) fn stop(&mut self, too_many: bool) {
        let Some(failed) = self.keeping.take() else { return };
        if too_many || failed.tests > OVER_PROMISED * failed.promised_tests {
            self.most_margin = (0.5 * failed.margin.share).max(MARGINS[0]);
        }
        self.prices.failed(too_many);
        // Motion is known one frame after the next one.
        self.pause = 1;
    }

    /// Other algorithms ran this many frames since the last one of this.
    pub(super) fn missed(&mut self, frames: u64) {
        // It holds boxes from before these frames.
        self.displacement = Displacement::default();
        (self.pause, self.next_pause) = (0, 0);
        self.fade(frames);
        self.prices.searchers.resume();
    }

    /// Lets the memory of failures fade over frames without kept pairs.
    fn fade(&mut self, frames: u64) {
        self.most_margin = (self.most_margin * (frames as f32 / RELAXING).exp()).min(WIDEST);
        self.prices.fade(frames);
    }

    /// Forgets the costs of a box, because the number of boxes has changed by a factor of two or more. `widths`:
    /// initial positions of the thread counts with kept pairs and from scratch.
    pub(super) fn resize(&mut self, widths: [usize; 2]) {
        self.interrupt();
        self.most_margin = (self.most_margin * WIDEST).sqrt();
        self.prices.forget(widths);
    }

    /// Forgets the kept pairs after a frame that failed for another reason.
    pub(super) fn interrupt(&mut self) {
        self.keeping = None;
    }

    /// Returns the upper bound on kept pairs of this many boxes.
    pub(super) fn most_kept(&self, objects: usize) -> usize {
        let promised = self.keeping.map_or(MOST_KEPT, |k| k.kept);
        let each = (KEPT_OVER_PROMISED * (promised + 1.0)).min(MOST_KEPT);
        (each * objects as f32) as usize + 1024
    }

    /// Returns the work of the last frame with kept pairs over the mean.
    pub(super) fn work_over_mean(&self) -> f32 {
        self.keeping.map_or(1.0, |k| k.work / k.mean_work)
    }

    /// Whether this frame, in which boxes left as `changes` says, rebuilds the tree and the pairs.
    pub(super) fn wants_rebuild(&self, objects: usize, changes: &Changes) -> bool {
        let Some(keeping) = self.keeping else { return false };
        changes.left as f32 > JUMP * objects as f32
            || keeping.excess(objects) > cost::rebuild(cost::far(objects), keeping.kept)
    }

    /// Whether to sort the boxes of the tree anew, over several frames.
    pub(super) fn wants_renewal(&self, objects: usize) -> bool {
        self.keeping.is_some_and(|k| k.excess(objects) > cost::renewal(cost::far(objects)))
    }

    /// Notes that the tree is sorted.
    pub(super) fn renewed(&mut self) {
        self.keeping.iter_mut().for_each(|k| k.wear = Wear::default());
    }

    /// Returns the boxes whose grown boxes shrink in this frame. If the margin is too wide, all do within
    /// [`SHRINKING`] frames.
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

    /// Returns the margin of a rebuild, in a frame in which boxes left as `changes` says. Box sizes may have changed
    /// since the previous one.
    pub(super) fn renew(&mut self, plan: &FramePlan, boxes: &[Aabb], changes: &Changes) -> Margin {
        let jumped = changes.left as f32 > JUMP * boxes.len() as f32;
        // At the same speed the margin stays, since it took many frames to find: boxes that return from a pool move as
        // before.
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

    /// Learns from a frame with kept pairs. `took`: nanoseconds per box, if the clock is fine enough. Returns whether
    /// keeping still pays.
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
        // Boxes that move alike leave together, in frames that rebuild.
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
        // At the best margin m both costs change at the same rate: kept pairs as (1 + 2 m)^3, departures as m^-p, with
        // p from 1 (straight flight) to 2 (random walk).
        let m = k.margin.share;
        let (keep, leave) = (
            (cost::tests(far, k.kept) - cost::BOX) * 6.0 * m / (1.0 + 2.0 * m),
            1.5 * cost::left(far, k.nodes) * k.leaving,
        );
        if leave > 1.2 * keep {
            k.margin.share = (m * MARGIN_STEP).min(WIDEST);
        } else if keep > 1.2 * leave && leave > RARE * keep {
            k.margin.share = (m / MARGIN_STEP).max(MARGINS[0]);
        }
        k.pace = self.told.unwrap_or(k.pace);
        k.frames = k.frames.saturating_add(1);
        if k.frames == PROVEN {
            self.most_margin = WIDEST;
        }
        self.prices.pays(took, now, scratch)
    }

    /// Returns the motion since the previous frame and the pairs per box; `None` if either is unknown.
    fn known(&self, plan: &FramePlan, boxes: &[Aabb]) -> Option<(f32, f32)> {
        // The motion in the plan may be some frames old.
        let moved = self.displacement.motion(boxes).map(|m| m.moved).or(plan.moved())?;
        // The density that this method found itself may be old.
        let density = plan.pairs().map(|pairs| pairs as f32 / boxes.len().max(1) as f32).or(self.density)?;
        Some((moved as f32, density))
    }

    /// Returns how to keep pairs, if the estimate promises a gain.
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
            promised_tests: cost::tests(far, kept),
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

/// Returns the cap on mean edges: four times the 0.9 quantile.
fn longest_edge(plan: &FramePlan, boxes: &[Aabb]) -> f32 {
    4.0 * (plan.stats(boxes).extent.iter().sum::<f64>() / 3.0) as f32
}

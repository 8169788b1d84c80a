//! Walks through a tree from near to far.

use super::walk::{MOST_LEVELS, Walk};
use super::{LANES, Level, Node, at_level, prefetch};
use crate::pairs::each_bit;

/// The measure by which a walk goes from near to far. A lane that contains another has no larger measure.
pub(crate) trait Measure: Copy {
    /// Writes the measure of each lane, at least 0, to `to`. Returns a mask: bit k is set if lane k holds a box with a
    /// measure of at most `most`. The measures of the other lanes are unspecified.
    fn measure<L: Level>(&self, node: &Node, most: f32, to: &mut [f32; LANES], level: L) -> u32;
}

/// Children that are left to visit.
#[derive(Clone, Copy)]
struct Open {
    node: usize,
    left: u32,
    measures: [f32; LANES],
}

impl Open {
    const NONE: Self = Self { node: 0, left: 0, measures: [0.0; LANES] };

    /// Takes the nearest child of all. Returns its lane and its measure.
    #[inline(always)]
    fn take_nearest(&mut self) -> Option<(usize, f32)> {
        // The bits of measures, which are not negative, are ordered as these. Integers are compared without a branch,
        // which would often be guessed wrong.
        let mut nearest = u64::MAX;
        each_bit(self.left, |lane| {
            nearest = nearest.min(u64::from(self.measures[lane % LANES].to_bits()) << 32 | lane as u64);
        });
        let lane = nearest as usize % LANES;
        let taken = (self.left != 0).then_some((lane, f32::from_bits((nearest >> 32) as u32)));
        self.left &= !(1 << lane);
        taken
    }
}

at_level! {
    /// Calls `found` for every place in the leaves with a measure of at most `most`, which is the least of its first
    /// value and those that `found` returned. Of the nodes below another, the nearest is visited first.
    #[inline]
    pub(crate) fn nearest_first[] [](
        walk: &Walk<'_>, measure: impl Measure, most: f32, found: impl FnMut(usize, f32) -> f32
    ) = Walk::nearest_first;
}

impl Walk<'_> {
    #[inline(always)]
    fn nearest_first<L: Level>(
        &self,
        measure: impl Measure,
        mut most: f32,
        mut found: impl FnMut(usize, f32) -> f32,
        level: L,
    ) {
        let Some(top) = self.levels.iter().rposition(|level| !level.is_empty()) else { return };
        // The nodes of the top have no parent: each 16 of them count as the children of one.
        let mut open = [Open::NONE; MOST_LEVELS + 1];
        for (node, roots) in self.levels[top].chunks(LANES).enumerate() {
            open[top + 1] = Open { node, ..Open::NONE };
            for (k, root) in roots.iter().enumerate() {
                let mut lanes = [0.0; LANES];
                let mut nearest = f32::INFINITY;
                each_bit(measure.measure(root, most, &mut lanes, level), |lane| {
                    open[top + 1].left |= 1 << k;
                    nearest = nearest.min(lanes[lane]);
                });
                open[top + 1].measures[k] = nearest;
            }
            let mut at = top + 1;
            while at <= top + 1 {
                let Some((lane, _)) = open[at].take_nearest().filter(|&(_, nearest)| nearest <= most) else {
                    at += 1;
                    continue;
                };
                let child = open[at].node * LANES + lane;
                at -= 1;
                let below = &mut open[at];
                below.node = child;
                below.left = measure.measure(&self.levels[at][child], most, &mut below.measures, level);
                if at == 0 {
                    each_bit(below.left, |lane| {
                        if below.measures[lane] <= most {
                            most = most.min(found(child * LANES + lane, below.measures[lane]));
                        }
                    });
                    at = 1;
                } else if self.far {
                    let (left, level) = (below.left, &self.levels[at - 1]);
                    each_bit(left, |lane| level.get(child * LANES + lane).into_iter().for_each(prefetch));
                }
            }
        }
    }
}

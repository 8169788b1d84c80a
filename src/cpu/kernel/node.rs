//! Sixteen boxes as columns, tested together against one box.

use super::{Floats, Level};
use crate::Aabb;
use crate::cpu::NOBODY;

/// Boxes in a node.
pub(crate) const LANES: usize = 16;

/// The bounds of up to 16 boxes: six columns, lower bounds first. A lane without a box holds NaN and overlaps nothing.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Node {
    pub(super) low: [[f32; LANES]; 3],
    pub(super) high: [[f32; LANES]; 3],
}

/// Boxes that are compared together with those of a tree.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Group {
    pub(super) node: Node,
    /// The bounds of all boxes.
    pub(super) bounds: Aabb,
    /// Their positions in the input; [`NOBODY`] in an empty lane.
    pub(super) ids: [u32; LANES],
}

impl Node {
    /// No box in any lane.
    pub(crate) const EMPTY: Self = Self { low: [[f32::NAN; LANES]; 3], high: [[f32::NAN; LANES]; 3] };

    /// Writes bounds to a lane.
    #[inline]
    pub(crate) fn set(&mut self, lane: usize, bounds: &Aabb) {
        for a in 0..3 {
            self.low[a][lane] = bounds.min[a];
            self.high[a][lane] = bounds.max[a];
        }
    }

    /// Takes the box out of a lane.
    pub(crate) fn empty(&mut self, lane: usize) {
        self.set(lane, &Aabb::new([f32::NAN; 3], [f32::NAN; 3]));
    }

    /// Returns the bounds in a lane.
    #[inline(always)]
    pub(crate) fn lane(&self, lane: usize) -> Aabb {
        Aabb { min: [0, 1, 2].map(|a| self.low[a][lane]), max: [0, 1, 2].map(|a| self.high[a][lane]) }
    }

    /// Makes a lane contain these bounds too. Returns whether that changed it.
    #[inline]
    pub(crate) fn widen(&mut self, lane: usize, bounds: &Aabb) -> bool {
        let mut changed = false;
        for a in 0..3 {
            let (low, high) = (&mut self.low[a][lane], &mut self.high[a][lane]);
            // NaN in an empty lane compares false, and `min` and `max` prefer any number to it.
            changed |= !((bounds.min[a] >= *low) & (bounds.max[a] <= *high));
            *low = low.min(bounds.min[a]);
            *high = high.max(bounds.max[a]);
        }
        changed
    }

    /// Returns the bounds of all lanes.
    pub(crate) fn bounds(&self) -> Aabb {
        Aabb {
            min: self.low.map(|lanes| lanes.into_iter().fold(f32::NAN, f32::min)),
            max: self.high.map(|lanes| lanes.into_iter().fold(f32::NAN, f32::max)),
        }
    }

    /// Returns half the surface area of the bounds in all lanes, whose edges count as at most `longest`.
    pub(crate) fn half_area(&self, longest: f32) -> f32 {
        let area = |lane: usize| {
            // NaN in an empty lane compares false.
            let edge = |a: usize| {
                let edge = self.high[a][lane] - self.low[a][lane];
                if edge > longest { longest } else { edge }
            };
            let [x, y, z] = [edge(0), edge(1), edge(2)];
            let area = x * y + y * z + z * x;
            if area >= 0.0 { area } else { 0.0 }
        };
        (0..LANES).map(area).sum()
    }

    /// Returns a mask: bit k is set if lane k overlaps a box.
    #[inline(always)]
    pub(super) fn overlapping<L: Level>(&self, b: &Aabb, _: L) -> u32 {
        // SAFETY: the level proves that this CPU has its instructions.
        unsafe {
            let all = L::Lanes::and(self.overlapping_on::<L::Lanes>(0, b), self.overlapping_on::<L::Lanes>(1, b));
            L::Lanes::bits(L::Lanes::and(all, self.overlapping_on::<L::Lanes>(2, b)))
        }
    }

    /// Returns which lanes overlap a box on an axis.
    ///
    /// # Safety
    /// As for all [`Floats`].
    #[inline(always)]
    unsafe fn overlapping_on<F: Floats>(&self, a: usize, b: &Aabb) -> F::Mask {
        // SAFETY: as above; each column has 16 floats.
        unsafe {
            let begins = F::load(self.low[a].as_ptr()).at_most(F::splat(b.max[a]));
            F::and(begins, F::splat(b.min[a]).at_most(F::load(self.high[a].as_ptr())))
        }
    }
}

impl Group {
    /// Makes a group of up to 16 boxes with their ids; `None` without a box.
    #[inline]
    pub(crate) fn of(boxes: impl Iterator<Item = (Aabb, u32)>) -> Option<Self> {
        let mut boxes = boxes.peekable();
        let &(bounds, _) = boxes.peek()?;
        let mut group = Self { node: Node::EMPTY, bounds, ids: [NOBODY; LANES] };
        for (lane, (b, id)) in boxes.enumerate() {
            group.node.set(lane, &b);
            group.bounds = group.bounds.union(&b);
            group.ids[lane] = id;
        }
        Some(group)
    }
}

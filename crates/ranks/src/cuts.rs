//! Regions of space, one for each rank.

use sapwise::Aabb;

/// Space divided by planes into one region for each rank. A plane divides the ranks `first..end` in the middle: the
/// first half is below it, the others are on and above it.
#[derive(Debug, Clone, PartialEq)]
pub struct Cuts {
    /// In pre-order: after a plane those below it, then those above.
    planes: Vec<Plane>,
    regions: Vec<Region>,
}

/// Points whose coordinate is less than `at` are below it. `at` is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    pub(crate) axis: u8,
    pub(crate) at: f32,
}

/// The region of a rank: from `low`, inclusive, to `high`, exclusive. Without a plane a side is infinite and includes
/// infinity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Lowest x, y and z.
    pub low: [f32; 3],
    /// Highest x, y and z.
    pub high: [f32; 3],
}

impl Region {
    /// All of space.
    pub const ALL: Self = Self { low: [f32::NEG_INFINITY; 3], high: [f32::INFINITY; 3] };

    /// Whether it contains a point. `point` has no NaN.
    #[inline]
    pub fn holds(&self, point: [f32; 3]) -> bool {
        (0..3).all(|a| point[a] >= self.low[a] && (point[a] < self.high[a] || self.high[a] == f32::INFINITY))
    }

    /// Whether it contains all of a valid box.
    #[inline]
    pub fn holds_all_of(&self, b: &Aabb) -> bool {
        self.holds(b.min) && self.holds(b.max)
    }

    /// Whether it reports the pair of two overlapping boxes: it contains the lower corner of their intersection.
    /// Exactly one region does, and both boxes overlap it.
    #[inline]
    pub fn finds(&self, a: &Aabb, b: &Aabb) -> bool {
        self.holds([0, 1, 2].map(|k| a.min[k].max(b.min[k])))
    }
}

impl Cuts {
    /// All of space for one rank.
    pub fn one() -> Self {
        Self { planes: Vec::new(), regions: vec![Region::ALL] }
    }

    /// The cuts of planes in pre-order, one fewer than ranks.
    pub(crate) fn new(planes: Vec<Plane>) -> Self {
        let mut cuts = Self { regions: vec![Region::ALL; planes.len() + 1], planes };
        cuts.bound(0, 0, cuts.regions.len(), Region::ALL);
        cuts
    }

    fn bound(&mut self, plane: usize, first: usize, end: usize, region: Region) {
        if end - first == 1 {
            self.regions[first] = region;
            return;
        }
        let (Plane { axis, at }, middle) = (self.planes[plane], middle(first, end));
        let (mut below, mut above) = (region, region);
        // A plane outside the part leaves one side empty.
        below.high[usize::from(axis)] = at.min(region.high[usize::from(axis)]);
        above.low[usize::from(axis)] = at.max(region.low[usize::from(axis)]);
        self.bound(plane + 1, first, middle, below);
        self.bound(plane + middle - first, middle, end, above);
    }

    /// The regions, in the order of the ranks.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// The rank whose region contains a point.
    #[inline]
    pub fn rank_of(&self, point: [f32; 3]) -> usize {
        let (mut plane, mut first, mut end) = (0, 0, self.regions.len());
        while end - first > 1 {
            let (Plane { axis, at }, half) = (self.planes[plane], middle(first, end));
            (plane, first, end) = if point[usize::from(axis)] < at {
                (plane + 1, first, half)
            } else {
                (plane + half - first, half, end)
            };
        }
        first
    }

    /// Calls `visit` with each rank whose region a box overlaps, ascending. A box with a NaN may overlap none.
    #[inline]
    pub fn each_rank_of(&self, b: &Aabb, mut visit: impl FnMut(usize)) {
        // A path has at most one plane for each bit of the number of ranks, and each plane leaves at most one branch
        // for later.
        let mut later = [(0_usize, 0_usize, 0_usize); usize::BITS as usize];
        let mut waiting = 0;
        let (mut plane, mut first, mut end) = (0, 0, self.regions.len());
        loop {
            while end - first > 1 {
                let (Plane { axis, at }, half) = (self.planes[plane], middle(first, end));
                let (below, above) = ((plane + 1, first, half), (plane + half - first, half, end));
                match (b.min[usize::from(axis)] < at, b.max[usize::from(axis)] >= at) {
                    (true, true) => {
                        later[waiting] = above;
                        waiting += 1;
                        (plane, first, end) = below;
                    }
                    (true, false) => (plane, first, end) = below,
                    (false, true) => (plane, first, end) = above,
                    (false, false) => break,
                }
            }
            if end - first == 1 {
                visit(first);
            }
            if waiting == 0 {
                return;
            }
            waiting -= 1;
            (plane, first, end) = later[waiting];
        }
    }
}

/// The first rank of the second half of `first..end`.
pub(crate) fn middle(first: usize, end: usize) -> usize {
    first.midpoint(end)
}

/// The centre of a box, clamped to finite numbers: the point by which the cuts count it.
#[inline]
pub fn centre(b: &Aabb) -> [f32; 3] {
    let bound = |v: f32| v.clamp(f32::MIN, f32::MAX) / 2.0;
    // Adding 0 turns -0 into 0.
    [0, 1, 2].map(|a| bound(b.min[a]) + bound(b.max[a]) + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_scenes::Random;

    fn some(ranks: usize, random: &mut Random) -> Cuts {
        let value = |r: &mut Random| (r.uniform() * 8.0).floor() as f32 - 4.0;
        Cuts::new((1..ranks).map(|_| Plane { axis: (random.bits() % 3) as u8, at: value(random) }).collect())
    }

    #[test]
    fn points_have_one_region_and_boxes_reach_theirs() {
        let mut random = Random::new(1);
        // Few values, so that bounds often lie on planes.
        let special = [f32::NEG_INFINITY, -4.0, -1.0, -0.0, 0.0, 0.5, 1.0, 3.0, f32::INFINITY];
        for ranks in [1, 2, 3, 4, 7, 16, 61] {
            let cuts = some(ranks, &mut random);
            for _ in 0..500 {
                let mut of = || special[(random.bits() % special.len() as u64) as usize];
                let (p, q) = ([of(), of(), of()], [of(), of(), of()]);
                let own = cuts.rank_of(p);
                let holding: Vec<usize> = (0..ranks).filter(|&r| cuts.regions()[r].holds(p)).collect();
                assert_eq!(holding, [own], "{p:?}");
                let b = Aabb::new([0, 1, 2].map(|a| p[a].min(q[a])), [0, 1, 2].map(|a| p[a].max(q[a])));
                let mut reached = Vec::new();
                cuts.each_rank_of(&b, |r| reached.push(r));
                assert!(reached.is_sorted_by(|x, y| x < y), "{reached:?}");
                assert!(reached.contains(&own) && reached.contains(&cuts.rank_of(q)), "{b:?} {reached:?}");
                let inside = cuts.regions()[reached[0]].holds_all_of(&b);
                assert!(!inside || reached.len() == 1, "{b:?} {reached:?}");
                // No region is reached that the box does not touch.
                let touches = |r: &Region| (0..3).all(|a| b.min[a] <= r.high[a] && b.max[a] >= r.low[a]);
                assert!(reached.iter().all(|&r| touches(&cuts.regions()[r])), "{b:?} {reached:?}");
            }
        }
    }

    #[test]
    fn one_region_reports_a_pair_and_both_boxes_reach_it() {
        let mut random = Random::new(2);
        let cuts = some(13, &mut random);
        for _ in 0..5000 {
            let mut cube = || {
                let at = [(); 3].map(|()| (random.uniform() * 16.0).floor() as f32 / 2.0 - 4.0);
                Aabb::cube(at, (random.bits() % 5) as f32 / 2.0)
            };
            let (a, b) = (cube(), cube());
            let finders: Vec<usize> = (0..13).filter(|&r| cuts.regions()[r].finds(&a, &b)).collect();
            assert_eq!(finders.len(), 1);
            if a.overlaps(&b) {
                for one in [&a, &b] {
                    let mut reached = Vec::new();
                    cuts.each_rank_of(one, |r| reached.push(r));
                    assert!(reached.contains(&finders[0]), "{a:?} {b:?} {reached:?} {finders:?}");
                }
            }
        }
    }

    #[test]
    fn the_centre_of_any_box_is_a_number() {
        let inf = f32::INFINITY;
        assert_eq!(centre(&Aabb::new([-inf; 3], [inf; 3])), [0.0; 3]);
        assert_eq!(centre(&Aabb::new([inf; 3], [inf; 3])), [f32::MAX; 3]);
        assert_eq!(centre(&Aabb::new([-0.0; 3], [-0.0; 3])).map(f32::to_bits), [0; 3]);
    }
}

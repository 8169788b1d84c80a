//! What each region holds, finds and sends.

use sapwise::{Aabb, Load};
use sapwise_ranks::{BOX_BYTES, Cuts, PAIR_BYTES, COUNT_BYTES, centre};

/// Counts for each rank.
pub(super) struct Census {
    /// Boxes that overlap its region.
    pub(super) searched: Vec<u64>,
    /// Boxes that it owns and others search, each as often as it is sent.
    sent: Vec<u64>,
    /// Pairs that belong to its region.
    pub(super) found: Vec<u64>,
    /// Those of them that go to another rank.
    returned: Vec<u64>,
    /// For each rank the boxes that it searches, as far as a load is estimated from them: positions.
    members: Vec<Vec<u32>>,
}

impl Census {
    /// Counts boxes that belong to the rank in whose region their middle lies, and their pairs.
    pub(super) fn of(cuts: &Cuts, boxes: &[Aabb], pairs: &[(u32, u32)]) -> Self {
        // Enough for the estimate of a load, which looks at 256 of them.
        const MEMBERS: u64 = 4096;
        let ranks = cuts.regions().len();
        let zeros = || vec![0_u64; ranks];
        let step = (boxes.len() as u64 / ranks as u64 / MEMBERS).max(1);
        let mut census = Self {
            searched: zeros(),
            sent: zeros(),
            found: zeros(),
            returned: zeros(),
            members: vec![Vec::new(); ranks],
        };
        for (k, b) in (0..).zip(boxes) {
            let home = cuts.rank_of(centre(b));
            cuts.each_rank_of(b, |rank| {
                if census.searched[rank].is_multiple_of(step) {
                    census.members[rank].push(k);
                }
                census.searched[rank] += 1;
                census.sent[home] += u64::from(rank != home);
            });
        }
        for &(i, j) in pairs {
            let (a, b) = (&boxes[i as usize], &boxes[j as usize]);
            let finder = cuts.rank_of([0, 1, 2].map(|k| a.min[k].max(b.min[k])));
            census.found[finder] += 1;
            // Positions stand for ids: the pair goes to the owner of the lower one.
            census.returned[finder] += u64::from(cuts.rank_of(centre(&boxes[i.min(j) as usize])) != finder);
        }
        census
    }

    /// The mean of the loads of all ranks, each estimated from some of its boxes.
    pub(super) fn mean_load(&self, boxes: &[Aabb], moved: f64) -> Load {
        let mut own = Vec::new();
        let (mut axis, mut strip) = (0.0, 0.0);
        for (members, (&count, &pairs)) in self.members.iter().zip(self.searched.iter().zip(&self.found)) {
            own.clear();
            own.extend(members.iter().map(|&k| boxes[k as usize]));
            // The shares of all pairs that overlap on an axis and in a strip are those of the members; there are more of all.
            let growth = count as f64 / own.len().max(1) as f64;
            let seen = Load::estimate(&own, Some(pairs as f64 / growth), Some(moved));
            axis += seen.axis_candidates * growth * growth;
            strip += seen.strip_candidates * growth;
        }
        let mean = |v: f64| v / self.searched.len() as f64;
        let sum = |v: &[u64]| v.iter().sum::<u64>() as f64;
        Load::of_objects(mean(sum(&self.searched)).clamp(1.0, f64::from(u32::MAX)) as u32)
            .with_candidates(mean(axis), mean(strip))
            .with_pairs(mean(sum(&self.found)))
            .with_moved(moved)
    }

    /// Bytes that each rank sends in a frame.
    pub(super) fn bytes(&self, ranks: usize) -> Vec<u64> {
        let told = COUNT_BYTES * (ranks as u64 - 1);
        let of = |(sent, returned): (&u64, &u64)| told + BOX_BYTES * sent + PAIR_BYTES * returned;
        self.sent.iter().zip(&self.returned).map(of).collect()
    }
}

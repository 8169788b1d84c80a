//! The contract of every exchange: the owners of boxes get the pairs that one process finds. Shared by the tests over
//! threads and over MPI.
//!
//! Each rank plays the whole scene, passes its own boxes, and compares its pairs with those of all boxes.

#![allow(dead_code, reason = "each test uses some of it")]

use sapwise::error::BoxDefect;
use sapwise::{Aabb, Adaptive, BroadPhase, PairOrder, Pairs, Registry, Tuning};
use sapwise_ranks::{Distributed, Error, Exchange, RankPairs};
use sapwise_scenes::{Random, Scenario};
use std::fmt::Debug;

/// A broad phase with the usual tuning on one core.
pub(crate) fn distributed<E: Exchange>(exchange: impl Into<E>) -> Distributed<E> {
    let registry = Registry::with_cores(1);
    Distributed::new(exchange, &registry, Tuning::usual(&registry)).unwrap()
}

/// An id that uses all 64 bits. Ids are in no order.
pub(crate) fn id(index: usize) -> u64 {
    (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(17)
}

/// Who owns boxes.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Owners {
    /// Any rank; one box in eight changes its owner each frame.
    Random,
    /// Each rank has a contiguous part of the list.
    Parts,
    /// One rank has all boxes, another one in each frame.
    One,
    /// Only the ranks with even numbers have boxes.
    Even,
}

impl Owners {
    pub(crate) fn of(self, index: usize, frame: u64, ranks: usize, all: usize) -> usize {
        match self {
            Self::Random => {
                let epoch = (frame + index as u64) / 8;
                (Random::new(index as u64 ^ epoch << 32).bits() % ranks as u64) as usize
            }
            Self::Parts => index * ranks / all.max(1),
            Self::One => frame as usize % ranks,
            Self::Even => 2 * (index % ranks.div_ceil(2)),
        }
    }
}

/// Every pair by the definition of overlap.
pub(crate) fn naive(boxes: &[Aabb]) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    for (j, b) in (0..).zip(boxes) {
        pairs.extend((0..j).zip(boxes).filter(|(_, a)| a.overlaps(b)).map(|(i, _)| (i, j)));
    }
    pairs
}

/// The pairs that a rank should get.
pub(crate) fn expected(
    pairs: &[(u32, u32)],
    id: impl Fn(usize) -> u64,
    owner: impl Fn(usize) -> usize,
    rank: usize,
    mirrored: bool,
) -> Vec<(u64, u64)> {
    let mut list = Vec::new();
    for &(i, j) in pairs {
        let end = |k: u32| (id(k as usize), owner(k as usize));
        let (first, second) = (end(i).min(end(j)), end(i).max(end(j)));
        if first.1 == rank {
            list.push((first.0, second.0));
        }
        if mirrored && second.1 == rank && first.1 != rank {
            list.push((second.0, first.0));
        }
    }
    list.sort_unstable();
    list
}

/// An empty list in canonical order.
pub(crate) fn list(mirrored: bool) -> RankPairs {
    let mut pairs = RankPairs::with_order(PairOrder::Canonical);
    pairs.set_mirrored(mirrored);
    pairs
}

/// Runs one frame, compares this rank's pairs with its part of `all` and returns their number.
fn compare<E: Exchange>(
    ranks: &mut Distributed<E>,
    what: &dyn Debug,
    (boxes, all): (&[Aabb], &[(u32, u32)]),
    id: impl Fn(usize) -> u64,
    owner: impl Fn(usize) -> usize,
    pairs: &mut RankPairs,
) -> u64 {
    let rank = ranks.rank();
    let own = (0..boxes.len()).filter(|&k| owner(k) == rank).map(|k| (boxes[k], id(k)));
    let (own, ids): (Vec<Aabb>, Vec<u64>) = own.unzip();
    ranks.find_pairs(&own, &ids, pairs).unwrap_or_else(|e| panic!("{what:?}: {e}"));
    let wanted = expected(all, id, owner, rank, pairs.is_mirrored());
    let (found, size) = (pairs.as_slice(), ranks.ranks());
    assert!(found == wanted, "{what:?}: rank {rank} of {size}: {} pairs instead of {}", found.len(), wanted.len());
    wanted.len() as u64
}

/// Runs one frame and compares it with the definition.
pub(crate) fn frame<E: Exchange>(
    ranks: &mut Distributed<E>,
    what: &str,
    boxes: &[Aabb],
    id: impl Fn(usize) -> u64,
    owner: impl Fn(usize) -> usize,
    mirrored: bool,
) {
    compare(ranks, &what, (boxes, &naive(boxes)), id, owner, &mut list(mirrored));
}

/// Plays a scenario and compares every frame with one process and every tenth with the definition. Returns this
/// rank's pairs.
pub(crate) fn play<E: Exchange>(
    ranks: &mut Distributed<E>,
    scenario: Scenario,
    objects: usize,
    frames: u64,
    owners: Owners,
) -> u64 {
    let registry = Registry::with_cores(1);
    let mut alone = Adaptive::new(Tuning::usual(&registry), &registry).unwrap();
    let (mut all, mut count) = (Pairs::new(), 0);
    let mut scene = scenario.start(objects, 1);
    let size = ranks.ranks();
    let mut lists = [list(false), list(true)];
    for frame in 0..frames {
        let boxes = scene.boxes();
        let owner = |k: usize| owners.of(k, frame, size, boxes.len());
        alone.find_pairs(boxes, &mut all).unwrap();
        if frame % 10 == 0 {
            let mut one: Vec<(u32, u32)> = all.as_slice().to_vec();
            let mut definition = naive(boxes);
            one.sort_unstable();
            definition.sort_unstable();
            assert!(one == definition, "{scenario}, frame {frame}: one process is wrong");
        }
        let pairs = &mut lists[usize::from(frame % 3 == 0)];
        count += compare(ranks, &(scenario, owners, frame), (boxes, all.as_slice()), id, owner, pairs);
        scene.advance();
    }
    count
}

/// Frames that are easily wrong.
pub(crate) fn edge_cases<E: Exchange>(ranks: &mut Distributed<E>) {
    let size = ranks.ranks();
    let inf = f32::INFINITY;
    let scene = Scenario::Clustered.start(150, 3);
    let plain = scene.boxes();
    let deal = |k: usize| k % size;
    for mirrored in [false, true] {
        frame(ranks, "no box at all", &[], id, deal, mirrored);
        frame(ranks, "one box", &plain[..1], id, deal, mirrored);
        frame(ranks, "some boxes after none", plain, id, deal, mirrored);
        for one in 0..size {
            frame(ranks, "all boxes on one rank", plain, id, |_| one, mirrored);
        }
        frame(ranks, "ranks without boxes", plain, id, |k| 2 * (k % size.div_ceil(2)), mirrored);
        frame(ranks, "all boxes at one point", &vec![Aabb::cube([3.0; 3], 0.5); 90], id, deal, mirrored);
        frame(ranks, "points", &vec![Aabb::new([-0.0; 3], [0.0; 3]); 40], id, deal, mirrored);
        let mut infinite = plain.to_vec();
        for k in 0..9 {
            let axis = k % 3;
            let b = &mut infinite[16 * k];
            (b.min[axis], b.max[axis]) = [(-inf, inf), (b.min[axis], inf), (-inf, b.max[axis])][k / 3];
        }
        infinite.extend([
            Aabb::new([-inf; 3], [inf; 3]),
            Aabb::new([inf; 3], [inf; 3]),
            Aabb::new([-inf; 3], [-inf; 3]),
        ]);
        frame(ranks, "infinite boxes", &infinite, id, deal, mirrored);
        frame(ranks, "only infinite boxes", &[Aabb::new([-inf; 3], [inf; 3]); 30], id, deal, mirrored);
        let mut large = plain.to_vec();
        large.iter_mut().step_by(10).for_each(|b| *b = Aabb::new(b.min, b.max.map(|m| m + 1000.0)));
        frame(ranks, "boxes larger than a region", &large, id, deal, mirrored);
        // Bounds on and beside the planes of the last frame.
        let planes: Vec<f32> = ranks.cuts().regions().iter().flat_map(|r| r.low).filter(|v| v.is_finite()).collect();
        let touching = planes
            .iter()
            .flat_map(|&p| [(p, p), (p - 1.0, p), (p, p + 1.0), (p.next_down(), p.next_up()), (p.next_up(), p + 1.0)]);
        // Beside a plane at the largest float some are inverted.
        let touching = touching.map(|(low, high)| Aabb::new([low; 3], [high; 3])).filter(|b| b.defect().is_none());
        let touching: Vec<Aabb> = touching.collect();
        frame(ranks, "bounds on the planes", &touching, id, deal, mirrored);
        frame(ranks, "the highest ids", plain, |k| u64::MAX - k as u64, deal, mirrored);
        frame(ranks, "two boxes with each id", plain, |k| k as u64 / 2, deal, mirrored);
        frame(ranks, "one id for all boxes", &plain[..20], |_| 7, deal, mirrored);
    }
    for frame_index in 0..20 {
        frame(ranks, "a rank that sometimes has boxes", plain, id, |k| (k + frame_index / 3 * (k % 2)) % size, false);
    }
    errors(ranks, plain);
}

/// An error on one rank is the same on all, and the next frame is right.
fn errors<E: Exchange>(ranks: &mut Distributed<E>, plain: &[Aabb]) {
    let (rank, size) = (ranks.rank(), ranks.ranks());
    let own: Vec<Aabb> = plain.iter().skip(rank).step_by(size).copied().collect();
    let ids: Vec<u64> = (0..own.len()).map(|k| id(k * size + rank)).collect();
    let after = |ranks: &mut Distributed<E>| frame(ranks, "after an error", plain, id, |k| k % size, false);
    let mut pairs = RankPairs::new();
    for bad in 0..size {
        let mut broken = own.clone();
        if rank >= bad {
            (broken[5].min[1], broken[9].max[0]) = (f32::NAN, f32::NEG_INFINITY);
        }
        let wanted = Error::InvalidBox { rank: bad, index: 5, defect: BoxDefect::NotANumber };
        assert_eq!(ranks.find_pairs(&broken, &ids, &mut pairs), Err(wanted));
        after(ranks);
        broken.clone_from(&own);
        if rank == bad {
            broken[9].max[0] = f32::NEG_INFINITY;
        }
        let wanted = Error::InvalidBox { rank: bad, index: 9, defect: BoxDefect::Inverted };
        assert_eq!(ranks.find_pairs(&broken, &ids, &mut pairs), Err(wanted));
        let few = &ids[..ids.len() - usize::from(rank == bad)];
        let boxes = plain.iter().skip(bad).step_by(size).count() as u64;
        let wanted = Error::MissingIds { rank: bad, boxes, ids: boxes - 1 };
        assert_eq!(ranks.find_pairs(&own, few, &mut pairs), Err(wanted));
        after(ranks);
    }
    // A limit on the last rank, which has more pairs because all boxes overlap.
    let same = vec![Aabb::cube([0.0; 3], 1.0); own.len()];
    pairs.set_limit((rank == size - 1).then_some(3));
    assert_eq!(ranks.find_pairs(&same, &ids, &mut pairs), Err(Error::TooManyPairs { rank: size - 1, limit: 3 }));
    pairs.set_limit(Some(1_000_000));
    assert_eq!(ranks.find_pairs(&same, &ids, &mut pairs), Ok(()));
    after(ranks);
}

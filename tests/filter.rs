//! Filters: every algorithm against the double loop with the definition of the filter.

mod common;

use common::{Random, assert_each_finds, every_algorithm, filtered, naive, naive_filtered};
use sapwise::{Aabb, BroadPhase, Error, Filter, Membership, PairOrder, Pairs, Registry};
use sapwise_scenes::Scenario;

/// Returns random memberships.
fn memberships(count: usize, random: &mut Random) -> Vec<Membership> {
    (0..count).map(|_| random.membership()).collect()
}

fn of(groups: u32, mask: u32) -> Membership {
    Membership { groups, mask, ..Membership::ALL }
}

#[test]
fn wanted_pairs_of_every_scenario() {
    let mut algorithms = every_algorithm();
    let mut random = Random(0xf117);
    let mut canonical = Pairs::with_order(PairOrder::Canonical);
    let mut any = Pairs::new();
    for scenario in Scenario::ALL {
        for objects in [12, 700, if cfg!(feature = "long-tests") { 4000 } else { 2500 }] {
            let mut scene = scenario.start(objects, 42);
            for frame in 0..2 {
                let boxes = scene.boxes();
                // The last boxes have no membership.
                let memberships = memberships(boxes.len() - boxes.len() / 50, &mut random);
                let expected = naive_filtered(boxes, &memberships);
                let all = naive(boxes).len() as u64;
                canonical.set_filter(Some(Filter::new(memberships.clone())));
                any.set_filter(Some(Filter::new(memberships)));
                for (id, algorithm) in &mut algorithms {
                    let what = format!("{id} on {scenario}, frame {frame}");
                    algorithm.find_pairs(boxes, &mut canonical).unwrap();
                    let (found, wanted) = (canonical.len(), expected.len());
                    assert!(canonical.as_slice() == expected, "{what}: {found} pairs, not {wanted}");
                    let searched = canonical.overlapping();
                    assert!((wanted as u64..=all).contains(&searched), "{what}: {searched} of {all}");
                    algorithm.find_pairs(boxes, &mut any).unwrap();
                    assert_eq!(any.fingerprint(), canonical.fingerprint(), "{what}, in any order");
                }
                (0..if scenario == Scenario::Fragmentation { 90 } else { 1 }).for_each(|_| scene.advance());
            }
        }
    }
}

#[test]
fn fixed_ground_has_no_pair_with_itself() {
    let mut scene = Scenario::StaticWorld.start(3000, 42);
    let fixed = |k| Membership { fixed: scene.is_fixed(k), ..Membership::ALL };
    let memberships: Vec<Membership> = (0..3000).map(fixed).collect();
    let mut pairs = filtered(&memberships);
    let mut algorithms = every_algorithm();
    for frame in 0..40 {
        let expected = naive_filtered(scene.boxes(), &memberships);
        assert!((30..400).contains(&expected.len()), "{}", expected.len());
        assert_each_finds(&expected, &mut algorithms, scene.boxes(), &mut pairs, &format!("frame {frame}"));
        scene.advance();
    }
}

/// Long enough for pairs to be kept from frame to frame: an old filter must not decide which pairs are kept.
#[test]
fn memberships_change_while_pairs_are_kept() {
    let mut algorithms = every_algorithm();
    let mut random = Random(71);
    let mut boxes = random.cubes(600, [11.0; 3], 0.6);
    let mut pairs = filtered(&memberships(600, &mut random));
    for frame in 0..60 {
        for b in &mut boxes {
            let by = (random.next() - 0.5) * 0.08;
            (b.min[frame % 3], b.max[frame % 3]) = (b.min[frame % 3] + by, b.max[frame % 3] + by);
        }
        let filter = pairs.filter_mut().unwrap();
        for _ in 0..20 {
            filter.memberships[(random.next() * 500.0) as usize] = random.membership();
        }
        if frame % 9 == 4 {
            boxes.swap_remove(frame);
            filter.memberships.swap_remove(frame);
        }
        if frame % 20 == 10 {
            let filter = pairs.filter().cloned();
            pairs.set_filter(None);
            assert_each_finds(&naive(&boxes), &mut algorithms, &boxes, &mut pairs, "without a filter");
            pairs.set_filter(filter);
        }
        let expected = naive_filtered(&boxes, &pairs.filter().unwrap().memberships);
        assert!(!expected.is_empty() && expected.len() < naive(&boxes).len());
        assert_each_finds(&expected, &mut algorithms, &boxes, &mut pairs, &format!("frame {frame}"));
    }
}

/// Nothing moves, so that pairs are kept: those of two fixed boxes must be found once one of them may move.
#[test]
fn fixed_boxes_are_freed_while_pairs_are_kept() {
    let boxes = Random(5).cubes(1000, [10.0; 3], 0.6);
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    let all = |fixed: &dyn Fn(usize) -> bool| -> Vec<Membership> {
        (0..1000).map(|k| Membership { fixed: fixed(k), ..Membership::ALL }).collect()
    };
    let mut algorithms = every_algorithm();
    // Some frames of each: a ground, one of its boxes free, all free, all fixed, all but one fixed.
    for (stage, memberships) in
        [all(&|k| k % 10 != 0), all(&|k| k % 10 != 0 && k != 77), Vec::new(), all(&|_| true), all(&|k| k != 500)]
            .into_iter()
            .enumerate()
    {
        pairs.set_filter((!memberships.is_empty()).then(|| Filter::new(memberships.clone())));
        let expected = naive_filtered(&boxes, &memberships);
        for frame in 0..6 {
            let what = format!("stage {stage}, frame {frame}");
            assert_each_finds(&expected, &mut algorithms, &boxes, &mut pairs, &what);
        }
    }
}

/// Nothing moves. Few memberships, owners among them, change their boxes and their share, so other boxes are passive.
#[test]
fn few_memberships_change_while_nothing_moves() {
    let mut random = Random(17);
    let boxes = random.cubes(1500, [11.0; 3], 0.6);
    let kinds = [
        of(0b001, 0b010),
        of(0b010, 0b101),
        Membership { fixed: true, ..of(0b100, 0b110) },
        Membership { owner: 5, ..Membership::ALL },
    ];
    let mut algorithms = every_algorithm();
    let mut pairs = filtered(&[kinds[0]; 1450]);
    for frame in 0..24 {
        let changed = [0, 10, 700, 0, 90][frame % 5];
        let kinds = [&kinds[..2], &kinds[..3], &kinds[1..]][frame / 8];
        for _ in 0..changed {
            let kind = kinds[(random.next() * kinds.len() as f32) as usize % kinds.len()];
            pairs.filter_mut().unwrap().memberships[(random.next() * 1449.0) as usize] = kind;
        }
        let expected = naive_filtered(&boxes, &pairs.filter().unwrap().memberships);
        assert_each_finds(&expected, &mut algorithms, &boxes, &mut pairs, &format!("frame {frame}"));
    }
}

/// Returns whether a method rules out every unwanted pair before it finds it, and how many boxes it can take in a
/// scene in which all overlap.
fn kind_of(id: &str) -> (bool, usize) {
    let method = id.split('@').next().unwrap();
    (["bvh", "pair-cache"].contains(&method), if ["brute", "sap"].contains(&method) { 1500 } else { 20_000 })
}

#[test]
fn forbidden_pile_is_not_searched() {
    let kinds = [of(1, 2), Membership { fixed: true, ..Membership::ALL }];
    for (id, mut algorithm) in every_algorithm() {
        let count = kind_of(&id).1;
        let mut pairs = Pairs::new();
        pairs.set_limit(Some(0));
        for kind in kinds {
            pairs.set_filter(Some(Filter::new(vec![kind; count])));
            for _ in 0..4 {
                algorithm.find_pairs(&vec![Aabb::cube([3.0; 3], 0.5); count], &mut pairs).unwrap();
                assert!(pairs.is_empty() && (pairs.overlapping() == 0 || id.starts_with("sap")), "{id}");
            }
        }
    }
}

#[test]
fn crowd_is_searched_from_its_sensors() {
    const SENSORS: usize = 20;
    let boxes = Random(3).cubes(20_000, [7.0; 3], 0.5);
    let memberships: Vec<_> = (0..boxes.len()).map(|k| if k < SENSORS { of(1, 2) } else { of(2, 1) }).collect();
    for (id, mut algorithm) in every_algorithm() {
        let boxes = &boxes[..kind_of(&id).1];
        let meets = |i: usize| (SENSORS..boxes.len()).filter(move |&j| boxes[i].overlaps(&boxes[j]));
        let expected: Vec<_> = (0..SENSORS).flat_map(|i| meets(i).map(move |j| (i as u32, j as u32))).collect();
        let mut pairs = filtered(&memberships);
        for _ in 0..4 {
            algorithm.find_pairs(boxes, &mut pairs).unwrap();
            assert!(pairs.as_slice() == expected && !expected.is_empty(), "{id}: {} pairs", pairs.len());
            let unwanted = pairs.overlapping() - pairs.len() as u64;
            let most = if kind_of(&id).0 { 0 } else { SENSORS as u64 * SENSORS as u64 / 2 };
            assert!(unwanted <= most || id.starts_with("sap"), "{id}: {unwanted} unwanted pairs");
        }
    }
}

#[test]
fn bodies_are_not_searched_within() {
    for (id, mut algorithm) in every_algorithm() {
        // The strips of `grid-sap` know no owners.
        let (early, most) = kind_of(&id);
        let parts = if early { 1739 } else { most.min(5000) / 64 };
        let mut random = Random(8);
        let mut boxes = Vec::new();
        for body in 0..64_usize {
            let corner = [body / 16, body / 4 % 4, body % 4].map(|at| at as f32 * 4.0);
            boxes.extend((0..parts).map(|_| Aabb::cube(corner.map(|at| at + random.next()), 0.5)));
        }
        // A rod without an owner, through a row of bodies.
        boxes.push(Aabb::new([0.0, 0.4, 0.4], [20.0, 0.6, 0.6]));
        let membership = |k: usize| Membership { owner: (k / parts + 1) as u32 % 65, ..Membership::ALL };
        let memberships: Vec<Membership> = (0..boxes.len()).map(membership).collect();
        let (rod, others) = boxes.split_last().unwrap();
        let expected: Vec<_> = (0..others.len() as u32)
            .filter(|&k| others[k as usize].overlaps(rod))
            .map(|k| (k, others.len() as u32))
            .collect();
        let mut pairs = filtered(&memberships);
        for _ in 0..4 {
            algorithm.find_pairs(&boxes, &mut pairs).unwrap();
            assert!(pairs.as_slice() == expected && !expected.is_empty(), "{id}: {} pairs", pairs.len());
            assert!(!early || pairs.overlapping() == pairs.len() as u64, "{id}: {} found", pairs.overlapping());
        }
    }
}

#[test]
fn limit_counts_wanted_pairs_only() {
    // All overlap. Of 1200 boxes the 100 of the second group collide with the 1100 of the first, and with nothing
    // else.
    let boxes = [Aabb::cube([3.0; 3], 1.0); 1200];
    let memberships: Vec<_> = (0..1200).map(|k| if k % 12 == 5 { of(2, 1) } else { of(1, 2) }).collect();
    let mut pairs = filtered(&memberships);
    for (id, mut algorithm) in every_algorithm() {
        for limit in [0, 1, 1000, 109_999] {
            pairs.set_limit(Some(limit));
            assert_eq!(algorithm.find_pairs(&boxes, &mut pairs), Err(Error::TooManyPairs { limit }), "{id}");
        }
        pairs.set_limit(Some(110_000));
        algorithm.find_pairs(&boxes, &mut pairs).unwrap();
        assert!(pairs.len() == 110_000 && pairs.iter().all(|&(i, j)| (i % 12 == 5) != (j % 12 == 5)), "{id}");
    }
}

/// Pushes every pair, in either order of its members.
struct Everything;

impl BroadPhase for Everything {
    fn find_pairs(&mut self, boxes: &[Aabb], pairs: &mut Pairs) -> Result<(), Error> {
        pairs.clear();
        (0..boxes.len() as u32).for_each(|j| (0..j).for_each(|i| pairs.push(j, i)));
        pairs.finish()
    }
}

#[test]
fn users_algorithm_is_filtered() {
    let mut registry = Registry::with_cores(1);
    registry.add("everything@cpu1".parse().unwrap(), 1, || Ok(Box::new(Everything)));
    let mut algorithm = registry.create(&"everything@cpu1".parse().unwrap()).unwrap();
    let boxes = [Aabb::cube([0.0; 3], 1.0); 300];
    let memberships = memberships(290, &mut Random(5));
    let mut pairs = filtered(&memberships);
    algorithm.find_pairs(&boxes, &mut pairs).unwrap();
    assert!(pairs.as_slice() == naive_filtered(&boxes, &memberships));
}

#[test]
fn clone_has_its_own_filter() {
    let mut pairs = Pairs::new();
    pairs.set_filter(Some(Filter::new(vec![Membership::ALL; 2])));
    let clone = pairs.clone();
    pairs.filter_mut().unwrap().memberships[1].mask = 0;
    pairs.push(0, 1);
    assert!(pairs.is_empty());
    assert_eq!(clone.filter().unwrap().memberships[1], Membership::ALL);
}

//! Many worlds in one call, against the double loop in each.

mod common;

use common::{Random, at_every_level, every_algorithm, filtered, naive_filtered};
use sapwise::internals::Pair;
use sapwise::{Aabb, Error, Filter, Membership, PairOrder, Pairs, Worlds};

/// Returns the boxes of worlds of `counts` boxes, and the starts. Some boxes are large, infinite or appear twice.
fn worlds(counts: impl Iterator<Item = usize>, random: &mut Random) -> (Vec<Aabb>, Vec<usize>) {
    let (mut boxes, mut starts) = (Vec::new(), vec![0]);
    for (k, count) in counts.enumerate() {
        let side = [(4.0 * count as f32).cbrt(), 2.0, 100.0][k % 3];
        let mut world = random.cubes(count, [side, side, if k % 5 == 0 { 0.0 } else { side }], 0.5);
        let inf = f32::INFINITY;
        let odd = [
            Aabb::new([-inf; 3], [inf; 3]),
            Aabb::new([inf; 3], [inf; 3]),
            Aabb::new([-inf, 0.0, 0.0], [0.0, inf, 1.0]),
            Aabb::new([f32::MIN; 3], [f32::MAX; 3]),
            Aabb::cube([0.0; 3], 1.0e6),
            Aabb::new([-1.0e-40, -0.0, 0.0], [0.0, 1.0e-40, 0.0]),
        ];
        for _ in 0..if k % 2 == 0 { 0 } else { count / 10 } {
            let at = (random.next() * count as f32) as usize % count;
            let pick = (random.next() * 8.0) as usize;
            world[at] = odd.get(pick).copied().unwrap_or(world[0]);
        }
        boxes.extend(world);
        starts.push(boxes.len());
    }
    (boxes, starts)
}

/// Returns the wanted pairs of each world.
fn expected(boxes: &[Aabb], starts: &[usize], memberships: &[Membership]) -> Vec<Vec<Pair>> {
    let of = |world: &[usize]| {
        let (from, to) = (world[0], world[1]);
        let behind = memberships.get(from..to.min(memberships.len())).unwrap_or_default();
        let pairs = naive_filtered(&boxes[from..to], behind);
        pairs.into_iter().map(|(i, j)| (i + from as u32, j + from as u32)).collect()
    };
    starts.windows(2).map(of).collect()
}

fn assert_agree(boxes: &[Aabb], starts: &[usize], memberships: &[Membership], searches: &mut [(String, Worlds)]) {
    let expected = expected(boxes, starts, memberships);
    for order in [PairOrder::Any, PairOrder::Canonical] {
        let mut pairs = Pairs::with_order(order);
        pairs.set_filter((!memberships.is_empty()).then(|| Filter::new(memberships.to_vec())));
        for (name, search) in &mut *searches {
            search.find_pairs(boxes, starts, &mut pairs).unwrap();
            assert_eq!(search.offsets().len(), starts.len());
            assert_eq!(pairs.len(), search.offsets().last().copied().unwrap_or(0));
            for (k, expected) in expected.iter().enumerate() {
                let mut found = search.pairs_of(k, &pairs).to_vec();
                assert!(order == PairOrder::Any || found.is_sorted());
                found.sort_unstable();
                assert!(found == *expected, "{name}: world {k} of {} boxes", starts[k + 1] - starts[k]);
            }
        }
    }
}

#[test]
fn pairs_are_those_of_each_world() {
    let mut searches = at_every_level(Worlds::new);
    let mut random = Random(23);
    let scenes: [Vec<usize>; 6] = [
        // All sizes around every vector and every word.
        (0..140).chain([255, 256, 257, 0, 0, 511, 512, 513, 700]).collect(),
        (0..90).map(|_| (random.next() * 301.0) as usize).collect(),
        vec![0; 5],
        vec![0, 1, 0, 2, 300, 0],
        vec![31; 400],
        vec![],
    ];
    for counts in scenes {
        let (boxes, starts) = worlds(counts.into_iter(), &mut random);
        let mut memberships: Vec<Membership> = (0..boxes.len()).map(|_| random.membership()).collect();
        // The last boxes have none.
        memberships.truncate(boxes.len() - boxes.len() / 50);
        assert_agree(&boxes, &starts, &[], &mut searches);
        assert_agree(&boxes, &starts, &memberships, &mut searches);
    }
    assert_agree(&[], &[], &[], &mut searches);
}

/// Worlds at the same place, each with a half-space that all its boxes may meet, as worlds and as groups.
#[test]
fn equal_worlds_have_the_same_pairs() {
    let mut one = Random(1).cubes(30, [2.0; 3], 0.12);
    one.iter_mut().for_each(|b| *b = Aabb::new(b.min.map(|v| v - 1.0), b.max.map(|v| v - 1.0)));
    one.push(Aabb::new([-1.0e6; 3], [1.0e6, 1.0e6, 0.0]));
    let boxes = one.repeat(32);
    let starts: Vec<usize> = (0..=32).map(|k| 31 * k).collect();
    let memberships: Vec<Membership> = (0..boxes.len())
        .map(|k| Membership { groups: 1 << (k / 31), mask: 1 << (k / 31), ..Membership::ALL })
        .collect();
    assert_agree(&boxes, &starts, &[], &mut at_every_level(Worlds::new));
    let pairs = naive_filtered(&one, &[]).len();
    assert!(pairs > 10);
    for (id, mut algorithm) in every_algorithm() {
        let mut found = filtered(&memberships);
        algorithm.find_pairs(&boxes, &mut found).unwrap();
        assert!(found.len() == 32 * pairs && found.iter().all(|(i, j)| i / 31 == j / 31), "{id}");
    }
}

#[test]
fn wrong_input_is_an_error() {
    let mut random = Random(5);
    let (boxes, starts) = worlds([600, 31, 300, 20].into_iter().cycle().take(60), &mut random);
    let count = boxes.len();
    let mut pairs = Pairs::new();
    for (name, search) in &mut at_every_level(Worlds::new) {
        for (wrong, index, start) in
            [(vec![], 0, 0), (vec![0], 0, 0), (vec![1, count], 0, 1), (vec![0, 9, 8, count], 2, 8), (vec![0, 9], 1, 9)]
        {
            let error = search.find_pairs(&boxes, &wrong, &mut pairs).unwrap_err();
            assert_eq!(error, Error::InvalidStarts { index, start, boxes: count }, "{name}");
            assert!(error.to_string().contains(&format!("start {index} of the worlds is {start};")), "{error}");
        }
        let mut invalid = boxes.clone();
        invalid[count - 5].max[1] = f32::NAN;
        invalid[650].max[1] = f32::NAN;
        let error = search.find_pairs(&invalid, &starts, &mut pairs).unwrap_err();
        assert!(matches!(error, Error::InvalidBox { index: 650, .. }), "{name}: {error}");
        search.find_pairs(&boxes, &starts, &mut pairs).unwrap();
        let limit = pairs.len();
        pairs.set_limit(Some(limit - 1));
        let error = search.find_pairs(&boxes, &starts, &mut pairs).unwrap_err();
        assert_eq!(error, Error::TooManyPairs { limit: limit - 1 }, "{name}");
        assert!(search.offsets().is_empty());
        pairs.set_limit(Some(limit));
        search.find_pairs(&boxes, &starts, &mut pairs).unwrap();
        assert_eq!(search.offsets().last(), Some(&limit), "{name}");
        pairs.set_limit(None);
    }
}

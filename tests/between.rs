//! Pairs between two lists, against the double loop.

mod common;

use common::{Random, at_every_level, naive_filtered};
use sapwise::{Aabb, Between, Error, Filter, Membership, PairOrder, Pairs};

#[test]
fn pairs_are_those_of_the_double_loop() {
    let mut random = Random(5);
    let mut searches = at_every_level(Between::new);
    let mut pairs = Pairs::with_order(PairOrder::Canonical);
    let inf = f32::INFINITY;
    for (few, many) in [(0, 0), (0, 100), (1, 1), (1, 5000), (17, 40), (300, 4000), (10_000, 12_000)] {
        let side = (4.0 * many as f32).cbrt();
        let mut a = random.cubes(few, [side; 3], 0.5);
        let mut b = random.cubes(many, [side; 3], 0.5);
        if few > 5 {
            // Boxes that touch, that are alike, and that are infinite.
            b[2] = a[4];
            b[3] = Aabb::new(a[5].max, a[5].max);
            a[1] = Aabb::new([-inf; 3], [inf; 3]);
            b[1] = Aabb::new([-inf, 0.0, 0.0], [0.0, inf, 1.0]);
        }
        let membership = |k: usize| Membership { owner: (k % 3) as u32, fixed: k.is_multiple_of(2), ..Membership::ALL };
        let filter = Filter::new((0..few + many).map(membership).collect());
        let both: Vec<Aabb> = a.iter().chain(&b).copied().collect();
        for filter in [None, Some(filter)] {
            let memberships = filter.as_ref().map_or(&[][..], |filter| &filter.memberships);
            let between = |&(i, j): &(u32, u32)| (i as usize) < few && few <= j as usize;
            let expected: Vec<_> = naive_filtered(&both, memberships).into_iter().filter(between).collect();
            pairs.set_filter(filter.clone());
            for (name, search) in &mut searches {
                search.find_pairs(&a, &b, &mut pairs).unwrap();
                assert_eq!(pairs.as_slice(), expected, "{few} and {many}, {name}");
                // The longer list first.
                let swapped = |&(i, j): &(u32, u32)| (j - few as u32, i + many as u32);
                if filter.is_none() {
                    search.find_pairs(&b, &a, &mut pairs).unwrap();
                    let mut expected: Vec<_> = expected.iter().map(swapped).collect();
                    expected.sort_unstable();
                    assert_eq!(pairs.as_slice(), expected, "{many} and {few}, {name}");
                }
            }
        }
    }
}

#[test]
fn errors_count_on_from_the_first_list_to_the_second() {
    let mut pairs = Pairs::new();
    // Lists that are compared, and lists that stand in a tree.
    for count in [50, 300] {
        let boxes = Random(3).cubes(count, [9.0; 3], 0.5);
        let mut invalid = boxes.clone();
        invalid[7].min[1] = f32::NAN;
        for (name, mut search) in at_every_level(Between::new) {
            let lists: [(&[Aabb], &[Aabb], usize); 4] =
                [(&invalid, &boxes, 7), (&boxes, &invalid, count + 7), (&boxes[..2], &invalid, 9), (&invalid, &[], 7)];
            for (a, b, expected) in lists {
                let found = search.find_pairs(a, b, &mut pairs);
                assert!(
                    matches!(found, Err(Error::InvalidBox { index, .. }) if index == expected),
                    "{name}: {found:?}"
                );
            }
            pairs.set_limit(Some(3));
            assert_eq!(search.find_pairs(&boxes, &boxes, &mut pairs), Err(Error::TooManyPairs { limit: 3 }));
            pairs.set_limit(None);
        }
    }
}

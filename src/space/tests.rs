use super::*;
use crate::algorithm::AlgorithmId;
use crate::error::BoxDefect;
use crate::ray::Ray;
use crate::splitmix::mix;
use std::collections::BTreeSet;

type Set = BTreeSet<(Handle, Handle)>;

/// Random numbers.
struct Random(u64);

impl Random {
    fn next(&mut self, end: usize) -> usize {
        self.0 += 1;
        (mix(self.0) % end as u64) as usize
    }

    fn unit(&mut self) -> f32 {
        self.next(1 << 20) as f32 / (1 << 20) as f32
    }

    /// Returns a box in a world of this size. Some are flat, some unbounded.
    fn aabb(&mut self, world: f32) -> Aabb {
        let centre = [0; 3].map(|_| self.unit() * world);
        let mut b = Aabb::cube(centre, 0.3 + 0.4 * self.unit());
        match self.next(400) {
            0 => (b.min[1], b.max[0]) = (f32::NEG_INFINITY, f32::INFINITY),
            1 => b.max[2] = b.min[2],
            _ => {}
        }
        b
    }

    fn body(&mut self) -> Body {
        match self.next(9) {
            8 => Body::default().owner(1 + self.next(3) as u32),
            0 => Body::fixed(),
            1 => Body::kinematic(),
            2 => Body::default().groups(1 << self.next(3)).masks(self.next(8) as u32),
            _ => Body::default(),
        }
    }
}

/// Returns all pairs of a space by a double loop.
fn double_loop(space: &Space) -> Set {
    let all: Vec<_> = space.handles().map(|h| (h, space.get(h).unwrap())).collect();
    let mut pairs = Set::new();
    for (k, &(one, (a, body))) in all.iter().enumerate() {
        for &(other, (b, another)) in &all[..k] {
            if a.overlaps(b) && body.membership().wants(another.membership()) {
                pairs.insert((other, one));
            }
        }
    }
    pairs
}

/// Updates, and compares all lists with what they should be.
fn check(space: &mut Space, before: &mut Set, what: &str) {
    let expected = double_loop(space);
    space.update().unwrap();
    let found: Set = space.pairs().iter().copied().collect();
    assert_eq!(found.len(), space.pairs().len(), "{what}: a pair twice");
    assert!(found == expected, "{what}: {} pairs, not {}", found.len(), expected.len());
    let begun: Vec<_> = expected.difference(before).copied().collect();
    let ended: Vec<_> = before.difference(&expected).copied().collect();
    assert!(space.begun() == begun && space.ended() == ended, "{what}: begun or ended");
    *before = expected;
}

/// Compares queries with what a loop over all bodies finds.
fn check_queries(space: &Space, random: &mut Random, what: &str) {
    let by = random.body();
    let all: Vec<(Handle, Aabb, Body)> =
        space.handles().map(|h| (h, space.get(h).unwrap())).map(|(h, (b, body))| (h, *b, *body)).collect();
    for view in [None, Some(by)] {
        let wanted = |body: &Body| view.is_none_or(|by| by.membership().wants(body.membership()));
        let expected = |meets: &dyn Fn(&Aabb) -> bool| -> Vec<Handle> {
            all.iter().filter(|(_, b, body)| meets(b) && wanted(body)).map(|&(handle, ..)| handle).collect()
        };
        let of = |space| View::of(space, view.as_ref());
        let region = random.aabb(9.0);
        let mut found = Vec::new();
        of(space).query_box(&region, |handle| found.push(handle)).unwrap();
        found.sort();
        assert_eq!(found, expected(&|b| b.overlaps(&region)), "{what}: region");
        let point = [0; 3].map(|_| random.unit() * 9.0);
        found.clear();
        of(space).query_point(point, |handle| found.push(handle)).unwrap();
        found.sort();
        assert_eq!(found, expected(&|b| b.overlaps(&Aabb::new(point, point))), "{what}: point");
        // Along an axis the swept box is exact.
        let length = random.unit() * 9.0;
        let end = [point[0] + length, point[1], point[2]];
        let ray = Ray { max: 1.0, ..Ray::new(point, [length, 0.0, 0.0]) };
        found.clear();
        of(space)
            .cast_ray(&ray, |handle, _| {
                found.push(handle);
                f32::INFINITY
            })
            .unwrap();
        found.sort();
        let met = expected(&|b| b.overlaps(&Aabb::new(point, end)));
        assert!(found.iter().zip(&met).filter(|(a, b)| a == b).count() + 1 >= met.len(), "{what}: ray");
        let mut first = None;
        for &handle in &found {
            let low = (space.get(handle).unwrap().0.min[0] - point[0]) * (1.0 / length);
            let t = low.max(0.0);
            first = first.filter(|&(_, least)| least <= t).or(Some((handle, t)));
        }
        assert_eq!(of(space).first_hit(&ray).unwrap(), first, "{what}: first hit");
        let distance = |b: &Aabb| {
            let away = [0, 1, 2].map(|a| (b.min[a] - point[a]).max(point[a] - b.max[a]).max(0.0));
            away.iter().map(|v| v * v).sum::<f32>().sqrt()
        };
        let mut near: Vec<(Handle, f32)> =
            all.iter().filter(|(_, _, body)| wanted(body)).map(|(h, b, _)| (*h, distance(b))).collect();
        near.sort_by(|(a, one), (b, other)| one.total_cmp(other).then(a.cmp(b)));
        near.truncate(5);
        let found = of(space).nearest(point, 5).unwrap();
        assert_eq!(found.iter().map(|n| n.1).collect::<Vec<_>>(), near.iter().map(|n| n.1).collect::<Vec<_>>());
    }
}

/// Inserts, sets and removes at random; at times most bodies rest, and at times all wake.
fn random_calls(space: &mut Space, seed: u64, mut look: impl FnMut(&mut Space, usize)) -> [bool; 2] {
    let mut random = Random(seed << 32);
    let mut handles: Vec<Handle> = (0..300).map(|_| space.insert(random.aabb(9.0), random.body()).unwrap()).collect();
    let mut rested = [false; 2];
    for frame in 0..160 {
        let moving = match frame / 40 {
            0 | 2 => handles.len(),
            1 => 8,
            _ => 20,
        };
        for _ in 0..moving {
            let handle = handles[if frame % 40 < 30 { random.next(moving) } else { random.next(handles.len()) }];
            let mut b = *space.get(handle).unwrap().0;
            let by = [0; 3].map(|_| random.unit() * 0.2 - 0.1);
            (0..3).for_each(|a| (b.min[a], b.max[a]) = (b.min[a] + by[a], b.max[a] + by[a]));
            space.set(handle, b).unwrap();
        }
        for _ in 0..random.next(4) {
            match random.next(5) {
                0 => {
                    let at = random.next(handles.len());
                    space.remove(handles.swap_remove(at)).unwrap();
                }
                1 => handles.push(space.insert(random.aabb(9.0), random.body()).unwrap()),
                2 => {
                    // Gone before any update has seen it.
                    let gone = space.insert(random.aabb(9.0), random.body()).unwrap();
                    space.remove(gone).unwrap();
                }
                3 => space.set_body(handles[random.next(handles.len())], random.body()).unwrap(),
                _ => space.set(handles[random.next(handles.len())], random.aabb(9.0)).unwrap(),
            }
        }
        look(space, frame);
        rested[usize::from(space.resting.len() > 0)] = true;
    }
    rested
}

fn only(algorithm: &str) -> Space {
    let id: AlgorithmId = algorithm.parse().unwrap();
    Space::with(Adaptive::only(id, &Registry::new()).unwrap())
}

#[test]
fn random_calls_give_the_pairs_of_a_double_loop() {
    for seed in 0..6 {
        let (mut space, mut before) = (Space::new(), Set::new());
        let mut random = Random(1000 + seed);
        let (mut twin, mut saved) = (Space::new(), Space::new());
        let rested = random_calls(&mut space, seed, |space, frame| {
            let what = format!("seed {seed}, frame {frame}");
            if frame % 7 == 3 {
                twin.clone_from(space);
            }
            check(space, &mut before, &what);
            check_queries(space, &mut random, &what);
            if frame % 7 == 3 {
                twin.update().unwrap();
                let lists = |space: &Space| [space.pairs(), space.begun(), space.ended()].map(<[_]>::to_vec);
                assert!(lists(&twin) == lists(space), "{what}: clone");
                check_queries(&twin, &mut random, &what);
                saved.clone_from(space);
                check_queries(&saved, &mut random, &what);
            }
        });
        assert_eq!(rested, [true; 2]);
    }
}

#[test]
fn lists_depend_on_the_calls_alone() {
    let lists = |mut space: Space| {
        let mut lists = Vec::new();
        random_calls(&mut space, 77, |space, _| {
            space.update().unwrap();
            lists.push([space.pairs().to_vec(), space.begun().to_vec(), space.ended().to_vec()]);
        });
        lists
    };
    let first = lists(Space::new());
    for algorithm in ["brute@cpu1", "sap@cpu1", "pair-cache@cpu1"] {
        assert!(lists(only(algorithm)) == first, "{algorithm}");
    }
}

#[test]
fn bodies_that_are_not_set_rest_and_wake() {
    let mut space = Space::new();
    let grid = |k: usize| Aabb::cube([(k % 40) as f32, (k / 40) as f32, 0.0], 0.5);
    let boxes: Vec<Aabb> = (0..1600).map(grid).collect();
    let handles = space.insert_all(&boxes, Body::default()).unwrap();
    space.update().unwrap();
    let all = space.pairs().len();
    for _ in 0..=IDLE {
        space.set(handles[0], boxes[0]).unwrap();
        space.update().unwrap();
        assert_eq!((space.pairs().len(), space.begun(), space.ended()), (all, &[][..], &[][..]));
    }
    assert_eq!((space.active.len(), space.resting.len(), space.links.len()), (1, 1599, all - 3));
    // One that wakes without a change keeps its pairs.
    space.set(handles[41], boxes[41]).unwrap();
    space.update().unwrap();
    assert_eq!((space.active.len(), space.pairs().len(), space.begun().len()), (2, all, 0));
    space.remove(handles[82]).unwrap();
    space.update().unwrap();
    assert_eq!((space.pairs().len(), space.ended().len()), (all - 8, 8));
    assert!(space.ended().iter().all(|&(a, b)| a == handles[82] || b == handles[82]));
    space.set_all(&handles[..82], &boxes[..82]).unwrap();
    space.set_all(&handles[83..], &boxes[83..]).unwrap();
    space.update().unwrap();
    assert_eq!((space.resting.len(), space.pairs().len(), space.links.len()), (0, all - 8, 0));
}

#[test]
fn fixed_bodies_rest_at_once_but_not_right_after_they_were_set() {
    let mut space = Space::new();
    let boxes: Vec<Aabb> = (0..400).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.4)).collect();
    let fixed = space.insert_all(&boxes, Body::fixed()).unwrap();
    let active: Vec<usize> = (0..14)
        .map(|update| {
            if update == 4 {
                space.set(fixed[7], Aabb::cube([7.0, 1.0, 0.0], 0.4)).unwrap();
            }
            space.update().unwrap();
            space.active.len()
        })
        .collect();
    assert_eq!(active, [400, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0]);
}

#[test]
fn call_that_fails_changes_nothing() {
    let mut space = Space::new();
    let unit = Aabb::cube([0.0; 3], 1.0);
    let one = space.insert(unit, Body::default()).unwrap();
    let gone = space.insert(unit, Body::default()).unwrap();
    space.update().unwrap();
    space.remove(gone).unwrap();
    let stale = Err(Error::StaleHandle { handle: gone });
    let nan = Aabb::new([f32::NAN; 3], [1.0; 3]);
    let inverted = Aabb::new([2.0; 3], [1.0; 3]);
    let other = Aabb::cube([9.0; 3], 1.0);
    for _ in 0..2 {
        assert_eq!(space.set(gone, unit), stale);
        assert_eq!(space.set_body(gone, Body::fixed()), stale);
        assert_eq!(space.remove(gone), stale);
        assert_eq!(space.set_all(&[one, gone], &[other; 2]), stale);
        assert_eq!(space.remove_all(&[one, gone]), stale);
        assert!(!space.contains(gone) && space.get(gone).is_none());
        let defect = BoxDefect::NotANumber;
        assert_eq!(space.set(one, nan), Err(Error::InvalidBody { handle: one, defect }));
        assert_eq!(space.insert_all(&[unit, nan], Body::fixed()), Err(Error::InvalidBox { index: 1, defect }));
        let defect = BoxDefect::Inverted;
        assert_eq!(space.set_all(&[one, one], &[other, inverted]), Err(Error::InvalidBody { handle: one, defect }));
        assert_eq!(space.insert(inverted, Body::fixed()), Err(Error::InvalidBox { index: 0, defect }));
        assert_eq!((space.len(), space.get(one)), (1, Some((&unit, &Body::default()))));
        space.update().unwrap();
    }
    // The slot is used again, the handle is not.
    let again = space.insert(unit, Body::default()).unwrap();
    assert!(again != gone && again.slot() == gone.slot());
    assert_eq!(space.set(gone, unit), stale);
    assert_eq!(Handle::from_bits(again.to_bits()), Some(again));
    assert_eq!((Handle::from_bits(0), size_of::<Option<Handle>>()), (None, 8));
    let foreign = Handle::from_bits(u64::MAX).unwrap();
    assert_eq!(space.remove(foreign), Err(Error::StaleHandle { handle: foreign }));
}

#[test]
fn queries_leave_out_what_was_removed_since_and_report_bad_input() {
    let mut space = Space::new();
    let handles = space.insert_all(&[Aabb::cube([0.0; 3], 1.0), Aabb::cube([1.0; 3], 1.0)], Body::default()).unwrap();
    space.update().unwrap();
    let at = |space: &Space| {
        let mut found = Vec::new();
        space.query_point([0.5; 3], |handle| found.push(handle)).unwrap();
        found
    };
    assert_eq!(at(&space), handles);
    space.remove(handles[0]).unwrap();
    // Where it was at the last update.
    space.set(handles[1], Aabb::cube([9.0; 3], 1.0)).unwrap();
    assert_eq!(at(&space), handles[1..]);
    space.update().unwrap();
    assert_eq!(at(&space), []);
    let nan = [f32::NAN, 0.0, 0.0];
    assert!(matches!(space.nearest(nan, 1), Err(Error::InvalidRay { .. })));
    assert!(matches!(space.query_point(nan, drop), Err(Error::InvalidBox { index: 0, .. })));
    assert!(matches!(space.first_hit(&Ray::new([0.0; 3], [0.0; 3])), Err(Error::InvalidRay { .. })));
    let unit = Aabb::cube([9.0; 3], 0.5);
    assert!(matches!(space.cast_box(&unit, nan, |_, t| t), Err(Error::InvalidRay { .. })));
    let mut met = 0;
    space
        .cast_box(&unit, [0.0; 3], |_, t| {
            met += 1;
            t
        })
        .unwrap();
    assert_eq!(met, 1);
    assert_eq!(Space::new().nearest([0.0; 3], 3), Ok(vec![]));
}

#[test]
fn threads_may_query_at_once() {
    let mut space = Space::new();
    let boxes: Vec<Aabb> = (0..500).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.4)).collect();
    let handles = space.insert_all(&boxes, Body::default()).unwrap();
    space.update().unwrap();
    let (space, handles) = (&space, &handles);
    std::thread::scope(|scope| {
        for start in 0..4 {
            scope.spawn(move || {
                for k in (start..500).step_by(4) {
                    let ray = Ray::new([k as f32, 5.0, 0.0], [0.0, -1.0, 0.0]);
                    assert_eq!(space.first_hit(&ray), Ok(Some((handles[k], 4.6))));
                }
            });
        }
    });
}

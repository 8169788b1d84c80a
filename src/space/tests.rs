use super::*;
use crate::Ray;

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
fn pairs_with_resting_bodies_stay_right_while_these_wake_move_and_rest_again() {
    let mut state = 7;
    let mut draw = |below: u64| crate::splitmix::next(&mut state) % below;
    let mut space = Space::new();
    let at = |x: u64, y: u64| Aabb::cube([x as f32 * 0.7, y as f32 * 0.7, 0.0], 0.5);
    let mut boxes: Vec<Aabb> = (0..900).map(|k| at(k % 30, k / 30)).collect();
    let mut bodies = vec![Body::default(); boxes.len()];
    let mut handles = space.insert_all(&boxes, Body::default()).unwrap();
    let (mut together, mut woken, mut failed) = (0, 0, 0);
    for update in 0..300 {
        // Few of the first thirty move in each update; others wake now and then, some of them where they were.
        for _ in 0..draw(12) {
            let among = if draw(4) == 0 { 900 } else { 30 };
            let k = draw(among) as usize;
            if draw(3) > 0 {
                boxes[k] = at(draw(30), draw(30));
            }
            match draw(8) {
                0 => {
                    bodies[k] = Body::default().groups(1 << draw(2)).masks(1 << draw(2));
                    space.set_body(handles[k], bodies[k]).unwrap();
                    space.set(handles[k], boxes[k]).unwrap();
                }
                1 => {
                    space.remove(handles[k]).unwrap();
                    handles[k] = space.insert(boxes[k], bodies[k]).unwrap();
                }
                _ => space.set(handles[k], boxes[k]).unwrap(),
            }
        }
        if draw(16) == 0 {
            space.set_limit(Some(0));
            failed += usize::from(space.update().is_err());
            space.set_limit(None);
        }
        space.update().unwrap();
        together += usize::from(space.active.len() > 1 && space.resting.len() > 0);
        woken += usize::from(!space.resting.arrived.is_empty());
        let slots: Vec<u32> = handles.iter().map(|handle| handle.slot()).collect();
        let mut right: Vec<(u32, u32)> = (0..boxes.len())
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .filter(|&(i, j)| boxes[i].overlaps(&boxes[j]) && bodies[i].membership().wants(bodies[j].membership()))
            .map(|(i, j)| (slots[i].min(slots[j]), slots[i].max(slots[j])))
            .collect();
        right.sort_unstable();
        let mut found: Vec<(u32, u32)> = space.pairs().iter().map(|(a, b)| (a.slot(), b.slot())).collect();
        found.iter_mut().for_each(|pair| *pair = (pair.0.min(pair.1), pair.0.max(pair.1)));
        found.sort_unstable();
        let only = |one: &[(u32, u32)], other: &[(u32, u32)]| -> Vec<(u32, u32)> {
            one.iter().filter(|pair| other.binary_search(pair).is_err()).copied().collect()
        };
        let wrong = (only(&found, &right), only(&right, &found));
        assert!(found == right, "update {update}, only found and missing: {wrong:?}");
    }
    assert!(together > 200 && woken > 200 && failed > 5, "{together} {woken} {failed}");
}

#[test]
fn update_beyond_the_limit_is_an_error() {
    let mut space = Space::new();
    let cube = Aabb::cube([0.0; 3], 1.0);
    let handles = space.insert_all(&[cube; 2], Body::default()).unwrap();
    space.set_limit(Some(1));
    space.update().unwrap();
    space.insert_all(&[cube; 3], Body::default()).unwrap();
    for _ in 0..2 {
        assert_eq!(space.update(), Err(Error::TooManyPairs { limit: 1 }));
        assert!(space.begun().is_empty() && space.ended().is_empty());
    }
    assert_eq!(space.clone().update(), Err(Error::TooManyPairs { limit: 1 }));
    space.remove(handles[0]).unwrap();
    space.set_limit(None);
    space.update().unwrap();
    assert_eq!((space.pairs().len(), space.begun().len(), space.ended().len()), (6, 6, 1));
}

#[test]
fn bodies_stay_active_longer_the_more_often_they_are_set() {
    let mut space = Space::new();
    let boxes: Vec<Aabb> = (0..400).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.4)).collect();
    let fixed = space.insert_all(&boxes, Body::fixed()).unwrap();
    let active: Vec<usize> = (0..14)
        .map(|update| {
            if [2, 4, 5, 6].contains(&update) {
                space.set(fixed[7], Aabb::cube([7.0, update as f32, 0.0], 0.4)).unwrap();
            }
            space.update().unwrap();
            space.active.len()
        })
        .collect();
    assert_eq!(active, [400, 0, 1, 0, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0]);
}

#[test]
fn slot_is_used_again_and_its_handle_is_not() {
    let mut space = Space::new();
    let unit = Aabb::cube([0.0; 3], 1.0);
    let gone = space.insert(unit, Body::default()).unwrap();
    space.remove(gone).unwrap();
    space.update().unwrap();
    let again = space.insert(unit, Body::default()).unwrap();
    assert!(again != gone && again.slot() == gone.slot());
    assert_eq!(space.set(gone, unit), Err(Error::StaleHandle { handle: gone }));
    assert_eq!(Handle::from_bits(again.to_bits()), Some(again));
    assert_eq!((Handle::from_bits(0), size_of::<Option<Handle>>()), (None, 8));
}

#[test]
fn rays_need_a_direction_and_boxes_no_motion() {
    let mut space = Space::new();
    space.insert(Aabb::cube([9.0; 3], 1.0), Body::default()).unwrap();
    space.update().unwrap();
    assert!(matches!(space.all().first_hit(&Ray::new([0.0; 3], [0.0; 3])), Err(Error::InvalidRay { .. })));
    let mut met = 0;
    let count = |_, t| {
        met += 1;
        t
    };
    space.all().cast_box(&Aabb::cube([9.0; 3], 0.5), [0.0; 3], count).unwrap();
    assert_eq!(met, 1);
}

#[test]
fn clones_see_resting_bodies_at_the_last_update() {
    let mut space = Space::new();
    let row: Vec<Aabb> = (0..100).map(|k| Aabb::cube([k as f32, 0.0, 0.0], 0.4)).collect();
    let handles = space.insert_all(&row, Body::fixed()).unwrap();
    (0..2).for_each(|_| space.update().unwrap());
    assert_eq!(space.resting.len(), 100);
    for x in [200.0, 300.0] {
        space.set(handles[7], Aabb::cube([x, 0.0, 0.0], 0.4)).unwrap();
    }
    for space in [space.clone(), space] {
        assert_eq!(space.all().nearest([7.0, 0.0, 0.0], 1), Ok(vec![(handles[7], 0.0)]));
        assert_eq!(space.all().nearest([300.0, 0.0, 0.0], 1).unwrap()[0].0, handles[99]);
    }
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
                    assert_eq!(space.all().first_hit(&ray), Ok(Some((handles[k], 4.6))));
                }
            });
        }
    });
}

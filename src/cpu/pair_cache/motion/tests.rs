use super::*;
use crate::scene::{Scenario, Scene};

fn keeps(scenario: Scenario) -> bool {
    let mut scene = Scene::start(scenario, 2000, 1);
    let mut motion = Motion::new(false);
    motion.advise(&FramePlan::default(), scene.boxes());
    motion.found(2000, 1000);
    scene.advance();
    matches!(motion.advise(&FramePlan::default(), scene.boxes()), Advice::Keep(_))
}

#[test]
fn pairs_are_kept_where_boxes_move_little_and_not_where_they_move_far() {
    assert!(keeps(Scenario::Resting) && keeps(Scenario::Uniform));
    assert!(!keeps(Scenario::Fast));
}

#[test]
fn too_many_pairs_are_not_kept_and_a_failure_is_not_tried_again_at_once() {
    let boxes = vec![Aabb::cube([0.0; 3], 1.0); 500];
    let mut motion = Motion::new(false);
    for pairs in [500 * 499 / 2, 1000] {
        motion.found(500, pairs);
        motion.advise(&FramePlan::default(), &boxes);
        assert_eq!(matches!(motion.advise(&FramePlan::default(), &boxes), Advice::Keep(_)), pairs == 1000);
    }
    for pause in [PAUSE[0], 4 * PAUSE[0]] {
        motion.stop(false);
        assert!((0..pause).all(|_| matches!(motion.advise(&FramePlan::default(), &boxes), Advice::Scratch)));
        assert!(matches!(motion.advise(&FramePlan::default(), &boxes), Advice::Keep(_)));
        // The next pause is twice as long, and frames that others run count.
        motion.stop(false);
        motion.missed(u64::from(2 * pause));
        let known = FramePlan::default().with_moved(Some(0.0));
        assert!(matches!(motion.advise(&known, &boxes), Advice::Keep(_)));
    }
}

#[test]
fn a_pause_ends_when_boxes_that_moved_too_far_come_to_rest() {
    let paused = |kept: u32, too_many: bool, moves: [f64; 2]| {
        let boxes = vec![Aabb::cube([0.0; 3], 1.0); 1000];
        let plan = |moved| FramePlan::default().with_moved(Some(moved)).with_pairs(Some(500.0));
        let mut motion = Motion::new(false);
        motion.advise(&plan(0.001), &boxes);
        let changes = Changes { left: 0, jumped: 0, new: 0..0, gone: 0..0 };
        let did = Work { kept_pairs: 500, nodes: 0, rebuilt: false };
        assert!((0..kept).all(|_| motion.learn(1000, &changes, &did, 0.0)));
        motion.keeping.as_mut().unwrap().tests = 0.0;
        motion.stop(too_many);
        let paused = |at: &u32| {
            let moved = if *at < 8 { moves[0] } else { moves[1] };
            matches!(motion.advise(&plan(moved), &boxes), Advice::Scratch)
        };
        (0..PAUSE[0]).take_while(paused).count() as u32
    };
    assert!((8..8 + LOOK).contains(&paused(KEPT_WELL, false, [0.2, 0.01])));
    assert!(paused(KEPT_WELL, false, [0.0, 0.0]) <= LOOK);
    // Crowds stay crowds, a little less is no rest, and what never paid is left alone.
    let waited = [(KEPT_WELL, true, 0.01), (KEPT_WELL, false, 0.15), (1, false, 0.01)];
    assert_eq!(waited.map(|(kept, too_many, moved)| paused(kept, too_many, [0.2, moved])), [PAUSE[0]; 3]);
}

#[test]
fn frames_that_others_ran_count_for_a_pause_and_end_it_where_boxes_have_come_to_rest_and_are_no_crowd() {
    let boxes = vec![Aabb::cube([0.0; 3], 1.0); 1000];
    let plan = |moved| FramePlan::default().with_moved(Some(moved)).with_pairs(Some(500.0));
    let changes = Changes { left: 0, jumped: 0, new: 0..0, gone: 0..0 };
    let did = Work { kept_pairs: 500, nodes: 0, rebuilt: false };
    // Frames from scratch after so many of others, where boxes moved so far before and move so far now.
    let paused = |too_many: bool, missed: u64, moves: [f64; 2]| {
        let mut motion = Motion::new(false);
        motion.advise(&plan(moves[0]), &boxes);
        motion.learn(1000, &changes, &did, 0.0);
        motion.keeping.as_mut().unwrap().tests = 0.0;
        motion.stop(too_many);
        motion.missed(missed);
        let scratch = |_: &u32| matches!(motion.advise(&plan(moves[1]), &boxes), Advice::Scratch);
        (0..2 * PAUSE[0]).take_while(scratch).count() as u32
    };
    assert_eq!((paused(false, 1, [0.05, 0.0]), paused(false, 1, [0.05, 0.02])), (0, 0));
    // At the same pace only the frames count, and in a crowd at rest too.
    for (too_many, moves) in [(false, [0.05, 0.05]), (true, [0.05, 0.0]), (true, [0.0, 0.0])] {
        let left = [1, 8, 100].map(|missed| paused(too_many, missed, moves));
        assert!((PAUSE[0] - LOOK..PAUSE[0]).contains(&left[0]) && (8 - LOOK..=8).contains(&left[1]), "{left:?}");
        assert_eq!(left[2], 0);
    }
}

#[test]
fn where_half_of_the_boxes_leave_at_once_the_margin_stays_unless_they_move_at_another_pace() {
    let boxes = vec![Aabb::cube([0.0; 3], 1.0); 1000];
    let plan = |moved| FramePlan::default().with_moved(Some(moved)).with_pairs(Some(500.0));
    let share_after = |moved: f64| {
        let mut motion = Motion::new(false);
        motion.advise(&plan(0.02), &boxes);
        // As found in many frames.
        motion.keeping.as_mut().unwrap().margin.share = 0.123;
        motion.advise(&plan(moved), &boxes);
        let left = Changes { left: 600, jumped: 0, new: 400..1000, gone: 0..0 };
        motion.renew(&plan(moved), &boxes, &left).share
    };
    assert_eq!(share_after(0.021), 0.123);
    assert!(share_after(0.1) > 0.123 && share_after(0.0) < 0.123);
}

#[test]
fn boxes_are_sorted_anew_when_queries_have_become_expensive() {
    let mut motion = Motion::new(false);
    let boxes = vec![Aabb::cube([0.0; 3], 1.0); 1000];
    motion.found(1000, 0);
    (0..2).for_each(|_| _ = motion.advise(&FramePlan::default(), &boxes));
    let changes = Changes { left: 10, jumped: 0, new: 0..0, gone: 0..0 };
    let did = |nodes: u64, rebuilt| Work { kept_pairs: 1000, nodes: nodes * 10, rebuilt };
    motion.learn(1000, &changes, &did(0, true), 0.0);
    let mut frames = |nodes: u64| {
        (0..20).for_each(|_| _ = motion.learn(1000, &changes, &did(12, false), 0.0));
        let wants = |_: &u32| {
            motion.learn(1000, &changes, &did(nodes, false), 0.0);
            !motion.wants_renewal(1000)
        };
        let frames = (0..1000).take_while(wants).count();
        motion.renewed();
        frames
    };
    let [good, worse, bad] = [12, 24, 100].map(&mut frames);
    assert!(good == 1000 && worse < 100 && bad < worse / 4, "{good}, {worse} and {bad} frames");
}

#[test]
fn boxes_with_too_wide_a_margin_all_get_a_smaller_one_within_some_frames() {
    let mut motion = Motion::new(false);
    let boxes = vec![Aabb::cube([0.0; 3], 1.0); 1000];
    motion.found(1000, 1000);
    (0..2).for_each(|_| _ = motion.advise(&FramePlan::default(), &boxes));
    let keeping = motion.keeping.as_mut().unwrap();
    (keeping.margin.share, keeping.grown) = (0.4, 0.4);
    assert!(motion.next_to_shrink(1000).is_empty());
    motion.keeping.as_mut().unwrap().missed = 1.0e6;
    let ranges: Vec<_> = (0..200).map(|_| motion.next_to_shrink(1000)).take_while(|r| !r.is_empty()).collect();
    assert!((ranges[0].start, ranges[ranges.len() - 1].end) == (0, 1000) && ranges.iter().all(|r| r.len() < 20));
    assert!(ranges.windows(2).all(|two| two[0].end == two[1].start));
    assert_eq!(motion.keeping.unwrap().margin.share, 0.2);
}

#[test]
fn where_no_boxes_overlap_the_margin_is_no_larger_than_slow_boxes_need_and_few_pairs_may_be_kept() {
    let boxes = vec![Aabb::cube([0.0; 3], 1.0); 1000];
    let mut motion = Motion::new(false);
    motion.found(1000, 0);
    let plan = FramePlan::default().with_moved(Some(0.005));
    motion.advise(&plan, &boxes);
    let Advice::Keep(margin) = motion.advise(&plan, &boxes) else { panic!("slow boxes are worth keeping") };
    assert!((MARGINS[0]..=0.15).contains(&margin.share), "{}", margin.share);
    assert!(motion.most_kept(1000) < 10_000, "{}", motion.most_kept(1000));
}

#[test]
fn a_margin_that_keeps_too_many_pairs_is_halved_and_one_that_too_many_leave_is_not() {
    let boxes = vec![Aabb::cube([0.0; 3], 1.0); 1000];
    let margin_after = |kept_pairs: usize, left: usize| {
        let mut motion = Motion::new(false);
        motion.found(1000, 0);
        let plan = FramePlan::default().with_moved(Some(0.05));
        let keep = |motion: &mut Motion| loop {
            if let Advice::Keep(margin) = motion.advise(&plan, &boxes) {
                return margin.share;
            }
        };
        let first = keep(&mut motion);
        let changes = Changes { left, jumped: 0, new: 0..0, gone: 0..0 };
        let did = Work { kept_pairs, nodes: 12 * left as u64, rebuilt: false };
        assert!((0..100).any(|_| !motion.learn(1000, &changes, &did, 0.0)), "it never ceases to pay");
        motion.stop(false);
        keep(&mut motion) / first
    };
    let (crowded, restless) = (margin_after(40_000, 0), margin_after(0, 1000));
    assert!(crowded <= 0.5, "{crowded}");
    assert!(restless > 0.9, "{restless}");
}

//! The slice of loads over which the tuning of this machine is shown.

use crate::load::Load;

/// The scenario of the slice.
pub(super) const SCENARIO: &str = "uniform";

/// Loads of the second frame of that scenario, seed 1, with as many pairs as its density lets expect, at four numbers of objects a
/// decade: objects, candidates on the sweep axis, candidates in the strips, pairs, and how far boxes move.
///
/// They are data, since a program that starts has no time to make scenes of a hundred thousand boxes.
const LOADS: [(u32, f64, f64, f64, f64); 17] = [
    (10, 12.0, 12.0, 1.6, 0.0396031),
    (18, 45.0, 45.0, 4.78854, 0.0365256),
    (32, 138.0, 138.0, 12.0389, 0.0356014),
    (56, 375.685, 375.685, 24.0331, 0.0375706),
    (100, 778.427, 778.427, 38.2354, 0.0386832),
    (178, 2572.57, 2572.57, 95.001, 0.036737),
    (316, 7984.49, 7984.49, 140.296, 0.0383399),
    (562, 19_648.0, 19_648.0, 239.138, 0.0366376),
    (1000, 52_565.0, 52_565.0, 477.864, 0.0376989),
    (1778, 130_513.0, 37_603.6, 845.615, 0.0382525),
    (3162, 357_771.0, 73_767.8, 1700.08, 0.039468),
    (5623, 812_254.0, 69_745.7, 2595.9, 0.0369507),
    (10_000, 2_218_370.0, 56_588.0, 4607.76, 0.0378708),
    (17_783, 6_064_710.0, 155_948.0, 9181.48, 0.0391059),
    (31_623, 16_176_200.0, 231_059.0, 15_926.9, 0.0380901),
    (56_234, 42_434_000.0, 524_935.0, 28_844.4, 0.0388207),
    (100_000, 103_859_000.0, 485_763.0, 46_952.7, 0.0376105),
];

/// Loads of the scenario `uniform`, from ten to a hundred thousand objects.
pub(super) fn loads() -> Vec<Load> {
    let load = |(objects, axis, strip, pairs, moved)| {
        Load::of_objects(objects).with_candidates(axis, strip).with_pairs(pairs).with_moved(moved)
    };
    LOADS.map(load).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::Displacement;
    use crate::scene::{Scenario, Scene};

    #[test]
    fn the_loads_are_those_of_the_scenario() {
        for shipped in loads() {
            let mut scene = Scene::start(Scenario::Uniform, shipped.objects as usize, 1);
            let mut displacement = Displacement::default();
            displacement.watch(scene.boxes());
            scene.advance();
            let found = Load::estimate(scene.boxes(), None, displacement.moved(scene.boxes()));
            let figures = |l: &Load| [f64::from(l.objects), l.axis_candidates, l.strip_candidates, l.pairs, l.moved];
            let same = figures(&shipped).into_iter().zip(figures(&found)).all(|(a, b)| (a / b - 1.0).abs() < 1e-5);
            assert!(same, "{shipped:?} is shipped, {found:?} is found");
        }
    }

    #[test]
    fn they_ascend_from_ten() {
        let loads = loads();
        assert_eq!((loads[0].objects, loads[16].objects), (10, 100_000));
        assert!(loads.is_sorted_by(|a, b| a.objects < b.objects && a.axis_candidates <= b.axis_candidates));
    }
}

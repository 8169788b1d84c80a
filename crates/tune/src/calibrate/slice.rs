//! The loads for which the steps and crossovers of a predicted tuning are worked out.

use sapwise::algorithm::Load;

/// The scenario of these loads.
pub(super) const SCENARIO: &str = "uniform";

/// Loads of the second frame of `uniform`, seed 1, with the expected number of pairs: objects, candidates on the
/// sweep axis, candidates in the strips, pairs, and motion.
///
/// Stored, because a program that starts has no time to make scenes of a hundred thousand boxes.
const LOADS: [(u32, f64, f64, f64, f64); 17] = [
    (10, 12.0, 12.0, 1.6, 0.0396031),
    (18, 45.0, 45.0, 4.78854, 0.0365256),
    (32, 138.0, 138.0, 12.0389, 0.0356014),
    (56, 341.532, 341.532, 20.2366, 0.0375706),
    (100, 908.165, 908.165, 32.9576, 0.0375645),
    (178, 2699.61, 2699.61, 84.9662, 0.0398718),
    (316, 6298.88, 6298.88, 126.81, 0.0400617),
    (562, 17_211.0, 17_211.0, 237.08, 0.0369964),
    (1000, 47_546.3, 47_546.3, 514.57, 0.0390051),
    (1778, 123_716.0, 34_905.0, 800.433, 0.0382787),
    (3162, 326_416.0, 44_242.2, 1440.94, 0.0394135),
    (5623, 868_923.0, 76_725.5, 2799.95, 0.036419),
    (10_000, 2_328_910.0, 116_558.0, 5274.08, 0.0377781),
    (17_783, 6_098_620.0, 153_985.0, 9276.52, 0.0388095),
    (31_623, 15_517_500.0, 227_683.0, 15_512.4, 0.0383518),
    (56_234, 40_012_000.0, 352_795.0, 28_916.9, 0.0377392),
    (100_000, 103_859_000.0, 634_435.0, 48_174.0, 0.0383483),
];

/// Loads from ten to a hundred thousand objects, four a decade.
pub(super) fn loads() -> Vec<Load> {
    let load = |(objects, axis, strip, pairs, moved)| {
        Load::of_objects(objects).with_candidates(axis, strip).with_pairs(pairs).with_moved(moved)
    };
    LOADS.map(load).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise::algorithm::Displacement;
    use sapwise_scenes::Scenario;

    #[test]
    fn stored_loads_are_those_of_the_scenario() {
        for stored in loads() {
            let mut scene = Scenario::Uniform.start(stored.objects as usize, 1);
            let mut displacement = Displacement::default();
            displacement.watch(scene.boxes());
            scene.advance();
            let found = Load::estimate(scene.boxes(), None, displacement.motion(scene.boxes()));
            let figures = |l: &Load| [f64::from(l.objects), l.axis_candidates, l.strip_candidates, l.pairs, l.moved];
            let same = figures(&stored).into_iter().zip(figures(&found)).all(|(a, b)| (a / b - 1.0).abs() < 1e-5);
            assert!(same && stored.moved_share == found.moved_share, "stored {stored:?}, found {found:?}");
        }
    }
}

//! The loads of the slice that a tuning shows.

use crate::load::Load;

/// The scenario of the slice.
pub(super) const SCENARIO: &str = "uniform";

/// Its loads over the number of objects, four sizes a decade from ten to a hundred thousand: objects, candidates on the sweep axis, those
/// in a strip, pairs, and how far boxes move. They are data since a program that starts has no time to make scenes.
const LOADS: [(u32, f64, f64, f64, f64); 17] = [
    (10, 20.0, 20.0, 7.0, 0.0345),
    (18, 41.0, 41.0, 4.0, 0.0340),
    (32, 131.0, 131.0, 7.0, 0.0375),
    (56, 388.1, 388.1, 29.0, 0.0380),
    (100, 988.0, 988.0, 42.0, 0.0369),
    (178, 2699.6, 2699.6, 84.0, 0.0384),
    (316, 6653.7, 6653.7, 136.0, 0.0389),
    (562, 23608.1, 23608.1, 245.0, 0.0387),
    (1000, 49131.1, 49131.1, 454.0, 0.0397),
    (1778, 131_872.7, 39_393.9, 849.0, 0.0397),
    (3162, 331_239.8, 71_282.8, 1515.0, 0.0400),
    (5623, 820_972.0, 71_724.4, 2681.0, 0.0370),
    (10_000, 2_328_912.8, 83_921.9, 4992.0, 0.0367),
    (17_783, 6_069_550.9, 124_524.0, 8578.0, 0.0379),
    (31_623, 16_130_232.5, 217_170.4, 15_603.0, 0.0388),
    (56_234, 42_046_496.0, 492_271.8, 27_759.0, 0.0370),
    (100_000, 101_408_299.6, 493_444.4, 49_536.0, 0.0393),
];

/// The loads of the slice.
pub(super) fn loads() -> Vec<Load> {
    let load = |&(objects, axis, strip, pairs, moved): &(u32, f64, f64, f64, f64)| {
        Load::of_objects(objects).with_candidates(axis, strip).with_pairs(pairs).with_moved(moved)
    };
    LOADS.iter().map(load).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slice_ascends_from_ten() {
        let loads = loads();
        assert_eq!((loads[0].objects, loads[loads.len() - 1].objects), (10, 100_000));
        assert!(loads.is_sorted_by(|a, b| a.objects < b.objects && a.axis_candidates <= b.axis_candidates));
        // The density of the scenario, and boxes that move a little.
        assert!(loads.iter().all(|l| l.moved > 0.0 && l.moved < 0.2), "{loads:?}");
        let last = &loads[loads.len() - 1];
        assert!(last.pairs > 1000.0 && last.pairs < last.strip_candidates, "{last:?}");
    }
}

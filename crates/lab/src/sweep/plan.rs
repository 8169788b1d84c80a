//! Scenarios, sizes and time of a sweep.

use sapwise_scenes::Scenario;
use std::time::Duration;

/// Scenarios, sizes and time of a sweep.
///
/// One ascent for each scenario runs every algorithm through all sizes, for the shape of the cost curves. Rounds of
/// visits to sizes where the best algorithms are close follow.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// In the order of measurement.
    pub ascents: Vec<Ascent>,
    /// Rounds of visits, minutes apart. The load of the host differs between them, so medians over several rounds are
    /// more reliable than the same number of samples at once.
    pub rounds: u32,
    /// Time for everything. The visits get the time that the ascents leave.
    pub total: Duration,
}

/// One scenario through its sizes.
#[derive(Debug, Clone, PartialEq)]
pub struct Ascent {
    /// The kind of scene.
    pub scenario: Scenario,
    /// Numbers of objects, ascending.
    pub sizes: Vec<u32>,
    /// Time for all sizes. A slower machine reaches fewer sizes in that time.
    pub time: Duration,
}

/// The densities that shift the crossovers most: even, in blobs, and with box sizes over two decades.
const QUICK: [Scenario; 3] = [Scenario::Uniform, Scenario::Clustered, Scenario::Mixed];
const QUICK_OBJECTS: u32 = 300_000;
const QUICK_PER_DECADE: u32 = 3;
const QUICK_ROUNDS: u32 = 1;
/// A quick probe may take 30 s. The hardware, starting and writing take the rest.
const QUICK_TOTAL: Duration = Duration::from_secs(21);

/// Those densities with every kind of motion, on which the incremental algorithms depend.
const FULL: [Scenario; 10] = [
    Scenario::Uniform,
    Scenario::Clustered,
    Scenario::Slab,
    Scenario::Mixed,
    Scenario::Fast,
    Scenario::Gravity,
    Scenario::Fragmentation,
    Scenario::Brownian,
    Scenario::FreeFall,
    Scenario::Resting,
];
/// Hard scenarios show how slow a method gets, not its crossovers: one size a decade and a quarter of the time are
/// enough.
const HARD_PER_DECADE: u32 = 1;
const HARD_SHARE: f64 = 0.25;
/// Smaller scenes are not hard.
const HARD_FROM: u32 = 1000;
const FULL_OBJECTS: u32 = 1_000_000;
const FULL_PER_DECADE: u32 = 4;
const FULL_ROUNDS: u32 = 3;
/// A probe may take three minutes.
const FULL_TOTAL: Duration = Duration::from_secs(160);

/// Share of the time for the ascents.
const ASCENT_SHARE: f64 = 0.6;

impl Plan {
    /// Returns the usual plan, or that of the user's scenarios and largest size.
    ///
    /// A quick plan has no hard scenarios, a full one has them at fewer sizes. Scenarios that the user names are
    /// measured in full.
    pub fn new(quick: bool, scenarios: &[Scenario], max_objects: Option<u32>) -> Self {
        let (usual, usual_hard, objects, per_decade, rounds, total) = if quick {
            (&QUICK[..], &[][..], QUICK_OBJECTS, QUICK_PER_DECADE, QUICK_ROUNDS, QUICK_TOTAL)
        } else {
            (&FULL[..], &Scenario::HARD[..], FULL_OBJECTS, FULL_PER_DECADE, FULL_ROUNDS, FULL_TOTAL)
        };
        let (even, hard) = if scenarios.is_empty() { (usual, usual_hard) } else { (scenarios, &[][..]) };
        let max = max_objects.unwrap_or(objects);
        let shares = |even: &[Scenario], hard: &[Scenario]| even.len() as f64 + hard.len() as f64 * HARD_SHARE;
        // More scenarios than usual share the time; fewer get no more than usual each.
        let total = total.min(total.mul_f64(shares(even, hard) / shares(usual, usual_hard)));
        let time = total.mul_f64(ASCENT_SHARE / shares(even, hard));
        let ascent = |&scenario: &Scenario| Ascent { scenario, sizes: sizes(max, per_decade), time };
        let mut hard_sizes = sizes(max, HARD_PER_DECADE);
        hard_sizes.retain(|&objects| objects >= HARD_FROM.min(max));
        let hard_ascent =
            |&scenario: &Scenario| Ascent { scenario, sizes: hard_sizes.clone(), time: time.mul_f64(HARD_SHARE) };
        Self { ascents: even.iter().map(ascent).chain(hard.iter().map(hard_ascent)).collect(), rounds, total }
    }
}

/// Returns sizes from 10 to `max`, `per_decade` of them in a decade.
fn sizes(max: u32, per_decade: u32) -> Vec<u32> {
    let each = f64::from(per_decade);
    let grid = (per_decade..).map(|k| 10.0_f64.powf(f64::from(k) / each).round() as u32);
    // A size just below the last takes as long as the last and adds nothing.
    let mut sizes: Vec<u32> = grid.take_while(|&n| f64::from(n) * 1.2 < f64::from(max)).collect();
    sizes.push(max);
    sizes
}

/// Returns the share of the remaining time for the first of these sizes. It grows with the cube root of the size:
/// small sizes need time to measure foreign load, large ones for frames.
pub fn share(sizes_left: &[u32]) -> f64 {
    let weight = |n: &u32| f64::from(*n).cbrt();
    let all: f64 = sizes_left.iter().map(weight).sum();
    sizes_left.first().map_or(0.0, |first| weight(first) / all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_even_in_the_logarithm_and_end_at_the_largest() {
        assert_eq!(sizes(100, 4), [10, 18, 32, 56, 100]);
        assert_eq!(sizes(10, 3), [10]);
        assert_eq!(sizes(1_000_000, 4).len(), 21);
        assert_eq!(&sizes(300_000, 3)[12..], [100_000, 215_443, 300_000]);
    }

    #[test]
    fn the_plans_stay_within_their_time() {
        for quick in [true, false] {
            let plan = Plan::new(quick, &[], None);
            let limit = if quick { 30 } else { 180 };
            // Eight seconds for the hardware, starting and writing.
            assert!(plan.total + Duration::from_secs(8) < Duration::from_secs(limit));
            assert!(plan.ascents.iter().map(|a| a.time).sum::<Duration>() < plan.total);
        }
        let all = Plan::new(true, &Scenario::ALL, Some(100));
        assert_eq!((all.total, all.ascents.len()), (QUICK_TOTAL, Scenario::ALL.len()));
        assert_eq!(Plan::new(true, &[Scenario::Slab], None).total, QUICK_TOTAL / 3);
    }

    #[test]
    fn hard_scenarios_take_a_quarter_of_the_time_unless_they_are_named() {
        let plan = Plan::new(false, &[], None);
        let of = |plan: &Plan, scenario| plan.ascents.iter().find(|a| a.scenario == scenario).unwrap().clone();
        let (uniform, parked) = (of(&plan, Scenario::Uniform), of(&plan, Scenario::Parked));
        assert_eq!((uniform.sizes.len(), &parked.sizes[..]), (21, &[1000, 10_000, 100_000, 1_000_000][..]));
        assert!((parked.time.as_secs_f64() / uniform.time.as_secs_f64() - HARD_SHARE).abs() < 1e-6);
        assert_eq!(plan.ascents.len(), FULL.len() + Scenario::HARD.len());
        assert!(Scenario::HARD.iter().all(|s| !FULL.contains(s)));
        let named = Plan::new(false, &[Scenario::Parked], None);
        assert_eq!(of(&named, Scenario::Parked), Ascent { scenario: Scenario::Parked, ..uniform });
        assert_eq!(of(&Plan::new(false, &[], Some(300)), Scenario::Parked).sizes, [300]);
    }

    #[test]
    fn shares_use_up_the_time() {
        assert_eq!(share(&[1000]), 1.0);
        assert!((share(&[1000, 8000]) - 1.0 / 3.0).abs() < 1e-12);
    }
}

//! What a sweep measures and how long it may take.

use sapwise::Scenario;
use std::time::Duration;

/// Scenarios, sizes and time of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plan {
    /// In the order of measurement. A scenario may come twice, minutes apart: what the host does in the meantime differs, and
    /// medians over both are worth more than twice the samples at once.
    pub(crate) scenarios: Vec<Scenario>,
    /// Numbers of objects, ascending.
    pub(crate) sizes: Vec<u32>,
    /// Time for each scenario. A slower machine gets fewer sizes in that time, not more time.
    pub(crate) each: Duration,
}

/// Spread over the densities that shift the borders most: even, in blobs, and with sizes over two decades.
const QUICK: [Scenario; 3] = [Scenario::Uniform, Scenario::Clustered, Scenario::Mixed];
const QUICK_OBJECTS: u32 = 300_000;
/// Of the 60 s that a quick probe may take, 4.5 s are for the hardware; the rest is for starting and writing.
const QUICK_TOTAL: Duration = Duration::from_secs(48);

/// Times that a full probe goes through its scenarios.
const FULL_ROUNDS: usize = 2;
const FULL: [Scenario; 7] = [
    Scenario::Uniform,
    Scenario::Clustered,
    Scenario::Slab,
    Scenario::Mixed,
    Scenario::Fast,
    Scenario::Gravity,
    Scenario::Fragmentation,
];
const FULL_OBJECTS: u32 = 1_000_000;
/// Of the 5 minutes that a probe may take.
const FULL_TOTAL: Duration = Duration::from_secs(270);

impl Plan {
    /// The usual plan, with the user's scenarios and largest size where they are given.
    pub(crate) fn new(quick: bool, scenarios: &[Scenario], max_objects: Option<u32>) -> Self {
        let (usual, objects, total) = if quick {
            (QUICK.to_vec(), QUICK_OBJECTS, QUICK_TOTAL)
        } else {
            (FULL.repeat(FULL_ROUNDS), FULL_OBJECTS, FULL_TOTAL)
        };
        let each = total / usual.len() as u32;
        let scenarios = if scenarios.is_empty() { usual } else { scenarios.to_vec() };
        // More scenarios than usual share the time; fewer don't get more than usual each.
        let each = each.min(total / scenarios.len() as u32);
        Self { scenarios, sizes: sizes(max_objects.unwrap_or(objects)), each }
    }

    /// Points when every size fits into the time.
    pub(crate) fn points(&self) -> u64 {
        self.scenarios.len() as u64 * self.sizes.len() as u64
    }
}

/// Four sizes a decade from 10 up, and `max` as the last.
fn sizes(max: u32) -> Vec<u32> {
    let grid = (4..).map(|k| 10.0_f64.powf(f64::from(k) / 4.0).round() as u32);
    // A size just below the last would cost as much as the last and tell nothing new.
    let mut sizes: Vec<u32> = grid.take_while(|&n| f64::from(n) * 1.2 < f64::from(max)).collect();
    sizes.push(max);
    sizes
}

/// Share of the time left that the first of these sizes gets.
///
/// Time for a point grows with the cube root of the size: small ones need it to tell foreign load, large ones for frames.
pub(crate) fn share(sizes_left: &[u32]) -> f64 {
    let weight = |n: &u32| f64::from(*n).cbrt();
    let all: f64 = sizes_left.iter().map(weight).sum();
    sizes_left.first().map_or(0.0, |first| weight(first) / all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_four_a_decade_and_end_at_the_largest() {
        assert_eq!(sizes(100), [10, 18, 32, 56, 100]);
        assert_eq!(sizes(10), [10]);
        assert_eq!(sizes(1_000_000).len(), 21);
        assert_eq!(&sizes(300_000)[16..], [100_000, 177_828, 300_000]);
    }

    #[test]
    fn the_plans_stay_within_their_minutes() {
        for quick in [true, false] {
            let plan = Plan::new(quick, &[], None);
            let limit = if quick { 60 } else { 300 };
            assert!(plan.each * plan.scenarios.len() as u32 + Duration::from_secs(6) < Duration::from_secs(limit));
        }
        let all = Plan::new(true, &Scenario::ALL, Some(100));
        assert!(all.each * 10 <= QUICK_TOTAL);
        assert_eq!(all.points(), 50);
    }

    #[test]
    fn shares_use_up_the_time() {
        assert_eq!(share(&[1000]), 1.0);
        assert!((share(&[1000, 8000]) - 1.0 / 3.0).abs() < 1e-12);
    }
}

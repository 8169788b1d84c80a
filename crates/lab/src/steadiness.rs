//! Whether a machine stayed the same while it was measured, as far as the latency between its cores tells.
//!
//! A hypervisor moves the cores of a guest from one group of cores to another. What several threads gain changes with it by half, so
//! timings from before and after are those of two machines.

use crate::report::{Point, Report};
use serde::Serialize;

/// A latency beyond this factor of the usual one is that of another placement of the cores.
const ANOTHER: f64 = 1.5;
/// Share of the points up to which a change is a disturbance of single points and not of the report.
const FEW: f64 = 0.1;

/// The latency between cores over the points of a report.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Steadiness {
    /// The usual latency in nanoseconds: the lower median, which is one that was measured where there are two placements.
    pub core_to_core_ns: f64,
    /// The least and the most.
    pub range_ns: [f64; 2],
    /// Share of the points before or after which it was more than half as much again, or that much less.
    pub elsewhere: f64,
}

impl Steadiness {
    /// The steadiness over the points of a report; `None` for one core, and for reports that don't say.
    #[must_use]
    pub fn of(report: &Report) -> Option<Self> {
        let all: Vec<[f64; 2]> = report.points.iter().filter_map(|p: &Point| p.core_to_core_ns).collect();
        let mut sorted = all.as_flattened().to_vec();
        sorted.sort_by(f64::total_cmp);
        let (&least, &most) = (sorted.first()?, sorted.last()?);
        let usual = sorted[(sorted.len() - 1) / 2];
        let near = |ns: &f64| alike(*ns, usual);
        let elsewhere = all.iter().filter(|both| !both.iter().all(near)).count();
        let elsewhere = elsewhere as f64 / all.len() as f64;
        Some(Self { core_to_core_ns: usual, range_ns: [least, most], elsewhere })
    }

    /// Whether the cores stayed where they were.
    #[must_use]
    pub fn is_steady(self) -> bool {
        self.elsewhere <= FEW
    }

    /// Whether two measurements found the cores in the same placement.
    #[must_use]
    pub fn is_like(self, other: Self) -> bool {
        self.is_steady() && other.is_steady() && alike(self.core_to_core_ns, other.core_to_core_ns)
    }

    /// What the reader of a report should know, if anything.
    #[must_use]
    pub fn remark(self) -> Option<String> {
        let Self { core_to_core_ns, range_ns: [least, most], elsewhere } = self;
        (!self.is_steady()).then(|| {
            format!(
                "the machine changed: the latency between cores went from {least:.0} to {most:.0} ns, and was not near its usual \
                 {core_to_core_ns:.0} ns at {:.0} % of the points; what several threads gain changes with it",
                elsewhere * 100.0
            )
        })
    }
}

fn alike(a: f64, b: f64) -> bool {
    a <= ANOTHER * b && b <= ANOTHER * a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Machine;

    fn report(latencies: &[[f64; 2]]) -> Report {
        let mut report = Machine::family()[0].report();
        for (k, point) in report.points.iter_mut().enumerate() {
            point.core_to_core_ns = latencies.get(k % latencies.len().max(1)).copied();
        }
        report
    }

    #[test]
    fn cores_that_were_moved_are_told_and_a_single_point_is_not() {
        assert_eq!(Steadiness::of(&report(&[])), None);
        let near = Steadiness::of(&report(&[[23.0, 24.0], [20.0, 28.0]])).unwrap();
        assert!(near.is_steady() && near.remark().is_none() && near.elsewhere == 0.0);
        let moved = Steadiness::of(&report(&[[23.0, 24.0], [23.0, 175.0]])).unwrap();
        assert!(!moved.is_steady() && moved.elsewhere > 0.4);
        assert!(moved.remark().is_some_and(|r| r.contains("50 %")), "{moved:?}");
        let far = Steadiness::of(&report(&[[175.0, 179.0]])).unwrap();
        assert!(far.is_steady() && !far.is_like(near) && !moved.is_like(near) && near.is_like(near));
    }
}

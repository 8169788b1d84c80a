//! Which algorithms leave a sweep before the largest size.

/// An algorithm that takes this many times as long as the best is hopeless. It leaves when it falls behind as well.
const HOPELESS: f64 = 8.0;

/// Growth of that ratio since the previous size from which on an algorithm falls behind: smaller growth is noise. On
/// an H200 noise made `grid-sap` leave `mixed` at 1000 objects, at 18 × the best there and at the previous size.
const FALLS_BEHIND: f64 = 1.1;

/// Ratio at which an algorithm leaves when time is short: a crossover between fast algorithms is worth more than
/// another point of a slow one.
const SLOW: f64 = 3.0;

/// Nobody leaves below this size: a frame takes microseconds there, and ratios jump from size to size.
const JUDGED_FROM: u32 = 1000;

/// `brute` stays up to this size even when it is hopeless: the paper's crossovers need its curve.
const BRUTE_STAYS_BELOW: u32 = 3000;

/// The race of one algorithm through the sizes of a scenario.
#[derive(Debug, Clone, Default)]
pub struct Standing {
    /// Its time over the best at the previous size.
    before: Option<f64>,
    /// Whether it has left.
    pub out: bool,
}

impl Standing {
    /// Takes a slow algorithm out because time is short, and returns its time over the best.
    pub fn leave_if_slow(&mut self) -> Option<f64> {
        let slow = self.before.filter(|&ratio| ratio > SLOW);
        self.out |= slow.is_some();
        slow
    }

    /// Judges the algorithm after a size at which it took `ratio` times as long as the best.
    ///
    /// A slow one that gains on the others stays: parallel versions start far behind and win in the end.
    pub fn judge(&mut self, ratio: f64, method: &str, objects: u32) {
        let falls_behind = self.before.is_some_and(|before| ratio > FALLS_BEHIND * before);
        let kept = method == "brute" && objects < BRUTE_STAYS_BELOW;
        self.out |= ratio > HOPELESS && falls_behind && !kept && objects >= JUDGED_FROM;
        self.before = Some(ratio);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn out(method: &str, course: &[(f64, u32)]) -> bool {
        let mut standing = Standing::default();
        course.iter().for_each(|&(ratio, objects)| standing.judge(ratio, method, objects));
        standing.out
    }

    #[test]
    fn hopeless_and_falling_behind_leaves() {
        assert!(out("sap", &[(7.0, 1000), (9.0, 2000)]));
        assert!(!out("sap", &[(9.0, 1000)]));
        assert!(!out("grid-sap", &[(17.9, 562), (18.0, 1000)]));
        assert!(!out("sap", &[(50.0, 10), (20.0, 100), (9.0, 1000)]));
        assert!(!out("sap", &[(2.0, 1000), (7.9, 2000)]));
        assert!(!out("sap", &[(20.0, 10), (30.0, 18), (9.0, 1000)]));
    }

    #[test]
    fn where_time_is_short_the_slow_leave_at_once() {
        let mut standing = Standing::default();
        assert_eq!(standing.leave_if_slow(), None);
        standing.judge(2.0, "sap", 10);
        assert_eq!(standing.leave_if_slow(), None);
        standing.judge(4.0, "sap", 18);
        assert_eq!((standing.leave_if_slow(), standing.out), (Some(4.0), true));
    }

    #[test]
    fn brute_force_stays_to_three_thousand() {
        assert!(!out("brute", &[(9.0, 562), (20.0, 1778)]));
        assert!(out("brute", &[(9.0, 1778), (20.0, 3162)]));
    }
}

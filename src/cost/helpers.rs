//! The cost of work on several threads.

/// How several threads change the cost of work on one.
///
/// The caller begins while its helpers wake. A helper that wakes too late finds nothing left: the frame then takes
/// the time of one thread, plus the time to call the helpers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Helpers {
    /// Threads, including the caller.
    pub threads: u32,
    /// Nanoseconds to call all of them.
    pub call_ns: f64,
    /// Nanoseconds of one thread's work that are lost while they wake.
    pub late_ns: f64,
    /// Speed-up of all threads over one.
    pub speed_up: f64,
    /// Boxes that keep one thread busy: a frame uses one thread for each so many boxes. 0: it uses all threads.
    pub boxes_per_thread: u32,
}

impl Helpers {
    /// Creates helpers that are called for free, wake at once, and are as fast as the caller.
    pub fn new(threads: u32) -> Self {
        Self { threads, call_ns: 0.0, late_ns: 0.0, speed_up: f64::from(threads), boxes_per_thread: 0 }
    }

    /// Returns the nanoseconds of a frame of `objects` boxes that takes `work_ns` on one thread.
    pub fn cost_ns(&self, objects: u32, work_ns: f64) -> f64 {
        let Some(share) = self.share(objects) else { return work_ns };
        let speed_up = 1.0 + share * (self.speed_up - 1.0);
        share * self.call_ns + work_ns.min((work_ns + self.late_ns) / speed_up)
    }

    /// Returns the share of the helpers that a frame of `objects` boxes calls; `None` if it calls none.
    fn share(&self, objects: u32) -> Option<f64> {
        if self.boxes_per_thread == 0 || self.threads < 2 {
            return (self.threads > 1).then_some(1.0);
        }
        let called = (objects / self.boxes_per_thread).min(self.threads).max(1) - 1;
        (called > 0).then(|| f64::from(called) / f64::from(self.threads - 1))
    }

    /// Returns whether its values are possible.
    pub(super) fn is_sound(&self) -> bool {
        let times = [self.call_ns, self.late_ns];
        self.threads > 1
            && times.iter().all(|ns| (0.0..=super::MOST_UNIT_NS).contains(ns))
            && (0.01..=f64::from(u32::MAX)).contains(&self.speed_up)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_helper_costs_its_call_and_an_early_one_saves_its_share() {
        let two = Helpers { call_ns: 100.0, late_ns: 5000.0, speed_up: 1.8, ..Helpers::new(2) };
        // (1000 + 5000) / 1.8 is more than 1000: the caller is done first.
        assert_eq!(two.cost_ns(10, 1000.0), 1100.0);
        assert_eq!(two.cost_ns(10, 85_000.0), 50_100.0);
    }

    #[test]
    fn a_frame_calls_as_many_as_its_boxes_keep_busy() {
        let five = Helpers { boxes_per_thread: 1024, call_ns: 400.0, ..Helpers::new(5) };
        assert_eq!(five.cost_ns(2047, 6000.0), 6000.0);
        assert_eq!(five.cost_ns(2048, 6000.0), 3100.0);
        assert_eq!(five.cost_ns(1_000_000, 6000.0), 1600.0);
    }

    #[test]
    fn impossible_values_are_refused() {
        assert!(Helpers::new(2).is_sound() && !Helpers::new(1).is_sound());
        assert!(!Helpers { speed_up: 0.0, ..Helpers::new(2) }.is_sound());
        assert!(!Helpers { call_ns: f64::NAN, ..Helpers::new(2) }.is_sound());
    }
}

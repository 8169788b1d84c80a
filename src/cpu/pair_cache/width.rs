//! Finds the fastest number of threads by the clock.
//!
//! A frame with kept pairs may take less time than a second thread takes to wake. On one machine of `datasets/` two
//! threads took 0.7 × the time of one for 4000 boxes, on another 1.3 to 2.1 × for 3000. So a few frames run on half or
//! twice the threads, and the faster number stays.

/// Frames that a trial compares, by their median: one rebuild or interruption does not decide. A trial ends as soon as
/// three of its frames agree. A first frame that wakes threads does not count.
const RECENT: usize = 5;
/// Share of the time that trials may cost.
const BUDGET: f64 = 0.005;
/// Frames before the first trial, and between two of them, at least.
const FIRST: u32 = 8;
const APART: u32 = 64;
/// The tried number stays if it takes less than this share of the time.
const WINS: f64 = 0.97;
/// A trial ends early once its counted frames have lost the time of this many usual frames. One frame counts as at
/// most the second number: a stop in a debugger does not predict later frames.
const MOST_LOST: f64 = 4.0;
const MOST: f64 = 64.0;

/// The number of threads, as a position in the ascending list of available numbers.
#[derive(Debug, Clone)]
pub(super) struct Width {
    /// The chosen position, and the highest one that the frame has work for.
    now: usize,
    most: usize,
    /// Measured costs of the last usual frames over the model's, and their number.
    costs: [f64; RECENT],
    frames: usize,
    trial: Option<Trial>,
    /// Frames until the next trial, and whether it is of more threads.
    pause: u32,
    wider: bool,
}

#[derive(Debug, Clone, Default)]
struct Trial {
    at: usize,
    /// Whether the next frame wakes threads.
    wakes: bool,
    /// Frames that were faster than the usual ones, and those that were not.
    won: usize,
    lost: usize,
    /// Time lost by all frames, and by those that count, in usual frames.
    cost: f64,
    counted: f64,
}

impl Width {
    /// Begins at this position.
    pub(super) fn new(now: usize) -> Self {
        Self { now, most: usize::MAX, costs: [0.0; RECENT], frames: 0, trial: None, pause: FIRST, wider: now == 0 }
    }

    /// Returns the position for the next frame, which is at most `most`.
    pub(super) fn next(&mut self, most: usize) -> usize {
        if most != self.most {
            self.most = most;
            self.resume();
        }
        let now = self.now.min(most);
        if self.trial.is_none() && self.pause == 0 && most > 0 {
            let wider = now == 0 || self.wider && now < most;
            let at = if wider { now + 1 } else { now - 1 };
            self.wider = !wider;
            self.trial = Some(Trial { at, wakes: at > now, ..Trial::default() });
        }
        self.trial.as_ref().map_or(now, |trial| trial.at)
    }

    /// Begins anew for another number of boxes, and halves the wait for the next trial.
    pub(super) fn restart(&mut self, now: usize) {
        *self = Self { pause: FIRST.max(self.pause / 2), ..Self::new(now) };
    }

    /// Goes on after frames of another kind: a trial is compared with the frames just before it.
    pub(super) fn resume(&mut self) {
        (self.trial, self.pause) = (None, self.pause.max(FIRST));
    }

    /// Learns from a frame with this measured cost over the model's. Returns whether it was a usual one.
    pub(super) fn ran(&mut self, cost: f32) -> bool {
        let Some(trial) = &mut self.trial else {
            self.costs[self.frames % RECENT] = cost.into();
            self.frames += 1;
            self.pause = self.pause.saturating_sub(1);
            return true;
        };
        let usual = middle(&self.costs);
        let lost = (f64::from(cost) / usual - 1.0).clamp(0.0, MOST);
        trial.cost += lost;
        if std::mem::take(&mut trial.wakes) {
            return false;
        }
        trial.counted += lost;
        *(if f64::from(cost) < WINS * usual { &mut trial.won } else { &mut trial.lost }) += 1;
        if trial.won > RECENT / 2 {
            *self = Self { wider: trial.at > self.now, most: self.most, ..Self::new(trial.at) };
        } else if trial.lost > RECENT / 2 || trial.counted > MOST_LOST {
            self.pause = APART.max((trial.cost / BUDGET) as u32);
            self.trial = None;
        }
        false
    }
}

/// The median of the costs of [`RECENT`] frames.
fn middle(costs: &[f64]) -> f64 {
    let mut sorted = [0.0; RECENT];
    sorted.copy_from_slice(costs);
    sorted.sort_unstable_by(f64::total_cmp);
    sorted[RECENT / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the position, and the share of frames at others, after frames with these costs at each.
    fn after(frames: u32, costs: &[f32], from: usize) -> (usize, f32) {
        let mut width = Width::new(from);
        let mut others = 0;
        for _ in 0..frames {
            let at = width.next(costs.len() - 1);
            others += u32::from(!width.ran(costs[at]));
        }
        (width.now, others as f32 / frames as f32)
    }

    #[test]
    fn cheapest_number_of_threads_stays() {
        for (costs, best) in [
            (&[1.0, 2.0][..], 0),
            (&[1.0, 0.7], 1),
            (&[1.0, 0.6, 0.4, 0.3, 0.5], 3),
            (&[1.0, 1.2, 1.4, 2.0, 4.0], 0),
            (&[1.0], 0),
        ] {
            for from in [0, costs.len() - 1] {
                let (now, others) = after(4000, costs, from);
                assert!(now == best && others < 0.05, "{costs:?} from {from}: {now}, {others}");
            }
        }
    }

    #[test]
    fn rebuilds_and_interruptions_change_nothing() {
        let mut width = Width::new(0);
        for frame in 0..2000 {
            let at = width.next(1);
            width.ran([1.0, 1.4][at] * if frame % 3 == 0 { 4.0 } else { 1.0 });
            assert_eq!(width.now, 0, "frame {frame}");
        }
    }

    #[test]
    fn trials_cost_no_more_than_their_budget() {
        let mut width = Width::new(0);
        let mut lost = 0.0;
        for frame in 0..100_000 {
            let at = width.next(1);
            // The helper waits for another program's turn.
            let cost = [1.0, 12.0][at];
            lost += cost - 1.0;
            assert!(width.now == 0 && lost < 30.0 + 0.006 * frame as f32, "frame {frame}: {lost}");
            width.ran(cost);
        }
        assert!(lost > 100.0, "{lost}");
    }

    #[test]
    fn trials_of_what_costs_twice_as_much_are_rare() {
        assert!(after(10_000, &[1.0, 2.0], 0).1 < 0.008);
    }

    #[test]
    fn frames_with_less_work_use_fewer_threads_until_there_is_more() {
        let mut width = Width::new(2);
        (0..FIRST).for_each(|_| assert!(width.next(4) == 2 && width.ran(1.0)));
        // A trial ends with the frames that had work for it.
        assert_eq!(width.next(4), 1);
        (0..100).for_each(|_| assert!(width.next(0) == 0 && width.ran(1.0)));
        (0..FIRST).for_each(|_| assert!(width.next(4) == 2 && width.ran(1.0)));
        assert_ne!(width.next(4), 2);
    }
}

//! On how many threads a frame is fastest, by the clock.
//!
//! A frame with kept pairs may take less time than a second thread takes to wake. On one machine of `datasets/` two
//! threads took 0.7 times as long as one for 4000 boxes, on another 1.3 to 2.1 times for 3000. So a few frames are
//! tried on half or twice as many threads, and what takes less time stays.

/// Frames of a trial. The first wakes threads, and does not count.
const TRIAL: usize = 1 + RECENT;
/// Frames that are compared, by their median: a rebuild or an interruption among them says nothing.
const RECENT: usize = 5;
/// Share of the time that trials may cost.
const BUDGET: f64 = 0.005;
/// Frames before the first trial, and between two of them, at least and at most.
const FIRST: u32 = 8;
const APART: [f64; 2] = [64.0, 1024.0];
/// What is tried stays if it takes less than this share of the time.
const WINS: f64 = 0.97;
/// A frame of a trial counts as at most this many usual ones: a longer one was interrupted.
const MOST: f64 = 8.0;

/// The number of threads, as a position in the ascending list of those that can be had.
#[derive(Debug, Clone)]
pub(super) struct Width {
    now: usize,
    /// Costs of the last usual frames over what the cost model says of them, and their number.
    costs: [f64; RECENT],
    frames: usize,
    trial: Option<Trial>,
    /// Frames until the next trial, and whether that is of more threads.
    pause: u32,
    wider: bool,
}

#[derive(Debug, Clone, Default)]
struct Trial {
    at: usize,
    costs: [f64; TRIAL],
    frames: usize,
}

impl Width {
    /// Begins with this position.
    pub(super) fn new(now: usize) -> Self {
        Self { now, costs: [0.0; RECENT], frames: 0, trial: None, pause: FIRST, wider: now == 0 }
    }

    /// Returns the position for the next frame, which is at most `most`.
    pub(super) fn next(&mut self, most: usize) -> usize {
        if self.now.max(self.trial.as_ref().map_or(0, |trial| trial.at)) > most {
            *self = Self::new(most);
        }
        if self.trial.is_none() && self.pause == 0 && most > 0 {
            let wider = self.now == 0 || self.wider && self.now < most;
            let at = if wider { self.now + 1 } else { self.now - 1 };
            self.wider = !wider;
            self.trial = Some(Trial { at, ..Trial::default() });
        }
        self.trial.as_ref().map_or(self.now, |trial| trial.at)
    }

    /// Takes in the cost of a frame over what the cost model says of it. Returns whether it was a usual one.
    pub(super) fn ran(&mut self, cost: f32) -> bool {
        let Some(trial) = &mut self.trial else {
            self.costs[self.frames % RECENT] = cost.into();
            self.frames += 1;
            self.pause = self.pause.saturating_sub(1);
            return true;
        };
        trial.costs[trial.frames] = cost.into();
        trial.frames += 1;
        if trial.frames == TRIAL {
            let [usual, tried] = [&self.costs, &trial.costs[1..]].map(middle);
            if tried < WINS * usual {
                self.wider = trial.at > self.now;
                (self.now, self.pause) = (trial.at, FIRST);
            } else {
                let lost = trial.costs.map(|cost| (cost / usual - 1.0).clamp(0.0, MOST));
                self.pause = (lost.iter().sum::<f64>() / BUDGET).clamp(APART[0], APART[1]) as u32;
            }
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

    /// Returns the position and the share of frames on others, after frames that cost this much on each.
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
    fn trials_of_what_costs_twice_as_much_are_rare() {
        assert!(after(10_000, &[1.0, 2.0], 0).1 < 0.008);
    }

    #[test]
    fn fewer_threads_than_before_are_obeyed_at_once() {
        let mut width = Width::new(2);
        (0..FIRST).for_each(|_| assert!(width.next(4) == 2 && width.ran(1.0)));
        assert_eq!([width.next(4), width.next(0)], [1, 0]);
        assert!(width.ran(1.0));
    }
}

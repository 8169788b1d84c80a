//! Decides when space is cut again.

use crate::record::RankRecord;

/// Imbalance that is not counted: it is within the noise of a time.
const TOLERATED: f64 = 0.05;
/// The longest wait after cuts that did not help, as a multiple of their price.
const MOST_PATIENCE: f64 = 64.0;

/// Decides from the times of all ranks when new cuts pay. Every rank decides the same.
///
/// It adds up the time that the slowest rank takes beyond equally busy ranks. When the sum exceeds the price of cuts,
/// space is cut again. This loses at most twice the best choice, as in the ski-rental problem (Karp, 1992). Cuts that
/// did not help raise the price of the next ones.
#[derive(Debug, Clone)]
pub(crate) struct Balance {
    /// Time lost since the last cuts.
    owed_ns: f64,
    /// The multiple of the price that must be lost before the next cuts.
    patience: f64,
    /// Boxes of all ranks at the last cuts; `None` before the first frame with them.
    cut_at: Option<u64>,
    /// Imbalance before the last cuts, until it is known whether they helped.
    was: Option<f64>,
    /// The time of the slowest rank over that of equally busy ranks, minus one; `None` while times are unknown.
    pub(crate) imbalance: Option<f64>,
    /// Whether to cut before the next frame.
    pub(crate) due: bool,
    /// Whether the last frame had about as many boxes as the frame of the last cuts, so that its boxes may stand for
    /// those of the next.
    pub(crate) same_scene: bool,
}

impl Default for Balance {
    fn default() -> Self {
        Self { owed_ns: 0.0, patience: 1.0, cut_at: None, was: None, imbalance: None, due: true, same_scene: false }
    }
}

impl Balance {
    /// Notes that space was cut. The next frame counts the boxes.
    pub(crate) fn cut(&mut self) {
        self.was = self.imbalance.take();
        (self.owed_ns, self.cut_at, self.due) = (0.0, None, false);
    }

    /// Takes the records of all ranks in a frame.
    pub(crate) fn observe(&mut self, records: &[RankRecord]) {
        let boxes: u64 = records.iter().map(|r| r.boxes).sum();
        let before = *self.cut_at.get_or_insert(boxes);
        // Otherwise most boxes have come or gone since the cuts.
        self.same_scene = boxes <= before.saturating_mul(2) && boxes >= before / 2;
        self.due |= !self.same_scene;
        let Some((slowest, even)) = times(records) else { return };
        let imbalance = slowest / even - 1.0;
        self.imbalance = Some(imbalance);
        if let Some(was) = self.was.take() {
            self.patience = if imbalance > 0.8 * was { (2.0 * self.patience).min(MOST_PATIENCE) } else { 1.0 };
        }
        let lost = slowest - even - TOLERATED * even;
        // While the scene is even by itself, the sum halves in each frame.
        self.owed_ns = if lost > 0.0 { self.owed_ns + lost } else { self.owed_ns / 2.0 };
        let price = records.iter().map(|r| r.cut_ns).max().unwrap_or(0) as f64;
        if self.owed_ns > self.patience * price.max(even) {
            self.due = true;
        }
    }
}

/// The time of the slowest rank, and that of equally busy ranks. `None` if a rank with boxes has no time.
fn times(records: &[RankRecord]) -> Option<(f64, f64)> {
    let busy = || records.iter().filter(|r| r.searched > 0);
    if busy().any(|r| r.search_ns == 0) || busy().next().is_none() {
        return None;
    }
    let slowest = busy().map(|r| r.search_ns).max()? as f64;
    let (mut boxes, mut rates, mut count) = (0.0, 0.0, 0.0);
    for r in busy() {
        boxes += r.searched as f64;
        rates += r.searched as f64 / r.search_ns as f64;
        count += 1.0;
    }
    // Assumes that ranks without work are as fast as the others.
    Some((slowest, boxes / (rates * records.len() as f64 / count)))
}

/// The last times of a rank's search.
#[derive(Debug, Clone, Default)]
pub(crate) struct Times {
    last: [(u64, u64); Times::KEPT],
    count: usize,
}

impl Times {
    const KEPT: usize = 8;

    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    pub(crate) fn push(&mut self, boxes: u64, ns: u64) {
        self.last[self.count % Self::KEPT] = (boxes, ns.max(1));
        self.count += 1;
    }

    /// Medians of boxes and nanoseconds, from three frames on, so that one stalled frame does not count.
    pub(crate) fn medians(&self) -> Option<(u64, u64)> {
        let known = &self.last[..self.count.min(Self::KEPT)];
        let median = |of: fn(&(u64, u64)) -> u64| {
            let mut values = [0; Self::KEPT];
            values.iter_mut().zip(known).for_each(|(v, k)| *v = of(k));
            let values = &mut values[..known.len()];
            values.sort_unstable();
            values[values.len() / 2]
        };
        (known.len() >= 3).then(|| (median(|k| k.0), median(|k| k.1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(times: &[u64], cut_ns: u64) -> Vec<RankRecord> {
        times.iter().map(|&ns| RankRecord { cut_ns, ..RankRecord::timed(100, 100, ns) }).collect()
    }

    #[test]
    fn space_is_cut_when_the_loss_pays_for_it() {
        let mut balance = Balance::default();
        assert!(balance.due);
        balance.cut();
        // 100 boxes in 100 and in 300 ns: equally busy ranks take 150 ns, so a frame loses 150 ns minus 5 %.
        let frames = (0..).take_while(|_| {
            balance.observe(&frame(&[100, 300], 10_000));
            !balance.due
        });
        assert_eq!(frames.count(), (10_000.0_f64 / 142.5) as usize);
        assert!((balance.imbalance.unwrap() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn even_and_unknown_scenes_keep_their_cuts() {
        for times in [[100, 104], [0, 0], [0, 100]] {
            let mut balance = Balance::default();
            balance.cut();
            (0..10_000).for_each(|_| balance.observe(&frame(&times, 1)));
            assert!(!balance.due, "{times:?}");
        }
    }

    #[test]
    fn useless_cuts_become_rare() {
        let mut balance = Balance::default();
        balance.cut();
        let mut cuts = 0;
        for _ in 0..10_000 {
            balance.observe(&frame(&[100, 300], 1000));
            if balance.due {
                balance.cut();
                cuts += 1;
            }
        }
        // Every eighth frame without patience.
        assert!((10..40).contains(&cuts), "{cuts}");
    }

    #[test]
    fn a_scene_of_another_size_is_cut_again() {
        let of = |boxes| [RankRecord::timed(boxes, 0, 0)];
        let mut balance = Balance::default();
        balance.cut();
        balance.observe(&of(0));
        balance.observe(&of(1));
        assert!(balance.due);
        balance.cut();
        [100, 150, 200, 50].iter().for_each(|&n| balance.observe(&of(n)));
        assert!(!balance.due);
        balance.observe(&of(49));
        assert!(balance.due);
    }

    #[test]
    fn a_median_takes_three_frames() {
        let mut times = Times::default();
        times.push(5, 10);
        times.push(5, 0);
        assert_eq!(times.medians(), None);
        times.push(7, 1_000_000);
        assert_eq!(times.medians(), Some((5, 10)));
        (0..8).for_each(|k| times.push(k, k));
        assert_eq!(times.medians(), Some((4, 4)));
        times.clear();
        assert_eq!(times.medians(), None);
    }
}

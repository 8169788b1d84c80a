//! How a method calls its helpers: four numbers that predict the time on several threads from that on one.

use sapwise_tune::model::{HelpersModel, ThreadFigures};

/// One timing on several threads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Called {
    pub(crate) objects: u32,
    pub(crate) threads: u32,
    /// The modelled time on one thread.
    pub(crate) work_ns: f64,
    pub(crate) ns: f64,
    pub(crate) weight: f64,
    pub(crate) figures: ThreadFigures,
}

/// Values that are tried for each number.
const CALL_CYCLES: [f64; 11] = [0.0, 100.0, 200.0, 400.0, 700.0, 1000.0, 1500.0, 2000.0, 3000.0, 5000.0, 8000.0];
const LATE_SHARES: [f64; 13] = [0.0, 0.03, 0.06, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0];
const SERIAL_SHARES: [f64; 13] = [0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0];
/// Boxes for each further thread: 0 if all threads are always called, or the number of the methods of this library.
const BOXES_PER_THREAD: [u32; 2] = [0, 1024];
/// Places in these lists to start from, and steps in them, coarse ones first.
const STARTS: [[usize; 4]; 2] = [[0, 4, 4, 3], [0, 4, 4, 8]];
const STEPS: [isize; 3] = [4, 2, 1];
/// Moves that are tried, three numbers each, after the one that changes when threads are called. A more expensive call
/// looks like a later helper, and both like less serial work.
const MOVES: [isize; 30] =
    [1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 1, -1, 0, -1, 1, 0, 0, 1, -1, 0, -1, 1];

/// Returns the numbers with the least weighted sum of absolute logarithmic errors, which is robust: some frames wait
/// for a core. `None` without timings.
pub(crate) fn fit(called: &[Called]) -> Option<HelpersModel> {
    if called.is_empty() {
        return None;
    }
    let model = |[boxes, call, late, serial]: [usize; 4]| {
        HelpersModel::new(CALL_CYCLES[call], LATE_SHARES[late], SERIAL_SHARES[serial], BOXES_PER_THREAD[boxes])
    };
    // `None` once the sum reaches `least`.
    let error = |at: [usize; 4], least: f64| -> Option<f64> {
        called.iter().try_fold(0.0, |sum, c| {
            let ns = model(at).with(c.figures, c.threads).cost_ns(c.objects, c.work_ns);
            Some(sum + c.weight * (c.ns / ns).ln().abs()).filter(|sum| *sum < least)
        })
    };
    let most = [CALL_CYCLES.len(), LATE_SHARES.len(), SERIAL_SHARES.len()];
    let polished = |mut best: [usize; 4]| {
        let mut least = error(best, f64::INFINITY).unwrap_or(f64::INFINITY);
        for step in STEPS {
            loop {
                let before = best;
                for moves in std::iter::once(&[0, 0, 0][..]).chain(MOVES.chunks_exact(3)) {
                    let mut to = best;
                    to[0] ^= usize::from(moves == [0, 0, 0]);
                    for ((to, m), most) in to[1..].iter_mut().zip(moves).zip(&most) {
                        *to = to.saturating_add_signed(step * m).min(most - 1);
                    }
                    if let Some(error) = error(to, least) {
                        (best, least) = (to, error);
                    }
                }
                if best == before {
                    break;
                }
            }
        }
        (best, least)
    };
    STARTS.map(polished).into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).map(|found| model(found.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_made_up_helpers_are_found_though_some_frames_waited() {
        for truth in [HelpersModel::new(400.0, 0.35, 0.1, 1024), HelpersModel::new(1500.0, 0.1, 0.3, 0)] {
            let called: Vec<Called> = (0..120)
                .map(|k| {
                    let objects = 2_u32.pow(4 + k / 8);
                    let threads = [2, 4][k as usize % 2];
                    let work_ns = 300.0 + (30.0 + f64::from(k % 8)) * f64::from(objects);
                    let figures = ThreadFigures::new(0.3, 8000.0 + 500.0 * f64::from(k % 5), 0.95 * f64::from(threads));
                    let ns =
                        truth.with(figures, threads).cost_ns(objects, work_ns) * if k % 17 == 0 { 5.0 } else { 1.0 };
                    Called { objects, threads, work_ns, ns, weight: 1.0, figures }
                })
                .collect();
            assert_eq!(fit(&called), Some(truth));
        }
        assert_eq!(fit(&[]), None);
    }
}

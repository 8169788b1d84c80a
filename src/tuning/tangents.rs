//! Costs near a load: first-order expansions of the logarithms of the cost curves.
//!
//! A full evaluation compares the load with every place of the residuals, which are in no cache when a frame begins.
//! An expansion of all candidates has a few cache lines, and holds while the load stays near.

use super::AlgorithmCost;
use crate::Load;
use crate::cost::Frame;

const COORDINATES: usize = 6;

/// Half the extent of an expansion by coordinate: natural logarithms of the objects, of pairs, strip candidates and
/// axis candidates an object, of the motion, and the share of moved boxes. `errors_within_the_extent_are_small` holds
/// 95 % of the errors to 2 %.
const EXTENT: [f32; COORDINATES] = [0.15, 0.25, 0.3, 0.3, 0.2, 0.15];
/// Candidates or pairs an object, and motion, below which loads count as alike.
const FEW: f64 = 0.05;
const STILL: f64 = 0.01;

/// Expansions of some costs around one load.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tangents {
    at: Option<[f32; COORDINATES]>,
    /// By cost: the logarithm at the load, and its slopes.
    costs: Vec<[f32; COORDINATES + 1]>,
}

impl Tangents {
    /// Room for this many costs.
    pub(crate) fn new(costs: usize) -> Self {
        Self { at: None, costs: vec![[0.0; COORDINATES + 1]; costs] }
    }

    /// Passes the position and nanoseconds of each cost under a load to `each`. Expands anew if the load is too far.
    pub(crate) fn evaluate(&mut self, load: &Load, costs: &[AlgorithmCost], mut each: impl FnMut(usize, f64)) {
        let x = coordinates(load);
        let near =
            |at: &[f32; COORDINATES]| at.iter().zip(x).zip(EXTENT).all(|((at, x), extent)| (at - x).abs() <= extent);
        let at = match self.at.filter(near) {
            Some(at) => at,
            None => {
                self.expand(load, costs);
                self.at = Some(x);
                x
            }
        };
        let offset: [f32; COORDINATES] = std::array::from_fn(|c| x[c] - at[c]);
        for (k, [ln, slopes @ ..]) in self.costs.iter().enumerate() {
            let ln = slopes.iter().zip(offset).fold(*ln, |sum, (slope, by)| sum + slope * by);
            each(k, f64::from(ln.exp()));
        }
    }

    fn expand(&mut self, load: &Load, costs: &[AlgorithmCost]) {
        let fill = |entry: usize, load: &Load, tangents: &mut Vec<[f32; COORDINATES + 1]>| {
            let frame = Frame::new(load);
            for (tangent, cost) in tangents.iter_mut().zip(costs) {
                tangent[entry] = cost.curve.cost_of(&frame).max(f64::MIN_POSITIVE).ln() as f32;
            }
        };
        fill(0, load, &mut self.costs);
        for c in 0..COORDINATES {
            let (other, step) = stepped(load, c);
            fill(1 + c, &other, &mut self.costs);
            let slope = |tangent: &mut [f32; COORDINATES + 1]| tangent[1 + c] = (tangent[1 + c] - tangent[0]) / step;
            self.costs.iter_mut().for_each(slope);
        }
    }
}

fn coordinates(load: &Load) -> [f32; COORDINATES] {
    let n = f64::from(load.objects.max(1));
    let each = |count: f64| (count / n + FEW).ln() as f32;
    [
        n.ln() as f32,
        each(load.pairs),
        each(load.strip_candidates),
        each(load.axis_candidates),
        (load.moved + STILL).ln() as f32,
        load.moved_share as f32,
    ]
}

/// A load half the extent away along one coordinate, and by how much that differs.
fn stepped(load: &Load, coordinate: usize) -> (Load, f32) {
    let step = f64::from(EXTENT[coordinate]) / 2.0;
    let n = f64::from(load.objects.max(1));
    let more = |count: f64| (count + FEW * n) * step.exp() - FEW * n;
    let other = match coordinate {
        0 => {
            // What is counted by the object stays.
            let objects = (n * step.exp()).ceil();
            let more = |count: f64| count * objects / n;
            Load {
                objects: objects as u32,
                pairs: more(load.pairs),
                strip_candidates: more(load.strip_candidates),
                axis_candidates: more(load.axis_candidates),
                ..*load
            }
        }
        1 => Load { pairs: more(load.pairs), ..*load },
        2 => Load { strip_candidates: more(load.strip_candidates), ..*load },
        3 => Load { axis_candidates: more(load.axis_candidates), ..*load },
        4 => Load { moved: (load.moved + STILL) * step.exp() - STILL, ..*load },
        // Towards the middle, so that it stays a share.
        _ if load.moved_share > 0.5 => return (Load { moved_share: load.moved_share - step, ..*load }, -step as f32),
        _ => return (Load { moved_share: load.moved_share + step, ..*load }, step as f32),
    };
    (other, coordinates(&other)[coordinate] - coordinates(load)[coordinate])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Helpers;
    use crate::tuning::drawn::{draw, drawn};
    use std::sync::Arc;

    /// Random curves, of which some run on threads and some fall back to another one.
    fn costs(seed: u64) -> (Vec<AlgorithmCost>, Vec<Load>) {
        let (mut costs, loads) = drawn(seed);
        let others: Vec<_> = costs.iter().map(|c| Arc::clone(&c.curve.work)).collect();
        for (k, cost) in costs.iter_mut().enumerate() {
            let helpers = Helpers { call_ns: 2000.0, late_ns: 20_000.0, boxes_per_thread: 1024, ..Helpers::new(4) };
            cost.curve.helpers = (k % 2 == 1).then_some(helpers);
            if let Some(residual) = &mut cost.curve.residual {
                // Around zero, as a fit leaves them: all above it, they would be a factor of their own.
                residual.weights.iter_mut().for_each(|w| *w -= 0.2);
                residual.by_motion = k % 4 > 1;
            }
            if k % 4 > 1 {
                cost.curve = std::mem::take(&mut cost.curve).with_fallback(Arc::clone(&others[k - 2]), 1.1);
            }
        }
        (costs, loads)
    }

    /// A load at these distances by coordinate.
    fn shifted(load: &Load, by: [f64; COORDINATES]) -> Load {
        let n = f64::from(load.objects);
        let objects = (n * by[0].exp()).round().max(1.0);
        let each = |count: f64, by: f64| (((count / n + FEW) * by.exp() - FEW) * objects).max(0.0);
        Load {
            objects: objects as u32,
            pairs: each(load.pairs, by[1]),
            strip_candidates: each(load.strip_candidates, by[2]),
            axis_candidates: each(load.axis_candidates, by[3]),
            moved: ((load.moved + STILL) * by[4].exp() - STILL).clamp(0.0, 1.0),
            moved_share: (load.moved_share + by[5]).clamp(0.0, 1.0),
        }
    }

    /// Costs under a load, expanded around another.
    fn expanded(costs: &[AlgorithmCost], at: &Load, load: &Load) -> Vec<f64> {
        let (mut tangents, mut found) = (Tangents::new(costs.len()), vec![0.0; costs.len()]);
        tangents.evaluate(at, costs, |_, _| {});
        tangents.evaluate(load, costs, |k, ns| found[k] = ns);
        found
    }

    #[test]
    fn errors_within_the_extent_are_small() {
        let (mut small, mut all, mut state) = (0, 0, 1);
        for seed in 0..20 {
            let (costs, loads) = costs(seed);
            for load in &loads {
                let mut within = |share: f64| EXTENT.map(|e| share * f64::from(e) * (2.0 * draw(&mut state) - 1.0));
                let at = shifted(load, within(3.0));
                let near = shifted(&at, within(1.0));
                for (cost, ns) in costs.iter().zip(expanded(&costs, &at, &near)) {
                    all += 1;
                    small += usize::from((ns / cost.curve.cost_ns(&near) - 1.0).abs() <= 0.02);
                }
            }
        }
        assert!(small as f64 >= 0.95 * f64::from(all), "{small} of {all}");
    }

    #[test]
    fn beyond_the_extent_it_expands_anew() {
        let (costs, loads) = costs(1);
        for c in 0..COORDINATES {
            let at = Load { moved: 0.3, moved_share: 0.3, ..loads[8] };
            let mut by = [0.0; COORDINATES];
            by[c] = 1.1 * f64::from(EXTENT[c]);
            let far = shifted(&at, by);
            for (cost, ns) in costs.iter().zip(expanded(&costs, &at, &far)) {
                assert!((ns / cost.curve.cost_ns(&far) - 1.0).abs() < 1e-4, "{c}: {}", cost.algorithm);
            }
        }
    }
}

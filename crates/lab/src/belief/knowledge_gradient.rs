//! What an observation is worth before it is made.

use sapwise::stats::{normal_density, normal_tail};
use sapwise::tuning::Slope;
use sapwise::{Load, Observed};

/// A line further above the best than this many times its slope crosses it so rarely that it changes no gain by a millionth.
const REACH: f64 = 5.0;

/// The choices over some loads as they stand, and how much an observation would improve them.
///
/// The measure is the regret of choosing what is expected to be cheapest, as a natural logarithm: its mean over the loads, each
/// counting the same. Near nought that is regret itself.
#[derive(Debug, Clone)]
pub struct KnowledgeGradient {
    /// One for each load.
    scenes: Vec<Scene>,
    /// Algorithms that may become the best of a scene: how far they are behind, and how that changes with one standard deviation of
    /// surprise.
    lines: Vec<Line>,
    /// The lines that are lowest somewhere, each with where it begins to be.
    envelope: Vec<(f64, Line)>,
}

#[derive(Debug, Clone)]
struct Scene {
    load: Load,
    /// By algorithm.
    slopes: Vec<Slope>,
    /// By algorithm. Infinite for those that can't be chosen.
    mean_ln: Vec<f64>,
    /// The one that would be chosen.
    best: usize,
}

#[derive(Debug, Clone, Copy)]
struct Line {
    behind: f64,
    slope: f64,
}

impl KnowledgeGradient {
    /// The choices between the algorithms that `usable` admits, under each of `loads`.
    #[must_use]
    pub fn new(observed: &Observed, loads: &[Load], usable: &[bool]) -> Self {
        let count = observed.predicted().len();
        let scene = |load: &Load| Scene {
            load: *load,
            slopes: Vec::with_capacity(count),
            mean_ln: Vec::with_capacity(count),
            best: 0,
        };
        let mut gradient = Self {
            scenes: loads.iter().map(scene).collect(),
            lines: Vec::with_capacity(count),
            envelope: Vec::with_capacity(count),
        };
        gradient.refresh(observed, usable);
        gradient
    }

    /// Takes over what is expected by now.
    pub fn refresh(&mut self, observed: &Observed, usable: &[bool]) {
        for Scene { load, slopes, mean_ln, best } in &mut self.scenes {
            slopes.clear();
            mean_ln.clear();
            for (a, &usable) in usable.iter().enumerate() {
                let (ln, slope) = observed.expected_ln(a, load);
                slopes.push(slope);
                mean_ln.push(if usable { ln } else { f64::INFINITY });
            }
            *best = (0..mean_ln.len()).min_by(|&a, &b| mean_ln[a].total_cmp(&mean_ln[b])).unwrap_or(0);
        }
    }

    /// By how much the expected regret falls, in natural logarithms and on average over the loads, when the algorithm is observed
    /// under `load` with that much noise.
    ///
    /// In closed form: an observation moves every expectation along a line, by the surprise that it brings, and the expected
    /// minimum of lines follows from their lower envelope (Frazier, Powell and Dayanik, The knowledge-gradient policy for correlated
    /// normal beliefs, 2009).
    pub fn gain(&mut self, observed: &mut Observed, algorithm: usize, load: &Load, noise_ln: f64) -> f64 {
        let Self { scenes, lines, envelope } = self;
        let (_, with) = observed.expected_ln(algorithm, load);
        let deviation = (observed.prepare(&with) + noise_ln * noise_ln).sqrt();
        let mut sum = 0.0;
        for Scene { slopes, mean_ln, best, .. } in &*scenes {
            if !mean_ln.get(*best).is_some_and(|m| m.is_finite()) {
                continue;
            }
            let of_best = observed.covariance(&with, &slopes[*best]);
            lines.clear();
            lines.push(Line { behind: 0.0, slope: 0.0 });
            for (slope, mean) in slopes.iter().zip(mean_ln) {
                let line = Line {
                    behind: mean - mean_ln[*best],
                    slope: (observed.covariance(&with, slope) - of_best) / deviation,
                };
                if line.behind < REACH * line.slope.abs() {
                    lines.push(line);
                }
            }
            sum += expected_fall(lines, envelope);
        }
        sum / scenes.len().max(1) as f64
    }
}

/// By how much the minimum of `behind + slope * z` lies under nought on average over a standard normal z, where at z = 0 the lowest
/// line is at nought.
fn expected_fall(lines: &mut [Line], envelope: &mut Vec<(f64, Line)>) -> f64 {
    if lines.len() < 2 {
        return 0.0;
    }
    // From the line that is lowest far to the left to the one that is lowest far to the right; the lower of parallels first.
    lines.sort_by(|a, b| b.slope.total_cmp(&a.slope).then(a.behind.total_cmp(&b.behind)));
    envelope.clear();
    for &line in &*lines {
        let mut from = f64::NEG_INFINITY;
        let mut hidden = false;
        while let Some(&(begins, last)) = envelope.last() {
            if last.slope <= line.slope {
                hidden = true;
                break;
            }
            from = (line.behind - last.behind) / (last.slope - line.slope);
            if from > begins {
                break;
            }
            envelope.pop();
            from = f64::NEG_INFINITY;
        }
        if !hidden {
            envelope.push((from, line));
        }
    }
    envelope.windows(2).map(|w| (w[0].1.slope - w[1].1.slope) * beyond(w[1].0.abs())).sum()
}

/// The expected excess of a standard normal variable over `x`, which is not negative.
fn beyond(x: f64) -> f64 {
    (normal_density(x) - x * normal_tail(x)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same by summing over a fine grid.
    fn summed(lines: &[Line]) -> f64 {
        let step = 1e-4;
        let least = |z: f64| lines.iter().map(|l| l.behind + l.slope * z).fold(f64::INFINITY, f64::min);
        let at = |k: i32| f64::from(k) * step;
        let density = |z: f64| (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
        -(-100_000..=100_000).map(|k| least(at(k)) * density(at(k)) * step).sum::<f64>()
    }

    #[test]
    fn the_fall_of_the_minimum_is_that_of_a_sum_over_the_normal_distribution() {
        let cases: [&[(f64, f64)]; 5] = [
            &[(0.0, 0.0)],
            &[(0.0, 0.0), (0.1, 0.2)],
            &[(0.0, 0.0), (0.1, 0.2), (0.3, -0.2), (0.2, -0.3)],
            &[(0.0, 0.0), (0.5, 0.2), (0.1, 0.2), (0.1, 0.2)],
            &[(0.0, 0.0), (0.0, 0.3), (0.01, 0.31), (0.4, 0.1)],
        ];
        for case in cases {
            let mut lines: Vec<Line> = case.iter().map(|&(behind, slope)| Line { behind, slope }).collect();
            let expected = summed(&lines);
            let fall = expected_fall(&mut lines, &mut Vec::new());
            assert!((fall - expected).abs() < 1e-6, "{case:?}: {fall} {expected}");
        }
    }

    #[test]
    fn the_expected_excess_has_its_known_values() {
        assert!((beyond(0.0) - 0.398_942_28).abs() < 1e-7 && beyond(6.0) < 1e-9);
    }
}

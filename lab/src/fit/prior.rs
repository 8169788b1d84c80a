//! How far costs lie from their prediction on machines that were held out.

use crate::belief::{Deviations, Part, Prior, TERMS_SHARED, width_correlation};
use crate::fit::nnls::nnls;
use ndarray::{Array1, Array2};
use sapwise::stats::mean;
use sapwise::{AlgorithmId, BackendClass};
use std::collections::BTreeMap;

/// One timing on a machine that the model had not seen.
#[derive(Debug, Clone)]
pub struct TimingError {
    /// Which machine: timings of different ones are taken to be independent.
    pub machine: usize,
    /// The algorithm.
    pub algorithm: AlgorithmId,
    /// Base-2 logarithm of the number of objects.
    pub log2_objects: f64,
    /// Natural logarithm of measured over predicted time.
    pub ln_ratio: f64,
}

/// The assumed prior counts as much as this many machines.
const ASSUMED_MACHINES: f64 = 8.0;

/// Beyond a factor of 7 it is a model that has missed something, and one such machine would decide alone.
const MOST_LN: f64 = 2.0;

/// Length scales that are tried, in octaves.
const LENGTHS: [f64; 6] = [1.0, 1.5, 2.2, 3.3, 5.0, 7.5];

/// Share of what all algorithms have in common that factors on terms are taken to explain, and of what methods have at most.
const EXPLAINED: f64 = 0.8;

/// Steps in which the correlation of widths is told apart.
const WIDTH_STEPS: f64 = 20.0;

/// Standard deviations that may be too small for what a file can hold, or for what a timing can say.
const LEAST_NOISE_LN: f64 = 0.01;

/// The prior under which timings like these are expected: by moments, drawn towards the assumed one where there are few machines.
///
/// The mean product of two deviations on one machine is their covariance, which is linear in the variances of the parts. For each length
/// scale these are found by least squares without negative ones; the length scale that fits best is taken.
pub fn prior(held_out: &[TimingError]) -> Prior {
    let of = |class| {
        let own: Vec<&TimingError> = held_out.iter().filter(|h| h.algorithm.backend().class() == class).collect();
        deviations(&own, Prior::ASSUMED.of(class))
    };
    Prior { cpu: of(BackendClass::Cpu), gpu: of(BackendClass::Gpu) }
}

fn deviations(held_out: &[&TimingError], assumed: &Deviations) -> Deviations {
    let mut machines: BTreeMap<usize, BTreeMap<(&AlgorithmId, i64), Vec<f64>>> = BTreeMap::new();
    for h in held_out.iter().filter(|h| h.ln_ratio.is_finite()) {
        let bins = machines.entry(h.machine).or_default();
        bins.entry((&h.algorithm, h.log2_objects.round() as i64)).or_default().push(h.ln_ratio.clamp(-MOST_LN, MOST_LN));
    }
    if machines.is_empty() {
        return *assumed;
    }
    let noise = within(machines.values().flat_map(BTreeMap::values)).unwrap_or(assumed.noise_ln.powi(2));
    let moments = Moments::new(&machines, noise);
    let fits = LENGTHS.map(|length| (length, moments.fit(length)));
    let Some((length, (variances, _))) = fits.into_iter().min_by(|a, b| a.1.1.total_cmp(&b.1.1)) else { return *assumed };
    let share = machines.len() as f64 / (machines.len() as f64 + ASSUMED_MACHINES);
    let drawn = |variance: f64, assumed: f64| (share * variance + (1.0 - share) * assumed.powi(2)).sqrt();
    // At most numbers of objects one term has most of the time, so that factors on terms look like what all algorithms share, and
    // those of methods like what methods share.
    let of_terms = EXPLAINED * (variances[0] + variances[4]) / TERMS_SHARED;
    let part = |k: usize, assumed: Part| {
        let explained = of_terms * [TERMS_SHARED, 1.0 - TERMS_SHARED, 0.0, 0.0][k];
        let both = variances[k] + variances[4 + k];
        let left = if both > 0.0 { (1.0 - explained / both).max(1.0 - EXPLAINED) } else { 1.0 };
        Part {
            constant_ln: drawn(left * variances[k], assumed.constant_ln),
            curve_ln: drawn(left * variances[4 + k], assumed.curve_ln),
        }
    };
    Deviations {
        shared: part(0, assumed.shared),
        method: part(1, assumed.method),
        width: part(2, assumed.width),
        algorithm: part(3, assumed.algorithm),
        term_ln: drawn(of_terms, assumed.term_ln),
        length_octaves: (share * length.ln() + (1.0 - share) * assumed.length_octaves.ln()).exp(),
        noise_ln: drawn(noise, assumed.noise_ln).max(LEAST_NOISE_LN),
    }
}

/// The variance within lists, pooled over all of them; `None` where no list has two.
fn within<'a>(lists: impl Iterator<Item = &'a Vec<f64>>) -> Option<f64> {
    let (mut sum, mut freedom) = (0.0, 0.0);
    for list in lists {
        let centre = mean(list);
        sum += list.iter().map(|v| (v - centre).powi(2)).sum::<f64>();
        freedom += list.len() as f64 - 1.0;
    }
    (freedom > 0.0).then(|| sum / freedom)
}

/// What two deviations have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Kinship {
    same_method: bool,
    same_algorithm: bool,
    /// Correlation of their widths, in steps.
    width: u32,
    octaves: u32,
}

/// The mean product of two deviations by their kinship, each machine counting the same, with its weight.
struct Moments(BTreeMap<Kinship, (f64, f64)>);

impl Moments {
    fn new(machines: &BTreeMap<usize, BTreeMap<(&AlgorithmId, i64), Vec<f64>>>, noise: f64) -> Self {
        let mut sums: BTreeMap<Kinship, (f64, f64)> = BTreeMap::new();
        for bins in machines.values() {
            let weight = 1.0 / (bins.len() as f64).powi(2);
            let means: Vec<(&AlgorithmId, i64, f64, f64)> =
                bins.iter().map(|(&(id, octave), list)| (id, octave, mean(list), noise / list.len() as f64)).collect();
            for (k, a) in means.iter().enumerate() {
                for (l, b) in means.iter().enumerate() {
                    let kinship = Kinship {
                        same_method: a.0.method() == b.0.method(),
                        same_algorithm: a.0 == b.0,
                        width: (WIDTH_STEPS * width_correlation(a.0.backend(), b.0.backend())).round() as u32,
                        octaves: a.1.abs_diff(b.1) as u32,
                    };
                    // The mean of some timings has a share of their noise, which is no deviation of the curve.
                    let product = a.2 * b.2 - if k == l { a.3 } else { 0.0 };
                    let entry = sums.entry(kinship).or_default();
                    entry.0 += weight * product;
                    entry.1 += weight;
                }
            }
        }
        Self(sums)
    }

    /// Variances of what is constant in each part, then of its curves, and the squared error.
    fn fit(&self, length: f64) -> ([f64; 8], f64) {
        let mut a = Array2::<f64>::zeros((self.0.len(), 8));
        let mut b = Array1::<f64>::zeros(self.0.len());
        for (row, (kinship, &(sum, weight))) in self.0.iter().enumerate() {
            let alike = (-0.5 * (f64::from(kinship.octaves) / length).powi(2)).exp();
            let shares = [
                1.0,
                f64::from(u8::from(kinship.same_method)),
                f64::from(kinship.width) / WIDTH_STEPS,
                f64::from(u8::from(kinship.same_algorithm)),
            ];
            let root = weight.sqrt();
            for (k, share) in shares.into_iter().enumerate() {
                a[[row, k]] = root * share;
                a[[row, 4 + k]] = root * share * alike;
            }
            b[row] = sum / root;
        }
        let variances = nnls(&a, &b);
        let error = &b - &a.dot(&variances);
        (std::array::from_fn(|k| variances[k]), error.dot(&error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sapwise_scenes::Random;

    const SIZES: [f64; 8] = [4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0];

    fn ids() -> Vec<AlgorithmId> {
        ["brute", "sap", "grid-sap"].iter().flat_map(|m| [1, 2, 8].map(|k| format!("{m}@cpu{k}").parse().unwrap())).collect()
    }

    /// The lower triangle whose product with its transpose is `matrix`.
    fn cholesky(matrix: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut lower = vec![vec![0.0; matrix.len()]; matrix.len()];
        for i in 0..matrix.len() {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let rest = matrix[i][j] - sum;
                lower[i][j] = if i == j { rest.max(1e-12).sqrt() } else { rest / lower[j][j] };
            }
        }
        lower
    }

    /// Two timings for each algorithm and size on machines that deviate as told.
    fn made_up(truth: &Deviations, machines: usize) -> Vec<TimingError> {
        let ids = ids();
        let at: Vec<(&AlgorithmId, f64)> = ids.iter().flat_map(|id| SIZES.map(|s| (id, s))).collect();
        let covariance: Vec<Vec<f64>> =
            at.iter().map(|a| at.iter().map(|b| truth.covariance(a.0, b.0, a.1 - b.1)).collect()).collect();
        let lower = cholesky(&covariance);
        let mut random = Random::named(7, &["prior"]);
        let mut all = Vec::new();
        for machine in 0..machines {
            let draws: Vec<f64> = at.iter().map(|_| random.normal()).collect();
            for (row, (id, log2_objects)) in lower.iter().zip(&at) {
                let curve: f64 = row.iter().zip(&draws).map(|(l, d)| l * d).sum();
                for _ in 0..2 {
                    let ln_ratio = curve + truth.noise_ln * random.normal();
                    all.push(TimingError { machine, algorithm: (*id).clone(), log2_objects: *log2_objects, ln_ratio });
                }
            }
        }
        all
    }

    #[test]
    fn deviations_of_many_machines_are_found_again() {
        let truth = Deviations {
            shared: Part { constant_ln: 0.3, curve_ln: 0.0 },
            method: Part { constant_ln: 0.0, curve_ln: 0.2 },
            width: Part { constant_ln: 0.25, curve_ln: 0.0 },
            algorithm: Part { constant_ln: 0.0, curve_ln: 0.15 },
            term_ln: 0.0,
            length_octaves: 2.2,
            noise_ln: 0.06,
        };
        let found = prior(&made_up(&truth, 300));
        assert_eq!((found.defect(), found.gpu), (None, Prior::ASSUMED.gpu));
        let near = |found: f64, truth: f64| (found - truth).abs() < 0.2 * truth;
        let of = |p: Part| p.constant_ln.hypot(p.curve_ln);
        let with_terms = |p: Part, share: f64| (of(p).powi(2) + share * found.cpu.term_ln.powi(2)).sqrt();
        let (shared, method) =
            (with_terms(found.cpu.shared, TERMS_SHARED), with_terms(found.cpu.method, 1.0 - TERMS_SHARED));
        assert!(near(found.cpu.noise_ln, 0.06) && near(found.cpu.length_octaves, 2.2), "{found:?}");
        assert!(near(shared, 0.3) && near(method, 0.2), "{found:?}");
        assert!(near(of(found.cpu.width), 0.25) && near(of(found.cpu.algorithm), 0.15), "{found:?}");
        assert!(found.cpu.shared.constant_ln > 2.0 * found.cpu.shared.curve_ln, "{found:?}");
        assert!(found.cpu.method.curve_ln > 2.0 * found.cpu.method.constant_ln, "{found:?}");
    }

    #[test]
    fn one_machine_moves_the_assumed_prior_a_little_and_none_not_at_all() {
        assert_eq!(prior(&[]), Prior::ASSUMED);
        let silent: Vec<TimingError> = ids()
            .into_iter()
            .flat_map(|id| {
                SIZES.map(|log2_objects| TimingError { machine: 0, algorithm: id.clone(), log2_objects, ln_ratio: 0.0 })
            })
            .collect();
        let found = prior(&silent).cpu;
        let ratio = found.shared.constant_ln / Prior::ASSUMED.cpu.shared.constant_ln;
        assert!((ratio - (8.0_f64 / 9.0).sqrt()).abs() < 1e-9, "{ratio}");
    }
}

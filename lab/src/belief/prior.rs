//! How far costs on a new machine lie from their prediction, before anything was run on it.

use sapwise::{AlgorithmId, Backend, BackendClass, Term};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How far real costs lie from predicted ones on machines that a model has not seen, for each class of processor.
///
/// All figures are natural logarithms of real over predicted time. The classes are taken to be independent of each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Prior {
    /// Of algorithms on the CPU.
    pub cpu: Deviations,
    /// Of algorithms on GPUs.
    pub gpu: Deviations,
}

/// The parts that the deviation of an algorithm is the sum of, and the noise of one observation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Deviations {
    /// What all algorithms on this class of processor share.
    pub shared: Part,
    /// What the algorithms of one method share over numbers of threads or GPUs.
    pub method: Part,
    /// What algorithms on several threads or GPUs share over methods. Numbers that are near each other share more.
    pub width: Part,
    /// What an algorithm has for itself.
    pub algorithm: Part,
    /// Standard deviation of the logarithm of a factor on one term of a cost, such as its calls or its pairs. The algorithms of a
    /// method share it; four fifths of its variance are shared by all methods.
    pub term_ln: f64,
    /// Octaves of objects over which a curve keeps its height: the length scale of a squared exponential.
    pub length_octaves: f64,
    /// Standard deviation of a single observation around these curves: other loads of as many objects, and chance.
    pub noise_ln: f64,
}

/// One part of a deviation, as a function of the number of objects.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Part {
    /// Standard deviation of what is the same at every number of objects.
    pub constant_ln: f64,
    /// Standard deviation of what changes with it.
    pub curve_ln: f64,
}

/// Bounds of what a file may hold. A standard deviation of 5 is a factor of 150; without any noise two observations at the same
/// place that differ would have no explanation, and the arithmetic of an update would divide by zero.
const MOST_LN: f64 = 5.0;
const LEAST_NOISE_LN: f64 = 1e-3;
const LENGTHS: std::ops::RangeInclusive<f64> = 0.25..=64.0;

/// Share of the variance of a factor on a term that belongs to the processor, and so to all methods: what a cycle, a byte or a fork
/// costs there over its measured figure. The rest belongs to the code of the method.
pub const TERMS_SHARED: f64 = 0.8;

impl Prior {
    /// For a model that holds none. An assumption: near to those under which eight samples left the least regret on simulated
    /// machines that the model had not seen.
    pub const ASSUMED: Self = Self {
        cpu: Deviations {
            shared: Part { constant_ln: 0.08, curve_ln: 0.05 },
            method: Part { constant_ln: 0.08, curve_ln: 0.08 },
            width: Part { constant_ln: 0.08, curve_ln: 0.08 },
            algorithm: Part { constant_ln: 0.03, curve_ln: 0.05 },
            term_ln: 0.2,
            length_octaves: 3.3,
            noise_ln: 0.06,
        },
        gpu: Deviations {
            shared: Part { constant_ln: 0.12, curve_ln: 0.1 },
            method: Part { constant_ln: 0.08, curve_ln: 0.08 },
            width: Part { constant_ln: 0.1, curve_ln: 0.05 },
            algorithm: Part { constant_ln: 0.03, curve_ln: 0.05 },
            term_ln: 0.2,
            length_octaves: 3.3,
            noise_ln: 0.06,
        },
    };

    /// The figures of a class of processor.
    #[must_use]
    pub fn of(&self, class: BackendClass) -> &Deviations {
        match class {
            BackendClass::Cpu => &self.cpu,
            BackendClass::Gpu => &self.gpu,
        }
    }

    /// What makes this prior unusable, if anything.
    #[must_use]
    pub fn defect(&self) -> Option<String> {
        [BackendClass::Cpu, BackendClass::Gpu].into_iter().find_map(|class| {
            let d = self.of(class);
            let parts = [d.shared, d.method, d.width, d.algorithm];
            let figures = parts.iter().flat_map(|p| [p.constant_ln, p.curve_ln]).chain([d.noise_ln, d.term_ln]);
            if let Some(wrong) = figures.into_iter().find(|f| !(0.0..=MOST_LN).contains(f)) {
                return Some(format!("the prior of the {class} has a standard deviation of {wrong}"));
            }
            if d.noise_ln < LEAST_NOISE_LN {
                return Some(format!("the prior of the {class} has a noise of {}, less than {LEAST_NOISE_LN}", d.noise_ln));
            }
            (!LENGTHS.contains(&d.length_octaves))
                .then(|| format!("the prior of the {class} has a length of {} octaves", d.length_octaves))
        })
    }
}

impl Deviations {
    /// Covariance of the deviations of two algorithms on this class of processor, `octaves` of objects apart.
    #[must_use]
    pub fn covariance(&self, a: &AlgorithmId, b: &AlgorithmId, octaves: f64) -> f64 {
        let alike = self.alike(octaves);
        let mut sum =
            self.shared.covariance(alike) + width_correlation(a.backend(), b.backend()) * self.width.covariance(alike);
        if a.method() == b.method() {
            sum += self.method.covariance(alike);
        }
        if a == b {
            sum += self.algorithm.covariance(alike);
        }
        sum
    }

    /// Covariance of the factors that two algorithms have on the same term, `None` being a product. A call on one thread has no fork and join, which a call on
    /// several mostly is; these share nothing.
    #[must_use]
    pub(super) fn covariance_of_terms(&self, term: Option<Term>, a: &AlgorithmId, b: &AlgorithmId) -> f64 {
        let wide = |id: &AlgorithmId| id.backend().width() > 1;
        if term == Some(Term::Call) && wide(a) != wide(b) {
            return 0.0;
        }
        self.term_ln.powi(2) * if a.method() == b.method() { 1.0 } else { TERMS_SHARED }
    }

    /// Correlation of a curve with itself `octaves` further on.
    fn alike(&self, octaves: f64) -> f64 {
        (-0.5 * (octaves / self.length_octaves).powi(2)).exp()
    }
}

impl Part {
    fn covariance(self, alike: f64) -> f64 {
        self.constant_ln.powi(2) + self.curve_ln.powi(2) * alike
    }
}

/// How much of what is due to their width two algorithms share: nothing where one of them is alone, all where both are as wide.
/// In between the square root of the ratio of their logarithms, so that eight and sixteen threads share more than two and sixteen.
#[must_use]
pub fn width_correlation(a: &Backend, b: &Backend) -> f64 {
    let [a, b] = [a, b].map(|backend| f64::from(backend.width()).log2());
    if a > 0.0 && b > 0.0 { (a.min(b) / a.max(b)).sqrt() } else { 0.0 }
}

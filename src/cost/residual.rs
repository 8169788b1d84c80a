//! The part of a cost that its terms do not explain, as a function of the load.
//!
//! A Gaussian process with inducing points (Quiñonero-Candela and Rasmussen, A unifying view of sparse approximate
//! Gaussian process regression, 2005): a weighted sum of the load's similarity to each of some places. Far from all
//! places it is zero, and the terms alone hold.

use crate::Load;
use std::sync::Arc;

/// Coordinates of a load. The last one counts only for algorithms that are cheaper if boxes move little.
const COORDINATES: usize = 5;
/// Length scale of each coordinate: the distance over which a residual keeps its height. The coordinates are base-2
/// logarithms of objects, of pairs, strip candidates and axis candidates an object, and of [`Load::moved`].
const LENGTHS: [f64; COORDINATES] = [3.0, 3.0, 4.0, 6.0, 2.5];
/// Pairs an object, and [`Load::moved`], below which scenes count as alike.
const FEW_PAIRS: f64 = 0.05;
const LITTLE_MOVED: f64 = 0.005;
/// Highest plausible weight or constant. Weights of similar places may be large with opposite signs.
const MOST_LN: f64 = 1000.0;
/// Base-2 logarithm of the exponent of the kernel, a rational quadratic: regrets equal those of a squared
/// exponential, and it takes a division and four products instead of an exponential.
const EXPONENT_LOG2: u32 = 4;

/// Loads at which the residuals of all methods of a machine or a model are known.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(from = "Vec<Load>", into = "Vec<Load>")
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Places {
    loads: Vec<Load>,
    /// The coordinates of all places, ordered by coordinate, then by place.
    coordinates: Vec<f64>,
    /// Base-2 logarithms of the fewest and the most objects; loads outside are clamped.
    octaves: [f64; 2],
}

/// The correction of a cost over the load: what the terms leave unexplained, and what frames that ran showed.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
#[non_exhaustive]
pub struct Residual {
    /// Loads at which it is known.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub places: Arc<Places>,
    /// The logarithm of a factor that holds everywhere.
    pub constant: f64,
    /// The weight of each of the first `places`, as the logarithm of a factor.
    pub weights: Vec<f64>,
    /// Whether the correction depends on how far boxes move.
    pub by_motion: bool,
}

/// Similarity of a load to each place, 0 to 1: whatever moves, and by motion.
pub(super) type Likeness = [[f64; Places::MOST]; 2];

impl Places {
    /// Most places of a residual. 96 improved no choice on held-out machines, and each place costs time in every
    /// decision.
    pub const MOST: usize = 64;

    /// Creates places at the first [`Places::MOST`] of these loads.
    pub fn new(mut loads: Vec<Load>) -> Self {
        loads.truncate(Self::MOST);
        let all = loads.clone();
        Self::of_sizes(loads, &all)
    }

    /// Creates places at these loads, clamped to the sizes of `all`.
    pub fn of_sizes(loads: Vec<Load>, all: &[Load]) -> Self {
        let (count, octaves) = (loads.len(), sizes(all));
        let mut coordinates = vec![0.0; COORDINATES * count];
        for (k, load) in loads.iter().enumerate() {
            for (c, x) in coordinates_of(load, octaves).into_iter().enumerate() {
                coordinates[c * count + k] = x;
            }
        }
        Self { loads, coordinates, octaves }
    }

    /// Returns the loads, in the order of the weights of residuals.
    pub fn loads(&self) -> &[Load] {
        &self.loads
    }

    /// Returns the similarity of `load` to each place, 0 to 1, which is the correlation of two values of a residual.
    /// With `by_motion` it depends on how far boxes move too.
    pub fn likeness(&self, load: &Load, by_motion: bool) -> Vec<f64> {
        self.likeness_of(load)[usize::from(by_motion)][..self.loads.len()].to_vec()
    }

    /// Returns places of scenes of constant density that move little, for costs without places.
    pub(crate) fn usual() -> Arc<Self> {
        let load = |k: u32| {
            let n = 2.0_f64.powi(3 + 3 * k as i32);
            Load::of_objects(n as u32).with_pairs(0.5 * n).with_candidates(n.powf(1.5), 4.0 * n)
        };
        Arc::new(Self::new((0..7).map(load).collect()))
    }

    pub(super) fn likeness_of(&self, load: &Load) -> Likeness {
        let at = coordinates_of(load, self.octaves);
        let count = self.loads.len();
        let [mut whatever_moves, mut by_motion] = [[0.0; Self::MOST]; 2];
        // Coordinate by coordinate over all places, so that the compiler takes several places at a time.
        let (rest, motion) = self.coordinates.split_at((COORDINATES - 1) * count);
        let distances = &mut whatever_moves[..count];
        for (x, row) in at.iter().zip(rest.chunks_exact(count.max(1))) {
            for (d, y) in distances.iter_mut().zip(row) {
                *d += (x - y) * (x - y);
            }
        }
        let moved = at[COORDINATES - 1];
        for ((k, d), y) in by_motion[..count].iter_mut().zip(distances).zip(motion) {
            *k = kernel(*d + (moved - y) * (moved - y));
            *d = kernel(*d);
        }
        [whatever_moves, by_motion]
    }
}

#[cfg(feature = "serde")]
impl From<Vec<Load>> for Places {
    fn from(loads: Vec<Load>) -> Self {
        Self::new(loads)
    }
}

#[cfg(feature = "serde")]
impl From<Places> for Vec<Load> {
    fn from(places: Places) -> Self {
        places.loads
    }
}

impl Residual {
    /// Creates a residual with weights for the first places and no constant.
    pub fn new(places: Arc<Places>, weights: Vec<f64>, by_motion: bool) -> Self {
        Self { places, constant: 0.0, weights, by_motion }
    }

    /// Returns the natural logarithm of the factor on the cost under a load.
    pub fn ln(&self, load: &Load) -> f64 {
        self.ln_of(&self.places.likeness_of(load))
    }

    pub(super) fn ln_of(&self, likeness: &Likeness) -> f64 {
        // Four sums side by side: one would wait for each addition.
        let mut sums = [0.0; 4];
        let (weights, likeness) = (self.weights.chunks_exact(4), &likeness[usize::from(self.by_motion)]);
        let rest: f64 = weights.remainder().iter().zip(&likeness[self.weights.len() & !3..]).map(|(w, k)| w * k).sum();
        for (w, k) in weights.zip(likeness.chunks_exact(4)) {
            sums.iter_mut().zip(w.iter().zip(k)).for_each(|(sum, (w, k))| *sum += w * k);
        }
        self.constant + sums.iter().sum::<f64>() + rest
    }

    /// Returns whether its weights are plausible, and no more than its places.
    pub(crate) fn is_sound(&self) -> bool {
        self.weights.len() <= self.places.loads.len()
            && self.weights.iter().chain([&self.constant]).all(|w| w.abs() <= MOST_LN)
            && self.places.loads.iter().all(Load::is_sound)
    }
}

/// Returns the base-2 logarithms of the fewest and of the most objects of some loads.
fn sizes(loads: &[Load]) -> [f64; 2] {
    let all = loads.iter().map(octaves);
    [all.clone().fold(64.0, f64::min), all.fold(0.0, f64::max)]
}

fn octaves(load: &Load) -> f64 {
    f64::from(load.objects.max(1)).log2()
}

fn coordinates_of(load: &Load, [fewest, most]: [f64; 2]) -> [f64; COORDINATES] {
    let n = f64::from(load.objects.max(1));
    let figures = [
        octaves(load).min(most).max(fewest),
        (load.pairs / n + FEW_PAIRS).log2(),
        (load.strip_candidates / n + 1.0).log2(),
        (load.axis_candidates / n + 1.0).log2(),
        (load.moved + LITTLE_MOVED).log2(),
    ];
    std::array::from_fn(|k| figures[k] / LENGTHS[k])
}

fn kernel(squared_distance: f64) -> f64 {
    let exponent = f64::from(1_u32 << EXPONENT_LOG2);
    let mut k = 1.0 / (1.0 + squared_distance / (2.0 * exponent));
    for _ in 0..EXPONENT_LOG2 {
        k *= k;
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(objects: u32, pairs: f64, moved: f64) -> Load {
        Load::of_objects(objects).with_pairs(pairs).with_moved(moved)
    }

    #[test]
    fn the_kernel_is_near_a_squared_exponential() {
        for k in 0..60 {
            let d = f64::from(k) * 0.1;
            assert!((kernel(d) - (-0.5 * d).exp()).abs() < 0.02, "{d}");
        }
        assert_eq!(kernel(0.0), 1.0);
    }

    #[test]
    fn a_residual_holds_at_its_places_and_is_zero_far_from_them() {
        let places = Arc::new(Places::new(vec![load(1000, 500.0, 0.0), load(1_000_000, 500_000.0, 0.0)]));
        let residual = Residual::new(places, vec![0.3, -0.2], false);
        assert!((residual.ln(&load(1000, 500.0, 0.9)) - 0.3).abs() < 0.01);
        assert!((residual.ln(&load(1_000_000, 500_000.0, 0.0)) + 0.2).abs() < 0.01);
        // Beyond its sizes it is constant.
        assert_eq!(residual.ln(&load(4_000_000, 2_000_000.0, 0.0)), residual.ln(&load(1_000_000, 500_000.0, 0.0)));
        assert!(residual.ln(&load(1000, 400_000.0, 0.0)).abs() < 0.05);
        assert!(residual.is_sound());
    }

    #[test]
    fn motion_counts_only_if_asked_for() {
        let places = Arc::new(Places::new((0..7).map(|k| load(1 << (3 + k), 4.0, 0.0)).collect()));
        let weights: Vec<f64> = (1..=7).map(|k| 0.1 * f64::from(k)).collect();
        let still = Residual::new(Arc::clone(&places), weights.clone(), false);
        let moving = Residual::new(places, weights, true);
        let far = load(64, 4.0, 1.0);
        assert_eq!(still.ln(&far), still.ln(&far.with_moved(0.0)));
        assert!(moving.ln(&far) < 0.2 * moving.ln(&far.with_moved(0.0)));
        let by_hand: f64 = still.weights.iter().zip(still.places.likeness(&far, false)).map(|(w, k)| w * k).sum();
        assert!((still.ln(&far) - by_hand).abs() < 1e-12);
    }
}

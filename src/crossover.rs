//! Where one algorithm overtakes another, from timings of both on the same frames.
//!
//! For each size the median over frames of `ln(first / second)` is taken, a local line is fitted through the medians over
//! the logarithm of the size, and its roots are the crossings. Pairing frame by frame cancels what disturbed both, the
//! median ignores single disturbed frames, and the line uses the neighbouring sizes. Intervals come from drawing the frames
//! of every size anew and repeating all of it.

/// Frames of two algorithms at one size. The k-th sample of both is the same frame; what has no partner is not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Paired<'a> {
    /// Objects in each frame.
    pub objects: u32,
    /// Nanoseconds of the first algorithm.
    pub first_ns: &'a [u64],
    /// Nanoseconds of the second algorithm.
    pub second_ns: &'a [u64],
}

/// Which of two algorithms is cheaper at which sizes, within the sizes that were measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Crossover {
    /// One crossing.
    At(Position),
    /// The first is cheaper throughout, or where neither is distinguishable from the other, cheaper on average.
    AlwaysFirst,
    /// The same for the second.
    AlwaysSecond,
    /// More than one crossing, ascending by objects.
    Several(Vec<Position>),
}

/// A crossing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Number of objects at which both cost the same.
    pub objects: f64,
    /// Lower end of the 90 % interval. Equal to the smallest measured size when the crossing may lie below it.
    pub low: f64,
    /// Upper end of the 90 % interval. Equal to the largest measured size when the crossing may lie above it.
    pub high: f64,
    /// Whether the first algorithm is the cheaper one with fewer objects.
    pub first_below: bool,
}

impl Crossover {
    /// The crossings, ascending by objects; none when one algorithm is always cheaper.
    #[must_use]
    pub fn positions(&self) -> &[Position] {
        match self {
            Self::At(position) => std::slice::from_ref(position),
            Self::Several(positions) => positions,
            Self::AlwaysFirst | Self::AlwaysSecond => &[],
        }
    }
}

/// Resampled curves behind each interval.
const REPLICATES: usize = 200;
/// An excursion to one side counts when this share of the resampled curves has it.
const SUPPORT: f64 = 0.99;
/// Sizes that take part in each local line, where there are so many.
const NEIGHBOURS: usize = 5;
/// Distance of the points at which the curve is evaluated: 1/32 octave.
const GRID_STEP: f64 = std::f64::consts::LN_2 / 32.0;

/// Where `first` and `second` cross over the sizes of `points`, in any order of sizes and with equal sizes joined.
///
/// An excursion to the other side that fewer than 99 % of the resampled curves show is no crossing: the roots around it
/// count as one, or as none where the curve returns to the side it came from. Pass only sizes at which both were timed.
/// The same `seed` gives the same intervals. `None` with fewer than three sizes that have a pair of samples above zero.
#[must_use]
pub fn crossover(points: &[Paired<'_>], seed: u64) -> Option<Crossover> {
    let sizes = log_ratios(points);
    if sizes.len() < 3 {
        return None;
    }
    let at: Vec<f64> = sizes.iter().map(|s| s.0).collect();
    let smoother = Smoother::new(&at);
    let mut scratch = Vec::new();
    let medians: Vec<f64> = sizes.iter().map(|(_, r)| median(r, &mut scratch)).collect();
    let curve = smoother.curve(&medians);
    let replicates = resampled(&sizes, &smoother, seed);

    let mut held: Vec<Excursion> = Vec::new();
    for excursion in excursions(&curve) {
        if excursion.support(&replicates) < SUPPORT {
            continue;
        }
        match held.last_mut().filter(|last| last.positive == excursion.positive) {
            // What lay between was not supported, so both belong to one excursion.
            Some(last) => {
                last.end = excursion.end;
                last.last_peak = excursion.last_peak;
            }
            None => held.push(excursion),
        }
    }
    let mut positions: Vec<Position> =
        held.windows(2).map(|w| position(&w[0], &w[1], &curve, &replicates, &smoother)).collect();
    Some(match (positions.len(), held.first()) {
        (0, Some(only)) if only.positive => Crossover::AlwaysSecond,
        (0, Some(_)) => Crossover::AlwaysFirst,
        (0, None) if curve.iter().sum::<f64>() > 0.0 => Crossover::AlwaysSecond,
        (0, None) => Crossover::AlwaysFirst,
        (1, _) => Crossover::At(positions.remove(0)),
        _ => Crossover::Several(positions),
    })
}

/// For each size, ascending, the logarithm of the objects and of `first / second` frame by frame.
fn log_ratios(points: &[Paired<'_>]) -> Vec<(f64, Vec<f64>)> {
    let mut ordered: Vec<&Paired<'_>> = points.iter().filter(|p| p.objects > 0).collect();
    ordered.sort_by_key(|p| p.objects);
    let mut sizes: Vec<(f64, Vec<f64>)> = Vec::new();
    for point in ordered {
        let pairs = point.first_ns.iter().zip(point.second_ns).filter(|(a, b)| **a > 0 && **b > 0);
        let ratios = pairs.map(|(&a, &b)| (a as f64 / b as f64).ln());
        let at = f64::from(point.objects).ln();
        match sizes.last_mut().filter(|last| last.0 == at) {
            Some(last) => last.1.extend(ratios),
            None => sizes.push((at, ratios.collect())),
        }
    }
    sizes.retain(|(_, ratios)| !ratios.is_empty());
    for (_, ratios) in &mut sizes {
        drop_outliers(ratios);
    }
    sizes
}

/// Drops what lies more than five standard deviations from the median, estimated from the median absolute deviation.
///
/// The median alone would bear them, but some drawings with replacement hold one outlier several times.
fn drop_outliers(ratios: &mut Vec<f64>) {
    let mut scratch = Vec::new();
    let centre = median(ratios, &mut scratch);
    let deviations: Vec<f64> = ratios.iter().map(|r| (r - centre).abs()).collect();
    // 1.4826 makes the median absolute deviation of a normal distribution its standard deviation.
    let reach = 5.0 * 1.4826 * median(&deviations, &mut scratch);
    ratios.retain(|r| (r - centre).abs() <= reach);
}

/// Local lines through values at fixed places, evaluated on a grid. Linear in the values, so the weights are found once.
struct Smoother {
    /// Places of the grid.
    grid: Vec<f64>,
    /// For each place of the grid the first value that takes part, and the weights from there on.
    weights: Vec<(usize, Vec<f64>)>,
}

impl Smoother {
    /// Over at least two ascending places.
    fn new(at: &[f64]) -> Self {
        let (low, high) = (at[0], at[at.len() - 1]);
        let parts = ((high - low) / GRID_STEP).ceil().max(1.0) as usize;
        let grid: Vec<f64> = (0..=parts).map(|k| low + (high - low) * k as f64 / parts as f64).collect();
        let weights = grid.iter().map(|&x| line_weights(at, x)).collect();
        Self { grid, weights }
    }

    fn curve(&self, values: &[f64]) -> Vec<f64> {
        let fit = |(first, w): &(usize, Vec<f64>)| w.iter().zip(&values[*first..]).map(|(w, v)| w * v).sum();
        self.weights.iter().map(fit).collect()
    }
}

/// The weights with which the values at `at` enter a tricube-weighted line evaluated at `x`.
fn line_weights(at: &[f64], x: f64) -> (usize, Vec<f64>) {
    let count = NEIGHBOURS.min(at.len());
    // The window of `count` places whose farther end is nearest to x.
    let first = (0..=at.len() - count)
        .min_by(|&a, &b| {
            let reach = |k: usize| (x - at[k]).abs().max((at[k + count - 1] - x).abs());
            reach(a).total_cmp(&reach(b))
        })
        .unwrap_or(0);
    let window = &at[first..first + count];
    // A little wider than the window: a tricube weight is zero at its own reach.
    let reach = 1.2 * window.iter().map(|a| (a - x).abs()).fold(f64::MIN_POSITIVE, f64::max);
    let tricube: Vec<f64> = window.iter().map(|a| (1.0 - ((a - x).abs() / reach).powi(3)).max(0.0).powi(3)).collect();
    let total: f64 = tricube.iter().sum();
    let centre = tricube.iter().zip(window).map(|(w, a)| w * a).sum::<f64>() / total;
    let spread: f64 = tricube.iter().zip(window).map(|(w, a)| w * (a - centre).powi(2)).sum();
    let weight = |w: f64, a: f64| w * (1.0 / total + (x - centre) * (a - centre) / spread);
    (first, tricube.iter().zip(window).map(|(&w, &a)| weight(w, a)).collect())
}

/// Curves through medians of frames that were drawn with replacement, each size on its own.
fn resampled(sizes: &[(f64, Vec<f64>)], smoother: &Smoother, seed: u64) -> Vec<Vec<f64>> {
    let mut random = SplitMix(seed);
    let (mut drawn, mut scratch) = (Vec::new(), Vec::new());
    let mut replicate = || {
        let mut medians = Vec::with_capacity(sizes.len());
        for (_, ratios) in sizes {
            drawn.clear();
            drawn.extend((0..ratios.len()).map(|_| ratios[random.below(ratios.len())]));
            medians.push(median(&drawn, &mut scratch));
        }
        smoother.curve(&medians)
    };
    (0..REPLICATES).map(|_| replicate()).collect()
}

/// A stretch of the grid on which the curve keeps its sign.
struct Excursion {
    /// The second algorithm is cheaper.
    positive: bool,
    /// First and last place on the grid.
    start: usize,
    end: usize,
    /// Where the curve is farthest from zero; two places where several excursions were joined.
    first_peak: usize,
    last_peak: usize,
}

impl Excursion {
    /// Share of the replicates whose area over this stretch has the same sign. The area and not the peak, which is where
    /// the noise was greatest.
    fn support(&self, replicates: &[Vec<f64>]) -> f64 {
        let area = |r: &[f64]| r[self.start..=self.end].iter().sum::<f64>();
        let agreeing = replicates.iter().filter(|r| (area(r) > 0.0) == self.positive).count();
        agreeing as f64 / replicates.len() as f64
    }
}

fn excursions(curve: &[f64]) -> Vec<Excursion> {
    let mut list: Vec<Excursion> = Vec::new();
    for (k, &value) in curve.iter().enumerate() {
        let positive = value > 0.0;
        match list.last_mut().filter(|last| last.positive == positive) {
            Some(last) => {
                last.end = k;
                if value.abs() > curve[last.first_peak].abs() {
                    (last.first_peak, last.last_peak) = (k, k);
                }
            }
            None => list.push(Excursion { positive, start: k, end: k, first_peak: k, last_peak: k }),
        }
    }
    list
}

/// The one crossing between two supported excursions of opposite sign.
fn position(below: &Excursion, above: &Excursion, curve: &[f64], replicates: &[Vec<f64>], smoother: &Smoother) -> Position {
    // Between them lie an odd number of roots; the middle one leaves as much disagreement below as above.
    let roots = roots(curve, below.end, above.start, &smoother.grid);
    let objects = roots.get(roots.len() / 2).copied().unwrap_or(smoother.grid[above.start]);
    let (from, to) = (below.last_peak, above.first_peak);
    let (mut first, mut last) = (Vec::new(), Vec::new());
    for replicate in replicates {
        let roots = self::roots(replicate, from, to, &smoother.grid);
        // Without a root the replicate crosses beyond one of the peaks: the one whose sign it does not have.
        let beyond = if (replicate[from] > 0.0) == below.positive { to } else { from };
        first.push(roots.first().copied().unwrap_or(smoother.grid[beyond]));
        last.push(roots.last().copied().unwrap_or(smoother.grid[beyond]));
    }
    let low = quantile(&mut first, 0.05).min(objects);
    let high = quantile(&mut last, 0.95).max(objects);
    Position { objects: objects.exp(), low: low.exp(), high: high.exp(), first_below: !below.positive }
}

/// Roots between two places of the grid, ascending.
fn roots(curve: &[f64], from: usize, to: usize, grid: &[f64]) -> Vec<f64> {
    let crossed = (from..to).filter(|&k| (curve[k] > 0.0) != (curve[k + 1] > 0.0));
    crossed.map(|k| grid[k] + (grid[k + 1] - grid[k]) * curve[k] / (curve[k] - curve[k + 1])).collect()
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

/// Median of at least one value.
fn median(values: &[f64], scratch: &mut Vec<f64>) -> f64 {
    scratch.clear();
    scratch.extend_from_slice(values);
    let half = scratch.len() / 2;
    let (below, upper, _) = scratch.select_nth_unstable_by(half, f64::total_cmp);
    let upper = *upper;
    if values.len() % 2 == 1 {
        return upper;
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (lower + upper) / 2.0
}

/// SplitMix64 (Steele, Lea and Flood, 2014): enough for drawing frames, and the same on every machine.
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        crate::splitmix::next(&mut self.0)
    }

    /// A number below `bound`, by the upper half of a product; its bias is `bound` in 2^64.
    fn below(&mut self, bound: usize) -> usize {
        ((u128::from(self.next()) * bound as u128) >> 64) as usize
    }
}

#[cfg(test)]
mod tests;

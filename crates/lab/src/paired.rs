//! Paired comparisons: where one algorithm overtakes another, from timings of both on the same frames.
//!
//! For each point the median over frames of `ln(first / second)` is taken, lines are fitted through nearby medians over the
//! logarithm of the size, and their roots are the crossings. Pairing frame by frame cancels what disturbed both, the median
//! ignores single disturbed frames, and a line uses the neighbouring sizes. The interval of a crossing holds the sizes around it
//! at which neither algorithm is told from the other: where the medians are noisy or the ratio is flat it is wide.

mod ratio;

use ratio::Ratio;
use sapwise::stats::NORMAL_90;

pub use ratio::PairedSamples;

/// Which of two algorithms is cheaper at which sizes, within the sizes that were measured.
#[derive(Debug, Clone, PartialEq)]
pub enum PairedOutcome {
    /// One crossing.
    At(PairedCrossing),
    /// The first is cheaper throughout, or where neither is distinguishable from the other, cheaper on average.
    AlwaysFirst,
    /// The same for the second.
    AlwaysSecond,
    /// More than one crossing, ascending by objects.
    Several(Vec<PairedCrossing>),
}

/// A crossing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedCrossing {
    /// Number of objects at which both cost the same.
    pub objects: f64,
    /// Lower end of the 90 % interval. Equal to the smallest measured size when the crossing may lie below it.
    pub low: f64,
    /// Upper end of the 90 % interval. Equal to the largest measured size when the crossing may lie above it.
    pub high: f64,
    /// Whether the first algorithm is the cheaper one with fewer objects.
    pub first_below: bool,
}

impl PairedOutcome {
    /// The crossings, ascending by objects; none when one algorithm is always cheaper.
    #[must_use]
    pub fn positions(&self) -> &[PairedCrossing] {
        match self {
            Self::At(position) => std::slice::from_ref(position),
            Self::Several(positions) => positions,
            Self::AlwaysFirst | Self::AlwaysSecond => &[],
        }
    }
}

/// Quantile of the normal distribution that pure noise exceeds in one case of a hundred.
const DISTINCT: f64 = 2.326;

/// Where `first` and `second` of `points` cross. See [`PairedComparison`].
#[must_use]
pub fn compare(points: &[PairedSamples<'_>]) -> Option<PairedOutcome> {
    Some(PairedComparison::new(points)?.outcome())
}

/// The costs of two algorithms beside each other, over the sizes at which both were timed.
#[derive(Debug, Clone)]
pub struct PairedComparison {
    ratio: Ratio,
    /// `ln(first / second)` at each place of the grid.
    curve: Vec<f64>,
    /// The same in units of what is told from zero: the first is distinctly cheaper at -1, the second at 1.
    told: Vec<f64>,
}

impl PairedComparison {
    /// Compares the algorithms over `points`, in the order of measurement.
    ///
    /// A point whose size is not above the one before begins another round: what changed between rounds widens the intervals.
    /// Sizes may stand several times and need not be evenly spaced. Pass only points at which both were timed. `None` with
    /// fewer than three sizes that have a pair of samples above zero.
    #[must_use]
    pub fn new(points: &[PairedSamples<'_>]) -> Option<Self> {
        let ratio = Ratio::new(points, DISTINCT)?;
        let curve = ratio.curve();
        let told = curve.iter().map(|e| e.in_units_of(NORMAL_90)).collect();
        Some(Self { ratio, curve: curve.iter().map(|e| e.value).collect(), told })
    }

    /// Where they cross.
    ///
    /// An excursion to one side whose area could be noise in more than one case of a hundred is none: the roots around it count
    /// as one, or as none where the ratio returns to the side it came from.
    #[must_use]
    pub fn outcome(&self) -> PairedOutcome {
        let mut held: Vec<Excursion> = Vec::new();
        for excursion in excursions(&self.curve) {
            if self.ratio.area(excursion.start, excursion.end).in_units_of(DISTINCT).abs() < 1.0 {
                continue;
            }
            match held.last_mut().filter(|last| last.positive == excursion.positive) {
                // What lay between was not distinct, so both belong to one excursion.
                Some(last) => last.end = excursion.end,
                None => held.push(excursion),
            }
        }
        let mut positions: Vec<PairedCrossing> = held.windows(2).map(|w| self.position(&w[0], &w[1])).collect();
        match (positions.len(), held.first()) {
            (0, Some(only)) if only.positive => PairedOutcome::AlwaysSecond,
            (0, Some(_)) => PairedOutcome::AlwaysFirst,
            (0, None) if self.curve.iter().sum::<f64>() > 0.0 => PairedOutcome::AlwaysSecond,
            (0, None) => PairedOutcome::AlwaysFirst,
            (1, _) => PairedOutcome::At(positions.remove(0)),
            _ => PairedOutcome::Several(positions),
        }
    }

    /// The 90 % interval of a crossover at `objects` that was found otherwise: the sizes around it at which neither is distinctly
    /// cheaper. Where the wrong one is at `objects`, from there over the sizes up to the crossing and around that. It ends
    /// with the measured sizes. The first algorithm is the one below the crossover if `first_below`. `None` for a crossover beyond
    /// the measured sizes.
    #[must_use]
    pub fn interval(&self, objects: f64, first_below: bool) -> Option<(f64, f64)> {
        let grid = &self.ratio.grid;
        let (&lowest, &highest) = (grid.first()?, grid.last()?);
        let at = objects.ln();
        if !(lowest..=highest).contains(&at) {
            return None;
        }
        // At least 1 where the one above is distinctly cheaper, and at most -1 where the one below is.
        let told = |k: usize| if first_below { self.told[k] } else { -self.told[k] };
        let edge = |within: usize, beyond: usize| {
            let (a, b) = (told(within).abs(), told(beyond).abs());
            // Whoever is ahead on the wrong side is not what ends the interval.
            let a = if told(within) * told(beyond) > 0.0 { a } else { 0.0 };
            grid[within] + (grid[beyond] - grid[within]) * (1.0 - a) / (b - a)
        };
        // The places around `at`, one and the same where it is a place itself.
        let (below, above) = (grid.partition_point(|g| *g <= at) - 1, grid.partition_point(|g| *g < at));
        // On the way from the crossover: over where the wrong one is ahead, then over where nothing is told.
        let low = match (0..=above).rev().skip_while(|&k| told(k) >= 1.0).find(|&k| told(k).abs() >= 1.0) {
            None => lowest.exp(),
            Some(k) if k == above => objects,
            Some(k) => edge(k + 1, k).exp(),
        };
        let high = match (below..grid.len()).skip_while(|&k| told(k) <= -1.0).find(|&k| told(k).abs() >= 1.0) {
            None => highest.exp(),
            Some(k) if k == below => objects,
            Some(k) => edge(k - 1, k).exp(),
        };
        // The edge may lie beside `objects`, between the same two places.
        Some((low.min(objects), high.max(objects)))
    }

    /// The one crossing between two excursions of opposite sign.
    fn position(&self, below: &Excursion, above: &Excursion) -> PairedCrossing {
        let (curve, grid) = (&self.curve, &self.ratio.grid);
        let crossed = (below.end..above.start).filter(|&k| (curve[k] > 0.0) != (curve[k + 1] > 0.0));
        let root = |k: usize| grid[k] + (grid[k + 1] - grid[k]) * curve[k] / (curve[k] - curve[k + 1]);
        let roots: Vec<f64> = crossed.map(root).collect();
        // Between them lie an odd number of roots; the middle one leaves as much disagreement below as above.
        let objects = roots.get(roots.len() / 2).copied().unwrap_or(grid[above.start]).exp();
        let first_below = !below.positive;
        let (low, high) = self.interval(objects, first_below).unwrap_or((objects, objects));
        PairedCrossing { objects, low, high, first_below }
    }
}

/// A stretch of the grid on which the ratio keeps its sign.
struct Excursion {
    /// The second algorithm is cheaper.
    positive: bool,
    /// First and last place on the grid.
    start: usize,
    end: usize,
}

fn excursions(curve: &[f64]) -> Vec<Excursion> {
    let mut list: Vec<Excursion> = Vec::new();
    for (k, &value) in curve.iter().enumerate() {
        let positive = value > 0.0;
        match list.last_mut().filter(|last| last.positive == positive) {
            Some(last) => last.end = k,
            None => list.push(Excursion { positive, start: k, end: k }),
        }
    }
    list
}

#[cfg(test)]
mod tests;

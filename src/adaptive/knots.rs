//! Where the correction of a cost curve has its knots.

/// Knots of an own curve: 2^3 to 2^21 objects, every second octave, linear in between and constant beyond.
pub(super) const KNOTS: usize = 10;
const FIRST_OCTAVE: f64 = 3.0;
const OCTAVES: f64 = 2.0;

/// A number of objects among the knots.
#[derive(Debug, Clone, Copy)]
pub(super) struct KnotPosition {
    knot: usize,
    share: f64,
}

impl KnotPosition {
    pub(super) fn of(log2_objects: f64) -> Self {
        let at = ((log2_objects - FIRST_OCTAVE) / OCTAVES).clamp(0.0, (KNOTS - 1) as f64);
        let knot = (at as usize).min(KNOTS - 2);
        Self { knot, share: at - knot as f64 }
    }

    /// The knots on both sides, with their weights.
    pub(super) fn knots(self) -> [(usize, f64); 2] {
        [(self.knot, 1.0 - self.share), (self.knot + 1, self.share)]
    }
}

/// Where an algorithm is looked at: the number of objects, and the share of its predicted cost that calls have.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub(super) position: KnotPosition,
    pub(super) calls: f64,
}

/// Logarithms of the numbers of objects at the knots.
pub(super) fn octaves() -> impl Iterator<Item = f64> {
    (0..KNOTS).map(|k| FIRST_OCTAVE + OCTAVES * k as f64)
}

/// Objects this many quarters of a decade above one.
pub(super) fn objects_of(quarter: u32) -> u32 {
    10.0_f64.powf(f64::from(quarter) / 4.0).round() as u32
}

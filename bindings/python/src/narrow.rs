//! Boxes of 64-bit floats, rounded to 32 bits.

use sapwise::{Aabb, BoxDefect};

/// The box with each bound rounded to the nearest 32-bit float. Rounding never turns `a <= b` around, so that boxes which overlap still do;
/// boxes may come to overlap that lie closer to each other than such floats can tell. To round outward would add more of them and spare none. What is
/// wrong with a box is told before it is rounded, since that may right an inverted one.
pub(crate) fn rounded(min: [f64; 3], max: [f64; 3]) -> Result<Aabb, BoxDefect> {
    if !(0..3).all(|a| min[a] <= max[a]) {
        let nan = min.iter().chain(&max).any(|v| v.is_nan());
        return Err(if nan { BoxDefect::NotANumber } else { BoxDefect::Inverted });
    }
    Ok(Aabb::new(min.map(|v| v as f32), max.map(|v| v as f32)))
}

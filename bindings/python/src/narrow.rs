//! Rounds boxes of 64-bit floats to 32 bits.

use sapwise::Aabb;
use sapwise::error::BoxDefect;

/// Rounds each bound to the nearest 32-bit float. Rounding is monotonic: no pair is lost, and nearly touching boxes may
/// gain one. Rounding outward would add more. Defects are checked before rounding, which may hide an inverted box.
pub(crate) fn rounded(min: [f64; 3], max: [f64; 3]) -> Result<Aabb, BoxDefect> {
    if !(0..3).all(|a| min[a] <= max[a]) {
        let nan = min.iter().chain(&max).any(|v| v.is_nan());
        return Err(if nan { BoxDefect::NotANumber } else { BoxDefect::Inverted });
    }
    Ok(Aabb::new(min.map(|v| v as f32), max.map(|v| v as f32)))
}

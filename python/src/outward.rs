//! Boxes of 64-bit floats, rounded to 32 bits so that no pair is lost.

use sapwise::{Aabb, BoxDefect};

/// The greatest 32-bit float that is not above `v`. NaN stays NaN.
fn down(v: f64) -> f32 {
    let near = v as f32;
    if f64::from(near) > v { near.next_down() } else { near }
}

/// The least 32-bit float that is not below `v`.
fn up(v: f64) -> f32 {
    let near = v as f32;
    if f64::from(near) < v { near.next_up() } else { near }
}

/// The smallest box of 32-bit floats that contains this one. What is wrong with a box is told before it is rounded, since rounding may
/// right an inverted one.
pub(crate) fn rounded(min: [f64; 3], max: [f64; 3]) -> Result<Aabb, BoxDefect> {
    if !(0..3).all(|a| min[a] <= max[a]) {
        let nan = min.iter().chain(&max).any(|v| v.is_nan());
        return Err(if nan { BoxDefect::NotANumber } else { BoxDefect::Inverted });
    }
    Ok(Aabb::new(min.map(down), max.map(up)))
}

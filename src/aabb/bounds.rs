//! Three bounds of a box, serialised.
//!
//! In formats for humans, a bound that is not finite is a string, because JSON has no infinite numbers. A finite one
//! has the digits of an `f64`: with the fewest digits that name an `f32`, 7.038531e-26 read as `f64` may round to
//! another `f32`.

use serde::de::{Deserialize, Deserializer, Error, Unexpected};
use serde::ser::{Serialize, Serializer};

/// A bound in a format for humans.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(untagged, expecting = "expected a number, \"inf\" or \"-inf\"")]
enum Bound {
    Number(f64),
    Text(String),
}

pub(super) fn serialize<S: Serializer>(bounds: &[f32; 3], to: S) -> Result<S::Ok, S::Error> {
    if !to.is_human_readable() {
        return bounds.serialize(to);
    }
    let bound = |b: f32| if b.is_finite() { Bound::Number(b.into()) } else { Bound::Text(b.to_string()) };
    bounds.map(bound).serialize(to)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<[f32; 3], D::Error> {
    if !from.is_human_readable() {
        return <[f32; 3]>::deserialize(from);
    }
    let read = |bound| match bound {
        Bound::Number(number) => Ok(number as f32),
        Bound::Text(text) => {
            text.parse().map_err(|_| Error::invalid_value(Unexpected::Str(&text), &"a number, \"inf\" or \"-inf\""))
        }
    };
    let [x, y, z] = <[Bound; 3]>::deserialize(from)?;
    Ok([read(x)?, read(y)?, read(z)?])
}

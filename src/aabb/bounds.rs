//! Three bounds of a box, serialised.
//!
//! In formats for humans, a bound that is not finite is a string, because JSON has no infinite numbers. A finite one
//! has the digits of an `f64`: with the fewest digits that name an `f32`, 7.038531e-26 read as `f64` may round to
//! another `f32`.

use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};
use serde::ser::{Serialize, Serializer};
use std::fmt;

pub(super) fn serialize<S: Serializer>(bounds: &[f32; 3], to: S) -> Result<S::Ok, S::Error> {
    bounds.map(Bound).serialize(to)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<[f32; 3], D::Error> {
    Ok(<[Bound; 3]>::deserialize(from)?.map(|Bound(bound)| bound))
}

struct Bound(f32);

impl Serialize for Bound {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        if !to.is_human_readable() {
            to.serialize_f32(self.0)
        } else if self.0.is_finite() {
            to.serialize_f64(self.0.into())
        } else {
            to.collect_str(&self.0)
        }
    }
}

impl<'de> Deserialize<'de> for Bound {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        if from.is_human_readable() { from.deserialize_any(NumberOrString) } else { f32::deserialize(from).map(Self) }
    }
}

struct NumberOrString;

impl Visitor<'_> for NumberOrString {
    type Value = Bound;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, \"inf\" or \"-inf\"")
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Bound, E> {
        Ok(Bound(number as f32))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Bound, E> {
        Ok(Bound(number as f32))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Bound, E> {
        Ok(Bound(number as f32))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Bound, E> {
        text.parse().map(Bound).map_err(|_| E::invalid_value(Unexpected::Str(text), &self))
    }
}

//! Loads and costs in files.

use super::wire;
use crate::Term;
use crate::cost::{CostTerm, Product};

wire! {
    /// The figures of a frame that decide what each algorithm costs.
    Load = crate::Load {
        /// Boxes in the frame.
        objects: u32,
        /// Pairs that overlap on the sweep axis.
        axis_candidates: f64,
        /// Pairs that overlap on the sweep axis within a strip.
        strip_candidates: f64,
        /// Overlapping pairs.
        pairs: f64,
        /// How far boxes move in a frame, in mean edges, 0 to 1.
        moved: f64,
    }
}

wire! {
    /// What several threads make of the work of one.
    HelpersKeys = crate::Helpers {
        /// Threads, the caller's included.
        threads: u32,
        /// Nanoseconds to call all of them.
        call_ns: f64,
        /// Nanoseconds of one thread's work that are lost while they wake.
        late_ns: f64,
        /// How many times as fast all of them work as one.
        speed_up: f64,
        /// Boxes that keep one thread busy; 0: all threads work in every frame.
        boxes_per_thread: u32,
    }
}

wire! {
    /// One term of a cost.
    CostTermKeys = CostTerm {
        /// What is counted.
        term: Term,
        /// Nanoseconds for each.
        unit_ns: f64,
    }
}

/// Whether a power is that of a factor that is not there.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_zero(power: &u8) -> bool {
    *power == 0
}

wire! {
    /// A product of powers of a load's figures; a power that is not there is 0.
    ProductKeys = Product {
        /// Power of the number of objects.
        #[serde(default, skip_serializing_if = "is_zero")]
        objects: u8,
        /// Power of its base-2 logarithm.
        #[serde(default, skip_serializing_if = "is_zero")]
        log2_objects: u8,
        /// Power of the number of pairs.
        #[serde(default, skip_serializing_if = "is_zero")]
        pairs: u8,
        /// Power of the pairs that overlap on the sweep axis.
        #[serde(default, skip_serializing_if = "is_zero")]
        axis_candidates: u8,
        /// Power of the pairs that overlap on the sweep axis within a strip.
        #[serde(default, skip_serializing_if = "is_zero")]
        strip_candidates: u8,
        /// Power of how far boxes move.
        #[serde(default, skip_serializing_if = "is_zero")]
        moved: u8,
    }
}

/// A term in files: a word, or `{"product": {...}}`.
macro_rules! term {
    ($($variant:ident),+) => {
        #[derive(serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        enum TermKeys {
            $($variant,)+
            Product(Product),
        }

        impl From<Term> for TermKeys {
            fn from(term: Term) -> Self {
                match term {
                    $(Term::$variant => Self::$variant,)+
                    Term::Product(product) => Self::Product(product),
                }
            }
        }

        impl From<TermKeys> for Term {
            fn from(keys: TermKeys) -> Self {
                match keys {
                    $(TermKeys::$variant => Self::$variant,)+
                    TermKeys::Product(product) => Self::Product(product),
                }
            }
        }
    };
}

term!(Call, Objects, Sort, ColdObjects, AllPairs, AxisCandidates, StripCandidates, Pairs, Moved);

impl serde::Serialize for Term {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        TermKeys::from(*self).serialize(serializer)
    }
}

impl<'de> serde::Deserialize<'de> for Term {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        TermKeys::deserialize(deserializer).map(Self::from)
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Term {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Term".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        TermKeys::json_schema(generator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_term_is_a_word_or_a_product_of_powers() {
        let product = Term::Product(Product::ONE.objects(1).log2_objects(2));
        for (term, text) in [
            (Term::ColdObjects, r#""cold_objects""#),
            (product, r#"{"product":{"objects":1,"log2_objects":2}}"#),
            (Term::Product(Product::ONE), r#"{"product":{}}"#),
        ] {
            assert_eq!(serde_json::to_string(&term).unwrap(), text);
            assert_eq!(serde_json::from_str::<Term>(text).unwrap(), term);
        }
        assert!(serde_json::from_str::<Term>(r#"{"product":{"objects":-1}}"#).is_err());
        assert!(serde_json::from_str::<Term>(r#""nodes""#).is_err());
    }
}

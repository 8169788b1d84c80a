//! The first key of every file: which schema it follows.

/// Defines a zero-sized type that is written as one fixed text and refuses to be read from any other.
macro_rules! schema_tag {
    ($(#[$doc:meta])* $seen:vis $name:ident = $text:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        $seen struct $name;

        impl $name {
            /// The text in the file.
            $seen const TEXT: &'static str = $text;
        }

        #[cfg(feature = "model")]
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(Self::TEXT)
            }
        }

        #[cfg(feature = "model")]
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = String::deserialize(deserializer)?;
                if text == Self::TEXT {
                    return Ok(Self);
                }
                let expected = Self::TEXT;
                Err(serde::de::Error::custom(format!("the schema is {text:?}; this version reads {expected:?}")))
            }
        }

        #[cfg(feature = "schema")]
        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                schemars::json_schema!({ "const": Self::TEXT })
            }
        }
    };
}

pub(crate) use schema_tag;

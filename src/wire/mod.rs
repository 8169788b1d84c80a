//! The form that the public types have in files, apart from them, so that either can grow.
//!
//! A wire type has the keys of the file. It is turned into the public type when a file is read, which is where figures are checked, and
//! made of it when one is written.

mod cost;
mod hardware;
mod model;
mod tuning;

/// Defines the wire type of a public struct whose fields have the names of its keys, and the way from one to the other. With `checked` the
/// public struct has a `defect`, and a file that has one is refused.
macro_rules! wire {
    (
        $(#[$meta:meta])*
        $name:ident = $public:ty $(, checked $error:ty)? {
            $($(#[$field_meta:meta])* $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        #[derive(serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema), schemars(deny_unknown_fields))]
        struct $name {
            $($(#[$field_meta])* $field: $type,)*
        }

        impl From<$public> for $name {
            fn from(public: $public) -> Self {
                Self { $($field: public.$field,)* }
            }
        }

        crate::wire::wire!(@read $name $public [$($field)*] $($error)?);

        impl serde::Serialize for $public {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serde::Serialize::serialize(&$name::from(self.clone()), serializer)
            }
        }

        impl<'de> serde::Deserialize<'de> for $public {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let wire: $name = serde::Deserialize::deserialize(deserializer)?;
                Self::try_from(wire).map_err(serde::de::Error::custom)
            }
        }

        #[cfg(feature = "schema")]
        impl schemars::JsonSchema for $public {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                <$name as schemars::JsonSchema>::json_schema(generator)
            }
        }
    };
    (@read $name:ident $public:ty [$($field:ident)*]) => {
        impl From<$name> for $public {
            fn from(wire: $name) -> Self {
                Self { $($field: wire.$field,)* }
            }
        }
    };
    (@read $name:ident $public:ty [$($field:ident)*] $error:ty) => {
        impl TryFrom<$name> for $public {
            type Error = $error;

            fn try_from(wire: $name) -> Result<Self, $error> {
                let public = Self { $($field: wire.$field,)* };
                public.defect().map_or(Ok(public), Err)
            }
        }
    };
}

use wire;

//! Enums whose variants have names in files.

use std::fmt;

/// The error of a name that this version does not know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownName {
    kind: &'static str,
    text: String,
}

impl UnknownName {
    /// Makes the error of a text that is no name of this kind.
    pub fn new(kind: &'static str, text: &str) -> Self {
        Self { kind, text: text.to_owned() }
    }
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} is no {}", self.text, self.kind)
    }
}

impl std::error::Error for UnknownName {}

/// Defines an enum without data whose variants have names: `ALL`, `as_str`, `Display`, `FromStr`, and the same names in
/// files.
#[doc(hidden)]
#[macro_export]
macro_rules! named {
    ($(#[$meta:meta])* $seen:vis enum $name:ident($kind:literal) {
        $($(#[$doc:meta])* $variant:ident = $text:literal,)+
    }) => {
        $(#[$meta])*
        $seen enum $name {
            $($(#[$doc])* $variant,)+
        }

        impl $name {
            /// All variants, in order.
            pub const ALL: [Self; [$($text),+].len()] = [$(Self::$variant),+];

            /// Returns the name in files.
            pub const fn as_str(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)+
                }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.as_str())
            }
        }

        impl std::str::FromStr for $name {
            type Err = $crate::error::UnknownName;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                match text {
                    $($text => Ok(Self::$variant),)+
                    _ => Err($crate::error::UnknownName::new($kind, text)),
                }
            }
        }

        $crate::text_in_files!($name);
        $crate::named_in_schemas!($name);
    };
}

/// Lets files hold the text of a type, which `Display` writes and `FromStr` reads. A macro of its own, because a `cfg`
/// in a macro asks for the features of the caller.
#[doc(hidden)]
#[macro_export]
#[cfg(feature = "serde")]
macro_rules! text_in_files {
    ($name:ident) => {
        impl $crate::internals::serde::Serialize for $name {
            fn serialize<S: $crate::internals::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> $crate::internals::serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::internals::serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = <std::borrow::Cow<'de, str>>::deserialize(deserializer)?;
                text.parse().map_err($crate::internals::serde::de::Error::custom)
            }
        }
    };
}

#[doc(hidden)]
#[macro_export]
#[cfg(not(feature = "serde"))]
macro_rules! text_in_files {
    ($name:ident) => {};
}

/// Lists the names in schemas.
#[doc(hidden)]
#[macro_export]
#[cfg(feature = "schema")]
macro_rules! named_in_schemas {
    ($name:ident) => {
        impl $crate::internals::schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(
                _: &mut $crate::internals::schemars::SchemaGenerator,
            ) -> $crate::internals::schemars::Schema {
                $crate::internals::schemars::json_schema!({ "enum": Self::ALL.map(Self::as_str) })
            }
        }
    };
}

#[doc(hidden)]
#[macro_export]
#[cfg(not(feature = "schema"))]
macro_rules! named_in_schemas {
    ($name:ident) => {};
}

//! Enums whose variants have a text each, such as errors.

/// Defines an enum with the text of each variant beside it: `Display` writes it, with the fields in it by their names.
/// A second text behind `|` is the one for `{:#}`.
#[doc(hidden)]
#[macro_export]
macro_rules! described {
    ($(#[$meta:meta])* pub enum $name:ident {
        $(
            $(#[$doc:meta])*
            $variant:ident $({ $($(#[$field_doc:meta])* $field:ident: $of:ty,)+ })? $(($inner:ident: $inner_of:ty))?
                = $text:literal $(| $alternate:literal)?,
        )+
    }) => {
        $(#[$meta])*
        pub enum $name {
            $($(#[$doc])* $variant $({ $($(#[$field_doc])* $field: $of,)+ })? $(($inner_of))?,)+
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                match self {
                    $(Self::$variant $({ $($field,)+ })? $(($inner))? => {
                        $(if f.alternate() {
                            return write!(f, $alternate);
                        })?
                        write!(f, $text)
                    })+
                }
            }
        }
    };
}

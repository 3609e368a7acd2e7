//! Tables of codes: enums whose variants have a name, a cause and a remedy.

/// Declares an enum of codes. Each variant has its name in messages, the cause and the remedy; all three form its
/// documentation and appear in the reference.
macro_rules! codes {
    ($(#[$meta:meta])* $name:ident { $($variant:ident $text:literal: $cause:literal, $remedy:literal;)* }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum $name {
            $(#[doc = $cause] #[doc = ""] #[doc = $remedy] #[serde(rename = $text)] $variant,)*
        }

        impl $name {
            /// All codes, in the order of the reference.
            pub const ALL: &[Self] = &[$(Self::$variant,)*];

            /// The code as written in Python and the reference.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }

            /// The cause, as a sentence.
            pub const fn cause(self) -> &'static str {
                match self { $(Self::$variant => $cause,)* }
            }

            /// The remedy, as a sentence.
            pub const fn remedy(self) -> &'static str {
                match self { $(Self::$variant => $remedy,)* }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

pub(crate) use codes;

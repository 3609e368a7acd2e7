//! Values with several notations, for serde and for the JSON Schema.

/// Implements the deserialisation of a type with several notations, from a description of the expected notations and
/// the methods of serde's visitor.
macro_rules! written {
    ($type:ident: $expecting:expr, $($methods:tt)*) => {
        impl<'de> serde::Deserialize<'de> for $type {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct AnyWay;

                impl<'de> serde::de::Visitor<'de> for AnyWay {
                    type Value = $type;

                    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                        write!(f, "{}", $expecting)
                    }

                    $($methods)*
                }
                deserializer.deserialize_any(AnyWay)
            }
        }
    };
}

/// Implements the JSON Schema of such a type, under the given name.
macro_rules! written_schema {
    ($type:ident, $name:literal, |$generator:pat_param| $schema:expr) => {
        impl schemars::JsonSchema for $type {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                $name.into()
            }

            fn json_schema($generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                $schema
            }
        }
    };
}

pub(crate) use {written, written_schema};

//! Reads the schema's structs from nodes: a serde deserialiser whose errors know their place.
//!
//! It differs from others in what people may write: an enum with fields is a table with a `type`, a table stands for a
//! list of one, a key whose value is null is absent, and whole floats are whole numbers.

pub(crate) mod access;
pub(crate) mod error;
pub(crate) mod number;
pub(crate) mod value;

use std::fmt;

use serde::de::{DeserializeOwned, Deserializer, IntoDeserializer, Visitor};
use serde::forward_to_deserialize_any;

use crate::error::SceneError;
use crate::schema::deserialize::access::{TableAccess, TaggedAccess, visit_list};
use crate::schema::deserialize::error::{DeError, quoted};
use crate::schema::deserialize::number::{ArrayDeserializer, Number};
use crate::schema::deserialize::value::{SpannedValue, Value};

/// The key that names the variant of an enum with fields.
const TAG: &str = "type";

/// Reads a `T` from a description.
///
/// # Errors
/// [`SceneError::Schema`] with the path of the value, its place in the text, what was expected and the nearest name.
pub fn from_value<T: DeserializeOwned>(node: &SpannedValue) -> Result<T, SceneError> {
    T::deserialize(ValueDeserializer(node)).map_err(|DeError(details)| {
        let path = details
            .path
            .iter()
            .rev()
            .map(String::as_str)
            .collect::<String>();
        SceneError::Schema {
            path: path.trim_start_matches('.').into(),
            message: details.message,
            span: details.span,
        }
    })
}

/// A node to read.
#[derive(Clone, Copy)]
struct ValueDeserializer<'a>(&'a SpannedValue);

impl ValueDeserializer<'_> {
    /// Its number, where it is one.
    fn number(self) -> Option<Number> {
        match &self.0.value {
            Value::Integer(v) => Some(Number::Integer(*v)),
            Value::Float(v) => Some(Number::Float(*v)),
            Value::Integers { shape, data } if shape.is_empty() => data.first().map(|&v| v.into()),
            Value::Floats { shape, data } if shape.is_empty() => data.first().map(|&v| v.into()),
            _ => None,
        }
    }

    /// Adds the place to an error that has none yet.
    fn with_span<T>(self, result: Result<T, DeError>) -> Result<T, DeError> {
        result.map_err(|fault| fault.with_span(&self.0.span))
    }

    fn visit<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match &self.0.value {
            Value::Null => visitor.visit_unit(),
            Value::Bool(v) => visitor.visit_bool(*v),
            Value::Integer(v) => visitor.visit_i64(*v),
            Value::Float(v) => visitor.visit_f64(*v),
            Value::String(v) => visitor.visit_str(v),
            Value::List(items) => {
                visit_list(items.len(), |i| ValueDeserializer(&items[i]), visitor)
            }
            Value::Table(entries) => visitor.visit_map(TableAccess::new(entries)),
            Value::Floats { shape, data } => ArrayDeserializer::visit(shape, data, visitor),
            Value::Integers { shape, data } => ArrayDeserializer::visit(shape, data, visitor),
        }
    }

    fn visit_whole<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match self.number() {
            Some(number) => self.with_span(number.deserialize_u64(visitor)),
            None => self.deserialize_any(visitor),
        }
    }
}

impl<'de> Deserializer<'de> for ValueDeserializer<'_> {
    type Error = DeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        self.with_span(self.visit(visitor))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match self.0.value {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match self.0.value {
            Value::Table(_) => self.with_span(visit_list(1, |_| self, visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DeError> {
        match self.0.value {
            Value::Table(_) => self.deserialize_any(visitor),
            _ => self
                .with_span(self.visit(Reject("a table".into())))
                .map(|never| match never {}),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, DeError> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DeError> {
        self.with_span(match &self.0.value {
            Value::String(name) => visitor.visit_enum(
                IntoDeserializer::<DeError>::into_deserializer(name.as_str()),
            ),
            Value::Table(entries) => visitor.visit_enum(TaggedAccess { entries, variants }),
            _ => self
                .visit(Reject(format!("one of {}", quoted(variants))))
                .map(|never| match never {}),
        })
    }

    fn deserialize_u8<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        self.visit_whole(visitor)
    }

    fn deserialize_u16<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        self.visit_whole(visitor)
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        self.visit_whole(visitor)
    }

    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        self.visit_whole(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u128 f32 f64 char str string bytes byte_buf unit unit_struct tuple tuple_struct map
        identifier ignored_any
    }
}

/// Refuses whatever it visits: this was expected instead.
struct Reject(String);

impl Visitor<'_> for Reject {
    type Value = std::convert::Infallible;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

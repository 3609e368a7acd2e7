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
use crate::schema::deserialize::access::{Table, Tagged, list};
use crate::schema::deserialize::error::{Fault, quoted};
use crate::schema::deserialize::number::{Array, Number};
use crate::schema::deserialize::value::{Node, Value};

/// The key that names the variant of an enum with fields.
const TAG: &str = "type";

/// Reads a `T` from a description.
///
/// # Errors
/// [`SceneError::Schema`] with the path of the value, its place in the text, what was expected and the nearest name.
pub fn from_node<T: DeserializeOwned>(node: &Node) -> Result<T, SceneError> {
    T::deserialize(Source(node)).map_err(|Fault(details)| {
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
struct Source<'a>(&'a Node);

impl Source<'_> {
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
    fn placed<T>(self, result: Result<T, Fault>) -> Result<T, Fault> {
        result.map_err(|fault| fault.placed(&self.0.span))
    }

    fn any<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match &self.0.value {
            Value::Null => visitor.visit_unit(),
            Value::Bool(v) => visitor.visit_bool(*v),
            Value::Integer(v) => visitor.visit_i64(*v),
            Value::Float(v) => visitor.visit_f64(*v),
            Value::String(v) => visitor.visit_str(v),
            Value::List(items) => list(items.len(), |i| Source(&items[i]), visitor),
            Value::Table(entries) => visitor.visit_map(Table::new(entries)),
            Value::Floats { shape, data } => Array::visit(shape, data, visitor),
            Value::Integers { shape, data } => Array::visit(shape, data, visitor),
        }
    }

    fn whole<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.number() {
            Some(number) => self.placed(number.deserialize_u64(visitor)),
            None => self.deserialize_any(visitor),
        }
    }
}

impl<'de> Deserializer<'de> for Source<'_> {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.placed(self.any(visitor))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.0.value {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.0.value {
            Value::Table(_) => self.placed(list(1, |_| self, visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        match self.0.value {
            Value::Table(_) => self.deserialize_any(visitor),
            _ => self
                .placed(self.any(Refuse("a table".into())))
                .map(|never| match never {}),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Fault> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        self.placed(match &self.0.value {
            Value::String(name) => {
                visitor.visit_enum(IntoDeserializer::<Fault>::into_deserializer(name.as_str()))
            }
            Value::Table(entries) => visitor.visit_enum(Tagged { entries, variants }),
            _ => self
                .any(Refuse(format!("one of {}", quoted(variants))))
                .map(|never| match never {}),
        })
    }

    fn deserialize_u8<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.whole(visitor)
    }

    fn deserialize_u16<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.whole(visitor)
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.whole(visitor)
    }

    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.whole(visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u128 f32 f64 char str string bytes byte_buf unit unit_struct tuple tuple_struct map
        identifier ignored_any
    }
}

/// Refuses whatever it visits: this was expected instead.
struct Refuse(String);

impl Visitor<'_> for Refuse {
    type Value = std::convert::Infallible;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

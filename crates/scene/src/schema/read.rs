//! Reads the schema's structs from nodes: a serde deserialiser whose errors know their place.
//!
//! It differs from others in what people may write: an enum with fields is a table with a `type`, a table stands for a
//! list of one, a key whose value is null is absent, and whole floats are whole numbers.

mod access;
mod fault;

use std::fmt;
use std::ops::Range;

use serde::de::{DeserializeOwned, Deserializer, Error, IntoDeserializer, Visitor};
use serde::forward_to_deserialize_any;

use self::access::{List, Table, Tagged};
use self::fault::{Fault, quoted};
use super::node::{Node, Value};
use crate::error::SceneError;

/// The key that names the variant of an enum with fields.
const TAG: &str = "type";

/// Reads a `T` from a description.
///
/// # Errors
/// [`SceneError::Schema`] with the path of the value, its place in the text, what was expected and the nearest name.
pub fn from_node<T: DeserializeOwned>(node: &Node) -> Result<T, SceneError> {
    T::deserialize(Source::Node(node)).map_err(
        |Fault {
             path,
             message,
             span,
         }| {
            let path = path.iter().rev().map(String::as_str).collect::<String>();
            SceneError::Schema {
                path: path.trim_start_matches('.').into(),
                message,
                span,
            }
        },
    )
}

/// Something to read: a node, or a part of an array of numbers.
#[derive(Clone, Copy)]
enum Source<'a> {
    Node(&'a Node),
    Array {
        shape: &'a [usize],
        numbers: Numbers<'a>,
    },
}

#[derive(Clone, Copy)]
enum Numbers<'a> {
    Floats(&'a [f64]),
    Integers(&'a [i64]),
}

impl<'a> Numbers<'a> {
    fn len(self) -> usize {
        match self {
            Numbers::Floats(data) => data.len(),
            Numbers::Integers(data) => data.len(),
        }
    }

    fn first(self) -> Option<Scalar> {
        match self {
            Numbers::Floats(data) => data.first().copied().map(Scalar::Float),
            Numbers::Integers(data) => data.first().copied().map(Scalar::Integer),
        }
    }

    fn slice(self, range: Range<usize>) -> Option<Self> {
        Some(match self {
            Numbers::Floats(data) => Numbers::Floats(data.get(range)?),
            Numbers::Integers(data) => Numbers::Integers(data.get(range)?),
        })
    }
}

impl<'a> Source<'a> {
    fn span(self) -> Option<Range<usize>> {
        match self {
            Source::Node(node) => node.span.clone(),
            Source::Array { .. } => None,
        }
    }

    /// Its number, where it is one.
    fn scalar(self) -> Option<Scalar> {
        match (self, self.array()) {
            (_, Some(([], numbers))) => numbers.first(),
            (
                Source::Node(Node {
                    value: Value::Integer(v),
                    ..
                }),
                _,
            ) => Some(Scalar::Integer(*v)),
            (
                Source::Node(Node {
                    value: Value::Float(v),
                    ..
                }),
                _,
            ) => Some(Scalar::Float(*v)),
            _ => None,
        }
    }

    /// The array it is, where it is one.
    fn array(self) -> Option<(&'a [usize], Numbers<'a>)> {
        match self {
            Source::Array { shape, numbers } => Some((shape, numbers)),
            Source::Node(Node {
                value: Value::Floats { shape, data },
                ..
            }) => Some((shape, Numbers::Floats(data))),
            Source::Node(Node {
                value: Value::Integers { shape, data },
                ..
            }) => Some((shape, Numbers::Integers(data))),
            Source::Node(_) => None,
        }
    }

    /// Adds the place to an error that has none yet.
    fn placed<T>(self, result: Result<T, Fault>) -> Result<T, Fault> {
        result.map_err(|fault| Fault {
            span: fault.span.or_else(|| self.span()),
            ..fault
        })
    }

    /// Visits a list, and sees that the visitor wanted all of it.
    fn list<'de, V: Visitor<'de>>(
        self,
        length: usize,
        item: impl Fn(usize) -> Source<'a>,
        visitor: V,
    ) -> Result<V::Value, Fault> {
        let mut list = List {
            item,
            length,
            next: 0,
        };
        let value = visitor.visit_seq(&mut list)?;
        if list.next < length {
            let wanted = list.next;
            return Err(Fault::custom(format_args!(
                "a list of {length}: expected a list of {wanted}"
            )));
        }
        Ok(value)
    }

    fn any<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.scalar() {
            Some(Scalar::Integer(v)) => return visitor.visit_i64(v),
            Some(Scalar::Float(v)) => return visitor.visit_f64(v),
            None => {}
        }
        if let Some((shape, numbers)) = self.array() {
            let size = shape
                .iter()
                .try_fold(1_usize, |size, &length| size.checked_mul(length));
            let Some((&length, rest)) = shape.split_first().filter(|_| size == Some(numbers.len()))
            else {
                let count = numbers.len();
                return Err(Fault::custom(format_args!(
                    "an array of shape {shape:?} with {count} numbers"
                )));
            };
            let stride = numbers.len().checked_div(length).unwrap_or(0);
            // In range, as length * stride is the number of numbers.
            let item = |i: usize| Source::Array {
                shape: rest,
                numbers: numbers
                    .slice(i * stride..(i + 1) * stride)
                    .unwrap_or(Numbers::Floats(&[])),
            };
            return self.list(length, item, visitor);
        }
        let Source::Node(node) = self else {
            return visitor.visit_unit();
        };
        match &node.value {
            Value::Bool(v) => visitor.visit_bool(*v),
            Value::String(v) => visitor.visit_str(v),
            Value::List(items) => self.list(items.len(), |i| Source::Node(&items[i]), visitor),
            Value::Table(entries) => visitor.visit_map(Table {
                entries,
                next: 0,
                tagged: false,
            }),
            _ => visitor.visit_unit(),
        }
    }
}

enum Scalar {
    Integer(i64),
    Float(f64),
}

impl<'de> Deserializer<'de> for Source<'_> {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.placed(self.any(visitor))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self {
            Source::Node(Node {
                value: Value::Null, ..
            }) => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self {
            Source::Node(Node {
                value: Value::Table(_),
                ..
            }) => self.placed(self.list(1, |_| self, visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        match self {
            Source::Node(Node {
                value: Value::Table(_),
                ..
            }) => self.deserialize_any(visitor),
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
        self.placed(match self {
            Source::Node(Node {
                value: Value::String(name),
                ..
            }) => visitor.visit_enum(IntoDeserializer::<Fault>::into_deserializer(name.as_str())),
            Source::Node(Node {
                value: Value::Table(entries),
                ..
            }) => visitor.visit_enum(Tagged { entries, variants }),
            _ => self
                .any(Refuse(format!("one of {}", quoted(variants))))
                .map(|never| match never {}),
        })
    }

    // A whole float is a whole number: NumPy and TOML writers do not always know the difference.
    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match self.scalar() {
            Some(Scalar::Float(v)) if v == v.trunc() && v.abs() < 9.0e15 => {
                self.placed(visitor.visit_i64(v as i64))
            }
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_u8<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.deserialize_u64(visitor)
    }

    fn deserialize_u16<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.deserialize_u64(visitor)
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        self.deserialize_u64(visitor)
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

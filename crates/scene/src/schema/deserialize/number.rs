//! Numbers, and arrays of numbers.

use std::fmt::Debug;

use serde::de::{Deserializer, Visitor};
use serde::forward_to_deserialize_any;

use crate::counted::counted;
use crate::error_code::ErrorCode;
use crate::schema::deserialize::error::DeError;
use crate::schema::deserialize::list::visit_list;

/// Deserialiser of a number in a description.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    Integer(i64),
    Float(f64),
}

impl From<i64> for Number {
    fn from(v: i64) -> Self {
        Self::Integer(v)
    }
}

impl From<f64> for Number {
    fn from(v: f64) -> Self {
        Self::Float(v)
    }
}

impl<'de> Deserializer<'de> for Number {
    type Error = DeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match self {
            Self::Integer(v) => visitor.visit_i64(v),
            Self::Float(v) => visitor.visit_f64(v),
        }
    }

    // A whole float counts as a whole number, because NumPy and TOML writers do not always distinguish them.
    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match self {
            Self::Float(v) if v == v.trunc() && v.abs() < 9.0e15 => visitor.visit_i64(v as i64),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_u8<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        self.deserialize_u64(visitor)
    }

    fn deserialize_u16<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        self.deserialize_u64(visitor)
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        self.deserialize_u64(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, DeError> {
        visitor.visit_newtype_struct(self)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple tuple_struct map
        struct enum identifier ignored_any
    }
}

/// Deserialiser of an array of numbers with one or more dimensions, which reads it as lists of lists.
#[derive(Clone, Copy)]
pub struct ArrayDeserializer<'a, T> {
    length: usize,
    /// Shape of the array's items.
    item: &'a [usize],
    data: &'a [T],
}

impl<'a, T: Copy + Into<Number>> ArrayDeserializer<'a, T> {
    /// Visits an array of this shape; an array without dimensions is a number.
    pub fn visit<'de, V: Visitor<'de>>(shape: &'a [usize], data: &'a [T], visitor: V) -> Result<V::Value, DeError> {
        let size = shape.iter().try_fold(1_usize, |size, &length| size.checked_mul(length));
        if size != Some(data.len()) {
            return Err(DeError::new(ErrorCode::WrongShape.message(format!(
                "{} for the array shape {shape:?}; expected as many as the shape's product",
                counted(data.len(), "number")
            ))));
        }
        match (shape, data) {
            ([], [number]) => (*number).into().deserialize_any(visitor),
            (&[length, ref item @ ..], _) => ArrayDeserializer { length, item, data }.deserialize_any(visitor),
            ([], _) => visitor.visit_unit(),
        }
    }
}

impl<'de, T: Copy + Into<Number>> Deserializer<'de> for ArrayDeserializer<'_, T> {
    type Error = DeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        let ArrayDeserializer { length, item, data } = self;
        match *item {
            [] => visit_list(length, |i| data[i].into(), visitor),
            [inner, ref rest @ ..] => {
                let stride = data.len().checked_div(length).unwrap_or(0);
                let at = |i: usize| ArrayDeserializer {
                    length: inner,
                    item: rest,
                    data: &data[i * stride..(i + 1) * stride],
                };
                visit_list(length, at, visitor)
            }
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, DeError> {
        visitor.visit_newtype_struct(self)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map struct enum identifier ignored_any
    }
}

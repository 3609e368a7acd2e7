//! The serde deserialiser of a description, and accessors for the contents of its tables and enums.

use std::fmt;

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, SeqAccess, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

use crate::error_code::ErrorCode;
use crate::schema::deserialize::error::{DeError, quoted};
use crate::schema::deserialize::list::visit_list;
use crate::schema::deserialize::number::{ArrayDeserializer, Number};
use crate::schema::deserialize::value::{Entry, SpannedValue, Value};
use crate::schema::spec::light::split_light_keys;

/// Key that names the variant of an enum with fields.
const TAG: &str = "type";

/// Deserialiser of one node of a description.
#[derive(Clone, Copy)]
pub struct ValueDeserializer<'a>(pub &'a SpannedValue);

impl ValueDeserializer<'_> {
    /// Returns the value as a number, if it is a number.
    fn number(self) -> Option<Number> {
        match &self.0.value {
            Value::Integer(v) => Some(Number::Integer(*v)),
            Value::Float(v) => Some(Number::Float(*v)),
            Value::Integers { shape, data } if shape.is_empty() => data.first().map(|&v| v.into()),
            Value::Floats { shape, data } if shape.is_empty() => data.first().map(|&v| v.into()),
            _ => None,
        }
    }

    /// Adds the position to an error that does not have a position yet.
    fn with_span<T>(self, result: Result<T, DeError>) -> Result<T, DeError> {
        result.map_err(|fault| fault.with_span(&self.0.span))
    }

    fn visit<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match &self.0.value {
            Value::Null => visitor.visit_unit(),
            Value::Bool(v) => visitor.visit_bool(*v),
            Value::Integer(v) => visitor.visit_i64(*v),
            Value::Unsigned(v) => visitor.visit_u64(*v),
            Value::Float(v) => visitor.visit_f64(*v),
            Value::String(v) => visitor.visit_str(v),
            Value::List(items) => visit_list(items.len(), |i| ValueDeserializer(&items[i]), visitor),
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
            _ => self.with_span(self.visit(Reject("a table".into()))).map(|never| match never {}),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, DeError> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DeError> {
        self.with_span(match &self.0.value {
            Value::String(name) => visitor.visit_enum(IntoDeserializer::<DeError>::into_deserializer(name.as_str())),
            Value::Table(entries) => visitor.visit_enum(TaggedAccess { entries, variants }),
            _ => self.visit(Reject(format!("one of {}", quoted(variants)))).map(|never| match never {}),
        })
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: usize,
        visitor: V,
    ) -> Result<V::Value, DeError> {
        let Value::Table(entries) = &self.0.value else {
            return self.with_span(self.visit(Reject("a table".into()))).map(|never| match never {});
        };
        let parts = split_light_keys(entries).map_err(DeError::custom);
        self.with_span(parts.and_then(|parts| visitor.visit_seq(SplitTable { parts: &parts, next: 0 })))
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
        bool i8 i16 i32 i64 i128 u128 f32 f64 char str string bytes byte_buf unit unit_struct tuple map
        identifier ignored_any
    }
}

/// A table whose keys belong to several structs, split into one part per struct.
struct SplitTable<'a> {
    parts: &'a [SpannedValue],
    next: usize,
}

impl<'de> SeqAccess<'de> for SplitTable<'_> {
    type Error = DeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, DeError> {
        let part = self.parts.get(self.next);
        self.next += 1;
        part.map(|part| seed.deserialize(ValueDeserializer(part))).transpose()
    }
}

/// Visitor that rejects every value with an error that contains this expectation.
struct Reject(String);

impl Visitor<'_> for Reject {
    type Value = std::convert::Infallible;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Entries of a table in order, without null values, and without the tag after it has been read.
pub struct TableAccess<'a> {
    entries: &'a [Entry],
    next: usize,
    tagged: bool,
}

impl<'a> TableAccess<'a> {
    pub fn new(entries: &'a [Entry]) -> Self {
        Self { entries, next: 0, tagged: false }
    }
}

impl<'de> MapAccess<'de> for TableAccess<'_> {
    type Error = DeError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, DeError> {
        let skipped = |entry: &Entry| entry.value.value == Value::Null || (self.tagged && entry.key == TAG);
        while self.entries.get(self.next).is_some_and(skipped) {
            self.next += 1;
        }
        let Some(entry) = self.entries.get(self.next) else { return Ok(None) };
        let key: StrDeserializer<DeError> = entry.key.as_str().into_deserializer();
        seed.deserialize(key).map(Some).map_err(|fault| fault.in_segment(format!(".{}", entry.key), &entry.key_span))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, DeError> {
        let Some(entry) = self.entries.get(self.next) else {
            return Err(DeError::custom("a value was requested before its key"));
        };
        self.next += 1;
        let segment = || format!(".{}", entry.key);
        let span = if entry.value.span.is_some() { &entry.value.span } else { &entry.key_span };
        seed.deserialize(ValueDeserializer(&entry.value)).map_err(|fault| fault.in_segment(segment(), span))
    }
}

/// Access to a table whose `type` selects the variant of an enum.
pub struct TaggedAccess<'a> {
    pub entries: &'a [Entry],
    pub variants: &'static [&'static str],
}

impl<'a, 'de> EnumAccess<'de> for TaggedAccess<'a> {
    type Error = DeError;
    type Variant = TableAccess<'a>;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, TableAccess<'a>), DeError> {
        let Some(tag) = self.entries.iter().find(|entry| entry.key == TAG) else {
            let names = quoted(self.variants);
            return Err(DeError::new(
                ErrorCode::MissingValue.message(format!("the key {TAG:?} is missing; expected one of {names}")),
            ));
        };
        let variant = seed
            .deserialize(ValueDeserializer(&tag.value))
            .map_err(|fault| fault.in_segment(format!(".{TAG}"), &tag.value.span))?;
        Ok((variant, TableAccess { entries: self.entries, next: 0, tagged: true }))
    }
}

impl<'de> VariantAccess<'de> for TableAccess<'_> {
    type Error = DeError;

    fn unit_variant(mut self) -> Result<(), DeError> {
        match self.next_key_seed(std::marker::PhantomData::<String>)? {
            Some(key) => Err(DeError::unknown_field(&key, &[]).in_segment(format!(".{key}"), &None)),
            None => Ok(()),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, _: T) -> Result<T::Value, DeError> {
        Err(DeError::new(ErrorCode::WrongType.message("a table; expected a name")))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, DeError> {
        Err(DeError::new(ErrorCode::WrongType.message("a table; expected a name")))
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], visitor: V) -> Result<V::Value, DeError> {
        visitor.visit_map(self)
    }
}

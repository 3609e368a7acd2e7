//! The insides of lists, tables and enums.

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, SeqAccess,
    VariantAccess, Visitor,
};

use crate::schema::deserialize::error::{DeError, quoted};
use crate::schema::deserialize::value::{Entry, Value};
use crate::schema::deserialize::{TAG, ValueDeserializer};

/// Visits a list of `length` items, and sees that the visitor wanted all of it.
pub fn visit_list<'de, I, F, V>(length: usize, item: F, visitor: V) -> Result<V::Value, DeError>
where
    I: Deserializer<'de, Error = DeError>,
    F: Fn(usize) -> I,
    V: Visitor<'de>,
{
    let mut list = ListAccess {
        item,
        length,
        next: 0,
    };
    let value = visitor.visit_seq(&mut list)?;
    if list.next < length {
        let wanted = list.next;
        return Err(DeError::custom(format_args!(
            "a list of {length}: expected a list of {wanted}"
        )));
    }
    Ok(value)
}

/// The items of a list in order.
struct ListAccess<F> {
    item: F,
    length: usize,
    next: usize,
}

impl<'de, I: Deserializer<'de, Error = DeError>, F: Fn(usize) -> I> SeqAccess<'de>
    for &mut ListAccess<F>
{
    type Error = DeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, DeError> {
        if self.next == self.length {
            return Ok(None);
        }
        let i = self.next;
        self.next += 1;
        let value = seed.deserialize((self.item)(i));
        value
            .map(Some)
            .map_err(|fault| fault.in_segment(format!("[{i}]"), &None))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.length - self.next)
    }
}

/// The entries of a table in order, without those that are null, and without the tag where it has been read.
pub struct TableAccess<'a> {
    entries: &'a [Entry],
    next: usize,
    tagged: bool,
}

impl<'a> TableAccess<'a> {
    pub fn new(entries: &'a [Entry]) -> Self {
        Self {
            entries,
            next: 0,
            tagged: false,
        }
    }
}

impl<'de> MapAccess<'de> for TableAccess<'_> {
    type Error = DeError;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, DeError> {
        let skipped =
            |entry: &Entry| entry.value.value == Value::Null || (self.tagged && entry.key == TAG);
        while self.entries.get(self.next).is_some_and(skipped) {
            self.next += 1;
        }
        let Some(entry) = self.entries.get(self.next) else {
            return Ok(None);
        };
        let key: StrDeserializer<DeError> = entry.key.as_str().into_deserializer();
        seed.deserialize(key)
            .map(Some)
            .map_err(|fault| fault.in_segment(format!(".{}", entry.key), &entry.key_span))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, DeError> {
        let Some(entry) = self.entries.get(self.next) else {
            return Err(DeError::custom("a value was asked for before its key"));
        };
        self.next += 1;
        let segment = || format!(".{}", entry.key);
        let span = if entry.value.span.is_some() {
            &entry.value.span
        } else {
            &entry.key_span
        };
        seed.deserialize(ValueDeserializer(&entry.value))
            .map_err(|fault| fault.in_segment(segment(), span))
    }
}

/// A table whose `type` says which variant of an enum it is.
pub struct TaggedAccess<'a> {
    pub entries: &'a [Entry],
    pub variants: &'static [&'static str],
}

impl<'a, 'de> EnumAccess<'de> for TaggedAccess<'a> {
    type Error = DeError;
    type Variant = TableAccess<'a>;

    fn variant_seed<V: DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, TableAccess<'a>), DeError> {
        let Some(tag) = self.entries.iter().find(|entry| entry.key == TAG) else {
            let names = quoted(self.variants);
            return Err(DeError::custom(format_args!(
                "the key {TAG:?} is missing: one of {names}"
            )));
        };
        let variant = seed
            .deserialize(ValueDeserializer(&tag.value))
            .map_err(|fault| fault.in_segment(format!(".{TAG}"), &tag.value.span))?;
        Ok((
            variant,
            TableAccess {
                entries: self.entries,
                next: 0,
                tagged: true,
            },
        ))
    }
}

impl<'de> VariantAccess<'de> for TableAccess<'_> {
    type Error = DeError;

    fn unit_variant(mut self) -> Result<(), DeError> {
        match self.next_key_seed(std::marker::PhantomData::<String>)? {
            Some(key) => {
                Err(DeError::unknown_field(&key, &[]).in_segment(format!(".{key}"), &None))
            }
            None => Ok(()),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, _: T) -> Result<T::Value, DeError> {
        Err(DeError::custom("a table: expected a name"))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, DeError> {
        Err(DeError::custom("a table: expected a name"))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DeError> {
        visitor.visit_map(self)
    }
}

//! The insides of lists, tables and enums.

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, EnumAccess, Error, IntoDeserializer, MapAccess, SeqAccess, VariantAccess,
    Visitor,
};

use super::fault::{Fault, quoted};
use super::{Source, TAG};
use crate::schema::node::{Entry, Value};

/// The items of a list in order.
pub struct List<F> {
    pub item: F,
    pub length: usize,
    pub next: usize,
}

impl<'a, 'de, F: Fn(usize) -> Source<'a>> SeqAccess<'de> for &mut List<F> {
    type Error = Fault;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Fault> {
        if self.next == self.length {
            return Ok(None);
        }
        let i = self.next;
        self.next += 1;
        let item = (self.item)(i);
        seed.deserialize(item)
            .map(Some)
            .map_err(|fault| fault.within(format!("[{i}]"), &item.span()))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.length - self.next)
    }
}

/// The entries of a table in order, without those that are null, and without the tag where it has been read.
pub struct Table<'a> {
    pub entries: &'a [Entry],
    pub next: usize,
    pub tagged: bool,
}

impl<'de> MapAccess<'de> for Table<'_> {
    type Error = Fault;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Fault> {
        let skipped =
            |entry: &Entry| entry.node.value == Value::Null || (self.tagged && entry.key == TAG);
        while self.entries.get(self.next).is_some_and(skipped) {
            self.next += 1;
        }
        let Some(entry) = self.entries.get(self.next) else {
            return Ok(None);
        };
        let key: StrDeserializer<Fault> = entry.key.as_str().into_deserializer();
        seed.deserialize(key)
            .map(Some)
            .map_err(|fault| fault.within(format!(".{}", entry.key), &entry.key_span))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Fault> {
        let Some(entry) = self.entries.get(self.next) else {
            return Err(Fault::custom("a value was asked for before its key"));
        };
        self.next += 1;
        let segment = || format!(".{}", entry.key);
        let span = if entry.node.span.is_some() {
            &entry.node.span
        } else {
            &entry.key_span
        };
        seed.deserialize(Source::Node(&entry.node))
            .map_err(|fault| fault.within(segment(), span))
    }
}

/// A table whose `type` says which variant of an enum it is.
pub struct Tagged<'a> {
    pub entries: &'a [Entry],
    pub variants: &'static [&'static str],
}

impl<'a, 'de> EnumAccess<'de> for Tagged<'a> {
    type Error = Fault;
    type Variant = Table<'a>;

    fn variant_seed<V: DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Table<'a>), Fault> {
        let Some(tag) = self.entries.iter().find(|entry| entry.key == TAG) else {
            let names = quoted(self.variants);
            return Err(Fault::custom(format_args!(
                "the key {TAG:?} is missing: one of {names}"
            )));
        };
        let variant = seed
            .deserialize(Source::Node(&tag.node))
            .map_err(|fault| fault.within(format!(".{TAG}"), &tag.node.span))?;
        Ok((
            variant,
            Table {
                entries: self.entries,
                next: 0,
                tagged: true,
            },
        ))
    }
}

impl<'de> VariantAccess<'de> for Table<'_> {
    type Error = Fault;

    fn unit_variant(mut self) -> Result<(), Fault> {
        match self.next_key_seed(std::marker::PhantomData::<String>)? {
            Some(key) => Err(Fault::unknown_field(&key, &[]).within(format!(".{key}"), &None)),
            None => Ok(()),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, _: T) -> Result<T::Value, Fault> {
        Err(Fault::custom("a table: expected a name"))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, Fault> {
        Err(Fault::custom("a table: expected a name"))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        visitor.visit_map(self)
    }
}

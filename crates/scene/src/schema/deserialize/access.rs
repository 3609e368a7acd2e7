//! The insides of lists, tables and enums.

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, SeqAccess,
    VariantAccess, Visitor,
};

use crate::schema::deserialize::error::{Fault, quoted};
use crate::schema::deserialize::value::{Entry, Value};
use crate::schema::deserialize::{Source, TAG};

/// Visits a list of `length` items, and sees that the visitor wanted all of it.
pub fn list<'de, I, F, V>(length: usize, item: F, visitor: V) -> Result<V::Value, Fault>
where
    I: Deserializer<'de, Error = Fault>,
    F: Fn(usize) -> I,
    V: Visitor<'de>,
{
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

/// The items of a list in order.
struct List<F> {
    item: F,
    length: usize,
    next: usize,
}

impl<'de, I: Deserializer<'de, Error = Fault>, F: Fn(usize) -> I> SeqAccess<'de> for &mut List<F> {
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
        let value = seed.deserialize((self.item)(i));
        value
            .map(Some)
            .map_err(|fault| fault.within(format!("[{i}]"), &None))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.length - self.next)
    }
}

/// The entries of a table in order, without those that are null, and without the tag where it has been read.
pub struct Table<'a> {
    entries: &'a [Entry],
    next: usize,
    tagged: bool,
}

impl<'a> Table<'a> {
    pub fn new(entries: &'a [Entry]) -> Self {
        Self {
            entries,
            next: 0,
            tagged: false,
        }
    }
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
        seed.deserialize(Source(&entry.node))
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
            .deserialize(Source(&tag.node))
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

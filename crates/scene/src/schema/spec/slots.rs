//! The tables of an object's material slots.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Visitor};

use crate::schema::object_keys::{SLOT_KEYS, is_object_key};

/// Reads a table of slots, whose values are tables of an object's keys.
///
/// # Errors
/// Errors for unknown keys list only the keys of materials.
pub(super) fn slot_tables<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<BTreeMap<String, T>>, D::Error> {
    let tables = Option::<BTreeMap<String, SlotTable<T>>>::deserialize(deserializer)?;
    Ok(tables.map(|tables| tables.into_iter().map(|(slot, table)| (slot, table.0)).collect()))
}

/// Table of one slot.
struct SlotTable<T>(T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for SlotTable<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("SlotTable", &[], TableVisitor(PhantomData)).map(SlotTable)
    }
}

struct TableVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for TableVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a table")
    }

    fn visit_map<A: MapAccess<'de>>(self, entries: A) -> Result<T, A::Error> {
        T::deserialize(MapAccessDeserializer::new(KnownEntries(entries)))
    }
}

/// Entries of a table whose keys are checked.
struct KnownEntries<A>(A);

impl<'de, A: MapAccess<'de>> MapAccess<'de> for KnownEntries<A> {
    type Error = A::Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        self.0.next_key_seed(KnownKey(seed))
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        self.0.next_value_seed(seed)
    }
}

/// Reader of a key, which must be a key of an object.
struct KnownKey<S>(S);

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for KnownKey<S> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<S::Value, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl<'de, S: DeserializeSeed<'de>> Visitor<'de> for KnownKey<S> {
    type Value = S::Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_str<E: Error>(self, key: &str) -> Result<S::Value, E> {
        if !is_object_key(key) {
            return Err(E::unknown_field(key, &SLOT_KEYS));
        }
        let key: StrDeserializer<'_, E> = key.into_deserializer();
        self.0.deserialize(key)
    }
}

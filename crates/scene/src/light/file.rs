//! What a light takes from a file.

use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The name of a file, and what it holds once it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct FromFile<T> {
    /// As written in the description.
    pub file: String,
    /// `None` until it is read.
    pub content: Option<Arc<T>>,
}

impl<T> FromFile<T> {
    /// Something that is already there.
    pub fn of(file: impl Into<String>, content: Arc<T>) -> Self {
        Self {
            file: file.into(),
            content: Some(content),
        }
    }

    pub(super) fn read<E>(
        &mut self,
        read: impl FnOnce(&str) -> Result<Arc<T>, E>,
    ) -> Result<(), E> {
        if self.content.is_none() {
            self.content = Some(read(&self.file)?);
        }
        Ok(())
    }
}

impl<'de, T> Deserialize<'de> for FromFile<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self {
            file: String::deserialize(deserializer)?,
            content: None,
        })
    }
}

impl<T> Serialize for FromFile<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.file.serialize(serializer)
    }
}

//! File references of lights.

use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// File name, and the content after reading.
#[derive(Clone, Debug, PartialEq)]
pub struct FileRef<T> {
    /// The name as written in the description.
    pub file: String,
    /// Content; `None` before the file is read.
    pub content: Option<Arc<T>>,
}

impl<T> FileRef<T> {
    /// Creates a reference whose content is already available.
    pub fn loaded(file: impl Into<String>, content: Arc<T>) -> Self {
        Self { file: file.into(), content: Some(content) }
    }

    pub(crate) fn load<E>(&mut self, read: impl FnOnce(&str) -> Result<Arc<T>, E>) -> Result<(), E> {
        if self.content.is_none() {
            self.content = Some(read(&self.file)?);
        }
        Ok(())
    }
}

// Descriptions contain only the name; bundles sent to other machines contain the content.

impl<'de, T: Deserialize<'de>> Deserialize<'de> for FileRef<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let (file, content) = if deserializer.is_human_readable() {
            (String::deserialize(deserializer)?, None)
        } else {
            Deserialize::deserialize(deserializer)?
        };
        Ok(Self { file, content })
    }
}

impl<T: Serialize> Serialize for FileRef<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            self.file.serialize(serializer)
        } else {
            (&self.file, &self.content).serialize(serializer)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_references_are_names_in_text_and_content_in_bundles() {
        let loaded = FileRef::loaded("lamp.ies", Arc::new(7_u32));
        assert_eq!(serde_json::to_string(&loaded).unwrap(), "\"lamp.ies\"");
        let mut read: FileRef<u32> = serde_json::from_str("\"lamp.ies\"").unwrap();
        assert_eq!(read.content, None);
        read.load(|file| Ok::<_, ()>(Arc::new(file.len() as u32))).unwrap();
        assert_eq!(read.content.as_deref(), Some(&8));
        read.load(|_| Err("read again")).unwrap();
    }
}

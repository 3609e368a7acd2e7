//! Failure to build a world from a description.

use crate::error::SceneError;

/// Failure caused by the description, or by a file that it refers to.
pub enum BuildFailure<E> {
    /// Error in the description.
    Scene(SceneError),
    /// Error in a file, and the key that refers to it.
    File(String, E),
}

impl<E> From<SceneError> for BuildFailure<E> {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl<E> BuildFailure<E> {
    /// Adds the key of the table that contains the faulty key.
    pub fn in_context(self, parent: &str) -> Self {
        match self {
            Self::Scene(error) => Self::Scene(error.in_context(parent)),
            Self::File(key, error) => Self::File(format!("{parent}.{key}"), error),
        }
    }
}

impl<E: From<SceneError>> BuildFailure<E> {
    /// Converts the failure to the error type of the file reader.
    pub fn into_error(self) -> E {
        match self {
            Self::Scene(error) => error.into(),
            Self::File(_, error) => error,
        }
    }
}

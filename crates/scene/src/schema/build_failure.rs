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

impl<E: From<SceneError>> BuildFailure<E> {
    /// Converts the failure to the error type of the file reader.
    pub fn into_error(self) -> E {
        match self {
            Self::Scene(error) => error.into(),
            Self::File(_, error) => error,
        }
    }
}

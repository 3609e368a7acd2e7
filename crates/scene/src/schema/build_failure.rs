//! The failure of building a world from a description.

use crate::error::SceneError;

/// The failure: of the description, or of a file that it names.
pub enum BuildFailure<E> {
    /// The description.
    Scene(SceneError),
    /// A file, and the key that names it.
    File(String, E),
}

impl<E> From<SceneError> for BuildFailure<E> {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl<E: From<SceneError>> BuildFailure<E> {
    /// As the error of whoever reads the files.
    pub fn into_error(self) -> E {
        match self {
            Self::Scene(error) => error.into(),
            Self::File(_, error) => error,
        }
    }
}

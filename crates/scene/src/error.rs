//! Errors of worlds and cameras.

use std::ops::Range;
use std::path::PathBuf;

use crate::error_code::{ErrorCode, Message};

/// Error of a world, a camera or a texture file. Programs should test [`SceneError::code`]; the message states what was
/// given, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// An invalid camera.
    #[error("{0}")]
    Camera(Message),
    /// Inconsistent geometry, colours or materials.
    #[error("{0}")]
    World(Message),
    /// A description (world file or dict) that the schema does not allow.
    #[error("{}{message}", path_prefix(path))]
    Schema {
        /// The key, such as `object[2].diffuse`; empty for the whole description.
        path: String,
        /// The expectation, with the nearest valid name.
        message: Message,
        /// Byte range in the source text.
        span: Option<Range<usize>>,
    },
    /// The temporary texture file cannot be created, written or read.
    #[error("{}: {message}", path.display())]
    Storage {
        /// The folder of the temporary file.
        path: PathBuf,
        /// The system's error number.
        number: Option<i32>,
        /// The system's message, and a remedy.
        message: String,
    },
}

/// Result type of the crate, whose default error is [`SceneError`].
pub type Result<T, E = SceneError> = std::result::Result<T, E>;

fn path_prefix(path: &str) -> String {
    if path.is_empty() { String::new() } else { format!("{path}: ") }
}

impl SceneError {
    /// The error of an invalid camera.
    pub fn camera(message: impl Into<Message>) -> Self {
        Self::Camera(message.into())
    }

    /// The error of inconsistent parts of a world.
    pub fn world(message: impl Into<Message>) -> Self {
        Self::World(message.into())
    }

    /// The error of a name that no part of a world has.
    pub fn unknown_name(message: impl Into<String>) -> Self {
        Self::World(ErrorCode::UnknownName.message(message))
    }

    /// The error of an invalid lens.
    pub fn lens(message: impl Into<String>) -> Self {
        Self::Camera(ErrorCode::InvalidLens.message(message))
    }

    /// The error of an invalid material.
    pub fn material(message: impl Into<String>) -> Self {
        Self::World(ErrorCode::InvalidMaterial.message(message))
    }

    /// The error of an invalid light.
    pub fn light(message: impl Into<String>) -> Self {
        Self::World(ErrorCode::InvalidLight.message(message))
    }

    /// The error of invalid arrays of a mesh.
    pub fn mesh(message: impl Into<String>) -> Self {
        Self::World(ErrorCode::InvalidMesh.message(message))
    }

    /// Returns the error for a key of a description.
    pub fn schema(code: ErrorCode, path: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Schema { path: path.into(), message: code.message(message), span: None }
    }

    /// Returns the error for a key whose value causes another error.
    pub fn at_key(path: impl Into<String>, error: Self) -> Self {
        Self::Schema { path: path.into(), message: Message::from(error), span: None }
    }

    /// The kind of error.
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Camera(message) => message.code_or(ErrorCode::InvalidCamera),
            Self::World(message) => message.code_or(ErrorCode::InvalidWorld),
            Self::Schema { message, .. } => message.code_or(ErrorCode::InvalidValue),
            Self::Storage { .. } => ErrorCode::Storage,
        }
    }

    /// The error with its key prefixed by `parent`.
    #[must_use]
    pub fn in_context(self, parent: &str) -> Self {
        match self {
            Self::Camera(_) | Self::World(_) => Self::at_key(parent, self),
            // A storage error is not a fault in the description, so no key is added.
            storage @ Self::Storage { .. } => storage,
            Self::Schema { path, message, span } => {
                let joint = if path.is_empty() || path.starts_with('[') { "" } else { "." };
                Self::Schema { path: format!("{parent}{joint}{path}"), message, span }
            }
        }
    }
}

impl From<SceneError> for Message {
    fn from(error: SceneError) -> Self {
        let code = error.code();
        code.message(error.to_string())
    }
}

/// Returns `; did you mean "name"?` with the candidate closest to a misspelt name, or the list of valid names if none
/// is close.
pub fn suggestion<'a>(given: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    let candidates: Vec<&str> = candidates.into_iter().collect();
    let given = given.to_lowercase();
    let likeness = |candidate: &str| strsim::jaro_winkler(&given, &candidate.to_lowercase());
    // A difference of one letter in a short word also counts as a misspelling, although the difference is large
    // relative to the word's length.
    let is_near = |candidate: &str| {
        let slips = strsim::damerau_levenshtein(&given, &candidate.to_lowercase());
        likeness(candidate) >= 0.8 || slips == 1 && given.len() > 1
    };
    let nearest = candidates.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b)));
    match nearest {
        Some(nearest) if is_near(nearest) => format!("; did you mean {nearest:?}?"),
        Some(_) if candidates.len() <= 40 => {
            let names: Vec<String> = candidates.iter().map(|name| format!("{name:?}")).collect();
            format!("; expected one of {}", names.join(", "))
        }
        _ => String::new(),
    }
}

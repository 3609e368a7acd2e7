//! Errors of worlds and cameras, in words their author can act on.

use std::ops::Range;
use std::path::PathBuf;

/// The variant specifies the cause; the message contains the given and the expected values and a remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A camera that cannot be.
    #[error("{0}")]
    Camera(String),
    /// Geometry, colours or materials that do not fit together.
    #[error("{0}")]
    World(String),
    /// A description (world file or dict) that the schema does not allow.
    #[error("{}{message}", path_prefix(path))]
    Schema {
        /// The key, as `object[2].diffuse`; empty at the top.
        path: String,
        /// The expectation, with the nearest valid name.
        message: String,
        /// Byte range in the text that it came from.
        span: Option<Range<usize>>,
    },
    /// The temporary texture file cannot be created, written or read.
    #[error("{}: {message}", path.display())]
    Storage {
        /// The folder that it is in.
        path: PathBuf,
        /// The system's number of the error.
        number: Option<i32>,
        /// The message of the system, and what to do.
        message: String,
    },
}

/// The result of making or changing a part of a world.
pub type Result<T, E = SceneError> = std::result::Result<T, E>;

fn path_prefix(path: &str) -> String {
    if path.is_empty() { String::new() } else { format!("{path}: ") }
}

impl SceneError {
    /// The error of a key of a description.
    pub fn schema(path: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Schema { path: path.into(), message: message.into(), span: None }
    }

    /// The error with its key prefixed by `parent`.
    #[must_use]
    pub fn in_context(self, parent: &str) -> Self {
        match self {
            Self::Camera(message) | Self::World(message) => Self::schema(parent, message),
            // Not the description's fault, whatever part of it came next.
            storage @ Self::Storage { .. } => storage,
            Self::Schema { path, message, span } => {
                let joint = if path.is_empty() || path.starts_with('[') { "" } else { "." };
                Self::Schema { path: format!("{parent}{joint}{path}"), message, span }
            }
        }
    }
}

/// `; did you mean "name"?` with the candidate nearest to a misspelt name, or the valid ones where none is near.
pub fn suggestion<'a>(given: &str, candidates: impl IntoIterator<Item = &'a str>) -> String {
    let candidates: Vec<&str> = candidates.into_iter().collect();
    let given = given.to_lowercase();
    let likeness = |candidate: &str| strsim::jaro_winkler(&given, &candidate.to_lowercase());
    // One slip in a short word is a misspelling as well, though it makes a large difference.
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

//! What can be wrong with a world or a camera, in words its author can act on.

use std::ops::Range;

/// Whose fault it is decides the variant; the message says what was given, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A camera that no pinhole camera is.
    #[error("{0}")]
    Camera(String),
    /// Geometry, colours or materials that do not fit together.
    #[error("{0}")]
    World(String),
    /// A description (world file or dict) that the schema does not allow.
    #[error("{path}: {message}")]
    Schema {
        /// The key, as `object[2].diffuse`; empty at the top.
        path: String,
        /// What was expected, with the nearest valid name.
        message: String,
        /// Where in the text, in bytes, when it came from one.
        span: Option<Range<usize>>,
    },
}

//! Errors of preparation and rendering.

use raycam_bvh::BuildError;
use raycam_scene::{ErrorCode, Message, SceneError};

/// Error of preparation or rendering. Programs should test [`RenderError::code`]; the message states what was given,
/// what was expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The settings, regions or arrays are invalid.
    #[error("{0}")]
    Settings(Message),
    /// The parts of the world are inconsistent.
    #[error("{0}")]
    World(Message),
    /// Texture tiles cannot be read back from the texture memory's file.
    #[error(transparent)]
    Textures(SceneError),
    /// No BVH can be built for the geometry.
    #[error("mesh {mesh}: {source}")]
    Build {
        /// Index into the world's meshes.
        mesh: usize,
        /// The builder's error.
        source: BuildError,
    },
    /// The image does not fit into memory.
    #[error("{what} requires {bytes} bytes; the limit is {limit}; request a smaller region or fewer channels")]
    TooLarge {
        /// Description of the requested data.
        what: String,
        /// Size of the data in bytes.
        bytes: u64,
        /// Maximum size in bytes.
        limit: u64,
    },
    /// The system cannot provide the memory.
    #[error(
        "{what} requires {bytes} bytes, more than the system provides; free memory, or request less at a time, for \
         example a smaller region or fewer channels"
    )]
    OutOfMemory {
        /// A description of the requested data.
        what: String,
        /// Size of the data in bytes.
        bytes: u64,
    },
    /// [`crate::Control::cancel`] was called.
    #[error("cancelled")]
    Cancelled,
    /// The operating system refused to start threads.
    #[error("cannot start {threads} threads: {message}")]
    Threads {
        /// Number of threads requested.
        threads: usize,
        /// The system's message.
        message: String,
    },
}

impl RenderError {
    /// Creates the error of invalid settings, regions or arrays.
    pub fn settings(message: impl Into<Message>) -> Self {
        Self::Settings(message.into())
    }

    /// Creates the error of a world whose parts are inconsistent.
    pub fn world(message: impl Into<Message>) -> Self {
        Self::World(message.into())
    }

    /// Returns the code of the error.
    pub fn code(&self) -> ErrorCode {
        match self {
            Self::Settings(message) => message.code_or(ErrorCode::InvalidSettings),
            Self::World(message) => message.code_or(ErrorCode::InvalidWorld),
            Self::Textures(error) => error.code(),
            Self::Build { .. } => ErrorCode::InvalidMesh,
            Self::TooLarge { .. } => ErrorCode::TooLarge,
            Self::OutOfMemory { .. } => ErrorCode::OutOfMemory,
            Self::Cancelled => ErrorCode::Cancelled,
            Self::Threads { .. } => ErrorCode::NoThreads,
        }
    }
}

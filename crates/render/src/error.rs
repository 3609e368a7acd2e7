//! Errors of preparation and rendering.

use raycam_bvh::BuildError;
use raycam_scene::SceneError;

/// Error of preparation or rendering. The variant specifies who can fix it; the message contains the given and the
/// expected values and a remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// Invalid settings, regions or arrays.
    #[error("{0}")]
    Settings(String),
    /// A world with inconsistent parts.
    #[error("{0}")]
    World(String),
    /// Texture tiles that cannot be read back from the texture memory's file.
    #[error(transparent)]
    Textures(SceneError),
    /// Geometry that no BVH can be built over.
    #[error("mesh {mesh}: {source}")]
    Build {
        /// Index into the world's meshes.
        mesh: usize,
        /// The builder's error.
        source: BuildError,
    },
    /// The image does not fit into memory.
    #[error("{what} needs {bytes} bytes, the limit is {limit}; render it in regions or with fewer channels")]
    TooLarge {
        /// The object that was requested.
        what: String,
        /// Its size.
        bytes: u64,
        /// The largest size allowed.
        limit: u64,
    },
    /// The system cannot provide the memory.
    #[error(
        "{what} needs {bytes} bytes, more than the system provides; render smaller regions or fewer channels at a time"
    )]
    OutOfMemory {
        /// The thing that was requested.
        what: String,
        /// Its size.
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

//! Errors of preparation and rendering.

use raycam_bvh::BuildError;
use raycam_scene::SceneError;

/// Error of preparation or rendering. The variant tells who can fix it; the message says what was given, what was
/// expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// Settings, regions or arrays that no frame can be rendered from.
    #[error("{0}")]
    Settings(String),
    /// A world whose parts do not fit together.
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
    /// The picture does not fit into memory.
    #[error("{what} needs {bytes} bytes, {limit} at most are allowed; render it in regions or with fewer channels")]
    TooLarge {
        /// The object that was requested.
        what: String,
        /// Its size.
        bytes: u64,
        /// The largest size allowed.
        limit: u64,
    },
    /// The system does not give the memory.
    #[error("{what} needs {bytes} bytes, more than the system gives this process; ask for less at a time")]
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

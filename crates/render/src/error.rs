//! Why there is no picture.

use raycam_bvh::BuildError;
use raycam_scene::SceneError;

/// Whose fault it is decides the variant; the message says what was given, what was expected and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// Settings, regions or arrays that no picture can be made from.
    #[error("{0}")]
    Settings(String),
    /// A world whose parts do not fit together.
    #[error("{0}")]
    World(String),
    /// Textures that cannot be read back from where they are.
    #[error(transparent)]
    Textures(SceneError),
    /// Geometry that no acceleration structure can hold.
    #[error("mesh {mesh}: {source}")]
    Build {
        /// Index into the world's meshes.
        mesh: usize,
        /// What is wrong with it.
        source: BuildError,
    },
    /// The picture does not fit into memory.
    #[error(
        "{what} needs {bytes} bytes, {limit} at most are allowed; render it in regions or with fewer channels"
    )]
    TooLarge {
        /// What was asked for.
        what: String,
        /// Its size.
        bytes: u64,
        /// What there may be.
        limit: u64,
    },
    /// [`crate::Control::cancel`] was called.
    #[error("cancelled")]
    Cancelled,
    /// The operating system gives no threads.
    #[error("cannot start {threads} threads: {message}")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        message: String,
    },
}

//! Why a mesh or a scene could not be built.

/// Why a mesh or a scene could not be built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BuildError {
    /// A triangle names a vertex that is not there.
    IndexOutOfRange {
        /// The triangle.
        triangle: usize,
        /// The index it gives.
        index: u32,
        /// The vertices there are.
        vertices: usize,
    },
    /// A vertex or a transform is NaN or infinite.
    NonFinite {
        /// `vertex 12` or `instance 3`.
        what: String,
    },
    /// More triangles or instances than 32-bit indices hold.
    TooLarge {
        /// `triangles` or `instances`.
        what: &'static str,
        /// How many were given.
        given: usize,
        /// How many there may be.
        limit: usize,
    },
    /// A tree was to be refitted to a mesh that it does not fit.
    TopologyMismatch {
        /// Triangles of the mesh.
        given: usize,
        /// Triangles of the tree.
        built: usize,
    },
}

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::IndexOutOfRange {
                triangle,
                index,
                vertices,
            } => {
                write!(
                    f,
                    "triangle {triangle} names vertex {index}, but there are {vertices} vertices"
                )
            }
            Self::NonFinite { what } => write!(f, "{what} is NaN or infinite"),
            Self::TooLarge { what, given, limit } => {
                write!(f, "{given} {what} given, at most {limit} fit")
            }
            Self::TopologyMismatch { given, built } => write!(
                f,
                "a tree of {built} triangles cannot be refitted to {given} triangles, or not to ones of that size: \
                 build it anew"
            ),
        }
    }
}

impl std::error::Error for BuildError {}

//! Errors of building a mesh or a scene.

/// Error of building a mesh or a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BuildError {
    /// A triangle refers to a vertex that does not exist.
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The invalid vertex index.
        index: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// A vertex or a transform is NaN or infinite.
    NonFinite {
        /// The invalid item, such as `vertex 12` or `instance 3`.
        what: String,
    },
    /// More triangles or instances than 32-bit indices support.
    TooLarge {
        /// The items: `triangles` or `instances`.
        what: &'static str,
        /// The given number of items.
        given: usize,
        /// The largest supported number.
        limit: usize,
    },
    /// A tree does not match the mesh of a refit.
    TopologyMismatch {
        /// Number of triangles of the mesh.
        given: usize,
        /// Number of triangles of the tree.
        built: usize,
    },
}

impl std::fmt::Display for BuildError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::IndexOutOfRange { triangle, index, vertices } => {
                write!(f, "triangle {triangle} refers to vertex {index}, but the mesh has {vertices} vertices")
            }
            Self::NonFinite { what } => write!(f, "{what} is NaN, infinite, or beyond 3.4e38"),
            Self::TooLarge { what, given, limit } => {
                write!(f, "too many {what}: {given}, limit {limit}")
            }
            Self::TopologyMismatch { given, built } => write!(
                f,
                "a tree of {built} triangles cannot be refitted: the mesh has {given} triangles, or its size has \
                 changed too much; build a new tree"
            ),
        }
    }
}

impl std::error::Error for BuildError {}

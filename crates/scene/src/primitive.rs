//! Primitive shapes as meshes centred at the origin: box, plane, sphere, cylinder, cone, torus.

use crate::error::SceneError;
use crate::mesh::Mesh;

/// An axis-aligned box of edge lengths `size`, 12 triangles.
///
/// # Errors
/// [`SceneError::World`] where an edge length is not finite and > 0.
pub fn box_(_size: [f64; 3]) -> Result<Mesh, SceneError> {
    todo_()
}

/// A rectangle in the xy plane that faces +z, 2 triangles.
///
/// # Errors
/// [`SceneError::World`] where an edge length is not finite and > 0.
pub fn plane(_size: [f64; 2]) -> Result<Mesh, SceneError> {
    todo_()
}

/// An icosphere: an icosahedron whose 20 faces are split into four `level` times, with all vertices on the sphere.
///
/// # Errors
/// [`SceneError::World`] where the radius is not finite and > 0, or the level beyond 9.
pub fn sphere(_radius: f64, _level: u32) -> Result<Mesh, SceneError> {
    todo_()
}

/// A closed cylinder around the z axis from `-height / 2` to `height / 2`.
///
/// # Errors
/// [`SceneError::World`] where a length is not finite and > 0, or segments are not 3..=4096.
pub fn cylinder(_radius: f64, _height: f64, _segments: u32) -> Result<Mesh, SceneError> {
    todo_()
}

/// A closed cone around the z axis, its base at `-height / 2`, its tip at `height / 2`.
///
/// # Errors
/// [`SceneError::World`] where a length is not finite and > 0, or segments are not 3..=4096.
pub fn cone(_radius: f64, _height: f64, _segments: u32) -> Result<Mesh, SceneError> {
    todo_()
}

/// A torus around the z axis: circle of `radius`, thickness of radius `tube` < `radius`.
///
/// # Errors
/// [`SceneError::World`] where a length is not finite and > 0, `tube >= radius`, or segments are not 3..=4096.
pub fn torus(_radius: f64, _tube: f64, _segments: u32) -> Result<Mesh, SceneError> {
    todo_()
}

fn todo_() -> Result<Mesh, SceneError> {
    Err(SceneError::World("not built yet".into()))
}

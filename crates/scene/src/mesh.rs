//! A mesh: indexed triangles in float64, with what its corners and faces carry.

use glam::DVec3;

use crate::color::Rgb;
use crate::error::SceneError;

/// Indexed triangles in mesh-local coordinates. Vertices are used exactly as given.
///
/// Per-vertex arrays are as long as `vertices`, per-triangle arrays as long as `triangles`; an absent one is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corner positions.
    pub vertices: Vec<DVec3>,
    /// Corner indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Shading normals, unit length, per vertex.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Texture coordinates per vertex; v = 0 is the top row of the image, as in glTF.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Linear colours per vertex, interpolated.
    pub vertex_colors: Option<Vec<Rgb>>,
    /// Linear colours per triangle.
    pub face_colors: Option<Vec<Rgb>>,
    /// Per triangle, which of its object's `materials` it has; all 0 when absent.
    pub material_slots: Option<Vec<u16>>,
}

impl Mesh {
    /// Whether everything fits together.
    ///
    /// # Errors
    /// [`SceneError::World`]: no triangles, vertices that are not finite, indices out of range, arrays of the wrong
    /// length, colours outside 0..=1.
    pub fn validate(&self) -> Result<(), SceneError> {
        Ok(())
    }

    /// How many triangles have no area: they are kept, and never hit.
    pub fn degenerate_count(&self) -> usize {
        0
    }

    /// The smallest and largest corner of the vertices that triangles use; `None` without triangles.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        None
    }
}

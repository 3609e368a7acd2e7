//! Statistics of a world.

use crate::mesh::Mesh;
use crate::world::World;

/// Counts of a world's parts. Triangles count once per object that shows them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldStats {
    /// Shared meshes.
    pub meshes: usize,
    /// Placed meshes.
    pub objects: usize,
    /// Triangles of all meshes, each mesh once.
    pub mesh_triangles: usize,
    /// Triangles of all objects.
    pub object_triangles: usize,
    /// Triangles without area, counting each mesh once: they are kept, but rays never hit them.
    pub degenerate_triangles: usize,
    /// Vertices of all meshes, each mesh once.
    pub vertices: usize,
    /// Materials.
    pub materials: usize,
    /// Textures.
    pub textures: usize,
    /// Lights.
    pub lights: usize,
    /// Cameras.
    pub cameras: usize,
}

impl World {
    /// Returns the counts of the world's parts.
    pub fn stats(&self) -> WorldStats {
        let sum = |of: fn(&Mesh) -> usize| self.meshes.iter().map(|mesh| of(mesh)).sum();
        WorldStats {
            meshes: self.meshes.len(),
            objects: self.objects.len(),
            mesh_triangles: sum(|mesh| mesh.triangles.len()),
            object_triangles: self.objects.iter().map(|object| self.meshes[object.mesh].triangles.len()).sum(),
            degenerate_triangles: sum(Mesh::degenerate_count),
            vertices: sum(|mesh| mesh.vertices.len()),
            materials: self.materials.len(),
            textures: self.textures.len(),
            lights: self.lights.len(),
            cameras: self.cameras.len(),
        }
    }
}

//! Bounds of a world and of its objects.

use glam::DVec3;

use crate::mesh::oriented_box::OrientedBox;
use crate::world::World;

impl World {
    /// Axis-aligned bounds of all visible objects, computed from their vertices: the smallest and the largest
    /// coordinates. `None` without visible objects.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.objects
            .iter()
            .filter(|object| object.visible)
            .filter_map(|object| self.meshes[object.mesh].bounds_in(object.world_from_mesh))
            .reduce(|(low, high), (l, h)| (low.min(l), high.max(h)))
    }

    /// Box around an object along the axes of its mesh: see [`OrientedBox::around`]. `None` if the object does not
    /// exist.
    pub fn oriented_box(&self, object: usize) -> Option<OrientedBox> {
        let object = self.objects.get(object)?;
        OrientedBox::around(&self.meshes[object.mesh], object.world_from_mesh)
    }
}

//! Number of time slices of an exposure, by the motion of objects in the image.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use raycam_scene::{Camera, Mesh, World};

/// Minimum number of slices; it is sufficient for a motion of up to 64 pixels.
const MIN_SLICES: usize = 64;
/// Largest motion per slice, in pixels, that is not visible, and smallest motion per slice that a notice reports.
const SMOOTH_STEP: f64 = 1.0;
const COARSE_STEP: f64 = 1.5;
/// Number of times at which the motion is measured, for rigid objects and for worlds with deforming meshes.
const PROBES: usize = 64;
const DEFORMING_PROBES: usize = 16;

/// Number of time slices of an exposure, and the motion of objects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SliceCount {
    pub slices: usize,
    /// Length in pixels of the longest path of a box corner in the image.
    pub motion: f64,
}

impl SliceCount {
    /// The number of slices for a motion in pixels: a power of two within the limits.
    pub fn for_motion(motion: f64, [min, max]: [usize; 2]) -> Self {
        let wanted = (motion / SMOOTH_STEP).ceil().min(max as f64) as usize;
        Self { slices: wanted.next_power_of_two().clamp(min, max), motion }
    }

    /// The number of slices for the motion during an exposure. `at` returns the world at a fraction of the exposure,
    /// from 0 to 1.
    pub fn of_exposure(world: &World, camera: &Camera, max: usize, at: impl Fn(f64) -> Option<World>) -> Self {
        let probes = if world.node_tree.is_some() { DEFORMING_PROBES } else { PROBES };
        let mut way = Ways::default();
        for probe in 0..=probes {
            if let Some(world) = at(probe as f64 / probes as f64) {
                way.add(&world, camera);
            }
        }
        Self::for_motion(way.longest(), [MIN_SLICES.min(max), max])
    }

    /// Motion per slice in pixels, if the slices are visible as separate images; otherwise `None`.
    pub fn coarse_step(&self) -> Option<f64> {
        let step = self.motion / self.slices as f64;
        (step > COARSE_STEP).then_some(step)
    }
}

/// The paths of the corners of all objects' boxes in the image.
#[derive(Default)]
struct Ways {
    /// For each corner: its last position in the image, and the length of the corner's path so far, in pixels.
    corners: Vec<(Option<DVec2>, f64)>,
    /// Boxes of meshes by the address of the mesh.
    boxes: HashMap<*const Mesh, MeshBox>,
}

/// Box of a mesh; without bounds if the mesh is empty.
struct MeshBox {
    bounds: Option<(DVec3, DVec3)>,
    /// The mesh is kept, so that its address is not reused.
    _mesh: Arc<Mesh>,
}

impl Ways {
    /// Adds the positions in a world. Positions outside the image are moved closer, to at most the image's size away
    /// from the image.
    fn add(&mut self, world: &World, camera: &Camera) {
        let size = DVec2::from(camera.size().map(f64::from));
        self.corners.resize(8 * world.objects.len(), (None, 0.0));
        for (object, corners) in world.objects.iter().zip(self.corners.chunks_exact_mut(8)) {
            let Some(mesh) = object.visible.then(|| &world.meshes[object.mesh]) else { continue };
            let known = self
                .boxes
                .entry(Arc::as_ptr(mesh))
                .or_insert_with(|| MeshBox { bounds: mesh.bounds(), _mesh: mesh.clone() });
            let Some((lower, upper)) = known.bounds else { continue };
            for (i, (last, length)) in corners.iter_mut().enumerate() {
                let pick = |axis: usize| if i >> axis & 1 == 0 { lower[axis] } else { upper[axis] };
                let corner = object.world_from_mesh.transform_point3(DVec3::new(pick(0), pick(1), pick(2)));
                let (pixel, is_valid) = camera.project(corner);
                let now = (is_valid && pixel.is_finite()).then(|| pixel.clamp(-size, 2.0 * size));
                if let (Some(before), Some(now)) = (*last, now) {
                    *length += before.distance(now);
                }
                *last = now;
            }
        }
    }

    fn longest(&self) -> f64 {
        self.corners.iter().fold(0.0, |longest, (_, length)| longest.max(*length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slice_counts_grow_with_the_motion_within_their_limits() {
        let count = |motion| SliceCount::for_motion(motion, [64, 1024]).slices;
        assert_eq!([0.0, 64.0, 65.0, 300.0, 1024.0, 1e9].map(count), [64, 64, 128, 512, 1024, 1024]);
        let step = |motion| SliceCount::for_motion(motion, [64, 256]).coarse_step();
        assert_eq!(step(300.0), None);
        assert_eq!(step(1024.0), Some(4.0));
    }
}

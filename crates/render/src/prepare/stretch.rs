//! Stretched meshes: an instance whose transform squeezes its mesh gets a BVH over the squeezed mesh.
//!
//! Rays are traced in mesh coordinates. If a transform squeezes the mesh to a small fraction along one axis, one
//! float32 rounding in the scene becomes much larger in mesh coordinates, and boxes padded by that amount are hit by
//! many rays that miss the mesh. The mesh is therefore squeezed first; the rest of the transform is nearly a rotation
//! with a uniform scale.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DMat3, DVec3};
use raycam_bvh::Bvh;
use raycam_scene::Object;
use raycam_scene::math::polar::polar;

use crate::error::RenderError;
use crate::prepare::mesh::PreparedMesh;

/// Maximum condition number, in the infinity norm, for which the BVH is not stretched; a rotation has at most 3.
const MAX_CONDITION: f64 = 6.0;
/// Maximum number of triangles in the stretched meshes of a world.
const MAX_TRIANGLES: usize = 1 << 22;
/// Step to which the entries of a stretch are rounded, as a fraction of the largest entry, so that rotations do not
/// change the stretch.
const STRETCH_STEPS: f64 = (1u64 << 24) as f64;

/// BVH over a mesh after a linear map.
#[derive(Clone, Debug)]
pub(crate) struct StretchedBvh {
    pub bvh: Arc<Bvh>,
    pub stretch: DMat3,
}

/// Stretched meshes of a world.
#[derive(Default)]
pub(crate) struct StretchedMeshes {
    by_mesh: HashMap<(usize, [u64; 9]), Option<StretchedBvh>>,
    triangles: usize,
}

impl StretchedMeshes {
    /// Stretched mesh of an instance; `None` if the transform does not require a stretched mesh, or if the world's
    /// stretched meshes have too many triangles.
    ///
    /// # Errors
    /// [`RenderError::OutOfMemory`] and [`RenderError::Build`].
    pub fn of_instance(
        &mut self,
        object: &Object,
        mesh: &Arc<PreparedMesh>,
    ) -> Result<Option<StretchedBvh>, RenderError> {
        let Some(stretch) = stretch_of(object.world_from_mesh.matrix3) else { return Ok(None) };
        let key = (Arc::as_ptr(mesh).addr(), stretch.to_cols_array().map(f64::to_bits));
        if let Some(known) = self.by_mesh.get(&key) {
            return Ok(known.clone());
        }
        // Triangles are counted for each world separately, so that equal worlds give identical bytes, independent of
        // other worlds in memory.
        let triangles = self.triangles.saturating_add(mesh.mesh.triangles.len());
        let found = if triangles > MAX_TRIANGLES {
            None
        } else {
            self.triangles = triangles;
            Some(StretchedBvh { bvh: mesh.stretched_bvh(object.mesh, stretch)?, stretch })
        };
        self.by_mesh.insert(key, found.clone());
        Ok(found)
    }
}

/// Stretch to apply to a mesh before its BVH is built; `None` if no stretch is needed or the transform is flat.
fn stretch_of(linear: DMat3) -> Option<DMat3> {
    let is_good = |m: DMat3| condition(m) <= MAX_CONDITION;
    if is_good(linear) || !linear.inverse().is_finite() {
        return None;
    }
    // The stretch scales the mesh's axes by powers of two, so that no coordinate is rounded and similar transforms
    // share the same stretch.
    let lengths = DVec3::new(linear.x_axis.length(), linear.y_axis.length(), linear.z_axis.length());
    let largest = lengths.max_element();
    let axes = DMat3::from_diagonal((lengths / largest).to_array().map(|l| l.log2().round().exp2()).into());
    if is_good(linear * axes.inverse()) {
        return Some(axes);
    }
    // Transforms with shear compress the mesh in directions other than its axes.
    let (_, stretch) = polar(if linear.determinant() < 0.0 { -linear } else { linear })?;
    let step = largest / STRETCH_STEPS;
    let stretch = DMat3::from_cols_array(&stretch.to_cols_array().map(|x| (x / step).round() / STRETCH_STEPS));
    is_good(linear * stretch.inverse()).then_some(stretch)
}

/// Condition number of a linear map in the infinity norm; NaN or infinite for a map that flattens.
fn condition(linear: DMat3) -> f64 {
    let norm = |m: DMat3| (m.abs() * DVec3::ONE).max_element();
    norm(linear) * norm(linear.inverse())
}

#[cfg(test)]
mod tests {
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Material, World};

    use super::*;
    use crate::control::Control;
    use crate::prepare::world::PreparedWorld;

    fn turned(angle: f64) -> DMat3 {
        DMat3::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), angle)
    }

    #[test]
    fn stretching_leaves_a_transform_close_to_a_rotation() {
        for good in [
            DMat3::IDENTITY,
            turned(0.7) * 1e-6,
            -turned(2.0),
            turned(1.0) * DMat3::from_diagonal(DVec3::new(1.0, 0.4, 1.0)),
        ] {
            assert_eq!(stretch_of(good), None);
        }
        let flat = DMat3::from_diagonal(DVec3::new(3.0, 4e-3, 3.0));
        let shear = turned(1.1) * flat * turned(0.4);
        for squeezed in [flat, shear, shear * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0))] {
            let stretch = stretch_of(squeezed).unwrap();
            for angle in [0.0, 0.3, 1.9, 3.0] {
                let moved = turned(angle) * squeezed * 0.9;
                assert_eq!(stretch_of(turned(angle) * squeezed), Some(stretch), "{angle}");
                assert!(condition(moved * stretch.inverse()) <= MAX_CONDITION);
            }
        }
        assert_eq!(stretch_of(flat * 0.9), stretch_of(flat), "powers of two");
        assert_eq!(stretch_of(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0))), None);
    }

    #[test]
    fn instances_share_stretched_meshes_within_the_budget() {
        let mut world = World::default();
        let mesh = world.add_mesh(primitive::sphere(1.0, 3).unwrap());
        let material = world.add_material(Material::default()).unwrap();
        let flat = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1e-3));
        for linear in [flat, turned(0.5) * flat, DMat3::IDENTITY, flat.transpose() * turned(0.5)] {
            world.add_object(Object::new("", mesh, vec![material], glam::DAffine3::from_mat3(linear))).unwrap();
        }
        let prepared = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let instances = &prepared.geometry.instances;
        let tree = |i: usize| instances[i].stretched.as_ref().map(|own| Arc::as_ptr(&own.bvh));
        assert!(tree(0).is_some() && tree(0) == tree(1) && tree(2).is_none());
        assert!(tree(3).is_some() && tree(3) != tree(0));
        // A copy of the world reuses the stretched meshes. A mesh that would exceed the limit on triangles is not
        // stretched.
        let again = PreparedWorld::new(&world, Some(&prepared), None, &Control::new()).unwrap();
        assert!(Arc::ptr_eq(
            &again.geometry.instances[0].stretched.as_ref().unwrap().bvh,
            &instances[0].stretched.as_ref().unwrap().bvh
        ));
        let mut full = StretchedMeshes { triangles: MAX_TRIANGLES, ..Default::default() };
        assert!(full.of_instance(&world.objects[0], &instances[0].mesh).unwrap().is_none());
    }
}

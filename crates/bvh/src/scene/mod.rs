//! The scene: instances of BLAS under a TLAS. This file defines the data. `build` and `flattened` create the scene,
//! `rebraid` opens instances for the TLAS, and `query` traces rays.

pub mod backoff;
pub(crate) mod build;
pub(crate) mod flattened;
pub(crate) mod instance_ranges;
pub(crate) mod query;
pub(crate) mod rebraid;
mod ties;

use std::sync::Arc;

use crate::aabb::Aabb;
use crate::blas::Bvh;
use crate::limits::MACHINE_EPSILON;
use crate::node::{NodeBlock, NodeRef};
use crate::platform::dispatch::{Dispatch, InstructionSet};
use crate::platform::huge_page_vec::HugePageVec;
use crate::scene::backoff::Backoff;
use crate::scene::instance_ranges::InstanceRanges;
use crate::scene::rebraid::SubtreeRef;

/// An instance of a mesh. `world_from_mesh` contains the rows of the 3 x 4 matrix that maps mesh-local to scene-local
/// coordinates.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The BLAS of the mesh.
    pub bvh: Arc<Bvh>,
    /// Any invertible affine transform: rotation, scale, shear, mirror, translation.
    pub world_from_mesh: [[f32; 4]; 3],
}

/// The float64 world coordinates of triangles, for [`Scene::closest_exact`].
///
/// The mesh and transform given to [`Scene::build`] must be these values rounded to float32, because the padding of the
/// search covers only that rounding.
pub trait ExactTriangles {
    /// Returns the world coordinates of the three corners of a triangle, which is given by its index in the
    /// mesh of an instance.
    fn corners(&self, instance: u32, triangle: u32) -> [[f64; 3]; 3];

    /// Prefetches the indices of a triangle's corners.
    fn prefetch_indices(&self, _instance: u32, _triangle: u32) {}

    /// Prefetches the corners of a triangle, whose indices are in the cache.
    fn prefetch_corners(&self, _instance: u32, _triangle: u32) {}

    /// True if the instance is mirrored: seen from outside, the corners of its triangles are clockwise.
    fn is_mirrored(&self, _instance: u32) -> bool {
        false
    }
}

/// An instance in the form that traversal uses.
#[derive(Debug)]
pub(crate) struct InstanceRecord {
    pub bvh: Arc<Bvh>,
    /// Transform from scaled scene coordinates to tree coordinates of the mesh.
    pub mesh_from_scene: [[f32; 4]; 3],
    /// Translation, if `mesh_from_scene` is only a translation.
    pub translation_only: Option<[f32; 3]>,
    /// Largest factor by which `mesh_from_scene` scales the largest coordinate of a vector.
    pub max_scale: f32,
    /// Upper bound on the largest factor by which `mesh_from_scene` scales the length of a vector.
    pub max_length_scale: f32,
    /// Upper bound on the ratio of the largest to the smallest factor by which `mesh_from_scene` scales lengths.
    pub length_condition: f32,
}

/// A scene: instances under a TLAS. Scene-local coordinates are world coordinates relative to `origin`.
pub struct Scene {
    pub(crate) instances: Vec<InstanceRecord>,
    pub(crate) origin: [f64; 3],
    /// Power of two by which scene coordinates are multiplied before traversal; 1 except for extreme scenes.
    pub(crate) scale: f64,
    /// The leaves of the TLAS.
    pub(crate) subtree_refs: Vec<SubtreeRef>,
    /// The nodes of the TLAS.
    pub(crate) tlas: HugePageVec<NodeBlock>,
    pub(crate) root: NodeRef,
    /// The bounds of all instances, in scaled coordinates.
    pub(crate) bounds: Aabb,
    /// Largest absolute coordinate, in scaled coordinates. Together with the condition number of the worst transform,
    /// this value bounds rounding errors.
    pub(crate) max_abs_coord: f32,
    pub(crate) transform_condition: f32,
    /// True for a single mesh with the identity transform: rays skip the transform and the TLAS.
    pub(crate) is_single_mesh: bool,
    /// The triangle ranges of the instances, for a flattened scene.
    pub(crate) mesh_ranges: Option<InstanceRanges>,
    /// Back-off for packets of incoherent rays and for culling at the root.
    pub(crate) packet_backoff: Backoff,
    pub(crate) root_cull_backoff: Backoff,
    /// Back-off for packets of coherent shadow rays.
    pub(crate) shadow_packet_backoff: Backoff,
    pub(crate) dispatch: Dispatch,
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Scene of {} instances for {}", self.instances.len(), self.dispatch.isa().name())
    }
}

impl Scene {
    /// The world coordinates of the scene-local origin.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// True if the scene is one BLAS whose rays need no transform.
    pub fn is_single_level(&self) -> bool {
        self.is_single_mesh
    }

    /// Selects an instruction set. Returns false, without effect, if the machine does not support it. Hits do not
    /// depend on it.
    pub fn set_instruction_set(&mut self, isa: InstructionSet) -> bool {
        let dispatch = Dispatch::try_new(isa);
        self.dispatch = dispatch.unwrap_or(self.dispatch);
        dispatch.is_some()
    }

    /// The nodes of the TLAS.
    pub(crate) fn blocks(&self) -> &[NodeBlock] {
        &self.tlas
    }

    /// Padding of instance boxes for the rounding errors of a transformed ray whose origin is within `distance` of the
    /// scene's origin.
    #[inline(always)]
    pub(crate) fn box_padding(&self, distance: f32) -> f32 {
        self.relative_padding(false) * (distance + self.max_abs_coord)
    }

    /// True if the origin is within the scene's bounds, so that the small padding is sufficient for a float32 ray.
    #[inline(always)]
    pub(crate) fn is_within_reach(&self, [x, y, z]: [f32; 3]) -> bool {
        x.abs().max(y.abs()).max(z.abs()) <= self.max_abs_coord
    }

    /// The padding as a fraction of the largest coordinate. It is small if `within` is true, because the boxes of
    /// instances with general transforms are then already padded, and a translation only has the rounding error of one
    /// sum.
    #[inline(always)]
    pub(crate) fn relative_padding(&self, within: bool) -> f32 {
        if within { 2.0 * MACHINE_EPSILON } else { relative_padding_of(self.transform_condition) }
    }
}

/// The rounding error of a transform with this condition number, as a fraction of the largest coordinate.
pub(crate) fn relative_padding_of(transform_condition: f32) -> f32 {
    (64.0 * transform_condition + 24.0) * MACHINE_EPSILON
}

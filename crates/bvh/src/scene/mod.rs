//! The scene: placed meshes, and the queries over them.

pub mod backoff;
pub(crate) mod build;
pub(crate) mod flattened;
pub(crate) mod instance_ranges;
pub(crate) mod query;
pub(crate) mod rebraid;

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

/// A placed mesh: `world_from_mesh` maps mesh-local to scene-local coordinates, rows of a 3 x 4 matrix.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The mesh.
    pub bvh: Arc<Bvh>,
    /// Any invertible affine transform: rotation, scale, shear, mirror, translation.
    pub world_from_mesh: [[f32; 4]; 3],
}

/// Where [`Scene::closest_exact`] finds a triangle's corners in float64 world coordinates.
///
/// The mesh and transform given to [`Scene::build`] must be these rounded to float32: the search is padded for that
/// rounding and no more.
pub trait ExactTriangles {
    /// The three corners of a triangle of an instance.
    fn corners(&self, instance: u32, triangle: u32) -> [[f64; 3]; 3];
}

/// A mesh in its place, as rays see it.
#[derive(Debug)]
pub(crate) struct InstanceRecord {
    pub bvh: Arc<Bvh>,
    /// From scaled scene coordinates to those of the mesh's tree.
    pub mesh_from_scene: [[f32; 4]; 3],
    /// Where it does no more than that, by how much it moves points.
    pub translation_only: Option<[f32; 3]>,
    /// How much longer it makes a vector at most.
    pub max_scale: f32,
}

/// Placed meshes, ready to be traced. Scene-local coordinates are world coordinates less `origin`.
pub struct Scene {
    pub(crate) instances: Vec<InstanceRecord>,
    pub(crate) origin: [f64; 3],
    /// Scene coordinates are multiplied by this power of two before anything else; 1 for all but extreme scenes.
    pub(crate) scale: f64,
    /// What rays go into, one after the other.
    pub(crate) subtree_refs: Vec<SubtreeRef>,
    /// Nodes over the subtree_refs.
    pub(crate) tlas: HugePageVec<NodeBlock>,
    pub(crate) root: NodeRef,
    /// Box of everything, scaled.
    pub(crate) bounds: Aabb,
    /// Largest coordinate at hand, scaled; with the transform_condition of the worst transform it bounds rounding.
    pub(crate) max_abs_coord: f32,
    pub(crate) transform_condition: f32,
    /// The scene is one mesh, placed where it was made: rays need neither transform nor the nodes above.
    pub(crate) is_single_mesh: bool,
    /// Whose the triangles of that mesh are, where it is several in one.
    pub(crate) mesh_ranges: Option<InstanceRanges>,
    /// Of rays that run apart: packets of them, and asking them at the gate.
    pub(crate) packet_backoff: Backoff,
    pub(crate) root_cull_backoff: Backoff,
    /// Of packets of shadow rays that do not.
    pub(crate) shadow_packet_backoff: Backoff,
    pub(crate) dispatch: Dispatch,
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "Scene of {} instances for {}",
            self.instances.len(),
            self.dispatch.isa().name()
        )
    }
}

impl Scene {
    /// The world coordinates of the scene-local origin.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// Whether it is one tree, in which rays need no transform.
    pub fn is_single_level(&self) -> bool {
        self.is_single_mesh
    }

    /// The instruction set that queries run with.
    pub fn instruction_set(&self) -> InstructionSet {
        self.dispatch.isa()
    }

    /// Makes queries run with a certain instruction set; false, and nothing changes, where the dispatch lacks it.
    /// The answers are the same.
    pub fn set_instruction_set(&mut self, isa: InstructionSet) -> bool {
        let dispatch = Dispatch::try_new(isa);
        self.dispatch = dispatch.unwrap_or(self.dispatch);
        dispatch.is_some()
    }

    /// The nodes above the subtree_refs.
    pub(crate) fn blocks(&self) -> &[NodeBlock] {
        &self.tlas
    }

    /// By how much boxes of instances must be padded for a ray that starts within `distance` of the scene's origin:
    /// a transformed ray is off by no more.
    #[inline(always)]
    pub(crate) fn box_padding(&self, distance: f32) -> f32 {
        self.relative_padding(false) * (distance + self.max_abs_coord)
    }

    /// Whether a ray of float32 that starts here needs boxes to be padded for little.
    #[inline(always)]
    pub(crate) fn is_within_reach(&self, [x, y, z]: [f32; 3]) -> bool {
        x.abs().max(y.abs()).max(z.abs()) <= self.max_abs_coord
    }

    /// The box_padding as a part of the largest coordinate at hand. For a ray of float32 that starts within the scene's max_abs_coord,
    /// boxes of instances that are more than moved have their pads already, and for others one sum is rounded.
    #[inline(always)]
    pub(crate) fn relative_padding(&self, within: bool) -> f32 {
        if within {
            2.0 * MACHINE_EPSILON
        } else {
            relative_padding_of(self.transform_condition)
        }
    }
}

/// What a transform with a transform_condition may do to a ray, as a part of the largest coordinate at hand.
pub(crate) fn relative_padding_of(transform_condition: f32) -> f32 {
    (64.0 * transform_condition + 24.0) * MACHINE_EPSILON
}

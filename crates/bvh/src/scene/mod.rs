//! The scene: placed meshes, and the queries over them.

pub(crate) mod flattened;
pub(crate) mod rebraid;

use std::sync::Arc;

use crate::aabb::Aabb;
use crate::blas::{Bvh, power_of_two_scale};
use crate::build::prim_ref::PrimRef;
use crate::build::{self, LeafBuilder, TREELET_SIZE};
use crate::error::BuildError;
use crate::limits::{MACHINE_EPSILON, MAX_INSTANCES};
use crate::node::{NodeBlock, NodeRef};
use crate::platform::dispatch::{Dispatch, InstructionSet};
use crate::platform::huge_page_vec::HugePageVec;
use crate::ray::{Coherence, ExactHit, ExactRay, Hit, Ray};
use crate::scene::flattened::{FlattenedTriangles, InstanceRanges};
use crate::scene::rebraid::{InstanceTransform, SubtreeRef, rebraid, transform_bounds};
use crate::traverse;
use crate::traverse::stream::backoff::Backoff;

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

impl InstanceRecord {
    /// The transform has no pad yet. `bounds` is the mesh's box in the scene, `None` for an empty mesh.
    fn new(
        instance: Instance,
        bounds: Option<([f64; 3], [f64; 3])>,
        scale: f64,
    ) -> (Self, Option<InstanceTransform>) {
        let mesh_scale = f64::from(instance.bvh.scale());
        let forward = instance.world_from_mesh.map(|row| row.map(f64::from));
        let along = mesh_scale / scale;
        let usable = inverse(&forward)
            .map(|m| m.map(|r| [r[0] * along, r[1] * along, r[2] * along, r[3] * mesh_scale]))
            .map(|m| m.map(|row| row.map(|x| x as f32)))
            .filter(|m| m.iter().flatten().all(|x| x.is_finite()));
        // Row sums bound how far the largest coordinate grows.
        let max_scale = usable.map_or(0.0, |m| norm(&m.map(|row| row.map(f64::from))));
        let transform = usable.and(bounds).map(|(lower, upper)| {
            let shrink = norm(&forward) * scale / mesh_scale;
            let mesh_reach = f64::from(instance.bvh.max_abs_coord()) * shrink;
            let corners = lower.iter().chain(&upper);
            let farthest = corners.fold(0.0, |r: f64, x| r.max((x * scale).abs()));
            let back = scale / mesh_scale;
            InstanceTransform {
                bvh: instance.bvh.clone(),
                scene_from_mesh: forward
                    .map(|r| [r[0] * back, r[1] * back, r[2] * back, r[3] * scale]),
                max_abs_coord: (mesh_reach + farthest) as f32,
                condition: (max_scale * shrink) as f32,
                pad: 0.0,
            }
        });
        let mesh_from_scene = usable.unwrap_or([[0.0; 4]; 3]);
        let translation_only = mesh_from_scene.map(|row| row[3]);
        let record = Self {
            bvh: instance.bvh,
            translation_only: (scale == 1.0 && mesh_from_scene == translation(translation_only))
                .then_some(translation_only),
            mesh_from_scene,
            max_scale: max_scale as f32,
        };
        (record, transform)
    }
}

/// Placed meshes, ready to be traced. Scene-local coordinates are world coordinates less `origin`.
pub struct Scene {
    pub(crate) instances: Vec<InstanceRecord>,
    origin: [f64; 3],
    /// Scene coordinates are multiplied by this power of two before anything else; 1 for all but extreme scenes.
    pub(crate) scale: f64,
    /// What rays go into, one after the other.
    pub(crate) subtree_refs: Vec<SubtreeRef>,
    /// Nodes over the subtree_refs.
    tlas: HugePageVec<NodeBlock>,
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
    dispatch: Dispatch,
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

/// What moves points by a vector.
pub(crate) const fn translation([x, y, z]: [f32; 3]) -> [[f32; 4]; 3] {
    [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]]
}

impl Scene {
    /// Places meshes. An instance whose transform is singular is kept and never hit.
    pub fn build(instances: Vec<Instance>, origin: [f64; 3]) -> Result<Self, BuildError> {
        if instances.len() > MAX_INSTANCES {
            return Err(BuildError::TooLarge {
                what: "instances",
                given: instances.len(),
                limit: MAX_INSTANCES,
            });
        }
        let finite = |i: &Instance| i.world_from_mesh.iter().flatten().all(|x| x.is_finite());
        if let Some(at) = instances.iter().position(|i| !finite(i)) {
            return Err(BuildError::NonFinite {
                what: format!("instance {at}"),
            });
        }
        if !origin.iter().all(|x| x.is_finite()) {
            return Err(BuildError::NonFinite {
                what: "the scene's origin".into(),
            });
        }
        let is_single_mesh =
            instances.len() == 1 && instances[0].world_from_mesh == translation([0.0; 3]);
        let boxes: Vec<_> = instances.iter().map(world_box).collect();
        let max_abs_coord64 = boxes
            .iter()
            .flatten()
            .flat_map(|(l, u)| l.iter().chain(u))
            .fold(0.0, |r: f64, x| r.max(x.abs()));
        let scale = f64::from(if is_single_mesh {
            instances[0].bvh.scale()
        } else {
            power_of_two_scale64(max_abs_coord64)
        });
        let mut scene = Self {
            instances: Vec::with_capacity(instances.len()),
            subtree_refs: vec![],
            origin,
            scale,
            tlas: HugePageVec::with_capacity(0),
            root: NodeRef::EMPTY,
            bounds: Aabb::ORIGIN,
            max_abs_coord: 0.0,
            transform_condition: 1.0,
            is_single_mesh,
            mesh_ranges: None,
            packet_backoff: Backoff::default(),
            root_cull_backoff: Backoff::default(),
            shadow_packet_backoff: Backoff::default(),
            dispatch: Dispatch::detect(),
        };
        let mut transforms: Vec<Option<InstanceTransform>> = Vec::with_capacity(instances.len());
        for (instance, bounds) in instances.into_iter().zip(boxes) {
            let (placed, transform) = InstanceRecord::new(instance, bounds, scale);
            if let Some(transform) = &transform {
                scene.transform_condition = scene.transform_condition.max(transform.condition);
                scene.max_abs_coord = scene.max_abs_coord.max(transform.max_abs_coord);
            }
            scene.instances.push(placed);
            transforms.push(transform);
        }
        for (placed, transform) in scene.instances.iter().zip(&mut transforms) {
            if let (None, Some(transform)) = (placed.translation_only, transform) {
                transform.pad =
                    f64::from(relative_padding_of(transform.condition) * 2.0 * scene.max_abs_coord);
            }
        }
        if is_single_mesh {
            scene.max_abs_coord = scene.instances[0].bvh.max_abs_coord();
        }
        scene.subtree_refs = rebraid(&transforms);
        let prims: Vec<_> = (0..)
            .zip(&scene.subtree_refs)
            .map(|(id, subtree)| subtree.prim_ref(id))
            .collect();
        let tree = build::build(scene.dispatch, prims.as_slice(), &InstanceLeaves);
        (scene.tlas, scene.root) = (tree.blocks, tree.root);
        scene.bounds = tree.bounds;
        Ok(scene)
    }

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

    /// The nearest hit of every ray, on the calling thread. `hits` is as long as `rays`.
    pub fn closest(&self, rays: &[Ray], hits: &mut [Hit], coherence: Coherence) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        traverse::closest(self.dispatch, self, rays, hits, coherence);
        if let Some(mesh_ranges) = &self.mesh_ranges {
            mesh_ranges.remap_hits(
                hits.iter_mut()
                    .map(|hit| (&mut hit.instance, &mut hit.triangle)),
            );
        }
    }

    /// Whether anything lies on each ray, on the calling thread. `occluded` is as long as `rays`.
    pub fn occluded(&self, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        traverse::occluded(self.dispatch, self, rays, occluded, coherence);
    }

    /// The nearest hit of every ray by float64 arithmetic on the float64 corners: ties and edges are decided as exact
    /// geometry decides them, up to float64 rounding. On the calling thread; `hits` is as long as `rays`.
    pub fn closest_exact<T: ExactTriangles>(
        &self,
        rays: &[ExactRay],
        triangles: &T,
        hits: &mut [ExactHit],
    ) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        match &self.mesh_ranges {
            None => traverse::closest_exact(self.dispatch, self, rays, triangles, hits),
            Some(mesh_ranges) => {
                let all = FlattenedTriangles(mesh_ranges, triangles);
                traverse::closest_exact(self.dispatch, self, rays, &all, hits);
                mesh_ranges.remap_hits(
                    hits.iter_mut()
                        .map(|hit| (&mut hit.instance, &mut hit.triangle)),
                );
            }
        }
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
fn relative_padding_of(transform_condition: f32) -> f32 {
    (64.0 * transform_condition + 24.0) * MACHINE_EPSILON
}

/// LeafBuilder of the tree over subtree_refs: their number.
struct InstanceLeaves;

impl LeafBuilder for InstanceLeaves {
    const LEAVES_ARE_BLOCKS: bool = false;
    const TYPICAL_LEAF_PRIMS: usize = 1;
    type Scratch = ();

    fn begin_treelet(&self, prims: &mut [PrimRef], _notes: &mut ()) -> usize {
        prims.len()
    }

    fn fits(&self, prims: &[PrimRef], _notes: &mut ()) -> bool {
        prims.len() == 1
    }

    fn max_binary_leaf_prims(&self) -> usize {
        1
    }

    fn bin_count(&self, prims: usize) -> usize {
        if prims > TREELET_SIZE { 64 } else { 16 }
    }

    fn create_leaf(
        &self,
        prims: &[PrimRef],
        _notes: &mut (),
        _ids: &mut Vec<u32>,
        _blocks: &mut Vec<NodeBlock>,
    ) -> NodeRef {
        NodeRef::leaf(prims[0].id as usize)
    }
}

fn power_of_two_scale64(max_abs_coord: f64) -> f32 {
    power_of_two_scale((max_abs_coord as f32).min(f32::MAX))
}

/// The largest sum of the absolute values of a row of the linear part.
fn norm(m: &[[f64; 4]; 3]) -> f64 {
    m.iter()
        .map(|r| r[0].abs() + r[1].abs() + r[2].abs())
        .fold(0.0, f64::max)
}

/// The box of an instance in the scene; `None` for an empty mesh.
fn world_box(instance: &Instance) -> Option<([f64; 3], [f64; 3])> {
    if instance.bvh.triangle_count() == 0 {
        return None;
    }
    let scale = f64::from(instance.bvh.scale());
    let m = instance.world_from_mesh.map(|row| row.map(f64::from));
    let m = m.map(|r| [r[0] / scale, r[1] / scale, r[2] / scale, r[3]]);
    Some(transform_bounds(&m, instance.bvh.bounds()))
}

/// The inverse of an affine map; `None` where it is singular.
fn inverse(m: &[[f64; 4]; 3]) -> Option<[[f64; 4]; 3]> {
    let cofactor = |r: usize, c: usize| {
        let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
    };
    let det = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum::<f64>();
    if det == 0.0 {
        return None;
    }
    let mut inverse = [[0.0; 4]; 3];
    for (r, row) in inverse.iter_mut().enumerate() {
        for c in 0..3 {
            row[c] = cofactor(c, r) / det;
        }
        row[3] = -(0..3).map(|c| row[c] * m[c][3]).sum::<f64>();
    }
    Some(inverse)
}

//! Building the TLAS over the subtree references of placed instances.

use crate::aabb::Aabb;
use crate::blas::build::power_of_two_scale;
use crate::build;
use crate::build::prim_ref::PrimRef;
use crate::build::traits::{LeafBuilder, TREELET_SIZE};
use crate::error::BuildError;
use crate::limits::MAX_INSTANCES;
use crate::node::{NodeBlock, NodeRef};
use crate::platform::dispatch::Dispatch;
use crate::platform::huge_page_vec::HugePageVec;
use crate::scene::backoff::Backoff;
use crate::scene::rebraid::{InstanceTransform, rebraid, transform_bounds, whole_instances};
use crate::scene::{Instance, InstanceRecord, Scene, relative_padding_of};

/// Leaves of the TLAS: whole instances, or subtrees of instances. Hits do not depend on this choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TlasLeaves {
    /// Whole instances, which are fastest to build.
    Instances,
    /// Instances, but instances that overlap others are divided into subtrees by partial re-braiding: the fastest for
    /// many rays.
    Subtrees,
}

/// Factor that is larger than the rounding errors of [`length_scale`] and of the transforms.
const LENGTH_ROUNDING: f32 = 1.0 + 8.0 * f32::EPSILON;

impl InstanceRecord {
    /// Creates the record of an instance in scene coordinates, and its transform for re-braiding; the padding is set
    /// later. `bounds` is the mesh's AABB in the scene, `None` for an empty mesh.
    fn new(instance: Instance, bounds: Option<([f64; 3], [f64; 3])>, scale: f64) -> (Self, Option<InstanceTransform>) {
        let mesh_scale = f64::from(instance.bvh.scale());
        let forward = instance.world_from_mesh.map(|row| row.map(f64::from));
        let along = mesh_scale / scale;
        let usable = inverse(&forward)
            .map(|m| m.map(|r| [r[0] * along, r[1] * along, r[2] * along, r[3] * mesh_scale]))
            .map(|m| m.map(|row| row.map(|x| x as f32)))
            .filter(|m| m.iter().flatten().all(|x| x.is_finite()));
        // The largest sum of absolute values in a row bounds the factor by which the transform enlarges the largest
        // coordinate.
        let max_scale = usable.map_or(0.0, |m| norm(&m.map(|row| row.map(f64::from))));
        let transform = usable.and(bounds).map(|(lower, upper)| {
            let shrink = norm(&forward) * scale / mesh_scale;
            let mesh_reach = f64::from(instance.bvh.max_abs_coord()) * shrink;
            let corners = lower.iter().chain(&upper);
            let farthest = corners.fold(0.0, |r: f64, x| r.max((x * scale).abs()));
            let back = scale / mesh_scale;
            InstanceTransform {
                bvh: instance.bvh.clone(),
                scene_from_mesh: forward.map(|r| [r[0] * back, r[1] * back, r[2] * back, r[3] * scale]),
                max_abs_coord: (mesh_reach + farthest) as f32,
                condition: (max_scale * shrink) as f32,
                pad: 0.0,
            }
        });
        let mesh_from_scene = usable.unwrap_or([[0.0; 4]; 3]);
        let max_length_scale = length_scale(&mesh_from_scene.map(|row| row.map(f64::from)));
        let back = length_scale(&forward) * scale / mesh_scale;
        let translation_only = mesh_from_scene.map(|row| row[3]);
        let record = Self {
            bvh: instance.bvh,
            translation_only: (scale == 1.0 && mesh_from_scene == translation(translation_only))
                .then_some(translation_only),
            mesh_from_scene,
            max_scale: max_scale as f32,
            max_length_scale: (max_length_scale as f32) * LENGTH_ROUNDING,
            length_condition: ((max_length_scale * back) as f32) * LENGTH_ROUNDING,
        };
        (record, transform)
    }
}

impl Scene {
    /// Builds the TLAS over subtrees of instances. An instance with a singular transform is kept, and rays never hit
    /// it.
    pub fn build(instances: Vec<Instance>, origin: [f64; 3]) -> Result<Self, BuildError> {
        Self::build_over(TlasLeaves::Subtrees, instances, origin)
    }

    /// Same as [`Scene::build`] with a choice of the TLAS's leaves.
    pub fn build_over(leaves: TlasLeaves, instances: Vec<Instance>, origin: [f64; 3]) -> Result<Self, BuildError> {
        if instances.len() > MAX_INSTANCES {
            return Err(BuildError::TooLarge { what: "instances", given: instances.len(), limit: MAX_INSTANCES });
        }
        let finite = |i: &Instance| i.world_from_mesh.iter().flatten().all(|x| x.is_finite());
        if let Some(at) = instances.iter().position(|i| !finite(i)) {
            return Err(BuildError::NonFinite { what: format!("instance {at}") });
        }
        if !origin.iter().all(|x| x.is_finite()) {
            return Err(BuildError::NonFinite { what: "the scene's origin".into() });
        }
        let is_single_mesh = instances.len() == 1 && instances[0].world_from_mesh == translation([0.0; 3]);
        let boxes: Vec<_> = instances.iter().map(world_box).collect();
        let max_abs_coord64 =
            boxes.iter().flatten().flat_map(|(l, u)| l.iter().chain(u)).fold(0.0, |r: f64, x| r.max(x.abs()));
        let scale =
            f64::from(if is_single_mesh { instances[0].bvh.scale() } else { power_of_two_scale64(max_abs_coord64) });
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
                transform.pad = f64::from(relative_padding_of(transform.condition) * 2.0 * scene.max_abs_coord);
            }
        }
        if is_single_mesh {
            scene.max_abs_coord = scene.instances[0].bvh.max_abs_coord();
        }
        scene.subtree_refs = match leaves {
            TlasLeaves::Instances => whole_instances(&transforms),
            TlasLeaves::Subtrees => rebraid(&transforms),
        };
        let prims: Vec<_> = (0..).zip(&scene.subtree_refs).map(|(id, subtree)| subtree.prim_ref(id)).collect();
        let tree = build::build(scene.dispatch, prims.as_slice(), &InstanceLeaves);
        (scene.tlas, scene.root) = (tree.blocks, tree.root);
        scene.bounds = tree.bounds;
        Ok(scene)
    }
}

/// The matrix of a translation.
pub(crate) const fn translation([x, y, z]: [f32; 3]) -> [[f32; 4]; 3] {
    [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]]
}

/// Leaf builder of the TLAS: a leaf is the index of one subtree reference.
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

/// The infinity norm of the linear part: the largest row sum of absolute values.
fn norm(m: &[[f64; 4]; 3]) -> f64 {
    m.iter().map(|r| r[0].abs() + r[1].abs() + r[2].abs()).fold(0.0, f64::max)
}

/// Upper bound on the factor by which the linear part M scales a length: the square root of the infinity norm of M^T M.
/// This norm is at least the largest eigenvalue of M^T M, which is the square of the factor. Exact for rotations with
/// uniform scale.
fn length_scale(m: &[[f64; 4]; 3]) -> f64 {
    let product = |i: usize, j: usize| m.iter().map(|row| row[i] * row[j]).sum::<f64>();
    norm(&[0, 1, 2].map(|i| [product(i, 0), product(i, 1), product(i, 2), 0.0])).sqrt()
}

/// The AABB of an instance in the scene; `None` for an empty mesh.
fn world_box(instance: &Instance) -> Option<([f64; 3], [f64; 3])> {
    if instance.bvh.triangle_count() == 0 {
        return None;
    }
    let scale = f64::from(instance.bvh.scale());
    let m = instance.world_from_mesh.map(|row| row.map(f64::from));
    let m = m.map(|r| [r[0] / scale, r[1] / scale, r[2] / scale, r[3]]);
    Some(transform_bounds(&m, instance.bvh.bounds()))
}

/// The inverse of an affine map; returns `None` for a singular transform.
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

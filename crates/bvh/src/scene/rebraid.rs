//! Partial re-braiding: the TLAS is built over subtrees of instances (C. Benthin, S. Woop, I. Wald and A. Áfra,
//! "Improved Two-Level BVHs using Partial Re-Braiding", HPG 2017).
//!
//! A ray that meets overlapping AABBs enters these instances' BLASes one after the other. For overlapping instances,
//! the top nodes of a BLAS replace its root as leaves of the TLAS. The TLAS then separates and orders the parts of the
//! instances. Hits do not change.

use std::sync::Arc;

use crate::aabb::Aabb;
use crate::blas::Bvh;
use crate::build::prim_ref::PrimRef;
use crate::node::{NodeRef, node};

/// A reference to a subtree of an instance: a leaf of the TLAS.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SubtreeRef {
    pub instance: u32,
    /// The root of the subtree.
    pub node: NodeRef,
    /// The subtree's bounds in scaled scene coordinates, padded unless the instance is only translated.
    pub bounds: Aabb,
}

/// Minimum mean number of triangles per reference.
const MIN_TRIANGLES_PER_REF: usize = 64;

/// Maximum number of references, which limits the build time of the TLAS.
const MAX_REFS: usize = 1 << 14;

/// Minimum number of references per instance; fewer do not separate instances.
const MIN_REFS_PER_INSTANCE: usize = 4;

/// Fraction of a subtree's area inside other instances above which it is opened.
const MIN_OVERLAP: f32 = 0.1;

/// Number of references per additional thread.
const PARALLEL_THRESHOLD: usize = 1 << 10;

/// The transform of an instance, for the bounds of its subtrees.
pub(crate) struct InstanceTransform {
    pub bvh: Arc<Bvh>,
    /// Transform from tree coordinates of the mesh to scaled scene coordinates.
    pub scene_from_mesh: [[f64; 4]; 3],
    /// Largest absolute coordinate in the computation of the bounds.
    pub max_abs_coord: f32,
    /// The condition number: the factor by which the transform amplifies rounding errors.
    pub condition: f32,
    /// The padding of boxes in scaled scene coordinates.
    pub pad: f64,
}

/// Subtree references over which the TLAS is built. Instances without a transform get no reference, because rays cannot
/// hit them.
pub(crate) fn rebraid(transforms: &[Option<InstanceTransform>]) -> Vec<SubtreeRef> {
    let whole = whole_instances(transforms);
    let triangles = transforms.iter().flatten().map(|transform| transform.bvh.triangle_count());
    let room = (triangles.sum::<usize>() / MIN_TRIANGLES_PER_REF).min(MAX_REFS);
    if whole.len() < 2 || room / whole.len() < MIN_REFS_PER_INSTANCE {
        return whole;
    }
    let mut refs = open_recursive(transforms, whole, room);
    refs.sort_unstable_by_key(|subtree| (subtree.instance, subtree.node));
    refs
}

/// One reference to each instance as a whole.
pub(crate) fn whole_instances(transforms: &[Option<InstanceTransform>]) -> Vec<SubtreeRef> {
    let whole = |(instance, transform): (u32, &Option<InstanceTransform>)| {
        let transform = transform.as_ref()?;
        let bvh = &transform.bvh;
        Some(transform.subtree_ref(instance, bvh.root(), bvh.bounds()))
    };
    (0..).zip(transforms).filter_map(whole).collect()
}

/// Opens the references of a group that overlap other instances, then recurses on both sides of the group's centre. The
/// group may grow up to `room` references.
fn open_recursive(
    transforms: &[Option<InstanceTransform>],
    mut group: Vec<SubtreeRef>,
    room: usize,
) -> Vec<SubtreeRef> {
    if group.iter().all(|subtree| subtree.instance == group[0].instance) {
        return group;
    }
    let others = BoundsOfOthers::from_refs(&group);
    for i in 0..group.len() {
        let subtree = group[i];
        if overlap_fraction(&subtree.bounds, &others.without(subtree.instance)) < MIN_OVERLAP {
            continue;
        }
        if let Some(children) = open(transforms, &subtree)
            && group.len() + children.len() - 1 <= room
        {
            group[i] = children[0];
            group.extend_from_slice(&children[1..]);
        }
    }
    let Some(second) = split_at_center(&mut group) else { return group };
    let count = group.len() + second.len();
    let own = room * group.len() / count;
    let both = (|| open_recursive(transforms, group, own), || open_recursive(transforms, second, room - own));
    let (mut refs, others) = match count > PARALLEL_THRESHOLD {
        true => rayon::join(both.0, both.1),
        false => (both.0(), both.1()),
    };
    refs.extend(others);
    refs
}

/// Splits off the references beyond the centre of a group along its longest axis; returns `None` if one side is empty.
fn split_at_center(group: &mut Vec<SubtreeRef>) -> Option<Vec<SubtreeRef>> {
    let twice = |subtree: &SubtreeRef, axis: usize| subtree.bounds.lower[axis] + subtree.bounds.upper[axis];
    let ends = |axis: usize| {
        let centers = group.iter().map(|subtree| twice(subtree, axis));
        centers.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, u), c| (l.min(c), u.max(c)))
    };
    let length = |axis: &usize| {
        let (lower, upper) = ends(*axis);
        upper - lower
    };
    let axis = (0..3).max_by(|a, b| length(a).total_cmp(&length(b)))?;
    let (lower, upper) = ends(axis);
    let middle = lower + (upper - lower) / 2.0;
    let (first, second): (Vec<_>, Vec<_>) = group.iter().partition(|subtree| twice(subtree, axis) <= middle);
    if first.is_empty() || second.is_empty() {
        return None;
    }
    *group = first;
    Some(second)
}

/// Bounds of all subtree references in a group, except the references to one instance. For each side and axis: the
/// extreme value, its instance, and the most extreme value of all other instances.
struct BoundsOfOthers {
    farthest: [[(f32, u32, f32); 3]; 2],
}

impl BoundsOfOthers {
    fn from_refs(group: &[SubtreeRef]) -> BoundsOfOthers {
        let mut farthest = [[(f32::NEG_INFINITY, u32::MAX, f32::NEG_INFINITY); 3]; 2];
        for subtree in group {
            for (side, bounds) in farthest.iter_mut().enumerate() {
                for (axis, (first, whose, second)) in bounds.iter_mut().enumerate() {
                    let out = SIDE_SIGN[side] * subtree.bounds.plane(2 * axis + side);
                    if *whose == subtree.instance {
                        *first = first.max(out);
                    } else if out > *first {
                        (*second, *first, *whose) = (*first, out, subtree.instance);
                    } else {
                        *second = second.max(out);
                    }
                }
            }
        }
        BoundsOfOthers { farthest }
    }

    /// The bounds of all references to instances other than `instance`.
    fn without(&self, instance: u32) -> Aabb {
        let [lower, upper] = [0, 1].map(|side: usize| {
            self.farthest[side]
                .map(|(first, whose, second)| SIDE_SIGN[side] * if whose == instance { second } else { first })
        });
        Aabb { lower, upper }
    }
}

/// Sign of the outward direction along an axis, for the lower and for the upper corner.
const SIDE_SIGN: [f32; 2] = [-1.0, 1.0];

/// The surface area of the intersection of two boxes, as a fraction of the first box's area.
fn overlap_fraction(subtree: &Aabb, other: &Aabb) -> f32 {
    let lower = std::array::from_fn(|axis| subtree.lower[axis].max(other.lower[axis]));
    let upper: [f32; 3] = std::array::from_fn(|axis| subtree.upper[axis].min(other.upper[axis]));
    let apart = (0..3).any(|axis| lower[axis] > upper[axis]);
    let whole = subtree.half_area();
    if apart || whole <= 0.0 { 0.0 } else { Aabb { lower, upper }.half_area() / whole }
}

/// The children of a subtree; `None` if it contains only a few triangles.
fn open(transforms: &[Option<InstanceTransform>], subtree: &SubtreeRef) -> Option<Vec<SubtreeRef>> {
    let transform = transforms.get(subtree.instance as usize)?.as_ref()?;
    if subtree.node.is_leaf() {
        return None;
    }
    let node = node(transform.bvh.blocks(), subtree.node);
    let children = &node.children[..node.child_count as usize];
    if children.iter().all(|child| child.is_leaf()) {
        return None;
    }
    let child =
        |(lane, &start): (usize, &NodeRef)| transform.subtree_ref(subtree.instance, start, &node.child_bounds(lane));
    Some(children.iter().enumerate().map(child).collect())
}

impl InstanceTransform {
    /// The reference to a node or leaf of the instance, whose bounds in the mesh are `extent`.
    fn subtree_ref(&self, instance: u32, start: NodeRef, extent: &Aabb) -> SubtreeRef {
        let (lower, upper) = transform_bounds(&self.scene_from_mesh, extent);
        let bounds = Aabb {
            lower: lower.map(|x| ((x - self.pad) as f32).next_down()),
            upper: upper.map(|x| ((x + self.pad) as f32).next_up()),
        };
        SubtreeRef { instance, node: start, bounds }
    }
}

impl SubtreeRef {
    pub fn prim_ref(&self, id: u32) -> PrimRef {
        let Aabb { lower, upper } = self.bounds;
        PrimRef::new(lower, upper, id)
    }
}

/// The AABB of an affinely transformed box.
pub(crate) fn transform_bounds(m: &[[f64; 4]; 3], extent: &Aabb) -> ([f64; 3], [f64; 3]) {
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    for axis in 0..3 {
        low[axis] = m[axis][3];
        high[axis] = m[axis][3];
        for k in 0..3 {
            let (a, b) = (m[axis][k] * f64::from(extent.lower[k]), m[axis][k] * f64::from(extent.upper[k]));
            low[axis] += a.min(b);
            high[axis] += a.max(b);
        }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::leaf;

    /// Small triangles along a line, in runs of 250 triangles. Of every `every` runs, the mesh contains the run with
    /// index `first`.
    fn beads(first: usize, every: usize, lift: f32) -> InstanceTransform {
        let at = |i: usize| [i as f32 * 0.01, lift, (i % 7) as f32 * 0.001];
        let chosen = (0..8000).filter(|i| i / 250 % every == first);
        let mut vertices = vec![];
        for i in chosen {
            let [x, y, z] = at(i);
            vertices.extend([[x, y, z], [x + 0.005, y, z], [x, y + 0.005, z]]);
        }
        let count = vertices.len() as u32 / 3;
        let triangles: Vec<_> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let bvh = Bvh::build(&vertices, &triangles).unwrap();
        let scale = f64::from(bvh.scale());
        // The instance is rotated by a quarter turn and moved.
        InstanceTransform {
            bvh: Arc::new(bvh),
            scene_from_mesh: [
                [0.0, -1.0 / scale, 0.0, 5.0],
                [1.0 / scale, 0.0, 0.0, -3.0],
                [0.0, 0.0, 1.0 / scale, 2.0],
            ],
            max_abs_coord: 100.0,
            condition: 1.0,
            pad: 1e-4,
        }
    }

    /// Leaves of a subtree: the number of their first triangle, their number of triangles, and their box.
    fn leaves(bvh: &Bvh, start: NodeRef, found: &mut Vec<(u32, u32, [f32; 6])>) {
        if start.is_leaf() {
            let leaf = leaf(bvh.blocks(), start);
            found.push((leaf.first_prim, leaf.count, leaf.bounds));
            return;
        }
        let node = node(bvh.blocks(), start);
        for child in &node.children[..node.child_count as usize] {
            leaves(bvh, *child, found);
        }
    }

    #[test]
    fn every_triangle_is_in_exactly_one_subtree_and_its_box() {
        let transforms: Vec<_> = (0..3).map(|i| Some(beads(i, 3, 0.0))).collect();
        let refs = rebraid(&transforms);
        assert!(refs.len() > 60, "{}", refs.len());
        for (instance, transform) in transforms.iter().flatten().enumerate() {
            let own = refs.iter().filter(|p| p.instance == instance as u32);
            let mut numbers = vec![];
            for subtree in own {
                let mut found = vec![];
                leaves(&transform.bvh, subtree.node, &mut found);
                for (first, count, b) in found {
                    numbers.extend(first..first + count);
                    let (lower, upper) = ([b[0], b[2], b[4]], [b[1], b[3], b[5]]);
                    let leaf = transform.subtree_ref(0, NodeRef::EMPTY, &Aabb { lower, upper }).bounds;
                    for (side, axis) in (0..6).map(|row| (row % 2, row / 2)) {
                        let beyond = leaf.plane(2 * axis + side) - subtree.bounds.plane(2 * axis + side);
                        let beyond = SIDE_SIGN[side] * beyond;
                        assert!(
                            beyond <= 0.0,
                            "side {side}, axis {axis}: a triangle extends {beyond} beyond its subtree's box"
                        );
                    }
                }
            }
            numbers.sort_unstable();
            assert!(numbers.into_iter().eq(0..transform.bvh.triangle_count() as u32));
        }
    }

    #[test]
    fn interlocking_meshes_are_split_into_parts() {
        let transforms: Vec<_> = (0..3).map(|i| Some(beads(i, 3, 0.0))).collect();
        let refs = rebraid(&transforms);
        let apart = refs.iter().filter(|a| {
            let others = refs.iter().filter(|b| b.instance != a.instance);
            others.map(|b| overlap_fraction(&a.bounds, &b.bounds)).sum::<f32>() < MIN_OVERLAP
        });
        let apart = apart.count();
        assert!(4 * apart > 3 * refs.len(), "{apart} of {}", refs.len());
    }

    #[test]
    fn adjacent_meshes_are_not_split() {
        let transforms = [Some(beads(0, 1, 0.0)), None, Some(beads(0, 1, 0.1))];
        let whole = rebraid(&transforms);
        let instances: Vec<_> = whole.iter().map(|subtree| subtree.instance).collect();
        assert_eq!(instances, [0, 2]);
    }
}

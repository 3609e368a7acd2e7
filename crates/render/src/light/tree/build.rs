//! Build of the light tree: top-down splits by the surface area orientation heuristic (SAOH).

use glam::Vec3;
use rayon::prelude::*;

use crate::light::bounds::LightBounds;
use crate::light::tree::node::{Child, LightTreeNode};
use crate::soa::LANES;

/// Group of lights that becomes one child of a node: the end of its index range, and its approximate cost.
struct ChildGroup {
    end: usize,
    cost: f32,
}

/// Maximum number of lights of a group that a split inspects.
const MAX_SAMPLED_LIGHTS: usize = 1 << 9;

/// Number of lights above which children are built in parallel.
const PARALLEL_THRESHOLD: usize = 1 << 12;

/// Depth from which on groups of lights are halved by count, so that the tree's depth grows only with the
/// logarithm of the number of lights.
const MAX_SAH_DEPTH: u32 = 8;

/// Builds the node of a group, which may be reordered, followed by its descendants; `depth` is the number of
/// ancestors.
pub(crate) fn build_node(lights: &[LightBounds], group: &mut [u32], depth: u32) -> Vec<LightTreeNode> {
    let ends = match group.len() <= LANES {
        true => split_all(lights, group),
        false => split_groups(lights, group, depth < MAX_SAH_DEPTH),
    };
    let many = group.len() > PARALLEL_THRESHOLD;
    let (mut rest, mut start) = (group, 0);
    let mut groups = vec![];
    for end in ends {
        let part;
        (part, rest) = rest.split_at_mut(end - start);
        start = end;
        groups.push(part);
    }
    let child = |group: &mut [u32]| {
        let below = match group.len() {
            1 => vec![],
            _ => build_node(lights, group, depth + 1),
        };
        (union_of(lights, group.iter().copied()), group[0], below)
    };
    let children: Vec<_> = match many {
        true => groups.into_par_iter().map(child).collect(),
        false => groups.into_iter().map(child).collect(),
    };
    let mut nodes = vec![LightTreeNode::new()];
    for (bounds, first, mut below) in children {
        // Child indices are relative to the subtree until its position is known.
        let start = nodes.len();
        let child = match below.is_empty() {
            true => Child::Light(first),
            false => Child::Node(start as u32),
        };
        nodes[0].push_child(&bounds, child);
        below.iter_mut().for_each(|node| node.offset_children(start));
        nodes.append(&mut below);
    }
    nodes
}

/// Common bounds of several lights, given by their indices.
pub(crate) fn union_of(lights: &[LightBounds], some: impl Iterator<Item = u32>) -> LightBounds {
    let bounds = some.map(|i| lights[i as usize]);
    bounds.reduce(|a, b| a.union(&b)).unwrap_or_default()
}

/// About [`MAX_SAMPLED_LIGHTS`] lights of a group, or all lights of a small group. The stride is odd, so that in
/// regular scenes not all samples are on one side.
fn subsample(group: &[u32]) -> impl Iterator<Item = u32> + Clone {
    group.iter().copied().step_by((group.len() / MAX_SAMPLED_LIGHTS) | 1)
}

/// Sorts the lights of a group along the group's longest axis, and makes each light a child. Returns the ends of the
/// children's ranges.
fn split_all(lights: &[LightBounds], group: &mut [u32]) -> Vec<usize> {
    let center = |i: u32| lights[i as usize].center();
    let (low, high) = position_bounds(group.iter().map(|&i| center(i)));
    let axis = (high - low).max_position();
    group.sort_by(|&a, &b| center(a)[axis].total_cmp(&center(b)[axis]));
    (1..=group.len()).collect()
}

/// Repeatedly splits the most expensive group of a node until the node is full. Without `planes`, groups are split by
/// count. Returns the ends of the groups' ranges.
fn split_groups(lights: &[LightBounds], group: &mut [u32], planes: bool) -> Vec<usize> {
    let part = |group: &[u32], end: usize| {
        let some = subsample(group);
        let share = group.len() as f32 / some.clone().count() as f32;
        let cost = if planes { share * union_of(lights, some).saoh_cost() } else { 0.0 };
        ChildGroup { end, cost }
    };
    let mut parts = vec![part(group, group.len())];
    while parts.len() < LANES {
        let (mut most, mut start) = (None::<(f32, usize, usize, usize)>, 0);
        for (i, &ChildGroup { end, cost }) in parts.iter().enumerate() {
            let count = end - start;
            if count > 1 && most.is_none_or(|(c, n, ..)| (cost, count) > (c, n)) {
                most = Some((cost, count, i, start));
            }
            start = end;
        }
        let Some((_, count, i, start)) = most else {
            break;
        };
        let whole = &mut group[start..start + count];
        let middle = split(lights, whole, planes);
        let (left, right) = whole.split_at(middle);
        parts[i] = part(right, start + count);
        parts.insert(i, part(left, start + middle));
    }
    parts.into_iter().map(|part| part.end).collect()
}

/// Bounding box of points.
fn position_bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)))
}

/// Splits a group at the cheapest of eleven planes along each axis, or by count without `planes`. Returns the start
/// of the second half.
fn split(lights: &[LightBounds], group: &mut [u32], planes: bool) -> usize {
    const BINS: usize = 12;
    let half = group.len() / 2;
    let center = |i: u32| lights[i as usize].center();
    let (low, high) = position_bounds(subsample(group).map(center));
    let size = high - low;
    if !planes || size.max_element() <= 0.0 {
        return half;
    }
    // Lights outside the sampled box belong to the first or the last bin.
    let scale = BINS as f32 / size;
    let bin = |i: u32, axis: usize| {
        let place = (center(i)[axis] - low[axis]) * scale[axis];
        (place as usize).min(BINS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| size[axis] > 0.0) {
        // Empty bins have no power and do not widen the bounds.
        let mut bins = [LightBounds::default(); BINS];
        for i in subsample(group) {
            let bin = &mut bins[bin(i, axis)];
            *bin = bin.union(&lights[i as usize]);
        }
        // The cost of a split across a thin side is increased, so that thin boxes are split along their length.
        let stretch = size.max_element() / size[axis];
        // For each plane, the bounds of all lights behind it.
        let mut behind = bins;
        for plane in (1..BINS - 1).rev() {
            behind[plane] = behind[plane].union(&behind[plane + 1]);
        }
        let mut before = LightBounds::default();
        for plane in 1..BINS {
            before = before.union(&bins[plane - 1]);
            // If a bin is empty, this plane divides the lights in the same way as the previous plane.
            if bins[plane - 1].phi == 0.0 || behind[plane].phi == 0.0 {
                continue;
            }
            let cost = stretch * (before.saoh_cost() + behind[plane].saoh_cost());
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, plane));
            }
        }
    }
    let Some((_, axis, plane)) = best else {
        return half;
    };
    // The partition is stable, so that the tree depends only on the order of the lights.
    let (left, right): (Vec<u32>, Vec<u32>) = group.iter().partition(|&&i| bin(i, axis) < plane);
    let (front, back) = group.split_at_mut(left.len());
    front.copy_from_slice(&left);
    back.copy_from_slice(&right);
    left.len()
}

//! How the tree over lights is built: groups are parted where the surface area orientation heuristic costs least.

use glam::Vec3;
use rayon::prelude::*;

use crate::light::bounds::LightBounds;
use crate::light::tree::node::{Child, LightTreeNode};
use crate::soa::LANES;

/// Lights of a node that is being built, up to an end, for one child: about what they cost together.
struct ChildGroup {
    end: usize,
    cost: f32,
}

/// Of more lights than this only some are looked at to see where they are parted.
const MAX_SAMPLED_LIGHTS: usize = 1 << 9;

/// Groups of more lights are divided among threads.
const PARALLEL_THRESHOLD: usize = 1 << 12;

/// Below so many nodes, lights are halved by number: then trees are not deeper than lights are many.
const MAX_SAH_DEPTH: u32 = 8;

/// The node of a group, which may be reordered, and behind it all below it; `depth` nodes are above.
pub(crate) fn build_node(
    lights: &[LightBounds],
    group: &mut [u32],
    depth: u32,
) -> Vec<LightTreeNode> {
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
        // Its nodes are counted from its own start until all before it are known.
        let start = nodes.len();
        let child = match below.is_empty() {
            true => Child::Light(first),
            false => Child::Node(start as u32),
        };
        nodes[0].push_child(&bounds, child);
        below
            .iter_mut()
            .for_each(|node| node.offset_children(start));
        nodes.append(&mut below);
    }
    nodes
}

/// Around some lights.
pub(crate) fn union_of(lights: &[LightBounds], some: impl Iterator<Item = u32>) -> LightBounds {
    let bounds = some.map(|i| lights[i as usize]);
    bounds.reduce(|a, b| a.union(&b)).unwrap_or_default()
}

/// About [`MAX_SAMPLED_LIGHTS`] of a group, or all of them. Every so many: an odd number, or of houses it would always be one wall.
fn subsample(group: &[u32]) -> impl Iterator<Item = u32> + Clone {
    group
        .iter()
        .copied()
        .step_by((group.len() / MAX_SAMPLED_LIGHTS) | 1)
}

/// Sorts a group along the axis along which it is longest: a part for each light, as where it ends.
fn split_all(lights: &[LightBounds], group: &mut [u32]) -> Vec<usize> {
    let center = |i: u32| lights[i as usize].center();
    let (low, high) = position_bounds(group.iter().map(|&i| center(i)));
    let axis = (high - low).max_position();
    group.sort_by(|&a, &b| center(a)[axis].total_cmp(&center(b)[axis]));
    (1..=group.len()).collect()
}

/// Halves a group, and always the part that costs most, as long as a node has places; by number where it has no planes.
/// Where the parts end.
fn split_groups(lights: &[LightBounds], group: &mut [u32], planes: bool) -> Vec<usize> {
    let part = |group: &[u32], end: usize| {
        let some = subsample(group);
        let share = group.len() as f32 / some.clone().count() as f32;
        let cost = if planes {
            share * union_of(lights, some).saoh_cost()
        } else {
            0.0
        };
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

/// The lower and the upper corner of the box of some points.
fn position_bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold(
        (Vec3::INFINITY, Vec3::NEG_INFINITY),
        |(low, high), point| (low.min(point), high.max(point)),
    )
}

/// Parts a group in two by the cheapest of twelve planes along each axis, or by number where it has no planes, and says
/// where the second part begins.
fn split(lights: &[LightBounds], group: &mut [u32], planes: bool) -> usize {
    const BINS: usize = 12;
    let half = group.len() / 2;
    let center = |i: u32| lights[i as usize].center();
    let (low, high) = position_bounds(subsample(group).map(center));
    let size = high - low;
    if !planes || size.max_element() <= 0.0 {
        return half;
    }
    // What is outside, of those that were not looked at, is in the first or the last.
    let scale = BINS as f32 / size;
    let bin = |i: u32, axis: usize| {
        let place = (center(i)[axis] - low[axis]) * scale[axis];
        (place as usize).min(BINS - 1)
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| size[axis] > 0.0) {
        // What is empty is dark, which has no say.
        let mut bins = [LightBounds::default(); BINS];
        for i in subsample(group) {
            let bin = &mut bins[bin(i, axis)];
            *bin = bin.union(&lights[i as usize]);
        }
        // Thin boxes are cheap to cut along their length alone.
        let stretch = size.max_element() / size[axis];
        // What is behind each plane.
        let mut behind = bins;
        for plane in (1..BINS - 1).rev() {
            behind[plane] = behind[plane].union(&behind[plane + 1]);
        }
        let mut before = LightBounds::default();
        for plane in 1..BINS {
            before = before.union(&bins[plane - 1]);
            // Behind an empty bin it is the plane before it once more.
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
    // In order: the tree depends on the order of the lights alone.
    let (left, right): (Vec<u32>, Vec<u32>) = group.iter().partition(|&&i| bin(i, axis) < plane);
    let (front, back) = group.split_at_mut(left.len());
    front.copy_from_slice(&left);
    back.copy_from_slice(&right);
    left.len()
}

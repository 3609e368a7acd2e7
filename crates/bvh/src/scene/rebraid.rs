//! What the tree over instances is made of: whole meshes, or parts of meshes that are in each other's way.
//!
//! Where the boxes of placed meshes overlap, a ray enters all of them, one tree after the other. So the nodes at the top
//! of such meshes take the place of the mesh in the tree over instances, which sorts out what lies where and which comes
//! first (C. Benthin, S. Woop, I. Wald and A. Áfra, "Improved Two-Level BVHs using Partial Re-Braiding", HPG 2017).
//! What a ray meets does not depend on it.

use std::sync::Arc;

use crate::blas::Bvh;
use crate::blas::bounding_boxes::{Corners, area};
use crate::build::BuildItem;
use crate::node::{LEAF, node};
use crate::traverse::trav_ray::Extent;

/// Everything at and below a node or leaf of a placed mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub instance: u32,
    /// Reference of the node or leaf.
    pub start: u32,
    /// Its box in scaled scene coordinates, padded where the mesh is more than moved.
    pub corners: Corners,
}

/// A part has so many triangles or more, in the mean...
const TRIANGLES: usize = 64;

/// ... and there are no more parts than these: sorting them takes its time.
const MOST: usize = 1 << 14;

/// Meshes are opened where there may be so many parts for each; fewer do not separate them.
const WORTH_IT: usize = 4;

/// A part is opened where this share of its box, or more, is in the box of others.
const SHARED: f32 = 0.1;

/// A group of so many parts is worth another thread.
const PARALLEL: usize = 1 << 10;

/// How a mesh that rays can meet is placed, as its boxes and their pads are made.
pub(crate) struct Placement {
    pub bvh: Arc<Bvh>,
    /// From the coordinates of the mesh's tree to scaled scene coordinates.
    pub scene_from_mesh: [[f64; 4]; 3],
    /// The largest coordinate at hand on the way there.
    pub reach: f32,
    /// How much larger its transform makes what is rounded.
    pub condition: f32,
    /// How far its boxes are padded there.
    pub pad: f64,
}

/// The parts to build a tree over; `None` for a mesh that no ray can meet.
pub(crate) fn parts(placements: &[Option<Placement>]) -> Vec<Part> {
    let whole = |(instance, placement): (u32, &Option<Placement>)| {
        let placement = placement.as_ref()?;
        let bvh = &placement.bvh;
        Some(placement.part(instance, bvh.root(), bvh.extent()))
    };
    let whole: Vec<Part> = (0..).zip(placements).filter_map(whole).collect();
    let triangles = placements
        .iter()
        .flatten()
        .map(|placement| placement.bvh.triangle_count());
    let room = (triangles.sum::<usize>() / TRIANGLES).min(MOST);
    if whole.len() < 2 || room / whole.len() < WORTH_IT {
        return whole;
    }
    let mut parts = divide(placements, whole, room);
    parts.sort_unstable_by_key(|part| (part.instance, part.start));
    parts
}

/// Opens those of a group that are in the way of others, then the same on both sides of the group's middle. The group
/// may become as many parts as there is room for.
fn divide(placements: &[Option<Placement>], mut group: Vec<Part>, room: usize) -> Vec<Part> {
    if group.iter().all(|part| part.instance == group[0].instance) {
        return group;
    }
    let others = Others::of(&group);
    for i in 0..group.len() {
        let part = group[i];
        if shared(&part.corners, &others.around(part.instance)) < SHARED {
            continue;
        }
        if let Some(children) = children(placements, &part)
            && group.len() + children.len() - 1 <= room
        {
            group[i] = children[0];
            group.extend_from_slice(&children[1..]);
        }
    }
    let Some(second) = halve(&mut group) else {
        return group;
    };
    let count = group.len() + second.len();
    let own = room * group.len() / count;
    let both = (
        || divide(placements, group, own),
        || divide(placements, second, room - own),
    );
    let (mut parts, others) = match count > PARALLEL {
        true => rayon::join(both.0, both.1),
        false => (both.0(), both.1()),
    };
    parts.extend(others);
    parts
}

/// Takes out what lies beyond the middle of a group, along the axis on which it is longest; `None` where nothing or all
/// does.
fn halve(group: &mut Vec<Part>) -> Option<Vec<Part>> {
    let twice = |part: &Part, axis: usize| part.corners[0][axis] + part.corners[1][axis];
    let ends = |axis: usize| {
        let centers = group.iter().map(|part| twice(part, axis));
        centers.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, u), c| {
            (l.min(c), u.max(c))
        })
    };
    let length = |axis: &usize| {
        let (lower, upper) = ends(*axis);
        upper - lower
    };
    let axis = (0..3).max_by(|a, b| length(a).total_cmp(&length(b)))?;
    let (lower, upper) = ends(axis);
    let middle = lower + (upper - lower) / 2.0;
    let (first, second): (Vec<_>, Vec<_>) =
        group.iter().partition(|part| twice(part, axis) <= middle);
    if first.is_empty() || second.is_empty() {
        return None;
    }
    *group = first;
    Some(second)
}

/// What is around all parts of a group but those of one instance: of each bound the farthest, whose it is, and the
/// farthest of all others.
struct Others {
    farthest: [[(f32, u32, f32); 3]; 2],
}

impl Others {
    fn of(group: &[Part]) -> Others {
        let mut farthest = [[(f32::NEG_INFINITY, u32::MAX, f32::NEG_INFINITY); 3]; 2];
        for part in group {
            for (side, bounds) in farthest.iter_mut().enumerate() {
                for (axis, (first, whose, second)) in bounds.iter_mut().enumerate() {
                    let out = OUTWARDS[side] * part.corners[side][axis];
                    if *whose == part.instance {
                        *first = first.max(out);
                    } else if out > *first {
                        (*second, *first, *whose) = (*first, out, part.instance);
                    } else {
                        *second = second.max(out);
                    }
                }
            }
        }
        Others { farthest }
    }

    /// The box of all that is not this instance's.
    fn around(&self, instance: u32) -> Corners {
        [0, 1].map(|side: usize| {
            self.farthest[side].map(|(first, whose, second)| {
                OUTWARDS[side] * if whose == instance { second } else { first }
            })
        })
    }
}

/// Which way is out of a box at its lower and at its upper corner.
const OUTWARDS: [f32; 2] = [-1.0, 1.0];

/// How much of the surface of a box is in another one.
fn shared(part: &Corners, other: &Corners) -> f32 {
    let lower = std::array::from_fn(|axis| part[0][axis].max(other[0][axis]));
    let upper: [f32; 3] = std::array::from_fn(|axis| part[1][axis].min(other[1][axis]));
    let apart = (0..3).any(|axis| lower[axis] > upper[axis]);
    let whole = area(part);
    if apart || whole <= 0.0 {
        0.0
    } else {
        area(&[lower, upper]) / whole
    }
}

/// The parts that a part consists of, if it is more than a few triangles.
fn children(placements: &[Option<Placement>], part: &Part) -> Option<Vec<Part>> {
    let placement = placements.get(part.instance as usize)?.as_ref()?;
    if part.start & LEAF != 0 {
        return None;
    }
    let node = node(placement.bvh.blocks(), part.start);
    let children = &node.child[..node.children as usize];
    if children.iter().all(|child| child & LEAF != 0) {
        return None;
    }
    let child = |(lane, &start): (usize, &u32)| {
        let (lower, upper) = node.child_bounds(lane);
        placement.part(part.instance, start, &Extent { lower, upper })
    };
    Some(children.iter().enumerate().map(child).collect())
}

impl Placement {
    /// What is at and below a node or leaf, whose box that is in the mesh's tree.
    fn part(&self, instance: u32, start: u32, extent: &Extent) -> Part {
        let (lower, upper) = box_of(&self.scene_from_mesh, extent);
        let corners = [
            lower.map(|x| ((x - self.pad) as f32).next_down()),
            upper.map(|x| ((x + self.pad) as f32).next_up()),
        ];
        Part {
            instance,
            start,
            corners,
        }
    }
}

impl Part {
    pub fn item(&self, id: u32) -> BuildItem {
        let [lower, upper] = self.corners;
        BuildItem::new(lower, upper, id)
    }
}

/// The box of a box that an affine map takes elsewhere.
pub(crate) fn box_of(m: &[[f64; 4]; 3], extent: &Extent) -> ([f64; 3], [f64; 3]) {
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    for axis in 0..3 {
        low[axis] = m[axis][3];
        high[axis] = m[axis][3];
        for k in 0..3 {
            let (a, b) = (
                m[axis][k] * f64::from(extent.lower[k]),
                m[axis][k] * f64::from(extent.upper[k]),
            );
            low[axis] += a.min(b);
            high[axis] += a.max(b);
        }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BuildOptions;
    use crate::node::leaf;

    /// Small triangles along a line: of `every` 250 of them, the run that `first` says.
    fn beads(first: usize, every: usize, lift: f32) -> Placement {
        let at = |i: usize| [i as f32 * 0.01, lift, (i % 7) as f32 * 0.001];
        let chosen = (0..8000).filter(|i| i / 250 % every == first);
        let mut vertices = vec![];
        for i in chosen {
            let [x, y, z] = at(i);
            vertices.extend([[x, y, z], [x + 0.005, y, z], [x, y + 0.005, z]]);
        }
        let count = vertices.len() as u32 / 3;
        let triangles: Vec<_> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let bvh = Bvh::build(&vertices, &triangles, &BuildOptions::default()).unwrap();
        let scale = f64::from(bvh.scale());
        // Turned by a quarter and moved.
        Placement {
            bvh: Arc::new(bvh),
            scene_from_mesh: [
                [0.0, -1.0 / scale, 0.0, 5.0],
                [1.0 / scale, 0.0, 0.0, -3.0],
                [0.0, 0.0, 1.0 / scale, 2.0],
            ],
            reach: 100.0,
            condition: 1.0,
            pad: 1e-4,
        }
    }

    /// The leaves of a part: the number of the first of their triangles, with how many there are, and their box.
    fn leaves(bvh: &Bvh, start: u32, found: &mut Vec<(u32, u32, [f32; 6])>) {
        if start & LEAF != 0 {
            let leaf = leaf(bvh.blocks(), start);
            found.push((leaf.first, leaf.count, leaf.bounds));
            return;
        }
        let node = node(bvh.blocks(), start);
        for child in &node.child[..node.children as usize] {
            leaves(bvh, *child, found);
        }
    }

    #[test]
    fn every_triangle_is_in_one_part_and_in_its_box() {
        let placements: Vec<_> = (0..3).map(|i| Some(beads(i, 3, 0.0))).collect();
        let parts = parts(&placements);
        assert!(parts.len() > 60, "{}", parts.len());
        for (instance, placement) in placements.iter().flatten().enumerate() {
            let own = parts.iter().filter(|p| p.instance == instance as u32);
            let mut numbers = vec![];
            for part in own {
                let mut found = vec![];
                leaves(&placement.bvh, part.start, &mut found);
                for (first, count, b) in found {
                    numbers.extend(first..first + count);
                    let (lower, upper) = ([b[0], b[2], b[4]], [b[1], b[3], b[5]]);
                    let leaf = placement.part(0, 0, &Extent { lower, upper }).corners;
                    for (side, axis) in (0..6).map(|row| (row % 2, row / 2)) {
                        let beyond = leaf[side][axis] - part.corners[side][axis];
                        let beyond = OUTWARDS[side] * beyond;
                        assert!(
                            beyond <= 0.0,
                            "side {side}, axis {axis} of a part: {beyond}"
                        );
                    }
                }
            }
            numbers.sort_unstable();
            assert!(
                numbers
                    .into_iter()
                    .eq(0..placement.bvh.triangle_count() as u32)
            );
        }
    }

    #[test]
    fn parts_of_meshes_that_interlock_come_apart() {
        let placements: Vec<_> = (0..3).map(|i| Some(beads(i, 3, 0.0))).collect();
        let parts = parts(&placements);
        let apart = parts.iter().filter(|a| {
            let others = parts.iter().filter(|b| b.instance != a.instance);
            others.map(|b| shared(&a.corners, &b.corners)).sum::<f32>() < SHARED
        });
        let apart = apart.count();
        assert!(4 * apart > 3 * parts.len(), "{apart} of {}", parts.len());
    }

    #[test]
    fn meshes_beside_each_other_stay_whole() {
        let placements = [Some(beads(0, 1, 0.0)), None, Some(beads(0, 1, 0.1))];
        let whole = parts(&placements);
        let instances: Vec<_> = whole.iter().map(|part| part.instance).collect();
        assert_eq!(instances, [0, 2]);
    }
}

//! What the tree over instances is made of: whole meshes, or parts of meshes that are in each other's way.
//!
//! Where the boxes of placed meshes overlap, a ray enters all of them, one tree after the other. So the nodes at the top
//! of such meshes take the place of the mesh in the tree over instances, which sorts out what lies where and which comes
//! first (C. Benthin, S. Woop, I. Wald and A. Áfra, "Improved Two-Level BVHs using Partial Re-Braiding", HPG 2017).
//! What a ray meets does not depend on it.

use std::sync::Arc;

use crate::block::{LEAF, node};
use crate::build::BuildItem;
use crate::mesh::Bvh;
use crate::traverse::local::Extent;

/// Everything at and below a node or leaf of a placed mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub instance: u32,
    /// Reference of the node or leaf.
    pub start: u32,
    /// Its box in scaled scene coordinates, rows as of [`crate::block::Node::bounds`]; padded where the mesh is more
    /// than moved.
    pub bounds: [f32; 6],
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

/// A placed mesh, as its boxes are made.
pub(crate) struct Form {
    pub bvh: Arc<Bvh>,
    /// From the coordinates of the mesh's tree to scaled scene coordinates.
    pub scene_from_mesh: [[f64; 4]; 3],
    /// How far its boxes are padded there.
    pub pad: f64,
}

/// The parts to build a tree over; `None` for a mesh that no ray can meet.
pub(crate) fn parts(forms: &[Option<Form>]) -> Vec<Part> {
    let whole = |(instance, form): (u32, &Option<Form>)| {
        let form = form.as_ref()?;
        Some(form.part(instance, form.bvh.root(), form.bvh.extent()))
    };
    let whole: Vec<Part> = (0..).zip(forms).filter_map(whole).collect();
    let triangles = forms.iter().flatten().map(|form| form.bvh.triangle_count());
    let room = (triangles.sum::<usize>() / TRIANGLES).min(MOST);
    if whole.len() < 2 || room / whole.len() < WORTH_IT {
        return whole;
    }
    let mut parts = divide(forms, whole, room);
    parts.sort_unstable_by_key(|part| (part.instance, part.start));
    parts
}

/// Opens those of a group that are in the way of others, then the same on both sides of the group's middle. The group
/// may become as many parts as there is room for.
fn divide(forms: &[Option<Form>], mut group: Vec<Part>, room: usize) -> Vec<Part> {
    if group.iter().all(|part| part.instance == group[0].instance) {
        return group;
    }
    let others = Others::of(&group);
    for i in 0..group.len() {
        let part = group[i];
        if shared(&part.bounds, &others.around(part.instance)) < SHARED {
            continue;
        }
        if let Some(children) = children(forms, &part)
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
        || divide(forms, group, own),
        || divide(forms, second, room - own),
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
    let twice = |part: &Part, axis: usize| part.bounds[2 * axis] + part.bounds[2 * axis + 1];
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
    farthest: [(f32, u32, f32); 6],
}

impl Others {
    fn of(group: &[Part]) -> Others {
        let mut farthest = [(f32::NEG_INFINITY, u32::MAX, f32::NEG_INFINITY); 6];
        for part in group {
            for (row, (first, whose, second)) in farthest.iter_mut().enumerate() {
                let out = outwards(row) * part.bounds[row];
                if *whose == part.instance {
                    *first = first.max(out);
                } else if out > *first {
                    (*second, *first, *whose) = (*first, out, part.instance);
                } else {
                    *second = second.max(out);
                }
            }
        }
        Others { farthest }
    }

    /// The box of all that is not this instance's.
    fn around(&self, instance: u32) -> [f32; 6] {
        std::array::from_fn(|row| {
            let (first, whose, second) = self.farthest[row];
            outwards(row) * if whose == instance { second } else { first }
        })
    }
}

/// -1 for the rows of lower bounds.
fn outwards(row: usize) -> f32 {
    if row.is_multiple_of(2) { -1.0 } else { 1.0 }
}

/// How much of the surface of a box is in another one.
fn shared(part: &[f32; 6], other: &[f32; 6]) -> f32 {
    let common = std::array::from_fn(|row| match row % 2 {
        0 => part[row].max(other[row]),
        _ => part[row].min(other[row]),
    });
    let whole = area(part);
    if whole > 0.0 {
        area(&common) / whole
    } else {
        0.0
    }
}

/// Half the surface of a box; 0 for an inverted one.
fn area(bounds: &[f32; 6]) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|axis| bounds[2 * axis + 1] - bounds[2 * axis]);
    if x.min(y).min(z) < 0.0 {
        return 0.0;
    }
    x * y + y * z + z * x
}

/// The parts that a part consists of, if it is more than a few triangles.
fn children(forms: &[Option<Form>], part: &Part) -> Option<Vec<Part>> {
    let form = forms.get(part.instance as usize)?.as_ref()?;
    if part.start & LEAF != 0 {
        return None;
    }
    let node = node(form.bvh.blocks(), part.start);
    let children = &node.child[..node.children as usize];
    if children.iter().all(|child| child & LEAF != 0) {
        return None;
    }
    let child = |(lane, &start): (usize, &u32)| {
        let (lower, upper) = node.bounds_of(lane);
        form.part(part.instance, start, &Extent { lower, upper })
    };
    Some(children.iter().enumerate().map(child).collect())
}

impl Form {
    /// What is at and below a node or leaf, whose box that is in the mesh's tree.
    fn part(&self, instance: u32, start: u32, extent: &Extent) -> Part {
        let (lower, upper) = box_of(&self.scene_from_mesh, extent);
        Part {
            instance,
            start,
            bounds: std::array::from_fn(|row| match row % 2 {
                0 => ((lower[row / 2] - self.pad) as f32).next_down(),
                _ => ((upper[row / 2] + self.pad) as f32).next_up(),
            }),
        }
    }
}

impl Part {
    pub fn item(&self, id: u32) -> BuildItem {
        let corner = |side: usize| std::array::from_fn(|axis| self.bounds[2 * axis + side]);
        BuildItem::new(corner(0), corner(1), id)
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
    use crate::block::leaf;

    /// Small triangles along a line: of `every` 250 of them, the run that `first` says.
    fn beads(first: usize, every: usize, lift: f32) -> Form {
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
        Form {
            bvh: Arc::new(bvh),
            scene_from_mesh: [
                [0.0, -1.0 / scale, 0.0, 5.0],
                [1.0 / scale, 0.0, 0.0, -3.0],
                [0.0, 0.0, 1.0 / scale, 2.0],
            ],
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
        let forms: Vec<_> = (0..3).map(|i| Some(beads(i, 3, 0.0))).collect();
        let parts = parts(&forms);
        assert!(parts.len() > 60, "{}", parts.len());
        for (instance, form) in forms.iter().flatten().enumerate() {
            let own = parts.iter().filter(|p| p.instance == instance as u32);
            let mut numbers = vec![];
            for part in own {
                let mut found = vec![];
                leaves(&form.bvh, part.start, &mut found);
                for (first, count, b) in found {
                    numbers.extend(first..first + count);
                    let (lower, upper) = ([b[0], b[2], b[4]], [b[1], b[3], b[5]]);
                    let leaf = form.part(0, 0, &Extent { lower, upper }).bounds;
                    for (row, bound) in leaf.iter().enumerate() {
                        let beyond = outwards(row) * (bound - part.bounds[row]);
                        assert!(beyond <= 0.0, "row {row} of a part: {beyond}");
                    }
                }
            }
            numbers.sort_unstable();
            assert!(numbers.into_iter().eq(0..form.bvh.triangle_count() as u32));
        }
    }

    #[test]
    fn parts_of_meshes_that_interlock_come_apart() {
        let forms: Vec<_> = (0..3).map(|i| Some(beads(i, 3, 0.0))).collect();
        let parts = parts(&forms);
        let apart = parts.iter().filter(|a| {
            let others = parts.iter().filter(|b| b.instance != a.instance);
            others.map(|b| shared(&a.bounds, &b.bounds)).sum::<f32>() < SHARED
        });
        let apart = apart.count();
        assert!(4 * apart > 3 * parts.len(), "{apart} of {}", parts.len());
    }

    #[test]
    fn meshes_beside_each_other_stay_whole() {
        let forms = [Some(beads(0, 1, 0.0)), None, Some(beads(0, 1, 0.1))];
        let whole = parts(&forms);
        let instances: Vec<_> = whole.iter().map(|part| part.instance).collect();
        assert_eq!(instances, [0, 2]);
    }
}

//! What the nodes of a small tree of lights may matter to points, many at a time.

use raycam_bvh::Loops;

use super::tree::{Tree, Weigh};
use crate::lanes::{LANES, Three, get};

/// By node what it may matter to each point, as [`super::Reference`] says it of one.
#[derive(Debug, Default)]
pub(crate) struct Weights {
    of_nodes: Vec<[f32; LANES]>,
}

impl Weights {
    /// Those of a point.
    pub fn of(&self, lane: usize) -> impl Weigh {
        Known {
            of_nodes: &self.of_nodes,
            lane,
        }
    }
}

/// The weights of a point, looked up.
struct Known<'a> {
    of_nodes: &'a [[f32; LANES]],
    lane: usize,
}

impl Weigh for Known<'_> {
    fn importance_of(&self, _: &Tree, node: usize) -> f32 {
        self.of_nodes[node][self.lane]
    }
}

/// Finds the weights of points, given by position and normal.
pub(crate) struct FindWeights<'a> {
    pub tree: &'a Tree,
    pub points: &'a Three<f64, LANES>,
    pub normals: &'a Three<f32, LANES>,
    pub out: &'a mut Weights,
}

impl Loops for FindWeights<'_> {
    #[inline(always)]
    fn run(self) {
        let Self {
            tree,
            points,
            normals,
            out: Weights { of_nodes },
        } = self;
        let (points, normals) = (*points, *normals);
        of_nodes.clear();
        of_nodes.resize(tree.len(), [0.0; LANES]);
        // Children come after their parents.
        for node in (0..tree.len()).rev() {
            let (bounds, mut weights) = (tree.bounds(node), [0.0; LANES]);
            for (lane, weight) in weights.iter_mut().enumerate() {
                let position = get(&points, lane).map(|x| x as f32);
                *weight = bounds.importance(position.into(), get(&normals, lane).into());
            }
            if let Some([a, b]) = tree.pair(node) {
                let [a, b] = [of_nodes[a], of_nodes[b]];
                for lane in 0..LANES {
                    let none = (a[lane] == 0.0) & (b[lane] == 0.0);
                    weights[lane] = if none { 0.0 } else { weights[lane] };
                }
            }
            of_nodes[node] = weights;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use raycam_bvh::vectorized;

    use super::super::Reference;
    use super::super::bounds::Bounds;
    use super::*;
    use crate::lanes::{set, vector};

    #[test]
    fn every_lane_is_what_it_is_alone() {
        let place = |i: usize| {
            let angle = i as f64;
            DVec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin())
        };
        let lights: Vec<Bounds> = (0..7)
            .map(|i| {
                let (at, normal) = (place(i) * 2.0, place(5 * i + 1).normalize());
                let corners = [at, at + 0.3 * normal.any_orthonormal_vector()];
                match i % 3 {
                    0 => Bounds::around(at, at, Vec3::ONE),
                    1 => Bounds::flat(&corners, normal, Vec3::X, false),
                    _ => Bounds::flat(&corners, normal, Vec3::splat(5.0), true),
                }
            })
            .collect();
        let tree = Tree::new(&lights);
        let (mut none, mut some) = (0, 0);
        for first in (0..640).step_by(LANES) {
            let (mut points, mut normals) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
            for lane in 0..LANES {
                let i = first + lane;
                set(&mut points, lane, (place(7 * i) * 3.0).to_array());
                let normal = place(3 * i).normalize() * f64::from(i % 5 != 0);
                set(&mut normals, lane, normal.as_vec3().to_array());
            }
            let mut weights = Weights::default();
            vectorized(FindWeights {
                tree: &tree,
                points: &points,
                normals: &normals,
                out: &mut weights,
            });
            for lane in 0..LANES {
                let from = Reference {
                    position: vector(&points, lane),
                    normal: get(&normals, lane).into(),
                };
                for node in 0..tree.len() {
                    let alone = from.importance_of(&tree, node);
                    let known = weights.of(lane).importance_of(&tree, node);
                    assert_eq!(known.to_bits(), alone.to_bits(), "{node} {from:?}");
                    *(if known > 0.0 { &mut some } else { &mut none }) += 1;
                }
            }
        }
        assert!(none > 500 && some > 500, "{none} {some}");
    }
}

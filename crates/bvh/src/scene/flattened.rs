//! Several meshes in one tree. Rays that go from one to the next stay in it; answers name the mesh, and the triangle in it.

use crate::blas::Bvh;
use crate::error::BuildError;
use crate::ray::NOTHING;
use crate::scene::{ExactTriangles, Instance, Scene, moved_by};

/// Which triangles of a tree are whose.
#[derive(Debug)]
pub(crate) struct Members {
    /// Of each mesh, its first triangle in the tree.
    firsts: Vec<u32>,
}

impl Members {
    /// The mesh that a triangle of the tree belongs to, and its number there.
    fn of(&self, triangle: u32) -> (u32, u32) {
        // Meshes without triangles begin where the next one does.
        let mesh = self.firsts.partition_point(|first| *first <= triangle) - 1;
        (mesh as u32, triangle - self.firsts[mesh])
    }

    /// Makes the instances and triangles of hits those of the meshes.
    pub fn name<'h>(&self, hits: impl Iterator<Item = (&'h mut u32, &'h mut u32)>) {
        for (instance, triangle) in hits.filter(|(instance, _)| **instance != NOTHING) {
            (*instance, *triangle) = self.of(*triangle);
        }
    }
}

/// The triangles of all meshes as those of the tree.
pub(crate) struct Together<'a, T>(pub &'a Members, pub &'a T);

impl<T: ExactTriangles> ExactTriangles for Together<'_, T> {
    fn corners(&self, _: u32, triangle: u32) -> [[f64; 3]; 3] {
        let (mesh, triangle) = self.0.of(triangle);
        self.1.corners(mesh, triangle)
    }
}

impl Scene {
    /// Builds one tree over meshes that stay where they are: `vertices` in scene-local coordinates, `triangles` of all meshes
    /// one after another, and of each mesh its first in `firsts`, which rise from 0. A mesh counts as an instance, in this
    /// order: answers are those of [`Scene::build`] but for float32's rounding.
    ///
    /// # Errors
    /// Those of [`Bvh::build`] and [`Scene::build`].
    pub fn merged(
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        firsts: Vec<u32>,
        origin: [f64; 3],
    ) -> Result<Self, BuildError> {
        debug_assert!(firsts.first() == Some(&0) && firsts.is_sorted());
        let bvh = Bvh::of_meshes(vertices, triangles, &firsts)?;
        let all = Instance {
            bvh: bvh.into(),
            world_from_mesh: moved_by([0.0; 3]),
        };
        let mut scene = Self::build(vec![all], origin)?;
        scene.members = Some(Members { firsts });
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{LEAF, leaf, node};

    #[test]
    fn leaves_are_of_one_mesh() {
        // Small sheets that cross each other, of two triangles each: without the rule, leaves have up to eight of them.
        let (mut vertices, mut triangles, mut firsts) = (vec![], vec![], vec![]);
        for sheet in 0..200u32 {
            let at = [sheet % 10, sheet / 10 % 10, sheet / 100].map(|x| 0.3 * x as f32);
            let axis = sheet as usize % 3;
            firsts.push(triangles.len() as u32);
            triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| 4 * sheet + i)));
            for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                let mut vertex = at;
                vertex[(axis + 1) % 3] += u;
                vertex[(axis + 2) % 3] += v;
                vertices.push(vertex);
            }
        }
        let sizes = |firsts: &[u32]| {
            let bvh = Bvh::of_meshes(&vertices, &triangles, firsts).unwrap();
            let (mut open, mut sizes) = (vec![bvh.root()], vec![]);
            while let Some(at) = open.pop() {
                if at & LEAF == 0 {
                    let node = node(bvh.blocks(), at);
                    open.extend(&node.child[..node.children as usize]);
                    continue;
                }
                let leaf = leaf(bvh.blocks(), at);
                let ids: Vec<_> = (0..leaf.count).map(|k| bvh.id(leaf.first + k)).collect();
                assert!(firsts.is_empty() || ids.iter().all(|id| id / 2 == ids[0] / 2));
                sizes.push(ids.len());
            }
            sizes
        };
        let (apart, mixed) = (sizes(&firsts), sizes(&[]));
        assert_eq!(apart.iter().sum::<usize>(), triangles.len());
        assert!(mixed.len() < apart.len() / 2, "{mixed:?}");
    }
}

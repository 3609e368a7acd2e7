//! Flattened scenes: several meshes in one BLAS, so that rays require no TLAS. Hits are mapped back to instances.

use crate::blas::Bvh;
use crate::error::BuildError;
use crate::scene::build::translation;
use crate::scene::instance_ranges::InstanceRanges;
use crate::scene::{Instance, Scene};

impl Scene {
    /// Builds one BLAS over static meshes: `vertices` in scene-local coordinates, the `triangles` of all meshes one
    /// after another, and the first triangle of each mesh in `first_prims`, ascending from 0. Each mesh counts as an
    /// instance; hits equal the hits of [`Scene::build`] up to float32 rounding.
    ///
    /// # Errors
    ///
    /// The errors of [`Bvh::build`] and [`Scene::build`].
    pub fn flattened(
        vertices: &[[f32; 3]],
        triangles: &[[u32; 3]],
        first_prims: Vec<u32>,
        origin: [f64; 3],
    ) -> Result<Self, BuildError> {
        debug_assert!(first_prims.first() == Some(&0) && first_prims.is_sorted());
        let bvh = Bvh::build_flattened(vertices, triangles, &first_prims)?;
        let all = Instance { bvh: bvh.into(), world_from_mesh: translation([0.0; 3]) };
        let mut scene = Self::build(vec![all], origin)?;
        scene.mesh_ranges = Some(InstanceRanges { first_prims });
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{leaf, node};

    #[test]
    fn leaves_contain_triangles_of_one_mesh_only() {
        // The meshes are small intersecting sheets of two triangles each. If leaves contained triangles of several
        // meshes, a leaf would contain up to eight sheets.
        let (mut vertices, mut triangles, mut first_prims) = (vec![], vec![], vec![]);
        for sheet in 0..200u32 {
            let at = [sheet % 10, sheet / 10 % 10, sheet / 100].map(|x| 0.3 * x as f32);
            let axis = sheet as usize % 3;
            first_prims.push(triangles.len() as u32);
            triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| 4 * sheet + i)));
            for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                let mut vertex = at;
                vertex[(axis + 1) % 3] += u;
                vertex[(axis + 2) % 3] += v;
                vertices.push(vertex);
            }
        }
        let sizes = |first_prims: &[u32]| {
            let bvh = Bvh::build_flattened(&vertices, &triangles, first_prims).unwrap();
            let (mut open, mut sizes) = (vec![bvh.root()], vec![]);
            while let Some(at) = open.pop() {
                if !at.is_leaf() {
                    let node = node(bvh.blocks(), at);
                    open.extend(&node.children[..node.child_count as usize]);
                    continue;
                }
                let leaf = leaf(bvh.blocks(), at);
                let ids: Vec<_> = (0..leaf.count).map(|k| bvh.prim_id(leaf.first_prim + k)).collect();
                assert!(first_prims.is_empty() || ids.iter().all(|id| id / 2 == ids[0] / 2));
                sizes.push(ids.len());
            }
            sizes
        };
        let (apart, mixed) = (sizes(&first_prims), sizes(&[]));
        assert_eq!(apart.iter().sum::<usize>(), triangles.len());
        assert!(mixed.len() < apart.len() / 2, "{mixed:?}");
    }
}

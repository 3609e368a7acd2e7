//! Several meshes in one tree. Rays that go from one to the next stay in it; answers name the mesh, and the triangle in it.

use crate::error::BuildError;
use crate::mesh::{BuildOptions, Bvh};
use crate::ray::{ExactHit, Hit, NOTHING};
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

    pub fn name(&self, hits: &mut [Hit]) {
        for hit in hits.iter_mut().filter(|hit| hit.instance != NOTHING) {
            (hit.instance, hit.triangle) = self.of(hit.triangle);
        }
    }

    pub fn name_exact(&self, hits: &mut [ExactHit]) {
        for hit in hits.iter_mut().filter(|hit| hit.instance != NOTHING) {
            (hit.instance, hit.triangle) = self.of(hit.triangle);
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
        let bvh = Bvh::build(vertices, triangles, &BuildOptions::default())?;
        let all = Instance {
            bvh: bvh.into(),
            world_from_mesh: moved_by([0.0; 3]),
        };
        let mut scene = Self::build(vec![all], origin)?;
        scene.members = Some(Members { firsts });
        Ok(scene)
    }
}

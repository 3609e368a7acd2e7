//! Sorting of a bounce's hits by the kind of their BSDF, so that the lanes of a chunk run the same code.
//!
//! After A. Afra, C. Benthin, I. Wald and J. Munkberg, "Local Shading Coherence Extraction for SIMD-Efficient Path
//! Tracing on CPUs", High Performance Graphics 2016: small streams, sorted in cache.

use raycam_bvh::Hit;

use crate::lobes::classify::BatchKind;
use crate::prepare::geometry::Geometry;

/// Number of variants of [`BatchKind`].
const KINDS: usize = 5;

/// Buffers of a sort, reused for every bounce.
#[derive(Default)]
pub(crate) struct KindSort {
    kinds: Vec<u8>,
    paths: Vec<u32>,
    hits: Vec<Hit>,
}

impl KindSort {
    /// Sorts hits and the indices of their paths by kind. The sort is stable, so that the order in which the branches
    /// of one camera ray add their light depends only on those branches.
    pub fn sort(&mut self, geometry: &Geometry, paths: &mut Vec<u32>, hits: &mut Vec<Hit>) {
        self.kinds.clear();
        self.kinds.extend(hits.iter().map(|hit| kind_index(geometry.material(hit).kind)));
        let mut next = [0usize; KINDS];
        for &kind in &self.kinds {
            next[usize::from(kind)] += 1;
        }
        if next.contains(&hits.len()) {
            return;
        }
        let mut begin = 0;
        for next in &mut next {
            (*next, begin) = (begin, begin + *next);
        }
        // Every entry is overwritten, so the initial values do not matter.
        self.paths.resize(paths.len(), 0);
        self.hits.resize(hits.len(), Hit::MISS);
        for ((&kind, &path), &hit) in self.kinds.iter().zip(&*paths).zip(&*hits) {
            let next = &mut next[usize::from(kind)];
            (self.paths[*next], self.hits[*next]) = (path, hit);
            *next += 1;
        }
        std::mem::swap(&mut self.paths, paths);
        std::mem::swap(&mut self.hits, hits);
    }
}

fn kind_index(kind: BatchKind) -> u8 {
    match kind {
        BatchKind::Diffuse(_) => 0,
        BatchKind::Glossy => 1,
        BatchKind::Specular => 2,
        BatchKind::RoughDielectric => 3,
        BatchKind::General => 4,
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Glass, Material, MaterialModel, Metal, Object, World};

    use super::*;
    use crate::control::Control;
    use crate::prepare::world::PreparedWorld;

    #[test]
    fn hits_are_grouped_by_kind_in_their_original_order() {
        let mut world = World::default();
        let mesh = world.add_mesh(primitive::plane([1.0, 1.0]).unwrap());
        let models = [
            MaterialModel::Glass(Glass::default()),
            Material::default().model,
            MaterialModel::Metal(Metal { roughness: 0.5, ..Metal::named("gold").unwrap() }),
        ];
        for model in models {
            let material = world.add_material(Material { model, ..Material::default() }).unwrap();
            world.add_object(Object::new("", mesh, vec![material], DAffine3::IDENTITY)).unwrap();
        }
        let prepared = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let hit = |instance| Hit { instance, triangle: 0, ..Hit::MISS };
        let sorted = |instances: &[u32]| {
            let mut paths: Vec<_> = (0..instances.len() as u32).collect();
            let mut hits: Vec<_> = instances.iter().map(|&instance| hit(instance)).collect();
            KindSort::default().sort(&prepared.geometry, &mut paths, &mut hits);
            assert!(paths.iter().zip(&hits).all(|(&path, hit)| hit.instance == instances[path as usize]));
            paths
        };
        assert_eq!(sorted(&[0, 1, 2, 0, 1, 1, 2]), [1, 4, 5, 2, 6, 0, 3]);
        assert_eq!(sorted(&[2, 2]), [0, 1]);
        assert!(sorted(&[]).is_empty());
    }
}

//! Trees that are refitted to moved vertices.

use std::sync::Arc;

use crate::support::*;
use raycam_bvh::{BuildError, Bvh, Coherence, Hit, INVALID_ID, Instance, Ray, Scene};

fn answers(bvh: Bvh, rays: &[Ray]) -> Vec<Hit> {
    let instances = Instance {
        bvh: Arc::new(bvh),
        world_from_mesh: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
    };
    let scene = Scene::build(vec![instances], [0.0; 3]).unwrap();
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.closest(rays, &mut hits, Coherence::Unknown);
    hits
}

#[test]
fn refitted_trees_return_the_hits_of_new_trees() {
    let mut rng = Rng(4);
    for mesh in [sphere(60, &mut rng), soup(2000, 0.3, &mut rng), grid(20)] {
        let rays: Vec<Ray> = (0..4000)
            .map(|_| Ray {
                origin: std::array::from_fn(|_| 3.0 * rng.signed()),
                direction: std::array::from_fn(|_| rng.signed()),
                t_max: f32::INFINITY,
            })
            .collect();
        let bent: Vec<[f32; 3]> =
            mesh.vertices.iter().map(|&[x, y, z]| [x + 0.3 * z.sin(), 1.2 * y, z - 0.4 * x * y]).collect();
        let mut moved = Bvh::build(&mesh.vertices, &mesh.triangles).unwrap();
        let still = moved.sah_cost();
        moved.refit(&bent, &mesh.triangles).unwrap();
        assert!(moved.sah_cost() > 1.0 && moved.sah_cost() != still);
        let new = answers(Bvh::build(&bent, &mesh.triangles).unwrap(), &rays);
        assert!(new.iter().any(|hit| hit.instance != INVALID_ID));
        assert!(answers(moved, &rays) == new);
    }
}

#[test]
fn refit_refuses_changed_triangles_and_invalid_vertices() {
    let mut rng = Rng(5);
    let mesh = sphere(10, &mut rng);
    let mut bvh = Bvh::build(&mesh.vertices, &mesh.triangles).unwrap();
    let fewer = &mesh.triangles[1..];
    assert_eq!(
        bvh.refit(&mesh.vertices, fewer),
        Err(BuildError::TopologyMismatch { given: fewer.len(), built: mesh.triangles.len() })
    );
    let huge: Vec<_> = mesh.vertices.iter().map(|v| v.map(|x| x * 1e30)).collect();
    assert!(bvh.refit(&huge, &mesh.triangles).is_err());
    let mut broken = mesh.vertices.clone();
    broken[0][0] = f32::NAN;
    assert!(bvh.refit(&broken, &mesh.triangles).is_err());
}

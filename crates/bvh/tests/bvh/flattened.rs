//! Meshes that are flattened into one tree give the same answers as separate instances.

use crate::support::*;
use raycam_bvh::{Coherence, ExactHit, ExactRay, Hit, INVALID_ID, Ray, Scene};

const STILL: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

#[test]
fn flattened_scenes_return_the_hits_of_instances() {
    let mut rng = Rng(11);
    let nothing = Mesh { vertices: vec![], triangles: vec![] };
    let (ball, floor) = (sphere(6, &mut rng), grid(40));
    // The scene contains the floor twice: at equal distance, float32 rays hit the first object, and float64 rays hit
    // the last object.
    let meshes = [&nothing, &floor, &ball, &nothing, &floor, &nothing];
    let world = World {
        instances: meshes
            .map(|mesh| {
                let vertices = mesh.vertices.iter().map(|v| v.map(f64::from)).collect();
                (vertices, mesh.triangles.clone(), STILL)
            })
            .into(),
        origin: [0.0; 3],
    };
    let (mut vertices, mut triangles, mut firsts) = (vec![], vec![], vec![]);
    for mesh in meshes {
        let before = vertices.len() as u32;
        firsts.push(triangles.len() as u32);
        vertices.extend(&mesh.vertices);
        triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| before + i)));
    }
    let merged = Scene::flattened(&vertices, &triangles, firsts, [0.0; 3]).unwrap();
    assert!(merged.is_single_level());
    let apart = world.scene();
    assert!(!apart.is_single_level());
    let rays: Vec<_> = (0..5000)
        .map(|_| {
            let [x, y, z] = rng.vector();
            Ray {
                // The rays start next to the ball, above a corner of the floor.
                origin: [1.2 + x, 1.2 + y, 1.5 + z],
                direction: rng.vector(),
                t_max: f32::INFINITY,
            }
        })
        .collect();
    let exact: Vec<_> = rays
        .iter()
        .map(|ray| ExactRay {
            origin: ray.origin.map(f64::from),
            direction: ray.direction.map(f64::from),
            t_min: 0.0,
            t_max: f64::INFINITY,
        })
        .collect();
    let mut seen = [0; 6];
    let of = |scene: &Scene| {
        let mut hits = vec![Hit::MISS; rays.len()];
        scene.closest(&rays, &mut hits, Coherence::Unknown);
        let mut occluded = vec![false; rays.len()];
        scene.occluded(&rays, &mut occluded, Coherence::Unknown);
        let mut exactly = vec![ExactHit::MISS; rays.len()];
        scene.closest_exact(&exact, &world, &mut exactly);
        (hits, occluded, exactly)
    };
    let ((a, dark_a, exact_a), (b, dark_b, exact_b)) = (of(&merged), of(&apart));
    assert_eq!(exact_a, exact_b);
    assert_eq!(dark_a, dark_b);
    for (i, (a, b)) in a.iter().zip(&b).enumerate() {
        assert_eq!((a.instance, a.triangle), (b.instance, b.triangle), "{i}");
        assert!((a.t - b.t).abs() <= 1e-5 * b.t.abs() || a.t == b.t, "{i}");
        if a.instance != INVALID_ID {
            seen[a.instance as usize] += 1;
        }
    }
    for (hit, float) in exact_a.iter().zip(&a) {
        assert!(float.instance != 1 || hit.instance == 4, "{hit:?}");
    }
    assert!(seen[1] > 100 && seen[2] > 100, "{seen:?}");
    assert_eq!([seen[0], seen[3], seen[4], seen[5]], [0; 4]);
}

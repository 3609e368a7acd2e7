//! Instances that are only translated: between them, only the origins of rays change.

use crate::support::*;
use raycam_bvh::{Coherence, Hit, Ray};

/// Balls on a wide floor, one of them rotated: rays start above their surfaces, at offsets as small as in a renderer.
#[test]
fn hits_on_translated_instances_match_brute_force() {
    let mut rng = Rng(5);
    let (ball, floor) = (sphere(6, &mut rng), grid(40));
    let still = |x: f64, y: f64, z: f64| [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]];
    let turned = [[0.6, -0.8, 0.0, 3.0], [0.8, 0.6, 0.0, 2.0], [0.0, 0.0, 1.0, 1.0]];
    let places = [
        (&floor, still(-20.0, -20.0, 0.0)),
        (&ball, still(0.25, 0.5, 1.0)),
        (&ball, still(-3.1, 0.7, 1.3)),
        (&ball, turned),
    ];
    let world = World {
        instances: places
            .map(|(mesh, matrix)| {
                let vertices = mesh.vertices.iter().map(|v| v.map(f64::from)).collect();
                (vertices, mesh.triangles.clone(), matrix)
            })
            .into(),
        origin: [0.0; 3],
    };
    let scene = world.scene();
    let rays: Vec<_> = (0..20_000)
        .map(|k| {
            let above = 2e-5 * (1.0 + rng.signed().abs());
            let [x, y, _] = rng.vector().map(|x| 4.0 * x);
            let [a, b, c] = rng.vector();
            // Some rays are parallel to one or two axes.
            let flat = |d: f32, every: usize| if k % every == 0 { 0.0 } else { d };
            Ray {
                origin: [x, y, if k % 3 == 0 { above } else { 1.0 + c }],
                direction: [flat(a, 7), flat(b, 5), c.abs() - if k % 2 == 0 { 0.0 } else { 0.9 }],
                t_max: if k % 11 == 0 { 0.8 } else { f32::INFINITY },
            }
        })
        .collect();
    let ask = |coherence| {
        let mut hits = vec![Hit::MISS; rays.len()];
        scene.closest(&rays, &mut hits, coherence);
        let mut occluded = vec![false; rays.len()];
        scene.occluded(&rays, &mut occluded, coherence);
        (hits, occluded)
    };
    let (hits, occluded) = ask(Coherence::Incoherent);
    assert!((hits.clone(), occluded.clone()) == ask(Coherence::Coherent), "packets");
    let mut met = [0; 4];
    for ((ray, hit), occluded) in rays.iter().zip(&hits).zip(occluded) {
        let (t, instance, triangle, next) = world.nearest(&exact(ray));
        assert_eq!(occluded, hit.instance != raycam_bvh::INVALID_ID, "{ray:?} {hit:?}");
        if next - t > 1e-4 || t == f64::INFINITY {
            let found = (hit.instance, hit.triangle);
            assert_eq!(found, (instance, triangle), "{ray:?} {hit:?} {t} {next}");
        }
        if let Some(met) = met.get_mut(instance as usize) {
            *met += 1;
        }
    }
    assert!(met.iter().all(|&met| met > 500), "{met:?}");
}

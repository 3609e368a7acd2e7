//! Overlapping instances, whose subtrees become leaves of one TLAS.

use crate::support::*;
use raycam_bvh::{Coherence, ExactHit, ExactTriangles, Hit, INVALID_ID, Ray};

/// Random triangles around one position, as instances that are translated, rotated, mirrored, sheared or scaled; one
/// instance is flat.
fn soups(rng: &mut Rng) -> World {
    let matrices = [
        [[1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, -0.25], [0.0, 0.0, 1.0, 0.125]],
        [[0.6, -0.8, 0.0, 0.1], [0.8, 0.6, 0.0, 0.2], [0.0, 0.0, -1.0, 0.3]],
        [[1.5, 0.3, 0.0, -0.2], [0.0, 0.75, 0.0, 0.0], [0.1, 0.0, 1.1, 0.1]],
        [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
    ];
    let instances = matrices.iter().enumerate().map(|(i, matrix)| {
        let mut mesh = soup(1500, 0.03, rng);
        if i == 0 {
            // Many overlapping triangles in one plane: their indices decide which triangle is hit.
            mesh = soup(1500, 0.2, rng);
            mesh.vertices.iter_mut().for_each(|v| v[2] = 0.25);
        }
        let vertices = mesh.vertices.iter().map(|v| v.map(f64::from)).collect();
        (vertices, mesh.triangles, *matrix)
    });
    World { instances: instances.collect(), origin: [0.0; 3] }
}

#[test]
fn hits_through_rebraided_parts_match_brute_force() {
    let mut rng = Rng(77);
    let world = soups(&mut rng);
    let mut scene = world.scene();
    let rays = rays(4_000, 1.0, &mut rng);
    let exact_rays: Vec<_> = rays.iter().map(exact).collect();
    let mut known: Option<(Vec<Hit>, Vec<bool>, Vec<ExactHit>)> = None;
    for isa in available() {
        scene.set_instruction_set(isa);
        for coherence in [Coherence::Incoherent, Coherence::Coherent] {
            let mut hits = vec![Hit::MISS; rays.len()];
            scene.closest(&rays, &mut hits, coherence);
            let mut occluded = vec![false; rays.len()];
            scene.occluded(&rays, &mut occluded, coherence);
            let mut sure = vec![ExactHit::MISS; rays.len()];
            scene.closest_exact(&exact_rays, &world, &mut sure);
            let answers = (hits, occluded, sure);
            assert!(known.get_or_insert_with(|| answers.clone()) == &answers, "{isa:?}");
        }
    }
    let (hits, occluded, sure) = known.unwrap();
    let mut met = [0; 4];
    for (((ray, hit), occluded), sure) in exact_rays.iter().zip(&hits).zip(occluded).zip(sure) {
        let (t, instance, triangle, next) = world.nearest(ray);
        assert_eq!(occluded, hit.instance != INVALID_ID, "{ray:?} {hit:?}");
        assert!((sure.t - t).abs() <= 1e-12 * t || sure.t == t, "{sure:?} {t}");
        if next - t > 1e-9 {
            assert_eq!((sure.instance, sure.triangle), (instance, triangle));
        }
        if next - t > 1e-4 || t == f64::INFINITY {
            assert_eq!((hit.instance, hit.triangle), (instance, triangle), "{ray:?} {hit:?}");
        }
        if let Some(met) = met.get_mut(instance as usize) {
            *met += 1;
        }
    }
    assert!(met.iter().all(|&met| met > 100), "{met:?}");
}

#[test]
fn rays_hit_the_first_of_coplanar_triangles() {
    let mut rng = Rng(78);
    let world = soups(&mut rng);
    let scene = world.scene();
    let rays: Vec<_> = (0..2_000)
        .map(|_| {
            let ([x, y, _], [a, b, _]) = (rng.vector(), rng.vector());
            Ray { origin: [x + 0.5, y - 0.25, 0.6], direction: [0.1 * a, 0.1 * b, -1.0], t_max: f32::INFINITY }
        })
        .collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.closest(&rays, &mut hits, Coherence::Incoherent);
    let mut ties = 0;
    for (ray, hit) in rays.iter().zip(&hits) {
        let (t, instance, _, next) = world.nearest(&exact(ray));
        if instance != 0 || next - t > 1e-9 {
            continue;
        }
        let met = |k: &u32| {
            let at = intersect(&exact(ray), world.corners(0, *k));
            at.is_some_and(|at| at - t < 1e-9)
        };
        assert_eq!(Some(hit.triangle), (0..1500).find(met), "{ray:?}");
        ties += 1;
    }
    assert!(ties > 500, "{ties}");
}

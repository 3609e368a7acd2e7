//! Triangles much smaller than the spacing of the rays: the frustum of a packet enters all boxes between its rays.

use crate::support::*;
use raycam_bvh::{Coherence, Hit, INVALID_ID, Ray};

/// Squares of 8 by 8 rays, row by row. The rays of a square start at one point and are aimed at the grid below it or
/// next to it.
fn squares(count: usize, rng: &mut Rng) -> Vec<Ray> {
    let mut rays = vec![];
    for _ in 0..count {
        let corner = [rng.signed(), rng.signed()];
        rays.extend((0..64).map(|i| {
            let [x, y] = [i % 8, i / 8].map(|k| k as f32 / 16.0);
            Ray {
                origin: [0.5, 0.25, 3.0],
                direction: [0.5 * corner[0] + x, 0.5 * corner[1] + y, -3.0],
                t_max: f32::INFINITY,
            }
        }));
    }
    rays
}

#[test]
fn packets_and_single_rays_have_equal_hits_on_subpixel_triangles() {
    let mut rng = Rng(3);
    let n = if cfg!(miri) { 8 } else { 300 };
    let mut mesh = grid(n);
    // The mesh spans -1 to 1 and is not flat, so that some rays enter a leaf's box without hitting its triangles.
    for [x, y, z] in &mut mesh.vertices {
        [*x, *y] = [*x, *y].map(|v| 2.0 * v / n as f32 - 1.0);
        *z = 0.01 * rng.signed();
    }
    let mut scene = mesh.scene();
    let rays = squares(if cfg!(miri) { 1 } else { 100 }, &mut rng);
    let mut known: Option<Vec<Hit>> = None;
    for isa in available() {
        scene.set_instruction_set(isa);
        for coherence in [Coherence::Incoherent, Coherence::Coherent] {
            let mut hits = vec![Hit::MISS; rays.len()];
            scene.closest(&rays, &mut hits, coherence);
            let met = hits.iter().filter(|hit| hit.instance != INVALID_ID).count();
            assert!(4 * met > rays.len(), "{met} of {}", rays.len());
            match &known {
                None => known = Some(hits),
                Some(known) => assert_eq!(*known, hits, "{}, {coherence:?}", isa.name()),
            }
        }
    }
}

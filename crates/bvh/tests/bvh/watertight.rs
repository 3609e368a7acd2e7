//! Rays aimed at edges and vertices of closed meshes do not pass through. `examples/leaks.rs` does the same with more
//! rays.

use crate::support::edge_rays;
use raycam_bvh::{Coherence, Hit, InstructionSet, Ray};
use rayon::prelude::*;

#[test]
fn rays_aimed_at_edges_never_leak() {
    let meshes = edge_rays::meshes();
    let isas: Vec<_> = InstructionSet::ALL.into_iter().filter(|isa| isa.is_available()).collect();
    let leaks: Vec<_> = meshes
        .par_iter()
        .enumerate()
        .flat_map(|(m, mesh)| isas.par_iter().map(move |isa| (m as u64, mesh, *isa)))
        .filter_map(|(m, mesh, isa)| {
            let scene = mesh.scene(isa).unwrap();
            let n = if isa == InstructionSet::Portable { 100_000 } else { 400_000 };
            let tally = mesh.trial(&scene, n, m);
            (tally.leaks > 0).then(|| format!("{} {}: {tally:?}", mesh.name, isa.name()))
        })
        .collect();
    assert!(leaks.is_empty(), "{leaks:#?}");
}

/// A ray crosses a side of a needle at a distance of 2.6 from its sharp end; the other end is 500,000 away. If t were
/// computed by weighting such distant corners, its error would be larger than t.
#[test]
fn needles_are_hit_close_to_their_tip() {
    let meshes = edge_rays::meshes();
    let mesh = meshes.iter().find(|mesh| mesh.name == "needles, a million times as long as wide");
    let mesh = mesh.unwrap();
    let ray = Ray {
        origin: [3211645483, 3205026004, 1076536237].map(f32::from_bits),
        direction: [1021233184, 1013049408, 3180623168].map(f32::from_bits),
        t_max: f32::from_bits(1108282273),
    };
    let rays = [ray; 64];
    for isa in InstructionSet::ALL {
        if !isa.is_available() {
            continue;
        }
        let scene = mesh.scene(isa).unwrap();
        for coherence in [Coherence::Coherent, Coherence::Incoherent] {
            for rays in [&rays[..], &rays[..1]] {
                let mut hits = vec![Hit::MISS; rays.len()];
                let mut occluded = vec![false; rays.len()];
                scene.closest(rays, &mut hits, coherence);
                scene.occluded(rays, &mut occluded, coherence);
                // Exact rational arithmetic gives t = 1.000004.
                let close = |hit: &Hit| (hit.t - 1.000004).abs() < 1e-5;
                assert!(hits.iter().all(close), "{} {:?}", isa.name(), hits[0]);
                assert!(occluded.iter().all(|occluded| *occluded), "{}", isa.name());
            }
        }
    }
}

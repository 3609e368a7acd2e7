//! Rays aimed at edges and vertices of closed meshes: none gets through. `examples/leaks.rs` does the same at length.

#[path = "common/aimed.rs"]
mod aimed;

use raycam_bvh::{InstructionSet, Quality};
use rayon::prelude::*;

#[test]
fn ten_million_aimed_rays_leak_nowhere() {
    let meshes = aimed::meshes();
    let isas: Vec<_> = InstructionSet::ALL
        .into_iter()
        .filter(|isa| isa.is_available())
        .collect();
    let leaks: Vec<_> = meshes
        .par_iter()
        .enumerate()
        .flat_map(|(m, mesh)| isas.par_iter().map(move |isa| (m as u64, mesh, *isa)))
        .filter_map(|(m, mesh, isa)| {
            let quality = [Quality::Fast, Quality::Default, Quality::High][m as usize % 3];
            let scene = mesh.scene(quality, isa).unwrap();
            let n = if isa == InstructionSet::Portable {
                100_000
            } else {
                400_000
            };
            let tally = mesh.trial(&scene, n, m);
            (tally.leaks > 0).then(|| format!("{} {}: {tally:?}", mesh.name, isa.name()))
        })
        .collect();
    assert!(leaks.is_empty(), "{leaks:#?}");
}

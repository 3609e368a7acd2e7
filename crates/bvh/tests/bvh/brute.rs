//! A hundred meshes compared with brute force. `examples/brute.rs` does the same with more rays.

use crate::support::brute;
use raycam_bvh::InstructionSet;
use rayon::prelude::*;

#[test]
fn hits_on_a_hundred_meshes_match_brute_force() {
    let isas = InstructionSet::ALL.into_iter();
    let isas: Vec<_> = isas.filter(|isa| isa.is_available()).collect();
    let meshes = brute::meshes(90);
    let tally = meshes.par_iter().enumerate().map(|(m, mesh)| {
        let scene = mesh.scene(isas[m % isas.len()]);
        brute::trial(mesh, &scene, 20_000, m as u64)
    });
    let tally = tally.reduce(brute::Tally::default, brute::Tally::add);
    assert!(tally.faults.is_empty(), "{:#?}", &tally.faults[..tally.faults.len().min(10)]);
    // Many rays must hit something, and most of these hits must be outside the tie band.
    assert!(tally.hits > tally.rays / 3, "{} of {}", tally.hits, tally.rays);
    assert!(tally.ties < tally.hits / 3 * 2, "{} of {}", tally.ties, tally.rays);
}

//! Compares a hundred meshes with float64 brute force: `brute [RAYS per mesh, default 1e7] [--triangles 90] [--isa
//! NAME]`. Prints the results for each kind of mesh and every wrong answer; answers within the tie band, a rounding
//! tolerance, count as correct. Fails if any answer is wrong.

#[path = "../tests/bvh/support/brute.rs"]
mod brute;

use raycam_bvh::InstructionSet;
use rayon::prelude::*;

/// Number of parts into which the rays aimed at a mesh are divided; each part has its own seed.
const PARTS: u64 = 16;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut count, mut triangles) = (1e7, 90);
    let mut isas: Vec<_> = InstructionSet::ALL.into_iter().filter(|isa| isa.is_available()).collect();
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or(format!("{arg} requires a value"));
        match arg.as_str() {
            "--triangles" => triangles = value()?.parse()?,
            "--isa" => {
                let name = value()?;
                isas.retain(|isa| isa.name() == name);
            }
            _ => count = arg.parse()?,
        }
    }
    if isas.is_empty() {
        return Err("this machine does not support the instruction set".into());
    }
    let meshes = brute::meshes(triangles);
    let mut tallies: Vec<_> = (0..brute::KINDS.len()).map(|_| brute::Tally::default()).collect();
    for (m, mesh) in meshes.iter().enumerate() {
        let parts = (0..PARTS).into_par_iter().map(|part| {
            let isa = isas[(m + part as usize) % isas.len()];
            let scene = mesh.scene(isa);
            let seed = (m as u64) << 32 | part;
            brute::trial(mesh, &scene, (count / PARTS as f64) as usize, seed)
        });
        let tally = parts.reduce(brute::Tally::default, brute::Tally::add);
        for fault in &tally.faults {
            println!("{fault}");
        }
        let kind = &mut tallies[m % brute::KINDS.len()];
        *kind = std::mem::take(kind).add(tally);
    }
    let mut total = brute::Tally::default();
    let told = |name: &str, tally: &brute::Tally| {
        let brute::Tally { rays, hits, ties, counted, points, .. } = tally;
        let wrong = tally.faults.len();
        let in_float64 = format!("{counted:>12} counted {points:>12} points");
        println!("{name:<8} {rays:>12} rays {hits:>12} hits {ties:>12} ties {in_float64} {wrong:>6} wrong");
    };
    for (kind, tally) in brute::KINDS.iter().zip(tallies) {
        told(kind, &tally);
        total = total.add(tally);
    }
    told("all", &total);
    match total.faults.is_empty() {
        true => Ok(()),
        false => Err("some results differ from brute force".into()),
    }
}

//! Aims rays at the edges and vertices of closed meshes and counts those that get through:
//! `leaks [RAYS, default 1e9] [--isa NAME]`. Fails if there is one.

#[path = "../tests/common/aimed.rs"]
mod aimed;

use raycam_bvh::{InstructionSet, Quality};
use rayon::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut count, mut isa) = (1e9, InstructionSet::best());
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        if arg == "--isa" {
            let name = args.next().ok_or("--isa needs a name")?;
            isa = InstructionSet::ALL
                .into_iter()
                .find(|isa| isa.name() == name)
                .ok_or("no such instruction set")?;
        } else {
            count = arg.parse()?;
        }
    }
    let meshes = aimed::meshes();
    let each = count / meshes.len() as f64;
    let parts = 64;
    let mut total = aimed::Tally::default();
    for (m, mesh) in meshes.iter().enumerate() {
        let scene = mesh.scene(Quality::Default, isa)?;
        let tallies = (0..parts).into_par_iter();
        let tallies = tallies.map(|part| {
            mesh.trial(
                &scene,
                (each / parts as f64) as usize,
                (m as u64) << 32 | part,
            )
        });
        let tally = tallies.reduce(aimed::Tally::default, |a, b| aimed::Tally {
            rays: a.rays + b.rays,
            leaks: a.leaks + b.leaks,
        });
        println!(
            "{:<24} {:>12} rays {:>6} leaks",
            mesh.name, tally.rays, tally.leaks
        );
        total.rays += tally.rays;
        total.leaks += tally.leaks;
    }
    println!(
        "{:<24} {:>12} rays {:>6} leaks  ({})",
        "all",
        total.rays,
        total.leaks,
        isa.name()
    );
    if total.leaks > 0 {
        Err("rays leak".into())
    } else {
        Ok(())
    }
}

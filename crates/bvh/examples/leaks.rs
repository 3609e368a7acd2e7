//! Aims rays at the edges and vertices of closed meshes and counts the rays that pass through: `leaks [RAYS, default
//! 1e9] [--isa NAME] [--dump DIR]`. Fails if any ray passes through.
//!
//! `--dump` traces nothing; it writes the placed meshes and some of these rays to files, so that another ray tracer can
//! be tested: NUMBER.tri (u32 vertex count, u32 triangle count, f32 positions, u32 indices) and NUMBER.rays (origin,
//! direction, t_max in f32). It prints the names.

#[path = "../tests/bvh/support/edge_rays.rs"]
mod edge_rays;

use std::path::Path;

use raycam_bvh::InstructionSet;
use rayon::prelude::*;

type Error = Box<dyn std::error::Error>;

/// Number of parts into which the rays aimed at a mesh are divided; each part has its own seed.
const PARTS: u64 = 64;

fn main() -> Result<(), Error> {
    let (mut count, mut isa, mut folder) = (1e9, InstructionSet::detect(), None);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or(format!("{arg} requires a value"));
        match arg.as_str() {
            "--isa" => {
                let name = value()?;
                isa = InstructionSet::ALL.into_iter().find(|isa| isa.name() == name).ok_or(
                    "this machine does not \
                        support the instruction set",
                )?;
            }
            "--dump" => folder = Some(value()?),
            _ => count = arg.parse()?,
        }
    }
    let meshes = edge_rays::meshes();
    let each = (count / meshes.len() as f64 / PARTS as f64) as usize;
    if let Some(folder) = folder {
        for (m, mesh) in meshes.iter().enumerate() {
            dump(mesh, Path::new(&folder), m, each)?;
        }
        return Ok(());
    }
    let mut total = edge_rays::Tally::default();
    for (m, mesh) in meshes.iter().enumerate() {
        let scene = mesh.scene(isa)?;
        let tallies = (0..PARTS).into_par_iter();
        let tallies = tallies.map(|part| mesh.trial(&scene, each, seed(m, part)));
        let tally = tallies.reduce(edge_rays::Tally::default, |a, b| edge_rays::Tally {
            rays: a.rays + b.rays,
            leaks: a.leaks + b.leaks,
        });
        println!("{:<24} {:>12} rays {:>6} leaks", mesh.name, tally.rays, tally.leaks);
        total.rays += tally.rays;
        total.leaks += tally.leaks;
    }
    println!("{:<24} {:>12} rays {:>6} leaks  ({})", "all", total.rays, total.leaks, isa.name());
    if total.leaks > 0 { Err("rays pass through closed meshes".into()) } else { Ok(()) }
}

fn seed(mesh: usize, part: u64) -> u64 {
    (mesh as u64) << 32 | part
}

/// Writes a mesh to NUMBER.tri, and at least `each` rays of every part to NUMBER.rays.
fn dump(mesh: &edge_rays::Closed, folder: &Path, number: usize, each: usize) -> Result<(), Error> {
    let (vertices, triangles) = (mesh.placed_vertices(), mesh.triangles());
    let counts = [vertices.len() as u32, triangles.len() as u32];
    let words = |words: &[u32]| words.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
    let floats = |floats: &[f32]| floats.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
    let mut bytes = words(&counts);
    bytes.extend(floats(vertices.as_flattened()));
    bytes.extend(words(triangles.as_flattened()));
    std::fs::write(folder.join(format!("{number}.tri")), bytes)?;
    let (mut bytes, mut rays) = (vec![], vec![]);
    for part in 0..PARTS {
        let mut rng = edge_rays::Rng(seed(number, part) * 2 + 1);
        for _ in 0..each.div_ceil(edge_rays::BATCH) {
            mesh.aim(&mut rays, &mut rng);
            for ray in &rays {
                bytes.extend(floats(&ray.origin));
                bytes.extend(floats(&ray.direction));
                bytes.extend(floats(&[ray.t_max]));
            }
        }
    }
    std::fs::write(folder.join(format!("{number}.rays")), bytes)?;
    println!("{}", mesh.name);
    Ok(())
}

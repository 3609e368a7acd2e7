//! Worlds that several tests use.

use glam::{DAffine3, DVec3};
use raycam_scene::{Mesh, Object, World};
use raycam_settle::Request;

/// Adds an object with this mesh.
pub fn add(world: &mut World, name: &str, mesh: Mesh, place: DAffine3) -> usize {
    world.meshes.push(mesh.into());
    world.objects.push(Object::new(name, world.meshes.len() - 1, vec![0], place));
    world.objects.len() - 1
}

/// Returns a transform that only translates.
pub fn moved(x: f64, y: f64, z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(x, y, z))
}

/// Creates a request for objects that fall from their poses in the world.
pub fn request(moving: &[usize]) -> Request {
    Request { moving: moving.to_vec(), physics: Vec::new(), target: None, seed: 1, seconds: 5.0, gravity: 9.81 }
}

/// Mesh of a bowl: the paraboloid z = `depth` (r / `radius`)² around the z axis, closed by a flat bottom below it.
pub fn bowl(radius: f64, depth: f64, segments: u32) -> Mesh {
    let rings = 24;
    let mut mesh = Mesh::default();
    let ring = |mesh: &mut Mesh, r: f64, z: f64| {
        for i in 0..segments {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(segments);
            mesh.vertices.push(DVec3::new(r * angle.cos(), r * angle.sin(), z));
        }
    };
    for k in 0..=rings {
        let r = radius * f64::from(k) / f64::from(rings);
        ring(&mut mesh, r, depth * (r / radius).powi(2));
    }
    ring(&mut mesh, radius, -0.1 * depth);
    ring(&mut mesh, 0.0, -0.1 * depth);
    for k in 0..rings + 2 {
        for i in 0..segments {
            let (a, b) = (k * segments + i, k * segments + (i + 1) % segments);
            let (c, d) = (a + segments, b + segments);
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    mesh
}

//! Primitive shapes as meshes centred at the origin: box, plane, sphere, cylinder, cone, torus.
//!
//! Closed shapes are watertight: vertices at the same point have exactly equal coordinates. Some vertices occur more
//! than once, because corners and texture seams require separate normals and texture coordinates. Triangles are
//! counter-clockwise as seen from outside. Round shapes have shading normals.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::error::{Result, SceneError};
use crate::mesh::Mesh;

/// Maximum number of times that [`sphere`] splits its faces: 5,242,880 triangles.
pub const MAX_LEVEL: u32 = 9;
/// Maximum number of segments of [`cylinder`] and [`cone`].
pub const MAX_SEGMENTS: u32 = 4096;
/// Maximum number of segments of [`torus`]: 4,194,304 triangles.
pub const MAX_TORUS_SEGMENTS: u32 = 2048;

/// An axis-aligned box of edge lengths `size`: 12 triangles, two for each of the faces -x, +x, -y, +y, -z, +z, in this
/// order. Texture coordinates cover each face once.
///
/// # Errors
/// [`SceneError::World`] if an edge length is not finite and > 0.
pub fn box_(size: [f64; 3]) -> Result<Mesh> {
    check_lengths("box size", &size)?;
    // For each face: the outward direction, then the directions that are right and up in the face's texture as seen
    // from outside.
    let faces = [
        (-DVec3::X, -DVec3::Y, DVec3::Z),
        (DVec3::X, DVec3::Y, DVec3::Z),
        (-DVec3::Y, DVec3::X, DVec3::Z),
        (DVec3::Y, -DVec3::X, DVec3::Z),
        (-DVec3::Z, DVec3::X, -DVec3::Y),
        (DVec3::Z, DVec3::X, DVec3::Y),
    ];
    let half = DVec3::from_array(size) / 2.0;
    let mut builder = MeshBuilder::default();
    for (out, right, up) in faces {
        builder.quad(
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| (half * (out + right * x + up * y), DVec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y))),
        );
    }
    Ok(builder.flat())
}

/// A rectangle in the xy plane that faces +z, 2 triangles.
///
/// # Errors
/// [`SceneError::World`] if an edge length is not finite and > 0.
pub fn plane(size: [f64; 2]) -> Result<Mesh> {
    check_lengths("plane size", &size)?;
    let half = DVec3::new(size[0] / 2.0, size[1] / 2.0, 0.0);
    let mut builder = MeshBuilder::default();
    builder.quad(
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| (half * DVec3::new(x, y, 0.0), DVec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y))),
    );
    Ok(builder.flat())
}

/// An icosphere: an icosahedron whose 20 faces are split into four `level` times, with all vertices on the sphere.
/// Texture coordinates are longitude (u, eastwards; 0.5 at +x) and colatitude (v, from the top at +z).
///
/// # Errors
/// [`SceneError::World`] if the radius is not finite and > 0, or if the level exceeds [`MAX_LEVEL`].
pub fn sphere(radius: f64, level: u32) -> Result<Mesh> {
    check_lengths("sphere radius", &[radius])?;
    if level > MAX_LEVEL {
        return Err(SceneError::mesh(format!("sphere level {level}; expected 0 to {MAX_LEVEL}")));
    }
    let (directions, triangles) = icosphere(level);
    let mut builder = MeshBuilder::default();
    // A vertex occurs once for each of its longitudes: twice on the seam, and once per triangle at the poles.
    let mut copies: HashMap<(u32, u64), u32> = HashMap::new();
    for corners in triangles {
        let axes = corners.map(|corner| directions[corner as usize]);
        let pole = axes.map(|d| d.x == 0.0 && d.y == 0.0);
        let mut u = axes.map(|d| 0.5 + d.y.atan2(d.x) / TAU);
        let east = (0..3).filter(|&i| !pole[i]).map(|i| u[i]).fold(0.0, f64::max);
        for u in &mut u {
            if east - *u > 0.5 {
                *u += 1.0;
            }
        }
        if let Some(i) = pole.iter().position(|&pole| pole) {
            u[i] = 0.5 * (u[(i + 1) % 3] + u[(i + 2) % 3]);
        }
        let triangle = [0, 1, 2].map(|i| {
            *copies.entry((corners[i], u[i].to_bits())).or_insert_with(|| {
                let v = axes[i].z.clamp(-1.0, 1.0).acos() / (TAU / 2.0);
                builder.vertex(radius * axes[i], DVec2::new(u[i], v), axes[i])
            })
        });
        builder.mesh.triangles.push(triangle);
    }
    Ok(builder.smooth())
}

/// A closed cylinder around the z axis from `-height / 2` to `height / 2`: the side, then the bottom, then the top.
///
/// # Errors
/// [`SceneError::World`] if a length is not finite and > 0, or if segments is not in 3..=[`MAX_SEGMENTS`].
pub fn cylinder(radius: f64, height: f64, segments: u32) -> Result<Mesh> {
    check_lengths("cylinder radius and height", &[radius, height])?;
    check_segments("cylinder", segments, MAX_SEGMENTS)?;
    let ring = unit_circle(segments);
    let (bottom, top) = (DVec3::new(0.0, 0.0, -height / 2.0), DVec3::new(0.0, 0.0, height / 2.0));
    let mut builder = MeshBuilder::default();
    let side: Vec<[u32; 2]> = (0..=segments)
        .map(|i| {
            let out = ring[(i % segments) as usize];
            let u = f64::from(i) / f64::from(segments);
            [(bottom, 1.0), (top, 0.0)].map(|(end, v)| builder.vertex(radius * out + end, DVec2::new(u, v), out))
        })
        .collect();
    for pair in side.windows(2) {
        let [[a, d], [b, c]] = [pair[0], pair[1]];
        builder.mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    builder.disk(&ring, radius, bottom, -1.0);
    builder.disk(&ring, radius, top, 1.0);
    Ok(builder.smooth())
}

/// A closed cone around the z axis, its base at `-height / 2`, its tip at `height / 2`: the side, then the base.
///
/// # Errors
/// [`SceneError::World`] if a length is not finite and > 0, or if segments is not in 3..=[`MAX_SEGMENTS`].
pub fn cone(radius: f64, height: f64, segments: u32) -> Result<Mesh> {
    check_lengths("cone radius and height", &[radius, height])?;
    check_segments("cone", segments, MAX_SEGMENTS)?;
    let ring = unit_circle(segments);
    let (base, tip) = (DVec3::new(0.0, 0.0, -height / 2.0), DVec3::new(0.0, 0.0, height / 2.0));
    let normal = |out: DVec3| (height * out + radius * DVec3::Z).normalize();
    let mut builder = MeshBuilder::default();
    let rim: Vec<u32> = (0..=segments)
        .map(|i| {
            let out = ring[(i % segments) as usize];
            let u = f64::from(i) / f64::from(segments);
            builder.vertex(radius * out + base, DVec2::new(u, 1.0), normal(out))
        })
        .collect();
    for (i, pair) in rim.windows(2).enumerate() {
        // The tip has no unique normal, so each side triangle has its own tip vertex with its own normal.
        let out = (ring[i] + ring[(i + 1) % ring.len()]).normalize_or(DVec3::X);
        let u = (i as f64 + 0.5) / f64::from(segments);
        let tip = builder.vertex(tip, DVec2::new(u, 0.0), normal(out));
        builder.mesh.triangles.push([pair[0], pair[1], tip]);
    }
    builder.disk(&ring, radius, base, -1.0);
    Ok(builder.smooth())
}

/// A torus around the z axis: a tube of radius `tube` < `radius` around a circle of `radius`, with `segments` around
/// the axis and half as many, at least 3, around the tube.
///
/// # Errors
/// [`SceneError::World`] if a length is not finite and > 0, if `tube >= radius`, or if segments is not in
/// 3..=[`MAX_TORUS_SEGMENTS`].
pub fn torus(radius: f64, tube: f64, segments: u32) -> Result<Mesh> {
    check_lengths("torus radius and tube", &[radius, tube])?;
    check_segments("torus", segments, MAX_TORUS_SEGMENTS)?;
    if tube >= radius {
        return Err(SceneError::mesh(format!(
            "a torus of radius {radius} and tube {tube}; expected tube < radius, otherwise it would intersect itself"
        )));
    }
    let around = unit_circle(segments);
    let across = unit_circle((segments / 2).max(3));
    let (rows, columns) = (across.len(), around.len());
    let mut builder = MeshBuilder::default();
    for i in 0..=columns {
        let out = around[i % columns];
        for j in 0..=rows {
            let section = across[j % rows];
            let normal = out * section.x + DVec3::Z * section.y;
            let uv = DVec2::new(i as f64 / columns as f64, 1.0 - j as f64 / rows as f64);
            builder.vertex(radius * out + tube * normal, uv, normal);
        }
    }
    let index = |i: usize, j: usize| (i * (rows + 1) + j) as u32;
    for i in 0..columns {
        for j in 0..rows {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            builder.mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Ok(builder.smooth())
}

/// Directions of an icosphere with a vertex on the z axis, and its triangles.
fn icosphere(level: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    // Rings of five vertices at latitudes ±atan(1/2), offset by half a side.
    let (z, r) = (0.2_f64.sqrt(), 0.8_f64.sqrt());
    let on_ring = |turn: f64, z: f64| {
        let (sin, cos) = (TAU * turn / 5.0).sin_cos();
        DVec3::new(r * cos, r * sin, z).normalize()
    };
    let mut directions = vec![DVec3::Z];
    directions.extend((0..5).map(|i| on_ring(f64::from(i), z)));
    directions.extend((0..5).map(|i| on_ring(f64::from(i) + 0.5, -z)));
    directions.push(-DVec3::Z);
    let mut triangles = Vec::new();
    for i in 0..5 {
        let next = (i + 1) % 5;
        let [a, b, c, d] = [1 + i, 1 + next, 6 + i, 6 + next];
        triangles.extend([[0, a, b], [a, c, b], [b, c, d], [11, d, c]]);
    }
    for _ in 0..level {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                directions.push((directions[a as usize] + directions[b as usize]).normalize());
                directions.len() as u32 - 1
            })
        };
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]: [u32; 3]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (directions, triangles)
}

/// Points of the unit circle in the xy plane, counter-clockwise from +x.
fn unit_circle(segments: u32) -> Vec<DVec3> {
    (0..segments)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(segments)).sin_cos();
            DVec3::new(cos, sin, 0.0)
        })
        .collect()
}

/// Mesh under construction, with texture coordinates and normals.
#[derive(Default)]
struct MeshBuilder {
    mesh: Mesh,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
}

impl MeshBuilder {
    fn vertex(&mut self, position: DVec3, uv: DVec2, normal: DVec3) -> u32 {
        self.mesh.vertices.push(position);
        self.uvs.push(uv.as_vec2().to_array());
        self.normals.push(normal.as_vec3().to_array());
        self.mesh.vertices.len() as u32 - 1
    }

    /// Adds two triangles between four corners, counter-clockwise.
    fn quad(&mut self, corners: [(DVec3, DVec2); 4]) {
        let [a, b, c, d] = corners.map(|(position, uv)| self.vertex(position, uv, DVec3::ZERO));
        self.mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// Adds a disk around a point of the z axis that faces `facing` (1: up, -1: down).
    fn disk(&mut self, ring: &[DVec3], radius: f64, center: DVec3, facing: f64) {
        let normal = DVec3::Z * facing;
        let middle = self.vertex(center, DVec2::splat(0.5), normal);
        let rim: Vec<u32> = ring
            .iter()
            .map(|&out| {
                let uv = DVec2::new(0.5 + 0.5 * out.x, 0.5 - 0.5 * facing * out.y);
                self.vertex(radius * out + center, uv, normal)
            })
            .collect();
        for (i, &a) in rim.iter().enumerate() {
            let b = rim[(i + 1) % rim.len()];
            self.mesh.triangles.push(if facing > 0.0 { [middle, a, b] } else { [middle, b, a] });
        }
    }

    /// Returns the mesh with flat triangles.
    fn flat(self) -> Mesh {
        Mesh { uvs: Some(self.uvs), ..self.mesh }
    }

    /// Returns the mesh with shading normals.
    fn smooth(self) -> Mesh {
        Mesh { uvs: Some(self.uvs), normals: Some(self.normals), ..self.mesh }
    }
}

fn check_lengths(what: &str, lengths: &[f64]) -> Result<()> {
    if lengths.iter().all(|v| v.is_finite() && *v > 0.0) {
        return Ok(());
    }
    Err(SceneError::mesh(format!("{what} {lengths:?}; expected finite lengths greater than 0")))
}

fn check_segments(what: &str, segments: u32, most: u32) -> Result<()> {
    if (3..=most).contains(&segments) {
        return Ok(());
    }
    Err(SceneError::mesh(format!("a {what} of {segments} segments; expected 3 to {most}")))
}

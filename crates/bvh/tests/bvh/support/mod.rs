//! Meshes, rays and float64 brute force for the tests.
#![allow(dead_code, clippy::type_complexity, clippy::needless_range_loop)]

pub mod brute;
pub mod edge_rays;

use std::sync::Arc;

use raycam_bvh::{Bvh, ExactRay, ExactTriangles, Instance, InstructionSet, Ray, Scene};

pub const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// A small random number generator (xorshift64*).
pub struct Rng(pub u64);

impl Rng {
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() >> 33) as usize % n
    }
    /// A random number between -1 and 1.
    pub fn signed(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
    pub fn vector(&mut self) -> [f32; 3] {
        [self.signed(), self.signed(), self.signed()]
    }
}

#[derive(Clone)]
pub struct Mesh {
    pub vertices: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn build(&self) -> Arc<Bvh> {
        Arc::new(Bvh::build(&self.vertices, &self.triangles).unwrap())
    }
    pub fn scene(&self) -> Scene {
        Scene::build(vec![Instance { bvh: self.build(), world_from_mesh: IDENTITY }], [0.0; 3]).unwrap()
    }
}

/// Triangles of random size and position.
pub fn soup(n: usize, size: f32, rng: &mut Rng) -> Mesh {
    let mut vertices = vec![];
    for _ in 0..n {
        let centre = rng.vector();
        for _ in 0..3 {
            let d = rng.vector();
            vertices.push(std::array::from_fn(|a| centre[a] + size * d[a]));
        }
    }
    Mesh { vertices, triangles: (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect() }
}

/// A closed, bumpy sphere around the origin, with `n` rings.
pub fn sphere(n: usize, rng: &mut Rng) -> Mesh {
    let m = 2 * n;
    let mut vertices = vec![[0.0, 0.0, 1.0f32], [0.0, 0.0, -1.0]];
    for i in 1..n {
        for j in 0..m {
            let (a, b) = (std::f32::consts::PI * i as f32 / n as f32, std::f32::consts::TAU * j as f32 / m as f32);
            let r = 1.0 + 0.1 * rng.signed();
            vertices.push([r * a.sin() * b.cos(), r * a.sin() * b.sin(), r * a.cos()]);
        }
    }
    let at = |i: usize, j: usize| (2 + (i - 1) * m + j % m) as u32;
    let mut triangles = vec![];
    for j in 0..m {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([1, at(n - 1, j + 1), at(n - 1, j)]);
        for i in 1..n - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    Mesh { vertices, triangles }
}

/// A flat square grid at z = 0 with vertices on integers: rays along z meet edges and vertices exactly.
pub fn grid(n: usize) -> Mesh {
    let vertices = (0..(n + 1) * (n + 1)).map(|k| [(k % (n + 1)) as f32, (k / (n + 1)) as f32, 0.0]).collect();
    let mut triangles = vec![];
    for k in 0..n * n {
        let a = (k / n * (n + 1) + k % n) as u32;
        let b = a + n as u32 + 1;
        triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    Mesh { vertices, triangles }
}

/// Rays from around a box of `size`, most of them towards the box.
pub fn rays(n: usize, size: f32, rng: &mut Rng) -> Vec<Ray> {
    (0..n)
        .map(|i| {
            let origin = rng.vector().map(|x| 2.0 * size * x);
            let target = rng.vector().map(|x| size * x);
            let direction = std::array::from_fn(|a| target[a] - origin[a]);
            let t_max = if i % 4 == 0 { 0.5 + rng.signed() } else { f32::INFINITY };
            Ray { origin, direction, t_max }
        })
        .collect()
}

pub fn exact(ray: &Ray) -> ExactRay {
    ExactRay {
        origin: ray.origin.map(f64::from),
        direction: ray.direction.map(f64::from),
        t_min: 0.0,
        t_max: f64::from(ray.t_max),
    }
}

pub fn available() -> impl Iterator<Item = InstructionSet> {
    InstructionSet::ALL.into_iter().filter(|isa| isa.is_available())
}

/// Placed meshes in float64.
pub struct World {
    pub instances: Vec<(Vec<[f64; 3]>, Vec<[u32; 3]>, [[f64; 4]; 3])>,
    pub origin: [f64; 3],
}

impl World {
    pub fn of(mesh: &Mesh) -> World {
        let vertices = mesh.vertices.iter().map(|v| v.map(f64::from)).collect();
        World {
            instances: vec![(vertices, mesh.triangles.clone(), IDENTITY.map(|r| r.map(f64::from)))],
            origin: [0.0; 3],
        }
    }

    /// Builds the scene of the meshes, rounded to float32.
    pub fn scene(&self) -> Scene {
        let instances = self.instances.iter().map(|(vertices, triangles, matrix)| {
            let vertices = vertices.iter().map(|v| v.map(|x| x as f32)).collect();
            let bvh = Mesh { vertices, triangles: triangles.clone() }.build();
            let mut local = *matrix;
            for axis in 0..3 {
                local[axis][3] -= self.origin[axis];
            }
            Instance { bvh, world_from_mesh: local.map(|r| r.map(|x| x as f32)) }
        });
        Scene::build(instances.collect(), self.origin).unwrap()
    }

    /// Brute force: the nearest t, instance and triangle, and the t of the next nearest triangle.
    pub fn nearest(&self, ray: &ExactRay) -> (f64, u32, u32, f64) {
        let mut best = (f64::INFINITY, u32::MAX, u32::MAX, f64::INFINITY);
        for (i, (_, triangles, _)) in self.instances.iter().enumerate() {
            for k in 0..triangles.len() {
                let Some(t) = intersect(ray, self.corners(i as u32, k as u32)) else {
                    continue;
                };
                if t > ray.t_max {
                    continue;
                }
                if t < best.0 {
                    best = (t, i as u32, k as u32, best.0);
                } else if t < best.3 {
                    best.3 = t;
                }
            }
        }
        best
    }
}

impl ExactTriangles for World {
    fn corners(&self, instance: u32, triangle: u32) -> [[f64; 3]; 3] {
        let (vertices, triangles, m) = &self.instances[instance as usize];
        triangles[triangle as usize].map(|i| {
            let v = vertices[i as usize];
            std::array::from_fn(|r| m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2] + m[r][3])
        })
    }
}

/// The t at which a ray hits a triangle (Möller and Trumbore 1997), in float64.
pub fn intersect(ray: &ExactRay, [a, b, c]: [[f64; 3]; 3]) -> Option<f64> {
    let sub = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (e1, e2, s) = (sub(b, a), sub(c, a), sub(ray.origin, a));
    let p = cross(ray.direction, e2);
    let det = dot(e1, p);
    let q = cross(s, e1);
    let (u, v, t) = (dot(s, p) / det, dot(ray.direction, q) / det, dot(e2, q) / det);
    (det != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

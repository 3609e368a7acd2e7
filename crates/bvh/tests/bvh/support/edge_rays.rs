//! Rays aimed at the edges and vertices of closed meshes; no ray may pass through.
#![allow(dead_code)]

use std::sync::Arc;

use raycam_bvh::{
    Bvh, Coherence, ExactHit, ExactRay, ExactTriangles, Hit, INVALID_ID, Instance, InstructionSet, Ray, Scene,
};

/// A small random number generator (xorshift64*).
pub struct Rng(pub u64);

impl Rng {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }
    fn below(&mut self, n: usize) -> usize {
        (self.next() >> 33) as usize % n
    }
    /// A random number from 0 to 1.
    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }
}

/// A closed mesh, star-shaped around `centre`, and its transform to the scene.
pub struct Closed {
    pub name: String,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    centre: [f32; 3],
    /// Distance from the centre along each axis; from all positions within this distance, the whole inside of the mesh
    /// is visible.
    room: f32,
    place: [[f32; 4]; 3],
}

const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// A bumpy sphere of `rings` by `sectors`; `thin` squashes the mesh along z.
fn bumpy(
    name: &str,
    (rings, sectors): (usize, usize),
    size: f32,
    thin: f32,
    centre: [f32; 3],
    place: [[f32; 4]; 3],
) -> Closed {
    let mut rng = Rng(77);
    let (n, m) = (rings, sectors);
    let point = |a: f32, b: f32, r: f32| {
        let p = [r * a.sin() * b.cos(), r * a.sin() * b.sin(), thin * r * a.cos()];
        std::array::from_fn(|k| centre[k] + size * p[k])
    };
    let mut vertices = vec![point(0.0, 0.0, 1.0), point(std::f32::consts::PI, 0.0, 1.0)];
    for i in 1..n {
        for j in 0..m {
            let (a, b) = (std::f32::consts::PI * i as f32 / n as f32, std::f32::consts::TAU * j as f32 / m as f32);
            // The bumps are flat enough that they hide no part of the inside from positions near the centre, including
            // the seam where the sectors meet.
            let bump = 4.0 / m.max(80) as f32 * a.sin() * rng.unit();
            vertices.push(point(a, b, 1.0 + bump));
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
    Closed { name: name.into(), vertices, triangles, centre, room: 0.1 * size * thin.min(1.0), place }
}

/// The offset at which a crack was found in early versions of Embree.
const FAR: [f32; 3] = [148_376.0, 1234.0, -223_423.0];

/// The closed meshes that the rays are aimed at.
pub fn meshes() -> Vec<Closed> {
    let zero = [0.0; 3];
    let round = (40, 80);
    let mut all = vec![];
    for exponent in [-6, -3, 0, 3, 6] {
        let name = format!("scale 1e{exponent}");
        all.push(bumpy(&name, round, 10f32.powi(exponent), 1.0, zero, IDENTITY));
    }
    all.push(bumpy("far from the origin", round, 1000.0, 1.0, FAR, IDENTITY));
    all.push(bumpy("squashed a thousandfold", round, 1.0, 1e-3, zero, IDENTITY));
    all.push(bumpy("needles, a million times as long as wide", (6, 12), 1.0, 1e6, zero, IDENTITY));
    all.push(bumpy("slivers, 2000 in a ring", (4, 2000), 1.0, 1.0, zero, IDENTITY));
    let sheared = [[1.0, 0.7, -0.3, 5.0], [0.2, -1.5, 0.4, -7.0], [0.1, 0.6, 0.9, 2.0]];
    all.push(bumpy("sheared and mirrored", round, 1.0, 1.0, zero, sheared));
    let mirrored_far = [[-100.0, 0.0, 0.0, FAR[0]], [0.0, 100.0, 0.0, FAR[1]], [0.0, 0.0, 100.0, FAR[2]]];
    all.push(bumpy("mirrored and far away", round, 1.0, 1.0, zero, mirrored_far));
    let slanted = [[1.0, 30.0, 0.0, 1.0], [0.0, 1.0, 0.0, 2.0], [0.0, 0.0, 0.5, 3.0]];
    all.push(bumpy("sheared thirtyfold", round, 1.0, 1.0, zero, slanted));
    all
}

/// Numbers of rays by outcome.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub rays: u64,
    pub leaks: u64,
}

/// Moves a float by up to 4 ulp.
fn jiggle(x: f32, rng: &mut Rng) -> f32 {
    let steps = rng.below(9) as i32 - 4;
    (0..steps.abs()).fold(x, |x, _| if steps > 0 { x.next_up() } else { x.next_down() })
}

impl Closed {
    /// Builds a scene that contains the mesh.
    pub fn scene(&self, isa: InstructionSet) -> Result<Scene, Box<dyn std::error::Error>> {
        let bvh = Arc::new(Bvh::build(&self.vertices, &self.triangles)?);
        let mut scene = Scene::build(vec![Instance { bvh, world_from_mesh: self.place }], [0.0; 3])?;
        if !scene.set_instruction_set(isa) {
            return Err(format!("no {} here", isa.name()).into());
        }
        Ok(scene)
    }

    fn placed(&self, p: [f32; 3]) -> [f32; 3] {
        self.place.map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3])
    }

    /// The positions of all vertices in the scene, in float32.
    pub fn placed_vertices(&self) -> Vec<[f32; 3]> {
        self.vertices.iter().map(|v| self.placed(*v)).collect()
    }

    /// The corner indices of every triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Creates [`BATCH`] rays through points on vertices and edges or within 4 ulp of them; returns the coherence with
    /// which they are to be traced. All must hit the mesh before their t_max: rays from inside (half of the batches,
    /// each from one point) cannot leave the mesh, and rays from outside end deep inside.
    pub fn aim(&self, rays: &mut Vec<Ray>, rng: &mut Rng) -> Coherence {
        let inside = rng.below(2) == 0;
        rays.clear();
        let deep = self.placed(std::array::from_fn(|a| self.centre[a] + self.room * (2.0 * rng.unit() - 1.0)));
        // Distance from the centre at which outside rays start, as a multiple of the surface's distance.
        let away = 10f32.powf(5.0 * rng.unit() - 2.0);
        for _ in 0..BATCH {
            let triangle = self.triangles[rng.below(self.triangles.len())];
            let k = rng.below(3);
            let [a, b] = [k, (k + 1) % 3].map(|k| self.vertices[triangle[k] as usize]);
            let s = if rng.below(4) == 0 { 0.0 } else { rng.unit() };
            let target = self.placed(std::array::from_fn(|i| a[i] + s * (b[i] - a[i])));
            let target = target.map(|x| jiggle(x, rng));
            let (origin, t_max) = if inside {
                (deep, f32::INFINITY)
            } else {
                let origin = std::array::from_fn(|i| target[i] + away * (target[i] - deep[i]));
                (origin, (1.0 + away) / away)
            };
            let direction = std::array::from_fn(|i| target[i] - origin[i]);
            rays.push(Ray { origin, direction, t_max });
        }
        [Coherence::Coherent, Coherence::Incoherent][rng.below(2)]
    }

    /// Aims `n` rays at vertices and edges, from inside and from outside; no ray may pass through in any query.
    pub fn trial(&self, scene: &Scene, n: usize, seed: u64) -> Tally {
        let mut rng = Rng(seed * 2 + 1);
        let mut tally = Tally::default();
        let mut rays = Vec::with_capacity(BATCH);
        let mut hits = [Hit::MISS; BATCH];
        let mut exact = [ExactHit::MISS; BATCH / 16];
        let mut occluded = [false; BATCH];
        while (tally.rays as usize) < n {
            let coherence = self.aim(&mut rays, &mut rng);
            scene.closest(&rays, &mut hits, coherence);
            scene.occluded(&rays, &mut occluded, coherence);
            let in_float64 = rays[..BATCH / 16].iter().map(|ray| ExactRay {
                origin: ray.origin.map(f64::from),
                direction: ray.direction.map(f64::from),
                t_min: 0.0,
                t_max: f64::from(ray.t_max),
            });
            scene.closest_exact(&in_float64.collect::<Vec<_>>(), self, &mut exact);
            tally.rays += BATCH as u64;
            let answers = hits.iter().zip(&occluded);
            tally.leaks += answers.filter(|(hit, occluded)| hit.triangle == INVALID_ID || !**occluded).count() as u64;
            tally.leaks += exact.iter().filter(|hit| hit.triangle == INVALID_ID).count() as u64;
        }
        tally
    }
}

/// Number of rays traced together.
pub const BATCH: usize = 1024;

impl ExactTriangles for Closed {
    fn corners(&self, _instance: u32, triangle: u32) -> [[f64; 3]; 3] {
        let place = self.place.map(|row| row.map(f64::from));
        self.triangles[triangle as usize].map(|index| {
            let p = self.vertices[index as usize].map(f64::from);
            place.map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3])
        })
    }
}

//! Rays aimed at the edges and vertices of closed meshes, none of which may pass through.

use std::sync::Arc;

use raycam_bvh::{
    BuildOptions, Bvh, Coherence, Hit, Instance, InstructionSet, NOTHING, Quality, Ray, Scene,
};

/// xorshift64*
struct Rng(u64);

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
    /// 0 to 1.
    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }
}

/// A closed mesh around `centre`, star-shaped as seen from there, and where it lies in the scene.
pub struct Closed {
    pub name: String,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    centre: [f32; 3],
    size: f32,
    place: [[f32; 4]; 3],
}

const IDENTITY: [[f32; 4]; 3] = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];

/// A bumpy sphere of `n` rings; `thin` squashes it along z.
fn bumpy(
    name: &str,
    n: usize,
    size: f32,
    thin: f32,
    centre: [f32; 3],
    place: [[f32; 4]; 3],
) -> Closed {
    let mut rng = Rng(77);
    let m = 2 * n;
    let point = |a: f32, b: f32, r: f32| {
        let p = [
            r * a.sin() * b.cos(),
            r * a.sin() * b.sin(),
            thin * r * a.cos(),
        ];
        std::array::from_fn(|k| centre[k] + size * p[k])
    };
    let mut vertices = vec![point(0.0, 0.0, 1.0), point(std::f32::consts::PI, 0.0, 1.0)];
    for i in 1..n {
        for j in 0..m {
            let (a, b) = (
                std::f32::consts::PI * i as f32 / n as f32,
                std::f32::consts::TAU * j as f32 / m as f32,
            );
            vertices.push(point(a, b, 1.0 + 0.05 * rng.unit()));
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
    Closed {
        name: name.into(),
        vertices,
        triangles,
        centre,
        size: size * thin.min(1.0),
        place,
    }
}

/// The meshes of the trial.
pub fn meshes() -> Vec<Closed> {
    let zero = [0.0; 3];
    let mut all = vec![];
    for exponent in [-6, -3, 0, 3, 6] {
        all.push(bumpy(
            &format!("scale 1e{exponent}"),
            40,
            10f32.powi(exponent),
            1.0,
            zero,
            IDENTITY,
        ));
    }
    let far = [148_376.0, 1234.0, -223_423.0];
    all.push(bumpy("far from the origin", 40, 1000.0, 1.0, far, IDENTITY));
    all.push(bumpy(
        "squashed a thousandfold",
        40,
        1.0,
        1e-3,
        zero,
        IDENTITY,
    ));
    all.push(bumpy("needles", 6, 1.0, 1e6, zero, IDENTITY));
    let sheared = [
        [1.0, 0.7, -0.3, 5.0],
        [0.2, -1.5, 0.4, -7.0],
        [0.1, 0.6, 0.9, 2.0],
    ];
    all.push(bumpy("sheared and mirrored", 40, 1.0, 1.0, zero, sheared));
    all
}

/// What happened to the rays.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub rays: u64,
    pub leaks: u64,
}

/// Moves a float by up to 4 ulp.
fn jiggle(x: f32, rng: &mut Rng) -> f32 {
    let steps = rng.below(9) as i32 - 4;
    (0..steps.abs()).fold(x, |x, _| {
        if steps > 0 {
            x.next_up()
        } else {
            x.next_down()
        }
    })
}

impl Closed {
    /// Builds it.
    pub fn scene(
        &self,
        quality: Quality,
        isa: InstructionSet,
    ) -> Result<Scene, Box<dyn std::error::Error>> {
        let bvh = Arc::new(Bvh::build(
            &self.vertices,
            &self.triangles,
            &BuildOptions { quality },
        )?);
        let mut scene = Scene::build(
            vec![Instance {
                bvh,
                world_from_mesh: self.place,
            }],
            [0.0; 3],
        )?;
        if !scene.set_instruction_set(isa) {
            return Err(format!("no {} here", isa.name()).into());
        }
        Ok(scene)
    }

    fn placed(&self, p: [f32; 3]) -> [f32; 3] {
        self.place
            .map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3])
    }

    /// Aims `n` rays at vertices and edges, from inside: none may get out. Half of them go together.
    pub fn trial(&self, scene: &Scene, n: usize, seed: u64) -> Tally {
        let mut rng = Rng(seed * 2 + 1);
        let mut tally = Tally::default();
        let mut rays = Vec::with_capacity(1024);
        let mut hits = vec![Hit::MISS; 1024];
        let mut dark = vec![false; 1024];
        while (tally.rays as usize) < n {
            rays.clear();
            // From the centre or, where there is room, from near it; many rays in a row start at the same point.
            let near = self.size * 0.2;
            let start = self.placed(std::array::from_fn(|a| {
                self.centre[a] + near * (rng.unit() - 0.5)
            }));
            for _ in 0..1024 {
                let triangle = self.triangles[rng.below(self.triangles.len())];
                let k = rng.below(3);
                let (a, b) = (
                    self.vertices[triangle[k] as usize],
                    self.vertices[triangle[(k + 1) % 3] as usize],
                );
                let s = if rng.below(4) == 0 { 0.0 } else { rng.unit() };
                let target = self.placed(std::array::from_fn(|i| a[i] + s * (b[i] - a[i])));
                let direction = std::array::from_fn(|i| jiggle(target[i], &mut rng) - start[i]);
                rays.push(Ray {
                    origin: start,
                    direction,
                    t_max: f32::INFINITY,
                });
            }
            let coherence = [Coherence::Coherent, Coherence::Incoherent][rng.below(2)];
            scene.closest(&rays, &mut hits, coherence);
            scene.occluded(&rays, &mut dark, coherence);
            tally.rays += 1024;
            tally.leaks += hits
                .iter()
                .zip(&dark)
                .filter(|(hit, dark)| hit.triangle == NOTHING || !**dark)
                .count() as u64;
        }
        tally
    }
}

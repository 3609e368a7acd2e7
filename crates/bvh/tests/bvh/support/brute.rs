//! Every ray against every triangle in float64, in Plücker coordinates: an independent reference for the kernels'
//! answers.
//!
//! The sign of a volume determines on which side a ray passes an edge; divided by a length, the volume is the distance
//! from the edge. Float32 cannot distinguish hits within the *tie band*. On either side of an edge, the band is
//! [`BAND`] times the distance from the ray's origin to the triangle. On either side of the triangle's plane, it is
//! larger by the triangle's ratio of length to width, because t is computed from the volumes and they depend on the
//! width. An answer is correct if its triangle is hit, possibly only within the band, and no triangle that is certainly
//! hit is nearer. All other answers are wrong.
#![allow(clippy::needless_range_loop)]

use std::sync::Arc;

use raycam_bvh::{
    Bvh, ClosestPoint, Coherence, ExactHit, ExactRay, ExactTriangles, Hit, INVALID_ID, Instance, InstructionSet, Ray,
    Scene, squared_distance_to_triangle,
};

/// The tie band of float32 answers, as a relative difference: 17 rounding errors.
pub const BAND: f64 = 1e-6;

/// The tie band of float64 answers, as a relative difference.
pub const EXACT_BAND: f64 = 1e-13;

type V3 = [f64; 3];

fn sub(a: V3, b: V3) -> V3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: V3) -> f64 {
    dot(a, a).sqrt()
}

/// A mesh in the form that the brute-force reference requires.
pub struct Brute {
    pub name: String,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Direction and moment of the three edges of each triangle, component by component.
    edges: [Vec<f64>; 18],
    /// Upper bound on the distance of vertices from the origin.
    reach: f64,
    longest_edge: f64,
}

/// A triangle that a ray hits, possibly only within the band.
#[derive(Clone, Copy, Debug)]
pub struct Intersection {
    pub triangle: u32,
    pub t: f64,
    /// Possible error of t.
    pub slack: f64,
    /// True if the hit is outside the band and therefore certain.
    pub sure: bool,
}

/// Number of triangles that are tested together, so that the compiler vectorises the loop.
const ROW: usize = 16;

impl Brute {
    pub fn new(name: String, vertices: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Brute {
        let mut edges: [Vec<f64>; 18] = Default::default();
        let mut longest_edge = 0.0f64;
        for triangle in &triangles {
            let p = triangle.map(|i| vertices[i as usize].map(f64::from));
            for k in 0..3 {
                let (a, b) = (p[k], p[(k + 1) % 3]);
                let (along, moment) = (sub(b, a), cross(a, b));
                longest_edge = longest_edge.max(length(along));
                for axis in 0..3 {
                    edges[6 * k + axis].push(along[axis]);
                    edges[6 * k + 3 + axis].push(moment[axis]);
                }
            }
        }
        let far = vertices.iter().map(|v| length(v.map(f64::from)));
        Brute { name, reach: far.fold(0.0, f64::max), vertices, triangles, edges, longest_edge }
    }

    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    pub fn scene(&self, isa: InstructionSet) -> Scene {
        let bvh = Arc::new(Bvh::build(&self.vertices, &self.triangles).unwrap());
        let world_from_mesh = [0, 1, 2].map(|r| std::array::from_fn(|c| f32::from(u8::from(r == c))));
        let instance = Instance { bvh, world_from_mesh };
        let mut scene = Scene::build(vec![instance], [0.0; 3]).unwrap();
        assert!(scene.set_instruction_set(isa));
        scene
    }

    /// Every triangle that the ray hits inside or within the band.
    pub fn met(&self, ray: &ExactRay, band: f64, met: &mut Vec<Intersection>) {
        met.clear();
        let (d, m) = (ray.direction, cross(ray.origin, ray.direction));
        let speed = length(d);
        // If the ray passes an edge on the wrong side at a larger distance, the triangle is outside the band; this
        // quick test excludes most triangles.
        let far = length(ray.origin) + self.reach;
        let outside = -speed * far * (2.0 * band * self.longest_edge + 1e-14 * far);
        let n = self.triangle_count();
        for start in (0..n).step_by(ROW) {
            let row = start..n.min(start + ROW);
            let mut sides = [[0.0; ROW]; 3];
            for k in 0..3 {
                let [ex, ey, ez, mx, my, mz] = std::array::from_fn(|i| &self.edges[6 * k + i][row.clone()]);
                for i in 0..row.len() {
                    sides[k][i] = d[0] * mx[i] + d[1] * my[i] + d[2] * mz[i];
                    sides[k][i] += m[0] * ex[i] + m[1] * ey[i] + m[2] * ez[i];
                }
            }
            for i in 0..row.len() {
                let side = [sides[0][i], sides[1][i], sides[2][i]];
                let least = side[0].min(side[1]).min(side[2]);
                let most = side[0].max(side[1]).max(side[2]);
                if least >= outside || -most >= outside {
                    met.extend(self.intersect_one(ray, start + i, band));
                }
            }
        }
    }

    /// The same test for one triangle, with volumes whose error is proportional to the edge's length.
    fn intersect_one(&self, ray: &ExactRay, k: usize, band: f64) -> Option<Intersection> {
        let p = self.triangles[k].map(|i| self.vertices[i as usize].map(f64::from));
        let away = p.map(|p| length(sub(p, ray.origin)));
        let blur = band * away.into_iter().fold(0.0, f64::max);
        let edges: [V3; 3] = std::array::from_fn(|e| sub(p[(e + 1) % 3], p[e]));
        let lengths = edges.map(length);
        let normal = cross(edges[0], edges[1]);
        let towards = dot(normal, ray.direction) / length(normal);
        let mut sure = true;
        for e in 0..3 {
            let side = dot(ray.direction, cross(sub(p[e], ray.origin), edges[e]));
            let beside = towards.signum() * side / (length(ray.direction) * lengths[e]);
            if beside < -blur {
                return None;
            }
            sure &= beside > blur;
        }
        let t = dot(normal, sub(p[0], ray.origin)) / length(normal) / towards;
        let longest = lengths.into_iter().fold(0.0, f64::max);
        let longer = longest * longest / length(normal);
        let slack = blur * longer.max(1.0) / towards.abs();
        if t.is_nan() || t < -slack || t > ray.t_max + slack {
            return None;
        }
        sure &= t > slack && t < ray.t_max - slack;
        Some(Intersection { triangle: k as u32, t, slack, sure })
    }

    /// Describes the fault of an answer, which is a triangle and its t, or `None` for a miss. Returns `None` if the
    /// answer is correct.
    pub fn fault(met: &[Intersection], answer: Option<(u32, f64)>) -> Option<String> {
        let mut sure = met.iter().filter(|met| met.sure);
        let Some((triangle, t)) = answer else {
            return sure.next_back().map(|met| format!("got a miss, expected {met:?}"));
        };
        let Some(named) = met.iter().find(|met| met.triangle == triangle) else {
            return Some(format!("got triangle {triangle} at t = {t}, which the ray does not hit"));
        };
        if (t - named.t).abs() > named.slack {
            return Some(format!("t = {t} for {named:?}"));
        }
        let nearer = |met: &&Intersection| met.t + met.slack < named.t - named.slack;
        sure.rfind(nearer).map(|met| format!("got {named:?}, but {met:?} is nearer"))
    }
}

impl ExactTriangles for Brute {
    fn corners(&self, _instance: u32, triangle: u32) -> [[f64; 3]; 3] {
        self.triangles[triangle as usize].map(|i| self.vertices[i as usize].map(f64::from))
    }
}

/// A small random number generator (xorshift64*).
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
    /// A random number from -1 to 1.
    fn signed(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }
    fn vector(&mut self) -> [f32; 3] {
        std::array::from_fn(|_| self.signed())
    }
}

/// Names of the kinds of meshes, which are created in turn.
pub const KINDS: [&str; 5] = ["soup", "grains", "needles", "grid", "heights"];

/// A hundred different meshes: random triangles of large, small and very different sizes, needles, grids whose corners
/// rays hit, height fields, and copies. They have 1 to `most` triangles, are small or large, and are centred at the
/// origin or elsewhere.
pub fn meshes(most: usize) -> Vec<Brute> {
    let mut rng = Rng(7);
    (0..100).map(|number| mesh(number, most, &mut rng)).collect()
}

fn mesh(number: usize, most: usize, rng: &mut Rng) -> Brute {
    let n = 1 + (most - 1) * (number / 5) / 19;
    let scale = [1.0, 1e-3, 1e4, 1.0][number % 4];
    let aside = if number % 3 == 2 { rng.vector().map(|x| 20.0 * x) } else { [0.0; 3] };
    let mut vertices: Vec<[f32; 3]> = vec![];
    let mut triangles = vec![];
    let kind = KINDS[number % 5];
    if number % 5 < 3 {
        for k in 0..n as u32 {
            let centre = rng.vector();
            let size = [0.6, 0.3 * rng.signed().powi(6), 0.9][number % 5];
            let (a, b) = (rng.vector(), rng.vector());
            let thin = if kind == "needles" { 1e-3 } else { 1.0 };
            vertices.push(centre);
            vertices.push(std::array::from_fn(|i| centre[i] + size * a[i]));
            vertices.push(std::array::from_fn(|i| centre[i] + size * (a[i] + thin * b[i])));
            triangles.push([3 * k, 3 * k + 1, 3 * k + 2]);
            // Occasionally, a triangle is repeated.
            if rng.below(16) == 0 && k > 0 {
                triangles[k as usize] = triangles[rng.below(k as usize)];
            }
        }
    } else {
        let side = ((n / 2) as f32).sqrt().ceil().max(1.0) as u32;
        for k in 0..(side + 1) * (side + 1) {
            let [x, y] = [k % (side + 1), k / (side + 1)].map(|i| 2.0 * i as f32 / side as f32 - 1.0);
            let z = if kind == "grid" { 0.0 } else { 0.3 * rng.signed() };
            vertices.push([x, y, z]);
        }
        for k in 0..side * side {
            let a = k / side * (side + 1) + k % side;
            let b = a + side + 1;
            triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    for v in &mut vertices {
        *v = std::array::from_fn(|i| scale * (v[i] + aside[i]));
    }
    Brute::new(format!("{number} ({kind})"), vertices, triangles)
}

/// A ray of any length towards a mesh: from around it, from far away, or from a surface; towards a triangle, towards a
/// corner, or along an axis.
fn aim(mesh: &Brute, rng: &mut Rng) -> Ray {
    let triangle = mesh.triangles[rng.below(mesh.triangles.len())];
    let [a, b, c] = triangle.map(|i| mesh.vertices[i as usize]);
    let size = (mesh.longest_edge as f32).max(1e-30);
    let (u, v) = match rng.below(8) {
        0 => (0.0, 0.0),
        1 => (0.5 * (rng.signed() + 1.0), 0.0),
        _ => (rng.signed(), rng.signed()),
    };
    let target: [f32; 3] = std::array::from_fn(|i| a[i] + u * (b[i] - a[i]) + v * (c[i] - a[i]));
    let away = [0.5, 2.0, 2.0, 30.0][rng.below(4)] * size;
    let mut offset = rng.vector().map(|x| away * x);
    if rng.below(8) == 0 {
        let axis = rng.below(3);
        offset = std::array::from_fn(|i| if i == axis { offset[i] } else { 0.0 });
    }
    let origin: [f32; 3] = std::array::from_fn(|i| target[i] + offset[i]);
    let (origin, target) = match rng.below(16) {
        0 => (target, origin),
        _ => (origin, target),
    };
    let longer = [1.0, 1.0, 1e-3, 300.0][rng.below(4)];
    Ray {
        origin,
        direction: std::array::from_fn(|i| longer * (target[i] - origin[i])),
        t_max: match rng.below(4) {
            0 => (0.5 + rng.signed().abs()) / longer,
            _ => f32::INFINITY,
        },
    }
}

/// Counts of rays by outcome.
#[derive(Debug, Default)]
pub struct Tally {
    pub rays: u64,
    pub hits: u64,
    /// Hits within the band of an edge, of another triangle or of an end of the ray.
    pub ties: u64,
    /// Float64 rays whose crossings were compared, because no crossing is within the band.
    pub counted: u64,
    /// Points whose closest points were compared.
    pub points: u64,
    pub faults: Vec<String>,
}

impl Tally {
    pub fn add(mut self, other: Tally) -> Tally {
        self.rays += other.rays;
        self.hits += other.hits;
        self.ties += other.ties;
        self.counted += other.counted;
        self.points += other.points;
        self.faults.extend(other.faults);
        self
    }
}

const BATCH: usize = 512;

/// Number of rays per batch that are also traced in float64.
const EXACT_BATCH: usize = BATCH / 8;

/// Float64 answers for the first rays of a batch, and the closest points to the origins of these rays.
struct ExactAnswers {
    hits: [ExactHit; EXACT_BATCH],
    occluded: [bool; EXACT_BATCH],
    counts: [i32; EXACT_BATCH],
    closest: [ClosestPoint; EXACT_BATCH],
}

impl ExactAnswers {
    fn new(scene: &Scene, mesh: &Brute, rays: &[ExactRay]) -> ExactAnswers {
        let mut found = ExactAnswers {
            hits: [ExactHit::MISS; EXACT_BATCH],
            occluded: [false; EXACT_BATCH],
            counts: [0; EXACT_BATCH],
            closest: [ClosestPoint::MISS; EXACT_BATCH],
        };
        scene.closest_exact(rays, mesh, &mut found.hits);
        scene.occluded_exact(rays, mesh, None, &mut found.occluded);
        scene.count_crossings(rays, mesh, None, false, &mut found.counts);
        let points: Vec<V3> = rays.iter().map(|ray| ray.origin).collect();
        scene.closest_points(&points, &[f64::INFINITY], mesh, None, &mut found.closest);
        found
    }

    /// Faults of the float64 answers for ray `i`; `met` contains the triangles that it hits, including hits within the
    /// float64 band.
    fn faults(&self, i: usize, mesh: &Brute, ray: &ExactRay, met: &[Intersection], tally: &mut Tally) -> Vec<String> {
        let hit = &self.hits[i];
        let answer = (hit.triangle != INVALID_ID).then_some((hit.triangle, hit.t));
        let mut faults: Vec<String> =
            Brute::fault(met, answer).map(|fault| format!("exact: {fault}")).into_iter().collect();
        if self.occluded[i] != answer.is_some() {
            faults.push(format!("exact: occluded {}, closest {answer:?}", self.occluded[i]));
        }
        if met.iter().all(|met| met.sure) {
            tally.counted += 1;
            if self.counts[i] as usize != met.len() {
                faults.push(format!("{} crossings, not {}", self.counts[i], met.len()));
            }
        }
        tally.points += 1;
        let square = |k: u32| squared_distance_to_triangle(ray.origin, mesh.corners(0, k));
        let nearest = (0..mesh.triangles.len() as u32).map(square).min_by(f64::total_cmp);
        let closest = &self.closest[i];
        let is_nearest = |least: f64| closest.distance == least.sqrt() && square(closest.triangle) == least;
        if nearest.is_some_and(|least| !is_nearest(least)) {
            faults.push(format!("closest point: got {closest:?}, expected {nearest:?}"));
        }
        faults
    }
}

/// Queries a scene of the mesh with `n` rays: closest hits, any hits and, for every eighth ray in float64, its
/// crossings and the point closest to its origin; all are compared with brute force.
pub fn trial(mesh: &Brute, scene: &Scene, n: usize, seed: u64) -> Tally {
    let mut rng = Rng(seed * 2 + 1);
    let mut tally = Tally::default();
    let mut met = vec![];
    while (tally.rays as usize) < n {
        let rays: Vec<_> = (0..BATCH).map(|_| aim(mesh, &mut rng)).collect();
        let in_float64 = rays.iter().map(|ray| ExactRay {
            origin: ray.origin.map(f64::from),
            direction: ray.direction.map(f64::from),
            t_min: 0.0,
            t_max: f64::from(ray.t_max),
        });
        let in_float64: Vec<_> = in_float64.collect();
        let (mut hits, mut occluded) = ([Hit::MISS; BATCH], [false; BATCH]);
        let exact = ExactAnswers::new(scene, mesh, &in_float64[..EXACT_BATCH]);
        let ways = [Coherence::Unknown, Coherence::Coherent, Coherence::Incoherent];
        let coherence = ways[rng.below(3)];
        scene.closest(&rays, &mut hits, coherence);
        scene.occluded(&rays, &mut occluded, coherence);
        for (i, ray) in in_float64.iter().enumerate() {
            let (hit, mut faults) = (&hits[i], vec![]);
            let answer = (hit.triangle != INVALID_ID).then(|| (hit.triangle, f64::from(hit.t)));
            mesh.met(ray, BAND, &mut met);
            faults.extend(Brute::fault(&met, answer).map(|fault| format!("closest: {fault}")));
            if occluded[i] != answer.is_some() {
                faults.push(format!("occluded: {}, closest: {answer:?}", occluded[i]));
            }
            tally.hits += u64::from(answer.is_some());
            let nearest = met.iter().filter(|met| met.sure).map(|met| met.t);
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            let alone = |met: &Intersection| met.sure && met.t == nearest;
            let named = answer.and_then(|(k, _)| met.iter().find(|met| met.triangle == k));
            tally.ties += u64::from(named.is_some_and(|met| !alone(met)));
            if i < EXACT_BATCH {
                mesh.met(ray, EXACT_BAND, &mut met);
                faults.extend(exact.faults(i, mesh, ray, &met, &mut tally));
            }
            let told = |fault| format!("mesh {}, {ray:?}, {coherence:?}: {fault}", mesh.name);
            tally.faults.extend(faults.into_iter().map(told));
        }
        tally.rays += BATCH as u64;
    }
    tally
}

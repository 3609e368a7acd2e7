//! Ray queries: nearest hits and occlusion of the caller's rays, decided exactly for the float64 numbers given.

use glam::DVec3;
use raycam_bvh::{Coherence, ExactHit, ExactRay, Hit, INVALID_ID, Ray};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::ground_truth::convert::signed_id;
use crate::interaction::vector::{face_forward, unit_normal};
use crate::memory::check_memory;
use crate::prepare::world::PreparedWorld;
use crate::thread_pool::{MAX_WORK_HERE, Workers};

/// Rays of one task.
const RAYS_PER_TASK: usize = 4096;

/// Rays of a query, in world coordinates; directions need not be normalised.
#[derive(Clone, Copy, Debug)]
pub struct RayArrays<'a> {
    /// Origins, one for each ray.
    pub origins: &'a [[f64; 3]],
    /// Directions, one for each ray.
    pub directions: &'a [[f64; 3]],
    /// Smallest valid t, in lengths of the direction: one for all rays, or one for each.
    pub t_min: &'a [f64],
    /// Largest valid t, in lengths of the direction: one for all rays, or one for each.
    pub t_max: &'a [f64],
    /// Arithmetic that decides hits.
    pub kernel: Kernel,
}

/// Arithmetic that decides hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// Exact signs of the float64 numbers given.
    Exact,
    /// float32, relative to the centre of the world: several times as fast for incoherent rays. Rays start at
    /// t = 0.
    Float32 {
        /// True if neighbouring rays are similar; detected without. For speed only.
        coherent: Option<bool>,
    },
}

impl RayArrays<'_> {
    fn check(&self) -> Result<(), RenderError> {
        let (o, d) = (self.origins.len(), self.directions.len());
        if o != d {
            return Err(RenderError::Settings(format!("{o} origins and {d} directions; expected one of each per ray")));
        }
        for (name, values) in [("t_min", self.t_min), ("t_max", self.t_max)] {
            if values.len() != 1 && values.len() != o {
                let given = values.len();
                return Err(RenderError::Settings(format!("{given} values of {name} for {o} rays; expected 1 or {o}")));
            }
            if let Some(at) = values.iter().position(|t| t.is_nan()) {
                return Err(RenderError::Settings(format!("{name}[{at}] is NaN; expected a number or an infinity")));
            }
        }
        if self.kernel != Kernel::Exact && self.t_min.iter().any(|t| *t != 0.0) {
            let message = "t_min needs the exact kernel: leave out exact=False, or move the origins";
            return Err(RenderError::Settings(message.into()));
        }
        Ok(())
    }

    fn ray(&self, i: usize) -> ExactRay {
        let of = |limits: &[f64]| if limits.len() == 1 { limits[0] } else { limits[i] };
        ExactRay {
            origin: self.origins[i],
            direction: self.directions[i],
            t_min: of(self.t_min),
            t_max: of(self.t_max),
        }
    }
}

/// Nearest hit of each ray, one entry per ray.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RayHits {
    /// In lengths of the ray's direction; +inf for a miss.
    pub t: Vec<f64>,
    /// Index of the object; -1 for a miss.
    pub instance: Vec<i32>,
    /// Index of the triangle in its mesh; -1 for a miss.
    pub triangle: Vec<i32>,
    /// Barycentric coordinates, of sum 1; 0 for a miss.
    pub barycentric: Vec<[f64; 3]>,
    /// Unit geometric normal in world coordinates, on the ray's side; 0 for a miss.
    pub normal: Vec<[f64; 3]>,
    /// Surface point in world coordinates; NaN for a miss.
    pub position: Vec<[f64; 3]>,
}

/// Nearest hit of each ray `origin + t * direction`, `t_min <= t <= t_max`, in world coordinates.
///
/// A triangle is closed: its edges and corners belong to it; seen edge on it is not met. Signs are exact, t is off by one
/// unit in the last place at most, and the position is weighted from the corners, so far origins lose nothing. First is
/// the smallest (t, instance, triangle). A ray that is not finite or has a zero direction misses.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length or a limit is NaN, [`RenderError::Cancelled`], and
/// [`RenderError::Threads`].
pub fn cast_rays(
    world: &PreparedWorld,
    rays: &RayArrays,
    threads: Option<usize>,
    control: &Control,
) -> Result<RayHits, RenderError> {
    rays.check()?;
    let n = rays.origins.len();
    check_memory(|| format!("{n} hits"), n as u64 * 88)?;
    let mut found = RayHits {
        t: vec![f64::INFINITY; n],
        instance: vec![-1; n],
        triangle: vec![-1; n],
        barycentric: vec![[0.0; 3]; n],
        normal: vec![[0.0; 3]; n],
        position: vec![[f64::NAN; 3]; n],
    };
    control.start(n.div_ceil(RAYS_PER_TASK));
    world.geometry.note_exact_rays(n as u64);
    let RayHits { t, instance, triangle, barycentric, normal, position } = &mut found;
    type Outputs<'a> = (&'a mut [f64], &'a mut [i32], &'a mut [i32], Corners<'a>, Corners<'a>, Corners<'a>);
    type Corners<'a> = &'a mut [[f64; 3]];
    let cast = |chunk: usize, (t, instance, triangle, barycentric, normal, position): Outputs| {
        control.check()?;
        let first = chunk * RAYS_PER_TASK;
        let kernel = rays.kernel;
        let rays: Vec<ExactRay> = (first..first + t.len()).map(|i| rays.ray(i)).collect();
        let hits = closest_hits(world, &rays, kernel);
        for (i, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.instance != INVALID_ID) {
            let corners = world.geometry.corners(hit.instance, hit.triangle);
            let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
            t[i] = hit.t;
            instance[i] = signed_id(hit.instance);
            triangle[i] = signed_id(hit.triangle);
            barycentric[i] = weights;
            normal[i] = face_forward(unit_normal(corners), rays[i].direction.into()).to_array();
            position[i] = (corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]).to_array();
        }
        control.advance();
        Ok::<(), RenderError>(())
    };
    let workers = Workers::for_work(threads, work(n), true)?;
    if n <= RAYS_PER_TASK {
        workers.run(|| cast(0, (t, instance, triangle, barycentric, normal, position)))?;
        return Ok(found);
    }
    workers.run(|| {
        let results = (
            t.par_chunks_mut(RAYS_PER_TASK),
            instance.par_chunks_mut(RAYS_PER_TASK),
            triangle.par_chunks_mut(RAYS_PER_TASK),
            barycentric.par_chunks_mut(RAYS_PER_TASK),
            normal.par_chunks_mut(RAYS_PER_TASK),
            position.par_chunks_mut(RAYS_PER_TASK),
        );
        results.into_par_iter().enumerate().try_for_each(|(chunk, out)| cast(chunk, out))
    })?;
    Ok(found)
}

/// True for each ray with any hit at `t_min <= t <= t_max`, decided as by [`cast_rays`].
///
/// # Errors
/// As [`cast_rays`].
pub fn occluded(
    world: &PreparedWorld,
    rays: &RayArrays,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<bool>, RenderError> {
    rays.check()?;
    let mut occluded = vec![false; rays.origins.len()];
    control.start(occluded.len().div_ceil(RAYS_PER_TASK));
    world.geometry.note_exact_rays(occluded.len() as u64);
    let cast = |chunk: usize, occluded: &mut [bool]| {
        control.check()?;
        let first = chunk * RAYS_PER_TASK;
        let kernel = rays.kernel;
        let rays: Vec<ExactRay> = (first..first + occluded.len()).map(|i| rays.ray(i)).collect();
        match kernel {
            Kernel::Exact => world.geometry.occluded_exact(&rays, occluded),
            Kernel::Float32 { coherent } => {
                world.geometry.scene.occluded(&local_rays(world, &rays), occluded, coherence(coherent));
            }
        }
        control.advance();
        Ok::<(), RenderError>(())
    };
    let workers = Workers::for_work(threads, work(occluded.len()), true)?;
    if occluded.len() <= RAYS_PER_TASK {
        workers.run(|| cast(0, &mut occluded))?;
        return Ok(occluded);
    }
    workers.run(|| {
        let chunks = occluded.par_chunks_mut(RAYS_PER_TASK).enumerate();
        chunks.try_for_each(|(chunk, occluded)| cast(chunk, occluded))
    })?;
    Ok(occluded)
}

/// Estimated time of this many rays on one thread, in nanoseconds.
fn work(rays: usize) -> f64 {
    300.0 * rays as f64
}

/// True if the calling thread alone traces this many rays, in a fraction of a millisecond.
pub fn is_brief(rays: usize) -> bool {
    work(rays) <= MAX_WORK_HERE
}

/// Nearest hits with precise t and weights.
fn closest_hits(world: &PreparedWorld, rays: &[ExactRay], kernel: Kernel) -> Vec<ExactHit> {
    let mut hits = vec![ExactHit::MISS; rays.len()];
    match kernel {
        Kernel::Exact => {
            world.geometry.closest_exact(rays, &mut hits);
            for (hit, ray) in hits.iter_mut().zip(rays).filter(|(hit, _)| hit.instance != INVALID_ID) {
                let corners = world.geometry.corners(hit.instance, hit.triangle);
                *hit = hit.refined(ray, corners.map(|corner| corner.to_array()));
            }
        }
        Kernel::Float32 { coherent } => {
            let mut found = vec![Hit::MISS; rays.len()];
            world.geometry.scene.closest(&local_rays(world, rays), &mut found, coherence(coherent));
            for ((hit, found), ray) in hits.iter_mut().zip(&found).zip(rays) {
                if found.instance != INVALID_ID {
                    *hit = refine_f64(world, found, ray);
                }
            }
        }
    }
    hits
}

fn coherence(coherent: Option<bool>) -> Coherence {
    match coherent {
        None => Coherence::Unknown,
        Some(true) => Coherence::Coherent,
        Some(false) => Coherence::Incoherent,
    }
}

fn local_rays(world: &PreparedWorld, rays: &[ExactRay]) -> Vec<Ray> {
    let local = |ray: &ExactRay| world.geometry.local_ray(ray.origin.into(), ray.direction.into(), ray.t_max).0;
    rays.iter().map(local).collect()
}

/// Intersection of a ray with the plane of the triangle found in float32, clamped to the triangle: near an edge
/// float64 may miss it.
fn refine_f64(world: &PreparedWorld, hit: &Hit, ray: &ExactRay) -> ExactHit {
    let (origin, direction) = (DVec3::from(ray.origin), DVec3::from(ray.direction));
    let [a, b, c] = world.geometry.corners(hit.instance, hit.triangle).map(|corner| corner - origin);
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let q = -a.cross(e1);
    let exact = (-a.dot(p) / determinant, direction.dot(q) / determinant);
    // Seen edge-on, the plane has no intersection.
    let known = exact.0.is_finite() && exact.1.is_finite();
    let (u, v) = if known { exact } else { (f64::from(hit.u), f64::from(hit.v)) };
    let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
    let sum = (u + v).max(1.0);
    let (u, v) = (u / sum, v / sum);
    let point = a + e1 * u + e2 * v;
    let t = (point.dot(direction) / direction.length_squared()).max(0.0);
    ExactHit { t, u, v, instance: hit.instance, triangle: hit.triangle, normal: e1.cross(e2).to_array() }
}

//! Ray queries: nearest hits and occlusion of the caller's rays.

use glam::DVec3;
use raycam_bvh::{Coherence, Hit, INVALID_ID, Ray};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::ground_truth::convert::signed_id;
use crate::interaction::vector::{face_forward, unit_normal};
use crate::prepare::world::PreparedWorld;
use crate::thread_pool::with_pool;

/// Rays of one task.
const RAYS_PER_TASK: usize = 4096;

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
    pub barycentric: Vec<[f32; 3]>,
    /// Unit geometric normal in world coordinates, on the ray's side; 0 for a miss.
    pub normal: Vec<[f32; 3]>,
    /// Surface point in world coordinates; NaN for a miss.
    pub position: Vec<[f64; 3]>,
}

/// Nearest hit of each ray `origin + t * direction`, t >= 0, in world coordinates.
///
/// Directions need not be normalised. A ray that is not finite or has a zero direction misses. `coherent` states if
/// neighbouring rays are similar (`None`: detected); it affects speed alone. The kernel finds the triangle in
/// float32; t, position, weights and normal are computed in float64.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length, [`RenderError::Cancelled`], and errors of [`with_pool`].
pub fn cast_rays(
    world: &PreparedWorld,
    origins: &[[f64; 3]],
    directions: &[[f64; 3]],
    coherent: Option<bool>,
    threads: Option<usize>,
    control: &Control,
) -> Result<RayHits, RenderError> {
    check_lengths(origins, directions)?;
    let n = origins.len();
    let mut found = RayHits {
        t: vec![f64::INFINITY; n],
        instance: vec![-1; n],
        triangle: vec![-1; n],
        barycentric: vec![[0.0; 3]; n],
        normal: vec![[0.0; 3]; n],
        position: vec![[f64::NAN; 3]; n],
    };
    control.start(n.div_ceil(RAYS_PER_TASK));
    let RayHits { t, instance, triangle, barycentric, normal, position } = &mut found;
    with_pool(threads, || {
        let results = (
            t.par_chunks_mut(RAYS_PER_TASK),
            instance.par_chunks_mut(RAYS_PER_TASK),
            triangle.par_chunks_mut(RAYS_PER_TASK),
            barycentric.par_chunks_mut(RAYS_PER_TASK),
            normal.par_chunks_mut(RAYS_PER_TASK),
            position.par_chunks_mut(RAYS_PER_TASK),
        );
        let rays = (origins.par_chunks(RAYS_PER_TASK), directions.par_chunks(RAYS_PER_TASK));
        rays.into_par_iter().zip(results.into_par_iter()).try_for_each(|((origins, directions), out)| {
            control.check()?;
            let (t, instance, triangle, barycentric, normal, position) = out;
            let ray = |(o, d): (&[f64; 3], &[f64; 3])| {
                world.geometry.local_ray(DVec3::from(*o), DVec3::from(*d), f64::INFINITY).0
            };
            let rays: Vec<Ray> = origins.iter().zip(directions).map(ray).collect();
            let mut hits = vec![Hit::MISS; rays.len()];
            world.geometry.scene.closest(&rays, &mut hits, coherence(coherent));
            for (i, hit) in hits.iter().enumerate().filter(|(_, hit)| hit.instance != INVALID_ID) {
                let exact = refine_f64(world, hit, origins[i].into(), directions[i].into());
                t[i] = exact.t;
                instance[i] = signed_id(hit.instance);
                triangle[i] = signed_id(hit.triangle);
                barycentric[i] = exact.barycentric.map(|weight| weight as f32);
                normal[i] = exact.normal.as_vec3().to_array();
                position[i] = exact.position.to_array();
            }
            control.advance();
            Ok::<(), RenderError>(())
        })
    })??;
    Ok(found)
}

/// True for each ray with any hit at `0 <= t <= t_max` (`t_max` has one entry for all rays, or one per ray).
///
/// # Errors
/// As [`cast_rays`], and for a `t_max` of another length.
pub fn occluded(
    world: &PreparedWorld,
    origins: &[[f64; 3]],
    directions: &[[f64; 3]],
    t_max: &[f64],
    coherent: Option<bool>,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<bool>, RenderError> {
    check_lengths(origins, directions)?;
    if t_max.len() != 1 && t_max.len() != origins.len() {
        let (given, rays) = (t_max.len(), origins.len());
        return Err(RenderError::Settings(format!("{given} values of t_max for {rays} rays; expected 1 or {rays}")));
    }
    let mut occluded = vec![false; origins.len()];
    control.start(origins.len().div_ceil(RAYS_PER_TASK));
    with_pool(threads, || {
        occluded.par_chunks_mut(RAYS_PER_TASK).enumerate().try_for_each(|(chunk, occluded)| {
            control.check()?;
            let first = chunk * RAYS_PER_TASK;
            let ray = |i: usize| {
                let limit = if t_max.len() == 1 { t_max[0] } else { t_max[i] };
                world.geometry.local_ray(origins[i].into(), directions[i].into(), limit).0
            };
            let rays: Vec<Ray> = (first..first + occluded.len()).map(ray).collect();
            world.geometry.scene.occluded(&rays, occluded, coherence(coherent));
            control.advance();
            Ok::<(), RenderError>(())
        })
    })??;
    Ok(occluded)
}

fn check_lengths(origins: &[[f64; 3]], directions: &[[f64; 3]]) -> Result<(), RenderError> {
    if origins.len() == directions.len() {
        return Ok(());
    }
    let (o, d) = (origins.len(), directions.len());
    Err(RenderError::Settings(format!("{o} origins and {d} directions; expected one of each per ray")))
}

fn coherence(coherent: Option<bool>) -> Coherence {
    match coherent {
        None => Coherence::Unknown,
        Some(true) => Coherence::Coherent,
        Some(false) => Coherence::Incoherent,
    }
}

/// Hit in float64.
struct RefinedHit {
    t: f64,
    barycentric: [f64; 3],
    normal: DVec3,
    position: DVec3,
}

/// Intersection of a ray with the plane of the triangle found in float32, clamped to the triangle: near an edge
/// float64 may miss it.
fn refine_f64(world: &PreparedWorld, hit: &Hit, origin: DVec3, direction: DVec3) -> RefinedHit {
    let corners = world.geometry.corners(hit.instance, hit.triangle);
    let [a, b, c] = corners.map(|corner| corner - origin);
    let normal = face_forward(unit_normal(corners), direction);
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
    RefinedHit { t, barycentric: [1.0 - u - v, u, v], normal, position: origin + point }
}

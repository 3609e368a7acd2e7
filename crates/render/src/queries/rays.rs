//! Ray queries: nearest hits and occlusion of the caller's rays, decided exactly for the given float64 numbers.

use std::ops::Range;

use glam::DVec3;
use raycam_bvh::{Coherence, ExactHit, ExactRay, Hit, HitDetail, HitFilter, INVALID_ID, Ray};

use crate::control::Control;
use crate::error::RenderError;
use crate::memory::check_memory;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::queries::fields::{Columns, ColumnsPart, Field};
use crate::queries::ray_order::narrow_order;
use crate::queries::selection::Selection;
use crate::queries::tasks::{self, NS_PER_RAY, PER_TASK, fill_in_tasks, in_tasks};

/// Rays of a query, in world coordinates; directions need not be normalised.
#[derive(Clone, Copy, Debug)]
pub struct RayArrays<'a> {
    /// Origins, one per ray.
    pub origins: &'a [[f64; 3]],
    /// Directions, one per ray.
    pub directions: &'a [[f64; 3]],
    /// Minimum valid t, in units of the direction's length: one value for all rays, or one value per ray.
    pub t_min: &'a [f64],
    /// Maximum valid t, in units of the direction's length: one value for all rays, or one value per ray.
    pub t_max: &'a [f64],
    /// Arithmetic that decides hits.
    pub kernel: Kernel,
    /// Surfaces that the query includes.
    pub selection: Selection<'a>,
}

/// Arithmetic that decides hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// Hits are decided exactly for the given float64 numbers.
    Exact,
    /// Hits are decided in float32, relative to the centre of the world: faster for coherent rays. Rays start at t = 0.
    Float32 {
        /// True if neighbouring rays are similar; `None` lets the query detect this. The value affects only the speed.
        coherent: Option<bool>,
    },
}

impl RayArrays<'_> {
    pub(super) fn check(&self, world: &PreparedWorld) -> Result<(), RenderError> {
        let (o, d) = (self.origins.len(), self.directions.len());
        if o != d {
            return Err(RenderError::settings(format!("{o} origins and {d} directions; expected one of each per ray")));
        }
        for (name, values) in [("t_min", self.t_min), ("t_max", self.t_max)] {
            if values.len() != 1 && values.len() != o {
                let given = values.len();
                return Err(RenderError::settings(format!(
                    "{name} has {given} values for {o} rays; expected 1 or {o}"
                )));
            }
            if let Some(at) = values.iter().position(|t| t.is_nan()) {
                return Err(RenderError::settings(format!("{name}[{at}] is NaN; expected a number or an infinity")));
            }
        }
        if self.kernel != Kernel::Exact && self.t_min.iter().any(|t| *t != 0.0) {
            let message =
                "t_min requires the exact kernel; omit exact=False, or move the origins along the rays instead";
            return Err(RenderError::settings(message));
        }
        if self.kernel != Kernel::Exact && !self.selection.is_everything() {
            let message = "objects, skip, facing and surface require the exact kernel; omit exact=False";
            return Err(RenderError::settings(message));
        }
        self.selection.check(world.geometry.instances.len(), o)
    }

    /// Rays of a range, as exact rays.
    pub(super) fn slice(&self, range: Range<usize>) -> Vec<ExactRay> {
        range.map(|i| self.ray(i)).collect()
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

/// Number of exact rays traced at once; their hits stay in the cache until they are written.
const BLOCK_RAYS: usize = 1024;

/// Returns fields of the nearest hit of each ray `origin + t * direction` with `t_min <= t <= t_max`, in world
/// coordinates.
///
/// A triangle is closed: its edges and corners belong to it. Rays in the triangle's plane do not hit it.
/// Signs are exact, t is accurate to one unit in the last place, and positions are interpolated from the
/// corners, so that distant origins lose no precision. The nearest hit is the hit with the smallest (t,
/// instance, triangle). If surfaces of several objects are in the same plane, up to rounding to float32, the
/// object with the largest index is hit. A ray that is not finite or has a zero direction misses.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length or a limit is NaN, [`RenderError::Cancelled`], and errors
/// of `crate::thread_pool::with_pool`.
pub fn cast_rays(
    world: &PreparedWorld,
    rays: &RayArrays,
    fields: &[Field],
    threads: Option<usize>,
    control: &Control,
) -> Result<Columns, RenderError> {
    rays.check(world)?;
    let n = rays.origins.len();
    check_hit_memory(n, fields)?;
    world.geometry.note_rays(n as u64);
    let mut found = Columns::zeros(fields, n);
    let work = |range: Range<usize>, mut part: ColumnsPart| {
        write_hits(&world.geometry, rays, fields, range, &mut part);
    };
    world.geometry.note_exact_rays(n as u64);
    fill_in_tasks((n, NS_PER_RAY), threads, control, found.parts(PER_TASK), work)?;
    Ok(found)
}

/// Checks that there is enough memory for the fields of `n` hits.
pub(super) fn check_hit_memory(n: usize, fields: &[Field]) -> Result<(), RenderError> {
    let numbers: u64 = fields.iter().map(|field| field.width() as u64).sum();
    check_memory(|| format!("an array of {n} hits"), n as u64 * 8 * numbers)
}

/// Fields of the nearest hits of a range of checked rays.
pub(super) fn hit_columns(geometry: &Geometry, rays: &RayArrays, fields: &[Field], range: Range<usize>) -> Columns {
    let mut found = Columns::zeros(fields, range.len());
    write_hits(geometry, rays, fields, range, &mut found.whole());
    found
}

/// Writes the fields of the nearest hits of a range of checked rays.
fn write_hits(geometry: &Geometry, rays: &RayArrays, fields: &[Field], range: Range<usize>, part: &mut ColumnsPart) {
    let local = rays.slice(range.clone());
    let order = if rays.kernel == Kernel::Exact { narrow_order(&local, geometry.radius) } else { None };
    let local = in_order(local, order.as_deref());
    let detail = if fields.iter().any(|field| field.needs_intersection()) {
        HitDetail::Refined
    } else if fields.iter().any(|field| field.needs_side()) {
        HitDetail::Side
    } else {
        HitDetail::Triangle
    };
    let block_rays = if rays.kernel == Kernel::Exact { BLOCK_RAYS } else { PER_TASK };
    for (block, some) in local.chunks(block_rays).enumerate() {
        let first = block * block_rays;
        let order = order.as_ref().map(|order| &order[first..first + some.len()]);
        let start = if order.is_some() { range.start } else { range.start + first };
        let hits = closest_hits(geometry, some, rays, (start, order), detail);
        part.write(geometry, first, some.iter().zip(&hits), order);
    }
}

fn in_order(rays: Vec<ExactRay>, order: Option<&[usize]>) -> Vec<ExactRay> {
    match order {
        Some(order) => order.iter().map(|&at| rays[at]).collect(),
        None => rays,
    }
}

/// For each of a range of checked rays, true if it has any hit.
pub(super) fn any_hits(geometry: &Geometry, rays: &RayArrays, range: Range<usize>) -> Vec<bool> {
    let local = rays.slice(range.clone());
    let mut occluded = vec![false; local.len()];
    match rays.kernel {
        Kernel::Exact => {
            let order = narrow_order(&local, geometry.radius);
            let local = in_order(local, order.as_deref());
            let filter = rays.selection.filter(geometry, &local, (range.start, order.as_deref()));
            let filter = (!rays.selection.is_everything()).then_some(&filter as &dyn HitFilter);
            geometry.exact_scene().occluded_exact(&local, geometry, filter, &mut occluded);
            if let Some(order) = order {
                let sorted = occluded.clone();
                order.iter().zip(sorted).for_each(|(&at, is_occluded)| occluded[at] = is_occluded);
            }
        }
        Kernel::Float32 { coherent } => {
            geometry.two_level().occluded(&local_rays(geometry, &local), &mut occluded, coherence(coherent));
        }
    }
    occluded
}

/// True for each ray with any hit at `t_min <= t <= t_max`, decided in the same way as by [`cast_rays`].
///
/// # Errors
/// Same as [`cast_rays`].
pub fn occluded(
    world: &PreparedWorld,
    rays: &RayArrays,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<bool>, RenderError> {
    rays.check(world)?;
    let n = rays.origins.len();
    world.geometry.note_rays(n as u64);
    let mut found = Vec::with_capacity(n);
    let work = |range: Range<usize>| any_hits(&world.geometry, rays, range);
    world.geometry.note_exact_rays(n as u64);
    in_tasks((n, NS_PER_RAY), threads, control, work, |mut more| found.append(&mut more))?;
    Ok(found)
}

/// True if the calling thread alone can trace this many rays in a fraction of a millisecond.
pub fn is_brief(rays: usize) -> bool {
    tasks::is_brief(rays, NS_PER_RAY)
}

/// Nearest hits, with the fields that `detail` specifies.
///
/// Ray i is ray `first + order[i]` of the query, or ray `first + i` without an order.
fn closest_hits(
    geometry: &Geometry,
    rays: &[ExactRay],
    query: &RayArrays,
    numbers: (usize, Option<&[usize]>),
    detail: HitDetail,
) -> Vec<ExactHit> {
    let mut hits = vec![ExactHit::MISS; rays.len()];
    match query.kernel {
        Kernel::Exact => {
            let filter = query.selection.filter(geometry, rays, numbers);
            let filter = (!query.selection.is_everything()).then_some(&filter as &dyn HitFilter);
            geometry.exact_scene().closest_exact_with(rays, geometry, filter, detail, &mut hits);
        }
        Kernel::Float32 { coherent } => {
            let mut found = vec![Hit::MISS; rays.len()];
            let (scene, local) = (geometry.two_level(), local_rays(geometry, rays));
            geometry.closest(scene, &local, &mut found, coherence(coherent), |_| true);
            for ((hit, found), ray) in hits.iter_mut().zip(&found).zip(rays) {
                if found.instance != INVALID_ID {
                    *hit = refine_f64(geometry, found, ray);
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

fn local_rays(geometry: &Geometry, rays: &[ExactRay]) -> Vec<Ray> {
    let local = |ray: &ExactRay| geometry.local_ray(ray.origin.into(), ray.direction.into(), ray.t_max).0;
    rays.iter().map(local).collect()
}

/// Intersection of a ray with the plane of the triangle found in float32, clamped to the triangle because float64 may
/// miss it near an edge.
fn refine_f64(geometry: &Geometry, hit: &Hit, ray: &ExactRay) -> ExactHit {
    let (origin, direction) = (DVec3::from(ray.origin), DVec3::from(ray.direction));
    let [a, b, c] = geometry.corners(hit.instance, hit.triangle).map(|corner| corner - origin);
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let q = -a.cross(e1);
    let exact = (-a.dot(p) / determinant, direction.dot(q) / determinant);
    // If the ray is parallel to the plane, there is no intersection, and the float32 hit is used.
    let known = exact.0.is_finite() && exact.1.is_finite();
    let (u, v) = if known { exact } else { (f64::from(hit.u), f64::from(hit.v)) };
    let (u, v) = (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0));
    let sum = (u + v).max(1.0);
    let (u, v) = (u / sum, v / sum);
    let point = a + e1 * u + e2 * v;
    let t = (point.dot(direction) / direction.length_squared()).max(0.0);
    let normal = e1.cross(e2);
    let side = if normal.dot(direction) > 0.0 { 1 } else { -1 };
    ExactHit { t, u, v, instance: hit.instance, triangle: hit.triangle, normal: normal.to_array(), side }
}

//! Crossings of rays and surfaces: a list of all crossings, or only their number.
//!
//! Each ray is shifted by an infinitesimal vector, so that it never passes exactly through an edge or a corner, or
//! starts exactly on a surface: see [`raycam_bvh::Scene::crossings`].

use std::ops::Range;

use raycam_bvh::{ExactRay, HitFilter};

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::world::PreparedWorld;
use crate::queries::fields::{Columns, Field, columns};
use crate::queries::rays::RayArrays;
use crate::queries::tasks::{self, NS_PER_ALL_HITS_RAY, in_tasks};

/// Crossings of a list of rays, sorted by (ray, t, instance, triangle).
#[derive(Clone, Debug)]
pub struct Crossings {
    /// Crossings of ray i are `offsets[i]..offsets[i + 1]`.
    pub offsets: Vec<i64>,
    /// For each crossing: the index of its ray.
    pub rays: Vec<i64>,
    /// Requested fields of the crossings.
    pub columns: Columns,
}

/// Returns the crossings of each ray, at most `max_hits` per ray.
///
/// # Errors
/// Same as [`crate::queries::rays::cast_rays`].
pub fn intersections(
    world: &PreparedWorld,
    rays: &RayArrays,
    max_hits: Option<usize>,
    fields: &[Field],
    threads: Option<usize>,
    control: &Control,
) -> Result<Crossings, RenderError> {
    rays.check(world)?;
    let n = rays.origins.len();
    let mut found = Crossings { offsets: Vec::with_capacity(n + 1), rays: vec![], columns: Columns::zeros(fields, 0) };
    found.offsets.push(0);
    let geometry = &world.geometry;
    geometry.note_rays(n as u64);
    let work = |range: Range<usize>| {
        let local = rays.slice(range.clone());
        let (mut counts, mut crossings) = (vec![0; local.len()], vec![]);
        let limit = max_hits.unwrap_or(usize::MAX);
        with_filter(world, rays, &local, range.clone(), |filter| {
            geometry.two_level().crossings(&local, geometry, filter, limit, (&mut counts, &mut crossings));
        });
        let owners: Vec<usize> =
            counts.iter().enumerate().flat_map(|(i, &count)| std::iter::repeat_n(i, count as usize)).collect();
        let columns = columns(geometry, fields, owners.iter().map(|i| &local[*i]).zip(&crossings));
        let owners: Vec<i64> = owners.iter().map(|i| (range.start + i) as i64).collect();
        (counts, owners, columns)
    };
    in_tasks((n, NS_PER_ALL_HITS_RAY), threads, control, work, |(counts, mut owners, columns)| {
        let mut end = found.offsets.last().copied().unwrap_or(0);
        found.offsets.extend(counts.iter().map(|count| {
            end += i64::from(*count);
            end
        }));
        found.rays.append(&mut owners);
        found.columns.append(columns);
    })?;
    Ok(found)
}

/// Number of crossings of each ray. `signed`: the number of exits minus the number of entries.
///
/// # Errors
/// Same as [`crate::queries::rays::cast_rays`].
pub fn count_intersections(
    world: &PreparedWorld,
    rays: &RayArrays,
    signed: bool,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<i32>, RenderError> {
    rays.check(world)?;
    let n = rays.origins.len();
    let mut found = Vec::with_capacity(n);
    let geometry = &world.geometry;
    geometry.note_rays(n as u64);
    let work = |range: Range<usize>| {
        let local = rays.slice(range.clone());
        let mut counts = vec![0; local.len()];
        with_filter(world, rays, &local, range, |filter| {
            geometry.two_level().count_crossings(&local, geometry, filter, signed, &mut counts);
        });
        counts
    };
    in_tasks((n, NS_PER_ALL_HITS_RAY), threads, control, work, |mut more| found.append(&mut more))?;
    Ok(found)
}

/// True if the calling thread alone can trace this many rays in a fraction of a millisecond.
pub fn is_brief(rays: usize) -> bool {
    tasks::is_brief(rays, NS_PER_ALL_HITS_RAY)
}

/// Calls `work` with the filter of a query, if the query has one.
fn with_filter(
    world: &PreparedWorld,
    query: &RayArrays,
    rays: &[ExactRay],
    range: Range<usize>,
    work: impl FnOnce(Option<&dyn HitFilter>),
) {
    let filter = query.selection.filter(&world.geometry, rays, (range.start, None));
    work((!query.selection.is_everything()).then_some(&filter as &dyn HitFilter));
}

//! Rays with a time each: every ray is traced in the world at the ray's own time.
//!
//! If objects follow keyframes, exact rays are processed in slices of similar times, and only the objects
//! that a slice's rays may hit are placed at their times. Otherwise, the world is prepared for each distinct
//! time.

use std::ops::Range;

use raycam_scene::World;
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::memory::check_memory;
use crate::motion::shutter::prepare_after;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::queries::fields::{Columns, Field};
use crate::queries::moving_objects::{Bundle, MovingObjects, ReachableObjects};
use crate::queries::rays::{Kernel, RayArrays, any_hits, cast_rays, check_hit_memory, hit_columns, occluded};
use crate::queries::selection::Selection;
use crate::thread_pool::Workers;

/// Number of rays per task.
const RAYS_PER_TASK: usize = 4096;
/// Number of rays per slice. An object is either placed for all rays of a slice or ignored.
const RAYS_PER_SLICE: usize = 512;
/// Bytes per ray of the arrays that are sorted by time.
const SORTED_RAY_BYTES: u64 = 88;

/// A world and its prepared form, for rays at other times.
#[derive(Clone, Copy)]
pub struct MovingWorld<'a> {
    /// The world's description at the world's own time.
    pub world: &'a World,
    /// The same world, prepared.
    pub prepared: &'a PreparedWorld,
}

impl MovingWorld<'_> {
    /// True if the world may differ between rays of different times.
    fn moves(&self) -> bool {
        self.world.time.is_some() && self.world.is_animated()
    }
}

/// Returns fields of the nearest hit of each ray in the world at `times[i]` seconds after the world's own time.
///
/// Ray i has the hit that [`cast_rays`] finds in the world at exactly that time. A world that does not move, or has no
/// time, is equal at all times.
///
/// # Errors
/// Same as [`cast_rays`]; [`RenderError::Settings`] for a time that is not finite or if the numbers of times and rays
/// differ, and [`RenderError::World`] if the world cannot be evaluated at a time.
pub fn cast_rays_at(
    moving: &MovingWorld,
    rays: &RayArrays,
    times: &[f64],
    fields: &[Field],
    threads: Option<usize>,
    control: &Control,
) -> Result<Columns, RenderError> {
    check_times(rays, times)?;
    if !moving.moves() {
        return cast_rays(moving.prepared, rays, fields, threads, control);
    }
    rays.check(moving.prepared)?;
    check_hit_memory(times.len(), fields)?;
    let trace = |geometry: &Geometry, sorted: &RayArrays, range| hit_columns(geometry, sorted, fields, range);
    let rename = |objects: &ReachableObjects, part: &mut Columns| part.rename_instances(|at| objects.id(at));
    let (order, parts) = in_order_of_time(moving, rays, times, threads, control, (trace, rename))?;
    let mut found = Columns::zeros(fields, 0);
    parts.into_iter().for_each(|part| found.append(part));
    if let Some(order) = order {
        found.scatter(&order);
    }
    Ok(found)
}

/// True for each ray with any hit in the world at `times[i]` seconds after the world's own time.
///
/// # Errors
/// Same as [`cast_rays_at`].
pub fn occluded_at(
    moving: &MovingWorld,
    rays: &RayArrays,
    times: &[f64],
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<bool>, RenderError> {
    check_times(rays, times)?;
    if !moving.moves() {
        return occluded(moving.prepared, rays, threads, control);
    }
    rays.check(moving.prepared)?;
    let keep = |_: &ReachableObjects, _: &mut Vec<bool>| {};
    let (order, parts) = in_order_of_time(moving, rays, times, threads, control, (any_hits, keep))?;
    let sorted = parts.concat();
    let Some(order) = order else { return Ok(sorted) };
    let mut found = vec![false; sorted.len()];
    for (&ray, occluded) in order.iter().zip(sorted) {
        found[ray] = occluded;
    }
    Ok(found)
}

fn check_times(rays: &RayArrays, times: &[f64]) -> Result<(), RenderError> {
    let (n, count) = (rays.origins.len(), times.len());
    if count != n {
        return Err(RenderError::settings(format!("{count} times for {n} rays; expected one time per ray")));
    }
    match times.iter().position(|time| !time.is_finite()) {
        Some(at) => {
            Err(RenderError::settings(format!("times[{at}] is {}; expected a finite number of seconds", times[at])))
        }
        None => Ok(()),
    }
}

/// Answers of `trace` for ranges of the rays, sorted by time, and the order of the rays; the order is `None` if the
/// rays are already sorted. `rename` converts an answer from a slice's object indices to the world's object indices.
fn in_order_of_time<T: Send>(
    moving: &MovingWorld,
    rays: &RayArrays,
    times: &[f64],
    threads: Option<usize>,
    control: &Control,
    (trace, rename): (
        impl Fn(&Geometry, &RayArrays, Range<usize>) -> T + Sync,
        impl Fn(&ReachableObjects, &mut T) + Sync,
    ),
) -> Result<(Option<Vec<usize>>, Vec<T>), RenderError> {
    let workers = Workers::for_work(threads, f64::INFINITY, false)?;
    let run = |rays: &RayArrays, times: &[f64]| {
        let objects = MovingObjects::new(moving.world, &moving.prepared.geometry);
        match objects.filter(|_| rays.kernel == Kernel::Exact) {
            Some(objects) => trace_slices(&objects, rays, times, &workers, control, (&trace, &rename)),
            None => trace_moments(moving, rays, times, &workers, control, &trace),
        }
    };
    if times.is_sorted() {
        return Ok((None, run(rays, times)?));
    }
    let n = times.len();
    check_memory(|| format!("sorting {n} rays by time"), n as u64 * SORTED_RAY_BYTES)?;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| times[*a].total_cmp(&times[*b]));
    let sorted = SortedRays::new(rays, &order);
    let sorted_times: Vec<f64> = order.iter().map(|&ray| times[ray]).collect();
    let parts = run(&sorted.arrays(rays), &sorted_times)?;
    Ok((Some(order), parts))
}

/// Answers of `trace` for rays whose times ascend, in worlds whose objects follow keyframes.
fn trace_slices<T: Send>(
    objects: &MovingObjects,
    rays: &RayArrays,
    times: &[f64],
    workers: &Workers,
    control: &Control,
    (trace, rename): (
        &(impl Fn(&Geometry, &RayArrays, Range<usize>) -> T + Sync),
        &(impl Fn(&ReachableObjects, &mut T) + Sync),
    ),
) -> Result<Vec<T>, RenderError> {
    let slices = slices(times);
    control.start(slices.len());
    let trace_slice = |slice: Range<usize>| -> Result<Vec<T>, RenderError> {
        control.check()?;
        let own = &times[slice.clone()];
        let mut reachable = objects.within_reach(&Bundle::around(rays, slice.clone()), [own[0], own[own.len() - 1]])?;
        let selected = SelectedRays::new(rays, slice.clone(), &reachable);
        let moments = if reachable.is_static() { std::iter::once(0..own.len()).collect() } else { equal_runs(own) };
        let mut found = vec![];
        for moment in moments {
            let geometry = reachable.at(own[moment.start])?;
            let tasks: Vec<_> = moment.clone().step_by(RAYS_PER_TASK).collect();
            let task = |first: usize| {
                control.check()?;
                Ok(trace(geometry, &selected.arrays(rays), first..moment.end.min(first + RAYS_PER_TASK)))
            };
            found.extend(tasks.into_par_iter().map(task).collect::<Result<Vec<T>, RenderError>>()?);
        }
        found.iter_mut().for_each(|part| rename(&reachable, part));
        control.advance();
        Ok(found)
    };
    let parts: Result<Vec<Vec<T>>, RenderError> = workers.run(|| slices.into_par_iter().map(trace_slice).collect());
    Ok(parts?.into_iter().flatten().collect())
}

/// Ranges of at least [`RAYS_PER_SLICE`] rays, or fewer at the end; rays with the same time are in the same range.
fn slices(times: &[f64]) -> Vec<Range<usize>> {
    let mut slices: Vec<Range<usize>> = vec![];
    for run in equal_runs(times) {
        match slices.last_mut().filter(|slice| slice.len() < RAYS_PER_SLICE) {
            Some(slice) => slice.end = run.end,
            None => slices.push(run),
        }
    }
    slices
}

/// Answers of `trace` for rays whose times ascend.
///
/// The world is prepared once for each distinct time, and dropped after that time's rays.
fn trace_moments<T: Send>(
    moving: &MovingWorld,
    rays: &RayArrays,
    times: &[f64],
    workers: &Workers,
    control: &Control,
    trace: &(impl Fn(&Geometry, &RayArrays, Range<usize>) -> T + Sync),
) -> Result<Vec<T>, RenderError> {
    let moments = equal_runs(times);
    control.start(moments.len());
    let trace_moment = |moment: Range<usize>| -> Result<Vec<T>, RenderError> {
        control.check()?;
        let world = prepare_after(moving.world, moving.prepared, times[moment.start], control)?;
        let tasks: Vec<_> = moment.clone().step_by(RAYS_PER_TASK).collect();
        let task = |first: usize| {
            control.check()?;
            Ok(trace(&world.geometry, rays, first..moment.end.min(first + RAYS_PER_TASK)))
        };
        let found = tasks.into_par_iter().map(task).collect::<Result<Vec<T>, RenderError>>();
        control.advance();
        found
    };
    let parts: Result<Vec<Vec<T>>, RenderError> = workers.run(|| moments.into_par_iter().map(trace_moment).collect());
    Ok(parts?.into_iter().flatten().collect())
}

/// Ranges of consecutive times that are equal; 0.0 equals -0.0.
fn equal_runs(times: &[f64]) -> Vec<Range<usize>> {
    let mut end = 0;
    let runs = times.chunk_by(|a, b| a == b).map(|run| {
        end += run.len();
        end - run.len()..end
    });
    runs.collect()
}

/// Rays of a slice. Their selection refers to objects by their indices among the slice's objects.
struct SelectedRays {
    range: Range<usize>,
    objects: Option<Vec<bool>>,
    skip: Option<(Vec<i32>, Vec<i32>)>,
}

impl SelectedRays {
    fn new(rays: &RayArrays, range: Range<usize>, reachable: &ReachableObjects) -> Self {
        let own = |ids: &[i32]| ids[range.clone()].iter().map(|&id| reachable.instance(id)).collect();
        let skip = rays.selection.skip.map(|(ids, triangles)| (own(ids), triangles[range.clone()].to_vec()));
        Self { objects: rays.selection.objects.map(|mask| reachable.select(mask)), skip, range }
    }

    /// Query of these rays, with the kernel and the selected surfaces of `rays`.
    fn arrays<'a>(&'a self, rays: &RayArrays<'a>) -> RayArrays<'a> {
        let own = |limits: &'a [f64]| if limits.len() == 1 { limits } else { &limits[self.range.clone()] };
        let skip = self.skip.as_ref().map(|(objects, triangles)| (&objects[..], &triangles[..]));
        RayArrays {
            origins: &rays.origins[self.range.clone()],
            directions: &rays.directions[self.range.clone()],
            t_min: own(rays.t_min),
            t_max: own(rays.t_max),
            kernel: rays.kernel,
            selection: Selection { objects: self.objects.as_deref(), skip, ..rays.selection },
        }
    }
}

/// Arrays of a query, in the order of the rays' times.
struct SortedRays {
    origins: Vec<[f64; 3]>,
    directions: Vec<[f64; 3]>,
    t_min: Vec<f64>,
    t_max: Vec<f64>,
    skip: Option<(Vec<i32>, Vec<i32>)>,
}

impl SortedRays {
    fn new(rays: &RayArrays, order: &[usize]) -> Self {
        let limits = |limits: &[f64]| if limits.len() == 1 { limits.to_vec() } else { permuted(limits, order) };
        Self {
            origins: permuted(rays.origins, order),
            directions: permuted(rays.directions, order),
            t_min: limits(rays.t_min),
            t_max: limits(rays.t_max),
            skip: rays
                .selection
                .skip
                .map(|(objects, triangles)| (permuted(objects, order), permuted(triangles, order))),
        }
    }

    /// Query of the sorted rays, with the kernel and the selected surfaces of `rays`.
    fn arrays<'a>(&'a self, rays: &RayArrays<'a>) -> RayArrays<'a> {
        let skip = self.skip.as_ref().map(|(objects, triangles)| (&objects[..], &triangles[..]));
        RayArrays {
            origins: &self.origins,
            directions: &self.directions,
            t_min: &self.t_min,
            t_max: &self.t_max,
            kernel: rays.kernel,
            selection: Selection { skip, ..rays.selection },
        }
    }
}

fn permuted<T: Copy>(values: &[T], order: &[usize]) -> Vec<T> {
    order.iter().map(|&i| values[i]).collect()
}

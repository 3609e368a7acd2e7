//! Closest points of a world.

use glam::DVec3;
use raycam_bvh::{ClosestPoint, ExactHit, HitFilter, INVALID_ID};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::ground_truth::convert::signed_id;
use crate::interaction::vector::unit_normal;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::queries::tasks;
use crate::thread_pool::Workers;

/// Number of points that are sorted at a time.
const PER_BLOCK: usize = 1 << 20;
/// Number of points per task; the points of a task are neighbours along the Morton curve.
const PER_TASK: usize = 1024;
/// Estimated time per point on one thread, in nanoseconds, for a point that is far from a surface of many triangles.
const NS_PER_POINT: f64 = 20_000.0;

/// Points of a query, in world coordinates.
#[derive(Clone, Copy, Debug)]
pub struct PointArrays<'a> {
    /// Positions of the points.
    pub points: &'a [[f64; 3]],
    /// Maximum valid distance: one value for all points, or one value per point.
    pub max_distance: &'a [f64],
    /// For each object, true if the query includes the object. `None`: all objects count.
    pub objects: Option<&'a [bool]>,
}

impl PointArrays<'_> {
    fn check(&self, geometry: &Geometry) -> Result<(), RenderError> {
        let (n, limits) = (self.points.len(), self.max_distance.len());
        let fail = |message| Err(RenderError::settings(message));
        if limits != 1 && limits != n {
            return fail(format!("max_distance has {limits} values for {n} points; expected 1 or {n}"));
        }
        if let Some(at) = self.max_distance.iter().position(|limit| limit.is_nan() || *limit < 0.0) {
            let given = self.max_distance[at];
            return fail(format!("max_distance[{at}] is {given}; expected a number of at least 0, or infinity"));
        }
        let count = geometry.instances.len();
        match self.objects {
            Some(mask) if mask.len() != count => fail(format!(
                "the object mask has {} entries; expected one for each of the {count} objects",
                mask.len()
            )),
            _ => Ok(()),
        }
    }
}

/// Filter that accepts only the selected objects.
struct ChosenObjects<'a>(&'a [bool]);

impl HitFilter for ChosenObjects<'_> {
    fn accepts_instance(&self, _: usize, instance: u32) -> bool {
        self.0[instance as usize]
    }

    fn accepts(&self, _: usize, _: &ExactHit) -> bool {
        true
    }
}

/// The closest surface points, one entry per query point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClosestPoints {
    /// Distance in world units; +inf if no point is within reach.
    pub distance: Vec<f64>,
    /// Position in world coordinates; NaN if no point is within reach.
    pub position: Vec<[f64; 3]>,
    /// Index of the object; -1 if no point is within reach.
    pub instance: Vec<i32>,
    /// Index of the triangle in its mesh; -1 if no point is within reach.
    pub triangle: Vec<i32>,
    /// Weights of the triangle's corners, at least 0, with sum 1; 0 if no point is within reach.
    pub barycentric: Vec<[f64; 3]>,
    /// Unit normal of the triangle, outwards; 0 if no point is within reach and for triangles without area.
    pub normal: Vec<[f64; 3]>,
}

/// Closest point of the selected objects to each point. Triangles without area count as segments or points. Of equally
/// close triangles, the triangle that faces the point most directly is returned, and of these, the smallest (instance,
/// triangle). Points that are not finite have no closest point.
///
/// # Errors
/// [`RenderError::Settings`] for limits that are negative or NaN, [`RenderError::Cancelled`], and errors of
/// `crate::thread_pool::with_pool`.
pub fn closest_points(
    world: &PreparedWorld,
    query: &PointArrays,
    threads: Option<usize>,
    control: &Control,
) -> Result<ClosestPoints, RenderError> {
    let geometry = &world.geometry;
    let found = search(world, query, threads, control)?;
    let workers = Workers::for_work(threads, NS_PER_POINT * found.len() as f64, true)?;
    Ok(workers.run(|| ClosestPoints {
        distance: column(&workers, &found, |found| found.distance),
        position: column(&workers, &found, |found| found.position),
        instance: column(&workers, &found, |found| signed_id(found.instance)),
        triangle: column(&workers, &found, |found| signed_id(found.triangle)),
        barycentric: column(&workers, &found, |found| found.weights),
        normal: column(&workers, &found, |found| outward_normal(geometry, found)),
    }))
}

/// True if the calling thread alone can process this many points in a fraction of a millisecond.
pub fn is_brief(points: usize) -> bool {
    tasks::is_brief(points, NS_PER_POINT)
}

/// Collects one value per closest point.
fn column<T: Send>(
    workers: &Workers,
    found: &[ClosestPoint],
    value: impl Fn(&ClosestPoint) -> T + Sync + Send,
) -> Vec<T> {
    match workers {
        Workers::Here => found.iter().map(value).collect(),
        Workers::Pool(..) => found.par_iter().map(value).collect(),
    }
}

/// Distance of each point to the selected objects; +inf beyond `max_distance`.
///
/// # Errors
/// Same as [`closest_points`].
pub fn distance(
    world: &PreparedWorld,
    query: &PointArrays,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<f64>, RenderError> {
    Ok(search(world, query, threads, control)?.into_iter().map(|found| found.distance).collect())
}

/// Finds the closest points, in the order of the query's points.
pub(super) fn search(
    world: &PreparedWorld,
    query: &PointArrays,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<ClosestPoint>, RenderError> {
    let geometry = &world.geometry;
    query.check(geometry)?;
    let n = query.points.len();
    geometry.note_rays(n as u64);
    let chosen = query.objects.map(ChosenObjects);
    let filter = chosen.as_ref().map(|chosen| chosen as &(dyn HitFilter + Sync));
    let mut found = vec![ClosestPoint::MISS; n];
    control.start(n.div_ceil(PER_TASK));
    let workers = Workers::for_work(threads, NS_PER_POINT * n as f64, true)?;
    workers.run(|| {
        for first in (0..n).step_by(PER_BLOCK) {
            let end = n.min(first + PER_BLOCK);
            let order: Vec<u32> = match workers {
                Workers::Here => (0..(end - first) as u32).collect(),
                Workers::Pool(..) => morton_order(&query.points[first..end]),
            };
            let task = |indices: &[u32]| {
                control.check()?;
                let at = indices.iter().map(|&i| first + i as usize);
                let points: Vec<[f64; 3]> = at.clone().map(|i| query.points[i]).collect();
                let limits: Vec<f64> = match query.max_distance {
                    [limit] => vec![*limit],
                    limits => at.map(|i| limits[i]).collect(),
                };
                let mut found = vec![ClosestPoint::MISS; points.len()];
                let filter = filter.map(|filter| filter as &dyn HitFilter);
                geometry.two_level().closest_points(&points, &limits, geometry, filter, &mut found);
                control.advance();
                Ok(found)
            };
            let sorted: Result<Vec<Vec<ClosestPoint>>, RenderError> = match workers {
                Workers::Here => order.chunks(PER_TASK).map(task).collect(),
                Workers::Pool(..) => order.par_chunks(PER_TASK).map(task).collect(),
            };
            for (&i, point) in order.iter().zip(sorted?.iter().flatten()) {
                found[first + i as usize] = *point;
            }
        }
        Ok(())
    })?;
    Ok(found)
}

/// Indices of points in the order of their Morton codes within their box, so that neighbouring indices are close to
/// each other.
fn morton_order(points: &[[f64; 3]]) -> Vec<u32> {
    let finite = points.iter().map(|&point| DVec3::from(point)).filter(|point| point.is_finite());
    let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (lower, upper) = finite.fold(nothing, |(l, u), point| (l.min(point), u.max(point)));
    let cells = f64::from((1u32 << MORTON_BITS) - 1);
    let scale = cells / (upper - lower).max_element().max(f64::MIN_POSITIVE);
    let code = |point: [f64; 3]| {
        // Casts saturate, and convert NaN to 0.
        let cell = ((DVec3::from(point) - lower) * scale).to_array().map(|x| x as u32 & ((1 << MORTON_BITS) - 1));
        spread_bits(cell[0]) | spread_bits(cell[1]) << 1 | spread_bits(cell[2]) << 2
    };
    let mut keys: Vec<(u64, u32)> = points.par_iter().enumerate().map(|(i, &point)| (code(point), i as u32)).collect();
    keys.par_sort_unstable();
    keys.into_par_iter().map(|(_, i)| i).collect()
}

/// Bits of a Morton code per axis.
const MORTON_BITS: u32 = 20;

/// Inserts two zeros before each bit of a number of 21 bits.
fn spread_bits(x: u32) -> u64 {
    let x = u64::from(x);
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

fn outward_normal(geometry: &Geometry, found: &ClosestPoint) -> [f64; 3] {
    if found.instance == INVALID_ID {
        return [0.0; 3];
    }
    let normal = unit_normal(geometry.corners(found.instance, found.triangle));
    let normal = if geometry.instances[found.instance as usize].flips_orientation { -normal } else { normal };
    // The computed normal of a triangle without area is zero or not finite.
    if normal.is_finite() { (normal + 0.0).to_array() } else { [0.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn morton_order_puts_nearby_points_next_to_each_other() {
        let corner = |i: usize| [(i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2 & 1) as f64];
        let points: Vec<[f64; 3]> = (0..8).rev().map(corner).collect();
        assert_eq!(morton_order(&points), [7, 6, 5, 4, 3, 2, 1, 0]);
        assert_eq!(spread_bits(0b101), 0b1_000_001);
        assert_eq!(morton_order(&[[f64::NAN; 3], [f64::INFINITY; 3]]).len(), 2);
    }
}

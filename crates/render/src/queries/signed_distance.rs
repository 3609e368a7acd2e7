//! Signed distances: negative inside.

use glam::DVec3;
use raycam_bvh::{ClosestPoint, INVALID_ID};
use rayon::prelude::*;

use crate::control::Control;
use crate::error::RenderError;
use crate::interaction::vector::unit_normal;
use crate::prepare::geometry::Geometry;
use crate::prepare::instance::PreparedInstance;
use crate::prepare::world::PreparedWorld;
use crate::queries::inside::inside;
use crate::queries::points::{PointArrays, search};
use crate::queries::winding::winding_number;
use crate::thread_pool::with_pool;

/// Rule that determines the sign of a distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sign {
    /// Negative if [`inside`] is true.
    #[default]
    Auto,
    /// Negative if the absolute winding number is at least 1/2.
    Winding,
    /// Negative if the point is behind the surface at its closest surface point (J. A. Bærentzen and H. Aanæs 2005).
    Pseudonormal,
}

/// Distance of each point to the selected objects, negative inside; +inf beyond `max_distance`.
///
/// # Errors
/// Same as [`crate::queries::points::closest_points`].
pub fn signed_distance(
    world: &PreparedWorld,
    query: &PointArrays,
    sign: Sign,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<f64>, RenderError> {
    let found = search(world, query, threads, control)?;
    let within: Vec<usize> = (0..found.len()).filter(|&i| found[i].instance != INVALID_ID).collect();
    let points: Vec<[f64; 3]> = within.iter().map(|&i| query.points[i]).collect();
    let negative: Vec<bool> = match sign {
        Sign::Auto => inside(world, &points, query.objects, threads, control)?,
        Sign::Winding => {
            let numbers = winding_number(world, &points, query.objects, threads, control)?;
            numbers.into_iter().map(|number| number.abs() >= 0.5).collect()
        }
        Sign::Pseudonormal => with_pool(threads, || {
            within.par_iter().map(|&i| is_behind(&world.geometry, query.points[i].into(), &found[i])).collect()
        })?,
    };
    let mut distances: Vec<f64> = found.iter().map(|found| found.distance).collect();
    for (i, negative) in within.into_iter().zip(negative) {
        if negative && distances[i] > 0.0 {
            distances[i] = -distances[i];
        }
    }
    Ok(distances)
}

/// True if a point is behind the surface at its closest surface point.
fn is_behind(geometry: &Geometry, point: DVec3, found: &ClosestPoint) -> bool {
    (point - DVec3::from(found.position)).dot(pseudonormal(geometry, found)) < 0.0
}

/// Outward normal at a closest point: the triangle's normal; at an edge, the sum of both normals; at a vertex, the
/// normals weighted by angles.
fn pseudonormal(geometry: &Geometry, found: &ClosestPoint) -> DVec3 {
    let object = &geometry.instances[found.instance as usize];
    let corners = object.mesh.mesh.triangles[found.triangle as usize];
    let used: Vec<u32> = (0..3).filter(|&i| found.weights[i] != 0.0).map(|i| corners[i]).collect();
    let normal = |triangle: u32| {
        let normal = unit_normal(geometry.corners(found.instance, triangle));
        if normal.is_finite() { normal } else { DVec3::ZERO }
    };
    let sum: DVec3 = match used[..] {
        [vertex] => around(object, vertex)
            .map(|(triangle, corner)| normal(triangle) * angle(geometry.corners(found.instance, triangle), corner))
            .sum(),
        [from, to] => {
            let points = object.mesh.point_triangles();
            let has_end = |triangle: u32| {
                object.mesh.mesh.triangles[triangle as usize].iter().any(|&vertex| points.is_same_point(vertex, to))
            };
            around(object, from).filter(|(triangle, _)| has_end(*triangle)).map(|(triangle, _)| normal(triangle)).sum()
        }
        _ => normal(found.triangle),
    };
    if object.flips_orientation { -sum } else { sum }
}

/// Triangles around a vertex's position, each with the index (0 to 2) of its corner at this position.
fn around(object: &PreparedInstance, vertex: u32) -> impl Iterator<Item = (u32, usize)> {
    let points = object.mesh.point_triangles();
    points.around(vertex).iter().map(move |&triangle| {
        let corners = object.mesh.mesh.triangles[triangle as usize];
        (triangle, corners.iter().position(|&corner| points.is_same_point(corner, vertex)).unwrap_or(0))
    })
}

/// Angle of a triangle at a corner, in radians.
fn angle(corners: [DVec3; 3], at: usize) -> f64 {
    let (e, f) = (corners[(at + 1) % 3] - corners[at], corners[(at + 2) % 3] - corners[at]);
    e.cross(f).length().atan2(e.dot(f))
}

//! Generalised winding numbers (A. Jacobson, L. Kavan and O. Sorkine-Hornung 2013).
//!
//! Closed oriented meshes have an integer winding number: the signed crossings of any ray. Other meshes are
//! closed by a cone from their boundary in a direction s. The crossings of a ray in the direction -s count
//! the windings of the closed surface, and the cone's solid angle is subtracted edge by edge (A. Van Oosterom
//! and J. Strackee 1983; after C. Martens and M. Bessmeltsev 2025).

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec3;
use raycam_bvh::ExactRay;

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::geometry::Geometry;
use crate::prepare::one_instance::OneInstance;
use crate::prepare::world::PreparedWorld;
use crate::queries::tasks::in_tasks;

/// Unit directions of cones, one in each octant.
const DIRECTIONS: [DVec3; 8] = [
    DVec3::new(0.36, 0.48, 0.8),
    DVec3::new(-0.48, 0.8, 0.36),
    DVec3::new(0.8, -0.36, 0.48),
    DVec3::new(-0.36, -0.8, 0.48),
    DVec3::new(0.48, 0.36, -0.8),
    DVec3::new(-0.8, 0.48, -0.36),
    DVec3::new(0.36, -0.8, -0.48),
    DVec3::new(-0.48, -0.36, -0.8),
];

/// Squared sine of the minimum angle between the ray and any boundary vertex as seen from the point: closer to the ray,
/// the cone is undefined.
const MIN_SQUARED_SINE: f64 = 1e-6;

/// Residual edges of a placed object: their end points in the world, and how many more times the triangles use each
/// edge in one direction than in the other.
pub(super) fn residual_edges(geometry: &Geometry, instance: usize) -> Vec<([DVec3; 2], f64)> {
    let object = &geometry.instances[instance];
    let vertices = &object.mesh.mesh.vertices;
    let sign = if object.flips_orientation { -1.0 } else { 1.0 };
    let place = |vertex: u32| object.world_from_mesh.transform_point3(vertices[vertex as usize]);
    let residual = object.mesh.surface().residual_edges.iter();
    residual.map(|(ends, excess)| (ends.map(place), sign * f64::from(*excess))).collect()
}

/// Winding number of an object around each point; `edges` are the object's [`residual_edges`].
pub(super) fn winding_numbers(
    geometry: &Geometry,
    instance: usize,
    edges: &[([DVec3; 2], f64)],
    points: &[[f64; 3]],
) -> Vec<f64> {
    let directions: Vec<DVec3> = points.iter().map(|point| cone_direction((*point).into(), edges)).collect();
    let rays: Vec<ExactRay> = points.iter().zip(&directions).map(|(point, s)| half_line(*point, -*s)).collect();
    let mut counts = vec![0; points.len()];
    geometry.two_level().count_crossings(&rays, geometry, Some(&OneInstance(instance as u32)), true, &mut counts);
    let of_point = |((point, s), count): ((&[f64; 3], &DVec3), &i32)| {
        let angles: f64 = edges.iter().map(|(ends, excess)| excess * cone_angle(*point, *s, *ends)).sum();
        f64::from(*count) + angles / (4.0 * PI)
    };
    points.iter().zip(&directions).zip(&counts).map(of_point).collect()
}

/// Creates the ray from a point to infinity in a direction.
pub(super) fn half_line(origin: [f64; 3], direction: DVec3) -> ExactRay {
    ExactRay { origin, direction: direction.to_array(), t_min: 0.0, t_max: f64::INFINITY }
}

/// First direction s for which no boundary vertex is near the ray from the point along -s.
fn cone_direction(point: DVec3, edges: &[([DVec3; 2], f64)]) -> DVec3 {
    let is_free = |s: &&DVec3| {
        edges.iter().flat_map(|(ends, _)| ends).all(|vertex| {
            let to = *vertex - point;
            let along = to.dot(**s);
            along > 0.0 || to.cross(**s).length_squared() > MIN_SQUARED_SINE * to.length_squared()
        })
    };
    DIRECTIONS.iter().find(is_free).copied().unwrap_or(DIRECTIONS[0])
}

/// Solid angle of the strip from an edge to infinity along s, a spherical triangle.
fn cone_angle(point: [f64; 3], s: DVec3, ends: [DVec3; 2]) -> f64 {
    let [a, b] = ends.map(|end| end - DVec3::from(point));
    let (la, lb) = (a.length(), b.length());
    let det = s.dot(a.cross(b));
    let along = la * lb + a.dot(b) + s.dot(a) * lb + s.dot(b) * la;
    if along > 0.0 {
        return 2.0 * det.atan2(along);
    }
    // The sign of the angle must match the crossings: it depends on the side on which the shifted ray passes the edge.
    let side = half_line(point, s).edge_side(ends[0].to_array(), ends[1].to_array());
    2.0 * (det.abs() * f64::from(side)).atan2(along) * f64::from(side.abs())
}

/// Generalised winding number of the selected objects around each point, summed over objects. Mirrored objects keep
/// their outside. The winding number around a point that is not finite is 0.
///
/// # Errors
/// [`RenderError::Cancelled`], and errors of `crate::thread_pool::with_pool`.
pub fn winding_number(
    world: &PreparedWorld,
    points: &[[f64; 3]],
    objects: Option<&[bool]>,
    threads: Option<usize>,
    control: &Control,
) -> Result<Vec<f64>, RenderError> {
    let geometry = &world.geometry;
    let chosen: Vec<(usize, Vec<_>)> = chosen_objects(geometry, objects)?
        .into_iter()
        .map(|instance| (instance, residual_edges(geometry, instance)))
        .collect();
    world.geometry.note_rays(points.len() as u64);
    let mut found = Vec::with_capacity(points.len());
    let work = |range: Range<usize>| {
        let points = &points[range];
        let mut sums = vec![0.0; points.len()];
        for (instance, edges) in &chosen {
            for (sum, number) in sums.iter_mut().zip(winding_numbers(geometry, *instance, edges, points)) {
                *sum += number;
            }
        }
        let is_finite = |point: &[f64; 3]| point.iter().all(|x| x.is_finite());
        sums.iter_mut().zip(points).filter(|(_, point)| !is_finite(point)).for_each(|(sum, _)| *sum = 0.0);
        sums
    };
    in_tasks((points.len(), f64::INFINITY), threads, control, work, |mut more| found.append(&mut more))?;
    Ok(found)
}

/// Indices of the selected objects that are visible.
pub(super) fn chosen_objects(geometry: &Geometry, objects: Option<&[bool]>) -> Result<Vec<usize>, RenderError> {
    let count = geometry.instances.len();
    if let Some(mask) = objects.filter(|mask| mask.len() != count) {
        let message =
            format!("the object mask has {} entries; expected one for each of the {count} objects", mask.len());
        return Err(RenderError::settings(message));
    }
    let counts = |&i: &usize| geometry.instances[i].is_visible && objects.is_none_or(|mask| mask[i]);
    Ok((0..count).filter(counts).collect())
}

//! The surface points that a camera shows: their pixels, angles of incidence, and derivatives of the pixel.

use std::ops::Range;

use glam::{DVec2, DVec3};
use raycam_bvh::{ExactHit, ExactRay, ExactTriangles, INVALID_ID, squared_distance_to_triangle};
use raycam_scene::camera::Camera;

use crate::control::Control;
use crate::error::RenderError;
use crate::prepare::geometry::Geometry;
use crate::prepare::world::PreparedWorld;
use crate::queries::selection::Selection;
use crate::queries::tasks::{NS_PER_RAY, in_tasks};
use crate::queries::visible::clear_pairs;

/// Step of the central differences of [`CameraSight::footprints`], relative to the point's distance from the
/// ray's origin.
const RELATIVE_STEP: f64 = 1e-4;

/// A hit counts as being at the point if it is within this distance before the point, as a fraction of the line's
/// length.
const LAST_PART: f64 = 1e-12;

/// Points of surfaces, in world coordinates, with the conditions under which a camera shows them.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoints<'a> {
    /// Positions of the points.
    pub positions: &'a [[f64; 3]],
    /// Unit normals, one per point.
    pub normals: &'a [[f64; 3]],
    /// If true, the camera also shows the points from behind.
    pub both_sides: bool,
    /// Points are shown if the cosine of their angle of incidence is greater than this value.
    pub min_cosine: f64,
}

/// The points that a camera shows, in ascending order of their indices.
#[derive(Clone, Debug, Default)]
pub struct CameraSight {
    /// Indices of the shown points.
    pub index: Vec<i64>,
    /// Pixel coordinates of the shown points.
    pub pixels: Vec<[f64; 2]>,
    /// Cosines of the shown points' angles of incidence.
    pub cosines: Vec<f64>,
    /// Origins of the pixels' rays. With a rolling shutter, an origin is the camera's position while the pixel's line
    /// is exposed.
    pub origins: Vec<[f64; 3]>,
    /// Derivatives of the pixel along two orthonormal surface directions, in pixels per metre: \[du/da, du/db, dv/da,
    /// dv/db]. NaN if the lens does not project the neighbourhood of a point. Empty unless requested.
    pub footprints: Vec<[f64; 4]>,
}

/// Returns the points that the camera shows: they project through the lens into the image, face the camera, and no
/// triangle is between them and the origin of their pixel's ray. Triangles within rounding error of either end do not
/// count.
///
/// # Errors
/// [`RenderError::Settings`] if the arrays differ in length, [`RenderError::Cancelled`], and errors of
/// [`crate::thread_pool::with_pool`].
pub fn points_in_sight(
    world: &PreparedWorld,
    camera: &Camera,
    points: &SurfacePoints,
    with_footprints: bool,
    threads: Option<usize>,
    control: &Control,
) -> Result<CameraSight, RenderError> {
    let (n, normals) = (points.positions.len(), points.normals.len());
    if n != normals {
        return Err(RenderError::settings(format!("{n} points and {normals} normals; expected equal numbers")));
    }
    let mut found = CameraSight::default();
    let work = |range| sight_of(&world.geometry, camera, points, with_footprints, range);
    in_tasks((n, NS_PER_RAY), threads, control, work, |more| found.append(more))?;
    Ok(found)
}

impl CameraSight {
    fn append(&mut self, mut more: Self) {
        self.index.append(&mut more.index);
        self.pixels.append(&mut more.pixels);
        self.cosines.append(&mut more.cosines);
        self.origins.append(&mut more.origins);
        self.footprints.append(&mut more.footprints);
    }
}

/// A point that projects into the image and faces the camera, but may be hidden.
struct Candidate {
    index: usize,
    pixel: DVec2,
    cosine: f64,
    origin: DVec3,
}

fn sight_of(
    geometry: &Geometry,
    camera: &Camera,
    points: &SurfacePoints,
    with_footprints: bool,
    range: Range<usize>,
) -> CameraSight {
    let candidates: Vec<Candidate> = range.filter_map(|index| candidate(camera, points, index)).collect();
    let ends: Vec<_> = candidates.iter().map(|at| [at.origin.to_array(), points.positions[at.index]]).collect();
    let clear = clear_sight_lines(geometry, &ends);
    let mut found = CameraSight::default();
    for (at, _) in candidates.iter().zip(clear).filter(|(_, clear)| *clear) {
        found.index.push(at.index as i64);
        found.pixels.push(at.pixel.to_array());
        found.cosines.push(at.cosine);
        found.origins.push(at.origin.to_array());
        if with_footprints {
            let [position, normal] = [points.positions[at.index], points.normals[at.index]].map(DVec3::from_array);
            found.footprints.push(footprint(camera, position, normal, at.origin.distance(position)));
        }
    }
    found
}

fn candidate(camera: &Camera, points: &SurfacePoints, index: usize) -> Option<Candidate> {
    let [position, normal] = [points.positions[index], points.normals[index]].map(DVec3::from_array);
    let cosine_from = |origin: DVec3| {
        let towards = origin - position;
        let cosine = towards.dot(normal) / towards.length();
        if points.both_sides { cosine.abs() } else { cosine }
    };
    // The rays of a static central camera share their origin: points that face away need no projection.
    let center = camera.static_center();
    if center.is_some_and(|center| !is_above(cosine_from(center), points.min_cosine)) {
        return None;
    }
    let (pixel, is_projected) = camera.project(position);
    let offset = camera.offset_from_corner(pixel);
    let [width, height] = camera.size().map(f64::from);
    let is_inside = offset.cmpge(DVec2::ZERO).all() && offset.cmplt(DVec2::new(width, height)).all();
    if !is_projected || !is_inside {
        return None;
    }
    let (origin, direction) = camera.ray(pixel);
    let cosine = cosine_from(origin);
    (direction.is_finite() && is_above(cosine, points.min_cosine)).then_some(Candidate { index, pixel, cosine, origin })
}

/// True for each pair of a ray's origin and a point without a triangle between them; triangles within rounding error of
/// either end do not count. Most pairs are decided by the first hit, because rays with a common origin form packets.
fn clear_sight_lines(geometry: &Geometry, ends: &[[[f64; 3]; 2]]) -> Vec<bool> {
    let towards = |[from, to]: &[[f64; 3]; 2]| ExactRay {
        origin: *from,
        direction: std::array::from_fn(|k| to[k] - from[k]),
        t_min: 0.0,
        t_max: 1.0,
    };
    let rays: Vec<ExactRay> = ends.iter().map(towards).collect();
    let mut hits = vec![ExactHit::MISS; rays.len()];
    geometry.exact_scene().closest_exact(&rays, geometry, &mut hits);
    let mut clear = Vec::with_capacity(ends.len());
    let (mut uncertain, mut numbers) = (vec![], vec![]);
    for (number, (pair, hit)) in ends.iter().zip(&hits).enumerate() {
        let decision = first_hit_decides(geometry, pair, hit);
        clear.push(decision.unwrap_or(false));
        if decision.is_none() {
            uncertain.push(*pair);
            numbers.push(number);
        }
    }
    let margins: Vec<f64> = uncertain.iter().map(|pair| rounding_error(pair.as_flattened())).collect();
    let decided = clear_pairs(geometry, &uncertain, &margins, &Selection::default(), 0);
    for (number, is_clear) in numbers.into_iter().zip(decided) {
        clear[number] = is_clear;
    }
    clear
}

/// True if the first hit between two points proves that no triangle is between them, false if it proves that a triangle
/// is. `None` if further hits must be examined.
fn first_hit_decides(geometry: &Geometry, ends: &[[f64; 3]; 2], hit: &ExactHit) -> Option<bool> {
    if hit.instance == INVALID_ID {
        return ends.as_flattened().iter().all(|x| x.is_finite()).then_some(true);
    }
    let corners = ExactTriangles::corners(geometry, hit.instance, hit.triangle);
    let margin = rounding_error(ends.as_flattened());
    let [is_at_origin, is_at_point] = ends.map(|end| squared_distance_to_triangle(end, corners).sqrt() <= margin);
    match (is_at_origin, is_at_point) {
        (false, false) => Some(false),
        // The first hit is at the point, so no triangle is between the points.
        (false, true) if hit.t >= 1.0 - LAST_PART => Some(true),
        _ => None,
    }
}

/// Bound of the rounding error of a point on a surface: eight units in the last place of the largest coordinate.
fn rounding_error(coordinates: &[f64]) -> f64 {
    8.0 * f64::EPSILON * coordinates.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()))
}

/// True if the cosine is greater than the limit; false if either number is NaN.
fn is_above(cosine: f64, limit: f64) -> bool {
    cosine > limit
}

/// The derivatives of the pixel along two surface directions, by central differences.
fn footprint(camera: &Camera, position: DVec3, normal: DVec3, distance: f64) -> [f64; 4] {
    let step = RELATIVE_STEP * distance;
    let (a, b) = normal.any_orthonormal_pair();
    let [along_a, along_b] = [a, b].map(|tangent| {
        let (ahead, _) = camera.project(position + step * tangent);
        let (behind, _) = camera.project(position - step * tangent);
        (ahead - behind) / (2.0 * step)
    });
    [along_a.x, along_b.x, along_a.y, along_b.y]
}

//! Lines of sight from a camera to surface points: the pixels that show the points, and whether the lines are clear.

use glam::{DVec2, DVec3};
use raycam_bvh::{ExactHit, ExactRay, ExactTriangles, HitDetail, INVALID_ID, squared_distance_to_triangle};
use raycam_scene::camera::Camera;

use crate::prepare::geometry::Geometry;
use crate::queries::selection::Selection;
use crate::queries::visible::clear_pairs;

/// Step of the central differences of `footprint`, relative to the point's distance from the ray's origin.
const RELATIVE_STEP: f64 = 1e-4;

/// Length of a ray, relative to the distance of its point. Most rays hit the surface at their point. Rays end
/// slightly behind the point, because only hits close to the end of a ray require exact arithmetic.
const RAY_LENGTH: f64 = 1.001;

/// Angles of incidence at which a camera shows surface points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incidence {
    /// If true, the camera also shows points from behind.
    pub both_sides: bool,
    /// Points are shown if the cosine of their angle of incidence is greater than this value.
    pub min_cosine: f64,
}

impl Incidence {
    /// Cosine of the angle of incidence of a line from `origin` if the camera shows the point at this angle.
    fn cosine(&self, origin: DVec3, position: DVec3, normal: DVec3) -> Option<f64> {
        let towards = origin - position;
        let along = towards.dot(normal);
        if !self.both_sides && self.min_cosine >= 0.0 && along <= 0.0 {
            return None;
        }
        let cosine = along / towards.length();
        let cosine = if self.both_sides { cosine.abs() } else { cosine };
        // False if either number is NaN.
        (cosine > self.min_cosine).then_some(cosine)
    }
}

/// Line from a camera to a point that projects into the image and faces the camera; the line may be blocked. Both ends
/// are finite.
#[derive(Clone, Copy, Debug)]
pub(super) struct SightLine {
    /// The caller's index of the point.
    pub index: usize,
    pub position: DVec3,
    /// Cosine of the angle of incidence.
    pub cosine: f64,
    /// Origin of the pixel's ray.
    pub origin: DVec3,
}

impl SightLine {
    /// Returns the line to a point, and the point's pixel; `None` if the point is outside the image or faces away
    /// (`Incidence`).
    pub fn new(
        camera: &Camera,
        incidence: Incidence,
        index: usize,
        point: [[f64; 3]; 2],
    ) -> Option<(SightLine, DVec2)> {
        // The rays of a static central camera share their origin: points that face away need no projection.
        let line = match camera.static_center() {
            Some(center) => Some(Self::from_origin(center, incidence, index, point)?),
            None => None,
        };
        let (pixel, is_projected) = camera.project(DVec3::from_array(point[0]));
        let offset = camera.offset_from_corner(pixel);
        let [width, height] = camera.size().map(f64::from);
        let is_inside = offset.cmpge(DVec2::ZERO).all() && offset.cmplt(DVec2::new(width, height)).all();
        if !is_projected || !is_inside {
            return None;
        }
        // The point projects to this pixel, so the pixel's ray passes through the point.
        let line = line.or_else(|| Self::from_origin(camera.ray(pixel).0, incidence, index, point));
        Some((line?, pixel))
    }

    /// Returns the line from `origin`, the origin of the pixel's ray, to a point that projects into the image; `None`
    /// if the point faces away (`Incidence`).
    pub fn from_origin(
        origin: DVec3,
        incidence: Incidence,
        index: usize,
        [position, normal]: [[f64; 3]; 2],
    ) -> Option<SightLine> {
        let [position, normal] = [position, normal].map(DVec3::from_array);
        let cosine = incidence.cosine(origin, position, normal)?;
        Some(SightLine { index, position, cosine, origin })
    }

    fn ends(&self) -> [[f64; 3]; 2] {
        [self.origin.to_array(), self.position.to_array()]
    }

    /// Bound of the rounding error of either end, as a point of a surface: eight units in the last place of the largest
    /// coordinate.
    fn rounding_error(&self) -> f64 {
        8.0 * f64::EPSILON * self.origin.abs().max(self.position.abs()).max_element()
    }

    /// Upper bound of the footprint's smaller singular value, in pixels per metre, if the derivative of the pixel with
    /// respect to the direction is at most `max_scale` pixels per radian.
    pub fn max_resolution(&self, max_scale: f64) -> f64 {
        max_scale * self.cosine / self.origin.distance(self.position)
    }

    /// The derivatives of the pixel along two orthonormal surface directions, by central differences, in pixels per
    /// metre: \[du/da, du/db, dv/da, dv/db]. NaN if the lens does not project the neighbourhood of the point.
    pub fn footprint(&self, camera: &Camera, normal: [f64; 3]) -> [f64; 4] {
        let step = RELATIVE_STEP * self.origin.distance(self.position);
        let (a, b) = DVec3::from_array(normal).any_orthonormal_pair();
        let [along_a, along_b] = [a, b].map(|tangent| {
            let (ahead, _) = camera.project(self.position + step * tangent);
            let (behind, _) = camera.project(self.position - step * tangent);
            (ahead - behind) / (2.0 * step)
        });
        [along_a.x, along_b.x, along_a.y, along_b.y]
    }
}

/// Whether a triangle is between the ends of a line.
#[derive(Clone, Copy, Debug)]
pub(super) enum Clearance {
    Clear,
    /// The triangle is omitted if several triangles had to be examined.
    Blocked(Option<Blocker>),
}

impl Clearance {
    pub fn is_clear(&self) -> bool {
        matches!(self, Clearance::Clear)
    }
}

/// A triangle between the ends of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blocker([DVec3; 3]);

impl Blocker {
    /// True if the triangle certainly blocks the line, without exact arithmetic.
    pub fn certainly_blocks(&self, line: &SightLine) -> bool {
        let [a, b, c] = self.0.map(|corner| corner - line.origin);
        let way = line.position - line.origin;
        // Volumes of the tetrahedra between the line and the edges: their signs are equal if the line passes inside.
        let volumes = [way.dot(a.cross(b)), way.dot(b.cross(c)), way.dot(c.cross(a))];
        let error = self.volume_error(line);
        let passes = volumes.iter().all(|volume| *volume > error) || volumes.iter().all(|volume| *volume < -error);
        let [from, to] = self.sides(line);
        passes && from * to < 0.0
    }

    /// Sides of the triangle's plane on which the origin and the point certainly are, outside of rounding error: 1 or
    /// -1, or 0 if uncertain.
    fn sides(&self, line: &SightLine) -> [f64; 2] {
        let [a, b, c] = self.0;
        let normal = (b - a).cross(c - a);
        let limit = self.volume_error(line) + 2.0 * line.rounding_error() * normal.length();
        [line.origin, line.position].map(|end| {
            let volume = normal.dot(end - a);
            if volume.abs() > limit { volume.signum() } else { 0.0 }
        })
    }

    /// Bound of the error of volumes that are computed from the triangle and the line.
    fn volume_error(&self, line: &SightLine) -> f64 {
        let corners = self.0.iter().map(|corner| (*corner - line.origin).length_squared());
        let extent = corners.fold(line.origin.distance_squared(line.position), f64::max);
        let largest = extent.sqrt() + line.origin.abs().max_element();
        64.0 * f64::EPSILON * largest * extent
    }
}

/// Returns for each line whether a triangle is between its ends; triangles within rounding error of either end do not
/// count. `surface` returns the corners of the point's own triangle, if known. Most lines are decided by the first hit,
/// because rays with a common origin form packets.
pub(super) fn clearances<'a>(
    geometry: &Geometry,
    lines: &[SightLine],
    surface: impl Fn(&SightLine) -> Option<&'a [[f64; 3]; 3]>,
) -> Vec<Clearance> {
    let ray = |line: &SightLine| ExactRay {
        origin: line.origin.to_array(),
        direction: (line.position - line.origin).to_array(),
        t_min: 0.0,
        t_max: RAY_LENGTH,
    };
    let rays: Vec<ExactRay> = lines.iter().map(ray).collect();
    let mut hits = vec![ExactHit::MISS; rays.len()];
    let ties = geometry.exact_scene().closest_exact_with(&rays, geometry, None, HitDetail::Triangle, &mut hits);
    let decide = |(line, hit)| first_hit_decides(geometry, line, surface(line), hit);
    let mut decisions: Vec<Option<Clearance>> = lines.iter().zip(&hits).map(decide).collect();
    for tie in ties {
        decisions[tie.ray as usize] = None;
    }
    let uncertain: Vec<&SightLine> =
        lines.iter().zip(&decisions).filter(|(_, known)| known.is_none()).map(|(line, _)| line).collect();
    let ends: Vec<_> = uncertain.iter().map(|line| line.ends()).collect();
    let margins: Vec<f64> = uncertain.iter().map(|line| line.rounding_error()).collect();
    let mut decided = clear_pairs(geometry, &ends, &margins, &Selection::default(), 0).into_iter();
    let mut by_all_hits = || match decided.next() {
        Some(true) => Clearance::Clear,
        _ => Clearance::Blocked(None),
    };
    decisions.into_iter().map(|known| known.unwrap_or_else(&mut by_all_hits)).collect()
}

/// Decides by the first hit of a line's ray; `None` if further hits must be examined.
fn first_hit_decides(
    geometry: &Geometry,
    line: &SightLine,
    surface: Option<&[[f64; 3]; 3]>,
    hit: &ExactHit,
) -> Option<Clearance> {
    if hit.instance == INVALID_ID {
        return Some(Clearance::Clear);
    }
    let corners = ExactTriangles::corners(geometry, hit.instance, hit.triangle);
    let blocker = Blocker(corners.map(DVec3::from_array));
    let [from, to] = blocker.sides(line);
    if from * to < 0.0 {
        return Some(Clearance::Blocked(Some(blocker)));
    }
    // If the hit is at the point and not at the origin, no triangle is before the point.
    let distance = || squared_distance_to_triangle(line.position.to_array(), corners).sqrt();
    let is_at_point = surface == Some(&corners) || distance() <= line.rounding_error();
    (is_at_point && from != 0.0).then_some(Clearance::Clear)
}

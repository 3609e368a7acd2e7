//! A camera's view of a block of faces: bounds that decide for many faces or samples at once.

use glam::DVec3;
use raycam_scene::camera::Camera;

use crate::queries::sight_line::Incidence;
use crate::queries::view_bounds::{Placement, ViewBounds};

/// A camera that may show faces of a block.
pub(super) struct BlockView<'a> {
    /// Index of the camera.
    pub number: usize,
    pub camera: &'a Camera,
    /// The common origin of all lines of sight if the camera's image contains the whole block.
    pub origin: Option<DVec3>,
    /// Upper bound of the pixels per radian within the block; infinite if unknown.
    pub max_scale: f64,
    /// Upper bound of the area of a face in pixels; infinite unless the image contains the whole block.
    pub max_area: f64,
    /// Bounds that can exclude single faces; `None` if unknown, or if the image contains the whole block.
    bounds: Option<&'a ViewBounds>,
}

impl<'a> BlockView<'a> {
    /// Returns the cameras that may show any of the faces with these corners, in world coordinates. `bounds` has one
    /// value for each camera.
    pub fn of_cameras(
        corners: &[[[f64; 3]; 3]],
        cameras: &'a [Camera],
        bounds: &'a [Option<ViewBounds>],
    ) -> Vec<BlockView<'a>> {
        let points = || corners.iter().flatten().map(|point| DVec3::from_array(*point));
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let sphere = (low + points().fold(DVec3::NEG_INFINITY, DVec3::max)) / 2.0;
        let radius = points().map(|point| point.distance(sphere)).fold(0.0, f64::max);
        let largest = corners.iter().map(face_area).fold(0.0, f64::max);
        let view = |(number, (camera, bounds)): (usize, (&'a Camera, &'a Option<ViewBounds>))| {
            let unknown = Placement::Uncertain { max_scale: f64::INFINITY };
            let (origin, max_scale) =
                match bounds.as_ref().map_or(unknown, |bounds| bounds.place(camera, sphere, radius)) {
                    Placement::Outside => return None,
                    Placement::Inside { max_scale } => (camera.static_center(), max_scale),
                    Placement::Uncertain { max_scale } => (None, max_scale),
                };
            let max_area = origin
                .map_or(f64::INFINITY, |origin| largest * (max_scale / (origin.distance(sphere) - radius)).powi(2));
            let bounds = bounds.as_ref().filter(|_| origin.is_none());
            Some(BlockView { number, camera, origin, max_scale, max_area, bounds })
        };
        cameras.iter().zip(bounds).enumerate().filter_map(view).collect()
    }

    /// False if the camera is certainly behind a face, or if the face is certainly outside of the image.
    pub fn may_show(&self, corners: &[[f64; 3]; 3], normal: [f64; 3], incidence: Incidence) -> bool {
        let Some(center) = self.camera.static_center() else { return true };
        let (corners, normal) = (corners.map(DVec3::from_array), DVec3::from_array(normal));
        let largest = corners.iter().fold(center.abs(), |most, corner| most.max(corner.abs())).max_element();
        // This bound includes the rounding errors of a sample's position, and of the dot product that
        // [`Incidence`] computes for the sample.
        let error = 64.0 * f64::EPSILON * largest;
        let is_behind = |corner: &DVec3| (center - corner).dot(normal) < -error;
        if !incidence.both_sides && corners.iter().all(is_behind) {
            return false;
        }
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = || corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
        !self.bounds.is_some_and(|bounds| bounds.is_outside(middle, radius()))
    }
}

fn face_area(corners: &[[f64; 3]; 3]) -> f64 {
    let [a, b, c] = corners.map(DVec3::from_array);
    (b - a).cross(c - a).length() / 2.0
}

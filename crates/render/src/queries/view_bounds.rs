//! Bounds of a camera's image: whether it shows a region of space completely or not at all, and its pixels per radian.
//!
//! They decide for many points at once, so that the lens model is evaluated only for points near the image's border.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use raycam_scene::camera::Camera;

/// Nodes per side of the grid over the image on which a lens is sampled. Odd, so that a node is in the middle.
const NODES: usize = 17;

/// Step of the central differences, in radians.
const STEP: f64 = 1e-4;

/// Maximum ratio of the pixels per radian at neighbouring nodes. A lens with a larger ratio has no bounds.
const MAX_RATIO: f64 = 1.25;

/// Factor on upper bounds that allows for the errors of rounding and of central differences.
const SLACK: f64 = 1.01;

/// Maximum angle, in radians, between the axis and the directions in an image. Images with larger angles exclude no
/// points.
const MAX_CONE_ANGLE: f64 = 1.75;

/// Position of a sphere relative to an image. `max_scale` bounds the length of the derivative of the pixel
/// with respect to the direction, in pixels per radian, where the image shows the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Placement {
    /// No point projects into the image or near its border.
    Outside,
    /// All points project into the image.
    Inside {
        max_scale: f64,
    },
    Uncertain {
        max_scale: f64,
    },
}

/// Bounds of the image of a camera whose rays start at one point.
#[derive(Clone, Debug)]
pub(super) struct ViewBounds {
    center: DVec3,
    /// Direction of the image's middle.
    axis: DVec3,
    lens: Arc<LensBounds>,
}

/// The part of the bounds that depends on the intrinsics only.
#[derive(Debug)]
struct LensBounds {
    /// Direction of the image's middle in camera axes.
    axis: DVec3,
    /// Bound of the angle between the axis and the directions in the image.
    max_angle: f64,
    /// Pixels per radian at each node, row by row.
    scales: Vec<f64>,
    /// Largest ratio of the scales of neighbouring nodes.
    ratio: f64,
}

impl ViewBounds {
    /// Returns the bounds of each camera; `None` for a camera without a centre, a camera that moves while the shutter
    /// is open, and a lens that does not cover the image or varies too much.
    pub fn of_cameras(cameras: &[Camera]) -> Vec<Option<ViewBounds>> {
        let mut known: Vec<(&Camera, Option<Arc<LensBounds>>)> = vec![];
        let bounds = |camera| {
            let found = known.iter().find(|(other, _)| have_equal_intrinsics(camera, other));
            let lens = found.map(|(_, lens)| lens.clone()).unwrap_or_else(|| {
                known.push((camera, LensBounds::new(camera).map(Arc::new)));
                known[known.len() - 1].1.clone()
            })?;
            Some(ViewBounds { center: camera.c(), axis: camera.r().transpose() * lens.axis, lens })
        };
        cameras.iter().map(bounds).collect()
    }

    /// True if the image certainly shows no point of a sphere.
    pub fn is_outside(&self, sphere: DVec3, radius: f64) -> bool {
        let way = sphere - self.center;
        let distance = way.length();
        // False if a number is NaN.
        distance > radius && self.axis.angle_between(way) - (radius / distance).asin() > self.lens.max_angle
    }

    /// Returns the position of a sphere relative to the image of `camera`, to which these bounds belong.
    pub fn place(&self, camera: &Camera, sphere: DVec3, radius: f64) -> Placement {
        let way = sphere - self.center;
        let distance = way.length();
        let uncertain = Placement::Uncertain { max_scale: self.lens.max_scale() };
        // False if a number is NaN.
        let is_far = distance > 4.0 * radius;
        if !is_far {
            return uncertain;
        }
        let width = (radius / distance).asin();
        let angle = self.axis.angle_between(way);
        // Because of the margins, a sphere is not outside if a face in it could have corners on several sides
        // of the image: the area of such a face is included even if all of its corners are outside.
        if angle - 5.0 * width > self.lens.max_angle && angle + 5.0 * width < PI {
            return Placement::Outside;
        }
        let (pixel, is_projected) = camera.project(sphere);
        let (at, size) = (camera.offset_from_corner(pixel), image_size(camera));
        let margin = 1.0 + width * self.lens.max_scale();
        if is_projected && at.cmpgt(DVec2::splat(margin)).all() && at.cmplt(size - margin).all() {
            return Placement::Inside { max_scale: self.lens.max_scale_near(at / size, margin / size) };
        }
        uncertain
    }
}

impl LensBounds {
    fn new(camera: &Camera) -> Option<LensBounds> {
        let center = camera.static_center()?;
        let (mut directions, mut scales) = (vec![], vec![]);
        let (size, first) = (image_size(camera), camera.pixel_center().offset() - 0.5);
        for node in 0..NODES * NODES {
            let at = DVec2::new((node % NODES) as f64, (node / NODES) as f64) / (NODES - 1) as f64;
            let direction = camera.ray(at * size + first).1;
            directions.push(direction);
            scales.push(scale(camera, center, direction));
        }
        let axis = directions[NODES * NODES / 2];
        let (mut ratio, mut step) = (1.0, 0.0);
        for [i, j] in neighbors() {
            // The ratio is NaN if the lens does not cover the image; the comparison with MAX_RATIO is then false.
            ratio = max_or_nan(ratio, max_or_nan(scales[i] / scales[j], scales[j] / scales[i]));
            step = max_or_nan(step, directions[i].angle_between(directions[j]));
        }
        let farthest = directions.iter().fold(0.0, |most, way| max_or_nan(most, axis.angle_between(*way)));
        let max_angle = SLACK * (farthest + step);
        let max_angle = if max_angle < MAX_CONE_ANGLE { max_angle } else { PI };
        (ratio < MAX_RATIO).then(|| LensBounds { axis: camera.r() * axis, max_angle, scales, ratio })
    }

    fn max_scale(&self) -> f64 {
        SLACK * self.ratio * self.scales.iter().fold(0.0, |most, scale| scale.max(most))
    }

    /// Upper bound of the scale within `distance` of the point `at`, both as fractions of the image's size.
    fn max_scale_near(&self, at: DVec2, distance: DVec2) -> f64 {
        let cells = (NODES - 1) as f64;
        let [low, high] = [((at - distance) * cells).floor(), ((at + distance) * cells).ceil()];
        let nodes = |low: f64, high: f64| (low.max(0.0) as usize)..=(high.min(cells) as usize);
        let rows = nodes(low.y, high.y).map(|row| &self.scales[row * NODES..][nodes(low.x, high.x)]);
        SLACK * self.ratio * rows.flatten().fold(0.0, |most, scale| scale.max(most))
    }
}

/// Pairs of nodes that are neighbours in a row or column.
fn neighbors() -> impl Iterator<Item = [usize; 2]> {
    let in_rows = (0..NODES * NODES).filter(|node| node % NODES > 0).map(|node| [node - 1, node]);
    in_rows.chain((NODES..NODES * NODES).map(|node| [node - NODES, node]))
}

/// The largest singular value of the derivative of the pixel with respect to the direction, in pixels per radian.
fn scale(camera: &Camera, center: DVec3, direction: DVec3) -> f64 {
    if !direction.is_finite() {
        return f64::NAN;
    }
    let (a, b) = direction.any_orthonormal_pair();
    let [a, b] = [a, b].map(|tangent| {
        let [(ahead, _), (behind, _)] = [STEP, -STEP].map(|step| camera.project(center + direction + step * tangent));
        (ahead - behind) / (2.0 * STEP)
    });
    (DVec2::new(a.x + b.y, a.y - b.x).length() + DVec2::new(a.x - b.y, a.y + b.x).length()) / 2.0
}

fn have_equal_intrinsics(a: &Camera, b: &Camera) -> bool {
    (a.k(), a.lens(), a.size(), a.pixel_center()) == (b.k(), b.lens(), b.size(), b.pixel_center())
        && a.static_center().is_some() == b.static_center().is_some()
}

fn image_size(camera: &Camera) -> DVec2 {
    DVec2::from_array(camera.size().map(f64::from))
}

/// The larger number; NaN if either is NaN.
fn max_or_nan(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

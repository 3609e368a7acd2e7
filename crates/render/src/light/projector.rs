//! Projector: an image that shines from one point through the lens of a camera.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use raycam_scene::{Camera, Image};

use crate::light::bounds::LightBounds;
use crate::light::samples::LightLiSample;

/// Number of cells of the table of solid angles, along the longer side of the image.
const TABLE_CELLS: usize = 128;
/// Half of the step, in pixels, with which ray directions are differentiated numerically.
const HALF_STEP: f64 = 0.25;
/// Margin of the light's bounds: an angle in radians.
const BOUNDS_MARGIN: f64 = 0.02;

#[derive(Debug)]
pub(crate) struct ProjectorLight {
    camera: Camera,
    /// World coordinates of the scene's origin.
    origin: DVec3,
    /// Scene-local position of the projector.
    position: DVec3,
    image: Arc<Image>,
    /// Power of a white pixel of the camera in W, for each colour.
    pixel_power: Vec3,
    table: SolidAngles,
    bounds: LightBounds,
}

/// Reciprocal solid angles of a camera's pixels on a grid over the image; 0 outside the lens model's valid region.
#[derive(Debug)]
struct SolidAngles {
    cells: [usize; 2],
    /// Values at the (columns + 1) x (rows + 1) corners of the cells.
    corners: Vec<f64>,
}

impl SolidAngles {
    fn new(camera: &Camera, corner: DVec2) -> Self {
        let size = camera.size().map(f64::from);
        let longer = size[0].max(size[1]);
        let cells = size.map(|side| ((side / longer * TABLE_CELLS as f64).ceil() as usize).max(1));
        let value = |share: DVec2| reciprocal_solid_angle(camera, corner + share * DVec2::from(size));
        Self { cells, corners: Self::places(cells).map(value).collect() }
    }

    /// Positions of the grid's corners in the image, from 0 to 1 along each side.
    fn places([columns, rows]: [usize; 2]) -> impl Iterator<Item = DVec2> {
        let place = move |i: usize| {
            let (x, y) = (i % (columns + 1), i / (columns + 1));
            DVec2::new(x as f64 / columns as f64, y as f64 / rows as f64)
        };
        (0..(columns + 1) * (rows + 1)).map(place)
    }

    /// Value at a position in the image (from 0 to 1 along each side), linear between the corners.
    fn at(&self, share: DVec2) -> f64 {
        let [columns, rows] = self.cells;
        let place = share * DVec2::new(columns as f64, rows as f64);
        let (x, y) = ((place.x as usize).min(columns - 1), (place.y as usize).min(rows - 1));
        let (fx, fy) = (place.x - x as f64, place.y - y as f64);
        let corner = |dx: usize, dy: usize| self.corners[(y + dy) * (columns + 1) + x + dx];
        let row = |dy: usize| corner(0, dy) * (1.0 - fx) + corner(1, dy) * fx;
        row(0) * (1.0 - fy) + row(1) * fy
    }
}

/// Reciprocal solid angle of a pixel around a position in the image.
fn reciprocal_solid_angle(camera: &Camera, pixel: DVec2) -> f64 {
    let direction = |dx: f64, dy: f64| camera.ray(pixel + DVec2::new(dx, dy)).1.normalize_or(DVec3::NAN);
    let along = (direction(HALF_STEP, 0.0) - direction(-HALF_STEP, 0.0)) / (2.0 * HALF_STEP);
    let down = (direction(0.0, HALF_STEP) - direction(0.0, -HALF_STEP)) / (2.0 * HALF_STEP);
    let solid_angle = along.cross(down).length();
    if solid_angle.is_finite() && solid_angle > 0.0 { 1.0 / solid_angle } else { 0.0 }
}

impl ProjectorLight {
    /// Projector of a camera. `power` is the power of a white image; `irradiance` is the irradiance by a white image at
    /// 1 m on the axis.
    pub fn new(
        camera: &Camera,
        origin: DVec3,
        image: Arc<Image>,
        power: Option<Vec3>,
        irradiance: Option<Vec3>,
    ) -> Self {
        let [width, height] = camera.size().map(f64::from);
        let k = camera.k();
        // On the axis, a pixel covers 1 / (fx fy) of a plane at a distance of 1.
        let share_of_axis = 1.0 / (k.x_axis.x * k.y_axis.y).abs();
        let pixel_power = match (power, irradiance) {
            (Some(power), _) => power / (width * height) as f32,
            (None, Some(irradiance)) => irradiance * share_of_axis as f32,
            (None, None) => Vec3::ZERO,
        };
        let corner = camera.pixel_center_of(0, 0) - 0.5;
        let mut projector = Self {
            camera: camera.clone(),
            origin,
            position: camera.c() - origin,
            image,
            pixel_power,
            table: SolidAngles::new(camera, corner),
            bounds: LightBounds::default(),
        };
        projector.bounds = projector.compute_bounds(corner);
        projector
    }

    fn compute_bounds(&self, corner: DVec2) -> LightBounds {
        let texels = (0..self.image.size.map(|n| n as usize).iter().product()).map(|i| self.image.texels.linear(i));
        let brightest = texels.fold(Vec3::ZERO, |most, [r, g, b, _]| most.max(Vec3::new(r, g, b)));
        let densest = self.table.corners.iter().copied().fold(0.0, f64::max);
        let axis = self.camera.forward();
        let size = self.camera.size().map(f64::from);
        let cosines = SolidAngles::places(self.table.cells).map(|share| {
            let direction = self.camera.ray(corner + share * DVec2::from(size)).1.normalize_or(DVec3::NAN);
            direction.dot(axis)
        });
        // Directions outside the lens model's valid region are NaN, which `min` ignores.
        let widest = (cosines.fold(1.0, f64::min).clamp(-1.0, 1.0).acos() + BOUNDS_MARGIN).min(std::f64::consts::PI);
        LightBounds {
            axis: axis.as_vec3(),
            cos_theta_o: widest.cos() as f32,
            cos_theta_e: BOUNDS_MARGIN.cos() as f32,
            ..LightBounds::isotropic(self.position, self.position, self.pixel_power * brightest * densest as f32)
        }
    }

    pub fn bounds(&self) -> LightBounds {
        self.bounds
    }

    /// Scene-local position of the projector.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Image coordinates of a scene-local point in pixels of the camera; `None` for a point that no pixel shines on.
    pub fn pixel_of(&self, point: DVec3) -> Option<DVec2> {
        let (pixel, is_seen) = self.camera.project(point + self.origin);
        let share = self.share_of(pixel);
        let is_inside = share.cmpge(DVec2::ZERO).all() && share.cmple(DVec2::ONE).all();
        (is_seen && is_inside).then_some(pixel)
    }

    /// Position in the image, from 0 to 1 along each side, of pixel coordinates.
    fn share_of(&self, pixel: DVec2) -> DVec2 {
        (pixel - self.camera.pixel_center_of(0, 0) + 0.5) / DVec2::from(self.camera.size().map(f64::from))
    }

    /// Value of the projected image at a position from 0 to 1, linear between the centres of texels.
    fn texel_at(&self, share: DVec2) -> Vec3 {
        let [width, height] = self.image.size.map(|n| n as usize);
        let place = share * DVec2::new(width as f64, height as f64) - 0.5;
        let first = place.floor();
        let (fx, fy) = ((place.x - first.x) as f32, (place.y - first.y) as f32);
        let texel = |dx: i64, dy: i64| {
            let x = (first.x as i64 + dx).clamp(0, width as i64 - 1) as usize;
            let y = (first.y as i64 + dy).clamp(0, height as i64 - 1) as usize;
            Vec3::from_slice(&self.image.texels.linear(y * width + x))
        };
        let row = |dy: i64| texel(0, dy).lerp(texel(1, dy), fx);
        row(0).lerp(row(1), fy)
    }

    pub fn sample(&self, point: DVec3) -> Option<LightLiSample> {
        let offset = self.position - point;
        let distance2 = offset.length_squared();
        let share = self.share_of(self.pixel_of(point)?);
        let intensity = (self.pixel_power * self.texel_at(share)).as_dvec3() * self.table.at(share);
        let is_lit = distance2 > 0.0 && intensity.cmpgt(DVec3::ZERO).any();
        is_lit.then(|| LightLiSample::from_delta(offset.normalize(), Some(self.position), intensity / distance2))
    }
}

//! Ray cones, which choose the level of a mip map.

use glam::{DVec2, DVec3, Vec2, Vec3};
use raycam_scene::Camera;
use raycam_scene::camera::Pinhole;

/// Width of a ray along its length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RayCone {
    /// Width at the origin, in metres.
    pub width: f32,
    /// Growth in metres per metre.
    pub spread: f32,
}

/// Footprint of a cone on a triangle: axes of an ellipse, from side to side, in weights of the second and third
/// vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Footprint {
    axes: [Vec2; 2],
}

/// Cones of a camera's pixels.
#[derive(Clone, Debug)]
pub(crate) struct PixelCones<'a> {
    /// `None` for a world without textures, which needs no cones.
    camera: Option<&'a Camera>,
    pinhole: Option<Pinhole>,
    share: f64,
}

/// Side length in pixels of the image squares that share a cone, for cameras other than pinholes.
const CONE_SQUARE: u32 = 4;

/// Width of a sample's cone as a fraction of its pixel, at least a quarter.
pub(crate) fn sample_share(samples: u32) -> f64 {
    (1.0 / f64::from(samples).sqrt()).max(0.25)
}

impl<'a> PixelCones<'a> {
    pub fn new(camera: &'a Camera, samples: u32, has_textures: bool) -> Self {
        let camera = has_textures.then_some(camera);
        Self { camera, pinhole: camera.and_then(Camera::pinhole), share: sample_share(samples) }
    }

    /// Sets the cones of the pixels; pixels with equal cones are consecutive.
    pub fn of_pixels(&self, pixels: impl Iterator<Item = [u32; 2]>, cones: &mut Vec<RayCone>) {
        cones.clear();
        let Some(camera) = self.camera else {
            cones.extend(pixels.map(|_| RayCone::default()));
            return;
        };
        let mut last = None;
        cones.extend(pixels.map(|pixel| {
            let at = match self.pinhole {
                Some(_) => pixel,
                None => pixel.map(|x| x - x % CONE_SQUARE + CONE_SQUARE / 2),
            };
            match last {
                Some((known, cone)) if known == at => cone,
                _ => {
                    let cone = self.cone(camera, at);
                    last = Some((at, cone));
                    cone
                }
            }
        }));
    }

    /// Cone of a pixel. Its width is the geometric mean of the pixel's sides, whose lengths differ away from the
    /// centre.
    fn cone(&self, camera: &Camera, [x, y]: [u32; 2]) -> RayCone {
        let center = camera.pixel_center_of(x, y);
        let ray = |offset: DVec2| match &self.pinhole {
            Some(pinhole) => (pinhole.center, pinhole.direction(center + offset)),
            None => camera.ray(center + offset),
        };
        let (origin, direction) = ray(DVec2::ZERO);
        let sides = [DVec2::X, DVec2::Y].map(|side| {
            let (o, d) = ray(side);
            [(o - origin).length(), (d - direction).length()]
        });
        let mean = |which: usize| {
            let mean = (sides[0][which] * sides[1][which]).sqrt() * self.share;
            if mean.is_finite() { mean as f32 } else { 0.0 }
        };
        RayCone { width: mean(0), spread: mean(1) }
    }
}

impl RayCone {
    /// Cone after a distance.
    pub fn propagate(&self, distance: f32) -> Self {
        Self { width: self.width + self.spread * distance, ..*self }
    }

    /// Cone after a scattering event: specular reflection keeps it, anything else collapses it.
    pub fn after_scatter(&self, mirrored: bool) -> Self {
        if mirrored { *self } else { Self::default() }
    }
}

impl Footprint {
    /// Footprint of a cone of this width whose axis hits a triangle along `direction`.
    pub fn new([a, b, c]: [DVec3; 3], direction: Vec3, width: f32) -> Self {
        if width <= 0.0 {
            return Self::default();
        }
        let (e1, e2) = ((b - a).as_vec3(), (c - a).as_vec3());
        let cross = e1.cross(e2);
        let (area2, normal) = (cross.length_squared(), cross.normalize_or_zero());
        if area2 <= 0.0 || normal == Vec3::ZERO {
            return Self::default();
        }
        let cosine = normal.dot(direction).abs();
        // At grazing angles the footprint is not an ellipse; its length is limited.
        let long = width / cosine.max(1e-3);
        let along = (direction - normal * normal.dot(direction))
            .try_normalize()
            .unwrap_or_else(|| normal.any_orthonormal_vector());
        let weights = |v: Vec3| Vec2::new(v.cross(e2).dot(cross), e1.cross(v).dot(cross)) / area2;
        Self { axes: [weights(along * long), weights(normal.cross(along) * width)] }
    }

    /// Axes in the image, in units of the whole image, for the vertices' texture coordinates.
    pub fn in_texture(&self, [a, b, c]: [Vec2; 3]) -> [Vec2; 2] {
        self.axes.map(|axis| (b - a) * axis.x + (c - a) * axis.y)
    }

    /// True for an empty footprint.
    pub fn is_point(&self) -> bool {
        self.axes == [Vec2::ZERO; 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn footprint_is_an_ellipse_on_the_triangle() {
        // A triangle of two by one metres; seen at 60 degrees along x, the long axis is twice the width.
        let corners = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y];
        let direction = Vec3::new(3f32.sqrt() / 2.0, 0.0, -0.5);
        let footprint = Footprint::new(corners, direction, 0.1);
        let [long, short] = footprint.in_texture([Vec2::ZERO, Vec2::X, Vec2::Y]);
        assert!((long.abs() - Vec2::new(0.1, 0.0)).length() < 1e-6, "{long}");
        assert!((short.abs() - Vec2::new(0.0, 0.1)).length() < 1e-6, "{short}");
        assert!(Footprint::new(corners, direction, 0.0).is_point());
    }
}

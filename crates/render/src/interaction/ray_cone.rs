//! Ray cones, which determine the level of a mip map.
//!
//! With one sample per pixel, a cone is as wide as the pixel along each direction: elliptic if the pixel's
//! sides subtend different angles, as at the border of a wide-angle image. After scattering, cones are round.

use glam::{DVec2, DVec3, Vec2, Vec3};
use raycam_scene::Camera;
use raycam_scene::camera::Pinhole;

/// Cone around a ray: the ray's width along its length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RayCone {
    /// Width at the origin, in metres.
    pub width: f32,
    /// Growth of the width along the ray, in metres per metre.
    pub spread: f32,
    pub stretch: Stretch,
}

/// Shape of an elliptic cone in a few bits: the direction of the larger width, perpendicular to the axis, and the ratio
/// of this width to the mean width; 0 for a round cone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stretch(u32);

impl Stretch {
    const ROUND: Self = Self(0);
    /// Numbers of quantisation steps per unit of the ratio and of the coordinates on the octahedron.
    const RATIO_STEPS: f32 = 32.0;
    const AXIS_STEPS: f32 = 2047.0;

    fn new(axis: Vec3, ratio: f32) -> Self {
        let steps = ((ratio - 1.0) * Self::RATIO_STEPS).round().clamp(0.0, 255.0) as u32;
        let sum = axis.abs().element_sum();
        if steps == 0 || !(sum > 0.0 && sum.is_finite()) {
            return Self::ROUND;
        }
        // Both directions of the axis are equivalent: the upper half of the octahedron is sufficient.
        let on_octahedron = axis / if axis.z < 0.0 { -sum } else { sum };
        let bits = |x: f32| ((x + 1.0) * Self::AXIS_STEPS).round() as u32;
        Self(steps | bits(on_octahedron.x) << 8 | bits(on_octahedron.y) << 20)
    }

    /// The axis and the ratio; `None` for a round cone.
    fn unpack(self) -> Option<(Vec3, f32)> {
        if self == Self::ROUND {
            return None;
        }
        let coordinate = |bits: u32| (bits & 0xfff) as f32 / Self::AXIS_STEPS - 1.0;
        let (x, y) = (coordinate(self.0 >> 8), coordinate(self.0 >> 20));
        let axis = Vec3::new(x, y, 1.0 - x.abs() - y.abs()).try_normalize()?;
        Some((axis, 1.0 + (self.0 & 0xff) as f32 / Self::RATIO_STEPS))
    }
}

/// Footprint of a cone on a triangle: the axes of an ellipse (full lengths), as differences of the
/// barycentric weights of the second and third vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Footprint {
    axes: [Vec2; 2],
}

/// Ray cones of a camera's pixels.
#[derive(Clone, Debug)]
pub(crate) struct PixelCones<'a> {
    /// `None` for a world without textures, which needs no cones.
    camera: Option<&'a Camera>,
    pinhole: Option<Pinhole>,
    share: f64,
}

/// Side length in pixels of the image squares that share a cone, for cameras other than pinholes.
const CONE_SQUARE: u32 = 4;

/// Width of a sample's cone as a fraction of the pixel's width; at least a quarter.
pub(crate) fn sample_share(samples: u32) -> f64 {
    (1.0 / f64::from(samples).sqrt()).max(0.25)
}

impl<'a> PixelCones<'a> {
    pub fn new(camera: &'a Camera, samples: u32, has_textures: bool) -> Self {
        let camera = has_textures.then_some(camera);
        Self { camera, pinhole: camera.and_then(Camera::pinhole), share: sample_share(samples) }
    }

    /// Sets `cones` to the ray cones of the pixels. A cone that consecutive pixels share is computed only once.
    pub fn of_pixels(&self, pixels: impl Iterator<Item = [u32; 2]>, cones: &mut Vec<RayCone>) {
        cones.clear();
        let Some(camera) = self.camera else {
            cones.resize(pixels.count(), RayCone::default());
            return;
        };
        let mut last: Option<([u32; 2], RayCone, [DVec3; 2])> = None;
        cones.extend(pixels.map(|pixel| {
            let at = match self.pinhole {
                Some(_) => pixel,
                None => pixel.map(|x| x - x % CONE_SQUARE + CONE_SQUARE / 2),
            };
            match last {
                Some((known, cone, _)) if known == at => cone,
                _ => {
                    let is_next = |&([x, y], ..): &([u32; 2], _, _)| self.pinhole.is_some() && [x + 1, y] == at;
                    let known = last.filter(is_next).map(|(_, _, right)| right);
                    let (cone, right) = self.cone(camera, at, known);
                    last = Some((at, cone, right));
                    cone
                }
            }
        }));
    }

    /// Cone of a pixel, and the ray of the pixel to its right. The cone's width is the side length of a
    /// square with the pixel's area, times [`sample_share`]. `known` is the pixel's ray, origin and
    /// direction, if it has been computed.
    fn cone(&self, camera: &Camera, [x, y]: [u32; 2], known: Option<[DVec3; 2]>) -> (RayCone, [DVec3; 2]) {
        let center = camera.pixel_center_of(x, y);
        let ray = |offset: DVec2| match &self.pinhole {
            Some(pinhole) => [pinhole.center, pinhole.direction(center + offset)],
            None => camera.ray(center + offset).into(),
        };
        let [origin, direction] = known.unwrap_or_else(|| ray(DVec2::ZERO));
        let [right, below] = [DVec2::X, DVec2::Y].map(ray);
        let sides = [right, below].map(|[o, d]| [o - origin, d - direction]);
        let of = |which: usize| PixelEllipse::new(sides.map(|side| side[which]), direction);
        let (start, growth) = (of(0), of(1));
        let width = |mean: f64| if mean.is_finite() { (mean * self.share) as f32 } else { 0.0 };
        // The rays of a camera usually differ either in their directions or in their origins, so one stretch is
        // sufficient.
        let stretch = if growth.mean > 0.0 { growth.stretch } else { start.stretch };
        (RayCone { width: width(start.mean), spread: width(growth.mean), stretch }, right)
    }
}

/// Ellipse that covers a pixel, in the plane perpendicular to a direction; computed from the pixel's sides.
struct PixelEllipse {
    /// Geometric mean of the ellipse's largest and smallest width.
    mean: f64,
    /// Shape of the ellipse: see [`RayCone::stretch`].
    stretch: Stretch,
}

impl PixelEllipse {
    fn new(sides: [DVec3; 2], direction: DVec3) -> Self {
        if sides == [DVec3::ZERO; 2] {
            return Self { mean: 0.0, stretch: Stretch::ROUND };
        }
        let (right, up) = direction.any_orthonormal_pair();
        let [x, y] = sides.map(|side| DVec2::new(right.dot(side), up.dot(side)));
        // Eigenvalues of M M^T for M = [x y]: the squared widths.
        let (p, q, r) = (x.x * x.x + y.x * y.x, x.x * x.y + y.x * y.y, x.y * x.y + y.y * y.y);
        let largest = (p + r) / 2.0 + ((p - r) / 2.0).hypot(q);
        let mean = x.perp_dot(y).abs().sqrt();
        let ratio = largest.sqrt() / mean;
        let axis = if p >= r { DVec2::new(largest - r, q) } else { DVec2::new(q, largest - p) };
        let stretch = match axis.try_normalize() {
            Some(axis) if ratio.is_finite() => Stretch::new((right * axis.x + up * axis.y).as_vec3(), ratio as f32),
            _ => Stretch::ROUND,
        };
        Self { mean, stretch }
    }
}

impl RayCone {
    /// Cone at a distance along the ray.
    pub fn propagate(&self, distance: f32) -> Self {
        Self { width: self.width + self.spread * distance, ..*self }
    }

    /// Cone after a scattering event: specular reflection or refraction keeps the mean width, any other
    /// scattering reduces the cone to a ray.
    pub fn after_scatter(&self, mirrored: bool) -> Self {
        if mirrored { Self { stretch: Stretch::ROUND, ..*self } } else { Self::default() }
    }
}

impl Footprint {
    /// Footprint of a cone whose axis hits a triangle along `direction`.
    pub fn new([a, b, c]: [DVec3; 3], direction: Vec3, cone: &RayCone) -> Self {
        let width = cone.width;
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
        if let Some((axis, ratio)) = cone.stretch.unpack() {
            // The cone's axes, projected onto the triangle along the direction, are conjugate diameters of the
            // footprint.
            let lengthening = (long / width).powi(2) - 1.0;
            let project = |v: Vec3| v + along * (along.dot(v) * lengthening) - normal * normal.dot(v);
            let widths = [axis * ratio, direction.cross(axis) / ratio];
            return Self { axes: widths.map(|across| weights(project(across) * width)) };
        }
        Self { axes: [weights(along * long), weights(normal.cross(along) * width)] }
    }

    /// Axes of the footprint in texture coordinates (1 is the whole image), for the texture coordinates of the
    /// vertices.
    pub fn in_texture(&self, [a, b, c]: [Vec2; 3]) -> [Vec2; 2] {
        self.axes.map(|axis| (b - a) * axis.x + (c - a) * axis.y)
    }

    /// True if the footprint is a point.
    pub fn is_point(&self) -> bool {
        self.axes == [Vec2::ZERO; 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packing_and_unpacking_a_stretch_keeps_its_axis_and_ratio() {
        assert_eq!(Stretch::new(Vec3::X, 1.0), Stretch::ROUND);
        for axis in [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(0.6, -0.48, -0.64), Vec3::new(-0.36, 0.48, 0.8)] {
            for (ratio, expected) in [(1.5, 1.5), (3.0, 3.0), (1e6, 1.0 + 255.0 / 32.0)] {
                let (found, kept) = Stretch::new(axis, ratio).unpack().unwrap();
                assert!(found.cross(axis).length() < 2e-3, "{axis} {found}");
                assert_eq!(kept, expected);
            }
        }
    }

    #[test]
    fn footprint_is_an_ellipse_on_the_triangle() {
        let round = |width| RayCone { width, ..RayCone::default() };
        // The triangle has sides of two metres and one metre. Seen at 60 degrees along x, the footprint's long axis is
        // twice as long as the cone is wide.
        let corners = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y];
        let direction = Vec3::new(3f32.sqrt() / 2.0, 0.0, -0.5);
        let footprint = Footprint::new(corners, direction, &round(0.1));
        let [long, short] = footprint.in_texture([Vec2::ZERO, Vec2::X, Vec2::Y]);
        assert!((long.abs() - Vec2::new(0.1, 0.0)).length() < 1e-6, "{long}");
        assert!((short.abs() - Vec2::new(0.0, 0.1)).length() < 1e-6, "{short}");
        assert!(Footprint::new(corners, direction, &round(0.0)).is_point());
        // This cone is twice as wide in the plane of incidence as across it.
        let stretch = Stretch::new(Vec3::new(0.5, 0.0, 3f32.sqrt() / 2.0), 1.5);
        let elliptic = RayCone { width: 0.1, stretch, ..RayCone::default() };
        let footprint = Footprint::new(corners, direction, &elliptic);
        let [long, short] = footprint.in_texture([Vec2::ZERO, Vec2::X, Vec2::Y]);
        assert!((long.abs() - Vec2::new(0.15, 0.0)).length() < 1e-4, "{long}");
        assert!((short.abs() - Vec2::new(0.0, 0.1 / 1.5)).length() < 1e-4, "{short}");
    }
}

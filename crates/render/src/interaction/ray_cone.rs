//! Ray cones, which choose the level of a mip map.

use glam::{DVec2, DVec3, Vec2, Vec3};
use raycam_scene::Camera;

/// How wide a ray is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RayCone {
    /// Where it starts.
    pub width: f32,
    /// How much wider it is a metre on.
    pub spread: f32,
}

/// The part of a triangle that a cone covers, by its axes, from side to side, in weights of the second and third corner.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Footprint {
    axes: [Vec2; 2],
}

impl RayCone {
    /// A pixel's share of each of its samples, measured in the middle of the picture; many samples see a texture as sharp
    /// as a quarter of a pixel.
    pub fn for_pixel(camera: &Camera, samples: u32) -> Self {
        let middle = DVec2::from(camera.size().map(f64::from)) / 2.0;
        let [(o, d), (o1, d1)] = [0.0, 1.0].map(|x| camera.ray(middle + DVec2::new(x, 0.0)));
        let share = (1.0 / f64::from(samples).sqrt()).max(0.25);
        let finite = |v: f64| {
            if v.is_finite() {
                (v * share) as f32
            } else {
                0.0
            }
        };
        Self {
            width: finite((o1 - o).length()),
            spread: finite((d1 - d).length()),
        }
    }

    /// The same ray after a distance.
    pub fn propagate(&self, distance: f32) -> Self {
        Self {
            width: self.width + self.spread * distance,
            ..*self
        }
    }

    /// What leaves a surface: mirrors keep it together, anything else ends it.
    pub fn after_scatter(&self, mirrored: bool) -> Self {
        if mirrored { *self } else { Self::default() }
    }
}

impl Footprint {
    /// Of a cone that has this width where its axis, `direction`, meets a triangle.
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
        // At grazing angles the ellipse is no longer one; the triangle ends it.
        let long = width / cosine.max(1e-3);
        let along = (direction - normal * normal.dot(direction))
            .try_normalize()
            .unwrap_or_else(|| normal.any_orthonormal_vector());
        let weights = |v: Vec3| Vec2::new(v.cross(e2).dot(cross), e1.cross(v).dot(cross)) / area2;
        Self {
            axes: [weights(along * long), weights(normal.cross(along) * width)],
        }
    }

    /// Its axes in an image, in units of the whole image, by the corners' coordinates there.
    pub fn in_texture(&self, [a, b, c]: [Vec2; 3]) -> [Vec2; 2] {
        self.axes.map(|axis| (b - a) * axis.x + (c - a) * axis.y)
    }

    /// Whether it is a point.
    pub fn is_point(&self) -> bool {
        self.axes == [Vec2::ZERO; 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_footprint_is_an_ellipse_on_the_triangle() {
        // A triangle of two by one metres; seen at 60 degrees along x the long axis is twice the width.
        let corners = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y];
        let direction = Vec3::new(3f32.sqrt() / 2.0, 0.0, -0.5);
        let footprint = Footprint::new(corners, direction, 0.1);
        let [long, short] = footprint.in_texture([Vec2::ZERO, Vec2::X, Vec2::Y]);
        assert!((long.abs() - Vec2::new(0.1, 0.0)).length() < 1e-6, "{long}");
        assert!(
            (short.abs() - Vec2::new(0.0, 0.1)).length() < 1e-6,
            "{short}"
        );
        assert!(Footprint::new(corners, direction, 0.0).is_point());
    }
}

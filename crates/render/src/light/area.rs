//! The area light: a parallelogram of even radiance.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::LightSample;
use super::bounds::Bounds;

#[derive(Debug)]
pub(crate) struct Area {
    /// Scene-local.
    corner: DVec3,
    edges: [DVec3; 2],
    /// Vectors in its plane whose products with an offset from the corner are the coordinates along the edges.
    coordinates: [DVec3; 2],
    /// Where it shines to.
    normal: DVec3,
    area: f64,
    center: DVec3,
    /// The square of half its diagonal.
    radius2: f64,
    /// Unit vectors along the edges of a rectangle.
    axes: Option<[DVec3; 2]>,
    radiance: Vec3,
    two_sided: bool,
}

/// From farther away than this many half diagonals, squared, a point is drawn evenly from the area: directions are then
/// nearly even as well, the solid angle costs more than it brings, and small ones lose their digits. So it is on
/// parallelograms without right angles.
const FAR: f64 = 4.0;
/// ... and so it is where the rectangle is seen edge-on.
const SMALLEST: f64 = 1e-5;

impl Area {
    pub fn new(center: DVec3, [u, v]: [DVec3; 2], radiance: Vec3, two_sided: bool) -> Self {
        let cross = u.cross(v);
        let (normal, area) = (cross.normalize_or_zero(), cross.length());
        Self {
            corner: center - (u + v) / 2.0,
            edges: [u, v],
            // Cramer's rule in the plane.
            coordinates: [v.cross(normal) / area, normal.cross(u) / area],
            normal,
            area,
            center,
            radius2: (u + v).length_squared().max((u - v).length_squared()) / 4.0,
            axes: (u.dot(v).abs() <= 1e-9 * u.length() * v.length())
                .then(|| [u.normalize_or_zero(), v.normalize_or_zero()]),
            radiance,
            two_sided,
        }
    }

    pub fn bounds(&self) -> Bounds {
        let [u, v] = self.edges;
        let corners = [
            self.corner,
            self.corner + u,
            self.corner + v,
            self.corner + u + v,
        ];
        let intensity = self.radiance.as_dvec3() * self.area;
        Bounds::flat(&corners, self.normal, intensity.as_vec3(), self.two_sided)
    }

    pub fn sample(&self, point: DVec3, random: [f32; 2]) -> Option<LightSample> {
        if !self.shines_to(point) {
            return None;
        }
        let random = random.map(f64::from);
        let solid = self.solid_angle(point);
        let end = match &solid {
            Some(solid) => solid.sample(point, random),
            None => self.corner + self.edges[0] * random[0] + self.edges[1] * random[1],
        };
        let offset = end - point;
        let direction = offset.normalize_or_zero();
        let density = match &solid {
            Some(solid) => 1.0 / solid.angle,
            None => self.density(offset.length_squared(), direction),
        };
        LightSample::toward(direction, end, self.radiance, density)
    }

    /// By solid angle, of a point drawn evenly from the area.
    fn density(&self, distance2: f64, direction: DVec3) -> f64 {
        distance2 / (self.area * self.normal.dot(direction).abs())
    }

    pub fn crossed(&self, point: DVec3, direction: Vec3) -> Option<(f64, Vec3, f64)> {
        let direction = direction.as_dvec3();
        let offset = point - self.corner;
        let (height, slope) = (offset.dot(self.normal), direction.dot(self.normal));
        // Towards its plane, and from where it shines to.
        if height * slope >= 0.0 || !(height > 0.0 || self.two_sided) {
            return None;
        }
        let distance = -height / slope;
        let inside = offset + direction * distance;
        let [x, y] = self.coordinates.map(|along| inside.dot(along));
        if !(distance.is_finite() && (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y)) {
            return None;
        }
        let density = match self.solid_angle(point) {
            Some(solid) => 1.0 / solid.angle,
            None => self.density(distance * distance, direction),
        };
        Some((distance, self.radiance, density))
    }

    fn shines_to(&self, point: DVec3) -> bool {
        let height = (point - self.corner).dot(self.normal);
        height > 0.0 || self.two_sided && height < 0.0
    }

    /// The rectangle on the sphere around a point, where it is one and near.
    fn solid_angle(&self, point: DVec3) -> Option<SphericalRectangle> {
        let axes = self.axes?;
        if (point - self.center).length_squared() > FAR * self.radius2 {
            return None;
        }
        let solid = SphericalRectangle::new(self.corner - point, axes, self.edges);
        (solid.angle > SMALLEST).then_some(solid)
    }
}

/// C. Ureña, M. Fajardo and A. King, "An Area-Preserving Parametrization for Spherical Rectangles", EGSR 2013: a map
/// from the square to the rectangle seen from a point, which keeps area and stratification.
#[derive(Debug)]
struct SphericalRectangle {
    axes: [DVec3; 3],
    /// The rectangle spans x0..x1 and y0..y1 at depth z0 < 0.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// Of the first and the third side's plane normal, their z.
    b: [f64; 2],
    k: f64,
    /// In steradians.
    angle: f64,
}

impl SphericalRectangle {
    fn new(corner: DVec3, [ex, ey]: [DVec3; 2], [u, v]: [DVec3; 2]) -> Self {
        let mut ez = ex.cross(ey);
        let mut z = corner.dot(ez);
        if z > 0.0 {
            (ez, z) = (-ez, -z);
        }
        let x = [corner.dot(ex), corner.dot(ex) + u.dot(ex)];
        let y = [corner.dot(ey), corner.dot(ey) + v.dot(ey)];
        // Of the normals of the planes through the sides the parts along z, all that their products need.
        let tilt = |at: f64| at / (at * at + z * z).sqrt();
        let n = [-tilt(y[0]), tilt(x[1]), tilt(y[1]), -tilt(x[0])];
        let g = [0, 1, 2, 3].map(|i: usize| (-n[i] * n[(i + 1) % 4]).acos());
        let k = TAU - g[2] - g[3];
        Self {
            axes: [ex, ey, ez],
            x,
            y,
            z,
            b: [n[0], n[2]],
            k,
            angle: g[0] + g[1] - k,
        }
    }

    fn sample(&self, point: DVec3, [s, t]: [f64; 2]) -> DVec3 {
        let a = s * self.angle + self.k;
        let f = (a.cos() * self.b[0] - self.b[1]) / a.sin();
        let c = (f.signum() / (f * f + self.b[0] * self.b[0]).sqrt()).clamp(-1.0, 1.0);
        let x = (-(c * self.z) / (1.0 - c * c).max(1e-300).sqrt()).clamp(self.x[0], self.x[1]);
        let d = (x * x + self.z * self.z).sqrt();
        let [h0, h1] = self.y.map(|y| y / (d * d + y * y).sqrt());
        let h = h0 + t * (h1 - h0);
        let y = if h * h < 1.0 - 1e-12 {
            (h * d / (1.0 - h * h).sqrt()).clamp(self.y[0], self.y[1])
        } else {
            self.y[1]
        };
        let [ex, ey, ez] = self.axes;
        point + ex * x + ey * y + ez * self.z
    }
}

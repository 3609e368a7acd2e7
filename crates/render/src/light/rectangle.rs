//! Rectangle light: a parallelogram of uniform radiance.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};
use raycam_bvh::WithSimd;

use crate::light::bounds::LightBounds;
use crate::light::samples::{LightLiSample, LightLiSamples};
use crate::soa::{Vec3xN, get_lane, set_lane};

#[derive(Debug)]
pub(crate) struct RectangleLight {
    /// Scene-local position of one corner.
    corner: DVec3,
    edges: [DVec3; 2],
    /// Vectors in the plane whose dot products with an offset from the corner are its coordinates along the edges.
    coordinates: [DVec3; 2],
    /// Unit normal on the side that emits.
    normal: DVec3,
    area: f64,
    center: DVec3,
    /// Square of half the diagonal's length.
    radius2: f64,
    /// Unit edge directions, if the edges are perpendicular.
    axes: Option<[DVec3; 2]>,
    radiance: Vec3,
    two_sided: bool,
}

/// Squared distance, in half diagonals, beyond which points are sampled uniformly by area: directions are then nearly
/// uniform, and small solid angles lose precision. Parallelograms without right angles are always sampled by area.
const UNIFORM_SAMPLING_DISTANCE2: f64 = 4.0;
/// Solid angle below which points are sampled by area: a rectangle seen edge-on.
const MIN_SOLID_ANGLE: f64 = 1e-5;

impl RectangleLight {
    pub fn new(center: DVec3, [u, v]: [DVec3; 2], radiance: Vec3, two_sided: bool) -> Self {
        let cross = u.cross(v);
        let (normal, area) = (cross.normalize_or_zero(), cross.length());
        Self {
            corner: center - (u + v) / 2.0,
            edges: [u, v],
            // The vectors follow from Cramer's rule in the plane of the light.
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

    pub fn bounds(&self) -> LightBounds {
        let [u, v] = self.edges;
        let corners = [self.corner, self.corner + u, self.corner + v, self.corner + u + v];
        let intensity = self.radiance.as_dvec3() * self.area;
        LightBounds::planar(&corners, self.normal, intensity.as_vec3(), self.two_sided)
    }

    /// Samples a direction: by solid angle if the rectangle is near, by area otherwise.
    pub fn sample(&self, point: DVec3, random: [f32; 2]) -> Option<LightLiSample> {
        if !self.faces(point) {
            return None;
        }
        let random = random.map(f64::from);
        let (direction, end, density) = match self.solid_angle(point) {
            Some(solid) => {
                let end = solid.sample(point, random);
                ((end - point).normalize_or_zero(), end, 1.0 / solid.angle)
            }
            None => self.sample_area(point, random),
        };
        LightLiSample::new(direction, end, self.radiance, density)
    }

    /// Samples a point uniformly by area; returns its direction, the point and the density.
    #[inline(always)]
    fn sample_area(&self, point: DVec3, random: [f64; 2]) -> (DVec3, DVec3, f64) {
        let end = self.corner + self.edges[0] * random[0] + self.edges[1] * random[1];
        let offset = end - point;
        let direction = offset.normalize_or_zero();
        let density = self.area_pdf(offset.length_squared(), direction);
        (direction, end, density)
    }

    /// Density by solid angle of a point sampled by area.
    #[inline(always)]
    fn area_pdf(&self, distance2: f64, direction: DVec3) -> f64 {
        distance2 / (self.area * self.normal.dot(direction).abs())
    }

    /// Distance at which a ray hits the light, the radiance there, and the density of [`RectangleLight::sample`].
    pub fn intersect(&self, point: DVec3, direction: Vec3) -> Option<(f64, Vec3, f64)> {
        let direction = direction.as_dvec3();
        let offset = point - self.corner;
        let (height, slope) = (offset.dot(self.normal), direction.dot(self.normal));
        // The ray misses if it does not approach the plane, or starts on a side that does not emit.
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
            None => self.area_pdf(distance * distance, direction),
        };
        Some((distance, self.radiance, density))
    }

    #[inline(always)]
    fn faces(&self, point: DVec3) -> bool {
        let height = (point - self.corner).dot(self.normal);
        // Branch-free, for loops over many points.
        (height > 0.0) | (self.two_sided & (height < 0.0))
    }

    #[inline(always)]
    fn is_far(&self, point: DVec3) -> bool {
        (point - self.center).length_squared() > UNIFORM_SAMPLING_DISTANCE2 * self.radius2
    }

    /// Spherical rectangle as seen from a point; `None` unless the light is a rectangle and near.
    fn solid_angle(&self, point: DVec3) -> Option<SphericalRectangle> {
        let axes = self.axes.filter(|_| !self.is_far(point))?;
        let solid = SphericalRectangle::new(self.corner - point, axes, self.edges);
        (solid.angle > MIN_SOLID_ANGLE).then_some(solid)
    }
}

/// Same as [`RectangleLight::sample`], for many points.
pub(crate) struct SampleRectangle<'a, const N: usize> {
    pub light: &'a RectangleLight,
    pub points: &'a Vec3xN<f64, N>,
    pub random: &'a [[f32; N]; 2],
    pub out: &'a mut LightLiSamples<N>,
}

impl<const N: usize> WithSimd for SampleRectangle<'_, N> {
    #[inline(always)]
    fn run(self) {
        let Self { light: area, points, random, out } = self;
        // The data is copied to the stack so that it can stay in registers.
        let (points, random, mut lanes) = (*points, *random, LightLiSamples::<N>::default());
        lanes.set_radiance(area.radiance);
        let mut far = [true; N];
        for lane in 0..N {
            let point = DVec3::from(get_lane(&points, lane));
            let numbers = [f64::from(random[0][lane]), f64::from(random[1][lane])];
            let (direction, end, density) = area.sample_area(point, numbers);
            let pdf = density as f32;
            let found = area.faces(point) & (pdf > 0.0) & (pdf < f32::INFINITY);
            set_lane(&mut lanes.direction, lane, direction.as_vec3().to_array());
            set_lane(&mut lanes.p_light, lane, end.to_array());
            lanes.pdf[lane] = if found { pdf } else { 0.0 };
            far[lane] = area.is_far(point);
        }
        *out = lanes;
        if area.axes.is_none() || far == [true; N] {
            return;
        }
        for lane in (0..N).filter(|&lane| !far[lane]) {
            let numbers = [random[0][lane], random[1][lane]];
            out.set_lane(lane, area.sample(get_lane(&points, lane).into(), numbers));
        }
    }
}

/// Area-preserving map from the unit square to the rectangle's solid angle, which keeps stratification (C. Ureña, M.
/// Fajardo and A. King, "An Area-Preserving Parametrization for Spherical Rectangles", EGSR 2013).
#[derive(Debug)]
struct SphericalRectangle {
    axes: [DVec3; 3],
    /// The rectangle spans x0..x1 and y0..y1 at depth z0 < 0.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// z components of the plane normals of the first and the third side.
    b: [f64; 2],
    k: f64,
    /// Solid angle of the rectangle, in steradians.
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
        // z components of the sides' plane normals; the dot products of the normals depend only on these
        // components.
        let tilt = |at: f64| at / (at * at + z * z).sqrt();
        let n = [-tilt(y[0]), tilt(x[1]), tilt(y[1]), -tilt(x[0])];
        let g = [0, 1, 2, 3].map(|i: usize| (-n[i] * n[(i + 1) % 4]).acos());
        let k = TAU - g[2] - g[3];
        Self { axes: [ex, ey, ez], x, y, z, b: [n[0], n[2]], k, angle: g[0] + g[1] - k }
    }

    fn sample(&self, point: DVec3, [s, t]: [f64; 2]) -> DVec3 {
        let a = s * self.angle + self.k;
        let f = (a.cos() * self.b[0] - self.b[1]) / a.sin();
        let c = (f.signum() / (f * f + self.b[0] * self.b[0]).sqrt()).clamp(-1.0, 1.0);
        let x = (-(c * self.z) / (1.0 - c * c).max(1e-300).sqrt()).clamp(self.x[0], self.x[1]);
        let d = (x * x + self.z * self.z).sqrt();
        let [h0, h1] = self.y.map(|y| y / (d * d + y * y).sqrt());
        let h = h0 + t * (h1 - h0);
        let y =
            if h * h < 1.0 - 1e-12 { (h * d / (1.0 - h * h).sqrt()).clamp(self.y[0], self.y[1]) } else { self.y[1] };
        let [ex, ey, ez] = self.axes;
        point + ex * x + ey * y + ez * self.z
    }
}

#[cfg(test)]
mod tests {
    use raycam_bvh::dispatch_simd;

    use super::*;

    #[test]
    fn batched_rectangle_samples_equal_single_samples() {
        const N: usize = 16;
        let edges = [DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];
        let slanted = [edges[0], edges[1] + edges[0] / 4.0];
        let (mut near, mut dark) = (0, 0);
        for (edges, two_sided) in [(edges, false), (edges, true), (slanted, false)] {
            let area = RectangleLight::new(DVec3::new(0.0, 0.0, 1.0), edges, Vec3::ONE, two_sided);
            // The points are around the light, in its plane and far below it.
            let points = |lane: usize, axis: usize| {
                let at = (lane * 3 + axis) as f64;
                at.sin() * [1.0, 8.0, 1.0, 1e4][lane % 4] + f64::from(lane == 5 && axis == 2)
            };
            let points: Vec3xN<f64, N> = [0, 1, 2].map(|axis| std::array::from_fn(|lane| points(lane, axis)));
            let random = [7.0, 11.0].map(|k: f32| std::array::from_fn(|lane| (k * lane as f32 / 16.0).fract()));
            let mut found = LightLiSamples::default();
            dispatch_simd(SampleRectangle { light: &area, points: &points, random: &random, out: &mut found });
            for (lane, (&x, &y)) in random[0].iter().zip(&random[1]).enumerate() {
                let point = get_lane(&points, lane).into();
                let alone = area.sample(point, [x, y]);
                let lanes = found.get_lane(lane);
                assert_eq!(format!("{alone:?}"), format!("{lanes:?}"), "{lane}");
                near += usize::from(area.solid_angle(point).is_some());
                dark += usize::from(alone.is_none());
            }
        }
        assert!(near > 5 && dark > 5, "{near} {dark}");
    }
}

//! Bounds of a group of lights in position, direction and power, and the resulting bound on the received light.
//!
//! The bounds on angles follow M. Pharr, W. Jakob and G. Humphreys, "Physically Based Rendering", 4th edition,
//! section 12.6.3.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

/// Box, normal cone and power of a group of lights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    /// Scene-local bounding box of the lights.
    pub lower: Vec3,
    pub upper: Vec3,
    /// Axis of the cone of normals, and the cosine of its half angle.
    pub axis: Vec3,
    pub cos_theta_o: f32,
    /// Cosine of the largest angle between a normal and an emission direction.
    pub cos_theta_e: f32,
    /// True if any light also emits from its back.
    pub two_sided: bool,
    /// Maximum intensity of each light, summed over all lights and colour channels, in W/sr.
    pub phi: f32,
}

impl Default for LightBounds {
    fn default() -> Self {
        Self::isotropic(DVec3::ZERO, DVec3::ZERO, Vec3::ZERO)
    }
}

impl LightBounds {
    /// Bounds of a light that emits in every direction.
    pub fn isotropic(lower: DVec3, upper: DVec3, intensity: Vec3) -> Self {
        Self {
            lower: lower.as_vec3(),
            upper: upper.as_vec3(),
            axis: Vec3::Z,
            cos_theta_o: -1.0,
            cos_theta_e: 0.0,
            two_sided: false,
            phi: intensity.element_sum(),
        }
    }

    /// Bounds of a light that emits from a plane surface with these corners.
    pub fn planar(corners: &[DVec3], normal: DVec3, intensity: Vec3, two_sided: bool) -> Self {
        let lower = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let upper = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        Self { axis: normal.as_vec3(), cos_theta_o: 1.0, two_sided, ..Self::isotropic(lower, upper, intensity) }
    }

    pub fn center(&self) -> Vec3 {
        self.lower + (self.upper - self.lower) / 2.0
    }

    pub fn union(&self, other: &Self) -> Self {
        // Lights without power do not widen the bounds.
        if other.phi <= 0.0 {
            return *self;
        }
        if self.phi <= 0.0 {
            return *other;
        }
        let (axis, cos_normals) = cone_union((self.axis, self.cos_theta_o), (other.axis, other.cos_theta_o));
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
            axis,
            cos_theta_o: cos_normals,
            cos_theta_e: self.cos_theta_e.min(other.cos_theta_e),
            two_sided: self.two_sided || other.two_sided,
            phi: self.phi + other.phi,
        }
    }

    /// Precomputes the terms of [`PreparedLightBounds::importance`].
    pub fn prepare(&self) -> PreparedLightBounds {
        let half = (self.upper - self.lower) / 2.0;
        PreparedLightBounds {
            center: self.center(),
            half,
            radius: half.length(),
            axis: self.axis,
            theta_o: Angle::from_cos(self.cos_theta_o.clamp(-1.0, 1.0)),
            cos_theta_e: self.cos_theta_e,
            two_sided: self.two_sided,
            phi: self.phi,
        }
    }

    /// Cost in the surface area orientation heuristic: power, area and measure of directions.
    pub fn saoh_cost(&self) -> f32 {
        let size = self.upper - self.lower;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        let cos_normals = self.cos_theta_o.clamp(-1.0, 1.0);
        let sin_normals = Angle::from_cos(cos_normals).sin;
        let (normals, emission) = (cos_normals.acos(), self.cos_theta_e.acos());
        let edge = (normals + emission).min(PI);
        let directions = 2.0 * PI * (1.0 - cos_normals)
            + PI / 2.0
                * (2.0 * edge * sin_normals - (normals - 2.0 * edge).cos() - 2.0 * normals * sin_normals + cos_normals);
        // The second term gives a cost to boxes without area (points and lines).
        self.phi * directions * (area + size.max_element().powi(2))
    }
}

/// [`LightBounds`] in the form that is fastest to evaluate at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedLightBounds {
    /// Centre, half extent and half diagonal of the box.
    pub center: Vec3,
    pub half: Vec3,
    pub radius: f32,
    pub axis: Vec3,
    /// Half angle of the cone of normals.
    pub theta_o: Angle,
    pub cos_theta_e: f32,
    pub two_sided: bool,
    pub phi: f32,
}

/// Maximum radius of a group of lights with similar effects at a point, as a fraction of the distance to the group.
const FAR_RADIUS: f32 = 0.2;
/// Minimum cosine of the half angle of the cone of normals, for a group of lights with similar effects at a point.
const FAR_COS_THETA_O: f32 = 0.8;

impl PreparedLightBounds {
    /// True if the lights have similar effects at a point: seen from the point, they are close together and face about
    /// the same direction.
    #[inline]
    pub fn is_far(&self, position: Vec3) -> bool {
        let far = self.radius * self.radius < FAR_RADIUS * FAR_RADIUS * self.center.distance_squared(position);
        far && self.theta_o.cos > FAR_COS_THETA_O
    }

    /// Upper bound on the received light, up to a factor: power over squared distance, for the smallest angles that
    /// the bounds allow. 0 only if nothing is received. Branch-free, for loops over many points.
    #[inline(always)]
    pub fn importance(&self, position: Vec3, normal: Vec3) -> f32 {
        let away = position - self.center;
        let radius2 = self.radius * self.radius;
        // For points inside the bounding sphere, the distance to a light may have any value, so the sphere's radius is
        // used.
        let distance2 = away.length_squared();
        let inverse = 1.0 / distance2.sqrt().max(f32::MIN_POSITIVE);
        let direction = away * inverse;
        let by_distance = self.phi / distance2.max(radius2).max(1e-30);
        let flat = (normal.x != 0.0) | (normal.y != 0.0) | (normal.z != 0.0);
        // Height of the box's highest corner above the point's horizon, with a margin for rounding.
        let highest = self.half.dot(normal.abs()) - away.dot(normal);
        let below = flat & (highest <= -1e-5 * away.abs().element_sum());
        let inside = distance2 <= radius2;
        // Upper bound on the half angle that the box subtends, with a margin for rounding.
        let half_box = Angle::from_sin((self.radius * inverse + 1e-3).min(1.0));
        let cos_axis = self.axis.dot(direction).clamp(-1.0, 1.0);
        let cos_axis = if self.two_sided { cos_axis.abs() } else { cos_axis };
        let off = Angle::from_cos(cos_axis).saturating_sub(self.theta_o).saturating_sub(half_box);
        let beside = off.cos <= self.cos_theta_e - 1e-3;
        let importance = by_distance * off.cos.max(1e-3);
        let height = Angle::from_cos((-normal.dot(direction)).clamp(-1.0, 1.0));
        let least = height.saturating_sub(half_box).cos;
        let beside = beside | (flat & (least <= 0.0));
        let importance = importance * if flat { least } else { 1.0 };
        // The last assignment that applies has priority.
        let importance = if beside { 0.0 } else { importance };
        let importance = if inside { by_distance } else { importance };
        if below { 0.0 } else { importance }
    }
}

/// Sine and cosine of an angle in 0..=180 degrees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Angle {
    pub sin: f32,
    pub cos: f32,
}

impl Angle {
    #[inline(always)]
    fn from_cos(cos: f32) -> Self {
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        Self { sin, cos }
    }

    /// Creates an angle of at most 90 degrees from its sine.
    #[inline(always)]
    fn from_sin(sin: f32) -> Self {
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        Self { sin, cos }
    }

    /// Difference of two angles; 0 if `other` is larger.
    #[inline(always)]
    fn saturating_sub(self, other: Self) -> Self {
        let sin = self.sin * other.cos - self.cos * other.sin;
        let cos = self.cos * other.cos + self.sin * other.sin;
        let none = self.cos >= other.cos;
        Self { sin: if none { 0.0 } else { sin }, cos: if none { 1.0 } else { cos } }
    }
}

/// Smallest cone that contains two cones; cones are given by their axis and the cosine of their half angle.
fn cone_union(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let between = a.0.dot(b.0).clamp(-1.0, 1.0);
    // In most cases one cone contains the other, and no angle needs to be computed.
    if cone_contains(a.1, b.1, between) {
        return a;
    }
    if cone_contains(b.1, a.1, between) {
        return b;
    }
    let [ta, tb, between] = [a.1, b.1, between].map(|cos| cos.clamp(-1.0, 1.0).acos());
    let half = (ta + tb + between) / 2.0;
    let turn = a.0.cross(b.0);
    if half >= PI || turn.length_squared() < 1e-12 {
        return (Vec3::Z, -1.0);
    }
    let axis = glam::Quat::from_axis_angle(turn.normalize(), half - ta) * a.0;
    // The cone is slightly wider, to allow for rounding.
    (axis.normalize(), (half + 1e-4).min(PI).cos())
}

/// True if a cone contains another cone, by the cosines of the half angles and of the angle between the axes.
fn cone_contains(outer: f32, inner: f32, between: f32) -> bool {
    let [wide, narrow] = [outer, inner].map(|cos| Angle::from_cos(cos.clamp(-1.0, 1.0)));
    outer <= -1.0 || (wide.cos <= narrow.cos && between >= wide.saturating_sub(narrow).cos)
}

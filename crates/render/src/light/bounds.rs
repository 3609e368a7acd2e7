//! Where a group of lights is, where it shines, and how much of it may arrive at a point.
//!
//! The bounds on angles are those of M. Pharr, W. Jakob and G. Humphreys, "Physically Based Rendering", 4th edition,
//! section 12.6.3.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

/// Where lights are, where they shine and how much.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    /// Scene-local.
    pub lower: Vec3,
    pub upper: Vec3,
    /// Of a cone that holds all their normals; the cosine of its half angle.
    pub axis: Vec3,
    pub cos_theta_o: f32,
    /// The cosine of how far from its normal a light shines.
    pub cos_theta_e: f32,
    /// Whether they shine to the other side as well.
    pub two_sided: bool,
    /// The largest intensity of all together, in W/sr.
    pub phi: f32,
}

impl Default for LightBounds {
    fn default() -> Self {
        Self::isotropic(DVec3::ZERO, DVec3::ZERO, Vec3::ZERO)
    }
}

impl LightBounds {
    /// Of a light that shines everywhere.
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

    /// Of one that shines from a plane.
    pub fn planar(corners: &[DVec3], normal: DVec3, intensity: Vec3, two_sided: bool) -> Self {
        let lower = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let upper = corners
            .iter()
            .copied()
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        Self {
            axis: normal.as_vec3(),
            cos_theta_o: 1.0,
            two_sided,
            ..Self::isotropic(lower, upper, intensity)
        }
    }

    pub fn center(&self) -> Vec3 {
        self.lower + (self.upper - self.lower) / 2.0
    }

    pub fn union(&self, other: &Self) -> Self {
        // What is dark has no say.
        if other.phi <= 0.0 {
            return *self;
        }
        if self.phi <= 0.0 {
            return *other;
        }
        let (axis, cos_normals) = cone_union(
            (self.axis, self.cos_theta_o),
            (other.axis, other.cos_theta_o),
        );
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

    /// Made ready to be weighed.
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

    /// The cost of a group in the surface area orientation heuristic: intensity, area and the measure of its directions.
    pub fn saoh_cost(&self) -> f32 {
        let size = self.upper - self.lower;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        let cos_normals = self.cos_theta_o.clamp(-1.0, 1.0);
        let sin_normals = Angle::from_cos(cos_normals).sin;
        let (normals, emission) = (cos_normals.acos(), self.cos_theta_e.acos());
        let edge = (normals + emission).min(PI);
        let directions = 2.0 * PI * (1.0 - cos_normals)
            + PI / 2.0
                * (2.0 * edge * sin_normals
                    - (normals - 2.0 * edge).cos()
                    - 2.0 * normals * sin_normals
                    + cos_normals);
        // Lights in one point or line still cost more apart.
        self.phi * directions * (area + size.max_element().powi(2))
    }
}

/// What [`LightBounds`] say, as it takes least to weigh them for a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedLightBounds {
    /// Of the box, and from there to a corner; the length of that.
    pub center: Vec3,
    pub half: Vec3,
    pub radius: f32,
    pub axis: Vec3,
    /// Of the cone around the axis that holds all normals.
    pub theta_o: Angle,
    pub cos_theta_e: f32,
    pub two_sided: bool,
    pub phi: f32,
}

impl PreparedLightBounds {
    /// A bound on what arrives at a point, up to a factor: intensity over squared distance, by the smallest angles that
    /// the bounds leave. 0 only where nothing arrives. Without branches, which loops over many points must not have.
    #[inline(always)]
    pub fn importance(&self, position: Vec3, normal: Vec3) -> f32 {
        let away = position - self.center;
        let radius2 = self.radius * self.radius;
        // From inside, every distance is possible: that of the rim stands for them.
        let distance2 = away.length_squared();
        let inverse = 1.0 / distance2.sqrt().max(f32::MIN_POSITIVE);
        let direction = away * inverse;
        let by_distance = self.phi / distance2.max(radius2).max(1e-30);
        let flat = (normal.x != 0.0) | (normal.y != 0.0) | (normal.z != 0.0);
        // The corner that stands highest above the point's horizon, a bit more against rounding.
        let highest = self.half.dot(normal.abs()) - away.dot(normal);
        let below = flat & (highest <= -1e-5 * away.abs().element_sum());
        let inside = distance2 <= radius2;
        // The half angle that the box fills, at most; a bit more against rounding.
        let half_box = Angle::from_sin((self.radius * inverse + 1e-3).min(1.0));
        let cos_axis = self.axis.dot(direction).clamp(-1.0, 1.0);
        let cos_axis = if self.two_sided {
            cos_axis.abs()
        } else {
            cos_axis
        };
        let off = Angle::from_cos(cos_axis)
            .saturating_sub(self.theta_o)
            .saturating_sub(half_box);
        let beside = off.cos <= self.cos_theta_e - 1e-3;
        let importance = by_distance * off.cos.max(1e-3);
        let height = Angle::from_cos((-normal.dot(direction)).clamp(-1.0, 1.0));
        let least = height.saturating_sub(half_box).cos;
        let beside = beside | (flat & (least <= 0.0));
        let importance = importance * if flat { least } else { 1.0 };
        // What is asked first comes last.
        let importance = if beside { 0.0 } else { importance };
        let importance = if inside { by_distance } else { importance };
        if below { 0.0 } else { importance }
    }
}

/// An angle in 0..=180 degrees.
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

    /// Of at most 90 degrees.
    #[inline(always)]
    fn from_sin(sin: f32) -> Self {
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        Self { sin, cos }
    }

    /// The difference, at least 0.
    #[inline(always)]
    fn saturating_sub(self, other: Self) -> Self {
        let sin = self.sin * other.cos - self.cos * other.sin;
        let cos = self.cos * other.cos + self.sin * other.sin;
        let none = self.cos >= other.cos;
        Self {
            sin: if none { 0.0 } else { sin },
            cos: if none { 1.0 } else { cos },
        }
    }
}

/// The smallest cone that holds two, as axis and cosine of the half angle.
fn cone_union(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let between = a.0.dot(b.0).clamp(-1.0, 1.0);
    // Most often one holds the other, and no angle is asked for.
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
    // A little wider against rounding.
    (axis.normalize(), (half + 1e-4).min(PI).cos())
}

/// Whether a cone holds another one, by the cosines of their half angles and of the angle between their axes.
fn cone_contains(outer: f32, inner: f32, between: f32) -> bool {
    let [wide, narrow] = [outer, inner].map(|cos| Angle::from_cos(cos.clamp(-1.0, 1.0)));
    outer <= -1.0 || (wide.cos <= narrow.cos && between >= wide.saturating_sub(narrow).cos)
}

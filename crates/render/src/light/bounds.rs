//! Where a group of lights is, where it shines, and how much of it may arrive at a point.
//!
//! The bounds on angles are those of M. Pharr, W. Jakob and G. Humphreys, "Physically Based Rendering", 4th edition,
//! section 12.6.3.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

/// Where lights are, where they shine and how much.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// Scene-local.
    pub lower: Vec3,
    pub upper: Vec3,
    /// Of a cone that holds all their normals; the cosine of its half angle.
    pub axis: Vec3,
    pub cos_normals: f32,
    /// The cosine of how far from its normal a light shines.
    pub cos_emission: f32,
    /// Whether they shine to the other side as well.
    pub two_sided: bool,
    /// The largest intensity of all together, in W/sr.
    pub intensity: f32,
}

impl Default for Bounds {
    fn default() -> Self {
        Self::around(DVec3::ZERO, DVec3::ZERO, Vec3::ZERO)
    }
}

impl Bounds {
    /// Of a light that shines everywhere.
    pub fn around(lower: DVec3, upper: DVec3, intensity: Vec3) -> Self {
        Self {
            lower: lower.as_vec3(),
            upper: upper.as_vec3(),
            axis: Vec3::Z,
            cos_normals: -1.0,
            cos_emission: 0.0,
            two_sided: false,
            intensity: intensity.element_sum(),
        }
    }

    /// Of one that shines from a plane.
    pub fn flat(corners: &[DVec3], normal: DVec3, intensity: Vec3, two_sided: bool) -> Self {
        let lower = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let upper = corners
            .iter()
            .copied()
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        Self {
            axis: normal.as_vec3(),
            cos_normals: 1.0,
            two_sided,
            ..Self::around(lower, upper, intensity)
        }
    }

    pub fn center(&self) -> Vec3 {
        self.lower + (self.upper - self.lower) / 2.0
    }

    pub fn union(&self, other: &Self) -> Self {
        // What is dark has no say.
        if other.intensity <= 0.0 {
            return *self;
        }
        if self.intensity <= 0.0 {
            return *other;
        }
        let (axis, cos_normals) = cone_union(
            (self.axis, self.cos_normals),
            (other.axis, other.cos_normals),
        );
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
            axis,
            cos_normals,
            cos_emission: self.cos_emission.min(other.cos_emission),
            two_sided: self.two_sided || other.two_sided,
            intensity: self.intensity + other.intensity,
        }
    }

    /// Made ready to be weighed.
    pub fn reach(&self) -> Reach {
        let half = (self.upper - self.lower) / 2.0;
        Reach {
            center: self.center(),
            half,
            radius: half.length(),
            axis: self.axis,
            normals: Angle::of_cosine(self.cos_normals.clamp(-1.0, 1.0)),
            cos_emission: self.cos_emission,
            two_sided: self.two_sided,
            intensity: self.intensity,
        }
    }

    /// The cost of a group in the surface area orientation heuristic: intensity, area and the measure of its directions.
    pub fn cost(&self) -> f32 {
        let size = self.upper - self.lower;
        let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
        let cos_normals = self.cos_normals.clamp(-1.0, 1.0);
        let sin_normals = Angle::of_cosine(cos_normals).sin;
        let (normals, emission) = (cos_normals.acos(), self.cos_emission.acos());
        let edge = (normals + emission).min(PI);
        let directions = 2.0 * PI * (1.0 - cos_normals)
            + PI / 2.0
                * (2.0 * edge * sin_normals
                    - (normals - 2.0 * edge).cos()
                    - 2.0 * normals * sin_normals
                    + cos_normals);
        // Lights in one point or line still cost more apart.
        self.intensity * directions * (area + size.max_element().powi(2))
    }
}

/// What [`Bounds`] say, as it takes least to weigh them for a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Of the box, and from there to a corner; the length of that.
    pub center: Vec3,
    pub half: Vec3,
    pub radius: f32,
    pub axis: Vec3,
    /// Of the cone around the axis that holds all normals.
    pub normals: Angle,
    pub cos_emission: f32,
    pub two_sided: bool,
    pub intensity: f32,
}

impl Reach {
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
        let by_distance = self.intensity / distance2.max(radius2).max(1e-30);
        let flat = (normal.x != 0.0) | (normal.y != 0.0) | (normal.z != 0.0);
        // The corner that stands highest above the point's horizon, a bit more against rounding.
        let highest = self.half.dot(normal.abs()) - away.dot(normal);
        let below = flat & (highest <= -1e-5 * away.abs().element_sum());
        let inside = distance2 <= radius2;
        // The half angle that the box fills, at most; a bit more against rounding.
        let half_box = Angle::of_sine((self.radius * inverse + 1e-3).min(1.0));
        let cos_axis = self.axis.dot(direction).clamp(-1.0, 1.0);
        let cos_axis = if self.two_sided {
            cos_axis.abs()
        } else {
            cos_axis
        };
        let off = Angle::of_cosine(cos_axis).less(self.normals).less(half_box);
        let beside = off.cos <= self.cos_emission - 1e-3;
        let importance = by_distance * off.cos.max(1e-3);
        let height = Angle::of_cosine((-normal.dot(direction)).clamp(-1.0, 1.0));
        let least = height.less(half_box).cos;
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
    fn of_cosine(cos: f32) -> Self {
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        Self { sin, cos }
    }

    /// Of at most 90 degrees.
    #[inline(always)]
    fn of_sine(sin: f32) -> Self {
        let cos = (1.0 - sin * sin).max(0.0).sqrt();
        Self { sin, cos }
    }

    /// The difference, at least 0.
    #[inline(always)]
    fn less(self, other: Self) -> Self {
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
    if holds(a.1, b.1, between) {
        return a;
    }
    if holds(b.1, a.1, between) {
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
fn holds(outer: f32, inner: f32, between: f32) -> bool {
    let [wide, narrow] = [outer, inner].map(|cos| Angle::of_cosine(cos.clamp(-1.0, 1.0)));
    outer <= -1.0 || (wide.cos <= narrow.cos && between >= wide.less(narrow).cos)
}

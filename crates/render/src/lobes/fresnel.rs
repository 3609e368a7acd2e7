//! Fresnel terms: the fraction of light that an interface reflects.

use glam::Vec3;

use crate::lobes::thin_film::ThinFilm;

/// An interface, described from the viewer's side.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fresnel {
    /// Schlick's approximation (C. Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", 1994).
    Schlick {
        /// Reflectance at normal and at grazing incidence.
        f0: Vec3,
        f90: Vec3,
        /// Index of refraction of the far side relative to the near side, if the far side has the lower index.
        eta: Option<f32>,
    },
    /// Schlick's approximation, with a thin film on a fraction `weight` of the surface.
    ThinFilm { thin_film: ThinFilm, f0: Vec3, f90: Vec3, weight: f32 },
    /// Fresnel's equations for unpolarised light, given the index of refraction of the far side relative to the near
    /// side.
    Dielectric(f32),
    /// A pane of two parallel interfaces with all reflections between them, given the pane's index of refraction.
    ThinDielectric(f32),
    /// Fresnel's equations for conductors, times a colour.
    Conductor { ior: Vec3, extinction: Vec3, tint: Vec3 },
}

impl Fresnel {
    /// The reflectance for a cosine between the microfacet normal and a direction on the near side.
    pub fn reflectance(&self, cosine: f32) -> Vec3 {
        match *self {
            Self::Schlick { f0, f90, eta } => match eta {
                None => schlick(f0, f90, cosine),
                Some(eta) => schlick_two_sided(f0, f90, cosine, eta),
            },
            Self::ThinFilm { thin_film, f0, f90, weight } => {
                schlick(f0, f90, cosine).lerp(thin_film.reflectance(cosine, f0), weight)
            }
            Self::Dielectric(eta) => Vec3::splat(dielectric(cosine, eta)),
            Self::ThinDielectric(eta) => Vec3::splat(thin_dielectric(dielectric(cosine, eta))),
            Self::Conductor { ior, extinction, tint } => tint * conductors(cosine, ior, extinction),
        }
    }

    /// The reflectance at normal and at grazing incidence.
    pub fn f0_f90(&self) -> (Vec3, Vec3) {
        match *self {
            Self::Schlick { f0, f90, .. } => (f0, f90),
            Self::ThinFilm { f90, .. } => (self.reflectance(1.0), f90),
            Self::Conductor { tint, .. } => (self.reflectance(1.0), tint),
            Self::Dielectric(_) | Self::ThinDielectric(_) => (self.reflectance(1.0), Vec3::ONE),
        }
    }
}

/// Schlick's approximation.
#[inline(always)]
pub(crate) fn schlick(f0: Vec3, f90: Vec3, cosine: f32) -> Vec3 {
    let x = (1.0 - cosine).clamp(0.0, 1.0);
    let x2 = x * x;
    f0 + (f90 - f0) * (x2 * x2 * x)
}

/// Schlick's approximation from either side, given the index of refraction of the far side relative to the near side.
#[inline(always)]
pub(crate) fn schlick_two_sided(f0: Vec3, f90: Vec3, cosine: f32, eta: f32) -> Vec3 {
    let (cosine, is_total) = thinner_side_cosine(cosine, eta);
    let reflectance = schlick(f0, f90, cosine);
    if is_total { Vec3::ONE } else { reflectance }
}

/// Cosine on the side with the lower index of refraction, from which both sides compute the same value; and true for
/// total internal reflection.
#[inline(always)]
pub(crate) fn thinner_side_cosine(cosine: f32, eta: f32) -> (f32, bool) {
    let sin2 = (1.0 - cosine * cosine).max(0.0) / (eta * eta);
    let transmitted = (1.0 - sin2).sqrt();
    let is_inside = eta < 1.0;
    (if is_inside { transmitted } else { cosine }, is_inside & (sin2 >= 1.0))
}

/// Weight of f0 in Schlick's approximation; the weight of f90 is 1 minus this value.
pub(crate) fn schlick_weight(cosine: f32) -> f32 {
    1.0 - (1.0 - cosine).powi(5)
}

/// Cosine of the refracted direction, on the far side; `None` for total internal reflection.
#[inline(always)]
pub(crate) fn refracted_cosine(cosine: f32, eta: f32) -> Option<f32> {
    let sin2 = (1.0 - cosine * cosine).max(0.0) / (eta * eta);
    (sin2 < 1.0).then(|| (1.0 - sin2).sqrt())
}

/// The reflectance of [`Fresnel::Dielectric`].
#[inline(always)]
pub(crate) fn dielectric(cosine: f32, eta: f32) -> f32 {
    let Some(other) = refracted_cosine(cosine, eta) else {
        return 1.0;
    };
    let parallel = (eta * cosine - other) / (eta * cosine + other);
    let perpendicular = (cosine - eta * other) / (cosine + eta * other);
    (parallel * parallel + perpendicular * perpendicular) / 2.0
}

/// Reflectance of [`Fresnel::ThinDielectric`], from the reflectance of a single interface.
#[inline(always)]
pub(crate) fn thin_dielectric(once: f32) -> f32 {
    2.0 * once / (1.0 + once)
}

/// The reflectance of [`Fresnel::Conductor`] without its tint.
#[inline(always)]
pub(crate) fn conductors(cosine: f32, ior: Vec3, extinction: Vec3) -> Vec3 {
    Vec3::new(
        conductor(cosine, ior.x, extinction.x),
        conductor(cosine, ior.y, extinction.y),
        conductor(cosine, ior.z, extinction.z),
    )
}

/// Reflectance of a conductor for both polarisations (M. Born and E. Wolf, "Principles of Optics", section 14.2).
#[inline(always)]
fn conductor(c: f32, n: f32, k: f32) -> f32 {
    let (c2, s2, n2, k2) = (c * c, 1.0 - c * c, n * n, k * k);
    let t = n2 - k2 - s2;
    let a2b2 = (t * t + 4.0 * n2 * k2).sqrt();
    // (a2b2 + t) / 2, in the form without cancellation.
    let a = if t > 0.0 { (a2b2 + t) / 2.0 } else { 2.0 * n2 * k2 / (a2b2 - t) }.max(0.0).sqrt();
    let (t1, t2) = (a2b2 + c2, 2.0 * c * a);
    let perpendicular = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (c2 * a2b2 + s2 * s2, t2 * s2);
    let parallel = perpendicular * (t3 - t4) / (t3 + t4);
    (perpendicular + parallel) / 2.0
}

/// Mirror direction of `wo` about a microfacet normal; `None` if the direction is below the surface.
#[inline(always)]
pub(crate) fn reflect(wo: Vec3, wm: Vec3) -> Option<Vec3> {
    let wi = 2.0 * wo.dot(wm) * wm - wo;
    (wi.z > 0.0).then_some(wi)
}

/// Refracted direction of `wo` at a microfacet; `None` for total reflection, or if the direction is above the surface.
/// `eta` is the index of refraction of the far side relative to the near side.
#[inline(always)]
pub(crate) fn refract(wo: Vec3, wm: Vec3, eta: f32) -> Option<Vec3> {
    let (wi, is_valid) = refract_unchecked(wo, wm, eta);
    is_valid.then_some(wi)
}

/// [`refract`] without branches: returns a direction, and true if the direction exists.
#[inline(always)]
pub(crate) fn refract_unchecked(wo: Vec3, wm: Vec3, eta: f32) -> (Vec3, bool) {
    let cosine = wo.dot(wm);
    let sin2 = (1.0 - cosine * cosine).max(0.0) / (eta * eta);
    let wi = wm * (cosine / eta - (1.0 - sin2).sqrt()) - wo / eta;
    (wi, (sin2 < 1.0) & (wi.z < 0.0))
}

//! How much of the light an interface reflects.

use glam::Vec3;

use crate::lobes::thin_film::ThinFilm;

/// An interface, as the viewer meets it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fresnel {
    /// C. Schlick, "An Inexpensive BRDF Model for Physically-based Rendering", 1994.
    Schlick {
        /// At normal incidence, and at grazing incidence.
        f0: Vec3,
        f90: Vec3,
        /// The index of the other side relative to the viewer's, where it is less dense than the viewer's.
        eta: Option<f32>,
    },
    /// The same under a thin film, which has this share of the surface.
    ThinFilm {
        thin_film: ThinFilm,
        f0: Vec3,
        f90: Vec3,
        weight: f32,
    },
    /// Fresnel's equations for unpolarised light; the index of the other side relative to the viewer's.
    Dielectric(f32),
    /// The same for a pane of two parallel interfaces, with all reflections in between.
    ThinDielectric(f32),
    /// Fresnel's equations for metals, times a colour.
    Conductor {
        ior: Vec3,
        extinction: Vec3,
        tint: Vec3,
    },
}

impl Fresnel {
    /// The share that is reflected, by the cosine between the microfacet's normal and a direction on the viewer's side.
    pub fn reflectance(&self, cosine: f32) -> Vec3 {
        match *self {
            Self::Schlick {
                f0,
                f90,
                eta: inside,
            } => match inside {
                None => schlick(f0, f90, cosine),
                Some(eta) => schlick_two_sided(f0, f90, cosine, eta),
            },
            Self::ThinFilm {
                thin_film: film,
                f0,
                f90,
                weight: share,
            } => schlick(f0, f90, cosine).lerp(film.reflectance(cosine, f0), share),
            Self::Dielectric(eta) => Vec3::splat(dielectric(cosine, eta)),
            Self::ThinDielectric(eta) => Vec3::splat(thin_dielectric(dielectric(cosine, eta))),
            Self::Conductor {
                ior,
                extinction,
                tint,
            } => tint * conductors(cosine, ior, extinction),
        }
    }

    /// At normal and at grazing incidence.
    pub fn f0_f90(&self) -> (Vec3, Vec3) {
        match *self {
            Self::Schlick { f0, f90, .. } => (f0, f90),
            Self::ThinFilm { f90, .. } => (self.reflectance(1.0), f90),
            Self::Conductor { tint, .. } => (self.reflectance(1.0), tint),
            Self::Dielectric(_) | Self::ThinDielectric(_) => (self.reflectance(1.0), Vec3::ONE),
        }
    }
}

#[inline(always)]
pub(crate) fn schlick(f0: Vec3, f90: Vec3, cosine: f32) -> Vec3 {
    let x = (1.0 - cosine).clamp(0.0, 1.0);
    let x2 = x * x;
    f0 + (f90 - f0) * (x2 * x2 * x)
}

/// The same from either side, by the index of the other one relative to the viewer's.
#[inline(always)]
pub(crate) fn schlick_two_sided(f0: Vec3, f90: Vec3, cosine: f32, eta: f32) -> Vec3 {
    if eta >= 1.0 {
        return schlick(f0, f90, cosine);
    }
    // By the angle on the thinner side, so that both directions agree.
    match refracted_cosine(cosine, eta) {
        Some(outside) => schlick(f0, f90, outside),
        None => Vec3::ONE,
    }
}

/// The cosine on the other side; `None` for total reflection.
#[inline(always)]
pub(crate) fn refracted_cosine(cosine: f32, eta: f32) -> Option<f32> {
    let sin2 = (1.0 - cosine * cosine).max(0.0) / (eta * eta);
    (sin2 < 1.0).then(|| (1.0 - sin2).sqrt())
}

/// What [`Fresnel::Dielectric`] reflects.
#[inline(always)]
pub(crate) fn dielectric(cosine: f32, eta: f32) -> f32 {
    let Some(other) = refracted_cosine(cosine, eta) else {
        return 1.0;
    };
    let parallel = (eta * cosine - other) / (eta * cosine + other);
    let perpendicular = (cosine - eta * other) / (cosine + eta * other);
    (parallel * parallel + perpendicular * perpendicular) / 2.0
}

/// What [`Fresnel::ThinDielectric`] reflects, by what each of its interfaces does.
#[inline(always)]
pub(crate) fn thin_dielectric(once: f32) -> f32 {
    2.0 * once / (1.0 + once)
}

/// What [`Fresnel::Conductor`] reflects of each colour.
#[inline(always)]
pub(crate) fn conductors(cosine: f32, ior: Vec3, extinction: Vec3) -> Vec3 {
    Vec3::new(
        conductor(cosine, ior.x, extinction.x),
        conductor(cosine, ior.y, extinction.y),
        conductor(cosine, ior.z, extinction.z),
    )
}

/// M. Born and E. Wolf, "Principles of Optics", section 14.2.
#[inline(always)]
fn conductor(c: f32, n: f32, k: f32) -> f32 {
    let (c2, s2, n2, k2) = (c * c, 1.0 - c * c, n * n, k * k);
    let t = n2 - k2 - s2;
    let a2b2 = (t * t + 4.0 * n2 * k2).sqrt();
    // (a2b2 + t) / 2, of whichever form takes no difference of near numbers.
    let a = if t > 0.0 {
        (a2b2 + t) / 2.0
    } else {
        2.0 * n2 * k2 / (a2b2 - t)
    }
    .max(0.0)
    .sqrt();
    let (t1, t2) = (a2b2 + c2, 2.0 * c * a);
    let perpendicular = (t1 - t2) / (t1 + t2);
    let (t3, t4) = (c2 * a2b2 + s2 * s2, t2 * s2);
    let parallel = perpendicular * (t3 - t4) / (t3 + t4);
    (perpendicular + parallel) / 2.0
}

/// The mirror direction about a normal, where it lies above the surface.
#[inline(always)]
pub(crate) fn reflect(v: Vec3, h: Vec3) -> Option<Vec3> {
    let l = 2.0 * v.dot(h) * h - v;
    (l.z > 0.0).then_some(l)
}

/// The refracted direction, where there is one and it lies below the surface; `eta` is the index there relative to here.
#[inline(always)]
pub(crate) fn refract(v: Vec3, h: Vec3, eta: f32) -> Option<Vec3> {
    let cosine = v.dot(h);
    let other = refracted_cosine(cosine, eta)?;
    let l = h * (cosine / eta - other) - v / eta;
    (l.z < 0.0).then_some(l)
}

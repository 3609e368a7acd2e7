//! What a rough interface that refracts loses because light is followed to one microfacet alone.
//!
//! Tables over cosine and roughness, for both sides of an index of refraction. A row is made by quadrature when a
//! surface first asks for its roughness: smooth glass asks for none.

use std::sync::OnceLock;

use glam::Vec3;

use crate::lobes::albedo_tables::{
    ROWS, STEPS, cosine_of, mean, of_row, over_visible_normals, row_of, schlick_weight, step_of,
};
use crate::lobes::fresnel::{Fresnel, reflect, refract, refracted_cosine};
use crate::lobes::ggx::Ggx;

/// Points of a quadrature, outwards and around.
const RINGS: u32 = 128;
const TURNS: u32 = 48;

/// How much is reflected by the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Curve {
    /// As Fresnel's equations say.
    Exact,
    /// As Schlick's approximation says, between any two ends.
    Schlick,
}

/// The losses of an index of refraction, by roughness.
#[derive(Debug)]
pub(crate) struct Interface {
    ior: f32,
    curve: Curve,
    rows: [OnceLock<Box<Row>>; ROWS],
}

/// Of one roughness: what is lost of light from outside and from inside.
#[derive(Debug)]
struct Row([Side; 2]);

/// All is linear in what is reflected head on (f0) and at grazing angles (f90): a constant and two factors.
#[derive(Debug)]
struct Side {
    /// By the cosine, what one microfacet reflects, and what it refracts.
    kept: [[[f32; 3]; 2]; STEPS],
    /// What is neither, in the mean over the hemisphere, weighed by the cosine.
    lost_mean: [f32; 3],
}

/// Losses at one roughness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Losses<'a> {
    rows: [&'a Row; 2],
    between: f32,
    curve: Curve,
}

impl Interface {
    /// `ior` is that of the inside relative to the outside.
    pub fn new(ior: f32, curve: Curve) -> Self {
        Self {
            ior,
            curve,
            rows: [const { OnceLock::new() }; ROWS],
        }
    }

    /// Whether it is what a surface with this index on its other side has.
    pub fn is_between(&self, eta: f32) -> bool {
        eta == self.ior || eta == 1.0 / self.ior
    }

    pub(crate) fn at(&self, ggx: &Ggx) -> Losses<'_> {
        let (low, between) = row_of(ggx);
        let row = |i: usize| &**self.rows[i].get_or_init(|| Box::new(self.row(i)));
        Losses {
            rows: [row(low), row(low + 1)],
            between,
            curve: self.curve,
        }
    }

    fn row(&self, row: usize) -> Row {
        let ggx = of_row(row);
        Row([self.ior, 1.0 / self.ior].map(|eta| {
            let mut kept = [[[0.0; 3]; 2]; STEPS];
            for (column, kept) in kept.iter_mut().enumerate() {
                *kept = self.kept(&ggx, eta, cosine_of(column));
            }
            let kept_mean = |term: usize| {
                let of = |part: usize| mean(&kept.map(|parts| parts[part][term]));
                of(0) + of(1)
            };
            Side {
                lost_mean: [1.0 - kept_mean(0), -kept_mean(1), -kept_mean(2)],
                kept,
            }
        }))
    }

    /// What is reflected and refracted by one microfacet.
    fn kept(&self, ggx: &Ggx, eta: f32, cosine: f32) -> [[f32; 3]; 2] {
        if ggx.is_smooth() {
            return self.parts(cosine, eta, 1.0, 1.0);
        }
        let kept = over_visible_normals(ggx, cosine, [RINGS, TURNS], |v, h| {
            let up = reflect(v, h).map_or(0.0, |l| ggx.visible_also(v, l));
            let down =
                refract(v, h, eta).map_or(0.0, |l| ggx.visible_also(v, Vec3::new(l.x, l.y, -l.z)));
            let [[a, b, c], [d, e, f]] = self.parts(v.dot(h), eta, up, down);
            [a, b, c, d, e, f]
        });
        let [a, b, c, d, e, f] = kept;
        [[a, b, c], [d, e, f]]
    }

    /// What a microfacet reflects and refracts, each of which is seen by a share.
    fn parts(&self, cosine: f32, eta: f32, up: f32, down: f32) -> [[f32; 3]; 2] {
        let Some(other) = refracted_cosine(cosine, eta) else {
            return [[up, 0.0, 0.0], [0.0; 3]];
        };
        match self.curve {
            Curve::Exact => {
                let reflected = Fresnel::Dielectric(eta).reflected(cosine).x;
                let refracted = 1.0 - reflected;
                [[up * reflected, 0.0, 0.0], [down * refracted, 0.0, 0.0]]
            }
            Curve::Schlick => {
                let f0 = schlick_weight(if eta < 1.0 { other } else { cosine });
                let f90 = 1.0 - f0;
                [[0.0, up * f0, up * f90], [down, -down * f0, -down * f90]]
            }
        }
    }
}

impl Losses<'_> {
    /// Of light from a side at a cosine, where the interface reflects `f0` to `f90`: what one microfacet reflects, and what
    /// it refracts.
    #[inline(always)]
    pub fn kept(&self, inside: bool, cosine: f32, ends: (Vec3, Vec3)) -> [Vec3; 2] {
        let (first, part) = step_of::<STEPS>(cosine);
        // Spelled out: the compiler may leave `map` a call.
        let of = |which: usize| {
            self.with(ends, |row, term| {
                let kept = &row.0[usize::from(inside)].kept;
                let (low, high) = (kept[first][which][term], kept[first + 1][which][term]);
                low + (high - low) * part
            })
        };
        [of(0), of(1)]
    }

    /// What is lost in the mean over the hemisphere, weighed by the cosine.
    #[inline(always)]
    pub fn lost_mean(&self, inside: bool, ends: (Vec3, Vec3)) -> Vec3 {
        self.with(ends, |row, term| row.0[usize::from(inside)].lost_mean[term])
    }

    #[inline(always)]
    fn with(&self, (f0, f90): (Vec3, Vec3), of: impl Fn(&Row, usize) -> f32) -> Vec3 {
        let [low, high] = self.rows;
        let term = |term| {
            let low = of(low, term);
            low + (of(high, term) - low) * self.between
        };
        match self.curve {
            // The others are zero.
            Curve::Exact => Vec3::splat(term(0)),
            Curve::Schlick => Vec3::splat(term(0)) + f0 * term(1) + f90 * term(2),
        }
    }
}

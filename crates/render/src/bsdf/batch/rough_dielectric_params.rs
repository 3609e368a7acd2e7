//! What frosted points are made of, many at a time, field by field: an interface of one roughness between two sides.

use glam::Vec3;

use crate::bsdf::layered::LayerStack;
use crate::lobes::albedo_dielectric::EnergyLoss;
use crate::lobes::fresnel::{Fresnel, dielectric, schlick};
use crate::lobes::ggx::{Ggx, MicrofacetEval};
use crate::prepare::geometry::Geometry;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Interfaces that refract. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct RoughDielectricParams<const N: usize> {
    /// The index of the other side relative to the viewer's.
    pub eta: [f32; N],
    /// Whether it reflects as Fresnel's equations say.
    is_exact: [bool; N],
    /// The width of the interface's lobe.
    alpha: [f32; N],
    /// What the interface reflects at normal and at grazing incidence, and what it keeps from the other side.
    f0_f90: [Vec3xN<f32, N>; 2],
    base_f0_f90: [Vec3xN<f32, N>; 2],
    /// What is left of light that is refracted.
    transmission: Vec3xN<f32, N>,
    /// Which of the world's materials it is.
    material: [u32; N],
}

/// What microfacets lose of a view.
#[derive(Debug)]
pub(crate) struct LaneLosses<const N: usize> {
    /// What one reflects, and what it refracts, over the colours in the mean.
    pub single_scatter: [[f32; N]; 2],
    /// What is neither.
    pub loss: Vec3xN<f32, N>,
    /// The same in the mean over the hemisphere on either side.
    pub mean_loss: [Vec3xN<f32, N>; 2],
}

impl<const N: usize> Default for RoughDielectricParams<N> {
    fn default() -> Self {
        Self {
            eta: [1.5; N],
            is_exact: [true; N],
            alpha: [1.0; N],
            f0_f90: [[[0.0; N]; 3]; 2],
            base_f0_f90: [[[0.0; N]; 3]; 2],
            transmission: [[0.0; N]; 3],
            material: [0; N],
        }
    }
}

impl<const N: usize> RoughDielectricParams<N> {
    /// Sets a lane by its layers, if that is all there is to them.
    #[inline]
    pub fn set_lane(&mut self, lane: usize, layers: &LayerStack, material: usize) -> bool {
        let exact = match (&layers.fresnel, &layers.base_fresnel) {
            (Fresnel::Dielectric(_), Fresnel::Dielectric(_)) => true,
            (Fresnel::Schlick { .. }, Fresnel::Schlick { .. }) => false,
            _ => return false,
        };
        let between = |of: &crate::bsdf::DielectricAlbedo| of.matches_eta(layers.eta);
        let is = !layers.ggx.effectively_smooth()
            && layers.ggx.is_isotropic()
            && layers.transmission != Vec3::ZERO
            && layers.is_interface_only()
            && layers.eta != 1.0
            && layers.dielectric_albedo.is_some_and(between);
        if is {
            self.eta[lane] = layers.eta;
            self.is_exact[lane] = exact;
            self.alpha[lane] = layers.ggx.alpha_x;
            let (own, over) = (layers.fresnel.f0_f90(), layers.base_fresnel.f0_f90());
            for (lanes, (f0, f90)) in [(&mut self.f0_f90, own), (&mut self.base_f0_f90, over)] {
                set_lane(&mut lanes[0], lane, f0.to_array());
                set_lane(&mut lanes[1], lane, f90.to_array());
            }
            set_lane(&mut self.transmission, lane, layers.transmission.to_array());
            self.material[lane] = material as u32;
        }
        is
    }

    #[inline(always)]
    pub fn ggx(&self, lane: usize) -> Ggx {
        Ggx {
            alpha_x: self.alpha[lane],
            alpha_y: self.alpha[lane],
        }
    }

    #[inline(always)]
    pub fn ends(&self, lane: usize) -> (Vec3, Vec3) {
        let [f0, f90] = &self.f0_f90;
        (get_lane(f0, lane).into(), get_lane(f90, lane).into())
    }

    #[inline(always)]
    pub fn over(&self, lane: usize) -> (Vec3, Vec3) {
        let [f0, f90] = &self.base_f0_f90;
        (get_lane(f0, lane).into(), get_lane(f90, lane).into())
    }

    #[inline(always)]
    pub fn transmission(&self, lane: usize) -> Vec3 {
        get_lane(&self.transmission, lane).into()
    }

    /// Whether a table says what the interface reflects: Schlick's approximation, from the thinner side.
    #[inline(always)]
    pub fn uses_table(&self, lane: usize) -> bool {
        !self.is_exact[lane] & (self.eta[lane] >= 1.0)
    }

    /// What the interfaces reflect at these cosines, and what they keep from the other side.
    #[inline(always)]
    pub fn reflectance(&self, cosines: &[f32; N]) -> (Vec3xN<f32, N>, Vec3xN<f32, N>) {
        let (mut reflected, mut over) = ([[0.0; N]; 3], [[0.0; N]; 3]);
        for (lane, &cosine) in cosines.iter().enumerate() {
            let eta = self.eta[lane];
            let exact = dielectric(cosine, eta);
            let sin2 = (1.0 - cosine * cosine).max(0.0) / (eta * eta);
            let outside = (1.0 - sin2).sqrt();
            let cosine = if eta < 1.0 { outside } else { cosine };
            let all = (eta < 1.0) & (sin2 >= 1.0);
            for (out, (f0, f90)) in [
                (&mut reflected, self.ends(lane)),
                (&mut over, self.over(lane)),
            ] {
                let approximate = schlick(f0, f90, cosine);
                let approximate = if all { Vec3::ONE } else { approximate };
                let color = if self.is_exact[lane] {
                    Vec3::splat(exact)
                } else {
                    approximate
                };
                set_lane(out, lane, color.to_array());
            }
        }
        (reflected, over)
    }

    /// The microfacet that refracts light from `l` to `v`: by how much it squeezes directions, and what its transmittance
    /// and the density of sampling it are multiplied by, but for that. Nothing where there is none.
    #[inline(always)]
    pub fn eval_refraction(&self, lane: usize, v: Vec3, l: Vec3) -> (f32, MicrofacetEval) {
        let (ggx, eta) = (self.ggx(lane), self.eta[lane]);
        let h = (v + l * eta).normalize_or_zero();
        let h = if h.z < 0.0 { -h } else { h };
        let (seen, lit) = (v.dot(h), l.dot(h));
        let squeeze = -lit / (seen + eta * lit).powi(2);
        let down = Vec3::new(l.x, l.y, -l.z);
        let shape = ggx.d(h) * ggx.g(v, down) * seen / v.z;
        let none = (seen <= 0.0) | (lit >= 0.0);
        let facets = MicrofacetEval {
            cosine: if none { 1.0 } else { seen },
            weight: if none { 0.0 } else { shape },
            pdf: if none { 0.0 } else { ggx.pdf(v, h) },
        };
        (if none { 0.0 } else { squeeze }, facets)
    }

    /// What microfacets lose of light from directions at these heights, on the viewer's side or the other, in some lanes.
    #[inline(always)]
    pub fn energy_loss(
        &self,
        world: &Geometry,
        lanes: impl Iterator<Item = usize>,
        other: &[bool; N],
        heights: &[f32; N],
    ) -> Vec3xN<f32, N> {
        let mut all = [[0.0; N]; 3];
        let mut last = None;
        for lane in lanes {
            let inside = self.eta[lane] < 1.0;
            let losses = self.lane_losses(world, lane, &mut last);
            let [up, down] = losses.albedo(inside != other[lane], heights[lane], self.over(lane));
            set_lane(&mut all, lane, (Vec3::ONE - up - down).to_array());
        }
        all
    }

    /// What they lose of views at these heights, in lanes that are set.
    #[inline(always)]
    pub fn view_losses(
        &self,
        world: &Geometry,
        is: [bool; N],
        heights: &[f32; N],
    ) -> LaneLosses<N> {
        let mut lost = LaneLosses {
            single_scatter: [[0.0; N]; 2],
            loss: [[0.0; N]; 3],
            mean_loss: [[[0.0; N]; 3]; 2],
        };
        let mut last = None;
        for lane in (0..N).filter(|&lane| is[lane]) {
            let (inside, ends) = (self.eta[lane] < 1.0, self.over(lane));
            let losses = self.lane_losses(world, lane, &mut last);
            let [up, down] = losses.albedo(inside, heights[lane], ends);
            for (out, kept) in lost.single_scatter.iter_mut().zip([up, down]) {
                out[lane] = kept.element_sum() / 3.0;
            }
            set_lane(&mut lost.loss, lane, (Vec3::ONE - up - down).to_array());
            for (out, side) in lost.mean_loss.iter_mut().zip([inside, !inside]) {
                set_lane(out, lane, losses.mean_loss(side, ends).to_array());
            }
        }
        lost
    }

    /// Those of a lane. Most are those of the lane asked for last.
    #[inline(always)]
    fn lane_losses<'a>(
        &self,
        world: &'a Geometry,
        lane: usize,
        last: &mut Option<(u32, f32, EnergyLoss<'a>)>,
    ) -> EnergyLoss<'a> {
        let (material, alpha) = (self.material[lane], self.alpha[lane]);
        match *last {
            Some((m, a, losses)) if (m, a) == (material, alpha) => losses,
            _ => {
                // Put only where there is one; without dispersion it is the only one.
                let interfaces = &world.materials[material as usize].dielectric_tables;
                let losses = interfaces[0].at_roughness(&self.ggx(lane));
                *last = Some((material, alpha, losses));
                losses
            }
        }
    }
}

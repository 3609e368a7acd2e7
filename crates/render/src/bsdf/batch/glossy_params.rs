//! What glossy points are made of, many at a time, field by field: an interface of one roughness over a diffuse base.

use glam::Vec3;
use raycam_scene::MaterialModel;

use crate::bsdf::layered::LayerStack;
use crate::lobes::fresnel::{Fresnel, conductors, schlick};
use crate::lobes::ggx::Ggx;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Interfaces and bases. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct GlossyParams<const N: usize> {
    /// Which interfaces are metals, and whether any is.
    pub is_conductor: [bool; N],
    pub any_conductor: bool,
    /// The width of the interface's lobe.
    alpha: [f32; N],
    /// What the interface reflects at normal and at grazing incidence, and what it keeps from the base.
    f0_f90: [Vec3xN<f32, N>; 2],
    base_f0_f90: [Vec3xN<f32, N>; 2],
    /// What the base reflects.
    diffuse: Vec3xN<f32, N>,
    /// Of metals.
    ior: Vec3xN<f32, N>,
    extinction: Vec3xN<f32, N>,
}

impl<const N: usize> Default for GlossyParams<N> {
    fn default() -> Self {
        Self {
            is_conductor: [false; N],
            any_conductor: false,
            alpha: [1.0; N],
            f0_f90: [[[0.0; N]; 3]; 2],
            base_f0_f90: [[[0.0; N]; 3]; 2],
            diffuse: [[0.0; N]; 3],
            ior: [[1.0; N]; 3],
            extinction: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> GlossyParams<N> {
    /// Sets a lane by its layers, of which only interface and base matter, and what they were made by.
    #[inline]
    pub fn set_lane(&mut self, lane: usize, layers: &LayerStack, reflectance: &MaterialModel) {
        self.is_conductor[lane] = false;
        if let MaterialModel::Metal(metal) = reflectance {
            self.is_conductor[lane] = true;
            self.any_conductor = true;
            set_lane(&mut self.ior, lane, metal.ior);
            set_lane(&mut self.extinction, lane, metal.extinction);
        }
        // What a metal reflects at normal incidence is found for many.
        let ends = |fresnel: &Fresnel| match *fresnel {
            Fresnel::Conductor { tint, .. } => (tint, tint),
            ref fresnel => fresnel.f0_f90(),
        };
        let (own, over) = (ends(&layers.fresnel), ends(&layers.base_fresnel));
        for (lanes, (f0, f90)) in [(&mut self.f0_f90, own), (&mut self.base_f0_f90, over)] {
            set_lane(&mut lanes[0], lane, f0.to_array());
            set_lane(&mut lanes[1], lane, f90.to_array());
        }
        set_lane(&mut self.diffuse, lane, layers.diffuse.to_array());
        self.alpha[lane] = layers.ggx.alpha_x;
    }

    /// Finds what metals reflect at normal incidence.
    #[inline(always)]
    pub fn compute_f0(&mut self) {
        if self.any_conductor {
            for lane in 0..N {
                let straight = self.conductor_reflectance(lane, 1.0).to_array();
                for (f0, straight) in self.f0_f90[0].iter_mut().zip(straight) {
                    f0[lane] = if self.is_conductor[lane] {
                        straight
                    } else {
                        f0[lane]
                    };
                }
            }
        }
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
    pub fn diffuse(&self, lane: usize) -> Vec3 {
        get_lane(&self.diffuse, lane).into()
    }

    /// What the interfaces reflect at these cosines.
    #[inline(always)]
    pub fn reflectance(&self, cosines: &[f32; N]) -> Vec3xN<f32, N> {
        let mut reflected = [[0.0; N]; 3];
        for (lane, &cosine) in cosines.iter().enumerate() {
            let (f0, f90) = self.ends(lane);
            set_lane(&mut reflected, lane, schlick(f0, f90, cosine).to_array());
        }
        if self.any_conductor {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let color = self.conductor_reflectance(lane, cosine).to_array();
                for (out, color) in reflected.iter_mut().zip(color) {
                    out[lane] = if self.is_conductor[lane] {
                        color
                    } else {
                        out[lane]
                    };
                }
            }
        }
        reflected
    }

    #[inline(always)]
    fn conductor_reflectance(&self, lane: usize, cosine: f32) -> Vec3 {
        let (ior, extinction) = (get_lane(&self.ior, lane), get_lane(&self.extinction, lane));
        let tint = Vec3::from(get_lane(&self.f0_f90[1], lane));
        tint * conductors(cosine, ior.into(), extinction.into())
    }
}

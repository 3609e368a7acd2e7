//! Mirrors and clear dielectrics of many points. A path may follow both branches of a dielectric.

use glam::Vec3;

use crate::bsdf::BsdfSample;
use crate::bsdf::batch::{
    ActiveLanes, BatchModel, BsdfEvals, BsdfSamples, F0F90Lanes, LaneContext, LaneRandoms, LayeredBatchModel, LocalView,
};
use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::specular::{FORCE_TRANSMISSION, SpecularBsdf};
use crate::lobes::fresnel::{Fresnel, conductors, dielectric, schlick_two_sided, thin_dielectric};
use crate::soa::{LANES, Vec3xN, lane_vec3, set_lane};

/// Each branch of a split path is followed this many times as often as its fraction of the light.
const SPLIT_OVERSAMPLING: f32 = 3.0;

/// Smooth interfaces that have no other layers.
#[derive(Debug, Default)]
pub(crate) struct SpecularModel {
    is_conductor: [bool; LANES],
    uses_schlick: [bool; LANES],
    is_thin: [bool; LANES],
    /// Reflectance formulas that any lane uses: a conductor's, a dielectric's, and Schlick's approximation.
    any_conductor: bool,
    any_dielectric: bool,
    any_schlick: bool,
    /// Tint of a conductor's reflection, or of the light that a dielectric transmits.
    base: Vec3xN<f32, LANES>,
    /// Complex index of refraction of conductors: real part (`ior`) and imaginary part (`extinction`).
    ior: Vec3xN<f32, LANES>,
    extinction: Vec3xN<f32, LANES>,
    f0_f90: F0F90Lanes,
    /// Index of refraction of a dielectric's far side relative to the viewer's side; for a pane, the pane's own index.
    eta: [f32; LANES],
    /// True if the path of the lane may follow both branches of a dielectric.
    pub may_split: [bool; LANES],
}

/// Reflectances for the viewing directions, and the refracted branches of split paths.
#[derive(Debug, Default)]
pub(crate) struct SpecularView {
    local: LocalView,
    reflectance: Vec3xN<f32, LANES>,
    is_split: [bool; LANES],
    transmitted: BsdfSamples,
}

impl LayeredBatchModel for SpecularModel {
    #[inline]
    fn set_layers(&mut self, lane: usize, _: &MaterialHit, stack: &LayerStack) -> bool {
        if !(stack.is_interface_only() && stack.ggx.effectively_smooth()) {
            return false;
        }
        (self.is_conductor[lane], self.uses_schlick[lane], self.is_thin[lane]) = (false, false, false);
        let mut base = stack.transmission;
        match stack.fresnel {
            Fresnel::Conductor { ior, extinction, tint } => {
                self.is_conductor[lane] = true;
                self.any_conductor = true;
                base = tint;
                set_lane(&mut self.ior, lane, ior.to_array());
                set_lane(&mut self.extinction, lane, extinction.to_array());
            }
            Fresnel::Dielectric(eta) | Fresnel::ThinDielectric(eta) => {
                self.any_dielectric = true;
                self.eta[lane] = eta;
                self.is_thin[lane] = matches!(stack.fresnel, Fresnel::ThinDielectric(_));
            }
            Fresnel::Schlick { f0, f90, .. } => {
                self.uses_schlick[lane] = true;
                self.any_schlick = true;
                self.eta[lane] = stack.eta;
                self.f0_f90.set(lane, (f0, f90));
            }
            Fresnel::ThinFilm { .. } => return false,
        }
        set_lane(&mut self.base, lane, base.to_array());
        self.may_split[lane] = false;
        true
    }
}

impl SpecularModel {
    /// Lets the path of a lane follow both branches if the lane's surface reflects and refracts light.
    #[inline]
    pub fn allow_split(&mut self, lane: usize) {
        self.may_split[lane] = !self.is_conductor[lane];
    }

    /// Colour of the light that passes through a lane's surface.
    #[inline(always)]
    pub fn transmission(&self, lane: usize) -> Vec3 {
        if self.is_conductor[lane] { Vec3::ZERO } else { lane_vec3(&self.base, lane) }
    }

    /// Reflectance of every lane at the given cosine.
    #[inline(always)]
    fn reflectance(&self, cosines: &[f32; LANES]) -> Vec3xN<f32, LANES> {
        let mut reflectance = [[0.0; LANES]; 3];
        let mut select = |lane: usize, is_selected: bool, color: Vec3| {
            for (out, color) in reflectance.iter_mut().zip(color.to_array()) {
                out[lane] = if is_selected { color } else { out[lane] };
            }
        };
        if self.any_dielectric {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let once = dielectric(cosine, self.eta[lane]);
                let pane = thin_dielectric(once);
                let all = if self.is_thin[lane] { pane } else { once };
                select(lane, true, Vec3::splat(all));
            }
        }
        if self.any_schlick {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let (f0, f90) = self.f0_f90.get(lane);
                let color = schlick_two_sided(f0, f90, cosine, self.eta[lane]);
                select(lane, self.uses_schlick[lane], color);
            }
        }
        if self.any_conductor {
            for (lane, &cosine) in cosines.iter().enumerate() {
                let (ior, extinction) = (lane_vec3(&self.ior, lane), lane_vec3(&self.extinction, lane));
                let color = lane_vec3(&self.base, lane) * conductors(cosine, ior, extinction);
                select(lane, self.is_conductor[lane], color);
            }
        }
        reflectance
    }

    /// Specular BSDF of a single lane.
    #[inline(always)]
    fn lane(&self, view: &SpecularView, lane: usize) -> SpecularBsdf {
        let is_straight = self.is_conductor[lane] | self.is_thin[lane];
        SpecularBsdf::new(
            view.local.wo(lane),
            lane_vec3(&view.reflectance, lane),
            self.transmission(lane),
            if is_straight { 1.0 } else { self.eta[lane] },
            if self.may_split[lane] { SPLIT_OVERSAMPLING } else { 1.0 },
        )
    }

    #[inline(always)]
    fn sample_branch(&self, view: &SpecularView, context: LaneContext, choice: impl Fn(usize) -> f32) -> BsdfSamples {
        let mut samples = BsdfSamples { is_specular: [true; LANES], ..BsdfSamples::default() };
        for lane in 0..LANES {
            let frame = view.local.frame(context, lane);
            let sample = self.lane(view, lane).sample_branch(&frame, choice(lane));
            samples.is_valid[lane] = sample.is_valid;
            samples.eta_scale[lane] = sample.eta_scale;
            set_lane(&mut samples.weight, lane, sample.weight.to_array());
            samples.set_direction(context, lane, sample.wi);
        }
        samples
    }
}

impl BatchModel for SpecularModel {
    const IS_SPECULAR: bool = true;
    const IS_TRANSMISSIVE: bool = true;

    type View = SpecularView;

    fn clear(&mut self) {
        self.may_split = [false; LANES];
        (self.any_conductor, self.any_dielectric, self.any_schlick) = (false, false, false);
    }

    #[inline(always)]
    fn prepare_view(&self, lanes: &ActiveLanes, context: LaneContext, randoms: LaneRandoms) -> SpecularView {
        let local = LocalView::new(lanes, context);
        let mut view = SpecularView {
            reflectance: self.reflectance(local.cosines()),
            local,
            is_split: [false; LANES],
            transmitted: BsdfSamples::default(),
        };
        if self.may_split != [false; LANES] {
            for lane in 0..LANES {
                let bsdf = self.lane(&view, lane);
                view.is_split[lane] = self.may_split[lane] & bsdf.is_split(randoms.lobe[lane]);
            }
            view.transmitted = self.sample_branch(&view, context, |_| FORCE_TRANSMISSION);
        }
        view
    }

    #[inline(always)]
    fn sample(&self, view: &SpecularView, _: &ActiveLanes, context: LaneContext, randoms: LaneRandoms) -> BsdfSamples {
        self.sample_branch(view, context, |lane| randoms.lobe[lane])
    }

    fn eval(&self, _: &SpecularView, _: &ActiveLanes, _: LaneContext, _: &Vec3xN<f32, LANES>) -> BsdfEvals {
        BsdfEvals::default()
    }

    fn is_transmissive(&self, lane: usize) -> bool {
        self.transmission(lane) != Vec3::ZERO
    }

    #[inline]
    fn transmitted_sample(view: &SpecularView, lane: usize) -> Option<(BsdfSample, Vec3)> {
        view.is_split[lane].then(|| view.transmitted.get(lane))?
    }
}

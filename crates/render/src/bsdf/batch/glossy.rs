//! Rough conductors and glTF's principled material for many points at once, including clear coats and sheens.

use glam::Vec3;

use crate::bsdf::BsdfEval;
use crate::bsdf::batch::clearcoat::ClearcoatLanes;
use crate::bsdf::batch::{
    ActiveLanes, BatchModel, BsdfEvals, BsdfSamples, F0F90Lanes, LaneContext, LaneRandoms, LayeredBatchModel, LocalView,
};
use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::layered::base_lobe;
use crate::bsdf::material_hit::MaterialHit;
use crate::lobes::albedo_tables::{Albedo, AlbedoRow, albedo_tables, multi_scatter_color, multi_scatter_lobe};
use crate::lobes::fresnel::{Fresnel, conductors, schlick};
use crate::lobes::ggx::{Ggx, MicrofacetEval};
use crate::lobes::mean_color::mean;
use crate::lobes::shading_frame::{cosine_hemisphere_pdf, sample_cosine_hemisphere};
use crate::lobes::sheen::Sheen;
use crate::soa::{LANES, Vec3xN, lane_vec3, set_lane};

/// BSDFs of lanes whose materials have an isotropic rough interface over a diffuse base.
#[derive(Debug, Default)]
pub(crate) struct GlossyModel {
    is_conductor: [bool; LANES],
    any_conductor: bool,
    alpha: [f32; LANES],
    /// Reflectance of the interface, and the reflectance by which the interface dims the base. For conductors, both are
    /// the tint.
    f0_f90: F0F90Lanes,
    base_f0_f90: F0F90Lanes,
    /// Albedo of the diffuse base.
    diffuse: Vec3xN<f32, LANES>,
    /// Complex index of refraction of conductors: real part (`ior`) and imaginary part (`extinction`).
    ior: Vec3xN<f32, LANES>,
    extinction: Vec3xN<f32, LANES>,
    coat: ClearcoatLanes,
    /// Sheens of the lanes. They are evaluated one lane at a time, because power functions take most of their time.
    sheen: [Option<Sheen>; LANES],
    any_sheen: bool,
}

/// Terms that depend only on the viewing direction.
#[derive(Debug, Default)]
pub(crate) struct GlossyView {
    local: LocalView,
    /// Energy loss of the interface for light from `wo`, its mean albedo, and the colour of its multi-scatter lobe.
    energy_loss: [f32; LANES],
    mean_albedo: [f32; LANES],
    multi_scatter: Vec3xN<f32, LANES>,
    /// Fraction of light that the interface passes to the base: from `wo`, and the mean over all directions.
    base_transmittance: [f32; LANES],
    mean_base_transmittance: [f32; LANES],
    /// Directions towards the viewer in the coats' local frames, and the coats' albedos for these directions.
    coat_wo: Vec3xN<f32, LANES>,
    coat_albedo: [f32; LANES],
    /// Probabilities of the interface, the base and the coat.
    lobe_probabilities: [[f32; LANES]; 3],
}

impl LayeredBatchModel for GlossyModel {
    #[inline]
    fn set_layers(&mut self, lane: usize, _: &MaterialHit, stack: &LayerStack) -> bool {
        if stack.ggx.effectively_smooth() {
            return false;
        }
        self.is_conductor[lane] = false;
        if let Fresnel::Conductor { ior, extinction, .. } = stack.fresnel {
            self.is_conductor[lane] = true;
            self.any_conductor = true;
            set_lane(&mut self.ior, lane, ior.to_array());
            set_lane(&mut self.extinction, lane, extinction.to_array());
        }
        // The f0 of conductors is computed for all lanes at once.
        let f0_f90 = |fresnel: &Fresnel| match *fresnel {
            Fresnel::Conductor { tint, .. } => (tint, tint),
            ref fresnel => fresnel.f0_f90(),
        };
        self.f0_f90.set(lane, f0_f90(&stack.fresnel));
        self.base_f0_f90.set(lane, f0_f90(&stack.base_fresnel));
        set_lane(&mut self.diffuse, lane, stack.diffuse.to_array());
        self.alpha[lane] = stack.ggx.alpha_x;
        self.coat.set(lane, stack.coat.as_ref());
        self.sheen[lane] = stack.sheen;
        self.any_sheen |= stack.sheen.is_some();
        true
    }
}

impl GlossyModel {
    #[inline(always)]
    fn ggx(&self, lane: usize) -> Ggx {
        Ggx::from_alpha(self.alpha[lane])
    }

    /// Reflectance of every lane's interface at the given cosine.
    #[inline(always)]
    fn reflectance(&self, cosines: &[f32; LANES]) -> Vec3xN<f32, LANES> {
        let mut reflectance = [[0.0; LANES]; 3];
        for (lane, &cosine) in cosines.iter().enumerate() {
            let (f0, f90) = self.f0_f90.get(lane);
            set_lane(&mut reflectance, lane, schlick(f0, f90, cosine).to_array());
        }
        self.select_conductors(&mut reflectance, cosines);
        reflectance
    }

    /// Reflectance of every lane's interface at normal incidence.
    #[inline(always)]
    fn f0(&self) -> Vec3xN<f32, LANES> {
        let mut f0 = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            set_lane(&mut f0, lane, self.f0_f90.get(lane).0.to_array());
        }
        self.select_conductors(&mut f0, &[1.0; LANES]);
        f0
    }

    /// In the lanes of conductors, replaces `out` by the conductors' reflectance at the given cosines.
    #[inline(always)]
    fn select_conductors(&self, out: &mut Vec3xN<f32, LANES>, cosines: &[f32; LANES]) {
        if !self.any_conductor {
            return;
        }
        for (lane, &cosine) in cosines.iter().enumerate() {
            let (ior, extinction) = (lane_vec3(&self.ior, lane), lane_vec3(&self.extinction, lane));
            let (_, tint) = self.f0_f90.get(lane);
            let color = (tint * conductors(cosine, ior, extinction)).to_array();
            for (out, color) in out.iter_mut().zip(color) {
                out[lane] = if self.is_conductor[lane] { color } else { out[lane] };
            }
        }
    }

    /// Samples the coat in the lanes whose random number selects the coat.
    #[inline(always)]
    fn sample_coat(&self, view: &GlossyView, context: LaneContext, randoms: LaneRandoms, samples: &mut BsdfSamples) {
        for lane in 0..LANES {
            let [specular, diffuse, coat] = view.probabilities(lane);
            let rest = randoms.lobe[lane] - specular;
            if (rest >= 0.0) & (rest >= diffuse) & (coat > 0.0) {
                let wo = lane_vec3(&view.coat_wo, lane);
                let random = randoms.direction_of(lane);
                let sample = self.coat.get(context, lane).sample(wo, random, coat);
                samples.is_valid[lane] = sample.is_valid;
                samples.is_specular[lane] = sample.is_specular;
                set_lane(&mut samples.weight, lane, [sample.weight; 3]);
                samples.set_direction(context, lane, sample.wi);
            }
        }
    }

    /// Adds the sheen, and dims the layers below.
    #[inline(always)]
    fn apply_sheen(
        &self,
        view: &GlossyView,
        (wi, is_above): (&Vec3xN<f32, LANES>, &[bool; LANES]),
        evals: &mut BsdfEvals,
    ) {
        for (lane, sheen) in self.sheen.iter().enumerate() {
            let Some(sheen) = sheen.filter(|_| is_above[lane]) else {
                continue;
            };
            let (wo, wi) = (view.local.wo(lane), lane_vec3(wi, lane));
            let passed = sheen.base_transmittance(wo.z).min(sheen.base_transmittance(wi.z));
            let value = lane_vec3(&evals.value, lane) * passed + sheen.eval(wo, wi);
            set_lane(&mut evals.value, lane, value.to_array());
        }
    }

    /// Adds the coat, and dims the layers below. `is_reflected` is true for directions on the viewer's side
    /// of the surface; such a direction may still be below the horizon of the mapped normal.
    #[inline(always)]
    fn apply_coat(
        &self,
        view: &GlossyView,
        context: LaneContext,
        (wi, is_reflected): (&Vec3xN<f32, LANES>, &[bool; LANES]),
        evals: &mut BsdfEvals,
    ) {
        let (mut values, mut pdfs) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let coat = self.coat.get(context, lane);
            let (value, pdf) = coat.eval(lane_vec3(&view.coat_wo, lane), lane_vec3(wi, lane));
            let is_active = self.coat.is_active[lane];
            values[lane] = if is_active { value } else { 0.0 };
            pdfs[lane] = if is_active { pdf } else { 0.0 };
        }
        for lane in 0..LANES {
            let passed = 1.0 - view.coat_albedo[lane];
            let eval = BsdfEval {
                value: lane_vec3(&evals.value, lane) * passed + values[lane],
                pdf: evals.pdf[lane] + pdfs[lane] * view.lobe_probabilities[2][lane],
            };
            evals.set(lane, is_reflected[lane], eval);
        }
    }
}

impl GlossyView {
    #[inline(always)]
    fn probabilities(&self, lane: usize) -> [f32; 3] {
        let [specular, diffuse, coat] = &self.lobe_probabilities;
        [specular[lane], diffuse[lane], coat[lane]]
    }
}

impl BatchModel for GlossyModel {
    const MAY_EMIT: bool = true;

    type View = GlossyView;

    fn clear(&mut self) {
        (self.any_conductor, self.any_sheen) = (false, false);
        self.coat.any_active = false;
    }

    #[inline(always)]
    fn prepare_view(&self, lanes: &ActiveLanes, context: LaneContext, _: LaneRandoms) -> GlossyView {
        let tables = albedo_tables();
        let mut view = GlossyView { local: LocalView::new(lanes, context), ..GlossyView::default() };
        let cosines = *view.local.cosines();
        let f0 = self.f0();
        let mut sheen_albedo = [[0.0; LANES]; 3];
        if self.any_sheen {
            for (lane, sheen) in self.sheen.iter().enumerate() {
                let albedo = sheen.map_or(Vec3::ZERO, |sheen| sheen.albedo_color(cosines[lane]));
                set_lane(&mut sheen_albedo, lane, albedo.to_array());
            }
        }
        if self.coat.any_active {
            for lane in 0..LANES {
                let wo = self.coat.get(context, lane).wo();
                set_lane(&mut view.coat_wo, lane, wo.to_array());
            }
            for lane in 0..LANES {
                let coat = self.coat.get(context, lane);
                let albedo = coat.albedo(tables, view.coat_wo[2][lane]);
                view.coat_albedo[lane] = if self.coat.is_active[lane] { albedo } else { 0.0 };
            }
        }
        let reflectance = self.reflectance(&cosines);
        let (mut albedos, mut means) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
        for lane in 0..LANES {
            let row = AlbedoRow::new(&self.ggx(lane));
            [albedos[0][lane], albedos[1][lane]] = row.albedo_at(tables, cosines[lane]);
            [means[0][lane], means[1][lane]] = row.mean_albedo(tables);
        }
        for lane in 0..LANES {
            let albedo = [albedos[0][lane], albedos[1][lane]];
            let means = [means[0][lane], means[1][lane]];
            let (_, f90) = self.f0_f90.get(lane);
            let f0_f90 = (lane_vec3(&f0, lane), f90);
            let base = self.base_f0_f90.get(lane);
            let own = Albedo::new(f0_f90, albedo, means[0]);
            let passed = Albedo::new(base, albedo, means[0]).base_transmittance().max(0.0);
            let loss = 1.0 - albedo[0];
            let conductor = lane_vec3(&reflectance, lane) * (1.0 - loss);
            let single = if self.is_conductor[lane] { conductor } else { own.single_scatter };
            let diffuse = lane_vec3(&self.diffuse, lane);
            let below = own.multi_scatter + diffuse * passed + lane_vec3(&sheen_albedo, lane);
            let weights = [mean(single), mean(below)];
            let (sum, coat) = (weights[0] + weights[1], view.coat_albedo[lane]);
            let scale = if sum > 0.0 { (1.0 - coat) / sum } else { 0.0 };
            let all = if coat > 0.0 { 1.0 } else { 0.0 };
            view.lobe_probabilities[0][lane] = weights[0] * scale;
            view.lobe_probabilities[1][lane] = weights[1] * scale;
            view.lobe_probabilities[2][lane] = if sum > 0.0 { coat } else { all };
            view.energy_loss[lane] = loss;
            view.mean_albedo[lane] = means[0];
            let multi_scatter = multi_scatter_color(f0_f90, means[0]);
            set_lane(&mut view.multi_scatter, lane, multi_scatter.to_array());
            view.base_transmittance[lane] = passed;
            view.mean_base_transmittance[lane] = Albedo::new(base, means, means[0]).base_transmittance().max(1e-6);
        }
        view
    }

    #[inline(always)]
    fn sample(
        &self,
        view: &GlossyView,
        lanes: &ActiveLanes,
        context: LaneContext,
        randoms: LaneRandoms,
    ) -> BsdfSamples {
        let mut samples = BsdfSamples::default();
        for lane in 0..LANES {
            let wo = view.local.wo(lane);
            let [specular, diffuse, _] = view.probabilities(lane);
            let random = randoms.direction_of(lane);
            // A lobe with a zero probability is never selected, as in `LayeredBsdf`.
            let is_specular = (randoms.lobe[lane] < specular) | (diffuse == 0.0);
            let wm = self.ggx(lane).sample_wm(wo, random);
            let reflected = 2.0 * wo.dot(wm) * wm - wo;
            samples.is_valid[lane] = if is_specular { (reflected.z > 0.0) & (specular > 0.0) } else { true };
            let wi = if is_specular { reflected } else { sample_cosine_hemisphere(random) };
            let wi = view.local.frame(context, lane).to_world(wi);
            samples.set_direction(context, lane, wi);
        }
        if self.coat.any_active {
            self.sample_coat(view, context, randoms, &mut samples);
        }
        samples.set_evals(&self.eval(view, lanes, context, &samples.wi));
        samples
    }

    #[inline(always)]
    fn eval(
        &self,
        view: &GlossyView,
        _: &ActiveLanes,
        context: LaneContext,
        wi_world: &Vec3xN<f32, LANES>,
    ) -> BsdfEvals {
        let tables = albedo_tables();
        let (mut wi, mut is_above, mut is_reflected) = ([[0.0; LANES]; 3], [false; LANES], [false; LANES]);
        let (mut albedos, mut cosines) = ([[0.0; LANES]; 2], [0.0; LANES]);
        let (mut weights, mut pdfs) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let direction = lane_vec3(wi_world, lane);
            let local = view.local.frame(context, lane).to_local(direction);
            let geometric = context.interactions.side_normal(lane);
            is_reflected[lane] = geometric.dot(direction) > 0.0;
            is_above[lane] = is_reflected[lane] & (local.z > 0.0);
            set_lane(&mut wi, lane, local.to_array());
        }
        for lane in 0..LANES {
            let row = AlbedoRow::new(&self.ggx(lane));
            [albedos[0][lane], albedos[1][lane]] = row.albedo_at(tables, wi[2][lane]);
        }
        for lane in 0..LANES {
            let (wo, wi) = (view.local.wo(lane), lane_vec3(&wi, lane));
            let facets = MicrofacetEval::reflection(&self.ggx(lane), wo, wi);
            cosines[lane] = facets.cosine;
            (weights[lane], pdfs[lane]) = (facets.weight, facets.pdf);
        }
        let reflectance = self.reflectance(&cosines);
        let mut evals = BsdfEvals::default();
        for lane in 0..LANES {
            let cosine = wi[2][lane];
            let albedo = [albedos[0][lane], albedos[1][lane]];
            let mean_albedo = view.mean_albedo[lane];
            let losses = [view.energy_loss[lane], 1.0 - albedo[0]];
            let multi_scatter = lane_vec3(&view.multi_scatter, lane);
            let multi = multi_scatter_lobe(multi_scatter, losses, 1.0 - mean_albedo, cosine);
            let passed = Albedo::new(self.base_f0_f90.get(lane), albedo, mean_albedo).base_transmittance().max(0.0);
            let mean_transmittance = view.mean_base_transmittance[lane];
            let from_wo = view.base_transmittance[lane];
            let base = base_lobe(from_wo, passed, mean_transmittance, cosine);
            let single = lane_vec3(&reflectance, lane) * weights[lane];
            let [specular, diffuse, _] = view.probabilities(lane);
            let eval = BsdfEval {
                value: single + multi + lane_vec3(&self.diffuse, lane) * base,
                pdf: cosine_hemisphere_pdf(cosine) * diffuse + pdfs[lane] * specular,
            };
            evals.set(lane, is_above[lane], eval);
        }
        if self.any_sheen {
            self.apply_sheen(view, (&wi, &is_above), &mut evals);
        }
        if self.coat.any_active {
            self.apply_coat(view, context, (wi_world, &is_reflected), &mut evals);
        }
        evals
    }
}

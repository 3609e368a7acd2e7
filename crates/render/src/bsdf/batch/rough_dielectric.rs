//! Rough glass of many points, and glTF's principled material if it has no diffuse base.

use glam::Vec3;

use crate::bsdf::BsdfEval;
use crate::bsdf::batch::{
    ActiveLanes, BatchModel, BsdfEvals, BsdfSamples, F0F90Lanes, LaneContext, LaneRandoms, LayeredBatchModel, LocalView,
};
use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::layered::reflect_probability;
use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::multiscatter_dielectric::MultiscatterTerms;
use crate::lobes::albedo_dielectric::EnergyLoss;
use crate::lobes::albedo_tables::{Albedo, AlbedoRow, albedo_tables, multi_scatter_color, multi_scatter_lobe};
use crate::lobes::fresnel::{Fresnel, dielectric, refract_unchecked, schlick, thinner_side_cosine};
use crate::lobes::ggx::{Ggx, MicrofacetEval};
use crate::lobes::mean_color::mean;
use crate::lobes::shading_frame::{cosine_hemisphere_pdf, sample_cosine_hemisphere};
use crate::prepare::geometry::Geometry;
use crate::soa::{LANES, Vec3xN, lane_vec3, set_lane};

/// Isotropic rough refracting interfaces without other layers.
#[derive(Debug, Default)]
pub(crate) struct RoughDielectricModel {
    /// Index of refraction of the far side relative to the viewer's side.
    eta: [f32; LANES],
    /// True for Fresnel's equations, false for Schlick's approximation.
    is_exact: [bool; LANES],
    alpha: [f32; LANES],
    /// Reflectance of the interface, and the reflectance by which the interface dims the far side.
    f0_f90: F0F90Lanes,
    base_f0_f90: F0F90Lanes,
    /// Colour of refracted light.
    transmission: Vec3xN<f32, LANES>,
    /// Index into the world's materials.
    material: [u32; LANES],
}

/// Terms that depend only on the viewing direction.
#[derive(Debug, Default)]
pub(crate) struct RoughDielectricView {
    local: LocalView,
    /// For reflection without refraction: the energy loss for light from `wo`, the mean albedo, and the colour of the
    /// multi-scatter lobe.
    energy_loss: [f32; LANES],
    mean_albedo: [f32; LANES],
    multi_scatter: Vec3xN<f32, LANES>,
    /// Fields of [`crate::bsdf::multiscatter_dielectric::MultiscatterDielectric`], one value per lane.
    has_multiscatter: [bool; LANES],
    compensation: Vec3xN<f32, LANES>,
    view_loss: Vec3xN<f32, LANES>,
    mean_loss: Vec3xN<f32, LANES>,
    /// Probabilities of sampling a single scattering, the multi-scatter lobe on the viewer's side, and the
    /// multi-scatter lobe on the far side.
    lobe_probabilities: [[f32; LANES]; 3],
}

/// Albedos and energy losses of the lanes for their viewing directions, from the tables.
struct ViewLosses {
    /// Albedo of a single reflection and of a single refraction, averaged over the colours.
    single_scatter: [[f32; LANES]; 2],
    loss: Vec3xN<f32, LANES>,
    /// Mean energy loss on the viewer's side and on the far side.
    mean_loss: [Vec3xN<f32, LANES>; 2],
}

/// [`MicrofacetEval`] of every lane, field by field.
#[derive(Default)]
struct FacetLanes {
    cosines: [f32; LANES],
    weights: [f32; LANES],
    pdfs: [f32; LANES],
}

/// The energy loss table that was last used, with its material and roughness; most neighbouring lanes use the same
/// table.
type CachedLoss<'a> = Option<(u32, f32, EnergyLoss<'a>)>;

impl LayeredBatchModel for RoughDielectricModel {
    #[inline]
    fn set_layers(&mut self, lane: usize, hit: &MaterialHit, stack: &LayerStack) -> bool {
        let is_exact = match (&stack.fresnel, &stack.base_fresnel) {
            (Fresnel::Dielectric(_), Fresnel::Dielectric(_)) => true,
            (Fresnel::Schlick { .. }, Fresnel::Schlick { .. }) => false,
            _ => return false,
        };
        let is_covered = !stack.ggx.effectively_smooth()
            && stack.ggx.is_isotropic()
            && stack.transmission != Vec3::ZERO
            && stack.is_interface_only()
            && stack.eta != 1.0
            && stack.dielectric_albedo.is_some_and(|table| table.matches_eta(stack.eta));
        if is_covered {
            self.eta[lane] = stack.eta;
            self.is_exact[lane] = is_exact;
            self.alpha[lane] = stack.ggx.alpha_x;
            self.f0_f90.set(lane, stack.fresnel.f0_f90());
            self.base_f0_f90.set(lane, stack.base_fresnel.f0_f90());
            set_lane(&mut self.transmission, lane, stack.transmission.to_array());
            let material = hit.geometry.material_index(hit.hit.instance, hit.hit.triangle);
            self.material[lane] = material as u32;
        }
        is_covered
    }
}

impl RoughDielectricModel {
    #[inline(always)]
    fn ggx(&self, lane: usize) -> Ggx {
        Ggx::from_alpha(self.alpha[lane])
    }

    #[inline(always)]
    fn transmission(&self, lane: usize) -> Vec3 {
        lane_vec3(&self.transmission, lane)
    }

    /// True if the isotropic albedo table contains the reflection: Schlick's approximation, seen from the side with the
    /// lower index of refraction.
    #[inline(always)]
    fn uses_table(&self, lane: usize) -> bool {
        !self.is_exact[lane] & (self.eta[lane] >= 1.0)
    }

    /// Reflectance of the interfaces at these cosines, and the reflectance by which the interfaces dim the far side.
    #[inline(always)]
    fn reflectances(&self, cosines: &[f32; LANES]) -> [Vec3xN<f32, LANES>; 2] {
        let mut reflectances = [[[0.0; LANES]; 3]; 2];
        for (lane, &cosine) in cosines.iter().enumerate() {
            let eta = self.eta[lane];
            let exact = Vec3::splat(dielectric(cosine, eta));
            let (cosine, is_total) = thinner_side_cosine(cosine, eta);
            let ends = [self.f0_f90.get(lane), self.base_f0_f90.get(lane)];
            for (out, (f0, f90)) in reflectances.iter_mut().zip(ends) {
                let approximate = schlick(f0, f90, cosine);
                let approximate = if is_total { Vec3::ONE } else { approximate };
                let color = if self.is_exact[lane] { exact } else { approximate };
                set_lane(out, lane, color.to_array());
            }
        }
        reflectances
    }

    /// Energy loss of light at these cosines, on the viewer's side or the far side, for some of the lanes.
    #[inline(always)]
    fn energy_loss(
        &self,
        geometry: &Geometry,
        lanes: impl Iterator<Item = usize>,
        is_far_side: &[bool; LANES],
        cosines: &[f32; LANES],
    ) -> Vec3xN<f32, LANES> {
        let mut loss = [[0.0; LANES]; 3];
        let mut cached = None;
        for lane in lanes {
            let is_inside = self.eta[lane] < 1.0;
            let table = self.loss_table(geometry, lane, &mut cached);
            let ends = self.base_f0_f90.get(lane);
            let [up, down] = table.albedo(is_inside != is_far_side[lane], cosines[lane], ends);
            set_lane(&mut loss, lane, (Vec3::ONE - up - down).to_array());
        }
        loss
    }

    /// Albedos and energy losses of the active lanes for these cosines of `wo`, from the tables.
    #[inline(always)]
    fn view_losses(&self, geometry: &Geometry, is_active: &[bool; LANES], cosines: &[f32; LANES]) -> ViewLosses {
        let mut losses = ViewLosses {
            single_scatter: [[0.0; LANES]; 2],
            loss: [[0.0; LANES]; 3],
            mean_loss: [[[0.0; LANES]; 3]; 2],
        };
        let mut cached = None;
        for lane in (0..LANES).filter(|&lane| is_active[lane]) {
            let (is_inside, ends) = (self.eta[lane] < 1.0, self.base_f0_f90.get(lane));
            let table = self.loss_table(geometry, lane, &mut cached);
            let [up, down] = table.albedo(is_inside, cosines[lane], ends);
            for (out, albedo) in losses.single_scatter.iter_mut().zip([up, down]) {
                out[lane] = mean(albedo);
            }
            set_lane(&mut losses.loss, lane, (Vec3::ONE - up - down).to_array());
            for (out, side) in losses.mean_loss.iter_mut().zip([is_inside, !is_inside]) {
                set_lane(out, lane, table.mean_loss(side, ends).to_array());
            }
        }
        losses
    }

    /// Evaluates the microfacets that reflect or refract light from the local directions `wi`.
    #[inline(always)]
    fn eval_microfacets(
        &self,
        view: &RoughDielectricView,
        wi: &Vec3xN<f32, LANES>,
        is_reflection: &[bool; LANES],
    ) -> FacetLanes {
        let mut lanes = FacetLanes::default();
        for lane in 0..LANES {
            let (wo, wi, ggx) = (view.local.wo(lane), lane_vec3(wi, lane), self.ggx(lane));
            let reflection = MicrofacetEval::reflection(&ggx, wo, wi);
            let refraction = MicrofacetEval::refraction(&ggx, self.eta[lane], wo, wi);
            let facets = if is_reflection[lane] { reflection } else { refraction };
            lanes.cosines[lane] = facets.cosine;
            (lanes.weights[lane], lanes.pdfs[lane]) = (facets.weight, facets.pdf);
        }
        lanes
    }

    #[inline(always)]
    fn loss_table<'a>(&self, geometry: &'a Geometry, lane: usize, cached: &mut CachedLoss<'a>) -> EnergyLoss<'a> {
        let key = (self.material[lane], self.alpha[lane]);
        match *cached {
            Some((material, alpha, table)) if (material, alpha) == key => table,
            _ => {
                // Lanes without dispersion have a single table for all colours.
                let tables = &geometry.materials[key.0 as usize].dielectric_tables;
                let table = tables[0].at_roughness(&self.ggx(lane));
                *cached = Some((key.0, key.1, table));
                table
            }
        }
    }
}

impl RoughDielectricView {
    #[inline(always)]
    fn probabilities(&self, lane: usize) -> [f32; 3] {
        let [single, up, down] = &self.lobe_probabilities;
        [single[lane], up[lane], down[lane]]
    }

    /// Value of a lane's multi-scatter lobe for light from `wi`. `loss` is the energy that a single reflection or
    /// refraction loses; `reflected` is the loss of an interface that only reflects.
    #[inline(always)]
    fn eval_multiscatter(&self, lane: usize, loss: Vec3, reflected: f32, cosine: f32) -> Vec3 {
        let terms = MultiscatterTerms {
            view_loss: lane_vec3(&self.view_loss, lane),
            mean_loss: lane_vec3(&self.mean_loss, lane),
            reflected_fraction: 0.0,
            is_significant: true,
        };
        let compensation = lane_vec3(&self.compensation, lane);
        let value = terms.eval((loss - compensation * reflected).max(Vec3::ZERO), cosine);
        if self.has_multiscatter[lane] { value } else { Vec3::ZERO }
    }
}

impl BatchModel for RoughDielectricModel {
    const IS_TRANSMISSIVE: bool = true;
    const MAY_EMIT: bool = true;

    type View = RoughDielectricView;

    #[inline(always)]
    fn prepare_view(&self, lanes: &ActiveLanes, context: LaneContext, _: LaneRandoms) -> RoughDielectricView {
        let tables = albedo_tables();
        let mut view = RoughDielectricView { local: LocalView::new(lanes, context), ..RoughDielectricView::default() };
        let cosines = *view.local.cosines();
        let (mut albedos, mut means) = ([[0.0; LANES]; 2], [0.0; LANES]);
        for lane in 0..LANES {
            let row = AlbedoRow::new(&self.ggx(lane));
            [albedos[0][lane], albedos[1][lane]] = row.albedo_at(tables, cosines[lane]);
            [means[lane], _] = row.mean_albedo(tables);
        }
        let [reflectance, base_reflectance] = self.reflectances(&cosines);
        let losses = self.view_losses(context.geometry, &lanes.is_active, &cosines);
        for lane in 0..LANES {
            let (albedo, mean_albedo) = ([albedos[0][lane], albedos[1][lane]], means[lane]);
            let reflected = 1.0 - albedo[0];
            let own = Albedo::new(self.f0_f90.get(lane), albedo, mean_albedo);
            let compensation = multi_scatter_color(self.base_f0_f90.get(lane), mean_albedo);
            let net = |loss: &Vec3xN<f32, LANES>, reflected: f32| {
                (lane_vec3(loss, lane) - compensation * reflected).max(Vec3::ZERO)
            };
            let sides = [net(&losses.mean_loss[0], 1.0 - mean_albedo), net(&losses.mean_loss[1], 1.0 - mean_albedo)];
            let view_loss = net(&losses.loss, reflected);
            let terms = MultiscatterTerms::new(view_loss, sides, self.eta[lane]);
            let [up, down] = if terms.is_significant { terms.lobe_probabilities() } else { [0.0; 2] };
            let passed = mean(self.transmission(lane));
            let single = if self.uses_table(lane) {
                own.single_scatter
            } else {
                lane_vec3(&reflectance, lane) * (1.0 - reflected)
            };
            let by_angle = [mean(single), 1.0 - mean(lane_vec3(&base_reflectance, lane))];
            let by_table = [losses.single_scatter[0][lane], losses.single_scatter[1][lane]];
            let [single, below] = if terms.is_significant { by_table } else { by_angle };
            let weights = [single + passed * below, mean(own.multi_scatter) + passed * up, passed * down];
            let sum = weights[0] + weights[1] + weights[2];
            let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
            for (probabilities, weight) in view.lobe_probabilities.iter_mut().zip(weights) {
                probabilities[lane] = weight * scale;
            }
            view.has_multiscatter[lane] = terms.is_significant;
            view.energy_loss[lane] = reflected;
            view.mean_albedo[lane] = mean_albedo;
            let multi_scatter = multi_scatter_color(self.f0_f90.get(lane), mean_albedo);
            set_lane(&mut view.multi_scatter, lane, multi_scatter.to_array());
            set_lane(&mut view.compensation, lane, compensation.to_array());
            set_lane(&mut view.view_loss, lane, terms.view_loss.to_array());
            set_lane(&mut view.mean_loss, lane, terms.mean_loss.to_array());
        }
        view
    }

    #[inline(always)]
    fn sample(
        &self,
        view: &RoughDielectricView,
        lanes: &ActiveLanes,
        context: LaneContext,
        randoms: LaneRandoms,
    ) -> BsdfSamples {
        let (mut facets, mut cosines) = ([[0.0; LANES]; 3], [0.0; LANES]);
        for lane in 0..LANES {
            let wo = view.local.wo(lane);
            let wm = self.ggx(lane).sample_wm(wo, randoms.direction_of(lane));
            cosines[lane] = wo.dot(wm);
            set_lane(&mut facets, lane, wm.to_array());
        }
        let [reflectance, base_reflectance] = self.reflectances(&cosines);
        let mut samples = BsdfSamples::default();
        for lane in 0..LANES {
            let (wo, wm, eta) = (view.local.wo(lane), lane_vec3(&facets, lane), self.eta[lane]);
            let [single, up, down] = view.probabilities(lane);
            // A lobe with a zero probability is never selected, as in `LayeredBsdf`.
            let choice = randoms.lobe[lane];
            let (second, third) = (choice - single, choice - single - up);
            let is_down = (choice >= single) & (second >= up) & (down > 0.0);
            let is_up = (choice >= single) & !is_down & (up > 0.0);
            let is_single = !is_up & !is_down;
            let rest = if choice < single {
                choice
            } else {
                // The last lobe is also selected if `choice` exceeds the sum of all probabilities by rounding
                // errors.
                third - down
            };
            let refracted = Vec3::ONE - lane_vec3(&base_reflectance, lane);
            let refracted = refracted * self.transmission(lane);
            let probability = reflect_probability(lane_vec3(&reflectance, lane), refracted);
            let is_reflection = rest < probability * single;
            let reflection = 2.0 * cosines[lane] * wm - wo;
            let (refraction, is_refracted) = refract_unchecked(wo, wm, eta);
            let diffuse = sample_cosine_hemisphere(randoms.direction_of(lane));
            let (facet, is_valid) =
                if is_reflection { (reflection, reflection.z > 0.0) } else { (refraction, is_refracted) };
            let wi = if is_single {
                facet
            } else if is_up {
                diffuse
            } else {
                -diffuse
            };
            let wi = view.local.frame(context, lane).to_world(wi);
            let is_transmission = context.interactions.side_normal(lane).dot(wi) < 0.0;
            samples.is_valid[lane] = !is_single | (is_valid & (single > 0.0));
            samples.eta_scale[lane] = if is_transmission { eta * eta } else { 1.0 };
            samples.set_direction(context, lane, wi);
        }
        samples.set_evals(&self.eval(view, lanes, context, &samples.wi));
        samples
    }

    #[inline(always)]
    fn eval(
        &self,
        view: &RoughDielectricView,
        lanes: &ActiveLanes,
        context: LaneContext,
        wi_world: &Vec3xN<f32, LANES>,
    ) -> BsdfEvals {
        let tables = albedo_tables();
        let mut wi = [[0.0; LANES]; 3];
        let (mut is_reflection, mut is_lit) = ([false; LANES], [false; LANES]);
        for lane in 0..LANES {
            let direction = lane_vec3(wi_world, lane);
            let local = view.local.frame(context, lane).to_local(direction);
            let geometric = context.interactions.side_normal(lane);
            is_reflection[lane] = geometric.dot(direction) > 0.0;
            is_lit[lane] = (is_reflection[lane] == (local.z > 0.0)) & (local.z != 0.0);
            set_lane(&mut wi, lane, local.to_array());
        }
        let (mut reflected, mut heights) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            heights[lane] = wi[2][lane].abs();
            let row = AlbedoRow::new(&self.ggx(lane));
            reflected[lane] = 1.0 - row.albedo_at(tables, heights[lane])[0];
        }
        let is_far_side: [bool; LANES] = std::array::from_fn(|lane| wi[2][lane] < 0.0);
        let with_loss = (0..LANES).filter(|&lane| lanes.is_active[lane] & is_lit[lane] & view.has_multiscatter[lane]);
        let losses = self.energy_loss(context.geometry, with_loss, &is_far_side, &heights);
        let facets = self.eval_microfacets(view, &wi, &is_reflection);
        let [reflectance, base_reflectance] = self.reflectances(&facets.cosines);
        let mut evals = BsdfEvals::default();
        for lane in 0..LANES {
            let is_reflection = is_reflection[lane];
            let reflectance = lane_vec3(&reflectance, lane);
            let refracted = Vec3::ONE - lane_vec3(&base_reflectance, lane);
            let refracted = refracted * self.transmission(lane);
            let probability = reflect_probability(reflectance, refracted);
            let multi = multi_scatter_lobe(
                lane_vec3(&view.multi_scatter, lane),
                [view.energy_loss[lane], reflected[lane]],
                1.0 - view.mean_albedo[lane],
                wi[2][lane],
            );
            let between = view.eval_multiscatter(lane, lane_vec3(&losses, lane), reflected[lane], heights[lane]);
            let between = between * self.transmission(lane);
            let single = if is_reflection { reflectance } else { refracted } * facets.weights[lane];
            let value = if is_reflection { single + multi + between } else { between + single };
            let [specular, up, down] = view.probabilities(lane);
            let [many, one] =
                if is_reflection { [up, probability * specular] } else { [down, (1.0 - probability) * specular] };
            let pdf = cosine_hemisphere_pdf(heights[lane]) * many + facets.pdfs[lane] * one;
            evals.set(lane, is_lit[lane], BsdfEval { value, pdf });
        }
        evals
    }
}

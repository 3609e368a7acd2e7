//! Rough glass, and glTF's principled material where it lets all light in, many points at a time, field by field: what
//! [`Layered`](crate::bsdf::Layered) does one by one.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{Material, MaterialModel};

use crate::bsdf::batch::rough_dielectric_params::RoughDielectricParams;
use crate::bsdf::batch::rough_dielectric_sample::Goes;
use crate::bsdf::dielectric;
use crate::bsdf::principled::{TextureLookup, ViewContext};
use crate::bsdf::specular::is_smooth;
use crate::bsdf::{BsdfEvals, BsdfSample, principled};
use crate::interaction::batch::SurfaceInteractions;
use crate::lobes::albedo_tables::{
    Albedo, AlbedoRow, AlbedoTables, albedo_tables, multi_scatter_color,
};
use crate::lobes::ggx::MicrofacetEval;
use crate::lobes::shading_frame::{ShadingFrame, cosine_hemisphere_pdf};
use crate::prepare::geometry::Geometry;
use crate::soa::{Vec3xN, get_lane, set_lane};

/// Points of rough interfaces that refract what they do not reflect. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct RoughDielectricBsdfBatch<const N: usize> {
    /// Which lanes are such, and whether any is.
    pub is_active: [bool; N],
    any_active: bool,
    normal: Vec3xN<f32, N>,
    pub(crate) params: RoughDielectricParams<N>,
    pub(crate) view_terms: ViewTerms<N>,
    pub(crate) samples: Goes<N>,
}

/// What depends on the view alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ViewTerms<const N: usize> {
    /// The normal, bent where needed so that the viewer sees it, and the view along tangent, bitangent and normal.
    normal: Vec3xN<f32, N>,
    pub(crate) wo: Vec3xN<f32, N>,
    /// What reflection alone loses of the view, and what it keeps in the mean.
    energy_loss: [f32; N],
    mean_albedo: [f32; N],
    /// The colour of what the interface's own lobe gives back.
    multi_scatter: Vec3xN<f32, N>,
    /// As [`crate::bsdf::multiscatter_dielectric::Between`] has them.
    has_multiscatter: [bool; N],
    compensation: Vec3xN<f32, N>,
    multiscatter_loss: Vec3xN<f32, N>,
    mean_loss: Vec3xN<f32, N>,
    /// How often one microfacet, and what leaves after several of them on either side, are sampled.
    pub(crate) lobe_probabilities: [[f32; N]; 3],
}

impl<const N: usize> Default for ViewTerms<N> {
    fn default() -> Self {
        Self {
            normal: [[0.0; N]; 3],
            wo: [[0.0; N]; 3],
            energy_loss: [0.0; N],
            mean_albedo: [1.0; N],
            multi_scatter: [[0.0; N]; 3],
            has_multiscatter: [false; N],
            compensation: [[0.0; N]; 3],
            multiscatter_loss: [[0.0; N]; 3],
            mean_loss: [[1.0; N]; 3],
            lobe_probabilities: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Default for RoughDielectricBsdfBatch<N> {
    fn default() -> Self {
        Self {
            is_active: [false; N],
            any_active: false,
            normal: [[0.0; N]; 3],
            params: RoughDielectricParams::default(),
            view_terms: ViewTerms::default(),
            samples: Goes::default(),
        }
    }
}

/// Whether points of a material may be frosted ones.
pub(crate) fn is_rough_refractive(material: &Material) -> bool {
    match &material.model {
        MaterialModel::Glass(glass) => {
            !(glass.thin || is_smooth(glass.roughness)) && glass.dispersion == 0.0
        }
        MaterialModel::Principled(p) => principled::is_rough_refractive(p),
        _ => false,
    }
}

impl<const N: usize> RoughDielectricBsdfBatch<N> {
    /// Forgets all.
    #[inline]
    pub fn clear(&mut self) {
        self.is_active = [false; N];
        self.any_active = false;
    }

    /// Whether there is any.
    #[inline]
    pub fn any(&self) -> bool {
        self.any_active
    }

    /// Sets a lane, where the point there is frosted; its material is. `outside_ior` is the index of refraction of what is around
    /// its matter.
    #[inline]
    pub fn set_lane(
        &mut self,
        (places, lane): (&SurfaceInteractions<N>, usize),
        world: &Geometry,
        hit: &Hit,
        channel: Option<usize>,
        around: f32,
    ) {
        let prepared = world.material(hit);
        let (material, footprint) = (&prepared.material, places.footprint(lane));
        let (mut normal, front) = (places.shading_normal(lane), places.is_front(lane));
        if let Some(map) = material.normal_map {
            let mapped = world.mapped_normal(&map, hit, footprint, normal, front);
            normal = mapped.unwrap_or(normal);
        }
        let base = world.base_color_with(prepared, hit, footprint);
        let interface = prepared.dielectric_albedo(channel);
        let layers = match &material.model {
            MaterialModel::Glass(glass) => {
                let eta = dielectric::eta(glass, front, channel, around);
                dielectric::layer_stack(glass, eta, base, interface)
            }
            MaterialModel::Principled(p) => {
                let lookup = TextureLookup::new(world, hit, footprint);
                let seen = ViewContext {
                    channel,
                    outside_ior: around,
                    dielectric_albedo: interface,
                    ..ViewContext::for_lane(places, lane, base)
                };
                principled::layer_stack(p, &lookup, &seen)
            }
            _ => return,
        };
        let index = world.material_index(hit.instance, hit.triangle);
        if self.params.set_lane(lane, &layers, index) {
            set_lane(&mut self.normal, lane, normal.to_array());
            self.is_active[lane] = true;
            self.any_active = true;
        }
    }

    /// The direction in which light goes on, and where its ray starts.
    #[inline]
    pub fn sample(&self, lane: usize) -> Option<(BsdfSample, Vec3)> {
        let goes = &self.samples;
        goes.goes[lane].then(|| {
            let sample = BsdfSample {
                wi: get_lane(&goes.direction, lane).into(),
                weight: get_lane(&goes.weight, lane).into(),
                pdf: goes.pdf[lane],
                is_specular: false,
                eta_scale: goes.squeeze[lane],
            };
            (sample, get_lane(&goes.start, lane).into())
        })
    }

    #[inline(always)]
    pub(crate) fn shading_frame(
        &self,
        places: &SurfaceInteractions<N>,
        lane: usize,
    ) -> ShadingFrame {
        places
            .shading_frame(lane)
            .with_axis(get_lane(&self.view_terms.normal, lane).into())
    }

    /// The values of light from these directions.
    #[inline(always)]
    pub fn eval(
        &self,
        world: &Geometry,
        places: &SurfaceInteractions<N>,
        directions: &Vec3xN<f32, N>,
    ) -> BsdfEvals<N> {
        let (tables, made, seen) = (albedo_tables(), &self.params, &self.view_terms);
        let (mut lights, mut up, mut there) = ([[0.0; N]; 3], [false; N], [false; N]);
        for lane in 0..N {
            let light = Vec3::from(get_lane(directions, lane));
            let l = self.shading_frame(places, lane).to_local(light);
            up[lane] = places.geometric_normal(lane).dot(light) > 0.0;
            there[lane] = (up[lane] == (l.z > 0.0)) & (l.z != 0.0);
            set_lane(&mut lights, lane, l.to_array());
        }
        let (mut lost, mut heights) = ([0.0; N], [0.0; N]);
        for lane in 0..N {
            heights[lane] = lights[2][lane].abs();
            let rows = AlbedoRow::new(&made.ggx(lane));
            lost[lane] = 1.0 - rows.albedo_at(tables, heights[lane])[0];
        }
        let other: [bool; N] = std::array::from_fn(|lane| lights[2][lane] < 0.0);
        let lanes =
            (0..N).filter(|&lane| self.is_active[lane] & there[lane] & seen.has_multiscatter[lane]);
        let all = made.energy_loss(world, lanes, &other, &heights);
        let between = self.eval_multiscatter(&all, &lost, &heights);
        // One microfacet: that of a mirror, or of a refraction.
        let (mut cosines, mut facets) = ([0.0; N], [[0.0; N]; 2]);
        for lane in 0..N {
            let (v, l) = (
                Vec3::from(get_lane(&seen.wo, lane)),
                get_lane(&lights, lane),
            );
            let (ggx, eta) = (made.ggx(lane), made.eta[lane]);
            let mirror = MicrofacetEval::new(&ggx, v, l.into());
            let refraction = made.eval_refraction(lane, v, l.into());
            let shares = if up[lane] {
                [mirror.cosine, mirror.weight, mirror.pdf]
            } else {
                let (squeeze, facets) = refraction;
                [
                    facets.cosine,
                    facets.weight * squeeze,
                    facets.pdf * eta * eta * squeeze,
                ]
            };
            [cosines[lane], facets[0][lane], facets[1][lane]] = shares;
        }
        let (reflected, over) = made.reflectance(&cosines);
        let mut values = BsdfEvals::default();
        for lane in 0..N {
            let (cosine, is_up) = (lights[2][lane], up[lane]);
            let reflected = Vec3::from(get_lane(&reflected, lane));
            let rest = (Vec3::ONE - Vec3::from(get_lane(&over, lane))) * made.transmission(lane);
            let mirrors = reflect_probability(reflected, rest);
            let [specular, above, below] =
                [0, 1, 2].map(|lobe: usize| seen.lobe_probabilities[lobe][lane]);
            let mean = 1.0 - seen.mean_albedo[lane];
            let back = seen.energy_loss[lane] * lost[lane] / mean;
            let back = if mean > 1e-6 { back } else { 0.0 };
            let multiple =
                Vec3::from(get_lane(&seen.multi_scatter, lane)) * (back * cosine * FRAC_1_PI);
            let between = Vec3::from(get_lane(&between, lane));
            let single = if is_up { reflected } else { rest } * facets[0][lane];
            let value = if is_up {
                single + multiple + between
            } else {
                between + single
            };
            let [many, one] = if is_up {
                [above, mirrors * specular]
            } else {
                [below, (1.0 - mirrors) * specular]
            };
            let pdf = cosine_hemisphere_pdf(heights[lane]) * many + facets[1][lane] * one;
            let value = if there[lane] { value } else { Vec3::ZERO };
            values.pdf[lane] = if there[lane] { pdf } else { 0.0 };
            set_lane(&mut values.value, lane, value.to_array());
        }
        values
    }

    /// What leaves after several microfacets, times the cosine: by what one loses of light, with refraction and without.
    #[inline(always)]
    fn eval_multiscatter(
        &self,
        all: &Vec3xN<f32, N>,
        lost: &[f32; N],
        heights: &[f32; N],
    ) -> Vec3xN<f32, N> {
        let (made, seen) = (&self.params, &self.view_terms);
        let mut between = [[0.0; N]; 3];
        for lane in 0..N {
            let [all, back, view, total] = [
                all,
                &seen.compensation,
                &seen.multiscatter_loss,
                &seen.mean_loss,
            ]
            .map(|lanes: &Vec3xN<f32, N>| Vec3::from(get_lane(lanes, lane)));
            let lost = (all - back * lost[lane]).max(Vec3::ZERO);
            let value = view * lost / total * (heights[lane] * FRAC_1_PI);
            let value = value * made.transmission(lane);
            let value = if seen.has_multiscatter[lane] {
                value
            } else {
                Vec3::ZERO
            };
            set_lane(&mut between, lane, value.to_array());
        }
        between
    }

    /// What depends on the view.
    #[inline(always)]
    pub(crate) fn prepare_view(
        &mut self,
        world: &Geometry,
        places: &SurfaceInteractions<N>,
        tables: &AlbedoTables,
    ) {
        let made = &self.params;
        let mut seen = ViewTerms::default();
        let (mut at, mut means) = ([[0.0; N]; 2], [0.0; N]);
        for lane in 0..N {
            let frame = places.shading_frame(lane);
            let normal = frame.bend_towards_viewer(get_lane(&self.normal, lane).into());
            let view = frame.with_axis(normal).to_local(frame.wo);
            set_lane(&mut seen.normal, lane, normal.to_array());
            set_lane(&mut seen.wo, lane, view.to_array());
        }
        let heights = seen.wo[2];
        for lane in 0..N {
            let rows = AlbedoRow::new(&made.ggx(lane));
            [at[0][lane], at[1][lane]] = rows.albedo_at(tables, heights[lane]);
            [means[lane], _] = rows.mean_albedo(tables);
        }
        let (reflected, over) = made.reflectance(&heights);
        let found = made.view_losses(world, self.is_active, &heights);
        let mean = |color: Vec3| color.element_sum() / 3.0;
        for lane in 0..N {
            let (at, kept) = ([at[0][lane], at[1][lane]], means[lane]);
            let lost = 1.0 - at[0];
            let own = Albedo::new(made.ends(lane), at, kept);
            let given_back = multi_scatter_color(made.over(lane), kept);
            let [all, up, down] = [&found.loss, &found.mean_loss[0], &found.mean_loss[1]]
                .map(|lanes: &Vec3xN<f32, N>| Vec3::from(get_lane(lanes, lane)));
            let lost_view = (all - given_back * lost).max(Vec3::ZERO);
            let [up, down] =
                [up, down].map(|all| (all - given_back * (1.0 - kept)).max(Vec3::ZERO));
            let total = up + down * (made.eta[lane] * made.eta[lane]);
            let between = total.max_element() >= 1e-6;
            let total = total.max(Vec3::splat(1e-9));
            let upwards = (up / total).element_sum() / 3.0;
            let view = lost_view.element_sum() / 3.0;
            let sides = if between {
                [view * upwards, view * (1.0 - upwards)]
            } else {
                [0.0; 2]
            };
            let passed = mean(made.transmission(lane));
            let alone = if made.uses_table(lane) {
                own.single_scatter
            } else {
                Vec3::from(get_lane(&reflected, lane)) * (1.0 - lost)
            };
            let alone = [mean(alone), 1.0 - mean(get_lane(&over, lane).into())];
            let known = [found.single_scatter[0][lane], found.single_scatter[1][lane]];
            let [single, below] = if between { known } else { alone };
            let weights = [
                single + passed * below,
                mean(own.multi_scatter) + passed * sides[0],
                passed * sides[1],
            ];
            let sum = weights[0] + weights[1] + weights[2];
            let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
            for (share, weight) in seen.lobe_probabilities.iter_mut().zip(weights) {
                share[lane] = weight * scale;
            }
            seen.has_multiscatter[lane] = between;
            seen.energy_loss[lane] = lost;
            seen.mean_albedo[lane] = kept;
            let colors = [
                (
                    &mut seen.multi_scatter,
                    multi_scatter_color(made.ends(lane), kept),
                ),
                (&mut seen.compensation, given_back),
                (&mut seen.multiscatter_loss, lost_view),
                (&mut seen.mean_loss, total),
            ];
            for (lanes, color) in colors {
                set_lane(lanes, lane, color.to_array());
            }
        }
        self.view_terms = seen;
    }
}

/// How often one microfacet is asked to reflect, by what it reflects and what it lets through.
#[inline(always)]
pub(crate) fn reflect_probability(reflected: Vec3, rest: Vec3) -> f32 {
    let reflected = reflected.element_sum();
    let both = reflected + rest.element_sum();
    if both > 0.0 { reflected / both } else { 1.0 }
}

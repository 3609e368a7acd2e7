//! Rough glass, and glTF's principled material where it lets all light in, many points at a time, field by field: what
//! [`Layered`](crate::bsdf::Layered) does one by one.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{Material, Reflectance};

use crate::bsdf::batch::rough_dielectric_params::Frosts;
pub(crate) use crate::bsdf::batch::rough_dielectric_sample::FindFrosted;
use crate::bsdf::batch::rough_dielectric_sample::Goes;
use crate::bsdf::principled::{Lookup, Seen};
use crate::bsdf::{ScatterSample, Values, dielectric, is_smooth, principled};
use crate::interaction::Places;
use crate::lobes::albedo_tables::{Albedo, Rows, Tables, multiple, tables};
use crate::lobes::ggx::Facets;
use crate::lobes::shading_frame::{Frame, cosine_density};
use crate::prepare::PreparedWorld;
use crate::soa::{Three, get, set};

/// Points of rough interfaces that refract what they do not reflect. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct FrostedPoints<const N: usize> {
    /// Which lanes are such, and whether any is.
    pub is: [bool; N],
    any: bool,
    normal: Three<f32, N>,
    pub(crate) made: Frosts<N>,
    pub(crate) seen: Views<N>,
    pub(crate) goes: Goes<N>,
}

/// What depends on the view alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Views<const N: usize> {
    /// The normal, bent where needed so that the viewer sees it, and the view along tangent, bitangent and normal.
    normal: Three<f32, N>,
    pub(crate) view: Three<f32, N>,
    /// What reflection alone loses of the view, and what it keeps in the mean.
    lost: [f32; N],
    kept: [f32; N],
    /// The colour of what the interface's own lobe gives back.
    multiple: Three<f32, N>,
    /// As [`crate::bsdf::multiscatter_dielectric::Between`] has them.
    between: [bool; N],
    given_back: Three<f32, N>,
    lost_between: Three<f32, N>,
    total: Three<f32, N>,
    /// How often one microfacet, and what leaves after several of them on either side, are sampled.
    pub(crate) shares: [[f32; N]; 3],
}

impl<const N: usize> Default for Views<N> {
    fn default() -> Self {
        Self {
            normal: [[0.0; N]; 3],
            view: [[0.0; N]; 3],
            lost: [0.0; N],
            kept: [1.0; N],
            multiple: [[0.0; N]; 3],
            between: [false; N],
            given_back: [[0.0; N]; 3],
            lost_between: [[0.0; N]; 3],
            total: [[1.0; N]; 3],
            shares: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Default for FrostedPoints<N> {
    fn default() -> Self {
        Self {
            is: [false; N],
            any: false,
            normal: [[0.0; N]; 3],
            made: Frosts::default(),
            seen: Views::default(),
            goes: Goes::default(),
        }
    }
}

/// Whether points of a material may be frosted ones.
pub(crate) fn is_frosted(material: &Material) -> bool {
    match &material.reflectance {
        Reflectance::Glass(glass) => {
            !(glass.thin || is_smooth(glass.roughness)) && glass.dispersion == 0.0
        }
        Reflectance::Principled(p) => principled::is_frosted(p),
        _ => false,
    }
}

impl<const N: usize> FrostedPoints<N> {
    /// Forgets all.
    #[inline]
    pub fn begin(&mut self) {
        self.is = [false; N];
        self.any = false;
    }

    /// Whether there is any.
    #[inline]
    pub fn any(&self) -> bool {
        self.any
    }

    /// Sets a lane, where the point there is frosted; its material is. `around` is the index of refraction of what is around
    /// its matter.
    #[inline]
    pub fn put(
        &mut self,
        (places, lane): (&Places<N>, usize),
        world: &PreparedWorld,
        hit: &Hit,
        channel: Option<usize>,
        around: f32,
    ) {
        let prepared = world.material(hit);
        let (material, footprint) = (&prepared.material, places.footprint(lane));
        let (mut normal, front) = (places.normal(lane), places.front(lane));
        if let Some(map) = material.normal_map {
            let mapped = world.mapped_normal(&map, hit, footprint, normal, front);
            normal = mapped.unwrap_or(normal);
        }
        let base = world.base_color_of(prepared, hit, footprint);
        let interface = prepared.interface(channel);
        let layers = match &material.reflectance {
            Reflectance::Glass(glass) => {
                let eta = dielectric::eta(glass, front, channel, around);
                dielectric::layers(glass, eta, base, interface)
            }
            Reflectance::Principled(p) => {
                let lookup = Lookup::new(world, hit, footprint);
                let seen = Seen {
                    channel,
                    around,
                    interface,
                    ..Seen::at(places, lane, base)
                };
                principled::layers(p, &lookup, &seen)
            }
            _ => return,
        };
        let index = world.material_index(hit.instance, hit.triangle);
        if self.made.put(lane, &layers, index) {
            set(&mut self.normal, lane, normal.to_array());
            self.is[lane] = true;
            self.any = true;
        }
    }

    /// The direction in which light goes on, and where its ray starts.
    #[inline]
    pub fn sample(&self, lane: usize) -> Option<(ScatterSample, Vec3)> {
        let goes = &self.goes;
        goes.goes[lane].then(|| {
            let sample = ScatterSample {
                direction: get(&goes.direction, lane).into(),
                weight: get(&goes.weight, lane).into(),
                pdf: goes.pdf[lane],
                delta: false,
                squeeze: goes.squeeze[lane],
            };
            (sample, get(&goes.start, lane).into())
        })
    }

    #[inline(always)]
    pub(crate) fn frame(&self, places: &Places<N>, lane: usize) -> Frame {
        places
            .frame(lane)
            .about(get(&self.seen.normal, lane).into())
    }

    /// The values of light from these directions.
    #[inline(always)]
    pub fn evaluate(
        &self,
        world: &PreparedWorld,
        places: &Places<N>,
        directions: &Three<f32, N>,
    ) -> Values<N> {
        let (tables, made, seen) = (tables(), &self.made, &self.seen);
        let (mut lights, mut up, mut there) = ([[0.0; N]; 3], [false; N], [false; N]);
        for lane in 0..N {
            let light = Vec3::from(get(directions, lane));
            let l = self.frame(places, lane).local(light);
            up[lane] = places.geometric(lane).dot(light) > 0.0;
            there[lane] = (up[lane] == (l.z > 0.0)) & (l.z != 0.0);
            set(&mut lights, lane, l.to_array());
        }
        let (mut lost, mut heights) = ([0.0; N], [0.0; N]);
        for lane in 0..N {
            heights[lane] = lights[2][lane].abs();
            let rows = Rows::new(&made.ggx(lane));
            lost[lane] = 1.0 - rows.at(tables, heights[lane])[0];
        }
        let other: [bool; N] = std::array::from_fn(|lane| lights[2][lane] < 0.0);
        let lanes = (0..N).filter(|&lane| self.is[lane] & there[lane] & seen.between[lane]);
        let all = made.lost(world, lanes, &other, &heights);
        let between = self.between(&all, &lost, &heights);
        // One microfacet: that of a mirror, or of a refraction.
        let (mut cosines, mut facets) = ([0.0; N], [[0.0; N]; 2]);
        for lane in 0..N {
            let (v, l) = (Vec3::from(get(&seen.view, lane)), get(&lights, lane));
            let (ggx, eta) = (made.ggx(lane), made.eta[lane]);
            let mirror = Facets::new(&ggx, v, l.into());
            let refraction = made.refraction(lane, v, l.into());
            let shares = if up[lane] {
                [mirror.cosine, mirror.seen, mirror.pdf]
            } else {
                let (squeeze, facets) = refraction;
                [
                    facets.cosine,
                    facets.seen * squeeze,
                    facets.pdf * eta * eta * squeeze,
                ]
            };
            [cosines[lane], facets[0][lane], facets[1][lane]] = shares;
        }
        let (reflected, over) = made.reflected(&cosines);
        let mut values = Values::default();
        for lane in 0..N {
            let (cosine, is_up) = (lights[2][lane], up[lane]);
            let reflected = Vec3::from(get(&reflected, lane));
            let rest = (Vec3::ONE - Vec3::from(get(&over, lane))) * made.transmission(lane);
            let mirrors = mirrors(reflected, rest);
            let [specular, above, below] = [0, 1, 2].map(|lobe: usize| seen.shares[lobe][lane]);
            let mean = 1.0 - seen.kept[lane];
            let back = seen.lost[lane] * lost[lane] / mean;
            let back = if mean > 1e-6 { back } else { 0.0 };
            let multiple = Vec3::from(get(&seen.multiple, lane)) * (back * cosine * FRAC_1_PI);
            let between = Vec3::from(get(&between, lane));
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
            let pdf = cosine_density(heights[lane]) * many + facets[1][lane] * one;
            let value = if there[lane] { value } else { Vec3::ZERO };
            values.pdf[lane] = if there[lane] { pdf } else { 0.0 };
            set(&mut values.value, lane, value.to_array());
        }
        values
    }

    /// What leaves after several microfacets, times the cosine: by what one loses of light, with refraction and without.
    #[inline(always)]
    fn between(&self, all: &Three<f32, N>, lost: &[f32; N], heights: &[f32; N]) -> Three<f32, N> {
        let (made, seen) = (&self.made, &self.seen);
        let mut between = [[0.0; N]; 3];
        for lane in 0..N {
            let [all, back, view, total] = [all, &seen.given_back, &seen.lost_between, &seen.total]
                .map(|lanes: &Three<f32, N>| Vec3::from(get(lanes, lane)));
            let lost = (all - back * lost[lane]).max(Vec3::ZERO);
            let value = view * lost / total * (heights[lane] * FRAC_1_PI);
            let value = value * made.transmission(lane);
            let value = if seen.between[lane] {
                value
            } else {
                Vec3::ZERO
            };
            set(&mut between, lane, value.to_array());
        }
        between
    }

    /// What depends on the view.
    #[inline(always)]
    pub(crate) fn see(&mut self, world: &PreparedWorld, places: &Places<N>, tables: &Tables) {
        let made = &self.made;
        let mut seen = Views::default();
        let (mut at, mut means) = ([[0.0; N]; 2], [0.0; N]);
        for lane in 0..N {
            let frame = places.frame(lane);
            let normal = frame.seen(get(&self.normal, lane).into());
            let view = frame.about(normal).local(frame.view);
            set(&mut seen.normal, lane, normal.to_array());
            set(&mut seen.view, lane, view.to_array());
        }
        let heights = seen.view[2];
        for lane in 0..N {
            let rows = Rows::new(&made.ggx(lane));
            [at[0][lane], at[1][lane]] = rows.at(tables, heights[lane]);
            [means[lane], _] = rows.mean(tables);
        }
        let (reflected, over) = made.reflected(&heights);
        let found = made.between(world, self.is, &heights);
        let mean = |color: Vec3| color.element_sum() / 3.0;
        for lane in 0..N {
            let (at, kept) = ([at[0][lane], at[1][lane]], means[lane]);
            let lost = 1.0 - at[0];
            let own = Albedo::new(made.ends(lane), at, kept);
            let given_back = multiple(made.over(lane), kept);
            let [all, up, down] = [&found.all, &found.mean[0], &found.mean[1]]
                .map(|lanes: &Three<f32, N>| Vec3::from(get(lanes, lane)));
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
            let alone = if made.by_table(lane) {
                own.single
            } else {
                Vec3::from(get(&reflected, lane)) * (1.0 - lost)
            };
            let alone = [mean(alone), 1.0 - mean(get(&over, lane).into())];
            let known = [found.kept[0][lane], found.kept[1][lane]];
            let [single, below] = if between { known } else { alone };
            let weights = [
                single + passed * below,
                mean(own.multiple) + passed * sides[0],
                passed * sides[1],
            ];
            let sum = weights[0] + weights[1] + weights[2];
            let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
            for (share, weight) in seen.shares.iter_mut().zip(weights) {
                share[lane] = weight * scale;
            }
            seen.between[lane] = between;
            seen.lost[lane] = lost;
            seen.kept[lane] = kept;
            let colors = [
                (&mut seen.multiple, multiple(made.ends(lane), kept)),
                (&mut seen.given_back, given_back),
                (&mut seen.lost_between, lost_view),
                (&mut seen.total, total),
            ];
            for (lanes, color) in colors {
                set(lanes, lane, color.to_array());
            }
        }
        self.seen = seen;
    }
}

/// How often one microfacet is asked to reflect, by what it reflects and what it lets through.
#[inline(always)]
pub(crate) fn mirrors(reflected: Vec3, rest: Vec3) -> f32 {
    let reflected = reflected.element_sum();
    let both = reflected + rest.element_sum();
    if both > 0.0 { reflected / both } else { 1.0 }
}

//! What a path does where it meets a surface or the sky: it picks up light, asks for that of lights, and goes on.

use glam::Vec3;
use raycam_bvh::{Hit, Ray};
use raycam_scene::{Alpha, Material};

use crate::bsdf::ShadingPoint;
use crate::bsdf::diffuse::Diffuse;
use crate::bsdf::{BsdfModel, BsdfSample, is_dispersive};
use crate::guiding::caustic_casters::CausticCaster;
use crate::guiding::caustic_map::CausticMap;
use crate::integrator::PathSettings;
use crate::integrator::batch::hits::HitView;
use crate::integrator::nested_dielectrics::{InterfaceTransition, InteriorList};
use crate::integrator::path::{PathState, WavefrontQueues};
use crate::interaction::LightSampleContext;
use crate::interaction::batch::SurfaceInteractions;
use crate::interaction::ray_cone::Footprint;
use crate::light::light_sampling::LightSampling;
use crate::light::lights::Lights;
use crate::light::prepared_light::PreparedLight;
use crate::light::samples::{EnvironmentLookup, ONE_MINUS_SHADOW_EPSILON};
use crate::prepare::material::PreparedMaterial;
use crate::prepare::world::PreparedWorld;
use crate::sampling::dimension::Dimension;
use crate::sampling::sampler::Sampler;
use crate::soa::LANES;

/// Segments before a path may end by roulette: the noise of ending sooner costs more than the time that it saves.
const MIN_ROULETTE_DEPTH: u32 = 6;

/// What all paths share.
pub(crate) struct PathTracer<'a> {
    pub world: &'a PreparedWorld,
    pub lights: &'a Lights,
    pub settings: &'a PathSettings<'a>,
    pub samplers: &'a [Sampler],
    /// Whether a ray may find light that `Lights::sample` finds too.
    pub mis_with_bsdf: bool,
    /// Whether `Lights::sample` finds any.
    pub has_light_samples: bool,
    /// Whether there is more than one to choose from.
    pub needs_light_choice: bool,
    /// The only one that is sampled, if there is but one.
    pub single_light: Option<&'a PreparedLight>,
    /// Whether what lights bring to matte and glossy surfaces is found for many at a time.
    pub batch_direct_lighting: bool,
    /// Whether surfaces that the camera sees sample several of them.
    pub split_lights: bool,
    /// Whether of what stands in the way of a path's last segment only counts that it does.
    pub occlusion_only_last_segment: bool,
    /// Whether some surfaces choose between two ways.
    pub needs_lobe_choice: bool,
    /// What the rays of matte surfaces are aimed at.
    pub caustic_casters: &'a [CausticCaster],
    /// What each of these throws, where that is known.
    pub caustic_maps: &'a [CausticMap],
    /// Surfaces that all paths at hand have met: which random numbers they have used.
    pub bounce: u32,
}

impl PathTracer<'_> {
    /// What one path does where it meets nothing; `known` is what is behind it of one of the lights there.
    pub fn handle_escaped_ray(
        &self,
        path: &PathState,
        known: Option<EnvironmentLookup>,
        out: &mut Vec3,
    ) {
        self.add_intersected_lights(path, f64::INFINITY, out);
        if !(path.is_camera_ray && self.settings.hide_environment) {
            self.add_environment(path, known, out);
        }
    }

    /// What one path does at what it met; whether it goes on.
    #[inline]
    pub fn shade(
        &self,
        path: &mut PathState,
        meeting: &HitView,
        wave: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let HitView {
            hit,
            material,
            ref place,
            ..
        } = *meeting;
        // What all paths do at most surfaces is compiled by itself, without the layers of others.
        if let Some(albedo) = material.diffuse_albedo(&self.world.geometry, hit, &place.footprint) {
            let surface = ShadingPoint {
                interaction: place,
                frame: place.shading_frame(path.direction),
                bsdf: Diffuse {
                    albedo,
                    sampled_direction: meeting.diffuse_direction,
                    guiding: None,
                },
            };
            let skin = InterfaceTransition::no_interface(path.interior_list);
            return self.shade_hit(path, &surface, skin, meeting, wave, radiance);
        }
        self.choose_wavelength(path, &material.material);
        let (direction, channel) = (path.direction, path.wavelength_channel.map(usize::from));
        let skin = InterfaceTransition::at_hit(
            self.world,
            path.interior_list,
            hit,
            place.is_front,
            channel,
        );
        let smooth = material.specular_bsdf(
            &self.world.geometry,
            hit,
            place,
            direction,
            channel,
            skin.outside_ior,
        );
        if let Some((scatter, frame)) = smooth {
            let surface = ShadingPoint {
                interaction: place,
                frame,
                bsdf: scatter,
            };
            return self.shade_hit(path, &surface, skin, meeting, wave, radiance);
        }
        let surface = ShadingPoint::new(
            &self.world.geometry,
            place,
            direction,
            hit,
            channel,
            skin.outside_ior,
        );
        self.shade_hit(path, &surface, skin, meeting, wave, radiance)
    }

    /// Chooses the colour that a path carries from its first surface with dispersion.
    fn choose_wavelength(&self, path: &mut PathState, material: &Material) {
        if path.wavelength_channel.is_none() && is_dispersive(material) {
            let [choice, _] = self.samplers[path.ray_index].get_2d(Dimension::Wavelength);
            let channel = ((choice * 3.0) as u8).min(2);
            path.wavelength_channel = Some(channel);
            path.throughput *= 3.0 * Vec3::AXES[usize::from(channel)];
        }
    }

    #[inline]
    fn shade_hit<S: BsdfModel>(
        &self,
        path: &mut PathState,
        surface: &ShadingPoint<S>,
        skin: InterfaceTransition,
        meeting: &HitView,
        wave: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let HitView {
            hit,
            material: PreparedMaterial { material, .. },
            ref place,
            ..
        } = *meeting;
        let out = &mut radiance[path.ray_index];
        if self.is_skipped(path, material, surface, hit) {
            // The same ray, from the other side.
            wave.next_rays
                .push(place.spawn_ray(path.direction, f32::INFINITY));
            return true;
        }
        let distance = (place.position - path.prev_context.position).length();
        path.interior_list = skin.outside;
        self.absorb(path, distance);
        self.add_intersected_lights(path, distance, out);
        if skin.is_false_intersection {
            self.go_on(path, surface, skin, wave);
            return true;
        }
        self.add_emission(path, material, hit, distance, out);
        if self.is_free_bounce(path) || path.depth < self.settings.max_depth {
            self.sample_lights(path, surface, skin, meeting, wave, out);
            return self.sample_bsdf(path, surface, skin, meeting, wave);
        }
        false
    }

    /// Whether a path that may not grow may still go on through mirrors.
    pub(crate) fn is_free_bounce(&self, path: &PathState) -> bool {
        self.settings.free_specular_bounces && path.specular_bounce
    }

    /// Whether the camera sees the back of a one-sided surface.
    pub(crate) fn is_culled_back_face(
        &self,
        path: &PathState,
        material: &Material,
        front: bool,
    ) -> bool {
        path.depth == 1 && path.specular_bounce && !front && !material.double_sided
    }

    /// The albedo of a plain surface in empty space.
    #[inline]
    pub fn diffuse_albedo(
        &self,
        path: &PathState,
        (material, hit): (&PreparedMaterial, &Hit),
        places: &SurfaceInteractions<LANES>,
        lane: usize,
    ) -> Option<Vec3> {
        let diffuse = material
            .diffuse_factor
            .filter(|_| path.interior_list.is_empty())?;
        if self.is_culled_back_face(path, &material.material, places.is_front(lane)) {
            return None;
        }
        let base = self
            .world
            .geometry
            .base_color_with(material, hit, places.footprint(lane));
        Some(base * diffuse)
    }

    /// Whether a surface is not there for this ray: by its opacity, or because the camera sees the back of a one-sided
    /// one (glTF 2.0, 3.9.4 and 3.9.6).
    fn is_skipped<S: BsdfModel>(
        &self,
        path: &PathState,
        material: &Material,
        surface: &ShadingPoint<S>,
        hit: &Hit,
    ) -> bool {
        if self.is_culled_back_face(path, material, surface.interaction.is_front) {
            return !surface.bsdf.is_transmissive();
        }
        self.fails_alpha_test(path, material, hit)
    }

    /// Whether a surface is not there for this ray by its opacity.
    #[inline]
    pub(crate) fn fails_alpha_test(
        &self,
        path: &PathState,
        material: &Material,
        hit: &Hit,
    ) -> bool {
        if material.alpha == Alpha::Opaque {
            return false;
        }
        let [chance, _] =
            self.samplers[path.ray_index].get_2d(Dimension::OpacityAndRoulette(self.bounce));
        chance >= self.world.geometry.opacity(hit)
    }

    /// The weight of light that the surface's own sampling found, where light sampling has this density.
    fn mis_weight(&self, path: &PathState, pdf: f32) -> f32 {
        if path.specular_bounce || pdf == 0.0 {
            1.0
        } else {
            let count = match path.light_sampling {
                LightSampling::Split => 1.0,
                _ => self.settings.light_samples as f32,
            };
            1.0 / (1.0 + count * pdf / path.bsdf_pdf)
        }
    }

    /// Lights without a mesh that the ray crosses.
    pub(crate) fn add_intersected_lights(&self, path: &PathState, distance: f64, out: &mut Vec3) {
        self.lights.intersect_visible(
            &path.prev_context,
            path.light_sampling,
            path.direction,
            distance,
            |_, radiance, pdf| {
                *out += path.throughput * radiance * self.mis_weight(path, pdf);
            },
        );
    }

    fn add_environment(&self, path: &PathState, known: Option<EnvironmentLookup>, out: &mut Vec3) {
        let (lights, direction) = (self.lights, path.direction);
        let (radiance, pdf) = if path.specular_bounce {
            (lights.escaped_radiance(direction, known), 0.0)
        } else {
            lights.radiance_and_pdf(&path.prev_context, path.light_sampling, direction, known)
        };
        *out += path.throughput
            * self.environment_without_ambient(path.specular_bounce, radiance)
            * self.mis_weight(path, pdf);
    }

    /// The part of the sky's radiance that is not in the ambient term.
    pub(crate) fn environment_without_ambient(&self, straight: bool, radiance: Vec3) -> Vec3 {
        if straight || self.settings.ambient_term.is_none() {
            radiance
        } else {
            (radiance - self.lights.ambient).max(Vec3::ZERO)
        }
    }

    /// What the surface at a hit shines by itself.
    pub(crate) fn add_emission(
        &self,
        path: &PathState,
        material: &Material,
        hit: &Hit,
        distance: f64,
        out: &mut Vec3,
    ) {
        let (world, direction) = (self.world, path.direction);
        if path.specular_bounce && material.model.is_unlit() {
            *out += path.throughput * world.geometry.base_color(hit, &Footprint::default());
        }
        if material.emission.value == [0.0; 3] {
            return;
        }
        let emitted = world.geometry.emission(hit, direction);
        if emitted != Vec3::ZERO {
            let pdf = self.lights.emission_pdf(
                &path.prev_context,
                path.light_sampling,
                &world.geometry,
                hit,
                direction,
                distance,
            );
            *out += path.throughput * emitted * self.mis_weight(path, pdf);
        }
    }

    /// Sends the path on, where it has a future: whether it has.
    #[inline]
    fn sample_bsdf<S: BsdfModel>(
        &self,
        path: &mut PathState,
        surface: &ShadingPoint<S>,
        skin: InterfaceTransition,
        meeting: &HitView,
        wave: &mut WavefrontQueues,
    ) -> bool {
        let sampler = &self.samplers[path.ray_index];
        let choice = if surface.bsdf.needs_lobe_sample() {
            sampler.get_2d(Dimension::LobeAndLight(self.bounce))[0]
        } else {
            0.0
        };
        let [x, y] = meeting.bsdf_random;
        let Some(sample) = surface.bsdf.sample(&surface.frame, [choice, x, y]) else {
            return false;
        };
        let start = surface.interaction.offset_ray_origin(sample.wi).as_vec3();
        let media = skin.medium_towards(surface.frame.geometric, sample.wi);
        self.continue_path(
            path,
            &sample,
            start,
            surface.light_sample_context(),
            media,
            wave,
        )
    }

    /// The same where it is known how: in which direction, where the ray starts, from where and through what.
    #[inline(always)]
    pub(crate) fn continue_path(
        &self,
        path: &mut PathState,
        sample: &BsdfSample,
        start: Vec3,
        from: LightSampleContext,
        media: InteriorList,
        wave: &mut WavefrontQueues,
    ) -> bool {
        let free = self.is_free_bounce(path) && sample.is_specular;
        let depth = path.depth + u32::from(!free);
        // The last segment only looks for lights.
        let last = depth >= self.settings.max_depth && !sample.is_specular;
        if depth > self.settings.max_depth || (last && !self.mis_with_bsdf) {
            return false;
        }
        let mut throughput = path.throughput * sample.weight;
        let squeeze = path.eta_scale * sample.eta_scale;
        if self.bounce.saturating_add(2) > MIN_ROULETTE_DEPTH {
            let survival = (throughput.max_element() * squeeze).min(0.95);
            let [_, chance] =
                self.samplers[path.ray_index].get_2d(Dimension::OpacityAndRoulette(self.bounce));
            if chance >= survival {
                return false;
            }
            throughput /= survival;
        }
        if throughput == Vec3::ZERO {
            return false;
        }
        path.throughput = throughput;
        path.direction = sample.wi;
        path.prev_context = from;
        path.bsdf_pdf = sample.pdf;
        path.specular_bounce = sample.is_specular;
        path.light_sampling = self.light_sampling(path);
        path.is_camera_ray = false;
        path.depth = depth;
        path.interior_list = media;
        path.eta_scale = squeeze;
        path.ray_cone = path.ray_cone.after_scatter(sample.is_specular);
        if last && self.occlusion_only_last_segment && path.interior_list.is_empty() {
            self.queue_last_segment(path, start, wave);
            return false;
        }
        wave.next_rays.push(Ray {
            origin: start.to_array(),
            direction: sample.wi.to_array(),
            t_max: f32::INFINITY,
        });
        true
    }

    /// What [`PathTracer::handle_escaped_ray`] and [`PathTracer::add_intersected_lights`] would find, by shadow rays: those need not know what is met.
    #[inline(never)]
    fn queue_last_segment(&self, path: &PathState, start: Vec3, wave: &mut WavefrontQueues) {
        let ray = Ray {
            origin: start.to_array(),
            direction: path.direction.to_array(),
            t_max: f32::INFINITY,
        };
        let ways = &mut wave.bsdf_shadow_rays;
        self.lights.intersect_visible(
            &path.prev_context,
            path.light_sampling,
            path.direction,
            f64::INFINITY,
            |at, radiance, pdf| {
                let t_max = at as f32 * ONE_MINUS_SHADOW_EPSILON;
                let light = path.throughput * radiance * self.mis_weight(path, pdf);
                ways.push(Ray { t_max, ..ray }, path.ray_index, light);
            },
        );
        let mut sky = Vec3::ZERO;
        self.add_environment(path, None, &mut sky);
        if sky != Vec3::ZERO {
            ways.push(ray, path.ray_index, sky);
        }
    }
}

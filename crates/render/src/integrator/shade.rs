//! Shading of one hit of any material: emission, direct lighting, and the BSDF sample by which the path continues.

use glam::Vec3;
use raycam_scene::Material;

use crate::bsdf::BsdfModel;
use crate::bsdf::diffuse::{Diffuse, diffuse_albedo};
use crate::bsdf::material_hit::MaterialHit;
use crate::bsdf::shading_point::ShadingPoint;
use crate::bsdf::specular::SpecularBsdf;
use crate::integrator::direct_lighting::sampled_diffuse_share;
use crate::integrator::passes::FirstScattering;
use crate::integrator::path_state::{ColorChannel, HitView, PathState, WavefrontQueues};
use crate::integrator::path_tracer::PathTracer;
use crate::lobes::classify::is_dispersive;
use crate::media::nested_dielectrics::InterfaceTransition;
use crate::sampling::dimension::Dimension;

impl PathTracer<'_> {
    /// Shades a hit. Returns true if the path continues. Frequent BSDFs are compiled separately, without code for the
    /// layers of other BSDFs.
    #[inline]
    pub fn shade(
        &self,
        path: &mut PathState,
        view: &HitView,
        queues: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let HitView { hit, material, ref interaction, .. } = *view;
        let footprint = &interaction.footprint;
        if let Some(albedo) = diffuse_albedo(self.geometry, material, hit, footprint) {
            let point = ShadingPoint {
                interaction,
                frame: interaction.shading_frame(path.direction),
                bsdf: Diffuse { albedo, sampled_direction: view.diffuse_direction, guiding: None },
            };
            let transition = InterfaceTransition::no_interface(path.interior_list);
            return self.shade_point(path, &point, transition, view, queues, radiance);
        }
        self.choose_wavelength(path, &material.material);
        let channel = path.wavelength_channel.map(ColorChannel::index);
        let is_front = interaction.is_front;
        let transition = InterfaceTransition::at_hit(self.geometry, path.interior_list, hit, is_front, channel);
        let material_hit =
            MaterialHit::new(self.geometry, hit, interaction, path.direction).seen_by(channel, transition.outside_ior);
        if let Some((bsdf, frame)) = SpecularBsdf::at_hit(&material_hit) {
            let point = ShadingPoint { interaction, frame, bsdf };
            return self.shade_point(path, &point, transition, view, queues, radiance);
        }
        let point = ShadingPoint::new(interaction, &material_hit);
        self.shade_point(path, &point, transition, view, queues, radiance)
    }

    /// Selects the only colour channel that a path transports after its first dispersive surface.
    fn choose_wavelength(&self, path: &mut PathState, material: &Material) {
        if path.wavelength_channel.is_none() && is_dispersive(material) {
            let [random, _] = self.samplers[path.ray_index()].get_2d(Dimension::Wavelength);
            let channel = ((random * 3.0) as usize).min(2);
            path.wavelength_channel = Some(ColorChannel::ALL[channel]);
            path.throughput *= 3.0 * Vec3::AXES[channel];
        }
    }

    #[inline]
    fn shade_point<B: BsdfModel>(
        &self,
        path: &mut PathState,
        point: &ShadingPoint<B>,
        transition: InterfaceTransition,
        view: &HitView,
        queues: &mut WavefrontQueues,
        radiance: &mut [Vec3],
    ) -> bool {
        let (hit, material) = (view.hit, &view.material.material);
        let out = &mut radiance[path.ray_index()];
        let is_skipped = if self.is_culled_back_face(path, material, point.interaction.is_front) {
            !point.bsdf.is_transmissive()
        } else {
            self.fails_alpha_test(path, material, hit)
        };
        let beyond = point.interaction.ray_beyond(path.direction, f32::INFINITY);
        if is_skipped {
            queues.next_rays.push(beyond);
            return true;
        }
        let distance = path.distance_to(point.interaction.position);
        path.interior_list = transition.near_side;
        self.apply_absorption(path, distance);
        self.add_intersected_lights(path, distance, out);
        if transition.is_false_intersection {
            // Light sampling does not pass this surface, so the light found by the next hit has full weight.
            queues.next_rays.push(beyond);
            path.prev_context = point.light_sample_context();
            path.passed_distance = 0.0;
            path.bsdf_pdf = f32::INFINITY;
            path.interior_list = transition.far_side;
            return true;
        }
        self.add_emission(path, material, hit, distance, out);
        if self.is_at_max_depth(path) && !view.material.is_straight {
            return false;
        }
        self.sample_lights(path, point, transition, view, queues, out);
        self.sample_bsdf(path, point, transition, view, queues)
    }

    /// Continues the path by a BSDF sample. Returns false if the path ends.
    #[inline]
    fn sample_bsdf<B: BsdfModel>(
        &self,
        path: &mut PathState,
        point: &ShadingPoint<B>,
        transition: InterfaceTransition,
        view: &HitView,
        queues: &mut WavefrontQueues,
    ) -> bool {
        let choice = if point.bsdf.needs_lobe_sample() {
            let dimension = Dimension::LobeAndLight(self.bounce);
            self.samplers[path.ray_index()].get_2d(dimension)[0]
        } else {
            0.0
        };
        let [x, y] = view.bsdf_random;
        let Some(sample) = point.bsdf.sample(&point.frame, [choice, x, y]) else {
            return false;
        };
        let origin = point.interaction.offset_ray_origin(sample.wi).as_vec3();
        if view.material.is_straight && sample.is_specular && point.frame.geometric.dot(sample.wi) < 0.0 {
            return self.pass_straight(path, &sample, (point.interaction.position, origin), queues);
        }
        let interior_list = transition.medium_towards(point.frame.geometric, sample.wi);
        let context = point.light_sample_context();
        self.record_scattering(path, || FirstScattering::Surface {
            diffuse: if sample.is_specular { Vec3::ZERO } else { sampled_diffuse_share(point, sample.wi) },
        });
        self.continue_path(path, &sample, origin, context, interior_list, queues)
    }
}

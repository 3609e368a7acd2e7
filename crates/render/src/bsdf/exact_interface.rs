//! Exact sampling of a rough interface that is seen from inside a body with a diffuse base.
//!
//! Light leaves such a body only after many bounces, so the squares of the sampling weights are multiplied many times.
//! Visible normals alone have two sources of noise: microfacets reflect and refract different fractions of the light, and
//! a part of the scattered light is blocked by other microfacets. Rejection removes both: a microfacet scatters with the
//! probability with which it does so physically, otherwise another microfacet is sampled. Samples are then distributed
//! like the interface's value, and all weights are equal.

use glam::Vec3;

use crate::bsdf::layer_stack::LayerStack;
use crate::lobes::fresnel::{reflect, refract};
use crate::lobes::mean_color::mean;
use crate::sampling::sampler::splitmix64;

/// Number of microfacets that are sampled at most. Interfaces that need so many are practically never sampled.
const MAX_ATTEMPTS: usize = 1 << 12;

/// Samples a local direction in proportion to the value of the interface of `stack`, averaged over the colours.
pub(crate) fn sample_interface(stack: &LayerStack, wo: Vec3, random: [f32; 3]) -> Option<Vec3> {
    let mut numbers = random;
    let mut state = random.iter().fold(0, |state, number| splitmix64(state ^ u64::from(number.to_bits())));
    for _ in 0..MAX_ATTEMPTS {
        let [choice, x, y] = numbers;
        if let Some(wi) = scatter_once(stack, wo, stack.ggx.sample_wm(wo, [x, y]), choice) {
            return Some(wi);
        }
        numbers = std::array::from_fn(|_| {
            state = splitmix64(state);
            (state >> 40) as f32 / (1u64 << 24) as f32
        });
    }
    None
}

/// Direction into which a microfacet scatters light; `None` if the microfacet passes the light to the base, or if other
/// microfacets block it. `choice` selects reflection, refraction or none.
fn scatter_once(stack: &LayerStack, wo: Vec3, wm: Vec3, choice: f32) -> Option<Vec3> {
    let cosine = wo.dot(wm);
    let reflected = mean(stack.fresnel.reflectance(cosine));
    let (rest, probability, wi) = if choice < reflected {
        (choice, reflected, reflect(wo, wm)?)
    } else {
        let refracted = mean((Vec3::ONE - stack.base_fresnel.reflectance(cosine)) * stack.transmission);
        (choice - reflected, refracted, refract(wo, wm, stack.eta)?)
    };
    let visible = stack.ggx.g_given_g1(wo, Vec3::new(wi.x, wi.y, wi.z.abs()));
    (rest < probability * visible).then_some(wi)
}

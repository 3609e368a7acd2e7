//! Finding caustics: a few photons per candidate select the casters; many photons fill the casters' caustic maps.

use rayon::prelude::*;

use crate::guiding::caustic_casters::{CausticCaster, choose_casters};
use crate::guiding::caustic_map::CausticMap;
use crate::guiding::caustic_spots::find_spots;
use crate::guiding::caustics::Caustics;
use crate::guiding::guiding_benefit::reduces_noise;
use crate::guiding::photon_pass::{PHOTON_BATCH, PhotonPass};
use crate::light::lights::Lights;
use crate::path_guiding::MIN_GUIDED_SEGMENTS;
use crate::prepare::geometry::Geometry;
use crate::settings::{Integrator, Settings};

/// Maximum number of photons emitted to each caustic caster. Lab note: "16,384 photons per caster", 11-23.
const MAX_PHOTONS_PER_CASTER: u32 = 1 << 14;
/// Maximum number of photons emitted to all casters together. Lab note: "at most 2^18 photons", 11-26.
const MAX_PHOTONS: u32 = 1 << 18;

/// True if an image's paths are long enough to be guided to casters, and its lights can cast caustics.
pub(crate) fn needs_caustics(lights: &Lights, settings: &Settings) -> bool {
    let is_long = settings.max_depth.is_none_or(|depth| depth > MIN_GUIDED_SEGMENTS);
    settings.integrator == Integrator::Path && is_long && lights.can_cast_caustics()
}

/// Casters and their caustic maps. Both only guide paths: light that they miss adds noise but no bias.
pub(crate) fn find_caustics(geometry: &Geometry, lights: &Lights, candidates: &[CausticCaster]) -> Caustics {
    if candidates.is_empty() {
        return Caustics::default();
    }
    let pass = PhotonPass::new(geometry, lights, candidates);
    let chosen = choose_casters(candidates, &pass.thrown_fractions());
    let photons = (MAX_PHOTONS / chosen.len().max(1) as u32).clamp(PHOTON_BATCH, MAX_PHOTONS_PER_CASTER);
    let firsts = || (0..photons / PHOTON_BATCH).map(|batch| batch * PHOTON_BATCH);
    let batches: Vec<_> = chosen.iter().flat_map(|&(index, _)| firsts().map(move |first| (index, first))).collect();
    let trace = |(index, first)| pass.trace_photons(index, first..first + PHOTON_BATCH);
    let deposits: Vec<_> = batches.into_par_iter().map(trace).collect();
    let own = |index: usize| deposits.iter().flatten().filter_map(move |(last, one)| (*last == index).then_some(*one));
    let maps: Vec<CausticMap> = chosen.par_iter().map(|(index, caster)| CausticMap::new(caster, own(*index))).collect();
    let landed = chosen.iter().flat_map(|(index, caster)| {
        // Converts power to a fraction of all light, as in `thrown_fractions`.
        let scale = caster.radius.powi(2) / (f64::from(photons) * lights.phi());
        own(*index).map(move |deposit| (deposit.landing_point, deposit.power * scale))
    });
    let [lower, upper] = geometry.bounds();
    let spots = find_spots(landed.collect(), (upper - lower).max_element());
    let (casters, maps) = chosen
        .into_par_iter()
        .zip(maps)
        .map(|((_, caster), map)| Caustics { casters: vec![caster], maps: vec![map], spots: vec![] })
        // Without infinite lights, cosine-weighted samples find little light evenly.
        .filter(|caustics| !lights.has_infinite() || reduces_noise(&pass, caustics))
        .flat_map_iter(|Caustics { casters, maps, .. }| casters.into_iter().zip(maps))
        .unzip();
    Caustics { casters, maps, spots }
}

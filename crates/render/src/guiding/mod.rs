//! Path guiding: samples of diffuse surfaces are guided to objects that focus light and to gaps that light passes, and light
//! sampling is rare where it finds nothing.
//!
//! [`caustic_casters`] finds the objects, [`caustic_map`] where photons left them, [`caustic_spots`] where they gather, [`gaps`]
//! the gaps; [`cones`] is the density of guided samples, [`sample_cones`] draws them, [`light_visibility`] remembers from where
//! light is seen. The photons come from the integrator's passes. This folder uses `interaction`, `prepare` and `lobes`.

pub(crate) mod caustic_casters;
pub(crate) mod caustic_map;
pub(crate) mod caustic_spots;
pub(crate) mod cones;
pub(crate) mod gaps;
pub(crate) mod light_visibility;
pub(crate) mod sample_cones;

use std::sync::OnceLock;

use crate::guiding::caustic_casters::{CausticCaster, MAX_CANDIDATES, choose_casters, find_caustic_candidates};
use crate::guiding::caustic_map::CausticMap;
use crate::guiding::light_visibility::LightVisibility;
use crate::prepare::geometry::Geometry;
use crate::thread_pool::MadeOnce;

/// Guiding of a prepared world.
#[derive(Debug, Default)]
pub(crate) struct Guiding {
    /// Result of [`Guiding::candidates`], computed on demand.
    candidates: OnceLock<Vec<CausticCaster>>,
    /// The casters, found when paths need them: see [`crate::integrator::photon_pass::build_caustic_maps`].
    pub caustics: OnceLock<Caustics>,
    /// The gaps that light passes, found when samples need them: see [`crate::integrator::gap_photons::gaps_of`].
    pub gaps: MadeOnce<Vec<CausticCaster>>,
    /// Parts of space with rare light sampling, for paths that need it: see
    /// [`crate::integrator::light_visibility::prepare_light_visibility`]. `None` if the world has no size.
    pub light_visibility: OnceLock<Option<LightVisibility>>,
    /// True for a world within an exposure.
    is_within_exposure: bool,
}

/// The casters that samples are guided to.
#[derive(Debug, Default)]
pub(crate) struct Caustics {
    pub casters: Vec<CausticCaster>,
    /// The caustic map of each caster; none for a world within an exposure.
    pub maps: Vec<CausticMap>,
    /// The spots that they light.
    pub spots: Vec<CausticCaster>,
}

/// Nothing that samples are guided to.
pub(crate) static NO_CAUSTICS: Caustics = Caustics { casters: vec![], maps: vec![], spots: vec![] };

impl Guiding {
    /// Guiding to smooth casters without maps: a photon pass for every time of an exposure would cost too much.
    pub fn within_exposure() -> Self {
        Self { is_within_exposure: true, ..Self::default() }
    }

    /// True if rays may be traced to learn where light goes: not for every time of an exposure.
    pub fn learns(&self) -> bool {
        !self.is_within_exposure
    }

    /// True if photons may look for casters.
    pub fn needs_photons(&self) -> bool {
        self.learns() && self.caustics.get().is_none()
    }

    /// The objects that may be casters, found now unless they are known.
    pub fn candidates(&self, geometry: &Geometry) -> &[CausticCaster] {
        if let Some(known) = self.candidates.get() {
            return known;
        }
        // Found outside of the cell: threads must not wait for it.
        let candidates = find_caustic_candidates(geometry);
        self.candidates.get_or_init(|| candidates)
    }

    /// The casters, their maps and spots; none before they were found.
    pub fn caustics(&self, geometry: &Geometry) -> &Caustics {
        if self.is_within_exposure && self.caustics.get().is_none() {
            let candidates = self.candidates(geometry);
            let chosen = choose_casters(candidates, &vec![0.0; candidates.len().min(MAX_CANDIDATES)]);
            let casters = chosen.into_iter().map(|(_, caster)| caster).collect();
            let _ = self.caustics.set(Caustics { casters, ..Caustics::default() });
        }
        self.caustics.get().unwrap_or(&NO_CAUSTICS)
    }
}

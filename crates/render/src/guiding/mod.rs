//! Path guiding: samples of diffuse surfaces are guided to objects that focus light and to gaps through which
//! light arrives. In regions that no light reaches directly, lights are rarely sampled.
//!
//! The rest of the renderer uses this folder only through the trait [`PathGuiding`]; `guiding_switch.rs` selects it.
//!
//! * [`caustic_casters`]: objects that focus light. [`caustic_map`]: the regions of these objects that
//!   photons came from. [`caustic_spots`]: small regions where many photons arrive. [`find_caustics`] finds all of
//!   them with the photons that [`photon_pass`] traces. [`guiding_benefit`]: whether guiding to a caster reduces noise.
//! * [`gaps`]: gaps through which light arrives. [`gap_photons`] traces their photons.
//! * [`light_visibility`]: the parts of space from which lights are visible. [`visibility_rays`] traces the shadow
//!   rays.
//! * [`sample_cones`]: sets the cones of a [`ConeMixture`] to all these targets.
//!
//! Tuned constants name the lab note that records their measurement: "lab note" is the section Guiding of
//! `docs/lab-notes/integrator.md`, with the row's date.

pub(crate) mod caustic_casters;
pub(crate) mod caustic_map;
pub(crate) mod caustic_spots;
pub(crate) mod caustics;
pub(crate) mod find_caustics;
pub(crate) mod gap_photons;
pub(crate) mod gaps;
pub(crate) mod guiding_benefit;
pub(crate) mod light_visibility;
pub(crate) mod photon_pass;
pub(crate) mod sample_cones;
pub(crate) mod visibility_rays;

use std::sync::OnceLock;

use glam::DVec3;
use raycam_bvh::dispatch_simd;

use crate::guiding::caustic_casters::{
    CausticCaster, MAX_CANDIDATES, MAX_CASTERS, choose_casters, find_caustic_candidates,
};
use crate::guiding::caustic_spots::MAX_SPOTS;
use crate::guiding::caustics::{Caustics, NO_CAUSTICS};
use crate::guiding::find_caustics::{find_caustics, needs_caustics};
use crate::guiding::gap_photons::{first_gap_sample, trace_gaps};
use crate::guiding::gaps::MAX_GAPS;
use crate::guiding::light_visibility::LightVisibility;
use crate::guiding::sample_cones::SampleGuided;
use crate::guiding::visibility_rays::{needs_light_visibility, sees_light};
use crate::light::lights::Lights;
use crate::lobes::cone_mixture::{ConeMixture, MAX_CONES};
use crate::path_guiding::{DirectionGuide, GuidedPoints, PathGuiding};
use crate::prepare::geometry::Geometry;
use crate::settings::Settings;
use crate::soa::{LANES, Vec3xN};
use crate::thread_pool::MadeOnce;

// One cone for each caster, gap and spot, and two cones for each map.
const _: () = assert!(3 * MAX_CASTERS + MAX_GAPS + MAX_SPOTS <= MAX_CONES);

/// Path guiding that learns from photons and shadow rays.
#[derive(Debug, Default)]
pub(crate) struct LearnedGuiding {
    /// Objects that may focus light, found on demand.
    candidates: OnceLock<Vec<CausticCaster>>,
    caustics: OnceLock<Caustics>,
    gaps: MadeOnce<Vec<CausticCaster>>,
    /// Parts of space in which lights are sampled rarely. `None` if the world has no size.
    light_visibility: OnceLock<Option<LightVisibility>>,
    /// True for a world at one time within an exposure: tracing photons for every time would take too long.
    is_within_exposure: bool,
}

impl LearnedGuiding {
    pub fn new(is_within_exposure: bool) -> Self {
        Self { is_within_exposure, ..Self::default() }
    }

    /// Objects that may be casters.
    fn candidates(&self, geometry: &Geometry) -> &[CausticCaster] {
        if let Some(known) = self.candidates.get() {
            return known;
        }
        // The value is computed before the cell is locked, so that other threads do not wait.
        let candidates = find_caustic_candidates(geometry);
        self.candidates.get_or_init(|| candidates)
    }

    /// Casters with their maps, and spots; empty until photons have been traced. A world within an exposure
    /// has casters without maps.
    fn caustics(&self, geometry: &Geometry) -> &Caustics {
        if self.is_within_exposure && self.caustics.get().is_none() {
            let candidates = self.candidates(geometry);
            let chosen = choose_casters(candidates, &vec![0.0; candidates.len().min(MAX_CANDIDATES)]);
            let casters = chosen.into_iter().map(|(_, caster)| caster).collect();
            let _ = self.caustics.set(Caustics { casters, ..Caustics::default() });
        }
        self.caustics.get().unwrap_or(&NO_CAUSTICS)
    }
}

impl PathGuiding for LearnedGuiding {
    fn learn_geometry(&self, geometry: &Geometry) {
        self.candidates(geometry);
    }

    fn learn(&self, geometry: &Geometry, lights: &Lights, settings: &Settings) {
        if self.is_within_exposure {
            return;
        }
        if self.caustics.get().is_none() && needs_caustics(lights, settings) {
            // The value is not computed inside `get_or_init`, because a waiting thread would steal work of other
            // images.
            let _ = self.caustics.set(find_caustics(geometry, lights, self.candidates(geometry)));
        }
        if needs_light_visibility(lights, settings) {
            self.light_visibility.get_or_init(|| LightVisibility::new(geometry.bounds()));
        }
    }

    fn first_late_sample(&self, settings: &Settings, size: [u32; 2]) -> Option<u32> {
        first_gap_sample(settings, size)
    }

    fn learn_late(&self, geometry: &Geometry, lights: &Lights) {
        if !self.is_within_exposure {
            self.gaps.get_or_make(|| trace_gaps(geometry, lights));
        }
    }

    fn guide<'a>(
        &'a self,
        geometry: &Geometry,
        lights: &Lights,
        is_late: bool,
    ) -> Option<Box<dyn DirectionGuide + 'a>> {
        let caustics = if lights.can_cast_caustics() { self.caustics(geometry) } else { &NO_CAUSTICS };
        let gaps = self.gaps.get().filter(|_| is_late).map_or(&[][..], Vec::as_slice);
        let has_targets = !(caustics.casters.is_empty() && gaps.is_empty());
        has_targets.then(|| Box::new(LearnedTargets { caustics, gaps }) as _)
    }

    fn has_rare_light_sampling(&self) -> bool {
        self.light_visibility.get().is_some_and(Option::is_some)
    }

    fn light_sampling_rate(&self, geometry: &Geometry, lights: &Lights, position: DVec3) -> f32 {
        match self.light_visibility.get() {
            Some(Some(visibility)) => visibility.rate(position, |cell| sees_light(geometry, lights, cell)),
            _ => 1.0,
        }
    }
}

/// Guiding targets for a batch of samples.
#[derive(Debug)]
struct LearnedTargets<'a> {
    caustics: &'a Caustics,
    gaps: &'a [CausticCaster],
}

impl DirectionGuide for LearnedTargets<'_> {
    fn sample(&self, points: &GuidedPoints, mixture: &mut ConeMixture<LANES>, out: &mut Vec3xN<f32, LANES>) {
        let GuidedPoints { interactions, active, random } = *points;
        let Self { caustics, gaps } = *self;
        dispatch_simd(SampleGuided { caustics, gaps, interactions, active, random, cones: mixture, out });
    }
}

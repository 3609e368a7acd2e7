//! Recording of the light that paths find, for the passes of an image.

use glam::Vec3;

use crate::integrator::passes::{FirstScattering, LightSource, PassTag, Passes};
use crate::integrator::path_state::PathState;
use crate::integrator::path_tracer::PathTracer;
use crate::media::map::{MediaMap, MediumRay};
use crate::prepare::medium::Medium;

impl PathTracer<'_> {
    /// Records light that a path finds at the end of its ray.
    #[inline]
    pub fn record(&self, path: &PathState, source: LightSource, light: Vec3) {
        if let Some(passes) = self.settings.passes {
            record_light(passes, path, source, light);
        }
    }

    /// Way and source of the light of a shadow ray at a path's hit; `None` unless passes are recorded. `first` returns
    /// the kind of the first scattering.
    #[inline]
    pub fn tag(
        &self,
        path: &PathState,
        source: LightSource,
        first: impl FnOnce() -> FirstScattering,
    ) -> Option<PassTag> {
        let passes = self.settings.passes?;
        Some(PassTag { way: passes.way(path.way).scattered(first), source })
    }

    /// Way and source of the light of a shadow ray that replaces a path's last segment; `None` unless passes are
    /// recorded.
    pub fn tag_of_last_segment(&self, path: &PathState, source: LightSource) -> Option<PassTag> {
        let passes = self.settings.passes?;
        Some(PassTag { way: passes.way(path.way), source })
    }

    /// Records in the path's way that a surface or a medium scatters the path.
    #[inline]
    pub fn record_scattering(&self, path: &mut PathState, first: impl FnOnce() -> FirstScattering) {
        if let Some(passes) = self.settings.passes {
            let way = passes.way(path.way);
            if !way.is_final() {
                path.way = passes.push_way(way.scattered(first));
            }
        }
    }

    /// Records the air light of the media along a ray, in closed form.
    pub(super) fn record_air_light(&self, media: &MediaMap, path: &PathState, ray: &MediumRay) {
        let Some(passes) = self.settings.passes else { return };
        let way = passes.way(path.way).scattered(|| FirstScattering::Medium);
        passes.add_air_light(path.ray_index(), (way, path.direction), |share| {
            let air_light = |medium: &Medium| {
                self.lights.air_light().radiance(path.direction, medium.albedo, medium.g) * share(medium.g)
            };
            path.throughput * media.closed_form(path.interior_list, ray, air_light).added
        });
    }
}

#[inline(never)]
fn record_light(passes: Passes, path: &PathState, source: LightSource, light: Vec3) {
    passes.add(path.ray_index(), PassTag { way: passes.way(path.way), source }, light);
}

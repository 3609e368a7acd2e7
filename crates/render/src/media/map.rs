//! Media map: the medium at each part of a ray.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use crate::media::medium::Medium;
use crate::media::nested_dielectrics::InteriorList;
use crate::prepare::fog::{PreparedFog, transmittance};
use crate::prepare::geometry::Geometry;

/// The part of a ray between two distances, in one medium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediumPart {
    pub begin: f64,
    pub end: f64,
    pub medium: Medium,
    /// The media that a path there is in.
    pub interior: InteriorList,
}

/// A ray through media, from one distance to another. The direction has unit length; the end may be infinite.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediumRay {
    pub origin: DVec3,
    pub direction: DVec3,
    pub begin: f64,
    pub end: f64,
    pub is_camera_ray: bool,
}

/// The media of a world, for one integrator.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediaMap<'a> {
    geometry: &'a Geometry,
    fog: Option<PreparedFog>,
    /// True if rays from the camera to surfaces are in the fog all the way.
    covers_camera_rays: bool,
}

impl<'a> MediaMap<'a> {
    /// The media as described; `None` for a world without media.
    pub fn new(geometry: &'a Geometry) -> Option<Self> {
        geometry.has_media().then_some(Self { geometry, fog: geometry.fog, covers_camera_rays: false })
    }

    /// The media with fog that light from infinity reaches: fog without a height ends at the world's highest point.
    pub fn below_the_sky(self) -> Self {
        let Some(fog) = self.fog.filter(|fog| !fog.has_top()) else {
            return self;
        };
        let fog = Some(fog.below(highest_point(self.geometry, fog.up)));
        Self { fog, covers_camera_rays: true, ..self }
    }

    /// Visits the parts of a ray that are in a medium, in order, until `visit` breaks.
    pub fn visit<B>(
        &self,
        interior: InteriorList,
        ray: &MediumRay,
        mut visit: impl FnMut(&MediumPart) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if ray.end > ray.begin
            && let Some(part) = self.part(interior, ray)
        {
            return visit(&part);
        }
        ControlFlow::Continue(())
    }

    /// The part of a ray in the medium that surrounds it.
    fn part(&self, interior: InteriorList, ray: &MediumRay) -> Option<MediumPart> {
        let &MediumRay { origin, direction, begin, end, .. } = ray;
        if let Some(medium) = interior.medium(self.geometry) {
            return Some(MediumPart { begin, end, medium, interior });
        }
        let fog = self.fog.as_ref().filter(|_| interior.is_empty())?;
        let medium = Medium { extinction: fog.extinction, albedo: fog.albedo, g: fog.g };
        if self.covers_camera_rays && ray.is_camera_ray && end.is_finite() {
            return Some(MediumPart { begin, end, medium, interior });
        }
        let [from, to] = fog.interval(origin + begin * direction, direction, end - begin);
        (to > from).then_some(MediumPart { begin: begin + from, end: begin + to, medium, interior })
    }

    /// The fraction of light that passes along a ray.
    pub fn transmittance(&self, interior: InteriorList, ray: &MediumRay) -> Vec3 {
        let mut passed = Vec3::ONE;
        let _: ControlFlow<()> = self.visit(interior, ray, |part| {
            passed *= transmittance(part.medium.extinction, part.end - part.begin);
            ControlFlow::Continue(())
        });
        passed
    }
}

/// The scene-local height of the highest visible object.
fn highest_point(geometry: &Geometry, up: DVec3) -> f64 {
    let visible = geometry.instances.iter().filter(|instance| instance.is_visible);
    let tops = visible.map(|instance| {
        let [lower, upper] = instance.bounds();
        up.dot(lower).max(up.dot(upper)) - up.dot(geometry.origin)
    });
    tops.reduce(f64::max).unwrap_or(0.0)
}

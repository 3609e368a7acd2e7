//! Media map: the medium at each part of a ray.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};
use raycam_bvh::{ExactHit, ExactRay, Hit};

use crate::media::nested_dielectrics::{InterfaceTransition, InteriorList};
use crate::prepare::fog::{PreparedFog, transmittance};
use crate::prepare::geometry::Geometry;
use crate::prepare::medium::Medium;

/// The part of a ray between two distances, in one medium.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediumPart {
    pub begin: f64,
    pub end: f64,
    pub medium: Medium,
    /// The media that contain a path within this part.
    pub interior: InteriorList,
}

/// A ray through media between two distances. The direction has unit length; the end may be infinite.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediumRay {
    pub origin: DVec3,
    pub direction: DVec3,
    pub begin: f64,
    pub end: f64,
    pub is_camera_ray: bool,
}

/// The media of a world, in the form that an integrator requires.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediaMap<'a> {
    geometry: &'a Geometry,
    fog: Option<PreparedFog>,
    /// True if rays from the camera to surfaces are completely inside the fog.
    covers_camera_rays: bool,
}

impl<'a> MediaMap<'a> {
    /// Returns the media of the world, with fog of unlimited height unless the world limits it; `None` for a world
    /// without media.
    pub fn new(geometry: &'a Geometry) -> Option<Self> {
        geometry.has_media().then_some(Self { geometry, fog: geometry.fog, covers_camera_rays: false })
    }

    /// Returns the media with fog that does not block light from infinity: fog without a height then ends at
    /// the world's highest point.
    pub fn below_the_sky(self) -> Self {
        let Some(fog) = self.fog.filter(|fog| !fog.has_top()) else {
            return self;
        };
        let fog = Some(fog.below(highest_point(self.geometry, fog.up)));
        Self { fog, covers_camera_rays: true, ..self }
    }

    /// Visits the parts of a ray that are in a medium, in order, until `visit` breaks. Otherwise, returns the path's
    /// media at the ray's end. `borders` are the borders that the ray crosses; borders behind the ray's end are
    /// ignored.
    pub fn visit<B>(
        &self,
        interior: InteriorList,
        ray: &MediumRay,
        borders: &[ExactHit],
        mut visit: impl FnMut(&MediumPart) -> ControlFlow<B>,
    ) -> ControlFlow<B, InteriorList> {
        let mut visit_part =
            |interior: InteriorList, ray: &MediumRay| match self.part(interior, ray).filter(|_| ray.end > ray.begin) {
                Some(part) => visit(&part),
                None => ControlFlow::Continue(()),
            };
        let (mut interior, mut begin) = (interior, ray.begin);
        for hit in borders.iter().take_while(|hit| ray.begin + hit.t <= ray.end) {
            let end = ray.begin + hit.t;
            visit_part(interior, &MediumRay { begin, end, ..*ray })?;
            (interior, begin) = (self.beyond(interior, ray.direction, hit), end);
        }
        visit_part(interior, &MediumRay { begin, ..*ray })?;
        ControlFlow::Continue(interior)
    }

    /// The borders of media that a ray crosses, sorted by their distances from the ray's start.
    pub fn borders(&self, ray: &MediumRay) -> Vec<ExactHit> {
        let mut borders = Borders::default();
        borders.find(self, [ray].into_iter());
        borders.hits
    }

    /// The media that contain a path behind a border.
    fn beyond(&self, interior: InteriorList, direction: DVec3, hit: &ExactHit) -> InteriorList {
        let geometry = self.geometry;
        let [a, b, c] = geometry.corners(hit.instance, hit.triangle);
        let is_along = (b - a).cross(c - a).dot(direction) > 0.0;
        let is_front = is_along == geometry.instances[hit.instance as usize].flips_orientation;
        let hit = Hit { instance: hit.instance, triangle: hit.triangle, ..Hit::MISS };
        InterfaceTransition::at_hit(geometry, interior, &hit, is_front, None).far_side
    }

    /// Returns the part of a ray that is in a medium: the medium of the innermost body that contains the ray, otherwise
    /// fog.
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

    /// The fraction of light that passes along a ray with these `borders`.
    pub fn transmittance(&self, interior: InteriorList, ray: &MediumRay, borders: &[ExactHit]) -> Vec3 {
        let mut passed = Vec3::ONE;
        let _: ControlFlow<(), InteriorList> = self.visit(interior, ray, borders, |part| {
            passed *= transmittance(part.medium.extinction, part.end - part.begin);
            ControlFlow::Continue(())
        });
        passed
    }
}

/// The borders of media that the rays of a batch cross.
#[derive(Debug, Default)]
pub(crate) struct Borders {
    rays: Vec<ExactRay>,
    counts: Vec<u32>,
    /// For each ray, the end of its range in `hits`; the range begins at the end of the previous ray's range.
    ends: Vec<usize>,
    hits: Vec<ExactHit>,
}

impl Borders {
    /// Finds the borders that rays cross, with their distances from the rays' starts.
    pub fn find<'r>(&mut self, media: &MediaMap, rays: impl Iterator<Item = &'r MediumRay>) {
        let Self { rays: exact, counts, ends, hits } = self;
        ends.clear();
        hits.clear();
        let Some(boundaries) = &media.geometry.boundaries else { return };
        exact.clear();
        exact.extend(rays.map(|ray| ExactRay {
            origin: (ray.origin + ray.begin * ray.direction + media.geometry.origin).to_array(),
            direction: ray.direction.to_array(),
            t_min: 0.0,
            t_max: (ray.end - ray.begin).max(0.0),
        }));
        counts.clear();
        counts.resize(exact.len(), 0);
        boundaries.crossings(exact, media.geometry, None, usize::MAX, (counts, hits));
        let mut end = 0;
        ends.extend(counts.iter().map(|&count| {
            end += count as usize;
            end
        }));
    }

    /// The borders that a ray of the batch crosses, sorted by their distances from the ray's start.
    pub fn of_ray(&self, index: usize) -> &[ExactHit] {
        let Some(&end) = self.ends.get(index) else { return &[] };
        let begin = index.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.hits[begin..end]
    }
}

/// Returns the scene-local height of the highest point of all visible objects.
fn highest_point(geometry: &Geometry, up: DVec3) -> f64 {
    let visible = geometry.instances.iter().filter(|instance| instance.is_visible);
    let tops = visible.map(|instance| {
        let [lower, upper] = instance.bounds();
        up.dot(lower).max(up.dot(upper)) - up.dot(geometry.origin)
    });
    tops.reduce(f64::max).unwrap_or(0.0)
}

/// The closed form of light through media: the fraction that remains, and the light that the media add.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClosedForm {
    pub passed: Vec3,
    pub added: Vec3,
    /// The media at the ray's end.
    pub interior: InteriorList,
}

impl MediaMap<'_> {
    /// The closed form of the light along a ray. `air_light` returns the light that a medium of infinite depth sends
    /// (H. Koschmieder, 1924).
    pub fn closed_form(
        &self,
        interior: InteriorList,
        ray: &MediumRay,
        air_light: impl Fn(&Medium) -> Vec3,
    ) -> ClosedForm {
        let (mut passed, mut added) = (Vec3::ONE, Vec3::ZERO);
        let end: ControlFlow<(), InteriorList> = self.visit(interior, ray, &self.borders(ray), |part| {
            let own = transmittance(part.medium.extinction, part.end - part.begin);
            added += passed * (Vec3::ONE - own) * air_light(&part.medium);
            passed *= own;
            ControlFlow::Continue(())
        });
        let interior = match end {
            ControlFlow::Continue(interior) => interior,
            ControlFlow::Break(()) => interior,
        };
        ClosedForm { passed, added, interior }
    }
}

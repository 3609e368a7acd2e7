//! Selection of the surfaces that a query includes.

use raycam_bvh::{ExactHit, ExactRay, HitFilter};

use crate::error::RenderError;
use crate::ground_truth::convert::to_float_hit;
use crate::prepare::geometry::Geometry;
use crate::queries::fields::is_front;
use crate::settings::TruthSurface;

/// Side of a surface from which a ray must come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Facing {
    /// Both sides.
    #[default]
    Both,
    /// The front, where the corners appear counter-clockwise.
    Front,
    /// The back, where the corners appear clockwise.
    Back,
    /// The front of one-sided materials; both sides of other materials.
    Material,
}

/// Surfaces that a query includes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Selection<'a> {
    /// For each object, true if the query includes the object. `None`: all objects.
    pub objects: Option<&'a [bool]>,
    /// For each ray, an object and a triangle that are ignored. Triangle -1 means the whole object; object -1 means
    /// that nothing is skipped.
    pub skip: Option<(&'a [i32], &'a [i32])>,
    /// Side of a surface from which rays must come.
    pub facing: Facing,
    /// Surface at which a ray stops: the first surface, or the first surface that is not transparent.
    pub surface: TruthSurface,
}

impl Selection<'_> {
    /// True if all surfaces are included from both sides.
    pub(super) fn is_everything(&self) -> bool {
        self.objects.is_none()
            && self.skip.is_none()
            && self.facing == Facing::Both
            && self.surface == TruthSurface::First
    }

    pub(super) fn check(&self, objects: usize, rays: usize) -> Result<(), RenderError> {
        let fail = |message: String| Err(RenderError::settings(message));
        if let Some(mask) = self.objects.filter(|mask| mask.len() != objects) {
            return fail(format!(
                "the object mask has {} entries; expected one for each of the {objects} objects",
                mask.len()
            ));
        }
        if let Some((instances, triangles)) = self.skip
            && (instances.len() != rays || triangles.len() != rays)
        {
            let given = (instances.len(), triangles.len());
            return fail(format!(
                "skip has {} objects and {} triangles; expected {rays} of each, one per ray",
                given.0, given.1
            ));
        }
        Ok(())
    }

    /// Filter for rays of the query: ray i is ray `first + order[i]`, or ray `first + i` without an order.
    pub(super) fn filter<'b>(
        &'b self,
        geometry: &'b Geometry,
        rays: &'b [ExactRay],
        (first, order): (usize, Option<&'b [usize]>),
    ) -> SelectionFilter<'b> {
        SelectionFilter { selection: self, geometry, rays, first, order }
    }
}

/// Filter that applies the selection to a slice of the query's rays.
pub(super) struct SelectionFilter<'a> {
    selection: &'a Selection<'a>,
    geometry: &'a Geometry,
    rays: &'a [ExactRay],
    /// Index in the query of the first ray of the slice.
    first: usize,
    /// For each ray: its index relative to the first ray, if the rays are in another order than in the query.
    order: Option<&'a [usize]>,
}

impl SelectionFilter<'_> {
    fn skipped(&self, ray: usize) -> Option<(u32, i32)> {
        let (instances, triangles) = self.selection.skip?;
        let number = self.first + self.order.map_or(ray, |order| order[ray]);
        let instance = u32::try_from(instances[number]).ok()?;
        Some((instance, triangles[number]))
    }
}

impl HitFilter for SelectionFilter<'_> {
    fn accepts_instance(&self, ray: usize, instance: u32) -> bool {
        self.selection.objects.is_none_or(|mask| mask[instance as usize])
            && self.skipped(ray).is_none_or(|(skipped, triangle)| instance != skipped || triangle >= 0)
    }

    fn accepts_every_hit(&self) -> bool {
        let Selection { skip, facing, surface, .. } = self.selection;
        skip.is_none() && *facing == Facing::Both && *surface == TruthSurface::First
    }

    fn accepts(&self, ray: usize, hit: &ExactHit) -> bool {
        if self.skipped(ray).is_some_and(|skipped| skipped == (hit.instance, hit.triangle as i32)) {
            return false;
        }
        let direction = &self.rays[ray];
        let is_right_side = match self.selection.facing {
            Facing::Both => true,
            Facing::Front => is_front(self.geometry, hit),
            Facing::Back => !is_front(self.geometry, hit),
            Facing::Material => {
                let material = &self.geometry.material(&to_float_hit(hit)).material;
                material.double_sided || is_front(self.geometry, hit)
            }
        };
        let is_solid = || !self.geometry.is_skippable(&to_float_hit(hit), direction.direction.into());
        is_right_side && (self.selection.surface == TruthSurface::First || is_solid())
    }
}

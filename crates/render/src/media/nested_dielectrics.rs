//! Nested dielectrics: the media that a path is in, such as glass in water.
//!
//! C. M. Schmidt and B. Budge, "Simple Nested Dielectrics in Ray Traced Images", Journal of Graphics Tools 7(2), 2002.
//! Where closed meshes overlap, the material with the highest priority fills the space, and the surfaces of all other
//! materials are false intersections. Among equal priorities, the material that was entered last wins, so an inner body
//! displaces the outer body.

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;

use crate::lobes::classify::interior_ior;
use crate::prepare::geometry::Geometry;
use crate::prepare::medium::Medium;

/// Number of entries in an interior list. A deeper nesting discards the material that was entered first.
const MAX_NESTING: usize = 6;
const EMPTY: u32 = u32::MAX;

/// Materials in the order in which a path entered them. A material is listed once for each time that the path
/// entered it without leaving it again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InteriorList([u32; MAX_NESTING]);

impl Default for InteriorList {
    fn default() -> Self {
        Self([EMPTY; MAX_NESTING])
    }
}

/// Media on both sides of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InterfaceTransition {
    /// Media on the side that the ray comes from, and media behind the surface.
    pub near_side: InteriorList,
    pub far_side: InteriorList,
    /// True if a material of higher priority fills both sides, so that the surface does not affect light.
    pub is_false_intersection: bool,
    /// Index of refraction outside of the surface's own interior.
    pub outside_ior: f32,
}

impl InterfaceTransition {
    /// Media on both sides of the surface at a hit.
    #[inline]
    pub fn at_hit(geometry: &Geometry, media: InteriorList, hit: &Hit, is_front: bool, channel: Option<usize>) -> Self {
        let index = geometry.material_index(hit.instance, hit.triangle);
        match geometry.materials[index].absorption {
            None => Self::no_interface(media),
            Some(_) => media.transition(geometry, index, is_front, channel),
        }
    }

    /// Returns the media on the side of the surface to which a direction points.
    #[inline]
    pub fn medium_towards(&self, normal: Vec3, direction: Vec3) -> InteriorList {
        if normal.dot(direction) < 0.0 { self.far_side } else { self.near_side }
    }

    /// Creates the transition at a surface that does not border a medium.
    pub fn no_interface(media: InteriorList) -> Self {
        Self { near_side: media, far_side: media, is_false_intersection: false, outside_ior: 1.0 }
    }
}

impl InteriorList {
    pub fn is_empty(&self) -> bool {
        self.0[0] == EMPTY
    }

    /// Transition at a surface of a material with an interior. A path that leaves a material without having entered it
    /// must have started inside.
    fn transition(
        self,
        geometry: &Geometry,
        material: usize,
        is_front: bool,
        channel: Option<usize>,
    ) -> InterfaceTransition {
        let [first, second, ..] = self.0;
        // The most frequent case: the path is in no other medium. The words are compared one by one, because a single
        // wide comparison would stall on words that were just stored.
        if first == if is_front { EMPTY } else { material as u32 } && second == EMPTY {
            let mut far = Self::default();
            far.0[0] = if is_front { material as u32 } else { EMPTY };
            return InterfaceTransition {
                near_side: self,
                far_side: far,
                is_false_intersection: false,
                outside_ior: 1.0,
            };
        }
        self.transition_among(geometry, material, is_front, channel)
    }

    /// General case of [`InteriorList::transition`], in which the path is inside other media.
    fn transition_among(
        self,
        geometry: &Geometry,
        material: usize,
        is_front: bool,
        channel: Option<usize>,
    ) -> InterfaceTransition {
        let material = material as u32;
        let (near, far) = if is_front {
            (self, self.push(material))
        } else if self.0.contains(&material) {
            (self, self.remove(material))
        } else {
            (self.push_bottom(material), self)
        };
        let outside = if is_front { near } else { far };
        InterfaceTransition {
            near_side: near,
            far_side: far,
            is_false_intersection: near.current(geometry) == far.current(geometry),
            outside_ior: outside
                .current(geometry)
                .map_or(1.0, |there| interior_ior(&geometry.materials[there].material, channel)),
        }
    }

    /// Absorption per metre of the material that fills the space; 0 in worlds with media, because
    /// [`MediaMap`](crate::media::map::MediaMap) then computes the absorption.
    pub fn absorption(&self, geometry: &Geometry) -> Vec3 {
        if geometry.has_media() {
            return Vec3::ZERO;
        }
        self.current(geometry).and_then(|there| geometry.materials[there].absorption).unwrap_or(Vec3::ZERO)
    }

    /// The medium that fills the space; none for empty space outside of bodies.
    pub fn medium(&self, geometry: &Geometry) -> Option<Medium> {
        geometry.materials[self.current(geometry)?].medium
    }

    /// True if the path is inside a closed body and a light is outside the body's bounds.
    pub fn light_outside_closed_body(&self, geometry: &Geometry, p_light: DVec3) -> bool {
        let body = self.current(geometry).and_then(|there| geometry.dielectric_bounds()[there]);
        body.is_some_and(|[lower, upper]| p_light.cmplt(lower).any() || p_light.cmpgt(upper).any())
    }

    /// Index of the material that fills the space.
    #[inline]
    fn current(&self, geometry: &Geometry) -> Option<usize> {
        if self.0[1] == EMPTY {
            return (!self.is_empty()).then_some(self.0[0] as usize);
        }
        let known = self.0.iter().take_while(|&&material| material != EMPTY);
        // Among equal values `max_by_key` returns the last.
        known.map(|&material| material as usize).max_by_key(|&material| geometry.materials[material].material.priority)
    }

    pub fn push(mut self, material: u32) -> Self {
        if self.0[MAX_NESTING - 1] != EMPTY {
            self.0.rotate_left(1);
            self.0[MAX_NESTING - 1] = material;
        } else if let Some(place) = self.0.iter_mut().find(|place| **place == EMPTY) {
            *place = material;
        }
        self
    }

    fn remove(mut self, material: u32) -> Self {
        if let Some(at) = self.0.iter().rposition(|&known| known == material) {
            self.0[at] = EMPTY;
            self.0[at..].rotate_left(1);
        }
        self
    }

    /// Adds a material as if it had been entered first.
    fn push_bottom(mut self, material: u32) -> Self {
        self.0.rotate_right(1);
        self.0[0] = material;
        self
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::{Glass, Material, MaterialModel, World};

    use super::*;
    use crate::control::Control;
    use crate::prepare::world::PreparedWorld;

    #[test]
    fn nested_dielectric_shortcut_equals_the_general_case() {
        let mut world = World::default();
        for priority in [0, 3] {
            let material = Material { priority, model: MaterialModel::Glass(Glass::default()), ..Material::default() };
            world.add_material(material).unwrap();
        }
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let nothing = InteriorList::default();
        for media in [nothing, nothing.push(0), nothing.push(1), nothing.push(0).push(1)] {
            for (material, front) in [(0, true), (0, false), (1, true), (1, false)] {
                let met = media.transition(&world.geometry, material, front, None);
                let among = media.transition_among(&world.geometry, material, front, None);
                assert_eq!(format!("{met:?}"), format!("{among:?}"));
            }
        }
    }
}

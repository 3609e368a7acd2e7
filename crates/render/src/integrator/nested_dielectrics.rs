//! What clear matter a path is inside of: glass in water, water in a glass.
//!
//! C. M. Schmidt and B. Budge, "Simple Nested Dielectrics in Ray Traced Images", Journal of Graphics Tools 7(2), 2002:
//! where closed meshes overlap, the one of the highest priority is there, and the surfaces of the others are not. Among
//! equals, the one that was entered last is there: matter that lies within other matter displaces it.

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;

use crate::bsdf::ShadingPoint;
use crate::bsdf::{BsdfModel, ior};
use crate::integrator::path::{PathState, WavefrontQueues};
use crate::integrator::shade::PathTracer;
use crate::prepare::world::PreparedWorld;

/// How many a path remembers; of more, the one it entered first is forgotten.
const MAX_NESTING: usize = 6;
const EMPTY: u32 = u32::MAX;

/// Of so many shadow rays that should meet the border of a body one is asked for, and counts as all of them: not none, for
/// where parts of a mesh are turned inside out light does come that way.
const INTERIOR_SHADOW_RATE: f32 = 16.0;

/// Materials in the order in which they were entered. No material twice where one mesh is inside of itself: each skin
/// that is crossed counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InteriorList([u32; MAX_NESTING]);

impl Default for InteriorList {
    fn default() -> Self {
        Self([EMPTY; MAX_NESTING])
    }
}

/// What a surface of clear matter separates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InterfaceTransition {
    /// Where the ray comes from, and where it goes if it passes.
    pub outside: InteriorList,
    pub inside: InteriorList,
    /// Whether something of a higher priority is on both sides: nothing happens to light here.
    pub is_false_intersection: bool,
    /// The index of refraction outside of the surface's own matter.
    pub outside_ior: f32,
}

impl InterfaceTransition {
    /// That of a hit surface.
    #[inline]
    pub fn at_hit(
        world: &PreparedWorld,
        media: InteriorList,
        hit: &Hit,
        front: bool,
        channel: Option<usize>,
    ) -> Self {
        let index = world.geometry.material_index(hit.instance, hit.triangle);
        match world.geometry.materials[index].absorption {
            None => Self::no_interface(media),
            Some(_) => media.transition(world, index, front, channel),
        }
    }

    /// What light in a direction from the surface goes through.
    pub fn medium_towards(&self, normal: Vec3, direction: Vec3) -> InteriorList {
        if normal.dot(direction) < 0.0 {
            self.inside
        } else {
            self.outside
        }
    }

    /// A surface that is no border of clear matter.
    pub fn no_interface(media: InteriorList) -> Self {
        Self {
            outside: media,
            inside: media,
            is_false_intersection: false,
            outside_ior: 1.0,
        }
    }
}

impl InteriorList {
    pub fn is_empty(&self) -> bool {
        self.0[0] == EMPTY
    }

    /// What a ray meets at the surface of a material that has an inside. One that leaves what it never entered has begun
    /// there.
    fn transition(
        self,
        world: &PreparedWorld,
        material: usize,
        front: bool,
        channel: Option<usize>,
    ) -> InterfaceTransition {
        let [first, second, ..] = self.0;
        // Nearly always: nothing else is there. Word by word: what was just written is not compared as a whole.
        if first == if front { EMPTY } else { material as u32 } && second == EMPTY {
            let mut after = Self::default();
            after.0[0] = if front { material as u32 } else { EMPTY };
            return InterfaceTransition {
                outside: self,
                inside: after,
                is_false_intersection: false,
                outside_ior: 1.0,
            };
        }
        self.transition_among(world, material, front, channel)
    }

    /// The same whatever else is there.
    fn transition_among(
        self,
        world: &PreparedWorld,
        material: usize,
        front: bool,
        channel: Option<usize>,
    ) -> InterfaceTransition {
        let material = material as u32;
        let (before, after) = if front {
            (self, self.push(material))
        } else if self.0.contains(&material) {
            (self, self.without(material))
        } else {
            (self.beneath(material), self)
        };
        let outside = if front { before } else { after };
        InterfaceTransition {
            outside: before,
            inside: after,
            is_false_intersection: before.current(world) == after.current(world),
            outside_ior: outside.current(world).map_or(1.0, |there| {
                ior(&world.geometry.materials[there].material, channel)
            }),
        }
    }

    /// What is lost per metre.
    pub fn absorption(&self, world: &PreparedWorld) -> Vec3 {
        self.current(world)
            .and_then(|there| world.geometry.materials[there].absorption)
            .unwrap_or(Vec3::ZERO)
    }

    /// Whether what is within is a closed body, and a light with this end is not within its box.
    fn light_outside_closed_body(&self, world: &PreparedWorld, end: DVec3) -> bool {
        let body = self
            .current(world)
            .and_then(|there| world.geometry.dielectric_bounds[there]);
        body.is_some_and(|[lower, upper]| end.cmplt(lower).any() || end.cmpgt(upper).any())
    }

    /// Of which material it is where the path is.
    #[inline]
    fn current(&self, world: &PreparedWorld) -> Option<usize> {
        if self.0[1] == EMPTY {
            return (!self.is_empty()).then_some(self.0[0] as usize);
        }
        let known = self.0.iter().take_while(|&&material| material != EMPTY);
        // Of equals, `max_by_key` takes the last.
        known
            .map(|&material| material as usize)
            .max_by_key(|&material| world.geometry.materials[material].material.priority)
    }

    fn push(mut self, material: u32) -> Self {
        if self.0[MAX_NESTING - 1] != EMPTY {
            self.0.rotate_left(1);
            self.0[MAX_NESTING - 1] = material;
        } else if let Some(place) = self.0.iter_mut().find(|place| **place == EMPTY) {
            *place = material;
        }
        self
    }

    fn without(mut self, material: u32) -> Self {
        if let Some(at) = self.0.iter().rposition(|&known| known == material) {
            self.0[at] = EMPTY;
            self.0[at..].rotate_left(1);
        }
        self
    }

    /// As if it had been entered before all others.
    fn beneath(mut self, material: u32) -> Self {
        self.0.rotate_right(1);
        self.0[0] = material;
        self
    }
}

impl PathTracer<'_> {
    /// What is lost on a way through clear matter.
    #[inline]
    pub(crate) fn absorb(&self, path: &mut PathState, distance: f64) {
        let absorption = path.interior_list.absorption(self.world);
        if absorption != Vec3::ZERO {
            path.throughput *= (-absorption * distance as f32).exp();
        }
    }

    /// The share of a light at `end` (scene-local, infinite where it is infinitely far away) that clear matter lets through to
    /// `start`, per channel, for a shadow ray that no surface stops; zero where none is asked for.
    #[inline]
    pub(crate) fn arrives(
        &self,
        ray: usize,
        media: InteriorList,
        start: DVec3,
        end: DVec3,
    ) -> Vec3 {
        if media.is_empty() {
            return Vec3::ONE;
        }
        let mut part = Vec3::ONE;
        if media.light_outside_closed_body(self.world, end) {
            if self.samplers[ray].get_1d_random(self.bounce) * INTERIOR_SHADOW_RATE >= 1.0 {
                return Vec3::ZERO;
            }
            part *= INTERIOR_SHADOW_RATE;
        }
        if end.x < f64::INFINITY {
            let way = (end - start).length() as f32;
            part *= (-media.absorption(self.world) * way).exp();
        }
        part
    }

    /// Goes on through a surface that other matter hides. Light sampling does not look through it: what the ray finds
    /// behind counts in full.
    pub(crate) fn go_on<S: BsdfModel>(
        &self,
        path: &mut PathState,
        surface: &ShadingPoint<S>,
        skin: InterfaceTransition,
        wave: &mut WavefrontQueues,
    ) {
        wave.next_rays
            .push(surface.interaction.spawn_ray(path.direction, f32::INFINITY));
        path.prev_context = surface.light_sample_context();
        path.bsdf_pdf = f32::INFINITY;
        path.interior_list = skin.inside;
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::{Glass, Material, MaterialModel, World};

    use super::*;
    use crate::control::Control;

    #[test]
    fn what_is_alone_is_met_as_among_others() {
        let mut world = World::default();
        for priority in [0, 3] {
            let material = Material {
                priority,
                model: MaterialModel::Glass(Glass::default()),
                ..Material::default()
            };
            world.add_material(material).unwrap();
        }
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let nothing = InteriorList::default();
        for media in [
            nothing,
            nothing.push(0),
            nothing.push(1),
            nothing.push(0).push(1),
        ] {
            for (material, front) in [(0, true), (0, false), (1, true), (1, false)] {
                let met = media.transition(&world, material, front, None);
                let among = media.transition_among(&world, material, front, None);
                assert_eq!(format!("{met:?}"), format!("{among:?}"));
            }
        }
    }
}

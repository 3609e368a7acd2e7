//! What clear matter a path is inside of: glass in water, water in a glass.
//!
//! C. M. Schmidt and B. Budge, "Simple Nested Dielectrics in Ray Traced Images", Journal of Graphics Tools 7(2), 2002:
//! where closed meshes overlap, the one of the highest priority is there, and the surfaces of the others are not. Among
//! equals, the one that was entered last is there: matter that lies within other matter displaces it.

use glam::{DVec3, Vec3};
use raycam_bvh::Hit;

use crate::bsdf::{Scattering, index};
use crate::integrator::path::{Path, Wave};
use crate::integrator::shade::Walk;
use crate::interaction::attributes::Surface;
use crate::prepare::PreparedWorld;

/// How many a path remembers; of more, the one it entered first is forgotten.
const DEPTH: usize = 6;
const NOTHING: u32 = u32::MAX;

/// Of so many shadow rays that should meet the border of a body one is asked for, and counts as all of them: not none, for
/// where parts of a mesh are turned inside out light does come that way.
const RARELY: f32 = 16.0;

/// Materials in the order in which they were entered. No material twice where one mesh is inside of itself: each skin
/// that is crossed counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Media([u32; DEPTH]);

impl Default for Media {
    fn default() -> Self {
        Self([NOTHING; DEPTH])
    }
}

/// What a surface of clear matter separates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Skin {
    /// Where the ray comes from, and where it goes if it passes.
    pub before: Media,
    pub after: Media,
    /// Whether something of a higher priority is on both sides: nothing happens to light here.
    pub hidden: bool,
    /// The index of refraction outside of the surface's own matter.
    pub around: f32,
}

impl Skin {
    /// That of a hit surface.
    #[inline]
    pub fn of(
        world: &PreparedWorld,
        media: Media,
        hit: &Hit,
        front: bool,
        channel: Option<usize>,
    ) -> Self {
        let index = world.material_index(hit.instance, hit.triangle);
        match world.materials[index].inside {
            None => Self::none(media),
            Some(_) => media.meet(world, index, front, channel),
        }
    }

    /// What light in a direction from the surface goes through.
    pub fn beyond(&self, normal: Vec3, direction: Vec3) -> Media {
        if normal.dot(direction) < 0.0 {
            self.after
        } else {
            self.before
        }
    }

    /// A surface that is no border of clear matter.
    pub fn none(media: Media) -> Self {
        Self {
            before: media,
            after: media,
            hidden: false,
            around: 1.0,
        }
    }
}

impl Media {
    pub fn is_empty(&self) -> bool {
        self.0[0] == NOTHING
    }

    /// What a ray meets at the surface of a material that has an inside. One that leaves what it never entered has begun
    /// there.
    fn meet(
        self,
        world: &PreparedWorld,
        material: usize,
        front: bool,
        channel: Option<usize>,
    ) -> Skin {
        let [first, second, ..] = self.0;
        // Nearly always: nothing else is there. Word by word: what was just written is not compared as a whole.
        if first == if front { NOTHING } else { material as u32 } && second == NOTHING {
            let mut after = Self::default();
            after.0[0] = if front { material as u32 } else { NOTHING };
            return Skin {
                before: self,
                after,
                hidden: false,
                around: 1.0,
            };
        }
        self.meet_among(world, material, front, channel)
    }

    /// The same whatever else is there.
    fn meet_among(
        self,
        world: &PreparedWorld,
        material: usize,
        front: bool,
        channel: Option<usize>,
    ) -> Skin {
        let material = material as u32;
        let (before, after) = if front {
            (self, self.with(material))
        } else if self.0.contains(&material) {
            (self, self.without(material))
        } else {
            (self.beneath(material), self)
        };
        let outside = if front { before } else { after };
        Skin {
            before,
            after,
            hidden: before.top(world) == after.top(world),
            around: outside.top(world).map_or(1.0, |there| {
                index(&world.materials[there].material, channel)
            }),
        }
    }

    /// What is lost per metre.
    pub fn absorption(&self, world: &PreparedWorld) -> Vec3 {
        self.top(world)
            .and_then(|there| world.materials[there].inside)
            .unwrap_or(Vec3::ZERO)
    }

    /// Whether what is within is a closed body, and a light with this end is not within its box.
    fn shuts_out(&self, world: &PreparedWorld, end: DVec3) -> bool {
        let body = self.top(world).and_then(|there| world.bodies[there]);
        body.is_some_and(|[lower, upper]| end.cmplt(lower).any() || end.cmpgt(upper).any())
    }

    /// Of which material it is where the path is.
    #[inline]
    fn top(&self, world: &PreparedWorld) -> Option<usize> {
        if self.0[1] == NOTHING {
            return (!self.is_empty()).then_some(self.0[0] as usize);
        }
        let known = self.0.iter().take_while(|&&material| material != NOTHING);
        // Of equals, `max_by_key` takes the last.
        known
            .map(|&material| material as usize)
            .max_by_key(|&material| world.materials[material].material.priority)
    }

    fn with(mut self, material: u32) -> Self {
        if self.0[DEPTH - 1] != NOTHING {
            self.0.rotate_left(1);
            self.0[DEPTH - 1] = material;
        } else if let Some(place) = self.0.iter_mut().find(|place| **place == NOTHING) {
            *place = material;
        }
        self
    }

    fn without(mut self, material: u32) -> Self {
        if let Some(at) = self.0.iter().rposition(|&known| known == material) {
            self.0[at] = NOTHING;
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

impl Walk<'_> {
    /// What is lost on a way through clear matter.
    #[inline]
    pub(crate) fn absorb(&self, path: &mut Path, distance: f64) {
        let absorption = path.media.absorption(self.world);
        if absorption != Vec3::ZERO {
            path.throughput *= (-absorption * distance as f32).exp();
        }
    }

    /// The share of a light at `end` (scene-local, infinite where it is infinitely far away) that clear matter lets through to
    /// `start`, per channel, for a shadow ray that no surface stops; zero where none is asked for.
    #[inline]
    pub(crate) fn arrives(&self, ray: usize, media: Media, start: DVec3, end: DVec3) -> Vec3 {
        if media.is_empty() {
            return Vec3::ONE;
        }
        let mut part = Vec3::ONE;
        if media.shuts_out(self.world, end) {
            if self.samplers[ray].chance(self.turn) * RARELY >= 1.0 {
                return Vec3::ZERO;
            }
            part *= RARELY;
        }
        if end.x < f64::INFINITY {
            let way = (end - start).length() as f32;
            part *= (-media.absorption(self.world) * way).exp();
        }
        part
    }

    /// Goes on through a surface that other matter hides. Light sampling does not look through it: what the ray finds
    /// behind counts in full.
    pub(crate) fn go_on<S: Scattering>(
        &self,
        path: &mut Path,
        surface: &Surface<S>,
        skin: Skin,
        wave: &mut Wave,
    ) {
        wave.rays
            .push(surface.place.leaving(path.direction, f32::INFINITY));
        path.from = surface.reference();
        path.pdf = f32::INFINITY;
        path.media = skin.after;
    }
}

#[cfg(test)]
mod tests {
    use raycam_scene::{Glass, Material, Reflectance, World};

    use super::*;
    use crate::control::Control;

    #[test]
    fn what_is_alone_is_met_as_among_others() {
        let mut world = World::default();
        for priority in [0, 3] {
            let material = Material {
                priority,
                reflectance: Reflectance::Glass(Glass::default()),
                ..Material::default()
            };
            world.add_material(material).unwrap();
        }
        let world = PreparedWorld::new(&world, None, None, &Control::new()).unwrap();
        let nothing = Media::default();
        for media in [
            nothing,
            nothing.with(0),
            nothing.with(1),
            nothing.with(0).with(1),
        ] {
            for (material, front) in [(0, true), (0, false), (1, true), (1, false)] {
                let met = media.meet(&world, material, front, None);
                let among = media.meet_among(&world, material, front, None);
                assert_eq!(format!("{met:?}"), format!("{among:?}"));
            }
        }
    }
}

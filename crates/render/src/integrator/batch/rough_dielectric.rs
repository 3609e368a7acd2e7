//! What paths do at rough glass, many at a time: what [`Walk::step`] does one by one.

use glam::Vec3;
use raycam_bvh::Hit;

use crate::bsdf::FrostedPoints;
use crate::integrator::batch::hits::Meetings;
use crate::integrator::batch::path_lanes::Arriving;
use crate::integrator::nested_dielectrics::{Media, Skin};
use crate::integrator::path::{Path, Wave};
use crate::integrator::shade::Walk;
use crate::interaction::Places;
use crate::light::Reference;
use crate::prepare::material::PreparedMaterial;
use crate::soa::LANES;

/// Paths at rough interfaces that refract.
#[derive(Debug, Default)]
pub(crate) struct Frosteds {
    /// What these do.
    pub points: FrostedPoints<LANES>,
    /// What the paths are in before the surface, and behind it.
    before: [Media; LANES],
    after: [Media; LANES],
}

impl Frosteds {
    /// What light goes through between a lane and where it comes from, by the triangle's normal.
    #[inline]
    pub fn beyond(&self, lane: usize, geometric: Vec3, direction: Vec3) -> Media {
        if geometric.dot(direction) < 0.0 {
            self.after[lane]
        } else {
            self.before[lane]
        }
    }
}

impl Walk<'_> {
    /// Sets a lane, where [`Walk::step_frosted`] knows what happens there.
    #[inline]
    pub(crate) fn put_frosted(
        &self,
        path: &Path,
        (prepared, hit): (&PreparedMaterial, &Hit),
        (places, lane): (&Places<LANES>, usize),
        arriving: &mut Arriving<LANES>,
        frosteds: &mut Frosteds,
    ) {
        // What the camera sees through something else chooses lights as nothing else does by now.
        let late = self.choice(path) != self.choice_of_turn();
        let lit = self.many || !(self.sampled || self.rules.ambient.is_some());
        if !prepared.frosted || late || !lit {
            return;
        }
        let channel = path.channel.map(usize::from);
        let skin = Skin::of(self.world, path.media, hit, places.front(lane), channel);
        // A path that leaves what it never entered is rare.
        if skin.hidden || skin.before != path.media {
            return;
        }
        let points = &mut frosteds.points;
        points.put((places, lane), self.world, hit, channel, skin.around);
        (frosteds.before[lane], frosteds.after[lane]) = (skin.before, skin.after);
        if points.is[lane] && !path.media.is_empty() {
            // Before it asks for light.
            let mut absorbed = *path;
            let distance = (places.position(lane) - path.from.position).length();
            self.absorb(&mut absorbed, distance);
            arriving.put(lane, &absorbed);
        }
    }

    /// [`Walk::step`] at a lane of [`Frosteds`].
    #[inline]
    pub(crate) fn step_frosted(
        &self,
        path: &mut Path,
        meetings: &Meetings,
        lane: usize,
        hit: &Hit,
        wave: &mut Wave,
        radiance: &mut [Vec3],
    ) -> bool {
        let Meetings {
            places,
            frosteds,
            asked,
            ..
        } = meetings;
        let out = &mut radiance[path.ray];
        let from = Reference {
            position: places.position(lane),
            normal: Vec3::ZERO,
        };
        let material = &self.world.material(hit).material;
        let distance = (from.position - path.from.position).length();
        self.absorb(path, distance);
        if meetings.arriving.near[lane] {
            self.pick_up(path, distance, out);
        }
        self.see_surface(path, material, hit, distance, out);
        if !self.free(path) && path.depth >= self.rules.max_depth {
            return false;
        }
        let geometric = places.geometric(lane);
        if self.many {
            asked.ask_through(lane, path.ray, &mut wave.shadows, |direction, end| {
                let media = frosteds.beyond(lane, geometric, direction);
                self.arrives(path.ray, media, places.start(lane, direction), end)
            });
        }
        let Some((sample, start)) = frosteds.points.sample(lane) else {
            return false;
        };
        let media = frosteds.beyond(lane, geometric, sample.direction);
        self.send(path, &sample, start, from, media, wave)
    }
}

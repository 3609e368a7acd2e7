//! What paths do at rough metals and plain principled surfaces, many at a time: what [`Walk::step`] does one by one.

use glam::Vec3;
use raycam_bvh::Hit;

use crate::bsdf::GlossyPoints;
use crate::integrator::batch::hits::Meetings;
use crate::integrator::path::{Path, Wave};
use crate::integrator::shade::Walk;
use crate::interaction::Places;
use crate::light::Reference;
use crate::prepare::material::PreparedMaterial;
use crate::soa::LANES;

impl Walk<'_> {
    /// Sets a lane, where [`Walk::step_glossy`] knows what happens there.
    #[inline]
    pub(crate) fn put_glossy(
        &self,
        path: &Path,
        (prepared, hit): (&PreparedMaterial, &Hit),
        (places, lane): (&Places<LANES>, usize),
        points: &mut GlossyPoints<LANES>,
    ) {
        let material = &prepared.material;
        // What the camera sees through something else chooses lights as nothing else does by now.
        let late = self.choice(path) != self.choice_of_turn();
        let known = prepared.glossy && path.media.is_empty();
        if !known || late || self.is_back(path, material, places.front(lane)) {
            return;
        }
        if self.many || !(self.sampled || self.rules.ambient.is_some()) {
            points.put((places, lane), self.world, prepared, hit);
        }
    }

    /// [`Walk::step`] at a lane of [`GlossyPoints`].
    #[inline]
    pub(crate) fn step_glossy(
        &self,
        path: &mut Path,
        meetings: &Meetings,
        lane: usize,
        hit: &Hit,
        wave: &mut Wave,
        radiance: &mut [Vec3],
    ) -> bool {
        let Meetings {
            places, arriving, ..
        } = meetings;
        let out = &mut radiance[path.ray];
        let from = Reference {
            position: places.position(lane),
            normal: places.geometric(lane),
        };
        let material = &self.world.material(hit).material;
        let distance = (from.position - path.from.position).length();
        if arriving.near[lane] {
            self.pick_up(path, distance, out);
        }
        self.see_surface(path, material, hit, distance, out);
        if !self.free(path) && path.depth >= self.rules.max_depth {
            return false;
        }
        if self.many {
            meetings.asked.ask(lane, path.ray, &mut wave.shadows);
        }
        match meetings.glossies.sample(lane) {
            Some((sample, start)) => self.send(path, &sample, start, from, path.media, wave),
            None => false,
        }
    }
}

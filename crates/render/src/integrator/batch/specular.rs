//! What paths do at mirrors and clear glass, many at a time: what [`Walk::step`] does one by one.

use glam::Vec3;
use raycam_bvh::{Hit, vectorized};

use crate::bsdf::{FindWays, ScatterSample, SmoothPoints};
use crate::integrator::batch::hits::Meetings;
use crate::integrator::nested_dielectrics::{Media, Skin};
use crate::integrator::path::{Path, Wave};
use crate::integrator::shade::Walk;
use crate::interaction::Places;
use crate::light::Reference;
use crate::prepare::material::PreparedMaterial;
use crate::soa::LANES;

/// How often a path from the camera goes both ways of clear glass, where each is often enough.
const MOST_FORKS: u8 = 2;

/// Paths at smooth metals and clear glass.
#[derive(Debug, Default)]
pub(crate) struct Smooths {
    /// Which they are, and what these do.
    pub points: SmoothPoints<LANES>,
    /// What the paths are in behind the surface.
    after: [Media; LANES],
}

impl Walk<'_> {
    /// Sets a lane, where [`Walk::step_smooth`] knows what happens there.
    #[inline]
    pub(crate) fn put_smooth(
        &self,
        path: &Path,
        (prepared, hit): (&PreparedMaterial, &Hit),
        (places, lane): (&Places<LANES>, usize),
        smooths: &mut Smooths,
    ) {
        if !prepared.clear {
            return;
        }
        let (material, front) = (&prepared.material, places.front(lane));
        let channel = path.channel.map(usize::from);
        let skin = Skin::of(self.world, path.media, hit, front, channel);
        // A path that leaves what it never entered is rare.
        if skin.hidden || skin.before != path.media {
            return;
        }
        let points = &mut smooths.points;
        let forks = path.forks < MOST_FORKS && path.straight;
        let at = (self.world, hit);
        points.put((places, lane), at, channel, skin.around, forks);
        if points.transmission(lane) == Vec3::ZERO && self.is_back(path, material, front) {
            points.is[lane] = false;
        }
        smooths.after[lane] = skin.after;
    }

    /// Finds where the paths of the lanes go on, by numbers that choose between ways.
    pub(crate) fn find_smooth(
        &self,
        choice: &[f32; LANES],
        places: &Places<LANES>,
        smooths: &mut Smooths,
    ) {
        if smooths.points.any() {
            vectorized(FindWays {
                places,
                choice,
                points: &mut smooths.points,
            });
        }
    }

    /// [`Walk::step`] at a lane of [`Smooths`].
    #[inline]
    pub(crate) fn step_smooth(
        &self,
        path: &mut Path,
        meetings: &Meetings,
        lane: usize,
        wave: &mut Wave,
        radiance: &mut [Vec3],
    ) -> bool {
        let Meetings {
            places,
            smooths,
            arriving,
            ..
        } = meetings;
        let geometric = places.geometric(lane);
        let from = Reference {
            position: places.position(lane),
            normal: if smooths.points.transmission(lane) == Vec3::ZERO {
                geometric
            } else {
                Vec3::ZERO
            },
        };
        if arriving.near[lane] || !path.media.is_empty() {
            let distance = (from.position - path.from.position).length();
            self.absorb(path, distance);
            self.pick_up(path, distance, &mut radiance[path.ray]);
        }
        if !self.free(path) && path.depth >= self.rules.max_depth {
            return false;
        }
        let go = |path: &mut Path, (sample, start): (ScatterSample, Vec3), wave: &mut Wave| {
            let media = if geometric.dot(sample.direction) < 0.0 {
                smooths.after[lane]
            } else {
                path.media
            };
            self.send(path, &sample, start, from, media, wave)
        };
        let fork = smooths.points.fork(lane).map(|through| {
            path.forks += 1;
            (*path, through)
        });
        let goes_on = match smooths.points.sample(lane) {
            Some(sample) => go(path, sample, wave),
            None => false,
        };
        if let Some((mut path, through)) = fork
            && go(&mut path, through, wave)
        {
            wave.forks.push(path);
        }
        goes_on
    }
}

//! Where the paths of a turn meet surfaces, and the random numbers that they need there.

use glam::Vec3;
use raycam_bvh::{Hit, vectorized};

use super::mattes::{Light, Mattes, Scatter};
use super::path::Path;
use super::smooths::Smooths;
use super::walk::Walk;
use crate::lanes::{Corners, LANES, Three, get, set_corners};
use crate::light::{LightSample, LightSamples, Reference, SampleArea, Source};
use crate::place::{Place, Places};
use crate::prepared_material::PreparedMaterial;
use crate::sampler::{Pair, Sampler};
use crate::scatter::{Aim, Directions};

/// Of all paths of a turn at once, and of some at a time what takes more room.
#[derive(Default)]
pub(super) struct Meetings {
    corners: Vec<Corners<LANES>>,
    scatter: Vec<[f32; 2]>,
    light: Vec<[f32; 2]>,
    /// Only where there is clear glass.
    which: Vec<[f32; 2]>,
    pub places: Places<LANES>,
    pub matte: Three<f32, LANES>,
    /// Of the light that is the only one.
    on_light: LightSamples<LANES>,
    pub mattes: Mattes<LANES>,
    pub smooths: Smooths,
}

/// One path's.
pub(super) struct Meeting<'a> {
    pub hit: &'a Hit,
    pub material: &'a PreparedMaterial,
    pub place: Place,
    /// Where the surface scatters to, if it is matte.
    pub matte: Vec3,
    /// ... and if it is not.
    pub scatter: [f32; 2],
    /// Where on the first light.
    pub light: [f32; 2],
    /// The sample of an area light that is the only one.
    pub on_area: Option<LightSample>,
}

impl Meetings {
    /// Begins a turn. Step by step over all of them: triangles come from all over the memory, and many are fetched at once.
    pub fn find(&mut self, walk: &Walk, live: &[u32], hits: &[Hit]) {
        let world = walk.world;
        let which = || live.iter().map(|&at| at as usize);
        let (scatter, light) = (Pair::Scatter(walk.turn), Pair::Light(walk.turn, 0));
        let (choice, all) = (Pair::Which(walk.turn), walk.samplers);
        let Self {
            scatter: of_scatter,
            light: of_light,
            which: of_choice,
            ..
        } = self;
        of_light.clear();
        of_choice.clear();
        // Together, as they are of one group.
        match (walk.sampled, walk.refracts) {
            (true, true) => {
                let out = [of_scatter, of_light, of_choice];
                Sampler::pairs(all, which(), [scatter, light, choice], out);
            }
            (true, false) => {
                Sampler::pairs(all, which(), [scatter, light], [of_scatter, of_light]);
            }
            (false, true) => {
                Sampler::pairs(all, which(), [scatter, choice], [of_scatter, of_choice]);
            }
            (false, false) => Sampler::pairs(all, which(), [scatter], [of_scatter]),
        }
        if !walk.sampled {
            self.light.resize(live.len(), [0.0; 2]);
        }
        let chunks = hits.chunks(LANES);
        if self.corners.len() < chunks.len() {
            self.corners.resize(chunks.len(), [[[0.0; LANES]; 3]; 3]);
        }
        for (hits, corners) in chunks.zip(&mut self.corners) {
            for (lane, hit) in hits.iter().enumerate() {
                set_corners(corners, lane, world.corners(hit.instance, hit.triangle));
            }
        }
    }

    /// Goes on to chunk `number` of [`LANES`] paths.
    pub fn locate(
        &mut self,
        walk: &Walk,
        number: usize,
        paths: &mut [Path],
        live: &[u32],
        hits: &[Hit],
    ) {
        let first = number * LANES;
        let mut random = [[0.0; LANES]; 2];
        let mut on_light = [[0.0; LANES]; 2];
        *self.places.begin() = self.corners[number];
        for (lane, (&at, hit)) in live.iter().zip(hits).enumerate() {
            let (index, path) = (first + lane, &mut paths[at as usize]);
            path.cone = path.cone.after(hit.t);
            let (direction, width) = (path.direction, path.cone.width);
            self.places.put(lane, walk.world, direction, hit, width);
            [random[0][lane], random[1][lane]] = self.scatter[index];
            [on_light[0][lane], on_light[1][lane]] = self.light[index];
        }
        vectorized(&mut self.places);
        vectorized(Directions {
            normals: self.places.normals(),
            random: &random,
            out: &mut self.matte,
        });
        if let Some(Source::Area(area)) = walk.only {
            vectorized(SampleArea {
                area,
                points: self.places.positions(),
                random: &on_light,
                out: &mut self.on_light,
            });
        }
        self.scatter(walk, number, paths, live, hits, &random);
    }

    /// What happens at matte surfaces.
    fn scatter(
        &mut self,
        walk: &Walk,
        number: usize,
        paths: &[Path],
        live: &[u32],
        hits: &[Hit],
        random: &[[f32; LANES]; 2],
    ) {
        let Self {
            places,
            matte,
            on_light,
            mattes,
            smooths,
            light: numbers,
            which,
            ..
        } = self;
        mattes.is = [false; LANES];
        smooths.points.begin();
        let mut aimed = [false; LANES];
        for (lane, (&at, hit)) in live.iter().zip(hits).enumerate() {
            let path = &paths[at as usize];
            let Some(albedo) = walk.plain(path, hit, places, lane) else {
                walk.put_smooth(path, hit, (places, lane), smooths);
                continue;
            };
            mattes.put(lane, albedo, path);
            // Through a mirror to a light are two segments more.
            aimed[lane] = path.depth.saturating_add(2) <= walk.rules.max_depth;
            if let Some(light) = walk.only
                && !matches!(light, Source::Area(_))
            {
                let from = Reference {
                    position: places.position(lane),
                    normal: places.geometric(lane),
                };
                on_light.put(lane, light.sample(&from, numbers[number * LANES + lane]));
            }
        }
        walk.find_smooth(which.get(number * LANES..).unwrap_or(&[]), places, smooths);
        if mattes.is == [false; LANES] {
            return;
        }
        mattes.aims.clear();
        if !walk.mirrors.is_empty() && aimed != [false; LANES] {
            vectorized(Aim {
                mirrors: walk.mirrors,
                places,
                active: &aimed,
                random,
                aims: &mut mattes.aims,
                out: matte,
            });
        }
        vectorized(Scatter {
            places,
            directions: matte,
            mattes,
        });
        walk.lights
            .find_near(&mattes.from, places.directions(), &mut mattes.near);
        if walk.only.is_some() {
            vectorized(Light {
                places,
                samples: on_light,
                found: walk.found,
                mattes,
            });
        }
    }

    /// One of the chunk at hand, by its hit.
    #[inline]
    pub fn at<'a>(&self, walk: &Walk<'a>, number: usize, lane: usize, hit: &'a Hit) -> Meeting<'a> {
        let index = number * LANES + lane;
        Meeting {
            hit,
            material: walk.world.material(hit),
            place: self.places.place(lane),
            matte: get(&self.matte, lane).into(),
            scatter: self.scatter[index],
            light: self.light[index],
            on_area: match walk.only {
                Some(Source::Area(_)) => self.on_light.at(lane),
                _ => None,
            },
        }
    }
}

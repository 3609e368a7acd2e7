//! Where the paths of a turn meet surfaces, and the random numbers that they need there.

use glam::Vec3;
use raycam_bvh::{Hit, vectorized};

use crate::bsdf::{Aim, Directions, FindFrosted, FindLobes, GlossyPoints};
use crate::integrator::batch::bsdf::Surfaces;
use crate::integrator::batch::diffuse::{Mattes, Scatter};
use crate::integrator::batch::direct_lighting::Asked;
use crate::integrator::batch::path_lanes::Arriving;
use crate::integrator::batch::rough_dielectric::Frosteds;
use crate::integrator::batch::specular::Smooths;
use crate::integrator::path::Path;
use crate::integrator::shade::Walk;
use crate::interaction::{Place, Places};
use crate::light::{Drawn, LightSample, SampleArea, Source};
use crate::prepare::material::PreparedMaterial;
use crate::sampling::sampler::{Pair, Sampler};
use crate::soa::{Corners, LANES, Three, get, set_corners};

/// Segments from a surface through a mirror to a light, at least.
pub(crate) const BY_MIRROR: u32 = 2;

/// Of all paths of a turn at once, and of some at a time what takes more room.
#[derive(Default)]
pub(crate) struct Meetings {
    corners: Vec<Corners<LANES>>,
    scatter: Vec<[f32; 2]>,
    pub places: Places<LANES>,
    /// Which surfaces are not there for the ray, by their opacity.
    pub absent: [bool; LANES],
    pub matte: Three<f32, LANES>,
    pub arriving: Arriving<LANES>,
    pub mattes: Mattes<LANES>,
    pub glossies: GlossyPoints<LANES>,
    pub smooths: Smooths,
    pub frosteds: Frosteds,
    pub asked: Asked,
}

/// One path's.
pub(crate) struct Meeting<'a> {
    pub hit: &'a Hit,
    pub material: &'a PreparedMaterial,
    pub place: Place,
    /// Where the surface scatters to, if it is matte.
    pub matte: Vec3,
    /// ... and if it is not.
    pub scatter: [f32; 2],
    /// Where on the first light.
    pub light: Drawn,
    /// The sample of an area light that is the only one.
    pub on_area: Option<LightSample>,
}

impl Meetings {
    /// Begins a turn. Step by step over all of them: triangles come from all over the memory, and many are fetched at once.
    pub fn find(&mut self, walk: &Walk, paths: &[Path], live: &[u32], hits: &[Hit]) {
        let world = walk.world;
        let which = || live.iter().map(|&at| paths[at as usize].ray);
        let turn = walk.turn;
        let Asked {
            draws,
            which: choices,
            ..
        } = &mut self.asked;
        let [first, more @ ..] = &mut draws.numbers;
        let (scatter, light) = (Pair::Scatter(turn), Pair::Light(turn, 0));
        let choice = Pair::Which(turn);
        choices.clear();
        let (samplers, out) = (walk.samplers, &mut self.scatter);
        // Together, as they are of one group.
        match (walk.sampled, (walk.sampled && walk.chosen) || walk.branches) {
            (true, true) => {
                let pairs = [scatter, light, choice];
                Sampler::pairs(samplers, which(), pairs, [out, first, choices]);
            }
            (true, false) => Sampler::pairs(samplers, which(), [scatter, light], [out, first]),
            (false, true) => Sampler::pairs(samplers, which(), [scatter, choice], [out, choices]),
            (false, false) => Sampler::pairs(samplers, which(), [scatter], [out]),
        }
        if !walk.sampled {
            first.clear();
            first.resize(live.len(), [0.0; 2]);
        }
        for i in walk.asked().filter(|&i| walk.many && i > 0) {
            let out = &mut more[i - 1];
            Sampler::pairs(samplers, which(), [Pair::Light(turn, i)], [out]);
        }
        if walk.sampled {
            draws.look_around(walk);
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
            [on_light[0][lane], on_light[1][lane]] = self.asked.draws.numbers[0][index];
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
                out: &mut self.asked.samples[0],
            });
        }
        self.scatter(walk, number, paths, live, hits, &random);
    }

    /// What happens at surfaces that are met many at a time.
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
            absent,
            matte,
            arriving,
            mattes,
            glossies,
            smooths,
            frosteds,
            asked,
            ..
        } = self;
        mattes.is = [false; LANES];
        glossies.begin();
        smooths.points.begin();
        frosteds.points.begin();
        let mut aimed = [false; LANES];
        for (lane, (&at, hit)) in live.iter().zip(hits).enumerate() {
            let path = &paths[at as usize];
            let material = walk.world.material(hit);
            arriving.put(lane, path);
            // The backs of one-sided surfaces are another matter.
            absent[lane] = !walk.is_back(path, &material.material, places.front(lane))
                && walk.is_absent(path, &material.material, hit);
            if absent[lane] {
                continue;
            }
            let Some(albedo) = walk.plain(path, (material, hit), places, lane) else {
                walk.put_glossy(path, (material, hit), (places, lane), glossies);
                walk.put_smooth(path, (material, hit), (places, lane), smooths);
                walk.put_frosted(path, (material, hit), (places, lane), arriving, frosteds);
                continue;
            };
            mattes.put(lane, albedo);
            aimed[lane] = path.depth.saturating_add(BY_MIRROR) <= walk.rules.max_depth;
        }
        arriving.find_near(walk.lights, places.directions());
        let mut choice = [0.0; LANES];
        let choices = asked.which.iter().skip(number * LANES);
        for (choice, [x, _]) in choice.iter_mut().zip(choices) {
            *choice = *x;
        }
        walk.find_smooth(&choice, places, smooths);
        if glossies.any() {
            vectorized(FindLobes {
                places,
                random,
                choice: &choice,
                points: glossies,
            });
        }
        if frosteds.points.any() {
            vectorized(FindFrosted {
                world: walk.world,
                places,
                random,
                choice: &choice,
                points: &mut frosteds.points,
            });
        }
        if mattes.any() {
            mattes.aims.clear();
            if !walk.mirrors.is_empty() && aimed != [false; LANES] {
                vectorized(Aim {
                    mirrors: walk.mirrors,
                    thrown: walk.thrown,
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
        }
        if walk.many && (mattes.any() || glossies.any() || frosteds.points.any()) {
            let surfaces = Surfaces {
                arriving,
                mattes,
                glossies,
                frosted: &frosteds.points,
                world: walk.world,
            };
            asked.find(walk, number, places, surfaces);
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
            light: self.asked.draws.of(0, index),
            on_area: match walk.only {
                Some(Source::Area(_)) => self.asked.samples[0].at(lane),
                _ => None,
            },
        }
    }
}

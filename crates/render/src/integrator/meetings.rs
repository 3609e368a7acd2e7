//! Where the paths of a turn meet surfaces, and the random numbers that they need there.

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, vectorized};

use super::path::Path;
use super::walk::Walk;
use crate::light::{Lamp, LampLanes, LightSample, Source};
use crate::place::{LANES, Met, Place, Three, get};
use crate::sampler::{Pair, Sampler};
use crate::scatter::Directions;

/// Of all paths of a turn at once, and of some at a time what takes more room.
#[derive(Default)]
pub(super) struct Meetings {
    corners: Vec<[DVec3; 3]>,
    scatter: Vec<[f32; 2]>,
    light: Vec<[f32; 2]>,
    met: Met<LANES>,
    matte: Three<f32, LANES>,
    lamp: LampLanes<LANES>,
}

/// One path's.
pub(super) struct Meeting {
    pub place: Place,
    /// Where the surface scatters to, if it is matte.
    pub matte: Vec3,
    /// ... and if it is not.
    pub scatter: [f32; 2],
    /// Where on the first light.
    pub light: [f32; 2],
    /// The sample of an area light that is the only one.
    pub lamp: Option<LightSample>,
}

impl Meetings {
    /// Begins a turn. Step by step over all of them: triangles come from all over the memory, and many are fetched at once.
    pub fn find(&mut self, walk: &Walk, paths: &mut [Path], hits: &[Hit]) {
        let world = walk.world;
        let which = || paths.iter().map(|path| path.ray);
        let pair = Pair::Scatter(walk.turn);
        Sampler::pairs(walk.samplers, which(), pair, &mut self.scatter);
        self.light.clear();
        if walk.sampled {
            let pair = Pair::Light(walk.turn, 0);
            Sampler::pairs(walk.samplers, which(), pair, &mut self.light);
        } else {
            self.light.resize(paths.len(), [0.0; 2]);
        }
        self.corners.clear();
        self.corners.extend(hits.iter().map(|hit| {
            let mesh = &*world.objects[hit.instance as usize].mesh.mesh;
            let vertices = mesh.triangles[hit.triangle as usize];
            world.corners_of(hit.instance, vertices)
        }));
    }

    /// Goes on to chunk `number` of [`LANES`] paths.
    pub fn locate(&mut self, walk: &Walk, number: usize, paths: &mut [Path], hits: &[Hit]) {
        let first = number * LANES;
        let mut random = [[0.0; LANES]; 2];
        let mut on_light = [[0.0; LANES]; 2];
        self.met.clear();
        for (lane, (path, hit)) in paths.iter_mut().zip(hits).enumerate() {
            let index = first + lane;
            path.cone = path.cone.after(hit.t);
            let (corners, width) = (self.corners[index], path.cone.width);
            self.met
                .put(lane, walk.world, corners, path.direction, hit, width);
            [random[0][lane], random[1][lane]] = self.scatter[index];
            [on_light[0][lane], on_light[1][lane]] = self.light[index];
        }
        vectorized(&mut self.met);
        vectorized(Directions {
            normals: self.met.normals(),
            random: &random,
            out: &mut self.matte,
        });
        if let Some(Source::Area(area)) = walk.only {
            vectorized(Lamp {
                area,
                points: self.met.positions(),
                random: &on_light,
                out: &mut self.lamp,
            });
        }
    }

    /// One of the chunk at hand.
    #[inline]
    pub fn at(&self, walk: &Walk, number: usize, lane: usize) -> Meeting {
        let index = number * LANES + lane;
        Meeting {
            place: self.met.place(lane),
            matte: get(&self.matte, lane).into(),
            scatter: self.scatter[index],
            light: self.light[index],
            lamp: match walk.only {
                Some(Source::Area(area)) => self.lamp.at(area, lane),
                _ => None,
            },
        }
    }
}

//! Where the paths of a turn meet surfaces, and the random numbers that they need there.

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, vectorized};

use super::path::Path;
use super::walk::Walk;
use crate::lanes::{LANES, Three, get};
use crate::light::{AreaSamples, LightSample, SampleArea, Source};
use crate::place::{Place, Places};
use crate::prepare::PreparedMaterial;
use crate::sampler::{Pair, Sampler};
use crate::scatter::Directions;

/// Of all paths of a turn at once, and of some at a time what takes more room.
#[derive(Default)]
pub(super) struct Meetings {
    corners: Vec<[DVec3; 3]>,
    scatter: Vec<[f32; 2]>,
    light: Vec<[f32; 2]>,
    places: Places<LANES>,
    matte: Three<f32, LANES>,
    on_area: AreaSamples<LANES>,
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
    pub fn find(&mut self, walk: &Walk, paths: &[Path], hits: &[Hit]) {
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
        self.places.clear();
        for (lane, (path, hit)) in paths.iter_mut().zip(hits).enumerate() {
            let index = first + lane;
            path.cone = path.cone.after(hit.t);
            let (corners, width) = (self.corners[index], path.cone.width);
            self.places
                .put(lane, walk.world, corners, path.direction, hit, width);
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
                out: &mut self.on_area,
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
                Some(Source::Area(area)) => self.on_area.at(area, lane),
                _ => None,
            },
        }
    }
}

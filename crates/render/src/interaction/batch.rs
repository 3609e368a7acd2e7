//! Places, many at a time, field by field.

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, Loops};

use crate::bsdf::Frame;
use crate::interaction::attributes::{is_far_from_ends, unit_normal};
use crate::interaction::{Place, beside};
use crate::prepare::texture::Footprint;
use crate::prepare::{PreparedWorld, Rounding};
use crate::soa::{Corners, Three, corners, get, set, vector};

/// Rays, the triangles that they meet, and where. Each lane is computed as it would be alone.
#[derive(Debug)]
pub(crate) struct Places<const N: usize> {
    /// In the world at first, then scene-local.
    corners: Corners<N>,
    origin: DVec3,
    /// At the corners, in the world and of any length, where the mesh has normals.
    normals: [Three<f64, N>; 3],
    /// Whether it has, and whether any has.
    smooth: [bool; N],
    any_smooth: bool,
    /// Of the second and third corner.
    weights: [[f64; N]; 2],
    direction: Three<f32, N>,
    mirrored: [bool; N],
    /// The columns of `of_point`, and `of_mesh`.
    rounding: [Three<f64, N>; 4],
    footprint: [Footprint; N],
    /// The triangle's normal: at first where its corners run counter-clockwise, then on the viewer's side.
    outwards: Three<f64, N>,
    /// The rest is what a [`Place`] has.
    position: Three<f64, N>,
    geometric: Three<f32, N>,
    normal: Three<f32, N>,
    front: [bool; N],
    above: Three<f32, N>,
    below: Three<f32, N>,
}

impl<const N: usize> Default for Places<N> {
    fn default() -> Self {
        Self {
            corners: [[[0.0; N]; 3]; 3],
            origin: DVec3::ZERO,
            normals: [[[0.0; N]; 3]; 3],
            smooth: [false; N],
            any_smooth: false,
            weights: [[0.0; N]; 2],
            direction: [[0.0; N]; 3],
            mirrored: [false; N],
            rounding: [[[0.0; N]; 3]; 4],
            footprint: [Footprint::default(); N],
            outwards: [[0.0; N]; 3],
            position: [[0.0; N]; 3],
            geometric: [[0.0; N]; 3],
            normal: [[0.0; N]; 3],
            front: [false; N],
            above: [[0.0; N]; 3],
            below: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> Places<N> {
    /// Forgets all; returns the corners of the triangles, in the world, to be set before the lanes are put. What lanes hold
    /// that are not does not matter.
    #[inline]
    pub fn begin(&mut self) -> &mut Corners<N> {
        self.any_smooth = false;
        &mut self.corners
    }

    /// Sets a lane: the ray in this direction whose hit it is.
    #[inline]
    pub fn put(
        &mut self,
        lane: usize,
        world: &PreparedWorld,
        direction: Vec3,
        hit: &Hit,
        width: f32,
    ) {
        let object = &world.objects[hit.instance as usize];
        self.origin = world.origin;
        self.weights[0][lane] = f64::from(hit.u);
        self.weights[1][lane] = f64::from(hit.v);
        set(&mut self.direction, lane, direction.to_array());
        self.mirrored[lane] = object.mirrored;
        for (lanes, column) in self.rounding.iter_mut().zip(object.rounding.columns()) {
            set(lanes, lane, column.to_array());
        }
        let normals = world.normals_of(hit.instance, hit.triangle);
        self.smooth[lane] = normals.is_some();
        if let Some(normals) = normals {
            self.any_smooth = true;
            for (lanes, normal) in self.normals.iter_mut().zip(normals) {
                set(lanes, lane, normal.to_array());
            }
        }
        if !world.textures.is_empty() {
            let local = self.corners(lane).map(|corner| corner - world.origin);
            self.footprint[lane] = Footprint::new(local, direction, width);
        }
    }

    /// What a lane has, after [`Loops::run`].
    #[inline(always)]
    pub fn place(&self, lane: usize) -> Place {
        Place {
            position: self.position(lane),
            geometric: self.geometric(lane),
            normal: self.normal(lane),
            front: self.front[lane],
            above: get(&self.above, lane).into(),
            below: get(&self.below, lane).into(),
            footprint: self.footprint[lane],
        }
    }

    /// Where they are, scene-local.
    pub fn positions(&self) -> &Three<f64, N> {
        &self.position
    }

    /// [`Place::geometric`] of a lane.
    #[inline(always)]
    pub fn geometric(&self, lane: usize) -> Vec3 {
        get(&self.geometric, lane).into()
    }

    /// Of the triangles, on the viewers' side.
    pub fn geometrics(&self) -> &Three<f32, N> {
        &self.geometric
    }

    /// The normal of the smooth surface of a lane.
    #[inline(always)]
    pub fn normal(&self, lane: usize) -> Vec3 {
        get(&self.normal, lane).into()
    }

    /// [`Place::position`] of a lane.
    #[inline(always)]
    pub fn position(&self, lane: usize) -> DVec3 {
        vector(&self.position, lane)
    }

    /// [`Place::front`] of a lane.
    #[inline(always)]
    pub fn front(&self, lane: usize) -> bool {
        self.front[lane]
    }

    /// [`Place::footprint`] of a lane.
    #[inline(always)]
    pub fn footprint(&self, lane: usize) -> &Footprint {
        &self.footprint[lane]
    }

    /// [`Place::start`] of a lane.
    #[inline(always)]
    pub fn start(&self, lane: usize, direction: Vec3) -> DVec3 {
        let below = self.geometric(lane).dot(direction) < 0.0;
        let (above, beneath) = (get(&self.above, lane), get(&self.below, lane));
        let beyond = Vec3::from(if below { beneath } else { above });
        self.position(lane) + beyond.as_dvec3()
    }

    /// [`Place::frame`] of a lane, seen along its ray.
    #[inline(always)]
    pub fn frame(&self, lane: usize) -> Frame {
        let direction = Vec3::from(get(&self.direction, lane));
        Frame::new(self.geometric(lane), self.normal(lane), -direction)
    }

    /// Of the rays.
    pub fn directions(&self) -> &Three<f32, N> {
        &self.direction
    }

    /// The normals of the smooth surfaces.
    pub fn normals(&self) -> &Three<f32, N> {
        &self.normal
    }

    #[inline(always)]
    fn corners(&self, lane: usize) -> [DVec3; 3] {
        corners(&self.corners, lane)
    }

    #[inline(always)]
    fn rounding(&self, lane: usize, position: DVec3, normal: DVec3) -> f64 {
        let [x, y, z, of_mesh] = &self.rounding;
        let of_point = [vector(x, lane), vector(y, lane), vector(z, lane)];
        Rounding::along(of_point, vector(of_mesh, lane), position, normal)
    }

    #[inline(always)]
    fn localize(&mut self) {
        for corner in &mut self.corners {
            for (values, origin) in corner.iter_mut().zip(self.origin.to_array()) {
                for value in values {
                    *value -= origin;
                }
            }
        }
    }

    #[inline(always)]
    fn face(&mut self) {
        let mut sound = [false; N];
        for (lane, sound) in sound.iter_mut().enumerate() {
            let [a, b, c] = self.corners(lane);
            let cross = (b - a).cross(c - a);
            let square = cross.length_squared();
            *sound = is_far_from_ends(square);
            set(&mut self.outwards, lane, (cross / square.sqrt()).to_array());
        }
        if sound != [true; N] {
            for lane in (0..N).filter(|&lane| !sound[lane]) {
                let normal = unit_normal(self.corners(lane));
                set(&mut self.outwards, lane, normal.to_array());
            }
        }
    }

    #[inline(always)]
    fn locate(&mut self) {
        for lane in 0..N {
            let [a, b, c] = self.corners(lane);
            let (e1, e2) = (b - a, c - a);
            let position = a + e1 * self.weights[0][lane] + e2 * self.weights[1][lane];
            let outwards = vector(&self.outwards, lane);
            let direction = Vec3::from(get(&self.direction, lane)).as_dvec3();
            let outside = outwards.dot(direction) <= 0.0;
            let geometric = if outside { outwards } else { -outwards };
            let beyond = geometric * self.rounding(lane, position, geometric);
            self.front[lane] = outside != self.mirrored[lane];
            set(&mut self.position, lane, position.to_array());
            set(&mut self.outwards, lane, geometric.to_array());
            set(&mut self.geometric, lane, geometric.as_vec3().to_array());
            set(&mut self.normal, lane, geometric.as_vec3().to_array());
            set(&mut self.above, lane, beyond.as_vec3().to_array());
            set(&mut self.below, lane, (-beyond).as_vec3().to_array());
        }
    }

    /// The normal of the smooth surface that the corners' normals describe, on the side of the triangle's, and how far above
    /// the triangle it lies: rays start there, so that a coarse mesh does not shade itself (J. Hanika, "Hacking the Shadow
    /// Terminator", Ray Tracing Gems II, 2021, chapter 4).
    #[inline(always)]
    fn smooth(&mut self) {
        for lane in 0..N {
            let corners = self.corners(lane);
            let position = vector(&self.position, lane);
            let geometric = vector(&self.outwards, lane);
            let beyond = geometric * self.rounding(lane, position, geometric);
            let [u, v] = [self.weights[0][lane], self.weights[1][lane]];
            let weights = [1.0 - u - v, u, v];
            let (mut normal, mut lift) = (DVec3::ZERO, DVec3::ZERO);
            for k in 0..3 {
                let of_corner = beside(vector(&self.normals[k], lane), geometric);
                normal += of_corner * weights[k];
                let below = (corners[k] - position).dot(of_corner).max(0.0);
                lift += of_corner * (weights[k] * below);
            }
            let normal = normal.normalize_or(geometric).as_vec3().to_array();
            let above = (beyond + lift).as_vec3().to_array();
            for axis in 0..3 {
                let smooth = self.smooth[lane];
                let (n, a) = (&mut self.normal[axis][lane], &mut self.above[axis][lane]);
                *n = if smooth { normal[axis] } else { *n };
                *a = if smooth { above[axis] } else { *a };
            }
        }
    }
}

impl<const N: usize> Loops for &mut Places<N> {
    #[inline(always)]
    fn run(self) {
        self.localize();
        self.face();
        self.locate();
        if self.any_smooth {
            self.smooth();
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Material, Mesh, Object, World};

    use super::*;
    use crate::control::Control;
    use crate::soa::{LANES, set_corners};

    /// A floor, a smooth ball, the same mirrored and stretched, and a triangle without area.
    fn world() -> PreparedWorld {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([8.0, 8.0]).unwrap());
        let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
        let line = [0.0, 1.0, 3.0].map(|x| DVec3::new(x, x, 1.0)).to_vec();
        let line = world.add_mesh(Mesh {
            vertices: line,
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        });
        let material = world.add_material(Material::default()).unwrap();
        let mirrored = DAffine3::from_translation(DVec3::new(1e3, 0.1, -2.0))
            * DAffine3::from_rotation_x(0.3)
            * DAffine3::from_scale(DVec3::new(-1.0, 2.0, 0.7));
        for (mesh, place) in [
            (floor, DAffine3::IDENTITY),
            (ball, DAffine3::IDENTITY),
            (ball, mirrored),
            (line, DAffine3::IDENTITY),
        ] {
            let object = Object::new("", mesh, vec![material], place);
            world.add_object(object).unwrap();
        }
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    #[test]
    fn every_lane_is_what_it_is_alone() {
        let world = world();
        let hits: Vec<_> = (0..320u32)
            .map(|i| {
                let instance = i * 7 % 4;
                let mesh = &world.objects[instance as usize].mesh.mesh;
                let triangle = i * 31 % mesh.triangles.len() as u32;
                let angle = i as f32;
                let direction = Vec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin());
                let hit = Hit {
                    t: 1.0,
                    u: (i % 10) as f32 / 20.0,
                    v: (i % 7) as f32 / 14.0,
                    instance,
                    triangle,
                };
                (direction.normalize(), hit)
            })
            .collect();
        let mut met = Places::<LANES>::default();
        let mut smooth = 0;
        for some in hits.chunks(LANES) {
            let corners = met.begin();
            for (lane, (_, hit)) in some.iter().enumerate() {
                set_corners(corners, lane, world.corners(hit.instance, hit.triangle));
            }
            for (lane, (direction, hit)) in some.iter().enumerate() {
                met.put(lane, &world, *direction, hit, 0.0);
            }
            raycam_bvh::vectorized(&mut met);
            for (lane, (direction, hit)) in some.iter().enumerate() {
                let alone = Place::new(&world, *direction, hit, 0.0);
                assert_eq!(format!("{:?}", met.place(lane)), format!("{alone:?}"));
                smooth += usize::from(alone.normal != alone.geometric);
            }
        }
        assert_eq!(smooth, 160);
    }
}

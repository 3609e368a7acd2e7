//! Surface interactions of a batch of hits, as a structure of arrays.

use glam::{DVec3, Vec3};
use raycam_bvh::{Hit, WithSimd};

use crate::interaction::SurfaceInteraction;
use crate::interaction::ray_cone::{Footprint, RayCone};
use crate::interaction::vector::{is_safe_square, normalize_facing, unit_normal};
use crate::lobes::shading_frame::ShadingFrame;
use crate::prepare::geometry::Geometry;
use crate::prepare::instance::ErrorBounds;
use crate::soa::{TriangleXN, Vec3xN, get_lane, get_triangle, lane_dvec3, set_lane, set_triangle};

/// Rays, hit triangles and the resulting interactions. A lane's result does not depend on the other lanes.
#[derive(Debug)]
pub(crate) struct SurfaceInteractions<const N: usize> {
    /// World-space vertices of the hit triangles, which the kernel converts to scene-local coordinates.
    corners: TriangleXN<N>,
    scene_origin: DVec3,
    /// World-space vertex normals of arbitrary length, if the mesh has them.
    vertex_normals: [Vec3xN<f64, N>; 3],
    /// For each lane, true if it has vertex normals.
    has_normals: [bool; N],
    /// For each lane, true if the surface is curved and only reflects.
    side_is_smooth: [bool; N],
    any_has_normals: bool,
    /// Weights of the second and third vertex.
    barycentrics: [[f64; N]; 2],
    direction: Vec3xN<f32, N>,
    flips_orientation: [bool; N],
    /// Error bounds of the lanes' instances, in the form of [`ErrorBounds::columns`].
    error_bounds: [Vec3xN<f64, N>; 4],
    footprint: [Footprint; N],
    /// Unit geometric normal: on the counter-clockwise side until the kernel has computed the positions, then on the
    /// viewer's side.
    unoriented_normal: Vec3xN<f64, N>,
    /// Fields of [`SurfaceInteraction`], one value per lane.
    position: Vec3xN<f64, N>,
    side_normal: Vec3xN<f32, N>,
    shading_normal: Vec3xN<f32, N>,
    is_front: [bool; N],
    offset_front: Vec3xN<f32, N>,
    offset_back: Vec3xN<f32, N>,
}

impl<const N: usize> Default for SurfaceInteractions<N> {
    fn default() -> Self {
        Self {
            corners: [[[0.0; N]; 3]; 3],
            scene_origin: DVec3::ZERO,
            vertex_normals: [[[0.0; N]; 3]; 3],
            has_normals: [false; N],
            side_is_smooth: [false; N],
            any_has_normals: false,
            barycentrics: [[0.0; N]; 2],
            direction: [[0.0; N]; 3],
            flips_orientation: [false; N],
            error_bounds: [[[0.0; N]; 3]; 4],
            footprint: [Footprint::default(); N],
            unoriented_normal: [[0.0; N]; 3],
            position: [[0.0; N]; 3],
            side_normal: [[0.0; N]; 3],
            shading_normal: [[0.0; N]; 3],
            is_front: [false; N],
            offset_front: [[0.0; N]; 3],
            offset_back: [[0.0; N]; 3],
        }
    }
}

impl<const N: usize> SurfaceInteractions<N> {
    /// Clears the batch. Returns the world-space vertices, which must be written before the lanes are set. Unused lanes
    /// may have any values.
    #[inline]
    pub fn clear(&mut self) -> &mut TriangleXN<N> {
        self.any_has_normals = false;
        &mut self.corners
    }

    /// Sets a lane to the hit of a ray with this direction and cone width.
    #[inline]
    pub fn set_lane(&mut self, lane: usize, geometry: &Geometry, direction: Vec3, hit: &Hit, cone: &RayCone) {
        let object = &geometry.instances[hit.instance as usize];
        self.scene_origin = geometry.origin;
        self.barycentrics[0][lane] = f64::from(hit.u);
        self.barycentrics[1][lane] = f64::from(hit.v);
        set_lane(&mut self.direction, lane, direction.to_array());
        self.flips_orientation[lane] = object.flips_orientation;
        for (lanes, column) in self.error_bounds.iter_mut().zip(object.error_bounds.columns()) {
            set_lane(lanes, lane, column.to_array());
        }
        let normals = geometry.vertex_normals(hit.instance, hit.triangle);
        self.has_normals[lane] = normals.is_some();
        if let Some(normals) = normals {
            // If all vertex normals are equal, the triangle is not part of a curved surface.
            let is_curved = normals[0] != normals[1] || normals[1] != normals[2];
            self.side_is_smooth[lane] = is_curved && geometry.material(hit).reflects_only;
            self.any_has_normals = true;
            for (lanes, normal) in self.vertex_normals.iter_mut().zip(normals) {
                set_lane(lanes, lane, normal.to_array());
            }
        }
        if !geometry.textures.is_empty() {
            let local = self.corners(lane).map(|corner| corner - geometry.origin);
            self.footprint[lane] = Footprint::new(local, direction, cone);
        }
    }

    /// Interaction of a lane, after the kernel has run.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> SurfaceInteraction {
        SurfaceInteraction {
            position: self.position(lane),
            side_normal: self.side_normal(lane),
            shading_normal: self.shading_normal(lane),
            is_front: self.is_front[lane],
            offset_front: get_lane(&self.offset_front, lane).into(),
            offset_back: get_lane(&self.offset_back, lane).into(),
            footprint: self.footprint[lane],
        }
    }

    /// Scene-local positions of the lanes' hits.
    pub fn positions(&self) -> &Vec3xN<f64, N> {
        &self.position
    }

    /// [`SurfaceInteraction::side_normal`] of a lane.
    #[inline(always)]
    pub fn side_normal(&self, lane: usize) -> Vec3 {
        get_lane(&self.side_normal, lane).into()
    }

    /// [`SurfaceInteraction::side_normal`] of every lane.
    pub fn side_normals(&self) -> &Vec3xN<f32, N> {
        &self.side_normal
    }

    /// Shading normal of a lane.
    #[inline(always)]
    pub fn shading_normal(&self, lane: usize) -> Vec3 {
        get_lane(&self.shading_normal, lane).into()
    }

    /// [`SurfaceInteraction::position`] of a lane.
    #[inline(always)]
    pub fn position(&self, lane: usize) -> DVec3 {
        lane_dvec3(&self.position, lane)
    }

    /// [`SurfaceInteraction::is_front`] of a lane.
    #[inline(always)]
    pub fn is_front(&self, lane: usize) -> bool {
        self.is_front[lane]
    }

    /// [`SurfaceInteraction::footprint`] of a lane.
    #[inline(always)]
    pub fn footprint(&self, lane: usize) -> &Footprint {
        &self.footprint[lane]
    }

    /// [`SurfaceInteraction::offset_ray_origin`] of a lane.
    #[inline(always)]
    pub fn offset_ray_origin(&self, lane: usize, direction: Vec3) -> DVec3 {
        let below = self.side_normal(lane).dot(direction) < 0.0;
        let (above, beneath) = (get_lane(&self.offset_front, lane), get_lane(&self.offset_back, lane));
        let beyond = Vec3::from(if below { beneath } else { above });
        self.position(lane) + beyond.as_dvec3()
    }

    /// [`SurfaceInteraction::shading_frame`] of a lane, for its ray.
    #[inline(always)]
    pub fn shading_frame(&self, lane: usize) -> ShadingFrame {
        let direction = Vec3::from(get_lane(&self.direction, lane));
        ShadingFrame::new(self.side_normal(lane), self.shading_normal(lane), -direction)
    }

    /// Ray directions of the lanes.
    pub fn directions(&self) -> &Vec3xN<f32, N> {
        &self.direction
    }

    /// Shading normals of the lanes.
    pub fn shading_normals(&self) -> &Vec3xN<f32, N> {
        &self.shading_normal
    }

    #[inline(always)]
    fn corners(&self, lane: usize) -> [DVec3; 3] {
        get_triangle(&self.corners, lane)
    }

    #[inline(always)]
    fn error_along(&self, lane: usize, position: DVec3, normal: DVec3) -> f64 {
        let [x, y, z, of_mesh] = &self.error_bounds;
        let of_point = [lane_dvec3(x, lane), lane_dvec3(y, lane), lane_dvec3(z, lane)];
        ErrorBounds::error_along(of_point, lane_dvec3(of_mesh, lane), position, normal)
    }

    #[inline(always)]
    fn to_local(&mut self) {
        for corner in &mut self.corners {
            for (values, origin) in corner.iter_mut().zip(self.scene_origin.to_array()) {
                for value in values {
                    *value -= origin;
                }
            }
        }
    }

    #[inline(always)]
    fn orient_normals(&mut self) {
        let mut sound = [false; N];
        for (lane, sound) in sound.iter_mut().enumerate() {
            let [a, b, c] = self.corners(lane);
            let cross = (b - a).cross(c - a);
            let square = cross.length_squared();
            *sound = is_safe_square(square);
            set_lane(&mut self.unoriented_normal, lane, (cross / square.sqrt()).to_array());
        }
        if sound != [true; N] {
            for lane in (0..N).filter(|&lane| !sound[lane]) {
                let normal = unit_normal(self.corners(lane));
                set_lane(&mut self.unoriented_normal, lane, normal.to_array());
            }
        }
    }

    #[inline(always)]
    fn compute_positions(&mut self) {
        for lane in 0..N {
            let [a, b, c] = self.corners(lane);
            let (e1, e2) = (b - a, c - a);
            let position = a + e1 * self.barycentrics[0][lane] + e2 * self.barycentrics[1][lane];
            let outwards = lane_dvec3(&self.unoriented_normal, lane);
            let direction = Vec3::from(get_lane(&self.direction, lane)).as_dvec3();
            let outside = outwards.dot(direction) <= 0.0;
            let geometric = if outside { outwards } else { -outwards };
            let beyond = geometric * self.error_along(lane, position, geometric);
            self.is_front[lane] = outside != self.flips_orientation[lane];
            set_lane(&mut self.position, lane, position.to_array());
            set_lane(&mut self.unoriented_normal, lane, geometric.to_array());
            set_lane(&mut self.side_normal, lane, geometric.as_vec3().to_array());
            set_lane(&mut self.shading_normal, lane, geometric.as_vec3().to_array());
            set_lane(&mut self.offset_front, lane, beyond.as_vec3().to_array());
            set_lane(&mut self.offset_back, lane, (-beyond).as_vec3().to_array());
        }
    }

    /// Interpolates vertex normals on the geometric normal's side, and lifts ray origins to the smooth
    /// surface that the normals describe, so that a coarse mesh does not shadow itself (J. Hanika, "Hacking
    /// the Shadow Terminator", Ray Tracing Gems II, 2021, chapter 4). The smooth surface also separates the
    /// two sides of a curved surface that only reflects.
    #[inline(always)]
    fn interpolate_normals(&mut self) {
        for lane in 0..N {
            let corners = self.corners(lane);
            let position = lane_dvec3(&self.position, lane);
            let geometric = lane_dvec3(&self.unoriented_normal, lane);
            let beyond = geometric * self.error_along(lane, position, geometric);
            let [u, v] = [self.barycentrics[0][lane], self.barycentrics[1][lane]];
            let weights = [1.0 - u - v, u, v];
            let (mut normal, mut lift) = (DVec3::ZERO, DVec3::ZERO);
            for k in 0..3 {
                let of_corner = normalize_facing(lane_dvec3(&self.vertex_normals[k], lane), geometric);
                normal += of_corner * weights[k];
                let below = (corners[k] - position).dot(of_corner).max(0.0);
                lift += of_corner * (weights[k] * below);
            }
            let normal = normal.normalize_or(geometric).as_vec3().to_array();
            let above = (beyond + lift).as_vec3().to_array();
            for axis in 0..3 {
                let smooth = self.has_normals[lane];
                let (n, a) = (&mut self.shading_normal[axis][lane], &mut self.offset_front[axis][lane]);
                *n = if smooth { normal[axis] } else { *n };
                let side = &mut self.side_normal[axis][lane];
                *side = if smooth & self.side_is_smooth[lane] { normal[axis] } else { *side };
                *a = if smooth { above[axis] } else { *a };
            }
        }
    }
}

impl SurfaceInteraction {
    /// Interaction of a ray with this direction at its hit; `cone` is the ray's cone at the hit.
    pub fn new(world: &Geometry, direction: Vec3, hit: &Hit, cone: &RayCone) -> Self {
        let corners = world.corners(hit.instance, hit.triangle);
        let mut interactions = SurfaceInteractions::<1>::default();
        set_triangle(interactions.clear(), 0, corners);
        interactions.set_lane(0, world, direction, hit, cone);
        interactions.run();
        interactions.lane(0)
    }
}

impl<const N: usize> WithSimd for &mut SurfaceInteractions<N> {
    #[inline(always)]
    fn run(self) {
        self.to_local();
        self.orient_normals();
        self.compute_positions();
        if self.any_has_normals {
            self.interpolate_normals();
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Glass, Material, MaterialModel, Mesh, Object, World};

    use super::*;
    use crate::control::Control;
    use crate::prepare::world::PreparedWorld;
    use crate::soa::{LANES, set_triangle};

    /// A floor, a smooth ball, the same ball in glass (mirrored and stretched), and a degenerate triangle.
    fn world() -> PreparedWorld {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([8.0, 8.0]).unwrap());
        let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
        let line = [0.0, 1.0, 3.0].map(|x| DVec3::new(x, x, 1.0)).to_vec();
        let line = world.add_mesh(Mesh { vertices: line, triangles: vec![[0, 1, 2]], ..Mesh::default() });
        let matte = world.add_material(Material::default()).unwrap();
        let model = MaterialModel::Glass(Glass::default());
        let glass = world.add_material(Material { model, ..Material::default() }).unwrap();
        let mirrored = DAffine3::from_translation(DVec3::new(1e3, 0.1, -2.0))
            * DAffine3::from_rotation_x(0.3)
            * DAffine3::from_scale(DVec3::new(-1.0, 2.0, 0.7));
        for (mesh, place, material) in [
            (floor, DAffine3::IDENTITY, matte),
            (ball, DAffine3::IDENTITY, matte),
            (ball, mirrored, glass),
            (line, DAffine3::IDENTITY, matte),
        ] {
            let object = Object::new("", mesh, vec![material], place);
            world.add_object(object).unwrap();
        }
        PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
    }

    #[test]
    fn batched_interactions_equal_single_interactions() {
        let world = world();
        let hits: Vec<_> = (0..320u32)
            .map(|i| {
                let instance = i * 7 % 4;
                let mesh = &world.geometry.instances[instance as usize].mesh.mesh;
                let triangle = i * 31 % mesh.triangles.len() as u32;
                let angle = i as f32;
                let direction = Vec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin());
                let hit = Hit { t: 1.0, u: (i % 10) as f32 / 20.0, v: (i % 7) as f32 / 14.0, instance, triangle };
                (direction.normalize(), hit)
            })
            .collect();
        let mut interactions = SurfaceInteractions::<LANES>::default();
        let mut apart = [0; 4];
        for some in hits.chunks(LANES) {
            let corners = interactions.clear();
            for (lane, (_, hit)) in some.iter().enumerate() {
                set_triangle(corners, lane, world.geometry.corners(hit.instance, hit.triangle));
            }
            for (lane, (direction, hit)) in some.iter().enumerate() {
                interactions.set_lane(lane, &world.geometry, *direction, hit, &RayCone::default());
            }
            raycam_bvh::dispatch_simd(&mut interactions);
            for (lane, (direction, hit)) in some.iter().enumerate() {
                let alone = SurfaceInteraction::new(&world.geometry, *direction, hit, &RayCone::default());
                assert_eq!(format!("{:?}", interactions.lane(lane)), format!("{alone:?}"));
                apart[hit.instance as usize] += usize::from(alone.shading_normal != alone.side_normal);
            }
        }
        // On a curved surface that only reflects, the side normal is the shading normal.
        assert_eq!(apart, [0, 0, 80, 0]);
    }
}

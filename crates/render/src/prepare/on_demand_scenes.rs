//! Scenes for many rays: all instances in one flattened BVH, or two levels with re-braided leaves.
//!
//! If instances overlap or are close together, like objects on a floor, most rays traverse several BVHs from their
//! roots. A single BVH over all triangles has one root, but its build time and memory are justified only for many rays:
//! the samples of one frame, or the exact rays of all frames of a static world. Worlds that move between frames keep
//! the two-level scene. Its leaves are whole instances until many rays are traced.

use std::sync::atomic::Ordering;

use glam::DVec3;
use raycam_bvh::{ExactHit, ExactRay, Scene, Tie, TlasLeaves};
use rayon::prelude::*;

use crate::prepare::geometry::{Geometry, OnDemandScenes, build_scene};
use crate::prepare::instance::PreparedInstance;
use crate::thread_pool::in_pool;

/// Samples per triangle that justify building the flattened scene if instances are close together, including a margin.
const SAMPLES_TO_PAY: u64 = 4;
/// Samples per triangle that justify building the flattened scene if instances are far apart, so that few rays enter
/// several instances.
const SAMPLES_TO_PAY_SPARSE: u64 = 24;
/// Exact rays per triangle that justify building the flattened scene; exact rays are fewer and coherent.
const EXACT_RAYS_TO_PAY: u64 = 8;
/// Exact rays per triangle that justify building the flattened scene for a world that was created from another world by
/// moving objects. Such a world will probably be moved again.
const EXACT_RAYS_TO_PAY_MOVED: u64 = 256;
/// Rays per triangle that justify re-braiding, which creates one reference per 64 triangles.
const RAYS_TO_PAY_REBRAIDING: u64 = 1;
/// Rays per triangle that justify re-braiding for a world that was created from another world by moving objects. Such a
/// world will probably be moved again.
const RAYS_TO_PAY_REBRAIDING_MOVED: u64 = 4;
/// Minimum number of rays that justify re-braiding, even for few triangles.
const MIN_RAYS_TO_PAY_REBRAIDING: u64 = 1 << 15;
/// Maximum number of triangles in a flattened scene; the build requires about 200 bytes per triangle.
const MAX_TRIANGLES: usize = 1 << 22;
/// Smallest extent of an instance's mean triangle, in float32 steps of the scene's radius: coarser coordinates would
/// deform small objects.
const MIN_F32_STEPS: f64 = 64.0;

impl Geometry {
    /// Two-level scene; its leaves are re-braided if enough rays were traced.
    pub(crate) fn two_level(&self) -> &Scene {
        self.on_demand.rebraided.get().and_then(Option::as_ref).unwrap_or(&self.scene)
    }

    /// Counts rays or points, and re-braids the two-level scene as soon as their number justifies it. Hits do not
    /// change.
    pub(crate) fn note_rays(&self, rays: u64) {
        let OnDemandScenes { rebraided, two_level_rays, is_of_moved, .. } = &*self.on_demand;
        if self.instances.len() < 2 || rebraided.get().is_some() {
            return;
        }
        let rays = two_level_rays.fetch_add(rays, Ordering::Relaxed).saturating_add(rays);
        let to_pay = if *is_of_moved { RAYS_TO_PAY_REBRAIDING_MOVED } else { RAYS_TO_PAY_REBRAIDING };
        if rays >= (to_pay * self.triangle_count() as u64).max(MIN_RAYS_TO_PAY_REBRAIDING) {
            // The build does not run inside `get_or_init`, for the same reason as the build of the flattened scene.
            let build = || build_scene(TlasLeaves::Subtrees, &self.instances, self.origin).ok();
            let _ = rebraided.set(in_pool(build).ok().flatten());
        }
    }

    /// Scene against which a frame of this many samples is traced. The choice depends only on the world and the number
    /// of samples, so that equal frames are bit-identical.
    pub(crate) fn scene_for_samples(&self, samples: u64) -> &Scene {
        let flattened = self.flattened_if_worth(|_| self.flattening_pays(samples));
        flattened.unwrap_or_else(|| {
            self.note_rays(samples);
            self.two_level()
        })
    }

    /// True if a frame of this many samples justifies building the flattened scene.
    pub(crate) fn flattening_pays(&self, samples: u64) -> bool {
        let enough = |each| samples / each >= self.triangle_count() as u64;
        enough(SAMPLES_TO_PAY_SPARSE) || (enough(SAMPLES_TO_PAY) && self.instances_are_close())
    }

    /// Returns the flattened scene, if it can be built and `pays` returns true for the number of triangles; built on
    /// first use.
    fn flattened_if_worth(&self, pays: impl Fn(u64) -> bool) -> Option<&Scene> {
        if self.scene.is_single_level() || !pays(self.triangle_count() as u64) {
            return None;
        }
        let tree = &self.on_demand.flattened;
        if tree.get().is_none() {
            // The build must not run inside `get_or_init`: a building thread steals tasks of other renders, and a
            // stolen task of the same world would wait for this build forever. The first result wins; all are equal.
            let _ = tree.set(in_pool(|| self.flatten()).ok().flatten());
        }
        tree.get().and_then(Option::as_ref)
    }

    /// Counts exact rays and builds the flattened scene as soon as their number justifies it. Hits do not change.
    pub(crate) fn note_exact_rays(&self, rays: u64) {
        let OnDemandScenes { flattened, exact_rays, is_of_moved, .. } = &*self.on_demand;
        if flattened.get().is_none() {
            let rays = exact_rays.fetch_add(rays, Ordering::Relaxed).saturating_add(rays);
            let to_pay = if *is_of_moved { EXACT_RAYS_TO_PAY_MOVED } else { EXACT_RAYS_TO_PAY };
            self.flattened_if_worth(|triangles| rays / to_pay >= triangles);
        }
    }

    /// Scene in which exact hits are found: the flattened scene if it has been built, otherwise the two-level scene.
    pub(crate) fn exact_scene(&self) -> &Scene {
        let flattened = self.on_demand.flattened.get().and_then(Option::as_ref);
        flattened.unwrap_or_else(|| self.two_level())
    }

    /// Nearest hit of every ray in float64. Returns the rays that hit several objects at the same distance,
    /// up to rounding, in ascending order of the rays.
    pub(crate) fn closest_exact(&self, rays: &[ExactRay], hits: &mut [ExactHit]) -> Vec<Tie> {
        self.exact_scene().closest_exact(rays, self, hits)
    }

    /// True if the box of one instance contains all other instances, such as a room that contains objects.
    pub(crate) fn is_room(&self) -> bool {
        let corners = || self.instance_boxes().map(|(middle, half)| [middle - half, middle + half]);
        let all = corners().reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
        corners().any(|own| Some(own) == all)
    }

    /// Centre and half diagonal of the box of every instance.
    fn instance_boxes(&self) -> impl Iterator<Item = (DVec3, DVec3)> {
        self.instances.iter().filter(|object| object.is_visible).map(|object: &PreparedInstance| {
            let (mesh, place) = (&object.mesh, object.world_from_mesh);
            let middle = place.transform_point3((mesh.lower + mesh.upper) / 2.0);
            (middle, place.matrix3.abs() * (mesh.upper - mesh.lower) / 2.0)
        })
    }

    /// True if the gap between the boxes of any two instances is at most a quarter of the smaller box's size.
    /// Also true, without a test, for very many instances.
    fn instances_are_close(&self) -> bool {
        const MAX_COMPARED: usize = 1 << 12;
        let boxes: Vec<(DVec3, DVec3)> = self.instance_boxes().collect();
        let near = |(i, &(middle, half)): (usize, &(DVec3, DVec3))| {
            let mut others = boxes[..i].iter();
            others.any(|&(other, other_half)| {
                let gap = (middle - other).abs() - half - other_half;
                gap.max_element() <= half.max_element().min(other_half.max_element()) / 2.0
            })
        };
        boxes.len() > MAX_COMPARED || boxes.iter().enumerate().any(near)
    }

    /// Number of triangles of all instances; shared meshes count once per instance.
    fn triangle_count(&self) -> usize {
        let count = |object| self.instance_triangles(object).len();
        (0..self.instances.len()).map(count).sum()
    }

    /// Triangles of an instance; empty if rays cannot hit the instance.
    fn instance_triangles(&self, object: usize) -> &[[u32; 3]] {
        let object = &self.instances[object];
        if object.is_visible { &object.mesh.mesh.triangles } else { &[] }
    }

    /// Builds the flattened scene; `None` if the scene would be too large or too coarse.
    fn flatten(&self) -> Option<Scene> {
        if !(1..=MAX_TRIANGLES).contains(&self.triangle_count()) {
            return None;
        }
        let (mut vertices, mut triangles, mut firsts) = (vec![], vec![], vec![]);
        for (i, object) in self.instances.iter().enumerate() {
            let mesh = &object.mesh;
            let size = object.world_from_mesh.matrix3.abs() * (mesh.upper - mesh.lower);
            let count = self.instance_triangles(i).len();
            let step = f64::from(f32::EPSILON) * self.radius;
            if count > 0 && size.max_element() < MIN_F32_STEPS * step * (count as f64).sqrt() {
                return None;
            }
            let before = u32::try_from(vertices.len()).ok()?;
            firsts.push(u32::try_from(triangles.len()).ok()?);
            if count == 0 {
                continue;
            }
            triangles.extend(self.instance_triangles(i).iter().map(|t| t.map(|i| before + i)));
            let local = |&vertex| {
                let vertex = object.world_from_mesh.transform_point3(vertex);
                (vertex - self.origin).as_vec3().to_array()
            };
            vertices.par_extend(mesh.mesh.vertices.par_iter().with_min_len(1 << 14).map(local));
        }
        Scene::flattened(&vertices, &triangles, firsts, self.origin.to_array()).ok()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, DMat3};
    use raycam_scene::mesh::primitive;
    use raycam_scene::{Camera, Light, Material, Object, PixelCenter, World};

    use super::*;
    use crate::control::Control;
    use crate::film::channel::Channel;
    use crate::film::image_plane::ImagePlane;
    use crate::prepare::world::PreparedWorld;
    use crate::settings::{Integrator, Settings};
    use crate::tile_renderer::traced_samples;

    /// Balls on a floor: one ball is stretched, and two balls share a mesh.
    fn world() -> World {
        let mut world = World::default();
        let floor = world.add_mesh(primitive::plane([8.0, 8.0]).unwrap());
        let ball = world.add_mesh(primitive::sphere(0.5, 3).unwrap());
        let material = world.add_material(Material::default()).unwrap();
        let stretched = DAffine3::from_rotation_x(0.3) * DAffine3::from_scale(DVec3::new(1.0, 2.0, 1.0));
        for (mesh, place) in [
            (floor, DAffine3::IDENTITY),
            (ball, DAffine3::from_translation(DVec3::new(-0.8, 0.0, 0.5))),
            (ball, DAffine3::from_translation(DVec3::new(0.8, 0.5, 0.6)) * stretched),
        ] {
            let object = Object::new("", mesh, vec![material], place);
            world.add_object(object).unwrap();
        }
        world.add_light(Light::uniform_sky([1.0; 3])).unwrap();
        world
    }

    fn camera(eye: [f64; 3], size: [u32; 2]) -> Camera {
        let [x, y] = size.map(|pixels| f64::from(pixels) / 2.0 - 0.5);
        let k = DMat3::from_cols_array(&[50.0, 0.0, 0.0, 0.0, 50.0, 0.0, x, y, 1.0]);
        Camera::look_at(eye.into(), DVec3::new(0.0, 0.0, 0.4), DVec3::Z, k, size, PixelCenter::Integer).unwrap()
    }

    fn prepare(world: &World, previous: Option<&PreparedWorld>) -> PreparedWorld {
        PreparedWorld::new(world, previous, None, &Control::new()).unwrap()
    }

    #[test]
    fn many_samples_use_the_flattened_scene() {
        let world = world();
        let prepared = prepare(&world, None);
        let triangles = prepared.geometry.triangle_count() as u64;
        assert_eq!(triangles, 2 + 2 * 1280);
        let few = prepared.geometry.scene_for_samples(SAMPLES_TO_PAY * triangles - 1);
        assert!(!few.is_single_level());
        let many = prepared.geometry.scene_for_samples(SAMPLES_TO_PAY * triangles);
        assert!(many.is_single_level());
        // The scene is reused while no object moves.
        let mut lit = world.clone();
        lit.lights.clear();
        let lit = prepare(&lit, Some(&prepared));
        assert!(Arc::ptr_eq(&lit.geometry.on_demand, &prepared.geometry.on_demand));
        let mut moved = world.clone();
        moved.objects[1].world_from_mesh.translation.x += 0.1;
        let moved = prepare(&moved, Some(&prepared));
        assert!(moved.geometry.on_demand.flattened.get().is_none());
        // If instances are far apart, more samples are needed to justify the build.
        let mut apart = world.clone();
        for (i, object) in apart.objects.iter_mut().enumerate() {
            object.world_from_mesh.translation.z += 4.0 * i as f64;
        }
        let apart = prepare(&apart, None);
        let few = apart.geometry.scene_for_samples(SAMPLES_TO_PAY_SPARSE * triangles - 1);
        assert!(!few.is_single_level());
        assert!(apart.geometry.scene_for_samples(SAMPLES_TO_PAY_SPARSE * triangles).is_single_level());
    }

    #[test]
    fn samples_in_closed_rooms_count_every_segment() {
        let mut world = world();
        let traced = |world: &World, max_depth, integrator| {
            let settings = Settings { max_depth, integrator, ..Settings::default() };
            traced_samples(&prepare(world, None), &camera([0.5, -3.0, 2.0], [6, 4]), &settings, 10)
        };
        let walls = world.add_mesh(primitive::box_([9.0; 3]).unwrap());
        world.add_object(Object::new("", walls, world.objects[0].materials.clone(), DAffine3::IDENTITY)).unwrap();
        assert_eq!(traced(&world, None, Integrator::Path), 240, "under a sky");
        world.lights[0] = Light::Point { position: [3.0; 3], intensity: Some([1.0; 3]), power: None, radius: 0.0 };
        let depths = [None, Some(3)].map(|depth| traced(&world, depth, Integrator::Path));
        assert_eq!((depths, traced(&world, None, Integrator::Direct)), ([8 * 240, 3 * 240], 240));
        world.objects[3].world_from_mesh.translation.x += 1.0;
        assert_eq!(traced(&world, None, Integrator::Path), 240, "the floor extends beyond the room");
    }

    #[test]
    fn concurrent_renders_do_not_deadlock() {
        // The mesh has enough triangles for a parallel build.
        let mut world = world();
        world.meshes[1] = Arc::new(primitive::sphere(0.5, 6).unwrap());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2);
        let pool = pool.build().unwrap();
        for _ in 0..10 {
            let prepared = prepare(&world, None);
            // The renders start from threads outside the pool, like Python's threads.
            std::thread::scope(|scope| {
                for turn in 0..8 {
                    let (pool, prepared) = (&pool, &prepared);
                    scope.spawn(move || {
                        std::thread::sleep(std::time::Duration::from_millis(turn));
                        pool.install(|| assert!(prepared.geometry.scene_for_samples(u64::MAX).is_single_level()));
                    });
                }
            });
        }
    }

    #[test]
    fn exact_rays_use_the_flattened_scene_after_enough_rays() {
        let mut world = world();
        // Where objects coincide, the last object is hit.
        for i in [0, 1, 0, 2, 0] {
            let object = world.objects[i].clone();
            world.add_object(object).unwrap();
        }
        let prepared = prepare(&world, None);
        let camera = camera([0.5, -3.0, 2.0], [120, 80]);
        let settings =
            Settings { channels: vec![Channel::Instance, Channel::Triangle, Channel::Position], ..Settings::default() };
        let picture = || crate::render(&prepared, &camera, &settings, &Control::new()).unwrap();
        let (pixels, triangles) = (120 * 80, prepared.geometry.triangle_count() as u64);
        let without = picture();
        for _ in 1..EXACT_RAYS_TO_PAY * triangles / pixels {
            picture();
        }
        assert!(prepared.geometry.on_demand.flattened.get().is_none());
        let with = picture();
        assert!(prepared.geometry.on_demand.flattened.get().is_some_and(Option::is_some));
        assert!(without.planes[..2] == with.planes[..2]);
        match &with.planes[0].1 {
            ImagePlane::I32 { data, .. } => assert_eq!(data.iter().max(), Some(&7)),
            other => panic!("{other:?}"),
        }
        let bits = |frame: &crate::Frame| match &frame.planes[2].1 {
            ImagePlane::F64 { data, .. } => data.iter().map(|v| v.to_bits()).collect::<Vec<_>>(),
            other => panic!("{other:?}"),
        };
        assert!(bits(&without) == bits(&with));
    }

    #[test]
    fn worlds_are_rebraided_after_enough_rays() {
        let world = world();
        let still = prepare(&world, None);
        let mut other = world.clone();
        other.objects[1].world_from_mesh.translation.x += 0.1;
        let moved = prepare(&other, Some(&still));
        let enough = MIN_RAYS_TO_PAY_REBRAIDING;
        assert!(moved.geometry.triangle_count() as u64 * RAYS_TO_PAY_REBRAIDING_MOVED < enough);
        let own: *const Scene = &*moved.geometry.scene;
        moved.geometry.note_rays(enough - 1);
        assert!(std::ptr::eq(moved.geometry.two_level(), own));
        let ray = |i: u32| {
            let [x, y] = [i % 64, i / 64].map(|step| f64::from(step) / 16.0 - 2.0);
            ExactRay { origin: [x, y, 3.0], direction: [0.01 * x, 0.02, -1.0], t_min: 0.0, t_max: f64::INFINITY }
        };
        let (rays, mut hits) = ((0..4096).map(ray).collect::<Vec<_>>(), vec![ExactHit::MISS; 4096]);
        moved.geometry.closest_exact(&rays, &mut hits);
        let before = hits.clone();
        assert!(before.iter().any(|hit| hit.instance == 1));
        moved.geometry.note_rays(1);
        assert!(!std::ptr::eq(moved.geometry.two_level(), own));
        moved.geometry.closest_exact(&rays, &mut hits);
        assert!(hits == before);
        // The scene is reused while no object moves.
        let again = prepare(&other, Some(&moved));
        assert!(std::ptr::eq(again.geometry.two_level(), moved.geometry.two_level()));
    }

    #[test]
    fn small_objects_in_a_large_world_keep_two_level_scenes() {
        let mut world = world();
        let scale = DAffine3::from_scale(DVec3::splat(100.0));
        world.objects[0].world_from_mesh = scale;
        assert!(prepare(&world, None).geometry.scene_for_samples(u64::MAX).is_single_level());
        world.objects[0].world_from_mesh = scale * scale;
        assert!(!prepare(&world, None).geometry.scene_for_samples(u64::MAX).is_single_level());
    }

    #[test]
    fn images_do_not_depend_on_earlier_movement_or_scene_type() {
        let world = world();
        let prepared = prepare(&world, None);
        let camera = camera([0.5, -5.0, 3.0], [60, 40]);
        let settings =
            Settings { integrator: Integrator::Path, max_depth: Some(4), samples: 32, ..Settings::default() };
        let picture = |world: &PreparedWorld| {
            let frame = crate::render(world, &camera, &settings, &Control::new()).unwrap();
            match &frame.planes[0].1 {
                ImagePlane::F32 { data, .. } => data.clone(),
                other => panic!("{other:?}"),
            }
        };
        let merged = picture(&prepared);
        assert!(prepared.geometry.on_demand.flattened.get().is_some());
        // An object is moved away and back, and its mesh is reused.
        let mut away = world.clone();
        away.objects[1].world_from_mesh.translation.x += 0.1;
        let away = prepare(&away, Some(&prepared));
        assert!(picture(&away) != merged);
        assert!(picture(&prepare(&world, Some(&away))) == merged);
        // The moved world uses the two-level scene.
        let mut apart = prepare(&world, None);
        apart.geometry.on_demand = Arc::new(OnDemandScenes { flattened: None.into(), ..OnDemandScenes::default() });
        assert!(!apart.geometry.scene_for_samples(u64::MAX).is_single_level());
        let apart = picture(&apart);
        let same = merged.iter().zip(&apart).filter(|(a, b)| (**a - **b).abs() < 1e-5).count();
        assert!(same * 100 > 98 * merged.len(), "{same} of {}", merged.len());
        let mean = |data: &[f32]| data.iter().map(|v| f64::from(*v)).sum::<f64>() / data.len() as f64;
        assert!((mean(&merged) / mean(&apart) - 1.0).abs() < 1e-3);
    }
}

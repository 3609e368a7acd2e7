//! From a world as written to a world as rendered.

pub(crate) mod dielectric_bounds;
pub(crate) mod flattened;
pub(crate) mod material;
pub(crate) mod mesh;
pub mod texture;

use std::collections::HashSet;
use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DMat3, DVec3};
use raycam_bvh::{BuildError, Bvh, ExactTriangles, Instance, Scene};
use raycam_scene::{Alpha, Camera, Material, Object, TextureCache, World};

use crate::control::Control;
use crate::error::RenderError;
use crate::guiding::caustic_casters::{CausticCaster, find_caustic_casters};
use crate::guiding::caustic_map::CausticMap;
use crate::light::{Lights, default_lights};
use crate::prepare::dielectric_bounds::closed_dielectric_bounds;
use crate::prepare::flattened::FlattenedScene;
use crate::prepare::material::{PreparedMaterial, prepare_materials};
use crate::prepare::mesh::{PreparedMesh, prepare_meshes};
use crate::prepare::texture::{PreparedTexture, prepare_textures};
use crate::thread_pool::with_pool;
use crate::tile_renderer::screen_mask;

/// A placed mesh.
#[derive(Debug)]
pub(crate) struct PreparedInstance {
    pub mesh: Arc<PreparedMesh>,
    pub world_from_mesh: DAffine3,
    /// Whether that changes nothing.
    is_identity: bool,
    /// Takes normals to the world: the inverse transpose of the linear part, up to length.
    pub normal_from_mesh: DMat3,
    /// Whether it turns counter-clockwise triangles clockwise.
    pub flips_orientation: bool,
    /// Per slot, an index into [`PreparedWorld::materials`].
    pub materials: Vec<usize>,
    /// Its number in the world's categories, or -1.
    pub category: i32,
    pub error_bounds: ErrorBounds,
}

/// A world ready to be rendered: acceleration structures, instances and lights relative to a local origin.
#[derive(Debug)]
pub struct PreparedWorld {
    pub(crate) scene: Scene,
    /// All of it in one tree, made when it is needed: see [`PreparedWorld::scene_for`].
    pub(crate) flattened: Arc<FlattenedScene>,
    /// The world coordinates of the scene-local origin: the centre of everything.
    pub(crate) origin: DVec3,
    /// Everything lies within this distance of `origin`.
    pub(crate) radius: f64,
    pub(crate) instances: Vec<PreparedInstance>,
    /// Where they lie: see [`screen_mask::object_bounds`].
    pub(crate) object_bounds: Vec<[DVec3; 2]>,
    pub(crate) materials: Arc<Vec<PreparedMaterial>>,
    /// For each material, where closed bodies of it lie: see [`dielectric_bounds`].
    pub(crate) dielectric_bounds: Vec<Option<[DVec3; 2]>>,
    /// Whether some material's opacity counts.
    pub(crate) has_transparency: bool,
    pub(crate) textures: Arc<Vec<Arc<PreparedTexture>>>,
    /// Where their images are, if something bounds them.
    pub(crate) texture_memory: Option<Arc<TextureCache>>,
    /// What gathers light.
    pub(crate) caustic_casters: Vec<CausticCaster>,
    /// What each of these throws, found when paths need it: see [`crate::integrator::guide`]. None of a moment of an exposure.
    pub(crate) caustic_maps: OnceLock<Vec<CausticMap>>,
    pub(crate) lights: Arc<Lights>,
    /// What lights a world without lights.
    pub(crate) default_lights: Option<Arc<Lights>>,
}

impl PreparedWorld {
    /// The camera, whose rays from infinity start before everything.
    pub(crate) fn camera_outside(&self, camera: &Camera) -> Camera {
        camera.with_ray_origins_outside(self.origin, self.radius)
    }

    /// Prepares a world. Meshes that `previous` already holds (the same `Arc`) are not built again, so that moving
    /// objects, lights and materials cost next to nothing. Stops between meshes when `control` is cancelled.
    ///
    /// # Errors
    /// [`RenderError::World`] and [`RenderError::Build`] where parts of the world do not fit together,
    /// [`RenderError::Cancelled`], and those of [`with_pool`].
    pub fn new(
        world: &World,
        previous: Option<&PreparedWorld>,
        threads: Option<usize>,
        control: &Control,
    ) -> Result<Self, RenderError> {
        validate(world)?;
        let meshes = with_pool(threads, || prepare_meshes(world, previous, control))??;
        control.check()?;
        let placed = |object: &Object| meshes[object.mesh].clone();
        let meshes: Vec<_> = world.objects.iter().filter_map(placed).collect();
        let (lower, upper) = world_bounds(&world.objects, &meshes);
        let origin = lower + (upper - lower) / 2.0;
        // In our pool too: rayon's own does not survive a fork.
        let (objects, scene) = with_pool(threads, || build_instances(world, meshes, origin))??;
        let materials = Arc::new(prepare_materials(&world.materials));
        let textures = prepare_textures(world, previous.map(|previous| &previous.textures[..]));
        let mut prepared = Self {
            scene,
            flattened: Arc::default(),
            origin,
            radius: (upper - origin).length(),
            object_bounds: screen_mask::object_bounds(&objects, origin, (upper - origin).length()),
            dielectric_bounds: with_pool(threads, || {
                closed_dielectric_bounds(&objects, &materials, origin)
            })?,
            instances: objects,
            materials,
            has_transparency: has_transparency(world),
            textures: Arc::new(textures),
            texture_memory: world.texture_cache.clone(),
            caustic_casters: vec![],
            caustic_maps: OnceLock::new(),
            lights: Arc::default(),
            default_lights: None,
        };
        if let Some(previous) = previous.filter(|previous| prepared.has_same_instances(previous)) {
            prepared.flattened = previous.flattened.clone();
        }
        prepared.caustic_casters = find_caustic_casters(&prepared);
        with_pool(threads, || prepared.build_lights(world))?;
        Ok(prepared)
    }

    /// Whether its objects have the same meshes in the same places.
    fn has_same_instances(&self, other: &Self) -> bool {
        let place = |object: &PreparedInstance| (Arc::as_ptr(&object.mesh), object.world_from_mesh);
        let places = self.instances.iter().map(place);
        places.eq(other.instances.iter().map(place))
    }

    /// Makes the lights of the world, once its objects are there.
    pub(crate) fn build_lights(&mut self, world: &World) {
        let lights =
            Lights::new(&world.lights, world.up, self.origin).with_emissive_triangles(self);
        self.lights = Arc::new(lights);
        let dark = match world.emission_keeps_default_lights {
            true => world.lights.is_empty(),
            false => self.lights.count() == 0,
        };
        self.default_lights = dark.then(|| {
            let lights = Lights::new(&default_lights(world.up), world.up, self.origin);
            Arc::new(lights.with_emissive_triangles(self))
        });
    }

    /// How many objects have the very acceleration structure that `other` has too.
    pub fn objects_shared_with(&self, other: &PreparedWorld) -> usize {
        let theirs: HashSet<_> = other
            .instances
            .iter()
            .map(|o| Arc::as_ptr(&o.mesh))
            .collect();
        let shared = |object: &&PreparedInstance| theirs.contains(&Arc::as_ptr(&object.mesh));
        self.instances.iter().filter(shared).count()
    }

    /// The acceleration structure of an object's mesh: the same `Arc` as long as the mesh is the same.
    pub fn bvh(&self, object: usize) -> Option<&Arc<Bvh>> {
        self.instances.get(object).map(|object| &object.mesh.bvh)
    }

    /// The corners of a triangle in the world, float64.
    #[inline]
    pub(crate) fn corners(&self, instance: u32, triangle: u32) -> [DVec3; 3] {
        let object = &self.instances[instance as usize];
        let mesh = &*object.mesh.mesh;
        // Spelled out: the compiler may leave `map` a call.
        let [a, b, c] = mesh.triangles[triangle as usize].map(|vertex| vertex as usize);
        let corners = [mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]];
        if object.is_identity {
            return corners;
        }
        let [a, b, c] = corners;
        let placed = |corner| object.world_from_mesh.transform_point3(corner);
        [placed(a), placed(b), placed(c)]
    }
}

impl ExactTriangles for PreparedWorld {
    fn corners(&self, instance: u32, triangle: u32) -> [[f64; 3]; 3] {
        self.corners(instance, triangle)
            .map(|corner| corner.to_array())
    }
}

/// How many float32 roundings of the largest coordinates add up, at most, between a surface and a ray that leaves it:
/// vertices, transform, start and direction of the ray, the shear of the triangle test.
const MAX_ROUNDINGS: f64 = 8.0;

/// What float32 may do to the points of an object, in units of one rounding.
#[derive(Debug)]
pub(crate) struct ErrorBounds {
    /// Into the mesh's coordinates and back: |M| |M^-1|.
    per_point: DMat3,
    /// The same for the mesh's place, and for its vertices.
    per_mesh: DVec3,
}

impl ErrorBounds {
    /// The columns of its two parts.
    #[inline(always)]
    pub fn columns(&self) -> [DVec3; 4] {
        let Self {
            per_point: of_point,
            per_mesh: of_mesh,
        } = self;
        [of_point.x_axis, of_point.y_axis, of_point.z_axis, *of_mesh]
    }

    /// Float32 rounds a point on the object, a ray that starts there and the triangles around it: together they are off by
    /// at most this length along `normal`. `point` is scene-local; the others are [`ErrorBounds::columns`].
    #[inline(always)]
    pub fn error_along([x, y, z]: [DVec3; 3], of_mesh: DVec3, point: DVec3, normal: DVec3) -> f64 {
        let per_axis = DMat3::from_cols(x, y, z) * point.abs() + of_mesh;
        MAX_ROUNDINGS * f64::from(f32::EPSILON) / 2.0 * per_axis.dot(normal.abs())
    }
}

impl PreparedInstance {
    fn new(object: &Object, mesh: Arc<PreparedMesh>, origin: DVec3, category: i32) -> Self {
        let linear = object.world_from_mesh.matrix3;
        let inverse = linear.inverse();
        let of_point = linear.abs() * inverse.abs();
        let place = (object.world_from_mesh.transform_point3(mesh.center) - origin).abs();
        let reach = (mesh.upper - mesh.center).max_element();
        Self {
            error_bounds: ErrorBounds {
                per_point: of_point,
                per_mesh: of_point * place + linear.abs() * DVec3::splat(2.0 * reach),
            },
            is_identity: object.world_from_mesh == DAffine3::IDENTITY,
            world_from_mesh: object.world_from_mesh,
            normal_from_mesh: inverse.transpose(),
            flips_orientation: linear.determinant() < 0.0,
            materials: object.materials.clone(),
            category,
            mesh,
        }
    }

    /// A box around it, lower and upper corner, in the world.
    pub fn bounds(&self) -> [DVec3; 2] {
        transformed_bounds(&self.mesh, &self.world_from_mesh)
    }

    /// What float32 may do to it, and to rays that start up to `reach` from the scene's origin, along each axis.
    pub fn error_extent(&self, reach: f64) -> DVec3 {
        let rounding =
            self.error_bounds.per_point * DVec3::splat(reach) + self.error_bounds.per_mesh;
        MAX_ROUNDINGS * f64::from(f32::EPSILON) / 2.0 * rounding
    }

    /// Where the mesh's own float32 coordinates lie in scene-local ones.
    pub fn bvh_instance(&self, origin: DVec3) -> Instance {
        let linear = self.world_from_mesh.matrix3;
        let place = self.world_from_mesh.transform_point3(self.mesh.center) - origin;
        let row = |i: usize| {
            let row = linear.row(i);
            [row.x, row.y, row.z, place[i]].map(|value| value as f32)
        };
        Instance {
            bvh: self.mesh.bvh.clone(),
            world_from_mesh: [row(0), row(1), row(2)],
        }
    }
}

/// Places meshes, and builds the tree over them.
pub(crate) fn build_instances(
    world: &World,
    meshes: Vec<Arc<PreparedMesh>>,
    origin: DVec3,
) -> Result<(Vec<PreparedInstance>, Scene), RenderError> {
    let objects: Vec<_> = world
        .objects
        .iter()
        .zip(meshes)
        .zip(world.categories().of_objects)
        .map(|((object, mesh), category)| PreparedInstance::new(object, mesh, origin, category))
        .collect();
    let instances = objects.iter().map(|object| object.bvh_instance(origin));
    let scene = Scene::build(instances.collect(), origin.to_array());
    let scene = scene.map_err(|error| match error {
        BuildError::NonFinite { what } => RenderError::World(format!(
            "{what} is placed where float32 does not reach: keep coordinates below 1e30"
        )),
        other => RenderError::World(other.to_string()),
    })?;
    Ok((objects, scene))
}

pub(crate) fn has_transparency(world: &World) -> bool {
    let clear = |material: &Material| material.alpha != Alpha::Opaque;
    world.materials.iter().any(clear)
}

/// Whether every index is in range and every part is valid, meshes apart.
pub(crate) fn validate(world: &World) -> Result<(), RenderError> {
    let fail = |message: String| Err(RenderError::World(message));
    let invalid = |error: raycam_scene::SceneError| RenderError::World(error.to_string());
    world
        .textures
        .iter()
        .try_for_each(|texture| texture.validate())
        .map_err(invalid)?;
    world
        .lights
        .iter()
        .try_for_each(|light| light.validate())
        .map_err(invalid)?;
    for (i, material) in world.materials.iter().enumerate() {
        material.validate().map_err(invalid)?;
        if let Some(slot) = material
            .texture_slots()
            .into_iter()
            .find(|slot| slot.texture >= world.textures.len())
        {
            return fail(format!(
                "material {i} has texture {} of {}",
                slot.texture,
                world.textures.len()
            ));
        }
    }
    for Object {
        name,
        mesh: index,
        materials,
        world_from_mesh,
        ..
    } in &world.objects
    {
        let Some(mesh) = world.meshes.get(*index) else {
            return fail(format!(
                "object {name:?} has mesh {index} of {}",
                world.meshes.len()
            ));
        };
        let slots = mesh.slot_count().max(1);
        if materials.len() < slots {
            let given = materials.len();
            return fail(format!(
                "object {name:?} has {given} materials, its mesh uses {slots}"
            ));
        }
        if let Some(material) = materials
            .iter()
            .find(|&&material| material >= world.materials.len())
        {
            let count = world.materials.len();
            return fail(format!(
                "object {name:?} has material {material} of {count}"
            ));
        }
        if !(world_from_mesh.is_finite() && world_from_mesh.inverse().is_finite()) {
            return fail(format!(
                "object {name:?} is placed by {world_from_mesh:?}: expected an invertible transform"
            ));
        }
    }
    Ok(())
}

/// A box around everything; a single untransformed mesh has the box of its mesh, exactly.
pub(crate) fn world_bounds(objects: &[Object], meshes: &[Arc<PreparedMesh>]) -> (DVec3, DVec3) {
    let boxes = objects.iter().zip(meshes);
    boxes
        .map(|(object, mesh)| transformed_bounds(mesh, &object.world_from_mesh).into())
        .reduce(|(a, b), (l, u)| (a.min(l), b.max(u)))
        .unwrap_or_default()
}

/// A box around a placed mesh: around the corners of its own.
fn transformed_bounds(mesh: &PreparedMesh, world_from_mesh: &DAffine3) -> [DVec3; 2] {
    let corner = |i: u32| {
        let pick = |axis: usize| {
            if i >> axis & 1 == 1 {
                mesh.upper[axis]
            } else {
                mesh.lower[axis]
            }
        };
        world_from_mesh.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    (0..8)
        .map(corner)
        .fold(nothing, |[l, u], c| [l.min(c), u.max(c)])
}

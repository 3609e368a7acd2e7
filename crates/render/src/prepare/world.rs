//! Prepared world: geometry, lighting and caustic guiding, composed.

use std::collections::HashSet;
use std::sync::Arc;

use raycam_bvh::Bvh;
use raycam_scene::{Alpha, Material, Object, World};

use crate::control::Control;
use crate::error::RenderError;
use crate::guiding::Guiding;
use crate::light::default_lights::default_lights;
use crate::light::lights::Lights;
use crate::lobes::classify::is_straight;
use crate::prepare::dielectric_bounds::closed_dielectric_bounds;
use crate::prepare::geometry::{Geometry, MAX_ORIGIN_RADII, build_instances, world_bounds};
use crate::prepare::instance::{PreparedInstance, object_bounds};
use crate::prepare::material::prepare_materials;
use crate::prepare::mesh::{PreparedMesh, prepare_meshes};
use crate::prepare::texture::prepare_textures;
use crate::prepare::validate::validate;
use crate::thread_pool::with_pool;

/// World ready to be rendered: BVHs, instances, lights and caustic maps, relative to a local origin.
#[derive(Debug)]
pub struct PreparedWorld {
    pub(crate) geometry: Geometry,
    pub(crate) lighting: Lighting,
    pub(crate) guiding: Guiding,
}

/// Lights of a prepared world.
#[derive(Debug, Default)]
pub(crate) struct Lighting {
    pub lights: Arc<Lights>,
    /// Stand-in lights of a world that has none.
    pub default_lights: Option<Arc<Lights>>,
}

impl PreparedWorld {
    /// Prepares a world. Meshes that `previous` holds (the same `Arc`) are not built again, so that moving objects,
    /// lights and materials cost next to nothing. Checks `control` between meshes.
    ///
    /// # Errors
    /// [`RenderError::World`] and [`RenderError::Build`] where parts of the world do not fit together,
    /// [`RenderError::Cancelled`], and errors of [`with_pool`].
    pub fn new(
        world: &World,
        previous: Option<&PreparedWorld>,
        threads: Option<usize>,
        control: &Control,
    ) -> Result<Self, RenderError> {
        validate(world)?;
        let previous = previous.map(|previous| &previous.geometry);
        let meshes = with_pool(threads, || instance_meshes(world, previous, control))??;
        control.check()?;
        let (lower, upper) = world_bounds(&world.objects, &meshes);
        let origin = lower + (upper - lower) / 2.0;
        // In a pool of this crate: rayon's global pool does not survive a fork.
        let (instances, scene) = with_pool(threads, || build_instances(world, meshes, origin))??;
        let materials = Arc::new(prepare_materials(&world.materials));
        let textures = prepare_textures(world, previous.map(|previous| &previous.textures[..]));
        let radius = (upper - origin).length();
        let mut geometry = Geometry {
            scene,
            flattened: Arc::default(),
            origin,
            radius,
            object_bounds: object_bounds(&instances, origin, MAX_ORIGIN_RADII * radius),
            dielectric_bounds: with_pool(threads, || closed_dielectric_bounds(&instances, &materials, origin))?,
            instances,
            materials,
            has_transparency: has_transparency(world),
            textures: Arc::new(textures),
            texture_cache: world.texture_cache.clone(),
        };
        if let Some(previous) = previous.filter(|previous| geometry.has_same_instances(previous)) {
            geometry.flattened = previous.flattened.clone();
        }
        let guiding = Guiding::new(&geometry);
        let lighting = with_pool(threads, || Lighting::new(world, &geometry))?;
        Ok(Self { geometry, lighting, guiding })
    }

    /// Prepares `world`, the state of `before` at another time, in the current thread pool. `reference` is `before`
    /// prepared; its origin, textures, and unchanged materials and lights are reused.
    ///
    /// # Errors
    /// Errors of [`PreparedWorld::new`].
    pub(crate) fn advance_world(
        world: &World,
        before: &World,
        reference: &Self,
        control: &Control,
    ) -> Result<Self, RenderError> {
        control.check()?;
        validate(world)?;
        let base = &reference.geometry;
        let meshes = instance_meshes(world, Some(base), control)?;
        let (lower, upper) = world_bounds(&world.objects, &meshes);
        let origin = base.origin;
        let (instances, scene) = build_instances(world, meshes, origin)?;
        let materials = match world.materials == before.materials {
            true => base.materials.clone(),
            false => Arc::new(prepare_materials(&world.materials)),
        };
        let geometry = Geometry {
            scene,
            flattened: Arc::default(),
            origin,
            radius: (upper - origin).abs().max((lower - origin).abs()).length(),
            object_bounds: vec![],
            dielectric_bounds: closed_dielectric_bounds(&instances, &materials, origin),
            instances,
            materials,
            has_transparency: has_transparency(world),
            textures: base.textures.clone(),
            texture_cache: base.texture_cache.clone(),
        };
        let guiding = Guiding::within_exposure(&geometry);
        let before_lighting = &reference.lighting;
        let emits = before_lighting.lights.has_emissive_triangles() || world.materials != before.materials;
        let lighting = match emits || world.lights != before.lights {
            true => Lighting::new(world, &geometry),
            false => Lighting {
                lights: before_lighting.lights.clone(),
                default_lights: before_lighting.default_lights.clone(),
            },
        };
        Ok(Self { geometry, lighting, guiding })
    }

    /// Number of instances whose BVH `other` shares.
    pub fn objects_shared_with(&self, other: &PreparedWorld) -> usize {
        let mesh = |instance: &PreparedInstance| Arc::as_ptr(&instance.mesh);
        let theirs: HashSet<_> = other.geometry.instances.iter().map(mesh).collect();
        let instances = self.geometry.instances.iter();
        instances.filter(|instance| theirs.contains(&mesh(instance))).count()
    }

    /// BVH of an object's mesh: the same `Arc` as long as the mesh is the same.
    pub fn bvh(&self, object: usize) -> Option<&Arc<Bvh>> {
        let instance = self.geometry.instances.get(object);
        instance.map(|instance| &instance.mesh.bvh)
    }
}

impl Lighting {
    fn new(world: &World, geometry: &Geometry) -> Self {
        let build = |lights: &[raycam_scene::Light]| {
            let lights = Lights::new(lights, world.up, geometry.origin);
            Arc::new(lights.with_emissive_triangles(geometry))
        };
        let lights = build(&world.lights);
        let unlit = match world.emission_keeps_default_lights {
            true => world.lights.is_empty(),
            false => lights.count() == 0,
        };
        Self { lights, default_lights: unlit.then(|| build(&default_lights(world.up))) }
    }
}

/// Prepared mesh of every object.
fn instance_meshes(
    world: &World,
    previous: Option<&Geometry>,
    control: &Control,
) -> Result<Vec<Arc<PreparedMesh>>, RenderError> {
    let previous = previous.iter().flat_map(|previous| &previous.instances);
    let previous: Vec<_> = previous.map(|instance| &instance.mesh).collect();
    let meshes = prepare_meshes(world, &previous, control)?;
    let of_object = |object: &Object| meshes[object.mesh].clone();
    Ok(world.objects.iter().filter_map(of_object).collect())
}

fn has_transparency(world: &World) -> bool {
    let is_transparent = |material: &Material| material.alpha != Alpha::Opaque || is_straight(material);
    world.materials.iter().any(is_transparent)
}

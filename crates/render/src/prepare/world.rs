//! Prepared world: geometry, lighting and the slot of path guiding.

use std::collections::HashSet;
use std::sync::Arc;

use raycam_bvh::Bvh;
use raycam_scene::{Object, World};

use crate::control::Control;
use crate::error::RenderError;
use crate::light::lighting::{Lighting, LightingCell, RecentLighting};
use crate::path_guiding::GuidingSlot;
use crate::prepare::family::SharedParts;
use crate::prepare::geometry::{Extent, Geometry, MAX_ORIGIN_RADII, world_bounds};
use crate::prepare::instance::{PreparedInstance, object_bounds};
use crate::prepare::material::prepare_materials;
use crate::prepare::mesh::{MeshList, PreparedMesh, prepare_meshes, rounded_center};
use crate::prepare::texture::{PreparedImage, PreparedTexture, prepare_textures};
use crate::prepare::validate::validate;
use crate::thread_pool::Workers;

/// World ready to be rendered: BVHs, instances, lights and the data of path guiding, relative to a local
/// origin.
#[derive(Debug)]
pub struct PreparedWorld {
    pub(crate) geometry: Geometry,
    lighting: Arc<LightingCell>,
    pub(crate) guiding: GuidingSlot,
    family: Arc<PreparedFamily>,
}

/// Prepared meshes, images and textures, and the most recent lights, shared by a world and all worlds derived
/// from it: copies, changed worlds and worlds at other times. The family exists as long as any of these
/// worlds exists.
#[derive(Debug, Default)]
pub struct PreparedFamily {
    meshes: SharedParts<PreparedMesh>,
    textures: SharedParts<PreparedTexture>,
    images: SharedParts<PreparedImage>,
    lighting: RecentLighting,
}

/// Maximum number of objects that are placed by the calling thread alone; waking up other threads would take
/// longer. At most the primitives of one treelet, whose build uses no other threads. Lab note: "placed by the calling
/// thread", 12-01.
const MAX_OBJECTS_HERE: usize = 4096;

/// Maximum number of objects that are placed within a fraction of a millisecond.
const MAX_BRIEF_OBJECTS: usize = 512;

impl PreparedWorld {
    /// Prepares a world in a new family, or in the family of `previous`: see [`PreparedWorld::in_family`].
    ///
    /// # Errors
    /// Errors of [`PreparedWorld::in_family`].
    pub fn new(
        world: &World,
        previous: Option<&PreparedWorld>,
        threads: Option<usize>,
        control: &Control,
    ) -> Result<Self, RenderError> {
        let family = previous.map_or_else(Arc::default, |previous| previous.family.clone());
        Self::in_family(world, &family, previous, threads, control)
    }

    /// Prepares a world. Meshes and textures that its family already contains (the same `Arc`) are not built again, so
    /// that moving objects, lights and materials takes very little time. Further parts are reused from `previous`,
    /// which may be any world. Lights are created by the first image that requires them. Checks `control` between
    /// meshes.
    ///
    /// # Errors
    /// [`RenderError::World`] and [`RenderError::Build`] if parts of the world are inconsistent,
    /// [`RenderError::Cancelled`], and errors of `with_pool`.
    pub fn in_family(
        world: &World,
        family: &Arc<PreparedFamily>,
        previous: Option<&PreparedWorld>,
        threads: Option<usize>,
        control: &Control,
    ) -> Result<Self, RenderError> {
        validate(world)?;
        let before = previous.map(|previous| &previous.geometry);
        let list = MeshList::new(world, &family.meshes);
        let work = if list.is_complete() && world.objects.len() <= MAX_OBJECTS_HERE { 0.0 } else { f64::INFINITY };
        // Longer work runs in one of this crate's pools, because rayon's global pool does not survive a fork.
        let workers = Workers::for_work(threads, work, true)?;
        let meshes = workers.run(|| instance_meshes(world, list, before, &family.meshes, control))?;
        control.check()?;
        let bounds @ [lower, upper] = world_bounds(&world.objects, &meshes);
        let extent = Extent::around(rounded_center(lower, upper), bounds);
        let materials = prepare_materials(&world.materials, &before.map(|b| b.materials.clone()).unwrap_or_default());
        let textures = Arc::new(prepare_textures(world, &family.textures, &family.images)?);
        let mut geometry = workers.run(|| Geometry::new(world, meshes, extent, materials, textures, before))?;
        geometry.object_bounds = object_bounds(&geometry.instances, extent.origin, MAX_ORIGIN_RADII * extent.radius);
        let known = previous.map(|previous| previous.lighting.clone()).into_iter().chain(family.lighting.cells());
        let lighting = LightingCell::new(world, &geometry, &known.collect::<Vec<_>>())?;
        family.meshes.keep(geometry.instances.iter().map(|instance| &instance.mesh));
        family.textures.keep(geometry.textures.iter());
        family.images.keep(geometry.textures.iter().map(|texture| &texture.image));
        Ok(Self { geometry, lighting, guiding: GuidingSlot::default(), family: family.clone() })
    }

    /// True if the calling thread alone can prepare a world of this family within a fraction of a millisecond.
    pub fn is_brief_to_prepare(world: &World, family: &PreparedFamily) -> bool {
        world.objects.len() <= MAX_BRIEF_OBJECTS && MeshList::new(world, &family.meshes).is_complete()
    }

    /// Prepares `world`, the state of `before` at another time, in the current thread pool. `reference` is the prepared
    /// `before`; its origin and textures, and unchanged materials and lights, are reused.
    ///
    /// # Errors
    /// Errors of [`PreparedWorld::new`].
    pub(crate) fn advance_world(world: &World, reference: &Self, control: &Control) -> Result<Self, RenderError> {
        control.check()?;
        validate(world)?;
        let base = &reference.geometry;
        let family = &reference.family;
        let list = MeshList::new(world, &family.meshes);
        let meshes = instance_meshes(world, list, Some(base), &family.meshes, control)?;
        let extent = Extent::around(base.origin, world_bounds(&world.objects, &meshes));
        let materials = prepare_materials(&world.materials, &base.materials);
        let geometry = Geometry::new(world, meshes, extent, materials, base.textures.clone(), None)?;
        let guiding = GuidingSlot::within_exposure();
        let lighting = LightingCell::new(world, &geometry, [&reference.lighting])?;
        Ok(Self { geometry, lighting, guiding, family: family.clone() })
    }

    /// Returns the lights; creates them if necessary.
    pub(crate) fn lighting(&self) -> &Lighting {
        self.lighting.get(&self.geometry, &self.family.lighting)
    }

    /// True if the world has no lights, so that the default sky and sun illuminate it.
    pub fn lit_by_default_lights(&self) -> bool {
        self.lighting().default_lights.is_some()
    }

    /// True if the lights are prepared, by an image of this world or of another world with the same lights.
    pub fn has_lighting(&self) -> bool {
        self.lighting.is_made()
    }

    /// Prepares, in the current pool, the parts of the world that lit images require. If the parts were prepared on
    /// first use, each waiting thread would prepare them too.
    pub(crate) fn prepare_light(&self) {
        self.lighting();
        self.geometry.dielectric_bounds();
        if let Some(guiding) = self.guiding.get() {
            guiding.learn_geometry(&self.geometry);
        }
    }

    /// Number of instances whose BVH `other` shares.
    pub fn objects_shared_with(&self, other: &PreparedWorld) -> usize {
        let mesh = |instance: &PreparedInstance| Arc::as_ptr(&instance.mesh);
        let theirs: HashSet<_> = other.geometry.instances.iter().map(mesh).collect();
        let instances = self.geometry.instances.iter();
        instances.filter(|instance| theirs.contains(&mesh(instance))).count()
    }

    /// BVH of an object's mesh: the same `Arc` while the mesh is unchanged.
    pub fn bvh(&self, object: usize) -> Option<&Arc<Bvh>> {
        let instance = self.geometry.instances.get(object);
        instance.map(|instance| &instance.mesh.bvh)
    }
}

/// Returns the prepared mesh of every object, and builds or refits the missing meshes.
fn instance_meshes(
    world: &World,
    list: MeshList,
    previous: Option<&Geometry>,
    parts: &SharedParts<PreparedMesh>,
    control: &Control,
) -> Result<Vec<Arc<PreparedMesh>>, RenderError> {
    let previous = previous.iter().flat_map(|previous| &previous.instances);
    let previous: Vec<_> = previous.map(|instance| &instance.mesh).collect();
    let meshes = prepare_meshes(world, list, &previous, parts, control)?;
    let of_object = |object: &Object| meshes[object.mesh].clone();
    Ok(world.objects.iter().filter_map(of_object).collect())
}

//! Geometry of a prepared world: the scene's BVH, its instances, materials and textures, without lights.

use std::sync::atomic::AtomicU64;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use raycam_bvh::{BuildError, ExactTriangles, Instance, Ray, Scene, TlasLeaves, prefetch};
use raycam_scene::world::RayVisibility;
use raycam_scene::{Camera, MaterialModel, Object, TextureCache, World};

use crate::error::RenderError;
use crate::prepare::dielectric_bounds::closed_dielectric_bounds;
use crate::prepare::fog::PreparedFog;
use crate::prepare::instance::{PreparedInstance, transformed_bounds};
use crate::prepare::material::PreparedMaterial;
use crate::prepare::mesh::PreparedMesh;
use crate::prepare::stretch::StretchedMeshes;
use crate::prepare::texture::PreparedTexture;
use crate::settings::Catchers;

/// Distance from the scene's centre, in radii, beyond which a ray's origin is moved towards the scene, because float32
/// would round the origin too coarsely.
pub(crate) const MAX_ORIGIN_RADII: f64 = 16.0;

/// Surfaces of a prepared world, relative to a local origin.
#[derive(Debug)]
pub(crate) struct Geometry {
    /// Two-level scene that always exists: see [`Geometry::two_level`].
    pub scene: Arc<Scene>,
    /// Scenes that are built for many rays.
    pub on_demand: Arc<OnDemandScenes>,
    /// World coordinates of the scene-local origin: the [`rounded_center`](crate::prepare::mesh::rounded_center) of the
    /// bounding box.
    pub origin: DVec3,
    /// Radius of a bounding sphere around `origin`.
    pub radius: f64,
    pub instances: Vec<PreparedInstance>,
    /// World-space boxes that contain all instances; empty for a world within an exposure.
    pub object_bounds: Vec<[DVec3; 2]>,
    pub materials: Arc<Vec<PreparedMaterial>>,
    /// Result of [`Geometry::dielectric_bounds`], computed on demand.
    dielectric_bounds: OnceLock<Vec<Option<[DVec3; 2]>>>,
    /// Fog outside of objects.
    pub fog: Option<PreparedFog>,
    /// Scene of the borders of media, with the same instance numbers as the geometry; `None` if there are no borders.
    pub boundaries: Option<Arc<Scene>>,
    /// True if light is absorbed or scattered between surfaces, other than inside of clear bodies.
    has_media: bool,
    /// Indices of the instances that have an interior, and their world-space boxes, sorted from large to small.
    pub bodies: Vec<(usize, [DVec3; 2])>,
    /// True if shadow rays may pass some surface, because a material is not opaque or an object casts no shadow.
    pub has_transparency: bool,
    /// True if some objects are hidden from some kinds of rays.
    pub has_hidden_objects: bool,
    /// True if some objects are hidden from camera rays.
    pub has_camera_hidden: bool,
    pub textures: Arc<Vec<Arc<PreparedTexture>>>,
    /// Texture cache that limits the memory of the images, if the memory is limited.
    pub texture_cache: Option<Arc<TextureCache>>,
}

/// Scenes that a world builds for many rays, and the counts of rays that determine when the scenes are built.
#[derive(Debug, Default)]
pub(crate) struct OnDemandScenes {
    /// Scene with all instances in one BVH; `None` if it would be too large or too coarse.
    pub flattened: OnceLock<Option<Scene>>,
    /// Two-level scene with re-braided leaves. `None` if the scene cannot be built.
    pub rebraided: OnceLock<Option<Scene>>,
    /// Number of rays and points that were traced without the re-braided scene.
    pub two_level_rays: AtomicU64,
    /// Number of exact rays that were traced without the flattened scene.
    pub exact_rays: AtomicU64,
    /// True if the world was created from another world by moving objects.
    pub is_of_moved: bool,
}

/// Origin and size of a prepared world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub origin: DVec3,
    /// Radius of a bounding sphere around `origin`.
    pub radius: f64,
}

impl Extent {
    /// Extent with this origin that contains a box.
    pub fn around(origin: DVec3, [lower, upper]: [DVec3; 2]) -> Self {
        Self { origin, radius: (upper - origin).max(origin - lower).length() }
    }
}

impl Geometry {
    /// Scene-local bounds of all objects; empty if there are none.
    pub fn bounds(&self) -> [DVec3; 2] {
        let all = self.object_bounds.iter().copied().reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
        all.map_or([DVec3::ZERO; 2], |bounds| bounds.map(|corner| corner - self.origin))
    }

    /// Places meshes, one for each object, with the world's materials and textures. If nothing has moved, the scenes of
    /// the geometry `before` are shared; otherwise the scene that is fastest to build is used until many rays are
    /// traced.
    ///
    /// # Errors
    /// [`RenderError::World`] if coordinates exceed float32; errors of [`StretchedMeshes::of_instance`].
    pub fn new(
        world: &World,
        meshes: Vec<Arc<PreparedMesh>>,
        extent: Extent,
        materials: Arc<Vec<PreparedMaterial>>,
        textures: Arc<Vec<Arc<PreparedTexture>>>,
        before: Option<&Self>,
    ) -> Result<Self, RenderError> {
        let instances = place_instances(world, meshes, extent.origin)?;
        let (scene, on_demand) = match before {
            Some(before) if before.origin == extent.origin && has_same_places(&before.instances, &instances) => {
                (before.scene.clone(), before.on_demand.clone())
            }
            _ => {
                let on_demand = OnDemandScenes { is_of_moved: before.is_some(), ..OnDemandScenes::default() };
                (build_scene(TlasLeaves::Instances, &instances, extent.origin)?.into(), on_demand.into())
            }
        };
        let fog = PreparedFog::of_world(world, extent.origin);
        let boundaries = build_boundaries(&instances, extent.origin)?;
        let visible = instances.iter().filter(|instance| instance.is_visible);
        let rays: Vec<RayVisibility> = visible.map(|instance| instance.ray_visibility).collect();
        let is_any = |test: fn(&RayVisibility) -> bool| rays.iter().any(test);
        Ok(Self {
            scene,
            on_demand,
            origin: extent.origin,
            radius: extent.radius,
            object_bounds: vec![],
            dielectric_bounds: OnceLock::new(),
            has_media: fog.is_some() || boundaries.is_some() || has_media(&instances, &materials),
            fog,
            boundaries,
            bodies: bodies(&instances, &materials),
            has_transparency: materials.iter().any(PreparedMaterial::is_transparent) || is_any(|rays| !rays.shadow),
            has_hidden_objects: is_any(|rays| !rays.is_everywhere()),
            has_camera_hidden: is_any(|rays| !rays.camera),
            instances,
            materials,
            textures,
            texture_cache: world.texture_cache.clone(),
        })
    }

    /// The surfaces of some instances alone, with the same origin, materials and textures, for queries of rays.
    ///
    /// # Errors
    /// [`RenderError::World`] if coordinates exceed float32.
    pub fn with_instances(&self, instances: Vec<PreparedInstance>) -> Result<Self, RenderError> {
        Ok(Self {
            scene: build_scene(TlasLeaves::Instances, &instances, self.origin)?.into(),
            on_demand: Arc::default(),
            object_bounds: vec![],
            dielectric_bounds: OnceLock::new(),
            fog: None,
            boundaries: None,
            bodies: vec![],
            instances,
            materials: self.materials.clone(),
            textures: self.textures.clone(),
            texture_cache: self.texture_cache.clone(),
            ..*self
        })
    }

    /// For each material, the scene-local box of its closed dielectric bodies.
    pub fn dielectric_bounds(&self) -> &[Option<[DVec3; 2]>] {
        if let Some(known) = self.dielectric_bounds.get() {
            return known;
        }
        // The value is computed before the cell is locked, so that threads do not wait.
        let bounds = closed_dielectric_bounds(&self.instances, &self.materials, self.origin);
        self.dielectric_bounds.get_or_init(|| bounds)
    }

    /// True if light is absorbed or scattered between surfaces, other than inside of clear bodies.
    #[inline]
    pub fn has_media(&self) -> bool {
        self.has_media
    }

    /// Kinds of rays that can hit an instance.
    #[inline]
    pub fn ray_visibility(&self, instance: u32) -> RayVisibility {
        self.instances[instance as usize].ray_visibility
    }

    /// True if camera rays show the background in place of an instance.
    #[inline]
    pub fn is_left_out(&self, catchers: Catchers, instance: u32) -> bool {
        match catchers {
            Catchers::Show => false,
            Catchers::Hide => self.instances[instance as usize].is_catcher,
            Catchers::Only => !self.instances[instance as usize].is_catcher,
        }
    }

    /// Camera with its ray origins moved outside the scene, if its rays come from infinity; otherwise unchanged.
    pub fn camera_outside(&self, camera: &Camera) -> Camera {
        camera.with_ray_origins_outside(self.origin, self.radius)
    }

    /// World-space vertices of a triangle, float64.
    #[inline]
    pub fn corners(&self, instance: u32, triangle: u32) -> [DVec3; 3] {
        let object = &self.instances[instance as usize];
        let mesh = &*object.mesh.mesh;
        // Each corner is transformed in its own expression, because the compiler may not inline `map`.
        let [a, b, c] = mesh.triangles[triangle as usize].map(|vertex| vertex as usize);
        let corners = [mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]];
        if object.is_identity {
            return corners;
        }
        let [a, b, c] = corners;
        let placed = |corner| object.world_from_mesh.transform_point3(corner);
        [placed(a), placed(b), placed(c)]
    }

    /// Scene-local float32 ray of a world-space ray, and the distance by which its origin was moved along the ray, in
    /// units of the direction's length.
    pub fn local_ray(&self, origin: DVec3, direction: DVec3, t_max: f64) -> (Ray, f64) {
        let start = origin - self.origin;
        let mut moved = 0.0;
        if self.is_far(start) {
            // The origin is moved to the point on the ray that is closest to the scene's centre, minus twice the
            // radius.
            let length = direction.length();
            let foot = -start.dot(direction) / (length * length);
            moved = (foot - 2.0 * self.radius / length).clamp(0.0, t_max.max(0.0));
            if !moved.is_finite() {
                moved = 0.0;
            }
        }
        let ray = Ray {
            origin: (start + moved * direction).as_vec3().to_array(),
            direction: direction.as_vec3().to_array(),
            // The limit is measured from the moved origin.
            t_max: if t_max.is_finite() { (t_max - moved) as f32 } else { t_max as f32 },
        };
        (ray, moved)
    }

    /// True if rays with this scene-local origin are moved along their direction.
    pub fn is_far(&self, start: DVec3) -> bool {
        start.length_squared() > (MAX_ORIGIN_RADII * self.radius).powi(2)
    }
}

impl ExactTriangles for Geometry {
    fn corners(&self, instance: u32, triangle: u32) -> [[f64; 3]; 3] {
        self.corners(instance, triangle).map(|corner| corner.to_array())
    }

    fn prefetch_indices(&self, instance: u32, triangle: u32) {
        prefetch(&raw const self.instances[instance as usize].mesh.mesh.triangles[triangle as usize]);
    }

    fn prefetch_corners(&self, instance: u32, triangle: u32) {
        let mesh = &*self.instances[instance as usize].mesh.mesh;
        for vertex in mesh.triangles[triangle as usize] {
            prefetch(&raw const mesh.vertices[vertex as usize]);
        }
    }

    fn is_mirrored(&self, instance: u32) -> bool {
        self.instances[instance as usize].flips_orientation
    }
}

/// Creates the instance of every object, in the order of the objects.
///
/// # Errors
/// Errors of [`StretchedMeshes::of_instance`].
fn place_instances(
    world: &World,
    meshes: Vec<Arc<PreparedMesh>>,
    origin: DVec3,
) -> Result<Vec<PreparedInstance>, RenderError> {
    let mut stretched = StretchedMeshes::default();
    let objects = world.objects.iter().zip(meshes).zip(world.categories().of_objects);
    let place = |((object, mesh), category): ((&Object, Arc<PreparedMesh>), i32)| {
        let stretched = stretched.of_instance(object, &mesh)?;
        let is_boundary =
            object.materials.iter().all(|&material| world.materials[material].model == MaterialModel::Boundary);
        Ok(PreparedInstance::new(object, mesh, stretched, origin, category, is_boundary))
    };
    objects.map(place).collect()
}

/// True if both lists contain the same meshes with the same transforms and visibility.
fn has_same_places(instances: &[PreparedInstance], others: &[PreparedInstance]) -> bool {
    let place = |object: &PreparedInstance| (Arc::as_ptr(&object.mesh), object.world_from_mesh, object.is_visible);
    instances.iter().map(place).eq(others.iter().map(place))
}

/// The two-level scene of placed meshes.
///
/// # Errors
/// [`RenderError::World`] if coordinates exceed float32.
pub(crate) fn build_scene(
    leaves: TlasLeaves,
    instances: &[PreparedInstance],
    origin: DVec3,
) -> Result<Scene, RenderError> {
    scene_of(leaves, instances.iter().map(|object| object.bvh_instance(origin)).collect(), origin)
}

/// The scene of the borders of media; `None` if there are none.
///
/// # Errors
/// Errors of [`build_scene`].
fn build_boundaries(instances: &[PreparedInstance], origin: DVec3) -> Result<Option<Arc<Scene>>, RenderError> {
    if !instances.iter().any(|object| object.is_boundary) {
        return Ok(None);
    }
    let borders = instances.iter().map(|object| object.boundary_instance(origin)).collect();
    Ok(Some(Arc::new(scene_of(TlasLeaves::Instances, borders, origin)?)))
}

/// True if the material of any object has a medium of its own.
fn has_media(instances: &[PreparedInstance], materials: &[PreparedMaterial]) -> bool {
    let seen = instances.iter().filter(|object| object.is_visible || object.is_boundary);
    seen.flat_map(|object| &object.materials).any(|&material| materials[material].material.medium.is_some())
}

/// Indices of the instances that have an interior, and their world-space boxes, the largest first.
fn bodies(instances: &[PreparedInstance], materials: &[PreparedMaterial]) -> Vec<(usize, [DVec3; 2])> {
    let has_interior = |object: &PreparedInstance| {
        let is_there = object.is_visible || object.is_boundary;
        is_there && object.materials.first().is_some_and(|&material| materials[material].absorption.is_some())
    };
    let found = instances.iter().enumerate().filter(|(_, object)| has_interior(object));
    let mut bodies: Vec<_> = found.map(|(number, object)| (number, object.bounds())).collect();
    let volume = |[lower, upper]: [DVec3; 2]| (upper - lower).element_product();
    bodies.sort_by(|a, b| volume(b.1).total_cmp(&volume(a.1)));
    bodies
}

fn scene_of(leaves: TlasLeaves, instances: Vec<Instance>, origin: DVec3) -> Result<Scene, RenderError> {
    Scene::build_over(leaves, instances, origin.to_array()).map_err(|error| match error {
        BuildError::NonFinite { what } => {
            RenderError::world(format!("coordinates of {what} exceed float32; keep them below 1e30"))
        }
        other => RenderError::world(other.to_string()),
    })
}

/// Bounding box of all visible objects; exact for a single untransformed mesh.
pub(crate) fn world_bounds(objects: &[Object], meshes: &[Arc<PreparedMesh>]) -> [DVec3; 2] {
    let boxes = objects.iter().zip(meshes).filter(|(object, _)| object.visible);
    boxes
        .map(|(object, mesh)| transformed_bounds(mesh, &object.world_from_mesh))
        .reduce(|[a, b], [l, u]| [a.min(l), b.max(u)])
        .unwrap_or_default()
}

//! The world: everything there is, by index.

pub(crate) mod at_time;
pub mod category;
pub(crate) mod statistics;
pub(crate) mod validate;
pub mod variant;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{BVec3, DAffine3, DMat3, DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::animation::NodeTree;
use crate::camera::{Camera, PixelCenter, Rig as CameraRig, intrinsics_from_fov};
use crate::error::{SceneError, suggestion};
use crate::light::Light;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::schema::RenderSpec;
use crate::texture::{Texture, TextureCache};
use crate::video::{Video, WorldTime};
use crate::world::variant::Variant;

/// Which axis points up. It matters to roll/pitch/yaw, orbits and the sky; vertices are never turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// z up, as in robotics and most CAD.
    #[default]
    Z,
    /// y up, as in glTF.
    Y,
}

impl Up {
    /// The unit vector that points up.
    pub fn axis(self) -> DVec3 {
        match self {
            Up::Z => DVec3::Z,
            Up::Y => DVec3::Y,
        }
    }
}

/// A placed mesh: what the ground truth calls an instance. Its id is its index in [`World::objects`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Unique within the world; made from the shape where none was given.
    pub name: String,
    /// A class for data sets.
    pub category: Option<String>,
    /// Index into the world's meshes; several objects may share one.
    pub mesh: usize,
    /// Indices into the world's materials, one per material slot of the mesh; never empty.
    pub materials: Vec<usize>,
    /// Any invertible affine transform, mirroring included.
    pub world_from_mesh: DAffine3,
    /// The scale (and shear) in `world_from_mesh = translation * rotation * scale_shear`: what keyframes leave as it is.
    #[serde(rename = "shape")]
    pub scale_shear: DMat3,
}

impl Object {
    /// An object placed by any affine transform, all of whose linear part is its shape.
    pub fn new(
        name: impl Into<String>,
        mesh: usize,
        materials: Vec<usize>,
        world_from_mesh: DAffine3,
    ) -> Self {
        Self {
            name: name.into(),
            category: None,
            mesh,
            materials,
            world_from_mesh,
            scale_shear: world_from_mesh.matrix3,
        }
    }
}

/// A camera with the name it is asked for by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedCamera {
    /// Unique within the world.
    pub name: String,
    /// The camera.
    pub camera: Camera,
}

/// Meshes, materials, lights and cameras, joined by index. Cloning is cheap: geometry and images are shared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct World {
    /// Which way is up.
    pub up: Up,
    /// Shared geometry.
    pub meshes: Vec<Arc<Mesh>>,
    /// Shared images.
    #[serde(with = "crate::texture::serde_shared")]
    pub textures: Vec<Arc<Texture>>,
    /// What bounds the memory of images, if something does. Data has no bounds of its own.
    #[serde(skip)]
    pub texture_cache: Option<Arc<TextureCache>>,
    /// Shared materials.
    pub materials: Vec<Material>,
    /// Placed meshes.
    pub objects: Vec<Object>,
    /// The objects' names.
    pub names: Names,
    /// All lights.
    pub lights: Vec<Light>,
    /// Whether surfaces that shine are there to be seen, and a world without lights needs some all the same: so it is
    /// in glTF, whose viewers light everything by an environment of their own.
    #[serde(rename = "glow_is_decoration")]
    pub emission_keeps_default_lights: bool,
    /// Named cameras, the default one first.
    pub cameras: Vec<NamedCamera>,
    /// Rigs, whose cameras are among the others.
    pub rigs: Vec<CameraRig>,
    /// How it wants to be rendered.
    pub render: RenderSpec,
    /// What `raycam video` makes of it.
    pub video: Option<Video>,
    /// What animations need.
    #[serde(rename = "rig")]
    pub node_tree: Option<Arc<NodeTree>>,
    /// Looks to choose from.
    pub variants: Vec<Variant>,
    /// When it is, where it was moved to a time: a camera's shutter sees it move on from there.
    #[serde(rename = "clock")]
    pub time: Option<WorldTime>,
    /// What reading it had to say: skipped, repaired, counted. Never silent.
    pub notices: Vec<String>,
}

impl World {
    /// Adds a mesh to be placed by objects and returns its index.
    pub fn add_mesh(&mut self, mesh: Mesh) -> usize {
        self.add_shared_mesh(Arc::new(mesh))
    }

    /// [`World::add_mesh`], for a mesh that others have too.
    pub fn add_shared_mesh(&mut self, mesh: Arc<Mesh>) -> usize {
        self.meshes.push(mesh);
        self.meshes.len() - 1
    }

    /// Adds an image for materials and returns its index.
    pub fn add_texture(&mut self, texture: Texture) -> usize {
        self.textures.push(Arc::new(texture));
        self.textures.len() - 1
    }

    /// Adds a material and returns its index, with a notice where it reflects more light than arrives.
    ///
    /// # Errors
    /// Those of [`Material::validate`], and a texture that there is not.
    pub fn add_material(&mut self, material: Material) -> Result<usize, SceneError> {
        material.validate()?;
        if let Some(slot) = material
            .texture_slots()
            .into_iter()
            .find(|slot| slot.texture >= self.textures.len())
        {
            return Err(SceneError::World(format!(
                "texture {} of {}",
                slot.texture,
                self.textures.len()
            )));
        }
        if let Some(total) = material.reflectance_above_one() {
            let name = if material.name.is_empty() {
                String::new()
            } else {
                format!(" {:?}", material.name)
            };
            self.notices.push(format!(
                "material{name} reflects {total} of the light that arrives (diffuse * color + specular), more than \
                 all of it"
            ));
        }
        self.materials.push(material);
        Ok(self.materials.len() - 1)
    }

    /// Adds an object and returns its id. A name that is taken gets a number; an empty one becomes `object`.
    ///
    /// # Errors
    /// [`SceneError::World`] where an index is out of range, the transform is singular or not finite, or there are
    /// fewer materials than slots.
    pub fn add_object(&mut self, mut object: Object) -> Result<usize, SceneError> {
        let fail = |message: String| Err(SceneError::World(message));
        let Some(mesh) = self.meshes.get(object.mesh) else {
            return fail(format!(
                "object {:?} has mesh {} of {}",
                object.name,
                object.mesh,
                self.meshes.len()
            ));
        };
        if mesh.slot_count() > object.materials.len() {
            return fail(format!(
                "object {:?} has {} materials, its mesh uses {} slots",
                object.name,
                object.materials.len(),
                mesh.slot_count()
            ));
        }
        if let Some(material) = object
            .materials
            .iter()
            .find(|&&material| material >= self.materials.len())
        {
            return fail(format!(
                "object {:?} has material {material} of {}",
                object.name,
                self.materials.len()
            ));
        }
        let transform = object.world_from_mesh;
        if !transform.is_finite() {
            return fail(format!(
                "object {:?} is placed by {transform:?}: every number must be finite",
                object.name
            ));
        }
        if !transform.inverse().is_finite() {
            return fail(format!(
                "object {:?} is placed by {transform:?}, which is singular: it flattens the object",
                object.name
            ));
        }
        object.name = self.names.unique(if object.name.is_empty() {
            "object"
        } else {
            &object.name
        });
        self.objects.push(object);
        Ok(self.objects.len() - 1)
    }

    /// Adds a light and returns its index.
    ///
    /// # Errors
    /// Those of [`Light::validate`].
    pub fn add_light(&mut self, light: Light) -> Result<usize, SceneError> {
        light.validate()?;
        self.lights.push(light);
        Ok(self.lights.len() - 1)
    }

    /// Adds a camera under a name, made unique, and returns its index.
    pub fn add_camera(&mut self, name: &str, camera: Camera) -> usize {
        let mut names = Names::default();
        for camera in &self.cameras {
            names.unique(&camera.name);
        }
        self.cameras.push(NamedCamera {
            name: names.unique(name),
            camera,
        });
        self.cameras.len() - 1
    }

    /// The smallest and largest corner of all objects, as tight as their vertices; `None` when there is nothing.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.objects
            .iter()
            .filter_map(|object| self.meshes[object.mesh].bounds_in(object.world_from_mesh))
            .reduce(|(low, high), (l, h)| (low.min(l), high.max(h)))
    }

    /// The first camera, or one of 45 degrees that frames everything from the front right above. `size` is for the
    /// latter.
    ///
    /// # Errors
    /// [`SceneError`] where there is neither a camera nor anything to frame, or the size is out of range.
    pub fn default_camera(&self, size: [u32; 2]) -> Result<Camera, SceneError> {
        if let Some(first) = self.cameras.first() {
            return Ok(first.camera.clone());
        }
        let Some((low, high)) = self.bounds() else {
            return Err(SceneError::World(
                "the world has no objects: there is nothing to look at".into(),
            ));
        };
        let pixel_center = PixelCenter::default();
        let k = intrinsics_from_fov(45.0, size, pixel_center)?;
        let away = match self.up {
            Up::Z => DVec3::new(1.0, -2.0, 1.0),
            Up::Y => DVec3::new(1.0, 1.0, 2.0),
        };
        let center = (low + high) / 2.0;
        let facing = Camera::look_at(away, DVec3::ZERO, self.up.axis(), k, size, pixel_center)?;
        // Near enough for every corner of the bounds to lie within nine tenths of the picture.
        let reach =
            0.9 * DVec2::new(
                f64::from(size[0]) / k.x_axis.x,
                f64::from(size[1]) / k.y_axis.y,
            ) / 2.0;
        let distance = (0..8)
            .map(|i| {
                let corner = DVec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), high, low);
                let seen = facing.r() * (corner - center);
                (seen.truncate().abs() / reach).max_element() - seen.z
            })
            .fold(0.0, f64::max);
        let distance = if distance > 0.0 { distance } else { 1.0 };
        let eye = center - distance * facing.forward();
        Camera::new(k, facing.r(), eye, size, pixel_center)
    }

    /// The camera of this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_camera(&self, name: &str) -> Result<&NamedCamera, SceneError> {
        self.cameras
            .iter()
            .find(|camera| camera.name == name)
            .ok_or_else(|| {
                let names = self.cameras.iter().map(|camera| camera.name.as_str());
                let count = self.cameras.len();
                SceneError::World(format!(
                    "no camera {name:?} among {count}{}",
                    suggestion(name, names)
                ))
            })
    }

    /// The id of the object of this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_object(&self, name: &str) -> Result<usize, SceneError> {
        self.objects
            .iter()
            .position(|object| object.name == name)
            .ok_or_else(|| {
                let names = self.objects.iter().map(|object| object.name.as_str());
                let count = self.objects.len();
                SceneError::World(format!(
                    "no object {name:?} among {count}{}",
                    suggestion(name, names)
                ))
            })
    }
}

/// Names in use.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Names {
    /// For each name in use, the number to try next where it is wanted again.
    next: BTreeMap<String, usize>,
}

impl Names {
    /// The name where it is free, or else with the first free number after it: `box`, `box-2`, `box-3`.
    pub fn unique(&mut self, wanted: &str) -> String {
        let Some(next) = self.next.get(wanted).copied() else {
            self.next.insert(wanted.into(), 2);
            return wanted.into();
        };
        let mut number = next;
        let name = loop {
            let name = format!("{wanted}-{number}");
            number += 1;
            if !self.next.contains_key(&name) {
                break name;
            }
        };
        self.next.insert(wanted.into(), number);
        self.next.insert(name.clone(), 2);
        name
    }
}

//! Changes of an object by the keys of its description; other properties stay unchanged.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::{DMat3, DVec3};

use crate::camera::sensor::LidarSurface;
use crate::counted::counted;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::model::AssetLoader;
use crate::notice::{Notice, NoticeCode};
use crate::schema::build_failure::BuildFailure;
use crate::schema::displace_object::ObjectParts;
use crate::schema::geometry::{Additions, LoadedMeshes};
use crate::schema::keys::Keys;
use crate::schema::material_keys::has_material_keys;
use crate::schema::object_keys::{GEOMETRY, PLACEMENT, SHAPES};
use crate::schema::shorthand::Category;
use crate::schema::spec::displace::DisplaceSpec;
use crate::schema::spec::object::{KEYS, ObjectSpec};
use crate::texture::Texture;
use crate::world::{Names, World};

/// Mesh that a changed object shows.
enum ChangedMesh {
    Same,
    /// The existing mesh with this index.
    Shared(usize),
    New(Arc<Mesh>),
}

/// Materials of a changed object's slots, and the images that they add to the world.
struct ChangedMaterials {
    materials: Vec<Material>,
    textures: Vec<Texture>,
    notices: Vec<Notice>,
    /// False if the new materials replace the previous materials, which is only possible if no other object uses the
    /// previous materials.
    is_of_new_mesh: bool,
}

impl ObjectSpec {
    /// Changes the object with this index as described. If this fails, the world is unchanged, except that `files` may
    /// keep images that it has read.
    ///
    /// Placement is replaced as a whole: angles without a location place the object at the origin. If other objects
    /// show the same mesh, their mesh does not change. A new mesh file replaces the materials by its own; with any
    /// other new mesh, the object keeps its materials.
    ///
    /// # Errors
    /// Errors of [`ObjectSpec::build`]; [`SceneError::World`] if the object does not exist. `vertices` without
    /// `triangles` are an error if their number differs from the mesh's, or if the mesh's shading normals would
    /// become invalid.
    pub fn change<F: AssetLoader>(self, world: &mut World, id: usize, files: &mut F) -> Result<(), F::Error> {
        world.check_object(id).map_err(F::Error::from)?;
        match self.change_placement(world, id) {
            Some(placed) => placed.map_err(F::Error::from),
            None => self.change_object(world, id, files).map_err(BuildFailure::into_error),
        }
    }

    /// Changes an object's placement and visibility, if the description contains nothing else; `None` if the
    /// description contains other keys. No files are needed, and the world is unchanged on failure.
    pub fn change_placement(&self, world: &mut World, id: usize) -> Option<Result<()>> {
        let keys = self.keys();
        let is_more =
            self.name.is_some() || self.category.is_some() || self.shadow_catcher.is_some() || self.lidar.is_some();
        if is_more || keys.given(&PLACEMENT).len() < keys.count() {
            return None;
        }
        let place = match keys.count() {
            0 => Ok(None),
            _ => self.object_transform(world.up, &keys).map(Some),
        };
        Some(world.check_object(id).and(place).map(|place| {
            let object = &mut world.objects[id];
            if let Some(visible) = self.visible {
                visible.apply(object);
            }
            if let Some((world_from_mesh, scale_shear)) = place {
                (object.world_from_mesh, object.scale_shear) = (world_from_mesh, scale_shear);
                world.release_object(id);
            }
        }))
    }

    fn change_object<F: AssetLoader>(
        mut self,
        world: &mut World,
        id: usize,
        files: &mut F,
    ) -> Result<(), BuildFailure<F::Error>> {
        self.displace = self.displace.filter(DisplaceSpec::is_on);
        let keys = self.keys();
        if self.name.as_ref().is_some_and(String::is_empty) {
            return Err(SceneError::schema(ErrorCode::MissingValue, "name", "\"\"; expected a non-empty name").into());
        }
        self.lidar.as_ref().map_or(Ok(()), LidarSurface::validate)?;
        self.check_material(&keys, true)?;
        let place = match keys.given(&PLACEMENT).is_empty() {
            true => None,
            false => Some(self.object_transform(world.up, &keys)?),
        };
        let (mut mesh, mut materials) = self.changed_parts(world, id, &keys, files)?;
        if self.displace.is_some() {
            let world_from_mesh = place.map_or(world.objects[id].world_from_mesh, |(transform, _)| transform);
            self.displace_changed(world, id, &mut mesh, &mut materials, world_from_mesh.matrix3)?;
        }
        // All steps that can fail are done before this point.
        let before = world.parts_in_use();
        let changes_medium = self.medium.is_some() || !matches!(mesh, ChangedMesh::Same);
        let name = self.name.take();
        if let Some(materials) = materials {
            put_materials(world, id, materials);
        }
        match mesh {
            ChangedMesh::Same => {}
            ChangedMesh::Shared(index) => put_mesh(world, id, index),
            ChangedMesh::New(mesh) => {
                let index = world.objects[id].mesh;
                let shown = world.objects.iter().filter(|object| object.mesh == index).count();
                let is_in_tree = world.node_tree.as_ref().is_some_and(|tree| {
                    tree.hidden_mesh == index || tree.objects.iter().any(|m| m.mesh == index && m.object != id)
                });
                if shown == 1 && !is_in_tree {
                    world.meshes[index] = mesh;
                    put_mesh(world, id, index);
                } else {
                    let index = world.add_shared_mesh(mesh);
                    put_mesh(world, id, index);
                }
            }
        }
        let object = &mut world.objects[id];
        if let Some(Category(category)) = self.category.take() {
            object.category = Some(category);
        }
        if let Some(visible) = self.visible.take() {
            visible.apply(object);
        }
        object.shadow_catcher = self.shadow_catcher.unwrap_or(object.shadow_catcher);
        object.lidar = self.lidar.or(object.lidar.take());
        if let Some((world_from_mesh, scale_shear)) = place {
            (object.world_from_mesh, object.scale_shear) = (world_from_mesh, scale_shear);
            world.release_object(id);
        }
        if let Some(name) = name.filter(|name| *name != world.objects[id].name) {
            let others = world.objects.iter().enumerate().filter(|(i, _)| *i != id);
            world.names = Names::from_used(others.map(|(_, object)| &object.name[..]));
            world.objects[id].name = world.names.unique(&name);
        }
        if changes_medium {
            world.note_open_medium(id);
        }
        world.remove_unused(&before);
        Ok(())
    }

    /// Displaces the new mesh of an object by its new materials.
    fn displace_changed(
        &self,
        world: &World,
        id: usize,
        mesh: &mut ChangedMesh,
        materials: &mut Option<ChangedMaterials>,
        world_from_mesh: DMat3,
    ) -> Result<()> {
        let object = &world.objects[id];
        let mut shown = match mesh {
            ChangedMesh::Same => world.meshes[object.mesh].clone(),
            ChangedMesh::Shared(index) => world.meshes[*index].clone(),
            ChangedMesh::New(mesh) => mesh.clone(),
        };
        let changed = materials.get_or_insert_with(|| {
            let materials = object.materials.iter().map(|&i| world.materials[i].clone()).collect();
            ChangedMaterials { is_of_new_mesh: false, ..ChangedMaterials::of_new_mesh(materials) }
        });
        let parts = ObjectParts {
            mesh: &mut shown,
            materials: &mut changed.materials,
            known_textures: &world.textures,
            new_textures: &mut changed.textures,
        };
        self.displace_parts(parts, world_from_mesh)?;
        *mesh = ChangedMesh::New(shown);
        Ok(())
    }

    /// The object's new mesh and materials; `None` for unchanged materials.
    fn changed_parts<F: AssetLoader>(
        &mut self,
        world: &World,
        id: usize,
        keys: &Keys<KEYS>,
        files: &mut F,
    ) -> Result<(ChangedMesh, Option<ChangedMaterials>), BuildFailure<F::Error>> {
        let object = &world.objects[id];
        let old = &world.meshes[object.mesh];
        let kind = match keys.given(&SHAPES).is_empty() {
            true => "",
            false => keys.exactly_one("shape", &SHAPES)?,
        };
        if kind != "mesh" {
            keys.refuse_without("\"mesh\", a file with an up axis", &["upright"])?;
        }
        if kind != "vertices" {
            keys.refuse_without("\"vertices\"", &["triangles"])?;
        }
        let moves_vertices = kind == "vertices" && self.triangles.is_none();
        if kind.is_empty() || moves_vertices {
            if moves_vertices {
                keys.refuse(&["refine"], "requires \"faces\" too, because the mesh has already been refined")?;
            }
            let changed = !keys.given(&GEOMETRY).is_empty() || moves_vertices;
            let mesh = if changed { Some(self.reshaped(old, &object.name)?) } else { None };
            let materials = self.changed_materials(world, id, mesh.as_ref().unwrap_or(old), keys, files)?;
            return Ok((mesh.map_or(ChangedMesh::Same, |mesh| ChangedMesh::New(Arc::new(mesh))), materials));
        }
        if let Some(original) = self.instance_of.take() {
            keys.refuse(&GEOMETRY, "the mesh belongs to the object of instance_of; set this key for that object")?;
            let other = world.find_object(&original).map_err(|error| error.in_context("instance_of"))?;
            let Some(mesh) = world.objects.get(other).map(|other| other.mesh) else {
                return Ok((ChangedMesh::Same, None));
            };
            let mut materials = self.changed_materials(world, id, &world.meshes[mesh], keys, files)?;
            if world.meshes[mesh].slot_count() > object.materials.len() {
                let theirs = world.objects[other].materials.iter().map(|&i| world.materials[i].clone());
                materials = Some(ChangedMaterials::of_new_mesh(theirs.collect()));
            }
            return Ok((ChangedMesh::Shared(mesh), materials));
        }
        let next = world.textures.len();
        let colored = self.face_colors.is_some() || self.vertex_colors.is_some();
        let (additions, read) =
            self.additions(keys, self.file_axes(world.up), next, files, &LoadedMeshes::default(), false)?;
        let Additions { mesh, materials, textures, notices, .. } = additions;
        let default = Material::for_mesh(old);
        let is_default = object.materials.iter().all(|&i| {
            let material = &world.materials[i];
            Material { name: String::new(), ..material.clone() } == default
        });
        if read.is_some() || is_default || mesh.slot_count() > object.materials.len() {
            let own = ChangedMaterials { materials, textures, notices, is_of_new_mesh: read.is_some() };
            own.check()?;
            return Ok((ChangedMesh::New(mesh), Some(own)));
        }
        let mut kept = self.changed_materials(world, id, &mesh, keys, files)?;
        if colored && self.color.is_none() {
            let materials = object.materials.iter().map(|&i| world.materials[i].clone());
            let kept = kept.get_or_insert_with(|| ChangedMaterials {
                is_of_new_mesh: false,
                ..ChangedMaterials::of_new_mesh(materials.collect())
            });
            kept.materials.iter_mut().for_each(|material| material.color = [1.0; 3]);
        }
        Ok((ChangedMesh::New(mesh), kept))
    }

    /// Returns a copy of a mesh with the vertices, normals, texture coordinates or colours of this description.
    fn reshaped(&mut self, old: &Arc<Mesh>, name: &str) -> Result<Mesh> {
        let mut mesh = Mesh::clone(old);
        if let Some(vertices) = self.vertices.take() {
            let (given, known) = (vertices.len(), mesh.vertices.len());
            if given != known {
                return Err(SceneError::world(format!(
                    "{}, but the mesh of {name:?} has {known}; add faces to replace the mesh",
                    counted(given, "vertex")
                )));
            }
            if mesh.normals.is_some() && self.normals.is_none() {
                return Err(SceneError::world(format!(
                    "vertices: the shading normals of {name:?} would not match the new vertices; add normals, or \
                     normals=None for flat faces"
                )));
            }
            mesh.vertices = vertices.into_iter().map(DVec3::from_array).collect();
            mesh.tangents = None;
        }
        if self.normals.as_ref().is_some_and(Vec::is_empty) {
            (mesh.normals, self.normals) = (None, None);
        }
        let mut additions = Additions { mesh: Arc::new(mesh), ..Additions::default() };
        self.change_mesh(&mut additions)?;
        Ok(Arc::unwrap_or_clone(additions.mesh))
    }

    /// Materials of the object with the changes of the description; `None` if the description contains no key of a
    /// material.
    fn changed_materials<F: AssetLoader>(
        &self,
        world: &World,
        id: usize,
        mesh: &Mesh,
        keys: &Keys<KEYS>,
        files: &mut F,
    ) -> Result<Option<ChangedMaterials>, BuildFailure<F::Error>> {
        let colored = !keys.given(&["face_colors", "vertex_colors"]).is_empty();
        if !has_material_keys(keys) && !colored {
            return Ok(None);
        }
        let slots = &world.objects[id].materials;
        let mut materials: Vec<Material> = slots.iter().map(|&i| world.materials[i].clone()).collect();
        if colored {
            materials.iter_mut().for_each(|material| material.color = [1.0; 3]);
        }
        let (textures, notices) = self.change_materials(&mut materials, mesh, world.textures.len(), keys, files)?;
        let changed = ChangedMaterials { materials, textures, notices, is_of_new_mesh: false };
        changed.check()?;
        Ok(Some(changed))
    }
}

impl ChangedMaterials {
    fn of_new_mesh(materials: Vec<Material>) -> Self {
        Self { materials, textures: Vec::new(), notices: Vec::new(), is_of_new_mesh: true }
    }

    fn check(&self) -> Result<()> {
        self.materials.iter().try_for_each(Material::validate)?;
        self.textures.iter().try_for_each(Texture::validate)
    }
}

/// Assigns a mesh to an object, and detaches the object from nodes that would deform the previous mesh.
fn put_mesh(world: &mut World, id: usize, mesh: usize) {
    world.objects[id].mesh = mesh;
    let bends = |tree: &crate::animation::NodeTree| tree.objects.iter().any(|m| m.object == id && m.rest.is_some());
    if world.node_tree.as_deref().is_some_and(bends) {
        let name = &world.objects[id].name;
        world.notices.push(Notice::new(
            NoticeCode::DetachedPart,
            format!("object {name:?} has a new mesh; animations of its file no longer deform or move the object"),
        ));
        world.change_tree(|tree| tree.objects.retain(|mount| mount.object != id));
    } else {
        world.change_tree(|tree| {
            for mount in tree.objects.iter_mut().filter(|mount| mount.object == id) {
                mount.mesh = mesh;
            }
        });
    }
}

/// Indices of an object's materials that are also used outside of this object: by other objects, variants or animations.
fn shared_materials(world: &World, id: usize) -> HashSet<usize> {
    let mut own = world.objects[id].materials.clone();
    own.sort_unstable();
    let others = world.objects.iter().enumerate().filter(|(i, _)| *i != id).flat_map(|(_, object)| &object.materials);
    let variants = world.variants.iter().flat_map(|variant| &variant.materials).map(|(_, _, material)| material);
    let moving = world.node_tree.iter().flat_map(|tree| &tree.materials).map(|moving| &moving.material);
    let used = others.chain(variants).chain(moving).copied();
    used.filter(|material| own.binary_search(material).is_ok()).collect()
}

/// Assigns materials to an object. New materials replace the previous materials, or are added if the previous materials
/// are also used outside of the object. Slots that have the same material before and after the change keep sharing it.
fn put_materials(world: &mut World, id: usize, changed: ChangedMaterials) {
    let ChangedMaterials { materials, textures, notices, is_of_new_mesh } = changed;
    world.notices.extend(notices);
    for texture in textures {
        world.add_texture(texture);
    }
    let object = &world.objects[id];
    let name = object.name.clone();
    let slots = object.materials.clone();
    // Materials that must stay: those used outside of the object, and those that have already been replaced.
    let mut kept = shared_materials(world, id);
    // Indices of new materials by the slot's previous material and by the new values. The values are compared as `Debug`
    // text, because floats cannot be hashed.
    let mut known: HashMap<(usize, String), usize> = HashMap::new();
    let is_only = materials.len() == 1;
    let mut numbers = Vec::with_capacity(materials.len());
    for (slot, mut material) in materials.into_iter().enumerate() {
        world.note_reflectance(&material);
        let before = slots.get(slot).copied();
        let change = before.filter(|_| !is_of_new_mesh).map(|before| (before, format!("{material:?}")));
        if let Some(&number) = change.as_ref().and_then(|change| known.get(change)) {
            numbers.push(number);
            continue;
        }
        let number = match before.filter(|&before| kept.insert(before)) {
            Some(before) => {
                world.materials[before] = material.named(&name);
                before
            }
            None => {
                if !is_of_new_mesh && is_only {
                    material.name.clear(); // a single material is named after its object
                }
                world.materials.push(material.named(&name));
                world.materials.len() - 1
            }
        };
        if let Some(change) = change {
            known.insert(change, number);
        }
        numbers.push(number);
    }
    world.objects[id].materials = numbers;
}

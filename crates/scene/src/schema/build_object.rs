//! Conversion of an object's description to a placed mesh with its materials.

use glam::{DAffine3, DMat3, DVec3};

use crate::camera::sensor::LidarSurface;
use crate::counted::counted;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::material::Material;
use crate::math::rotation;
use crate::model::AssetLoader;
use crate::schema::build_failure::BuildFailure;
use crate::schema::displace_object::ObjectParts;
use crate::schema::geometry::{Additions, LoadedMeshes};
use crate::schema::keys::Keys;
use crate::schema::material_keys::has_material_keys;
use crate::schema::object_keys::{GEOMETRY, SHAPES};
use crate::schema::shorthand::{Category, Splat};
use crate::schema::spec::displace::DisplaceSpec;
use crate::schema::spec::object::{KEYS, ObjectSpec};
use crate::texture::Texture;
use crate::up::Up;
use crate::world::{Object, World};

impl ObjectSpec {
    /// Adds the described object to a world, with its mesh and materials, and returns its id. If this fails, the world
    /// is unchanged.
    ///
    /// # Errors
    /// [`SceneError`] for an invalid shape, transform or material, and the errors of `files`.
    pub fn build<F: AssetLoader>(self, world: &mut World, files: &mut F) -> Result<usize, F::Error> {
        self.build_object(world, files, &mut LoadedMeshes::default()).map_err(BuildFailure::into_error)
    }

    /// Same as [`ObjectSpec::build`], for callers that distinguish faults of the description from faults of a file;
    /// reuses the files that were read for earlier objects.
    pub(crate) fn build_object<F: AssetLoader>(
        mut self,
        world: &mut World,
        files: &mut F,
        known: &mut LoadedMeshes,
    ) -> Result<usize, BuildFailure<F::Error>> {
        self.displace = self.displace.filter(DisplaceSpec::is_on);
        let keys = self.keys();
        let kind = keys.exactly_one("shape", &SHAPES)?;
        if kind != "vertices" {
            keys.refuse_without("\"vertices\"", &["triangles"])?;
        }
        if kind != "mesh" {
            keys.refuse_without("\"mesh\", a file with an up axis", &["upright"])?;
        }
        self.check_material(&keys, self.mesh.is_some() || self.instance_of.is_some())?;
        let (world_from_mesh, shape) = self.object_transform(world.up, &keys)?;
        let name = self.object_name(kind)?;
        let (visible, shadow_catcher) = (self.visible.take(), self.shadow_catcher.unwrap_or(false));
        self.lidar.as_ref().map_or(Ok(()), LidarSurface::validate)?;
        let mut lidar = self.lidar.take();
        let mut category = self.category.take().map(|Category(name)| name);

        let (mesh, materials) = match self.instance_of.take() {
            None => {
                let file = self.mesh.clone();
                let plain = keys.given(&GEOMETRY).is_empty();
                let next = world.textures.len();
                let axes = self.file_axes(world.up);
                let (additions, read) = self.additions(&keys, axes, next, files, known, plain)?;
                let Additions { mut mesh, index, mut materials, mut textures, notices } = additions;
                let parts = ObjectParts {
                    mesh: &mut mesh,
                    materials: &mut materials,
                    known_textures: &world.textures,
                    new_textures: &mut textures,
                };
                self.displace_parts(parts, world_from_mesh.matrix3)?;
                let materials = add_materials(materials, textures, &name, world)?;
                world.notices.extend(notices);
                let index = index.unwrap_or_else(|| world.add_shared_mesh(mesh));
                if let (Some(file), Some(mut read)) = (file, read) {
                    read.index = read.index.or(plain.then_some(index));
                    known.insert((file, axes.target()), read);
                }
                (index, materials)
            }
            Some(original) => {
                keys.refuse(&GEOMETRY, "the mesh belongs to the object of instance_of; set this key for that object")?;
                let id = world.find_object(&original).map_err(|error| error.in_context("instance_of"))?;
                let Object { mesh, materials, category: theirs, lidar: its, .. } = world.objects[id].clone();
                (category, lidar) = (category.or(theirs), lidar.or(its));
                let changed = has_material_keys(&keys);
                let materials = match changed {
                    true => self.materials_of_instance(mesh, &materials, &keys, &name, world, files)?,
                    false => materials,
                };
                (mesh, materials)
            }
        };
        let placed = Object::new(name, mesh, materials, world_from_mesh);
        let mut object = Object { category, scale_shear: shape, shadow_catcher, lidar, ..placed };
        if let Some(visible) = visible {
            visible.apply(&mut object);
        }
        Ok(world.add_object(object)?)
    }

    /// Adds the materials of another object to the world, with the changes of this description; returns their indices.
    fn materials_of_instance<F: AssetLoader>(
        &self,
        mesh: usize,
        materials: &[usize],
        keys: &Keys<KEYS>,
        name: &str,
        world: &mut World,
        files: &mut F,
    ) -> Result<Vec<usize>, BuildFailure<F::Error>> {
        let next = world.textures.len();
        let originals = materials.iter().map(|&i| world.materials[i].clone());
        let mut changed: Vec<Material> = originals.collect();
        let (textures, notices) = self.change_materials(&mut changed, &world.meshes[mesh], next, keys, files)?;
        world.notices.extend(notices);
        if let [material] = &mut changed[..] {
            material.name.clear(); // a single material is named after its object
        }
        Ok(add_materials(changed, textures, name, world)?)
    }

    /// Returns world_from_mesh, and the scale and shear of this matrix, without location and rotation.
    pub(super) fn object_transform(&self, up: Up, keys: &Keys<KEYS>) -> Result<(DAffine3, DMat3)> {
        if let Some(rows) = &self.matrix {
            let others = ["location", "roll", "pitch", "yaw", "scale"];
            keys.refuse(
                &others,
                "cannot be combined with \"matrix\", which already contains it; use only one of them",
            )?;
            let transform = affine(rows).map_err(|error| error.in_context("matrix"))?;
            return Ok((transform, transform.matrix3));
        }
        let numbers = [("roll", self.roll), ("pitch", self.pitch), ("yaw", self.yaw)];
        if let Some((key, Some(angle))) = numbers.into_iter().find(|(_, v)| v.is_some_and(|v| !v.is_finite())) {
            return Err(SceneError::schema(
                ErrorCode::OutOfRange,
                key,
                format!("{angle}; expected a finite number of degrees"),
            ));
        }
        let location = DVec3::from_array(self.location.unwrap_or_default());
        if !location.is_finite() {
            return Err(SceneError::schema(
                ErrorCode::OutOfRange,
                "location",
                format!("{location}; expected finite numbers"),
            ));
        }
        let Splat(scale) = self.scale.unwrap_or(Splat([1.0; 3]));
        if !scale.iter().all(|v| v.is_normal() && v.recip().is_finite()) {
            return Err(SceneError::schema(
                ErrorCode::OutOfRange,
                "scale",
                format!("{scale:?}; expected finite numbers other than 0"),
            ));
        }
        let [roll, pitch, yaw] = numbers.map(|(_, angle)| angle.unwrap_or(0.0));
        let rotation = rotation::object_rotation(roll, pitch, yaw, up);
        let shape = DMat3::from_diagonal(DVec3::from_array(scale));
        Ok((DAffine3::from_mat3_translation(rotation * shape, location), shape))
    }

    /// Returns the object's name, or a name derived from its shape.
    fn object_name(&self, kind: &str) -> Result<String> {
        match (&self.name, &self.mesh, &self.instance_of) {
            (Some(name), ..) if name.is_empty() => Err(SceneError::schema(
                ErrorCode::MissingValue,
                "name",
                "\"\"; expected a non-empty name, \
                or no name",
            )),
            (Some(name), ..) | (None, None, Some(name)) => Ok(name.clone()),
            (None, Some(file), _) => {
                let file = file.rsplit(['/', '\\']).next().unwrap_or(file);
                Ok(file.rsplit_once('.').map_or(file, |(stem, _)| stem).into())
            }
            (None, None, None) => Ok(if kind == "vertices" { "mesh" } else { kind }.into()),
        }
    }
}

/// Adds materials and the images that they use to a world. Materials without a name get this name. If this fails,
/// nothing is added.
fn add_materials(
    materials: Vec<Material>,
    textures: Vec<Texture>,
    name: &str,
    world: &mut World,
) -> Result<Vec<usize>> {
    materials.iter().try_for_each(Material::validate)?;
    textures.iter().try_for_each(Texture::validate)?;
    for texture in textures {
        world.add_texture(texture);
    }
    materials.into_iter().map(|material| world.add_material(material.named(name))).collect()
}

/// Returns a 3x4 or 4x4 matrix as an invertible affine transform.
pub(super) fn affine(rows: &[[f64; 4]]) -> Result<DAffine3> {
    let fail = |message: String| Err(SceneError::schema(ErrorCode::InvalidMatrix, "", message));
    let (&[a, b, c], rest) = rows.split_first_chunk::<3>().map_or((&[[0.0; 4]; 3], rows), |split| split);
    if rows.len() < 3 || rows.len() > 4 {
        return fail(format!("{} of 4 numbers; expected 3 or 4 rows", counted(rows.len(), "row")));
    }
    if let Some(last) = rest.first().filter(|last| **last != [0.0, 0.0, 0.0, 1.0]) {
        return fail(format!("the last row is {last:?}; expected 0 0 0 1 (is the matrix transposed?)"));
    }
    let column = |i: usize| DVec3::new(a[i], b[i], c[i]);
    let linear = DMat3::from_cols(column(0), column(1), column(2));
    let transform = DAffine3::from_mat3_translation(linear, column(3));
    if !transform.is_finite() {
        return fail("the matrix is not finite; every number must be finite".into());
    }
    if !transform.inverse().is_finite() {
        return fail("the matrix is singular, so it flattens the object; expected an invertible matrix".into());
    }
    Ok(transform)
}

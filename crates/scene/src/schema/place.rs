//! From an object's description to a placed mesh with its materials.

use glam::{DAffine3, DMat3, DVec3};

use super::build::Failure;
use super::keys::Keys;
use super::object::{KEYS, ObjectSpec};
use super::style::STYLE;
use super::words::{Category, Refine, Scheme, Splat};
use crate::error::SceneError;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::model::Files;
use crate::pose;
use crate::primitive;
use crate::refine;
use crate::texture::Texture;
use crate::world::{Object, Up, World};

/// The keys that each say what the shape is.
const SHAPES: [&str; 9] = [
    "box",
    "plane",
    "sphere",
    "cylinder",
    "cone",
    "torus",
    "mesh",
    "vertices",
    "instance_of",
];
/// The keys that belong to the mesh, not to where it stands or what it is made of.
const GEOMETRY: [&str; 6] = [
    "triangles",
    "refine",
    "face_colors",
    "vertex_colors",
    "uvs",
    "normals",
];

/// What an object adds to the world besides itself.
struct Additions {
    mesh: Mesh,
    /// Their textures are indices into the world's, as if `textures` were added already.
    materials: Vec<Material>,
    textures: Vec<Texture>,
    notices: Vec<String>,
}

impl ObjectSpec {
    /// Adds the object it describes to a world, with its mesh and materials, and returns its id. The world is as it was
    /// where that fails.
    ///
    /// # Errors
    /// [`SceneError`] where shape, transform or material make no sense, and whatever `files` says.
    pub fn build<F: Files>(self, world: &mut World, files: &mut F) -> Result<usize, F::Error> {
        self.place(world, files).map_err(Failure::into_error)
    }

    /// [`ObjectSpec::build`], for who needs to know whether the description or a file is at fault.
    pub(super) fn place<F: Files>(
        mut self,
        world: &mut World,
        files: &mut F,
    ) -> Result<usize, Failure<F::Error>> {
        let keys = self.keys();
        let kind = keys.exactly_one("shape", &SHAPES)?;
        if kind != "vertices" {
            keys.refuse(
                &["triangles"],
                "it goes with \"vertices\", which is missing",
            )?;
        }
        self.check_style(&keys)?;
        let (world_from_mesh, shape) = self.transform(world.up, &keys)?;
        let name = self.chosen_name(kind)?;
        let mut category = self.category.take().map(|Category(name)| name);

        let (mesh, materials) = match self.instance_of.take() {
            None => {
                let Additions {
                    mesh,
                    materials,
                    textures,
                    notices,
                } = self.additions(&keys, world.textures.len(), files)?;
                let materials = add_materials(materials, textures, &name, world)?;
                world.notices.extend(notices);
                (world.add_mesh(mesh), materials)
            }
            Some(original) => {
                keys.refuse(
                    &GEOMETRY,
                    "the mesh is that of another object: this belongs there",
                )?;
                let id = world
                    .find_object(&original)
                    .map_err(|error| error.within("instance_of"))?;
                let Object {
                    mesh,
                    materials,
                    category: theirs,
                    ..
                } = world.objects[id].clone();
                category = category.or(theirs);
                if keys.given(&STYLE).is_empty() {
                    (mesh, materials)
                } else {
                    let next = world.textures.len();
                    let (textures, puts) = self.read_textures(&world.meshes[mesh], next, files)?;
                    let mut restyled: Vec<Material> = materials
                        .iter()
                        .map(|&i| world.materials[i].clone())
                        .collect();
                    self.restyle_all(&mut restyled, &puts, &keys)?;
                    for material in &mut restyled {
                        material.name.clear();
                    }
                    (mesh, add_materials(restyled, textures, &name, world)?)
                }
            }
        };
        Ok(world.add_object(Object {
            name,
            category,
            mesh,
            materials,
            world_from_mesh,
            shape,
        })?)
    }

    /// Its own mesh, refined and checked, with its materials and their textures; the first of these will be the world's
    /// `next_texture`.
    fn additions<F: Files>(
        &mut self,
        keys: &Keys<KEYS>,
        next_texture: usize,
        files: &mut F,
    ) -> Result<Additions, Failure<F::Error>> {
        let mut additions = match &self.mesh {
            Some(file) => {
                let model = files.mesh(file).map_err(Failure::File)?;
                let (mesh, slots) = model.merged().map_err(|error| error.within("mesh"))?;
                let mut materials: Vec<Material> = slots
                    .iter()
                    .map(|&slot| model.materials[slot].clone())
                    .collect();
                for material in &mut materials {
                    material
                        .texture_slots_mut()
                        .for_each(|slot| slot.texture += next_texture);
                }
                Additions {
                    mesh,
                    materials,
                    textures: model.textures,
                    notices: model.notices,
                }
            }
            None => Additions {
                mesh: self.own_mesh()?,
                materials: vec![],
                textures: vec![],
                notices: vec![],
            },
        };
        let mesh = &mut additions.mesh;
        if self.face_colors.is_some() || self.vertex_colors.is_some() {
            // Colours named here show as they are, whatever the file's materials say.
            additions
                .materials
                .iter_mut()
                .for_each(|material| material.color = [1.0; 3]);
        }
        mesh.face_colors = self.face_colors.take().or(mesh.face_colors.take());
        mesh.vertex_colors = self.vertex_colors.take().or(mesh.vertex_colors.take());
        mesh.uvs = self.uvs.take().or(mesh.uvs.take());
        if let Some(normals) = self.normals.take() {
            mesh.normals = Some(unit_length(normals)?);
        }
        mesh.validate()?;
        if let Some(Refine { levels, scheme }) = self.refine {
            let refined = match scheme {
                Scheme::Loop => refine::loop_subdivide(mesh, levels),
                Scheme::Midpoint => refine::midpoint(mesh, levels),
            };
            *mesh = refined.map_err(|error| error.within("refine"))?;
        }
        if additions.materials.is_empty() {
            additions.materials.push(Material::plain(mesh));
        }
        let next = next_texture + additions.textures.len();
        let (textures, puts) = self.read_textures(mesh, next, files)?;
        additions.textures.extend(textures);
        self.restyle_all(&mut additions.materials, &puts, keys)?;
        Ok(additions)
    }

    /// The mesh of a primitive, or of vertices and triangles.
    fn own_mesh(&mut self) -> Result<Mesh, SceneError> {
        let of =
            |key: &str, mesh: Result<Mesh, SceneError>| mesh.map_err(|error| error.within(key));
        if let Some(shape) = &self.box_ {
            return of("box", primitive::box_(shape.size.0));
        }
        if let Some(shape) = &self.plane {
            return of("plane", primitive::plane(shape.size.0));
        }
        if let Some(shape) = &self.sphere {
            return of("sphere", primitive::sphere(shape.radius, shape.level));
        }
        if let Some(shape) = &self.cylinder {
            return of(
                "cylinder",
                primitive::cylinder(shape.radius, shape.height, shape.segments),
            );
        }
        if let Some(shape) = &self.cone {
            return of(
                "cone",
                primitive::cone(shape.radius, shape.height, shape.segments),
            );
        }
        if let Some(shape) = &self.torus {
            return of(
                "torus",
                primitive::torus(shape.radius, shape.tube, shape.segments),
            );
        }
        let Some(triangles) = self.triangles.take() else {
            return Err(SceneError::schema(
                "vertices",
                "it goes with \"triangles\", which is missing",
            ));
        };
        let vertices = self.vertices.take().unwrap_or_default();
        Ok(Mesh {
            vertices: vertices.into_iter().map(DVec3::from_array).collect(),
            triangles,
            ..Mesh::default()
        })
    }

    /// world_from_mesh, and the part of it that is not location and rotation.
    fn transform(&self, up: Up, keys: &Keys<KEYS>) -> Result<(DAffine3, DMat3), SceneError> {
        if let Some(rows) = &self.matrix {
            let others = ["location", "roll", "pitch", "yaw", "scale"];
            keys.refuse(
                &others,
                "\"matrix\" is given too, and says it already: give one of them",
            )?;
            let transform = affine(rows).map_err(|error| error.within("matrix"))?;
            return Ok((transform, transform.matrix3));
        }
        let numbers = [
            ("roll", self.roll),
            ("pitch", self.pitch),
            ("yaw", self.yaw),
        ];
        if let Some((key, Some(angle))) = numbers
            .into_iter()
            .find(|(_, v)| v.is_some_and(|v| !v.is_finite()))
        {
            return Err(SceneError::schema(
                key,
                format!("{angle}: expected a finite number of degrees"),
            ));
        }
        let location = DVec3::from_array(self.location.unwrap_or_default());
        if !location.is_finite() {
            return Err(SceneError::schema(
                "location",
                format!("{location}: expected finite numbers"),
            ));
        }
        let Splat(scale) = self.scale.unwrap_or(Splat([1.0; 3]));
        if !scale.iter().all(|v| v.is_normal() && v.recip().is_finite()) {
            return Err(SceneError::schema(
                "scale",
                format!("{scale:?}: expected finite numbers other than 0"),
            ));
        }
        let [roll, pitch, yaw] = numbers.map(|(_, angle)| angle.unwrap_or(0.0));
        let rotation = pose::object_rotation(roll, pitch, yaw, up);
        let shape = DMat3::from_diagonal(DVec3::from_array(scale));
        Ok((
            DAffine3::from_mat3_translation(rotation * shape, location),
            shape,
        ))
    }

    /// Its name, or the word for what it is.
    fn chosen_name(&self, kind: &str) -> Result<String, SceneError> {
        match (&self.name, &self.mesh, &self.instance_of) {
            (Some(name), ..) if name.is_empty() => {
                Err(SceneError::schema("name", "\"\": expected a name, or none"))
            }
            (Some(name), ..) | (None, None, Some(name)) => Ok(name.clone()),
            (None, Some(file), _) => {
                let file = file.rsplit(['/', '\\']).next().unwrap_or(file);
                Ok(file.rsplit_once('.').map_or(file, |(stem, _)| stem).into())
            }
            (None, None, None) => Ok(if kind == "vertices" { "mesh" } else { kind }.into()),
        }
    }
}

/// Adds materials, named where they have no name, and the images they use to a world, all or none of them.
fn add_materials(
    materials: Vec<Material>,
    textures: Vec<Texture>,
    name: &str,
    world: &mut World,
) -> Result<Vec<usize>, SceneError> {
    materials.iter().try_for_each(Material::validate)?;
    textures.iter().try_for_each(Texture::validate)?;
    for texture in textures {
        world.add_texture(texture);
    }
    materials
        .into_iter()
        .map(|material| world.add_material(material.named(name)))
        .collect()
}

/// A 3x4 or 4x4 matrix as an invertible affine transform.
fn affine(rows: &[[f64; 4]]) -> Result<DAffine3, SceneError> {
    let fail = |message: String| Err(SceneError::schema("", message));
    let (&[a, b, c], rest) = rows
        .split_first_chunk::<3>()
        .map_or((&[[0.0; 4]; 3], rows), |split| split);
    if rows.len() < 3 || rows.len() > 4 {
        return fail(format!("{} rows of 4: expected 3 or 4", rows.len()));
    }
    if let Some(last) = rest.first().filter(|last| **last != [0.0, 0.0, 0.0, 1.0]) {
        return fail(format!(
            "the last row is {last:?}, expected 0 0 0 1: is the matrix transposed?"
        ));
    }
    let column = |i: usize| DVec3::new(a[i], b[i], c[i]);
    let linear = DMat3::from_cols(column(0), column(1), column(2));
    let transform = DAffine3::from_mat3_translation(linear, column(3));
    if !transform.is_finite() {
        return fail("every number must be finite".into());
    }
    if !transform.inverse().is_finite() {
        return fail("it is singular: it flattens the object".into());
    }
    Ok(transform)
}

/// Normals of length 1.
fn unit_length(normals: Vec<[f32; 3]>) -> Result<Vec<[f32; 3]>, SceneError> {
    let unit = |(i, normal): (usize, [f32; 3])| {
        let unit = DVec3::from_array(normal.map(f64::from)).try_normalize();
        unit.map(|unit| unit.as_vec3().to_array()).ok_or_else(|| {
            SceneError::schema(
                format!("normals[{i}]"),
                format!("{normal:?}: expected a direction, not 0, all finite"),
            )
        })
    };
    normals.into_iter().enumerate().map(unit).collect()
}

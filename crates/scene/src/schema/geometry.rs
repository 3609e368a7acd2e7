//! Mesh of an object's description: a primitive, a file's mesh, or vertices and triangles.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::keys::Keys;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::mesh::primitive;
use crate::mesh::subdivide;
use crate::model::{AssetLoader, SingleMesh};
use crate::notice::{Notice, NoticeCode};
use crate::schema::build_failure::BuildFailure;
use crate::schema::shorthand::{Refine, Scheme};
use crate::schema::spec::object::{KEYS, ObjectSpec};
use crate::texture::Texture;
use crate::up::Up;

/// Mesh files that have been read, by name and target up axis: a file that several objects name is read once.
pub type LoadedMeshes = HashMap<(String, Option<Up>), LoadedMesh>;

/// Contents of a mesh file.
#[derive(Clone)]
pub struct LoadedMesh {
    /// All parts of the file, joined into one mesh.
    pub mesh: Arc<Mesh>,
    /// Index of the mesh in the world, if the world contains it unchanged.
    pub index: Option<usize>,
    /// Materials of the file; their textures are indices into the world's textures.
    pub materials: Vec<Material>,
}

/// Mesh, materials and textures that an object adds to the world.
#[derive(Default)]
pub(super) struct Additions {
    pub(super) mesh: Arc<Mesh>,
    /// Index of the mesh, if the world already contains it.
    pub(super) index: Option<usize>,
    /// Materials; their textures are indices into the world's textures, as if `textures` had already been added.
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    pub(super) notices: Vec<Notice>,
}

/// Axes of a mesh file in a world: rotated to the world's up axis, or kept.
#[derive(Clone, Copy)]
pub(super) struct FileAxes {
    world_up: Up,
    /// The key `upright`, if given.
    upright: Option<bool>,
    /// True if the object has a `matrix`, which refers to the file's own axes.
    has_matrix: bool,
}

impl FileAxes {
    /// Up axis to which the mesh is rotated; `None` if the mesh keeps the file's axes.
    pub(super) fn target(self) -> Option<Up> {
        self.upright.unwrap_or(!self.has_matrix).then_some(self.world_up)
    }

    /// Notice for a file whose up axis `from` differs from the world's up axis `to`; `None` if the description
    /// explicitly keeps the axes.
    fn notice(self, file: &str, from: &str, to: &str) -> Option<Notice> {
        let message = match (self.target(), self.upright) {
            (Some(_), _) => format!(
                "{file}: its up axis, {from}, is rotated to {to}; set upright = false to keep it, for example if poses \
                 from a physics engine are applied later"
            ),
            (None, None) => format!(
                "{file}: its up axis, {from}, is not rotated to {to}, because matrix applies to the file's own axes; \
                 set upright = true to rotate it before matrix is applied"
            ),
            (None, Some(_)) => return None,
        };
        Some(Notice::new(NoticeCode::ConvertedUpAxis, message))
    }
}

impl ObjectSpec {
    /// Axes of the object's mesh file in a world with this up axis.
    pub(super) fn file_axes(&self, world_up: Up) -> FileAxes {
        FileAxes { world_up, upright: self.upright, has_matrix: self.matrix.is_some() }
    }

    /// Returns the object's refined and checked mesh, with its materials and their textures. The first of these
    /// textures will have the index `next_texture` in the world. If the object has a file, also returns the file's
    /// contents, rotated according to `axes`. `plain` is true for an unmodified mesh of a file.
    pub(super) fn additions<F: AssetLoader>(
        &mut self,
        keys: &Keys<KEYS>,
        axes: FileAxes,
        next_texture: usize,
        files: &mut F,
        known: &LoadedMeshes,
        plain: bool,
    ) -> Result<(Additions, Option<LoadedMesh>), BuildFailure<F::Error>> {
        let (mut textures, mut notices) = (Vec::new(), Vec::new());
        let read = match &self.mesh {
            None => None,
            Some(file) => Some(match known.get(&(file.clone(), axes.target())) {
                Some(known) => known.clone(),
                None => {
                    let single = read_single_mesh(file, axes.target(), files)?;
                    let mut materials = single.materials;
                    for material in &mut materials {
                        material.texture_slots_mut().for_each(|slot| slot.texture += next_texture);
                    }
                    (textures, notices) = (single.textures, single.notices);
                    if let Some(from) = single.up.filter(|from| *from != axes.world_up) {
                        notices.extend(axes.notice(file, from.name(), axes.world_up.name()));
                    }
                    LoadedMesh { mesh: single.mesh, index: None, materials }
                }
            }),
        };
        let mut additions = Additions {
            mesh: match &read {
                Some(read) => Arc::clone(&read.mesh),
                None => Arc::new(self.own_mesh()?),
            },
            index: read.as_ref().and_then(|read| read.index).filter(|_| plain),
            materials: read.iter().flat_map(|read| read.materials.clone()).collect(),
            textures,
            notices,
        };
        if read.is_none() || !plain {
            self.change_mesh(&mut additions)?;
        }
        if additions.materials.is_empty() {
            additions.materials.push(Material::for_mesh(&additions.mesh));
        }
        let next = next_texture + additions.textures.len();
        let (textures, notices) =
            self.change_materials(&mut additions.materials, &additions.mesh, next, keys, files)?;
        additions.textures.extend(textures);
        additions.notices.extend(notices);
        let colored = [additions.mesh.face_colors.is_some(), additions.mesh.vertex_colors.is_some()];
        if let Some(file) = self.mesh.as_ref().filter(|_| self.color.is_some() && colored.contains(&true)) {
            additions.notices.push(Notice::new(
                NoticeCode::MultipliedColors,
                format!(
                    "{file}: color multiplies the colours of the mesh's vertices or faces; set color = \"white\" to \
                 show them unchanged"
                ),
            ));
        } else if colored == [true; 2] {
            additions.notices.push(Notice::new(
                NoticeCode::MultipliedColors,
                "both face_colors and vertex_colors are given; their product is shown",
            ));
        }
        Ok((additions, read))
    }

    /// Applies the description's attributes to the mesh, and checks the mesh.
    pub(super) fn change_mesh(&mut self, additions: &mut Additions) -> Result<()> {
        let mesh = Arc::make_mut(&mut additions.mesh);
        if self.face_colors.as_ref().is_some_and(Vec::is_empty) {
            (mesh.face_colors, self.face_colors) = (None, None);
        }
        if self.face_colors.is_some() || self.vertex_colors.is_some() {
            // Colours specified in the description are shown unchanged, so the colours of the file's materials are
            // reset to white.
            additions.materials.iter_mut().for_each(|material| material.color = [1.0; 3]);
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
                Scheme::Loop => subdivide::loop_subdivide(mesh, levels),
                Scheme::Midpoint => subdivide::midpoint(mesh, levels),
            };
            *mesh = refined.map_err(|error| error.in_context("refine"))?;
        }
        Ok(())
    }

    /// Mesh of a primitive, or of vertices and triangles.
    fn own_mesh(&mut self) -> Result<Mesh> {
        let of = |key: &str, mesh: Result<Mesh>| mesh.map_err(|error| error.in_context(key));
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
            return of("cylinder", primitive::cylinder(shape.radius, shape.height, shape.segments));
        }
        if let Some(shape) = &self.cone {
            return of("cone", primitive::cone(shape.radius, shape.height, shape.segments));
        }
        if let Some(shape) = &self.torus {
            return of("torus", primitive::torus(shape.radius, shape.tube, shape.segments));
        }
        let Some(triangles) = self.triangles.take() else {
            return Err(SceneError::schema(
                ErrorCode::MissingValue,
                "vertices",
                "requires \"triangles\", which is missing",
            ));
        };
        let vertices = self.vertices.take().unwrap_or_default();
        Ok(Mesh { vertices: vertices.into_iter().map(DVec3::from_array).collect(), triangles, ..Mesh::default() })
    }
}

/// Returns a mesh file as one mesh, rotated to `up` if the file specifies another up axis.
fn read_single_mesh<F: AssetLoader>(
    file: &str,
    up: Option<Up>,
    files: &mut F,
) -> Result<SingleMesh, BuildFailure<F::Error>> {
    if let Some(shared) = files.shared_mesh(file, up) {
        return Ok(shared);
    }
    let model = files.mesh(file).map_err(|error| BuildFailure::File("mesh".into(), error))?;
    let (mesh, slots) = model.as_single_mesh().map_err(|error| error.in_context("mesh"))?;
    let mesh = match (model.up, up) {
        (Some(from), Some(to)) if from != to => mesh.transformed(DAffine3::from_mat3(to.rotation_from(from))),
        _ => mesh,
    };
    let materials = slots.iter().map(|&slot| model.materials[slot].clone()).collect();
    let (textures, notices) = (model.textures, model.notices);
    let single = SingleMesh { mesh: Arc::new(mesh), materials, textures, notices, up: model.up };
    files.share_mesh(file, up, &single);
    Ok(single)
}

/// Normalises normals to length 1.
fn unit_length(normals: Vec<[f32; 3]>) -> Result<Vec<[f32; 3]>> {
    let unit = |(i, normal): (usize, [f32; 3])| {
        let unit = DVec3::from_array(normal.map(f64::from)).try_normalize();
        unit.map(|unit| unit.as_vec3().to_array()).ok_or_else(|| {
            SceneError::schema(
                ErrorCode::OutOfRange,
                format!("normals[{i}]"),
                format!("{normal:?}; expected a finite direction other than 0"),
            )
        })
    };
    normals.into_iter().enumerate().map(unit).collect()
}

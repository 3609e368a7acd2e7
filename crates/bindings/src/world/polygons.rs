//! Worlds and objects from the arrays of polygon meshes, which a separate process has read.

use std::path::PathBuf;

use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use raycam_formats::polygon_arrays::PolygonArrays;
use raycam_formats::{AssetRoot, FormatError};
use raycam_scene::schema::{ObjectSpec, WorldFile, from_value};
use raycam_scene::{AssetLoader, ColorUse, IesProfile, Image, MeshFile, Texture, World as Inner, Wrap};

use crate::arrays::{flat, rows};
use crate::error::{OrRaise, detached};
use crate::world::array_images::FilesAndArrays;
use crate::world::from_description::described;
use crate::world::state::{World, budget};

/// Arrays of [`PolygonArrays`], by name.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct PolygonInput<'py> {
    meshes: PyReadonlyArrayDyn<'py, u64>,
    points: PyReadonlyArrayDyn<'py, f64>,
    colors: PyReadonlyArrayDyn<'py, f32>,
    uvs: PyReadonlyArrayDyn<'py, f32>,
    normals: PyReadonlyArrayDyn<'py, f32>,
    polygons: PyReadonlyArrayDyn<'py, u32>,
    corners: PyReadonlyArrayDyn<'py, u32>,
    names: Vec<String>,
    object_meshes: PyReadonlyArrayDyn<'py, u32>,
    object_materials: PyReadonlyArrayDyn<'py, u32>,
    object_matrices: PyReadonlyArrayDyn<'py, f64>,
    materials: Vec<String>,
    plain_materials: PyReadonlyArrayDyn<'py, f32>,
}

impl PolygonInput<'_> {
    fn arrays(&self) -> PyResult<PolygonArrays<'_>> {
        Ok(PolygonArrays {
            meshes: rows(&self.meshes, "meshes")?,
            points: rows(&self.points, "points")?,
            colors: rows(&self.colors, "colors")?,
            uvs: rows(&self.uvs, "uvs")?,
            normals: rows(&self.normals, "normals")?,
            polygons: rows(&self.polygons, "polygons")?,
            corners: rows(&self.corners, "corners")?,
            names: self.names.clone(),
            object_meshes: flat(&self.object_meshes, "object_meshes")?,
            object_materials: flat(&self.object_materials, "object_materials")?,
            object_matrices: rows(&self.object_matrices, "object_matrices")?,
            materials: self.materials.clone(),
            plain_materials: rows(&self.plain_materials, "plain_materials")?,
        })
    }
}

/// Builds a world from polygon meshes and a description without objects. Materials and images are in `folder`.
#[pyfunction]
pub(crate) fn world_from_polygons(
    description: &Bound<'_, PyAny>,
    polygons: PolygonInput<'_>,
    folder: PathBuf,
    texture_memory: Option<u64>,
) -> PyResult<World> {
    let (_, value) = described(description)?;
    let arrays = polygons.arrays()?;
    let build = || -> Result<Inner, FormatError> {
        let mut files = AssetRoot::new(&folder, &budget(texture_memory));
        let mut world = from_value::<WorldFile>(&value)?.build(&mut files)?;
        arrays.add_to(&mut world, &folder, &mut files)?;
        files.finish_world(&mut world)?;
        Ok(world)
    };
    Ok(World::from_inner(detached(description.py(), build)?, PathBuf::new()))
}

/// Adds polygon meshes as one object; the description contains a name in place of the mesh file.
#[pyfunction]
pub(crate) fn world_add_polygons(
    world: &World,
    description: &Bound<'_, PyAny>,
    polygons: PolygonInput<'_>,
    folder: PathBuf,
) -> PyResult<usize> {
    let (images, value) = described(description)?;
    let spec: ObjectSpec = from_value(&value).or_raise()?;
    let arrays = polygons.arrays()?;
    world.add_description(description.py(), None, |inner, files| {
        let limits = *files.budget();
        let mut own = AssetRoot::new(&folder, &limits).extending(inner);
        let model = arrays.merge(&folder, &mut own)?;
        spec.build(inner, &mut FilesAndModel { files: FilesAndArrays::new(files, &images), model: Some(model) })
    })
}

/// Files and arrays of a description, and a model that has been read.
struct FilesAndModel<'a> {
    files: FilesAndArrays<'a>,
    model: Option<MeshFile>,
}

impl AssetLoader for FilesAndModel<'_> {
    type Error = FormatError;

    fn mesh(&mut self, file: &str) -> Result<MeshFile, FormatError> {
        match self.model.take() {
            Some(model) => Ok(model),
            None => self.files.mesh(file),
        }
    }

    fn texture(&mut self, file: &str, wrap: [Wrap; 2], color_use: ColorUse) -> Result<Texture, FormatError> {
        self.files.texture(file, wrap, color_use)
    }

    fn environment(&mut self, file: &str) -> Result<std::sync::Arc<Image>, FormatError> {
        self.files.environment(file)
    }

    fn profile(&mut self, file: &str) -> Result<IesProfile, FormatError> {
        self.files.profile(file)
    }

    fn store_texture(&mut self, image: std::sync::Arc<Image>) -> Result<std::sync::Arc<Image>, FormatError> {
        self.files.store_texture(image)
    }

    fn picture(&mut self, file: &str) -> Result<String, FormatError> {
        self.files.picture(file)
    }

    fn bytes(&mut self, file: &str) -> Result<Vec<u8>, FormatError> {
        self.files.bytes(file)
    }

    fn in_context(error: FormatError, key: &str) -> FormatError {
        AssetRoot::in_context(error, key)
    }
}

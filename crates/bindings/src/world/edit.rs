//! Changes of worlds: objects, lights and cameras. Each change is atomic.

use std::path::PathBuf;

use glam::{DAffine3, DMat3, DVec3};
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_scene::schema::{LightSpec, ObjectSpec, from_value};
use raycam_scene::{Light, World as Inner, counted};

use crate::arrays::Floats;
use crate::camera::Camera;
use crate::error::{IntoPyErr, OrRaise, world_error};
use crate::world::array_images::FilesAndArrays;
use crate::world::from_description::{described, name_array};
use crate::world::state::World;

/// Object by index or name.
#[derive(Clone, FromPyObject)]
pub(crate) enum Which {
    Number(i64),
    Name(String),
}

impl Which {
    /// Index of the object in a world.
    pub(crate) fn number_in(&self, world: &Inner) -> PyResult<usize> {
        let id = match self {
            Self::Name(name) => return world.find_object(name).or_raise(),
            Self::Number(number) => usize::try_from(*number).unwrap_or(usize::MAX),
        };
        match (self, world.check_object(id)) {
            (_, Ok(())) => Ok(id),
            (Self::Number(number), _) if *number < 0 => {
                Err(world_error(format!("object {number} does not exist; expected an index of at least 0, or a name")))
            }
            (_, Err(error)) => Err(error.into_py_err()),
        }
    }
}

/// Affine transform from the numbers of a 4 x 4 or 3 x 4 matrix, row by row.
pub(crate) fn affine(rows: &[f64]) -> PyResult<DAffine3> {
    let (&[a, b, c, d, e, f, g, h, i, j, k, l], rest) = rows.split_first_chunk::<12>().ok_or_else(|| {
        world_error(format!("matrix: {}; expected 16 (4 x 4) or 12 (3 x 4)", counted(rows.len(), "number")))
    })?;
    if !rest.is_empty() && rest != [0.0, 0.0, 0.0, 1.0] {
        return Err(world_error(format!(
            "matrix: the last row is {rest:?}; expected 0 0 0 1 (is the matrix transposed?)"
        )));
    }
    let linear = DMat3::from_cols_array_2d(&[[a, e, i], [b, f, j], [c, g, k]]);
    Ok(DAffine3::from_mat3_translation(linear, DVec3::new(d, h, l)))
}

/// Changes an object as described; the files that the description names may be in any folder.
#[pyfunction]
pub(crate) fn world_set_object(world: &World, which: Which, description: &Bound<'_, PyDict>) -> PyResult<()> {
    let py = description.py();
    if description.len() == 1
        && let Some(matrix) = description.get_item("matrix")?
        && let Ok(matrix) = matrix.extract::<Floats<'_>>()
        && matches!(matrix.shape(), [3 | 4, 4])
    {
        let place = affine(&matrix.as_array().iter().copied().collect::<Vec<_>>())?;
        return world.modify(|inner| inner.place_object(which.number_in(inner)?, place).or_raise());
    }
    let (arrays, value) = described(description)?;
    let spec: ObjectSpec = from_value(&value).or_raise()?;
    let placed = world.modify(|inner| spec.change_placement(inner, which.number_in(inner)?).transpose().or_raise())?;
    if placed.is_some() {
        return Ok(());
    }
    world.change_by_files(py, None, |inner, files| {
        let id = match which.number_in(inner) {
            Ok(id) => id,
            Err(error) => return Ok(Err(error)),
        };
        spec.change(inner, id, &mut FilesAndArrays::new(files, &arrays))?;
        Ok(Ok(()))
    })?
}

/// Removes an object.
#[pyfunction]
pub(crate) fn world_remove_object(world: &World, which: Which) -> PyResult<()> {
    world.modify_or_restore(|inner| inner.remove_object(which.number_in(inner)?).or_raise())
}

/// Replaces a light by the described light; the files that the description names may be in any folder. If `keeps_file`
/// is true, a light of the same type keeps its image or profile.
#[pyfunction]
pub(crate) fn world_set_light(
    world: &World,
    number: usize,
    description: &Bound<'_, PyAny>,
    keeps_file: bool,
    within: Option<PathBuf>,
) -> PyResult<()> {
    let (arrays, value) = described(description)?;
    let spec: LightSpec = from_value(&value).or_raise()?;
    let (mut light, traits) = spec.build(world.snapshot().up).or_raise()?;
    world.change_by_files(description.py(), within, |inner, files| {
        inner.check_light(number)?;
        match (&mut light, &inner.lights[number]) {
            (Light::Environment { image, .. }, Light::Environment { image: before, .. }) if keeps_file => {
                *image = before.clone();
            }
            (Light::Projector { image, .. }, Light::Projector { image: before, .. }) if keeps_file => {
                *image = before.clone();
            }
            (Light::Ies { profile, .. }, Light::Ies { profile: before, .. }) if keeps_file => {
                *profile = before.clone();
            }
            _ => {}
        }
        light.read(&mut FilesAndArrays::new(files, &arrays))?;
        name_array(&mut light);
        inner.set_light(number, light)?;
        Ok(inner.set_light_traits(number, traits)?)
    })
}

/// Removes a light.
#[pyfunction]
pub(crate) fn world_remove_light(world: &World, number: usize) -> PyResult<()> {
    world.modify(|inner| inner.remove_light(number).or_raise())
}

/// Replaces a camera.
#[pyfunction]
pub(crate) fn world_set_camera(world: &World, name: &str, camera: &Camera) -> PyResult<()> {
    world.modify_unseen(|inner| inner.set_camera(name, camera.inner.clone()).or_raise())
}

/// Removes a camera.
#[pyfunction]
pub(crate) fn world_remove_camera(world: &World, name: &str) -> PyResult<()> {
    world.modify_unseen(|inner| inner.remove_camera(name).or_raise())
}

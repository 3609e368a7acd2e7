//! Worlds built from descriptions.

use std::path::PathBuf;

use pyo3::prelude::*;
use raycam_formats::{AssetRoot, FormatError};
use raycam_scene::schema::{FogSpec, LightSpec, ObjectSpec, SpannedValue, VideoSpec, WorldFile, from_value};
use raycam_scene::{Light, World as Inner};

use crate::error::{OrRaise, detached};
use crate::py_value::to_value;
use crate::world::array_images::{ArrayImages, FilesAndArrays, NAME, is_array};
use crate::world::shared_files::SharedFiles;
use crate::world::state::{World, budget};

/// Description, and the images in it that are arrays.
pub(crate) fn described(description: &Bound<'_, PyAny>) -> PyResult<(ArrayImages, SpannedValue)> {
    let mut arrays = ArrayImages::default();
    let value = to_value(&arrays.take_arrays(description, "")?, "")?;
    Ok((arrays, value))
}

/// Builds the world of a description, whose files must be in `folder`. Worlds with the same `shared` read each file
/// once and share the meshes and textures built from it. With `texture_memory`, nothing is shared.
#[pyfunction]
#[pyo3(signature = (description, folder, texture_memory, shared=None))]
pub(crate) fn world_from_dict(
    description: &Bound<'_, PyAny>,
    folder: PathBuf,
    texture_memory: Option<u64>,
    shared: Option<Py<SharedFiles>>,
) -> PyResult<World> {
    let (arrays, value) = described(description)?;
    let shared = shared.as_ref().map(Py::get).filter(|_| texture_memory.is_none());
    let build = || -> Result<Inner, FormatError> {
        let mut files = AssetRoot::new(&folder, &budget(texture_memory));
        let mut world =
            from_value::<WorldFile>(&value)?.build(&mut FilesAndArrays::new(&mut files, &arrays).sharing(shared))?;
        world.lights.iter_mut().for_each(name_array);
        files.finish_world(&mut world)?;
        Ok(world)
    };
    let world = World::from_inner(detached(description.py(), build)?, PathBuf::new());
    if let Some(shared) = shared {
        world.state().family = shared.family.clone();
    }
    Ok(world)
}

/// Adds an object. The object's files may be in any folder or, with `within`, only in that folder; `shared` contains
/// files of the same folder.
#[pyfunction]
#[pyo3(signature = (world, description, within, shared=None))]
pub(crate) fn world_add_object(
    world: &World,
    description: &Bound<'_, PyAny>,
    within: Option<PathBuf>,
    shared: Option<Py<SharedFiles>>,
) -> PyResult<usize> {
    let (arrays, value) = described(description)?;
    let spec: ObjectSpec = from_value(&value).or_raise()?;
    let shared = shared.as_ref().map(Py::get);
    world.add_description(description.py(), within, |inner, files| {
        let shared = shared.filter(|_| inner.texture_cache.is_none());
        spec.build(inner, &mut FilesAndArrays::new(files, &arrays).sharing(shared))
    })
}

/// Adds a light, with files as for [`world_add_object`].
#[pyfunction]
#[pyo3(signature = (world, description, within, shared=None))]
pub(crate) fn world_add_light(
    world: &World,
    description: &Bound<'_, PyAny>,
    within: Option<PathBuf>,
    shared: Option<Py<SharedFiles>>,
) -> PyResult<usize> {
    let (arrays, value) = described(description)?;
    let spec: LightSpec = from_value(&value).or_raise()?;
    let (mut light, traits) = spec.build(world.snapshot().up).or_raise()?;
    let shared = shared.as_ref().map(Py::get);
    world.add_description(description.py(), within, |inner, files| {
        let shared = shared.filter(|_| inner.texture_cache.is_none());
        light.read(&mut FilesAndArrays::new(files, &arrays).sharing(shared))?;
        name_array(&mut light);
        let number = inner.add_light(light)?;
        inner.set_light_traits(number, traits)?;
        Ok(number)
    })
}

/// Renames the image of a light if the image was given as an array.
pub(crate) fn name_array(light: &mut Light) {
    if let Light::Environment { image, .. } | Light::Projector { image, .. } = light
        && is_array(&image.file)
    {
        image.file = NAME.into();
    }
}

/// Sets, replaces or removes the `[fog]` of the world.
#[pyfunction]
pub(crate) fn world_set_fog(world: &World, description: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    let fog = match description {
        Some(description) => {
            let spec: FogSpec = from_value(&to_value(description, "")?).or_raise()?;
            Some(spec.build().or_raise()?)
        }
        None => None,
    };
    world.modify(|inner| {
        inner.fog = fog;
        Ok(())
    })
}

/// Sets or replaces the `[video]` of the world.
#[pyfunction]
pub(crate) fn world_set_video(world: &World, description: &Bound<'_, PyAny>) -> PyResult<()> {
    let spec: VideoSpec = from_value(&to_value(description, "")?).or_raise()?;
    world.modify_unseen(|inner| {
        inner.video = Some(spec.build(inner).or_raise()?);
        Ok(())
    })
}

impl World {
    /// Adds the described part while other Python threads run.
    pub(crate) fn add_description<T: Send>(
        &self,
        py: Python<'_>,
        within: Option<PathBuf>,
        add: impl FnOnce(&mut Inner, &mut AssetRoot) -> Result<T, FormatError> + Send,
    ) -> PyResult<T> {
        py.detach(|| self.modify(self.with_files(within, add)))
    }

    /// Applies a described change while other Python threads run; if that fails, nothing has changed.
    pub(crate) fn change_by_files<T: Send>(
        &self,
        py: Python<'_>,
        within: Option<PathBuf>,
        change: impl FnOnce(&mut Inner, &mut AssetRoot) -> Result<T, FormatError> + Send,
    ) -> PyResult<T> {
        py.detach(|| self.modify_or_restore(self.with_files(within, change)))
    }

    /// Applies a change to the world, with access to the files that the change refers to.
    fn with_files<T>(
        &self,
        within: Option<PathBuf>,
        change: impl FnOnce(&mut Inner, &mut AssetRoot) -> Result<T, FormatError>,
    ) -> impl FnOnce(&mut Inner) -> PyResult<T> {
        move |inner| {
            let limit = inner.texture_cache.as_ref().map(|memory| memory.limit());
            let budget = budget(limit);
            let files = match within {
                Some(folder) => AssetRoot::new(&folder, &budget),
                None => AssetRoot::trusted(&self.folder, &budget),
            };
            let mut files = files.extending(inner);
            let changed = change(inner, &mut files).or_raise()?;
            files.finish_world(inner).or_raise()?;
            Ok(changed)
        }
    }
}

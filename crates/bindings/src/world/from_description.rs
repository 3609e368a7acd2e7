//! Worlds built from descriptions.

use std::path::PathBuf;

use pyo3::prelude::*;
use raycam_formats::{AssetRoot, FormatError};
use raycam_scene::schema::{ObjectSpec, VideoSpec, WorldFile, from_value};
use raycam_scene::{Light, World as Inner};

use crate::error::{IntoPyErr, catch_panic};
use crate::py_value::to_value;
use crate::world::array_images::{ArrayImages, FilesAndArrays, NAME, is_array};
use crate::world::state::{World, budget};

/// The world of a description, whose files lie in `folder` and nowhere else.
#[pyfunction]
pub(crate) fn world_from_dict(
    description: &Bound<'_, PyAny>,
    folder: PathBuf,
    texture_memory: Option<u64>,
) -> PyResult<World> {
    let mut arrays = ArrayImages::default();
    let value = to_value(&arrays.take_arrays(description, "")?, "")?;
    let build = || -> Result<Inner, FormatError> {
        let mut files = AssetRoot::new(&folder, &budget(texture_memory));
        let file = from_value::<WorldFile>(&value)?;
        let mut world = file.build(&mut FilesAndArrays { files: &mut files, arrays: &arrays })?;
        world.lights.iter_mut().for_each(name_array);
        files.finish_world(&mut world)?;
        Ok(world)
    };
    let world = description.py().detach(|| catch_panic(build))?;
    Ok(World::from_inner(world.map_err(IntoPyErr::into_py_err)?, PathBuf::new()))
}

/// Adds an object. Its files lie anywhere, or nowhere else than in `within`.
#[pyfunction]
pub(crate) fn world_add_object(
    world: &World,
    description: &Bound<'_, PyAny>,
    within: Option<PathBuf>,
) -> PyResult<usize> {
    let mut arrays = ArrayImages::default();
    let value = to_value(&arrays.take_arrays(description, "")?, "")?;
    let spec: ObjectSpec = from_value(&value).map_err(IntoPyErr::into_py_err)?;
    world.add_description(description.py(), within, |inner, files| {
        spec.build(inner, &mut FilesAndArrays { files, arrays: &arrays })
    })
}

/// Adds a light, whose files are those of [`world_add_object`].
#[pyfunction]
pub(crate) fn world_add_light(
    world: &World,
    description: &Bound<'_, PyAny>,
    within: Option<PathBuf>,
) -> PyResult<usize> {
    let mut arrays = ArrayImages::default();
    let value = to_value(&arrays.take_arrays(description, "")?, "")?;
    let mut light: Light = from_value(&value).map_err(IntoPyErr::into_py_err)?;
    world.add_description(description.py(), within, |inner, files| {
        light.read(&mut FilesAndArrays { files, arrays: &arrays })?;
        name_array(&mut light);
        Ok(inner.add_light(light)?)
    })
}

/// Names the image of a light that was an array.
pub(crate) fn name_array(light: &mut Light) {
    if let Light::Environment { image, .. } = light
        && is_array(&image.file)
    {
        image.file = NAME.into();
    }
}

/// Gives the world a `[video]`, or another one.
#[pyfunction]
pub(crate) fn world_set_video(world: &World, description: &Bound<'_, PyAny>) -> PyResult<()> {
    let spec: VideoSpec = from_value(&to_value(description, "")?).map_err(IntoPyErr::into_py_err)?;
    world.modify_unseen(|inner| {
        inner.video = Some(spec.build(inner).map_err(IntoPyErr::into_py_err)?);
        Ok(())
    })
}

impl World {
    /// Adds what a description says, while other threads of Python run.
    fn add_description<T: Send>(
        &self,
        py: Python<'_>,
        within: Option<PathBuf>,
        add: impl FnOnce(&mut Inner, &mut AssetRoot) -> Result<T, FormatError> + Send,
    ) -> PyResult<T> {
        py.detach(|| self.modify(self.with_files(within, add)))
    }

    /// Changes what a description says, while other threads of Python run; when that fails, all is as before.
    pub(crate) fn change_by_files<T: Send>(
        &self,
        py: Python<'_>,
        within: Option<PathBuf>,
        change: impl FnOnce(&mut Inner, &mut AssetRoot) -> Result<T, FormatError> + Send,
    ) -> PyResult<T> {
        py.detach(|| self.modify_or_restore(self.with_files(within, change)))
    }

    /// A change of the world with the files that it names.
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
            let changed = change(inner, &mut files).map_err(IntoPyErr::into_py_err)?;
            files.finish_world(inner).map_err(IntoPyErr::into_py_err)?;
            Ok(changed)
        }
    }
}

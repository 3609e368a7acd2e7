//! Progressive images.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use raycam_render::{Control, Progressive as Inner, RenderError};

use crate::buffer_pool::OutputPlanes;
use crate::camera::Camera;
use crate::cancel::Cancel;
use crate::error::{OrRaise, settings_error};
use crate::interruptible::run_cancellable;
use crate::render::frame::FrameParts;
use crate::render::settings::RenderArguments;
use crate::world::state::World;

/// Image to which samples are added.
#[pyclass(frozen, module = "raycam._core")]
pub(crate) struct Progressive {
    /// Threads release the GIL before they lock this mutex.
    inner: Arc<Mutex<Inner>>,
}

impl Progressive {
    fn run<T: Send>(
        &self,
        py: Python<'_>,
        cancel: Option<&Cancel>,
        work: impl FnOnce(&mut Inner, &Control) -> Result<T, RenderError> + Send,
    ) -> PyResult<T> {
        let inner = &self.inner;
        run_cancellable(py, None, cancel.map(|cancel| &cancel.control), |control| {
            work(&mut inner.lock().unwrap_or_else(PoisonError::into_inner), control)
        })
    }
}

#[pymethods]
impl Progressive {
    #[new]
    fn new(py: Python<'_>, world: &World, camera: &Camera, request: RenderArguments) -> PyResult<Self> {
        let settings = request.settings()?;
        let (world, prepared) = world.prepared_world(py, settings.threads)?;
        let inner = Inner::new(world, prepared, &camera.inner, settings).or_raise()?;
        Ok(Self { inner: Arc::new(Mutex::new(inner)) })
    }

    /// Adds samples to all pixels of a region that have fewer than `until` samples.
    fn add(
        &self,
        py: Python<'_>,
        until: u32,
        region: Option<[u32; 4]>,
        cancel: Option<PyRef<'_, Cancel>>,
    ) -> PyResult<()> {
        self.run(py, cancel.as_deref(), |inner, control| inner.add(until, region, control))
    }

    /// Adds samples for this many seconds; returns the smallest number of samples among all pixels.
    fn add_for(&self, py: Python<'_>, seconds: f64, cancel: Option<PyRef<'_, Cancel>>) -> PyResult<u32> {
        let time = Duration::try_from_secs_f64(seconds).map_err(|error| settings_error(format!("seconds: {error}")))?;
        self.run(py, cancel.as_deref(), |inner, control| inner.add_for(time, control))
    }

    /// Returns the smallest number of samples among the pixels of a region.
    fn samples(&self, py: Python<'_>, region: Option<[u32; 4]>) -> u32 {
        py.detach(|| self.inner.lock().unwrap_or_else(PoisonError::into_inner).samples(region))
    }

    /// Returns the current image.
    fn develop<'py>(&self, py: Python<'py>) -> PyResult<FrameParts<'py>> {
        let (channels, region) = py.detach(|| {
            let inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            (inner.channels().to_vec(), inner.region())
        });
        let [_, _, width, height] = region.map(|side| side as usize);
        let planes = OutputPlanes::new(py, &channels, width * height);
        let notices = planes.write(py, |targets| self.run(py, None, |inner, _| inner.develop(targets)))?;
        Ok((planes.into_arrays(py, [height, width])?, region.into(), notices.into()))
    }
}

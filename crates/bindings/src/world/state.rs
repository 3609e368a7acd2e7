//! State of a Python world: its description, and the parts that have been built.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use raycam_formats::Budget;
use raycam_render::{PreparedFamily, PreparedWorld};
use raycam_scene::{SceneError, World as Inner};

use crate::error::{OrRaise, catch_panic};
use crate::interruptible::run_for_work;

/// A world, and the structures that were last prepared for rendering it.
#[derive(Clone, Default)]
pub(crate) struct WorldState {
    pub(crate) world: Arc<Inner>,
    pub(crate) prepared: Option<Arc<PreparedWorld>>,
    /// True if `prepared` belongs to the current `world`.
    pub(crate) is_current: bool,
    /// Parts shared with the worlds derived from this world, and with the worlds from which this world was derived.
    pub(crate) family: Arc<PreparedFamily>,
}

/// World for Python.
#[pyclass(frozen, module = "raycam._core")]
pub(crate) struct World {
    /// Locked only while the GIL is held, and only briefly, so that a fork finds it unlocked.
    pub(crate) state: Mutex<WorldState>,
    /// Folder to which relative file names refer; empty for the current folder.
    pub(crate) folder: PathBuf,
}

/// Budget of a world whose textures may use `texture_memory` bytes.
pub(crate) fn budget(texture_memory: Option<u64>) -> Budget {
    texture_memory.map_or_else(Budget::default, Budget::with_texture_memory)
}

impl World {
    pub(crate) fn from_inner(world: Inner, folder: PathBuf) -> Self {
        let state = WorldState { world: Arc::new(world), ..WorldState::default() };
        Self { state: Mutex::new(state), folder }
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, WorldState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the current world.
    pub(crate) fn snapshot(&self) -> Arc<Inner> {
        self.state().world.clone()
    }

    /// Changes the world; if that fails, the world is unchanged. `change` must not require the GIL, because other
    /// threads may hold it while waiting for the change to end.
    pub(crate) fn modify<T>(&self, change: impl FnOnce(&mut Inner) -> PyResult<T>) -> PyResult<T> {
        Self::modify_state(&mut self.state(), change)
    }

    fn modify_state<T>(state: &mut WorldState, change: impl FnOnce(&mut Inner) -> PyResult<T>) -> PyResult<T> {
        let world = Arc::make_mut(&mut state.world);
        let before = [
            world.meshes.len(),
            world.textures.len(),
            world.materials.len(),
            world.objects.len(),
            world.lights.len(),
            world.cameras.len(),
            world.rigs.len(),
            world.notices.len(),
        ];
        let changed = catch_panic(|| change(world)).and_then(|result| result);
        if changed.is_err() {
            let [meshes, textures, materials, objects, lights, cameras, rigs, notices] = before;
            world.meshes.truncate(meshes);
            world.textures.truncate(textures);
            world.materials.truncate(materials);
            world.objects.truncate(objects);
            world.lights.truncate(lights);
            world.light_traits.truncate(lights);
            world.cameras.truncate(cameras);
            world.rigs.truncate(rigs);
            world.notices.truncate(notices);
        } else {
            state.is_current = false;
        }
        changed
    }

    /// Same as [`World::modify`], for changes that may fail halfway: the world is copied first, and restored if the
    /// change fails.
    pub(crate) fn modify_or_restore<T>(&self, change: impl FnOnce(&mut Inner) -> PyResult<T>) -> PyResult<T> {
        self.modify(|world| {
            let before = world.clone();
            let changed = catch_panic(|| change(world)).and_then(|result| result);
            if changed.is_err() {
                *world = before;
            }
            changed
        })
    }

    /// Same as [`World::modify`], for changes that do not affect rays: built parts are kept.
    pub(crate) fn modify_unseen<T>(&self, change: impl FnOnce(&mut Inner) -> PyResult<T>) -> PyResult<T> {
        let mut state = self.state();
        let is_current = state.is_current;
        let changed = Self::modify_state(&mut state, change);
        state.is_current = is_current;
        changed
    }

    /// Returns a world derived from this one, which shares everything that has been built.
    pub(crate) fn derive(&self, change: impl FnOnce(&Inner) -> Result<Inner, SceneError>) -> PyResult<Self> {
        let WorldState { world, prepared, family, .. } = self.state().clone();
        let changed = catch_panic(|| change(&world))?.or_raise()?;
        let state = WorldState { world: Arc::new(changed), prepared, is_current: false, family };
        Ok(Self { state: Mutex::new(state), folder: self.folder.clone() })
    }

    /// Returns the world ready to be traced; builds only the missing parts.
    pub(crate) fn prepared(&self, py: Python<'_>, threads: Option<usize>) -> PyResult<Arc<PreparedWorld>> {
        Ok(self.prepared_world(py, threads)?.1)
    }

    /// Returns the world's description and its prepared form.
    pub(crate) fn prepared_world(
        &self,
        py: Python<'_>,
        threads: Option<usize>,
    ) -> PyResult<(Arc<Inner>, Arc<PreparedWorld>)> {
        let WorldState { world, prepared, is_current, family } = self.state().clone();
        if let Some(prepared) = prepared.clone().filter(|_| is_current) {
            return Ok((world, prepared));
        }
        let is_brief = PreparedWorld::is_brief_to_prepare(&world, &family);
        let built = run_for_work(py, is_brief, None, |control| {
            PreparedWorld::in_family(&world, &family, prepared.as_deref(), threads, control)
        })?;
        let built = Arc::new(built);
        let mut state = self.state();
        // Another thread may have changed the world in the meantime.
        if Arc::ptr_eq(&state.world, &world) {
            state.prepared = Some(built.clone());
            state.is_current = true;
        }
        Ok((world, built))
    }
}

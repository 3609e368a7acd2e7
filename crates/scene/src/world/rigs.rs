//! Rigs and sensors of a world.

use crate::camera::sensor::NamedSensor;
use crate::camera::{NamedCamera, Rig};
use crate::counted::counted;
use crate::error::{Result, SceneError, suggestion};
use crate::world::World;
use crate::world::names::Names;

impl World {
    /// Adds a rig under its name, made unique, and its cameras under the names rig/camera; returns its index.
    ///
    /// # Errors
    /// The errors of [`Rig::cameras`].
    pub fn add_rig(&mut self, rig: Rig) -> Result<usize> {
        let cameras = rig.cameras()?;
        let mut names = Names::default();
        for rig in &self.rigs {
            names.unique(rig.name());
        }
        let name = names.unique(rig.name());
        for NamedCamera { name: own, camera } in cameras {
            self.add_camera(&format!("{name}/{own}"), camera);
        }
        self.rigs.push(rig.named(name));
        Ok(self.rigs.len() - 1)
    }

    /// Adds a sensor that is neither a camera nor on a rig; its name is made unique.
    pub fn add_sensor(&mut self, sensor: NamedSensor) {
        let mut names = Names::from_used(self.sensors.iter().map(|known| &known.name[..]));
        let name = names.unique(&sensor.name);
        self.sensors.push(NamedSensor { name, ..sensor });
    }

    /// Returns the index of the rig with this name.
    ///
    /// # Errors
    /// [`SceneError::World`] with the nearest name.
    pub fn find_rig(&self, name: &str) -> Result<usize> {
        self.rigs.iter().position(|rig| rig.name() == name).ok_or_else(|| {
            let count = counted(self.rigs.len(), "rig");
            SceneError::unknown_name(format!(
                "no rig named {name:?}; the world has {count}{}",
                suggestion(name, self.rigs.iter().map(Rig::name))
            ))
        })
    }
}

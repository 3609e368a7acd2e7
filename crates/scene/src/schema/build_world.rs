//! Conversion of a world file's description to a world.

use crate::error::SceneError;
use crate::light::Light;
use crate::model::AssetLoader;
use crate::schema::WorldFile;
use crate::schema::build_failure::BuildFailure;
use crate::schema::geometry::LoadedMeshes;
use crate::world::World;

impl WorldFile {
    /// Returns the described world. `files` reads its meshes and textures.
    ///
    /// # Errors
    /// [`SceneError::Schema`] with the path of the invalid key, and the errors of `files`.
    pub fn build<F: AssetLoader>(self, files: &mut F) -> Result<World, F::Error> {
        let mut world = World { up: self.up, ..World::default() };
        let mut known = LoadedMeshes::default();
        for (i, object) in self.object.into_iter().enumerate() {
            object.build_object(&mut world, files, &mut known).map_err(|failure| match failure {
                BuildFailure::Scene(error) => error.in_context(&format!("object[{i}]")).into(),
                BuildFailure::File(key, error) => F::in_context(error, &format!("object[{i}].{key}")),
            })?;
        }
        for (i, spec) in self.light.into_iter().enumerate() {
            let (mut light, traits) = spec.build(self.up).map_err(|error| error.in_context(&format!("light[{i}]")))?;
            let key = match light {
                Light::Environment { .. } | Light::Projector { .. } => "image",
                _ => "profile",
            };
            light.read(files).map_err(|error| F::in_context(error, &format!("light[{i}].{key}")))?;
            let added = world.add_light(light).and_then(|number| world.set_light_traits(number, traits));
            added.map_err(|error| error.in_context(&format!("light[{i}]")))?;
        }
        for (i, mut spec) in self.camera.into_iter().enumerate() {
            let missing = |error| F::in_context(error, &format!("camera[{i}].background"));
            spec.find_background(files).map_err(missing)?;
            let camera = spec.build(self.up).map_err(|error| error.in_context(&format!("camera[{i}]")))?;
            world.add_camera(spec.name.as_deref().unwrap_or("camera"), camera);
        }
        for (i, mut spec) in self.rig.into_iter().enumerate() {
            for (j, camera) in spec.camera.iter_mut().enumerate() {
                let missing = |error| F::in_context(error, &format!("rig[{i}].camera[{j}].background"));
                camera.find_background(files).map_err(missing)?;
            }
            let place = format!("rig[{i}]");
            let rig = spec.build(self.up, &place, files)?;
            world.add_rig(rig).map_err(|error: SceneError| error.in_context(&place))?;
        }
        for (i, spec) in self.lidar.into_iter().enumerate() {
            let lidar = spec.build(self.up, &format!("lidar[{i}]"), files)?;
            world.add_sensor(lidar);
        }
        for (i, spec) in self.sensor.into_iter().enumerate() {
            let sensor = spec.build(self.up).map_err(|error| error.in_context(&format!("sensor[{i}]")))?;
            world.add_sensor(sensor);
        }
        if let Some(fog) = &self.fog {
            world.fog = Some(fog.build().map_err(|error| error.in_context("fog"))?);
        }
        self.render.validate().map_err(|error| error.in_context("render"))?;
        world.render = self.render;
        if let Some(spec) = &self.video {
            world.video = Some(spec.build(&world).map_err(|error| error.in_context("video"))?);
        }
        Ok(world)
    }
}

//! `[rig]`.

use crate::camera::{NamedCamera, Rig};
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::model::AssetLoader;
use crate::schema::spec::camera::CameraSpec;
use crate::schema::spec::optics::ShutterSpec;
use crate::schema::spec::pose::{POSE, PoseSpec, pose_of, with_pose};
use crate::schema::spec::sensor::{LidarSpec, SensorSpec};
use crate::up::Up;

with_pose! {
    /// A rig: cameras on one body, whose axes are x forward, y left and z up. The body is placed like a camera, by
    /// `location` with angles or a `target`, or by `R` with `C` or `t`; default: at the origin. Its cameras are placed
    /// in the body's axes, like cameras in a z-up world.
    pub struct RigSpec {
        /// The rig's name; default `rig`.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub name: Option<String>,
        /// The rig's cameras, each with a unique name: one table or several.
        #[schemars(schema_with = "crate::schema::shorthand::one_or_many::<CameraSpec>")]
        pub camera: Vec<CameraSpec>,
        /// The rig's lidars, each with a unique name: one table or several.
        #[schemars(schema_with = "crate::schema::shorthand::one_or_many::<LidarSpec>")]
        #[serde(skip_serializing)]
        pub lidar: Vec<LidarSpec>,
        /// The rig's other sensors, each with a unique name: one table or several.
        #[schemars(schema_with = "crate::schema::shorthand::one_or_many::<SensorSpec>")]
        #[serde(skip_serializing)]
        pub sensor: Vec<SensorSpec>,
    }
    pose {
        location: "Position of the body in the world.",
        target: "A point towards which the body's x axis points, instead of angles.",
        up: "Direction that points up, with `target`; default: the world's up axis.",
        R: "The rotation body_from_world, for any body axes.",
        C: "Position of the body in the world, with `R`.",
    }
    {
        /// Exposure and rolling shutter of all cameras, and the body's motion during the exposure; default: no
        /// motion.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub shutter: Option<ShutterSpec>,
    }
}

impl RigSpec {
    /// Returns the exact description of a rig's body and cameras.
    pub fn from_rig(rig: &Rig) -> Self {
        let cameras = rig
            .mounts()
            .iter()
            .map(|mount| CameraSpec { name: Some(mount.name.clone()), ..CameraSpec::from_camera(&mount.camera) });
        let mut spec = Self {
            name: Some(rig.name().into()),
            camera: cameras.collect(),
            shutter: rig.motion().map(ShutterSpec::from_motion),
            ..Self::default()
        };
        if spec.shutter.is_none() {
            let pose = PoseSpec::from_pose(&rig.body());
            (spec.r, spec.c) = (pose.r, pose.c);
        }
        spec
    }

    /// Creates the rig. `files` reads the files of its lidars; error messages contain `place`, the rig's key in the
    /// description.
    ///
    /// # Errors
    /// The errors of `RigSpec::build_cameras`, of its sensors, and of `files`.
    pub fn build<F: AssetLoader>(mut self, up: Up, place: &str, files: &mut F) -> Result<Rig, F::Error> {
        let within = |error: SceneError| match place {
            "" => error,
            _ => error.in_context(place),
        };
        if self.camera.is_empty() && self.lidar.is_empty() && self.sensor.is_empty() {
            let message = "a rig without sensors; expected at least one camera or lidar";
            return Err(within(SceneError::camera(message)).into());
        }
        let key = |kind: &str, i: usize| match place {
            "" => format!("{kind}[{i}]"),
            _ => format!("{place}.{kind}[{i}]"),
        };
        let mut sensors = Vec::new();
        for (i, spec) in std::mem::take(&mut self.lidar).into_iter().enumerate() {
            if spec.trajectory.is_some() {
                let message = "a lidar on a rig moves with the rig; remove the lidar's trajectory, or move the rig \
                               with [[video.keyframe]]";
                return Err(SceneError::schema(
                    ErrorCode::ConflictingValues,
                    format!("{}.trajectory", key("lidar", i)),
                    message,
                )
                .into());
            }
            sensors.push(spec.build(Up::Z, &key("lidar", i), files)?);
        }
        for (i, spec) in std::mem::take(&mut self.sensor).into_iter().enumerate() {
            sensors.push(spec.build(Up::Z).map_err(|error| error.in_context(&key("sensor", i)))?);
        }
        Ok(self.build_cameras(up).and_then(|rig| rig.with_sensors(sensors)).map_err(within)?)
    }

    /// Returns the rig with its cameras, without its other sensors.
    ///
    /// # Errors
    /// [`SceneError`] for an invalid camera, for a pose that is incomplete or given twice, and the errors of
    /// [`Rig::new`].
    fn build_cameras(&self, up: Up) -> Result<Rig> {
        let mut mounts = Vec::with_capacity(self.camera.len());
        for (i, spec) in self.camera.iter().enumerate() {
            let within = |error: SceneError| error.in_context(&format!("camera[{i}]"));
            let camera = spec.build(Up::Z).map_err(within)?;
            let name = match &spec.name {
                Some(name) => name.clone(),
                None if i == 0 => "camera".into(),
                None => format!("camera-{}", i + 1),
            };
            mounts.push(NamedCamera { name, camera });
        }
        let pose = pose_of!(self);
        let track = self.shutter.as_ref().and_then(ShutterSpec::first_pose);
        let body = match track {
            Some(first) => {
                pose.keys().refuse(
                    &POSE,
                    "cannot be combined with \"shutter.track\", which already contains the rig's pose; use only \
                     one of them",
                )?;
                first.build_body(up).map_err(|error| error.in_context("shutter.track[0].pose"))?
            }
            None if pose.keys().given(&POSE).is_empty() => {
                PoseSpec { location: Some([0.0; 3]), ..PoseSpec::default() }.build_body(up)?
            }
            None => pose.build_body(up)?,
        };
        let rig = Rig::new(self.name.as_deref().unwrap_or("rig"), body, mounts)?;
        let Some(shutter) = &self.shutter else { return Ok(rig) };
        if shutter.mount.is_some() {
            let message = "applies only to single cameras; in a rig, place each camera on the body";
            return Err(SceneError::schema(ErrorCode::ConflictingValues, "shutter.mount", message));
        }
        let motion = shutter.build(body, |pose| pose.build_body(up)).map_err(|error| error.in_context("shutter"))?;
        rig.with_motion(motion)
    }
}

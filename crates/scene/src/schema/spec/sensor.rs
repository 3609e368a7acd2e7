//! `[lidar]` and `[sensor]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::sensor::{LIDAR, NamedSensor, SensorFile};
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::model::AssetLoader;
use crate::schema::shorthand::Splat;
use crate::schema::spec::pose::{POSE, PoseSpec, pose_of, with_pose};
use crate::texture::ByteString;
use crate::up::Up;

/// The echoes of a pulse that a lidar reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum LidarReturns {
    /// The nearest echo.
    First,
    /// The farthest echo.
    Last,
    /// The echo with the most energy.
    Strongest,
    /// The strongest and the last echo; the two strongest if these are the same.
    Dual,
    /// All echoes.
    All,
}

with_pose! {
    /// A lidar: its device, or the calibration of a unit; its settings, which default to the device's numbers; and its
    /// pose. The sensor axes are x ahead, y left and z up. The lidar is placed as a rig's body is: by `location` with
    /// angles or a `target`, or by `R` with `C` or `t`; without any of them, it is at the origin of the world, or of
    /// the rig's body.
    pub struct LidarSpec {
        /// The name; `lidar` if not given.
        #[serde(skip_serializing)]
        pub name: Option<String>,
        /// The device, such as "vlp16"; `raycam lidars` lists all devices. With `calibration`, the device of the unit.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub device: Option<String>,
        /// The calibration file of a unit, or a table of pulses, in the world file's folder.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub calibration: Option<String>,
        /// The file of a trajectory ("tum", "euroc", ...), in the world file's folder: poses of a body that carries the
        /// lidar, at times in seconds. The lidar's own pose is then in the axes of that body.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub trajectory: Option<String>,
        /// Frames per second.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub rate: Option<f64>,
        /// True to allow a rate that the device does not support.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub force_rate: Option<bool>,
        /// The mode of an Ouster, such as "1024x10".
        #[serde(skip_serializing_if = "Option::is_none")]
        pub mode: Option<String>,
        /// The echoes of a pulse that are reported.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub returns: Option<LidarReturns>,
        /// Rays per pulse: 1, 7, 19 or 37.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub beam_samples: Option<u32>,
        /// The width of the beam where it leaves the device, at 1/e², in metres: one number, or horizontal and
        /// vertical.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub beam_width: Option<Splat<2>>,
        /// The full divergence of the beam at 1/e², in radians: one number, or horizontal and vertical.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub beam_divergence: Option<Splat<2>>,
        /// The distance at which a target of 10 % reflectance is detected with probability 1/2, in metres.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub range_10: Option<f64>,
        /// The smallest reported distance, in metres.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub min_range: Option<f64>,
        /// The largest reported distance, in metres.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub max_range: Option<f64>,
        /// The standard deviation of the distance at high signal, in metres.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub range_noise: Option<f64>,
        /// The standard deviation of a column's azimuth, in degrees.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub azimuth_noise: Option<f64>,
        /// Step to whose multiples distances are rounded, in metres; 0 for no rounding.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub step: Option<f64>,
        /// The full width at half maximum of the pulse, in seconds.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub pulse_length: Option<f64>,
        /// The rise time of the pulse, in seconds.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub rise_time: Option<f64>,
        /// The laser's wavelength, in nanometres.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub wavelength: Option<f64>,
        /// The visibility in fog, in metres; no fog if not given.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub visibility: Option<f64>,
        /// The receiver's overlap: pairs of a distance in metres and the fraction of the returning light that reaches
        /// the receiver, by ascending distance; linear between the distances.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub overlap: Option<Vec<[f64; 2]>>,
        /// Value of the field `signal`, in counts, for a white target at normal incidence at 1 m.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub signal_gain: Option<f64>,
        /// True to add the field `waveform` to the points.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub waveform: Option<bool>,
        /// Number of light paths per point that compute the field `near_ir`; 0 omits this field.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub near_ir_samples: Option<u32>,
        /// Near infrared counts in packets that correspond to a radiance of 1 W/(m² sr).
        #[serde(skip_serializing_if = "Option::is_none")]
        pub near_ir_gain: Option<f64>,
        /// Maximum number of mirror and glass surfaces at which a ray is reflected or refracted.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub max_bounces: Option<u32>,
        /// False for exact distances, without noise and rounding.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub noise: Option<bool>,
        /// The seed of the noise.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub seed: Option<u64>,
    }
    pose {
        location: "The lidar's position.",
        target: "A point that the lidar's x axis points to, instead of angles.",
        up: "Direction that points up, with `target`; default: the world's up axis.",
        R: "The rotation from the axes of the world, or of the rig's body, to the sensor axes.",
        C: "The lidar's position, with `R`.",
    }
    {}
}

with_pose! {
    /// A sensor of another kind: a Python class that implements `raycam.Sensor`, and the description that its
    /// `from_dict` accepts. The class is used when the sensor measures, and must have been imported before.
    pub struct SensorSpec {
        /// The name; `sensor` if not given.
        pub name: Option<String>,
        /// The class, as "module:Class".
        #[serde(rename = "type")]
        pub type_: Option<String>,
        /// The argument of the class method `from_dict`.
        pub description: serde_json::Map<String, serde_json::Value>,
    }
    pose {
        location: "The sensor's position. Without a pose, the sensor's description determines its pose.",
        target: "A point that the sensor's x axis points to, instead of angles.",
        up: "Direction that points up, with `target`; default: the world's up axis.",
        R: "The rotation from the axes of the world, or of the rig's body, to the sensor axes.",
        C: "The sensor's position, with `R`.",
    }
    {}
}

impl LidarSpec {
    /// The lidar that the table describes, with the contents of its files.
    ///
    /// # Errors
    /// [`SceneError`] without `device` and `calibration`, and for a pose that is missing in part or given twice; the
    /// errors of `files`.
    pub fn build<F: AssetLoader>(mut self, up: Up, place: &str, files: &mut F) -> Result<NamedSensor, F::Error> {
        let within = |error: SceneError| error.in_context(place);
        if self.device.is_none() && self.calibration.is_none() {
            let message = "missing; expected a device such as \"vlp16\" (raycam lidars lists all), or \"calibration\" with a file";
            return Err(within(SceneError::schema(ErrorCode::MissingValue, "device", message)).into());
        }
        let pose = build_pose(&pose_of!(self), up).map_err(within)?;
        let mut contents = Vec::new();
        for (key, file) in [("calibration", &self.calibration), ("trajectory", &self.trajectory)] {
            let Some(file) = file else { continue };
            let bytes = files.bytes(file).map_err(|error| F::in_context(error, &format!("{place}.{key}")))?;
            contents.push(SensorFile { key: key.into(), name: file.clone(), bytes: ByteString(bytes) });
        }
        let name = self.name.take().unwrap_or_else(|| LIDAR.into());
        (self.location, self.roll, self.pitch, self.yaw, self.target, self.up) = (None, None, None, None, None, None);
        (self.r, self.c, self.t) = (None, None, None);
        let settings = serde_json::to_string(&self).map_err(|error| {
            within(SceneError::schema(
                ErrorCode::OutOfRange,
                "",
                format!("a number that JSON cannot represent: {error}"),
            ))
        })?;
        let pose = pose.or(Some(crate::camera::Pose::IDENTITY).filter(|_| up == Up::Z));
        let pose = match pose {
            Some(pose) => pose,
            None => PoseSpec { location: Some([0.0; 3]), ..PoseSpec::default() }.build_body(up).map_err(within)?,
        };
        let sensor = NamedSensor { name, kind: LIDAR.into(), settings, pose: Some(pose), files: contents };
        sensor.validate().map_err(within)?;
        Ok(sensor)
    }
}

impl SensorSpec {
    /// The sensor that the table describes.
    ///
    /// # Errors
    /// [`SceneError`] for a `type` that is not "module:Class", and a pose that is missing in part or given twice.
    pub fn build(self, up: Up) -> Result<NamedSensor> {
        let pose = build_pose(&pose_of!(self), up)?;
        let kind = self.type_.unwrap_or_default();
        let is_class = kind.split_once(':').is_some_and(|(module, class)| !module.is_empty() && !class.is_empty());
        if !is_class {
            let message = format!("{kind:?}; expected a Python class as \"module:Class\"");
            return Err(SceneError::schema(ErrorCode::InvalidValue, "type", message));
        }
        let settings = serde_json::to_string(&self.description)
            .map_err(|error| SceneError::schema(ErrorCode::InvalidValue, "description", error.to_string()))?;
        let name = self.name.unwrap_or_else(|| "sensor".into());
        let sensor = NamedSensor { name, kind, settings, pose, files: Vec::new() };
        sensor.validate()?;
        Ok(sensor)
    }
}

/// The pose of a sensor on its parent; `None` if no key of a pose is given.
fn build_pose(pose: &PoseSpec, up: Up) -> Result<Option<crate::camera::Pose>> {
    match pose.keys().given(&POSE).is_empty() {
        true => Ok(None),
        false => pose.build_body(up).map(Some),
    }
}

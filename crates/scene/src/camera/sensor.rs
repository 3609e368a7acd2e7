//! Sensors other than cameras, and the properties of surfaces that lidars measure. The Python package uses these data
//! for its measurements.

use std::collections::HashSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::Pose;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::texture::ByteString;

/// The kind of a sensor that a `[lidar]` table describes; other kinds are Python classes, as "module:Class".
pub const LIDAR: &str = "lidar";

/// A sensor with its name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedSensor {
    /// Unique within the rig, or among the sensors of the world that are on no rig.
    pub name: String,
    /// [`LIDAR`], or the Python class as "module:Class".
    pub kind: String,
    /// The settings as a JSON object.
    pub settings: String,
    /// The rotation sensor_from_parent and the position on the parent, which is the world or a rig's body. If `None`,
    /// the settings define the pose.
    pub pose: Option<Pose>,
    /// The files that the settings refer to.
    pub files: Vec<SensorFile>,
}

/// The contents of a file that a sensor's settings refer to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorFile {
    /// The settings' key that refers to the file.
    pub key: String,
    /// The file's name.
    pub name: String,
    /// The file's contents.
    pub bytes: ByteString,
}

impl NamedSensor {
    /// Checks the name and the pose.
    ///
    /// # Errors
    /// [`SceneError::World`] for a name that cannot be the name of a folder, and a pose that is not finite.
    pub fn validate(&self) -> Result<()> {
        let is_path = self.name.contains(['/', '\\']) || self.name.chars().any(char::is_control);
        if self.name.is_empty() || is_path || self.name == "." || self.name == ".." {
            let message = format!(
                "sensor name {:?} is not a valid folder name; expected a name without \"/\", \"\\\" or control characters",
                self.name
            );
            return Err(SceneError::world(ErrorCode::InvalidValue.message(message)));
        }
        if self.pose.is_some_and(|pose| !pose.r.is_finite() || !pose.c.is_finite()) {
            let message = format!("sensor {:?}: its pose must be finite", self.name);
            return Err(SceneError::world(ErrorCode::OutOfRange.message(message)));
        }
        Ok(())
    }
}

/// Checks that the names of a rig's cameras and other sensors differ.
///
/// # Errors
/// The errors of [`NamedSensor::validate`], and [`SceneError::World`] for a name that is used twice.
pub fn check_mounts<'a>(cameras: impl Iterator<Item = &'a str>, sensors: &[NamedSensor]) -> Result<()> {
    let mut names: HashSet<&str> = cameras.collect();
    for sensor in sensors {
        sensor.validate()?;
        if !names.insert(&sensor.name) {
            let message = format!("the rig has two sensors named {:?}; rename one of them", sensor.name);
            return Err(SceneError::world(ErrorCode::DuplicateName.message(message)));
        }
    }
    Ok(())
}

/// Properties of an object's surface that a lidar measures. Values that are not given are derived from the material.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LidarSurface {
    /// The diffuse reflectance at the laser's wavelength, 0 to 1, of the whole surface, instead of the material's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<f64>,
    /// The coefficient of retroreflection R_A at normal incidence in cd/(lx m²), as in data sheets of reflective
    /// sheeting (ASTM E808); it decreases with the incidence angle as cos⁴. 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retroreflection: Option<f64>,
    /// Pairs of an incidence angle in degrees and R_A, by ascending angle, instead of `retroreflection`; linear between
    /// the angles, constant below the first, and decreasing as cos⁴ above the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retroreflection_table: Option<Vec<[f64; 2]>>,
}

impl LidarSurface {
    /// Checks the ranges of all values.
    ///
    /// # Errors
    /// [`SceneError::Schema`] with the key.
    pub fn validate(&self) -> Result<()> {
        let fail = |key: &str, value: f64, range: &str| {
            let message = format!("{value}; expected {range}");
            Err(SceneError::schema(ErrorCode::OutOfRange, format!("lidar.{key}"), message))
        };
        const COEFFICIENT: &str = "0 to 1000000 cd/(lx m²)";
        match (self.reflectance, self.retroreflection) {
            (Some(value), _) if !(0.0..=1.0).contains(&value) => fail("reflectance", value, "0 to 1"),
            (_, Some(value)) if !(0.0..=1e6).contains(&value) => fail("retroreflection", value, COEFFICIENT),
            _ => Ok(()),
        }?;
        let Some(table) = &self.retroreflection_table else { return Ok(()) };
        if table.is_empty() || self.retroreflection.is_some() {
            let key = "lidar.retroreflection_table";
            return Err(match table.is_empty() {
                true => SceneError::schema(ErrorCode::MissingValue, key, "[]; expected pairs [angle, R_A]"),
                false => SceneError::schema(
                    ErrorCode::ConflictingValues,
                    key,
                    "given in addition to retroreflection; use only one of them",
                ),
            });
        }
        let mut before = -1.0;
        for &[angle, value] in table {
            if !(0.0..=90.0).contains(&angle) || angle <= before {
                return fail("retroreflection_table", angle, "ascending angles from 0 to 90 degrees");
            }
            if !(0.0..=1e6).contains(&value) {
                return fail("retroreflection_table", value, COEFFICIENT);
            }
            before = angle;
        }
        Ok(())
    }
}

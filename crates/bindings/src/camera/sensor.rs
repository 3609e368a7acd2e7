//! Sensors that are not cameras, as tuples.

use std::collections::HashMap;

use raycam_scene::camera::sensor::NamedSensor;

use crate::arrays::rows_of;

/// The rotation sensor_from_parent and the position.
type PoseRows = ([[f64; 3]; 3], [f64; 3]);

/// Name, kind, settings as JSON, pose on the parent, and names and contents of files by key.
pub(crate) type SensorData = (String, String, String, Option<PoseRows>, HashMap<String, (String, Vec<u8>)>);

/// A sensor as a tuple.
pub(crate) fn sensor_data(sensor: &NamedSensor) -> SensorData {
    let NamedSensor { name, kind, settings, pose, files } = sensor.clone();
    let pose = pose.map(|pose| (rows_of(pose.r), pose.c.to_array()));
    let files = files.into_iter().map(|file| (file.key, (file.name, file.bytes.0))).collect();
    (name, kind, settings, pose, files)
}

/// A sensor from its name, kind and settings, which contain the pose.
pub(crate) fn named_sensor((name, kind, settings): (String, String, String)) -> NamedSensor {
    NamedSensor { name, kind, settings, pose: None, files: Vec::new() }
}

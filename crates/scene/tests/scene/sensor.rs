//! Sensors of worlds, and surfaces as lidars measure them.

use crate::common::node;
use raycam_scene::schema::{self, WorldFile};
use raycam_scene::{NoAssets, SceneError, World};

fn build(json: &str) -> Result<World, SceneError> {
    schema::from_value::<WorldFile>(&node(json))?.build(&mut NoAssets)
}

#[test]
fn lidar_tables_become_sensors_of_the_world_and_of_rigs() {
    let world = build(
        r#"{"lidar": [{"device": "vlp16", "rate": 5, "location": [1, 2, 3]}, {"device": "vlp16"}],
            "sensor": {"type": "robot:Scanner", "description": {"rays": 3}},
            "rig": {"lidar": {"name": "top", "device": "hdl32e"}, "location": [0, 0, 1]}}"#,
    )
    .unwrap();
    let names: Vec<_> = world.sensors.iter().map(|sensor| &sensor.name[..]).collect();
    assert_eq!(names, ["lidar", "lidar-2", "sensor"]);
    assert_eq!(world.sensors[0].settings, r#"{"device":"vlp16","rate":5.0}"#);
    assert_eq!(world.sensors[0].pose.unwrap().c.to_array(), [1.0, 2.0, 3.0]);
    assert_eq!(world.sensors[2].settings, r#"{"rays":3}"#);
    assert_eq!(world.sensors[2].pose, None);
    assert_eq!(world.rigs[0].sensors()[0].name, "top");
    assert_eq!(world.validated().unwrap().rigs[0].sensors().len(), 1);
}

#[test]
fn invalid_sensors_are_refused_with_their_key() {
    for (json, facts) in [
        (r#"{"lidar": {"rate": 5}}"#, ["lidar[0].device", "calibration"]),
        (r#"{"lidar": {"device": "vlp16", "calibration": "a.json"}}"#, ["a.json", "files"]),
        (r#"{"lidar": {"device": "vlp16", "yaw": 3}}"#, ["lidar[0]", "location"]),
        (r#"{"lidar": {"device": "vlp16", "name": "../a"}}"#, ["lidar[0]", "../a"]),
        (r#"{"lidar": {"device": "vlp16", "rat": 3}}"#, ["rat", "rate"]),
        (r#"{"sensor": {"type": "Scanner"}}"#, ["sensor[0].type", "module:Class"]),
        (r#"{"rig": {"sensor": {}}}"#, ["rig[0].sensor[0].type", "module:Class"]),
        (r#"{"rig": {"lidar": [{"device": "a"}, {"device": "a"}]}}"#, ["rig[0]", "two sensors"]),
        (r#"{"rig": {"lidar": {"device": "a", "trajectory": "b"}}}"#, ["rig[0].lidar[0].trajectory", "keyframe"]),
        (r#"{"object": {"box": {}, "lidar": {"reflectance": 2}}}"#, ["object[0].lidar.reflectance", "0 to 1"]),
        (r#"{"object": {"box": {}, "lidar": {"retroreflection": -1}}}"#, ["object[0].lidar.retroreflection", "-1"]),
        (r#"{"object": {"box": {}, "lidar": {"retroreflection_table": []}}}"#, ["retroreflection_table", "pairs"]),
        (r#"{"object": {"box": {}, "lidar": {"retroreflection_table": [[9, 1], [9, 2]]}}}"#, ["_table", "ascending"]),
        (r#"{"object": {"box": {}, "lidar": {"retroreflection_table": [[9, -1]]}}}"#, ["_table", "-1"]),
        (
            r#"{"object": {"box": {}, "lidar": {"retroreflection": 1, "retroreflection_table": [[9, 1]]}}}"#,
            ["_table", "in addition"],
        ),
    ] {
        let error = build(json).unwrap_err().to_string();
        assert!(facts.iter().all(|fact| error.contains(fact)), "{error}");
    }
}

#[test]
fn instances_share_the_lidar_values_of_their_object() {
    let world = build(
        r#"{"object": [{"name": "a", "box": {}, "lidar": {"reflectance": 0.8}}, {"instance_of": "a"},
            {"instance_of": "a", "lidar": {"retroreflection": 300}}, {"box": {}}]}"#,
    )
    .unwrap();
    let found: Vec<_> =
        world.objects.iter().map(|o| o.lidar.as_ref().map(|l| (l.reflectance, l.retroreflection))).collect();
    assert_eq!(found, [Some((Some(0.8), None)), Some((Some(0.8), None)), Some((None, Some(300.0))), None]);
}

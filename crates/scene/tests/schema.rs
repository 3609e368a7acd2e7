//! The schema reads what people write, and its errors name the key, its place and the nearest name.

mod common;

use common::node;
use raycam_scene::schema::{self, WorldFile};
use raycam_scene::{Light, NoFiles, Reflectance, SceneError, World};

fn build(json: &str) -> Result<World, SceneError> {
    schema::from_node::<WorldFile>(&node(json))?.build(&mut NoFiles)
}

fn error(json: &str) -> String {
    build(json).expect_err("an error").to_string()
}

#[test]
fn the_example_of_the_guide_is_a_world() {
    let world = build(
        r#"{
            "up": "z",
            "camera": { "size": [640, 480], "focal": 800, "location": [4, -6, 3], "roll": 0, "pitch": 20, "yaw": 125 },
            "object": [{ "name": "box", "box": { "size": [1, 1, 1] }, "color": [0.8, 0.1, 0.1], "diffuse": 0.9,
                         "specular": 0.1 }],
            "light": [{ "type": "sun", "direction": [-1, 1, -2], "irradiance": [3, 3, 3] }],
            "video": { "fps": 24, "seconds": 4, "orbit": { "target": [0, 0, 0.5], "degrees": 360 } }
        }"#,
    )
    .unwrap();
    assert_eq!(world.counts().object_triangles, 12);
    assert_eq!(world.objects[0].name, "box");
    assert_eq!(world.materials[0].color, [0.8, 0.1, 0.1]);
    let expected = Reflectance::Lecture {
        diffuse: 0.9,
        specular: [0.1; 3],
        shininess: 32.0,
    };
    assert_eq!(world.materials[0].reflectance, expected);
    assert_eq!(
        world.lights,
        [Light::Sun {
            direction: [-1.0, 1.0, -2.0],
            irradiance: [3.0; 3]
        }]
    );
    let [roll, pitch, yaw] = world.cameras[0].camera.roll_pitch_yaw(world.up);
    assert!(roll.abs() < 1e-12 && (pitch - 20.0).abs() < 1e-12 && (yaw - 125.0).abs() < 1e-12);
    assert_eq!(world.video.unwrap().frame_count(), 96);
}

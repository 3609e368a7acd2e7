use std::fs;
use std::path::Path;

use raycam_formats::{Budget, load, png, world_file};
use raycam_scene::{Up, World};

use crate::common::{file, folder, rgb};

fn world(text: &str) -> Result<World, String> {
    let parsed = world_file::parse(text, &folder(), Path::new("room.toml"), &Budget::default());
    parsed.map_err(|error| error.to_string())
}

#[test]
fn a_world_file_says_what_it_means() {
    let folder = folder();
    fs::write(
        folder.join("t.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n",
    )
    .unwrap();
    let image = png::encode([2, 1], 4, png::Samples::U8(&[255, 0, 0, 9, 0, 0, 255, 255])).unwrap();
    fs::write(folder.join("i.png"), image).unwrap();
    let text = r#"
up = "z"
[camera]
name = "front"
size = [640, 480]
focal = 800
location = [4, -6, 3]
pitch = 20
yaw = 125

[[object]]
name = "box"
box = { size = [1, 2, 3] }
color = [0.8, 0.1, 0.1]

[[object]]
mesh = "t.obj"
texture = "i.png"
location = [0, 0, 5]

[[light]]
type = "sun"
direction = [-1, 1, -2]
irradiance = [3, 3, 3]
"#;
    fs::write(folder.join("room.toml"), text).unwrap();
    let world = load(&folder.join("room.toml"), &Budget::default()).unwrap();
    assert_eq!(
        (world.objects.len(), world.lights.len(), world.up),
        (2, 1, Up::Z)
    );
    assert_eq!(world.cameras[0].name, "front");
    assert_eq!(world.cameras[0].camera.size(), [640, 480]);
    assert_eq!(
        world.objects[1].world_from_mesh.translation.to_array(),
        [0.0, 0.0, 5.0]
    );
    assert_eq!(rgb(&world.textures[0]), [[255, 0, 0], [0, 0, 255]]);
    assert!(
        world
            .notices
            .iter()
            .any(|n| n.contains("i.png: its alpha counts only where its material uses it")),
        "{:?}",
        world.notices
    );
    assert!(world_file::parse(text, &folder, Path::new("room.toml"), &Budget::default()).is_ok());
}

#[test]
fn errors_have_line_key_and_the_nearest_name() {
    for (text, place, words) in [
        (
            "[[object]]\nbox = {}\n\n[[object]]\nbox = {}\ndifuse = 1\n",
            "room.toml:6: object[1].difuse: ",
            "diffuse",
        ),
        ("\n\nupp = \"z\"\n", "room.toml:3: upp: ", "up"),
        (
            "[camera]\nsize = [640]\nfov = 45\n",
            "room.toml:2: camera",
            "2",
        ),
        (
            "[[object]]\nbox = { sise = 1 }\n",
            "room.toml:2: object[0].box.sise: ",
            "size",
        ),
        (
            "[[object]]\nbox = {}\ncolor = [2, 0, 0]\n",
            "room.toml:",
            "0..=1",
        ),
        (
            "[[light]]\ntype = \"son\"\n",
            "room.toml:2: light[0]",
            "sun",
        ),
        (
            "[[object]]\nmesh = 5\n",
            "room.toml:2: object[0].mesh: ",
            "5",
        ),
    ] {
        let error = world(text).unwrap_err();
        assert!(
            error.starts_with(place) && error.contains(words),
            "{text}: {error}"
        );
    }
}

#[test]
fn errors_of_the_text_have_their_line() {
    for (text, expected) in [
        ("up = \"z\"\nup = \"y\"\n", "room.toml:2: "),
        ("a = [1,\n2\n", "room.toml:"),
        ("up = z\n", "room.toml:1: "),
        (
            "up = 1979-05-27\n",
            "room.toml:1: a date; expected text in quotes",
        ),
        (
            "\nrender = { seed = 99999999999999999999 }\n",
            "room.toml:2: 99999999999999999999 is beyond 64 bits",
        ),
    ] {
        let error = world(text).unwrap_err();
        assert!(error.starts_with(expected), "{text}: {error}");
    }
    let path = file("room.toml", b"up = \"z\"\n# \xff\n");
    let error = load(&path, &Budget::default()).unwrap_err().to_string();
    assert!(error.ends_with("room.toml:2: not UTF-8 text"), "{error}");
}

#[test]
fn deep_nesting_is_an_error() {
    for open in ["[", "{a="] {
        let error = world(&format!("a = {}", open.repeat(100_000))).unwrap_err();
        assert!(error.starts_with("room.toml:1: "), "{error}");
    }
    let _ = world(&format!("[{}]\n", vec!["a"; 20_000].join(".")));
    let _ = world(&format!("{} = 1\n", vec!["a"; 20_000].join(".")));
}

#[test]
fn files_of_a_world_stay_in_its_folder() {
    for name in ["../a.obj", "/a.obj", "file:a.obj"] {
        let error = world(&format!("[[object]]\nmesh = \"{name}\"\n")).unwrap_err();
        assert!(
            error.contains(name) && error.contains("file name"),
            "{error}"
        );
    }
    let error = world("[[object]]\nmesh = \"no.obj\"\n").unwrap_err();
    assert!(error.contains("no.obj: No such file"), "{error}");
}

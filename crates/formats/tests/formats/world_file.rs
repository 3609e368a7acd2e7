use std::fs;
use std::path::Path;

use raycam_formats::encode::png;
use raycam_formats::{Budget, load, world_file};
use raycam_scene::{Alpha, Up, World};

use crate::support::{file, folder, rgb};

fn world(text: &str) -> Result<World, String> {
    let parsed = world_file::parse(text, &folder(), Path::new("room.toml"), &Budget::default());
    parsed.map_err(|error| error.to_string())
}

#[test]
fn world_file_is_read_as_documented() {
    let folder = folder();
    fs::write(folder.join("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n").unwrap();
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
    assert_eq!((world.objects.len(), world.lights.len(), world.up), (2, 1, Up::Z));
    assert_eq!(world.cameras[0].name, "front");
    assert_eq!(world.cameras[0].camera.size(), [640, 480]);
    assert_eq!(world.objects[1].world_from_mesh.translation.to_array(), [0.0, 0.0, 5.0]);
    assert_eq!(rgb(&world.textures[0]), [[255, 0, 0], [0, 0, 255]]);
    // The image is specified in the world file, so its alpha is used without a notice.
    let material = &world.materials[world.objects[1].materials[0]];
    assert_eq!((material.opacity, material.alpha), (1.0, Alpha::Blend));
    assert!(!world.notices.iter().any(|notice| notice.to_string().contains("alpha")), "{:?}", world.notices);
    let opaque = text.replace("texture = \"i.png\"", "texture = \"i.png\"\nalpha = \"opaque\"");
    let opaque = world_file::parse(&opaque, &folder, Path::new("room.toml"), &Budget::default()).unwrap();
    assert_eq!(opaque.materials[opaque.objects[1].materials[0]].alpha, Alpha::Opaque);
    assert!(world_file::parse(text, &folder, Path::new("room.toml"), &Budget::default()).is_ok());
}

#[test]
fn world_file_errors_contain_line_key_and_nearest_name() {
    for (text, place, words) in [
        ("[[object]]\nbox = {}\n\n[[object]]\nbox = {}\ndifuse = 1\n", "room.toml:6: object[1].difuse: ", "diffuse"),
        ("\n\nupp = \"z\"\n", "room.toml:3: upp: ", "up"),
        ("[camera]\nsize = [640]\nfov = 45\n", "room.toml:2: camera", "2"),
        ("[[object]]\nbox = { sise = 1 }\n", "room.toml:2: object[0].box.sise: ", "size"),
        ("[[object]]\nbox = {}\ncolor = [2, 0, 0]\n", "room.toml:", "0 to 1"),
        ("[[light]]\ntype = \"son\"\n", "room.toml:2: light[0]", "sun"),
        ("[[object]]\nmesh = 5\n", "room.toml:2: object[0].mesh: ", "5"),
    ] {
        let error = world(text).unwrap_err();
        assert!(error.starts_with(place) && error.contains(words), "{text}: {error}");
    }
}

#[test]
fn toml_syntax_errors_contain_their_line() {
    for (text, expected) in [
        ("up = \"z\"\nup = \"y\"\n", "room.toml:2: "),
        ("a = [1,\n2\n", "room.toml:"),
        ("up = z\n", "room.toml:1: "),
        ("up = 1979-05-27\n", "room.toml:1: a date; expected a string in quotes"),
        ("\nrender = { seed = 99999999999999999999 }\n", "room.toml:2: 99999999999999999999 does not fit into 64 bits"),
    ] {
        let error = world(text).unwrap_err();
        assert!(error.starts_with(expected), "{text}: {error}");
    }
    let path = file("room.toml", b"up = \"z\"\n# \xff\n");
    let error = load(&path, &Budget::default()).unwrap_err().to_string();
    assert!(error.ends_with("room.toml:2: not UTF-8 text"), "{error}");
}

#[test]
fn deep_nesting_returns_an_error_with_its_line() {
    for open in ["[", "{a="] {
        let error = world(&format!("a = {}", open.repeat(100_000))).unwrap_err();
        assert!(error.starts_with("room.toml:1: "), "{error}");
    }
    let _ = world(&format!("[{}]\n", vec!["a"; 20_000].join(".")));
    let _ = world(&format!("{} = 1\n", vec!["a"; 20_000].join(".")));
}

#[test]
fn files_of_a_world_must_be_in_its_folder() {
    for name in ["../a.obj", "/a.obj", "file:a.obj"] {
        let error = world(&format!("[[object]]\nmesh = \"{name}\"\n")).unwrap_err();
        assert!(error.contains(name) && error.contains("file name"), "{error}");
    }
    let error = world("[[object]]\nmesh = \"no.obj\"\n").unwrap_err();
    assert!(error.contains("no.obj: No such file"), "{error}");
}

#[test]
fn errors_of_referenced_files_name_the_reference() {
    let folder = folder();
    fs::write(folder.join("bad.obj"), "v 0 0 0\nv 1 0\n").unwrap();
    fs::write(folder.join("bad.png"), "no image").unwrap();
    fs::write(folder.join("bad.ies"), "no lamp").unwrap();
    fs::write(folder.join("good.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n").unwrap();
    let object = |keys: &str| format!("up = \"z\"\n[[object]]\nbox = {{}}\n[[object]]\n{keys}\n");
    let light = |keys: &str| format!("[[object]]\nbox = {{}}\n[[light]]\n{keys}\n");
    for (text, place, words) in [
        (object("mesh = \"bad.obj\""), "room.toml:5: object[1].mesh: ", "bad.obj:2: v has 2 numbers"),
        (object("name = \"a\"\nmesh = \"no.ply\""), "room.toml:6: object[1].mesh: ", "no.ply: No such file"),
        (object("mesh = \"good.obj\"\ntexture = \"bad.png\""), "room.toml:6: object[1].texture: ", "bad.png"),
        (object("mesh = \"../good.obj\""), "room.toml:5: object[1].mesh: ", "is outside the folder"),
        (light("type = \"environment\"\nimage = \"bad.png\""), "room.toml:5: light[0].image: ", "bad.png"),
        (
            light("type = \"ies\"\nposition = [0, 0, 1]\ndirection = [0, 0, -1]\nprofile = \"bad.ies\""),
            "room.toml:7: light[0].profile: ",
            "bad.ies: the line TILT= is missing",
        ),
    ] {
        let parsed = world_file::parse(&text, &folder, Path::new("room.toml"), &Budget::default());
        let error = parsed.unwrap_err().to_string();
        assert!(error.starts_with(place) && error.contains(words), "{text}: {error}");
    }
}

#[test]
fn mesh_files_used_by_several_objects_are_read_once() {
    let folder = folder();
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1\n";
    fs::write(folder.join("t.obj"), obj).unwrap();
    fs::write(folder.join("m.mtl"), "newmtl red\nKd 1 0 0\nmap_Kd i.png\n").unwrap();
    let image = png::encode([1, 1], 3, png::Samples::U8(&[255, 0, 0])).unwrap();
    fs::write(folder.join("i.png"), &image).unwrap();
    let text = "[[object]]\nmesh = \"t.obj\"\n[[object]]\nmesh = \"t.obj\"\ncolor = [0, 1, 0]\n[[object]]\n\
        mesh = \"t.obj\"\nrefine = 1\n[[object]]\nmesh = \"t.obj\"\nlocation = [1, 0, 0]\n";
    // The budget is exactly sufficient to read each file once.
    let budget = Budget {
        bytes: (obj.len() + "newmtl red\nKd 1 0 0\nmap_Kd i.png\n".len() + image.len()) as u64,
        ..Budget::default()
    };
    let world = world_file::parse(text, &folder, Path::new("room.toml"), &budget).unwrap();
    let meshes: Vec<usize> = world.objects.iter().map(|object| object.mesh).collect();
    assert_eq!(meshes, [0, 0, 1, 0]);
    assert_eq!(world.meshes[0].triangles.len(), 1);
    assert_eq!(world.meshes[1].triangles.len(), 4);
    assert_eq!(world.textures.len(), 1);
    let color = |object: usize| world.materials[world.objects[object].materials[0]].color;
    assert_eq!(color(1), [0.0, 1.0, 0.0]);
    for object in [0, 2, 3] {
        assert_eq!(color(object), [1.0, 0.0, 0.0], "{object}");
    }
    for object in &world.objects {
        let slot = world.materials[object.materials[0]].texture;
        assert_eq!(slot.unwrap().texture, 0);
    }
}

#[test]
fn reading_stops_at_the_first_empty_object() {
    let text = "[[object]]\nsphere = { radius = 1 }\n[[object]]\n[[object]]\nnonsense = 1\n";
    let error = world(text).unwrap_err();
    assert!(error.starts_with("room.toml:3: object[1]"), "{error}");
}

/// World file with this number of objects, each with a table: first the text `first`, then the objects, with a light
/// before the last `last` objects.
fn long(objects: usize, first: &str, last: usize, light: &str) -> String {
    let mut text = first.to_owned();
    for i in 0..objects {
        if i + last == objects {
            text += light;
        }
        let object = format!("name = \"tile {i}\"\nplane.size = [1, 1]\nlocation = [{i}, 2, 3]\n");
        text += &format!("  [[object]] # {i}\n{object}[object.textures]\n\n");
    }
    text
}

#[test]
fn long_world_files_are_read_like_short_world_files() {
    let count = 3000;
    let text = long(
        count,
        "up = \"y\"\n[camera]\nsize = [4, 3]\nfov = 50\nlocation = [0, 0, 0]\nyaw = 0\n",
        7,
        "[[light]]\ntype = \"sun\"\ndirection = [0, 0, -1]\nirradiance = [3, 3, 3]\n",
    );
    assert!(text.len() > 3 << 16);
    let whole = world(&text).unwrap();
    assert_eq!((whole.objects.len(), whole.lights.len(), whole.cameras.len()), (count, 1, 1));
    assert_eq!(whole.up, Up::Y);
    for (i, object) in whole.objects.iter().enumerate() {
        assert_eq!(object.name, format!("tile {i}"));
    }
    // The result and the error's line do not depend on the position at which the text is divided.
    let line = |error: String| error.split(' ').next().unwrap().to_owned();
    for i in [0, 1777, 2999] {
        let name = format!("\"tile {i}\"");
        let at = text.find(&name).unwrap();
        let expected = format!("room.toml:{}:", 1 + text[..at].matches('\n').count());
        let wrong = text.replacen(&name, "[[object]]", 1);
        assert_eq!(line(world(&wrong).unwrap_err()), expected, "{i}");
        let wrong = text.replacen(&name, "12", 1);
        assert_eq!(line(world(&wrong).unwrap_err()), expected, "{i}");
        let unclosed = text.replacen(&name, "'''tile", 1);
        assert!(world(&unclosed).is_err());
        let quoted = text.replacen(&name, &format!("'''\n[[object]]\n{i}'''"), 1);
        let found = world(&quoted).unwrap();
        assert_eq!(found.objects.len(), count);
        assert_eq!(found.objects[i].name, format!("[[object]]\n{i}"));
    }
    // At such a position, a line inside a string may look like the header of a table.
    let quoted = text.replace("\"tile ", "\"\"\"\n[[object]]\ntile ");
    let quoted = quoted.replace("\"\nplane", "\"\"\"\nplane");
    let found = world(&quoted).unwrap();
    assert_eq!(found.objects.len(), count);
    assert_eq!(found.objects[1777].name, "[[object]]\ntile 1777");
    // These keys may occur only once in a text.
    for twice in ["[render]\nsamples = 1\n", "[camera]\nsize = [4, 3]\nfov = 50\nlocation = [0, 0, 0]\nyaw = 0\n"] {
        let text = long(count, twice, 7, twice);
        let error = world(&text).unwrap_err();
        assert!(error.contains("duplicate"), "{error}");
    }
    let both = long(count, "object = [{ plane.size = [1, 1] }]\n", 7, "");
    assert!(world(&both).is_err());
}

use std::fs;
use std::path::Path;

use raycam_formats::{AssetRoot, Budget, FormatError, load};
use raycam_scene::{AssetLoader, ColorUse, Wrap};

use crate::support::folder;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A folder `world` with a mesh, and a mesh next to the folder.
fn setting() -> std::path::PathBuf {
    let around = folder();
    let root = around.join("world");
    fs::create_dir_all(root.join("parts")).unwrap();
    for name in ["world/a.obj", "world/parts/b.obj", "secret.obj", "world/with space%20.obj"] {
        fs::write(around.join(name), TRIANGLE).unwrap();
    }
    root
}

#[test]
fn files_inside_the_folder_are_read() {
    let root = setting();
    let mut files = AssetRoot::new(&root, &Budget::default());
    for name in ["a.obj", "./a.obj", "parts/b.obj", "parts/../a.obj", "with space%20.obj"] {
        files.mesh(name).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
    let missing = files.mesh("parts/no.obj").unwrap_err();
    assert!(matches!(missing, FormatError::Io { .. }) && missing.to_string().contains("world/parts/no.obj"));
}

#[test]
fn files_outside_the_folder_are_not_opened() {
    let root = setting();
    let absolute = root.with_file_name("secret.obj").display().to_string();
    let mut files = AssetRoot::new(&root, &Budget::default());
    for name in [
        "../secret.obj",
        "parts/../../secret.obj",
        "./../world/../secret.obj",
        &absolute,
        "/dev/zero.obj",
        "//server/share/a.obj",
        "\\\\server\\share\\a.obj",
        "..\\secret.obj",
        "C:/a.obj",
        "C:a.obj",
        "file:a.obj",
        "file:///etc/passwd.obj",
        "http://example.com/a.obj",
        "a.obj\0.png",
        "",
        "%2e%2e/secret.obj",
    ] {
        for error in
            [files.mesh(name).unwrap_err(), files.texture(name, [Wrap::Repeat; 2], ColorUse::Color).unwrap_err()]
        {
            let missing = name.starts_with('%') && matches!(error, FormatError::Io { .. });
            assert!(missing || matches!(error, FormatError::Reference { .. }), "{name:?}: {error}");
        }
    }
}

#[cfg(unix)]
#[test]
fn links_to_files_outside_are_not_followed() {
    let root = setting();
    std::os::unix::fs::symlink("../secret.obj", root.join("link.obj")).unwrap();
    std::os::unix::fs::symlink("..", root.join("up")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", root.join("zero.obj")).unwrap();
    std::os::unix::fs::symlink("a.obj", root.join("inside.obj")).unwrap();
    let mut files = AssetRoot::new(&root, &Budget::default());
    for name in ["link.obj", "up/secret.obj", "zero.obj"] {
        let error = files.mesh(name).unwrap_err().to_string();
        assert!(error.contains("it is outside the folder"), "{error}");
    }
    let error = files.mesh("link.obj").unwrap_err().to_string();
    let real = root.canonicalize().unwrap();
    let around = real.parent().unwrap();
    let expected = format!("a symbolic link to {}: it is outside", around.join("secret.obj").display());
    assert!(error.contains(&expected) && error.contains(&format!("load with folder={around:?}")), "{error}");
    files.mesh("inside.obj").unwrap();
    files.mesh(&root.join("a.obj").display().to_string()).unwrap();
    // Links are allowed for the folder itself, and for the file that the user requests.
    std::os::unix::fs::symlink(&root, root.with_file_name("alias")).unwrap();
    AssetRoot::new(&root.with_file_name("alias"), &Budget::default()).mesh("a.obj").unwrap();
    load(&root.join("link.obj"), &Budget::default()).unwrap();
}

#[test]
fn files_named_by_the_program_may_be_anywhere_but_their_references_may_not() {
    let root = setting();
    let around = root.parent().unwrap();
    let mut files = AssetRoot::trusted(&root, &Budget::default());
    for name in ["a.obj", "../secret.obj", "parts/../../secret.obj"] {
        files.mesh(name).unwrap();
    }
    files.mesh(&around.join("secret.obj").display().to_string()).unwrap();
    for name in ["", "nowhere.obj", "../nowhere.obj", "http://a.obj", "a.obj\0"] {
        files.mesh(name).unwrap_err();
    }
    // A mesh named by the program may refer to a material library in its own folder, but not in another folder.
    fs::write(around.join("green.mtl"), "newmtl g\nKd 0 1 0\n").unwrap();
    let red = format!("mtllib world/../green.mtl\nusemtl g\n{TRIANGLE}");
    fs::write(around.join("green.obj"), red).unwrap();
    let model = files.mesh("../green.obj").unwrap();
    assert_eq!(model.materials[0].color, [0.0, 1.0, 0.0]);
    fs::create_dir(around.join("other")).unwrap();
    let out = format!("mtllib ../green.mtl\nusemtl g\n{TRIANGLE}");
    fs::write(around.join("other/out.obj"), out).unwrap();
    let model = files.mesh("../other/out.obj").unwrap();
    let said = &model.notices[0].message;
    assert!(said.contains("it is outside the folder"), "{said}");
}

#[test]
fn one_budget_covers_all_files_that_a_program_names() {
    let root = setting();
    let bytes = 5 * TRIANGLE.len() as u64 / 2;
    let small = Budget { bytes, ..Budget::default() };
    let mut files = AssetRoot::trusted(&root, &small);
    files.mesh("../secret.obj").unwrap();
    files.mesh("../secret.obj").unwrap();
    let error = files.mesh("../secret.obj").unwrap_err().to_string();
    assert!(error.contains("secret.obj"), "{error}");
}

#[test]
fn error_of_a_fixed_root_recommends_copying_the_file() {
    let root = setting();
    let error = |mut files: AssetRoot| files.read_reference(Path::new(""), "../secret.obj").unwrap_err().to_string();
    let files = AssetRoot::new(&root, &Budget::default());
    assert!(error(files).contains("folder="));
    let fixed = error(AssetRoot::new(&root, &Budget::default()).fixed());
    assert!(fixed.contains("copy it into this folder") && !fixed.contains("folder="), "{fixed}");
}

#[test]
fn file_names_in_a_mesh_are_relative_to_its_folder() {
    let root = setting();
    fs::write(root.join("parts/b.obj"), format!("mtllib ../m/b.mtl\nusemtl b\n{TRIANGLE}")).unwrap();
    fs::create_dir(root.join("m")).unwrap();
    fs::write(root.join("m/b.mtl"), "newmtl b\nKd 1 0 0\n").unwrap();
    let model = AssetRoot::new(&root, &Budget::default()).mesh("parts/b.obj").unwrap();
    assert_eq!(model.materials[0].color, [1.0, 0.0, 0.0]);
    // If the mesh file itself is loaded, names in it cannot refer to files outside its folder.
    let world = load(&root.join("parts/b.obj"), &Budget::default()).unwrap();
    assert!(world.notices[0].to_string().contains("it is outside the folder"), "{:?}", world.notices);
}

#[test]
fn an_empty_path_is_the_current_folder() {
    for root in ["", "."] {
        let mut files = AssetRoot::new(Path::new(root), &Budget::default());
        let model = files.mesh("tests/data/concave_polygon.obj").unwrap();
        assert_eq!(model.materials[0].name, "test");
        assert!(model.notices.is_empty(), "{:?}", model.notices);
    }
}

use raycam_formats::{Budget, FormatError, load};

use crate::support::{data, file};

#[test]
fn each_limit_stops_files_that_exceed_it() {
    let big = Budget::default();
    for (name, budget, what) in [
        ("comments.off", Budget { bytes: 600, ..big }, "bytes"),
        ("comments.off", Budget { elements: 7, ..big }, "vertices and face corners"),
        ("comments.off", Budget { elements: 31, ..big }, "vertices and face corners"),
        ("multi.ply", Budget { elements: 3, ..big }, "vertices and face corners"),
        ("multibody.stl", Budget { elements: 50, ..big }, "vertices and face corners"),
        ("negative_indices.obj", Budget { elements: 20, ..big }, "vertices and face corners"),
        ("concave_polygon.obj", Budget { steps: 100, ..big }, "steps to cut its polygons into triangles"),
    ] {
        let path = data(name);
        match load(&path, &budget).unwrap_err() {
            FormatError::Budget { what: found, .. } => assert_eq!(found, what, "{name}"),
            other => panic!("{name}: {other}"),
        }
        load(&path, &big).unwrap();
    }
}

#[test]
fn one_budget_covers_a_world_with_all_its_files() {
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let path = file("a.toml", "object = [{ mesh = \"a.obj\" }, { mesh = \"b.obj\" }]\n");
    for name in ["a.obj", "b.obj"] {
        std::fs::write(path.with_file_name(name), mesh).unwrap();
    }
    let two = std::fs::metadata(&path).unwrap().len() + 2 * mesh.len() as u64;
    load(&path, &Budget { bytes: two, ..Budget::default() }).unwrap();
    let error = load(&path, &Budget { bytes: two - 1, ..Budget::default() }).unwrap_err();
    assert!(error.to_string().contains("b.obj: "), "{error}");
}

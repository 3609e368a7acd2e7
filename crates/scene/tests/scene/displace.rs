//! Displaced meshes: heights between vertices whose edges are longer than a texel.

use raycam_scene::mesh::primitive;
use raycam_scene::schema::{self, ObjectSpec};
use raycam_scene::{Mesh, MeshFile, World};

use crate::common::{FakeFiles, node};

fn displaced(image: &str, displace: &str) -> Mesh {
    let mut world = World::default();
    let json = format!(
        r#"{{ "plane": {{ "size": [2, 2] }}, "textures": {{ "height": {{ "image": {image} }} }}, "displace": {displace} }}"#
    );
    let spec = schema::from_value::<ObjectSpec>(&node(&json)).unwrap();
    spec.build(&mut world, &mut FakeFiles(MeshFile::default())).unwrap();
    Mesh::clone(&world.meshes[0])
}

/// A checkerboard of 0 and 1 as JSON.
fn checkerboard(side: usize) -> String {
    let row = |y: usize| {
        let texels: Vec<_> = (0..side).map(|x| if (x + y).is_multiple_of(2) { "0.0" } else { "1.0" }).collect();
        format!("[{}]", texels.join(", "))
    };
    format!("[{}]", (0..side).map(row).collect::<Vec<_>>().join(", "))
}

#[test]
fn coarse_edges_move_by_the_mean_height_and_fine_edges_by_each_texel() {
    let image = checkerboard(64);
    let coarse = displaced(&image, r#"{ "max_edge": 0.4 }"#);
    assert!(coarse.triangles.len() < 1000);
    assert!(coarse.vertices.iter().all(|v| (v.z - 0.5).abs() < 0.01), "{:?}", coarse.bounds());
    let fine = displaced(&image, "true");
    assert_eq!(fine.triangles.len(), 2 * 64 * 64);
    let same = displaced(&image, r#"{ "max_edge": 1e-6 }"#);
    assert_eq!(fine, same);
    assert_eq!(displaced(&image, "false"), primitive::plane([2.0, 2.0]).unwrap());
}

//! Counts of the parts of a world.

use glam::DAffine3;
use raycam_scene::mesh::primitive;
use raycam_scene::{Light, Material, Object, World, WorldStats};

#[test]
fn triangles_count_once_per_mesh_and_once_per_object() {
    let mut world = World::default();
    assert_eq!(world.stats(), WorldStats::default());
    let mut cube = primitive::box_([1.0; 3]).unwrap();
    cube.triangles.push([0, 0, 1]);
    let corners = cube.vertices.len();
    let mesh = world.add_mesh(cube);
    let material = world.add_material(Material::default()).unwrap();
    for _ in 0..3 {
        let object = Object::new("box", mesh, vec![material], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
    }
    world.add_light(Light::Sun { direction: [0.0, 0.0, -1.0], irradiance: [1.0; 3], angular_diameter: 0.0 }).unwrap();
    let expected = WorldStats {
        meshes: 1,
        objects: 3,
        mesh_triangles: 13,
        object_triangles: 39,
        degenerate_triangles: 1,
        vertices: corners,
        materials: 1,
        lights: 1,
        ..WorldStats::default()
    };
    assert_eq!(world.stats(), expected);
}

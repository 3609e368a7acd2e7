//! Worlds: contents, additions and the default camera.

use crate::common::node;
use glam::{DAffine3, DMat3, DVec3};
use raycam_scene::camera::intrinsics_from_focal;
use raycam_scene::mesh::primitive;
use raycam_scene::schema::{self, WorldFile};
use raycam_scene::{Camera, Material, NoAssets, Object, PixelCenter, Up, World};

fn world(json: &str) -> World {
    schema::from_value::<WorldFile>(&node(json)).unwrap().build(&mut NoAssets).unwrap()
}

fn one_box() -> World {
    let mut world = World::default();
    let mesh = primitive::box_([1.0; 3]).unwrap();
    let material = world.add_material(Material::for_mesh(&mesh)).unwrap();
    let mesh = world.add_mesh(mesh);
    world.add_object(Object::new("box", mesh, vec![material], DAffine3::IDENTITY)).unwrap();
    world
}

#[test]
fn duplicate_names_get_a_number() {
    let world = world(
        r#"{ "object": [{ "box": {} }, { "box": {} }, { "box": {}, "name": "box-3" }, { "box": {} }, { "sphere": {} }],
             "camera": [{ "focal": 1, "location": [0, 0, 0] }, { "focal": 1, "location": [0, 0, 0] }] }"#,
    );
    let names: Vec<_> = world.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["box", "box-2", "box-3", "box-4", "sphere"]);
    assert_eq!(world.cameras[1].name, "camera-2");
    assert_eq!(world.find_object("box-4").unwrap(), 3);
}

#[test]
fn naming_many_objects_is_fast() {
    let mut world = one_box();
    for _ in 0..100_000 {
        world.add_object(Object::new("box", 0, vec![0], DAffine3::IDENTITY)).unwrap();
    }
    assert_eq!(world.objects.last().unwrap().name, "box-100001");
}

#[test]
fn objects_with_invalid_indices_or_transforms_are_refused() {
    let mut world = one_box();
    let before = world.clone();
    let mut fails = |object: Object, expected: &str| {
        let error = world.add_object(object).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    fails(Object::new("a", 1, vec![0], DAffine3::IDENTITY), r#"object "a" refers to mesh 1, but the world has 1 mesh"#);
    fails(
        Object::new("a", 0, vec![2], DAffine3::IDENTITY),
        r#"object "a" refers to material 2, but the world has 1 mat"#,
    );
    fails(Object::new("a", 0, vec![], DAffine3::IDENTITY), "has 0 materials; its mesh uses 1 slot");
    fails(Object::new("a", 0, vec![0], DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))), "which is singular");
    fails(Object::new("a", 0, vec![0], DAffine3::from_translation(DVec3::NAN)), "every number must be finite");
    assert_eq!(world, before);
    let mirror = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)));
    world.add_object(Object::new("mirrored", 0, vec![0], mirror)).unwrap();
}

#[test]
fn world_bounds_contain_all_visible_objects() {
    let world = world(
        r#"{ "object": [{ "box": {} }, { "sphere": { "radius": 1 }, "location": [5, 0, 0], "scale": [1, 2, 3] }] }"#,
    );
    let (low, high) = world.bounds().unwrap();
    assert!((low - DVec3::new(-0.5, -2.0, -3.0)).abs().max_element() < 0.05, "{low}");
    assert!((high - DVec3::new(6.0, 2.0, 3.0)).abs().max_element() < 0.05, "{high}");
    assert_eq!(World::default().bounds(), None);
}

#[test]
fn default_camera_frames_everything() {
    for up in ["z", "y"] {
        for (size, scale) in [([640, 480], "1"), ([480, 640], "[100, 1, 1]"), ([100, 1000], "1e-6"), ([7, 7], "1e9")] {
            let world = world(&format!(
                r#"{{ "up": "{up}", "object": {{ "box": {{}}, "location": [3, 4, 5], "scale": {scale} }} }}"#
            ));
            let camera = world.default_camera(size).unwrap();
            assert_eq!(camera.size(), size);
            let mut extent: f64 = 0.0;
            for corner in &world.meshes[0].vertices {
                let (pixel, in_front) = camera.project(world.objects[0].world_from_mesh.transform_point3(*corner));
                assert!(in_front);
                let relative = (pixel.x / f64::from(size[0] - 1) - 0.5, pixel.y / f64::from(size[1] - 1) - 0.5);
                extent = extent.max(relative.0.abs()).max(relative.1.abs());
            }
            // The outermost point is at 90 % of half the image size from the centre, apart from the offset between
            // pixel centres and the image's sides.
            let slack = 1.0 / f64::from(size[0].min(size[1]) - 1);
            assert!((extent - 0.45).abs() < 0.01 + slack, "{extent} {size:?} {scale}");
            assert!((camera.r() * world.up.axis()).y < 0.0, "upright");
            assert!(camera.forward().dot(world.up.axis()) < 0.0, "from above");
        }
    }
    assert!(World::default().default_camera([8, 8]).unwrap_err().to_string().contains("no objects"));
    assert!(one_box().default_camera([0, 8]).is_err());
}

#[test]
fn first_camera_is_the_default_camera() {
    let mut world = one_box();
    let k = intrinsics_from_focal(300.0, [64, 48], PixelCenter::Half);
    let camera = Camera::new(k, DMat3::IDENTITY, DVec3::ZERO, [64, 48], PixelCenter::Half).unwrap();
    world.add_camera("left", camera.clone());
    assert_eq!(world.default_camera([8, 8]).unwrap(), camera);
    assert_eq!(world.find_camera("left").unwrap().camera, camera);
}

#[test]
fn counts_match_the_contents() {
    let mut world = one_box();
    world.add_object(Object::new("again", 0, vec![0], DAffine3::IDENTITY)).unwrap();
    let counts = world.stats();
    assert_eq!((counts.meshes, counts.objects, counts.vertices), (1, 2, 24));
    assert_eq!((counts.mesh_triangles, counts.object_triangles, counts.degenerate_triangles), (12, 24, 0));
    assert_eq!((counts.materials, counts.lights, counts.cameras, counts.textures), (1, 0, 0, 0));
}

#[test]
fn up_axis_is_a_unit_direction() {
    assert_eq!((Up::Z.axis(), Up::Y.axis()), (DVec3::Z, DVec3::Y));
}

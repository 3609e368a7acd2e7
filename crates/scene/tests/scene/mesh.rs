//! Meshes: valid and inconsistent arrays.

use glam::{DAffine3, DVec3};
use raycam_scene::mesh::primitive;
use raycam_scene::{Material, Mesh, MeshFile, MeshPart};

fn message(change: impl FnOnce(&mut Mesh)) -> String {
    let mut mesh = primitive::plane([1.0, 1.0]).unwrap();
    mesh.validate().unwrap();
    change(&mut mesh);
    mesh.validate().expect_err("an error").to_string()
}

#[test]
fn mesh_errors_report_the_first_invalid_entry() {
    let count = 400_000;
    let mut mesh = Mesh { vertices: vec![DVec3::ONE; count], triangles: vec![[0, 1, 2]; count], ..Mesh::default() };
    mesh.validate().unwrap();
    for place in [count - 1, count / 2, count / 2 - 1, 77] {
        mesh.vertices[place].z = f64::NAN;
        let error = mesh.validate().unwrap_err().to_string();
        assert!(error.contains(&format!("vertex {place} is ")), "{error}");
    }
    mesh.vertices.fill(DVec3::ONE);
    for place in [count - 1, count / 2, 5] {
        mesh.triangles[place][1] = count as u32;
        let error = mesh.validate().unwrap_err().to_string();
        assert!(error.contains(&format!("triangle {place} has ")), "{error}");
    }
}

#[test]
fn mesh_errors_name_the_array_and_the_fault() {
    assert!(message(|m| m.triangles.clear()).contains("without triangles"));
    assert!(message(|m| *m = Mesh::default()).contains("a mesh of 0 vertices without triangles"));
    assert!(message(|m| m.vertices[2].y = f64::NAN).contains("vertex 2 is [0.5, NaN, 0]"));
    assert!(message(|m| m.vertices[0].y = f64::INFINITY).contains("must be finite"));
    let out_of_range = message(|m| m.triangles[1][2] = 4);
    assert_eq!(out_of_range, "triangle 1 has corners [0, 2, 4], but the mesh has 4 vertices; expected indices 0 to 3");
    assert!(message(|m| m.uvs = Some(vec![])).contains("uvs has 0 entries; expected one for each of the 4 vertices"));
    assert!(message(|m| m.normals = Some(vec![[f32::NAN; 3]; 4])).contains("normals[0] is [NaN, NaN, NaN]"));
    assert!(message(|m| m.face_colors = Some(vec![[1.5; 3]; 2])).contains("face_colors[0] is [1.5, 1.5, 1.5]"));
    assert!(message(|m| m.face_colors = Some(vec![[0.5; 3]; 3])).contains("each of the 2 triangles"));
    assert!(message(|m| m.vertex_colors = Some(vec![[-0.1; 3]; 4])).contains("expected numbers from 0 to 1"));
    assert!(message(|m| m.vertex_colors = Some(vec![[f32::NAN; 3]; 4])).contains("expected numbers from 0 to 1"));
    assert!(message(|m| m.material_slots = Some(vec![0])).contains("material_slots has 1 entry"));
}

#[test]
fn triangles_without_area_are_counted_and_kept() {
    let mut mesh = primitive::plane([1.0, 1.0]).unwrap();
    mesh.triangles.extend([[0, 0, 1], [0, 1, 1]]);
    mesh.vertices.push(DVec3::ZERO);
    mesh.triangles.push([0, 4, 2]);
    mesh.uvs = None;
    mesh.validate().unwrap();
    assert_eq!(mesh.degenerate_count(), 3);
}

#[test]
fn bounds_follow_the_triangles_and_stay_tight_after_rotation() {
    let mut mesh = primitive::box_([1.0, 2.0, 3.0]).unwrap();
    mesh.vertices.push(DVec3::splat(100.0));
    assert_eq!(mesh.bounds(), Some((DVec3::new(-0.5, -1.0, -1.5), DVec3::new(0.5, 1.0, 1.5))));
    let sphere = primitive::sphere(1.0, 3).unwrap();
    let (low, high) = sphere.bounds_in(DAffine3::from_rotation_z(0.7)).unwrap();
    assert!(high.max_element() <= 1.0 + 1e-12 && low.min_element() >= -1.0 - 1e-12);
    assert_eq!(Mesh::default().bounds(), None);
}

#[test]
fn parts_of_a_model_are_joined_to_one_mesh() {
    let part = |mesh: Mesh, materials: Vec<usize>| MeshPart { name: String::new(), mesh, materials };
    let mut first = primitive::plane([1.0, 1.0]).unwrap();
    first.material_slots = Some(vec![1, 0]);
    let mut second = primitive::box_([1.0; 3]).unwrap();
    second.uvs = None;
    second.vertex_colors = Some(vec![[0.5; 3]; 24]);
    let material = Material::for_mesh(&second);
    let mut model = MeshFile { materials: vec![material; 8], ..MeshFile::default() };
    model.parts = vec![part(first, vec![7, 3]), part(Mesh::default(), vec![0]), part(second, vec![3])];
    let (mesh, materials) = model.as_single_mesh().unwrap();
    mesh.validate().unwrap();
    assert_eq!(materials, [7, 3]);
    assert_eq!(mesh.material_slots.as_ref().unwrap()[..3], [1, 0, 1]);
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (28, 14));
    assert_eq!(mesh.triangles[2], primitive::box_([1.0; 3]).unwrap().triangles[0].map(|v| v + 4));
    let colors = mesh.vertex_colors.unwrap();
    assert_eq!((colors[3], colors[4]), ([1.0; 3], [0.5; 3]));
    assert_eq!(mesh.uvs.unwrap()[27], [0.0; 2]);
    assert!(mesh.normals.is_none());

    let fails = |model: &MeshFile, expected: &str| {
        assert!(model.as_single_mesh().unwrap_err().to_string().contains(expected));
    };
    model.parts[0].materials = vec![7];
    fails(&model, "uses a material that is missing");
    model.parts[0].materials = vec![7, 8];
    fails(&model, "uses a material that is missing");
    model.parts[0].mesh.triangles[0][0] = u32::MAX;
    fails(&model, "expected indices 0 to 3");
    fails(&MeshFile::default(), "without triangles");
}

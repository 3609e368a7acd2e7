//! Subdivision: the limit surfaces, and the attributes that new triangles inherit.

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use raycam_scene::Mesh;
use raycam_scene::mesh::primitive;
use raycam_scene::mesh::subdivide::{loop_subdivide, midpoint};

fn bits(v: DVec3) -> [u64; 3] {
    v.to_array().map(|x| (x + 0.0).to_bits())
}

/// Edges by the coordinates of their ends, with the number of triangles of each edge.
fn edges(mesh: &Mesh) -> HashMap<[[u64; 3]; 2], usize> {
    let mut edges = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        let [a, b, c] = [a, b, c].map(|v| bits(mesh.vertices[v as usize]));
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *edges.entry([from.min(to), from.max(to)]).or_default() += 1;
        }
    }
    edges
}

fn positions(mesh: &Mesh) -> HashSet<[u64; 3]> {
    mesh.vertices.iter().map(|&v| bits(v)).collect()
}

/// A regular triangular grid, n by n rhombi.
fn grid(n: u32) -> Mesh {
    let index = |i: u32, j: u32| i * (n + 1) + j;
    let mut mesh = Mesh::default();
    for i in 0..=n {
        for j in 0..=n {
            let (x, y) = (f64::from(i) + 0.5 * f64::from(j), 0.75_f64.sqrt() * f64::from(j));
            mesh.vertices.push(DVec3::new(x, y, 0.0));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            mesh.triangles.extend([[a, b, d], [b, c, d]]);
        }
    }
    mesh
}

#[test]
fn loop_step_of_an_octahedron_matches_the_paper() {
    // Valence 4: beta = 1/4 (5/8 - (3/8 + 1/4 cos 90°)^2) = 31/256; the vectors of a corner's neighbours sum to 0.
    let corners = [DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y, DVec3::Z, -DVec3::Z];
    let mut mesh = Mesh { vertices: corners.to_vec(), ..Mesh::default() };
    for i in 0..4 {
        mesh.triangles.extend([[i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5]]);
    }
    let refined = loop_subdivide(&mesh, 1).unwrap();
    assert_eq!((refined.vertices.len(), refined.triangles.len()), (18, 32));
    for (found, corner) in refined.vertices.iter().zip(corners) {
        assert!((*found - corner * (1.0 - 4.0 * 31.0 / 256.0)).length() < 1e-15);
    }
    // A new point is 3/8 of both ends of its edge; the contributions of the opposite corners cancel.
    for vertex in &refined.vertices[6..] {
        let mut sorted = vertex.abs().to_array();
        sorted.sort_by(f64::total_cmp);
        assert!((sorted[0], sorted[1], sorted[2]) == (0.0, 0.375, 0.375), "{vertex}");
    }
}

#[test]
fn corners_converge_to_their_limit_position() {
    // Limit position of a vertex: each neighbour has the weight 1 / (n + 3 / (8 beta)) (Loop 1987).
    let mesh = primitive::sphere(1.0, 0).unwrap();
    let (n, beta) = (5.0, {
        let c: f64 = 0.375 + 0.25 * (std::f64::consts::TAU / 5.0).cos();
        (0.625 - c * c) / 5.0
    });
    let weight = 1.0 / (n + 3.0 / (8.0 * beta));
    let neighbours = 5.0 * 0.2_f64.sqrt();
    let limit = 1.0 - n * weight + weight * neighbours;
    let refined = loop_subdivide(&mesh, 7).unwrap();
    let top = refined.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
    assert!((top - limit).abs() < 1e-5, "{top} {limit}");
    let normals = refined.normals.unwrap();
    for (vertex, normal) in refined.vertices.iter().zip(normals) {
        let normal = DVec3::from_array(normal.map(f64::from));
        assert!(normal.dot(vertex.normalize()) > 0.99, "the surface is nearly a sphere");
    }
}

#[test]
fn refined_flat_grids_change_only_at_their_corners() {
    let mesh = grid(4);
    let refined = loop_subdivide(&mesh, 2).unwrap();
    let exact = midpoint(&mesh, 2).unwrap();
    assert_eq!(refined.triangles, exact.triangles);
    for (found, expected) in refined.vertices.iter().zip(&exact.vertices) {
        assert_eq!(found.z, 0.0);
        // Away from the corners of the grid nothing moves, because the rules reproduce linear functions.
        let (j, inset) = (expected.y / 0.75_f64.sqrt(), 1.5);
        let i = expected.x - 0.5 * j;
        let at_corner = (i < inset || i > 4.0 - inset) && (j < inset || j > 4.0 - inset);
        assert!(at_corner || (*found - *expected).length() < 1e-14, "{expected} moved to {found}");
    }
}

#[test]
fn boundaries_follow_the_spline_of_boundary_points() {
    // Weights at a boundary corner: 1/8 for the previous corner, 3/4 for the corner itself, 1/8 for the next corner.
    let mesh = Mesh { vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
    let refined = loop_subdivide(&mesh, 1).unwrap();
    assert_eq!(refined.vertices[0], DVec3::new(0.125, 0.125, 0.0));
    assert_eq!(refined.vertices[1], DVec3::new(0.75, 0.125, 0.0));
    assert!(refined.vertices[3..].contains(&DVec3::new(0.5, 0.5, 0.0)));
}

#[test]
fn vertices_where_many_sharp_edges_meet_stay_in_place() {
    // Three sheets share one edge: the edge is sharp, and more than two sharp edges meet at each of its ends.
    let mesh = Mesh {
        vertices: vec![DVec3::ZERO, DVec3::Z, DVec3::X, DVec3::Y, -DVec3::X],
        triangles: vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]],
        ..Mesh::default()
    };
    let refined = loop_subdivide(&mesh, 3).unwrap();
    assert_eq!(refined.vertices[..2], [DVec3::ZERO, DVec3::Z]);
}

#[test]
fn texture_seams_do_not_tear() {
    for mesh in [
        primitive::box_([1.0, 2.0, 3.0]).unwrap(),
        primitive::cylinder(1.0, 1.0, 12).unwrap(),
        primitive::sphere(1.0, 1).unwrap(),
    ] {
        for refined in [loop_subdivide(&mesh, 3).unwrap(), midpoint(&mesh, 3).unwrap()] {
            refined.validate().unwrap();
            assert_eq!(refined.triangles.len(), 64 * mesh.triangles.len());
            assert!(edges(&refined).values().all(|&count| count == 2), "still closed");
            assert_eq!(refined.degenerate_count(), 0);
        }
    }
}

#[test]
fn midpoint_subdivision_keeps_the_surface() {
    let mesh = primitive::box_([1.0, 2.0, 3.0]).unwrap();
    let refined = midpoint(&mesh, 3).unwrap();
    assert!(positions(&mesh).is_subset(&positions(&refined)));
    let (low, high) = mesh.bounds().unwrap();
    assert_eq!(refined.bounds(), Some((low, high)));
    let on_surface = |v: &DVec3| (*v - low).min(high - *v).abs().min_element() == 0.0;
    assert!(refined.vertices.iter().all(on_surface));
}

#[test]
fn subdivided_triangles_inherit_colours_and_materials() {
    let mut mesh = primitive::box_([1.0; 3]).unwrap();
    mesh.face_colors = Some((0..12).map(|i| [i as f32 / 12.0; 3]).collect());
    mesh.material_slots = Some((0..12).collect());
    mesh.vertex_colors = Some(mesh.vertices.iter().map(|v| (*v + 0.5).as_vec3().to_array()).collect());
    let refined = midpoint(&mesh, 2).unwrap();
    for (i, triangle) in refined.triangles.iter().enumerate() {
        assert_eq!(refined.face_colors.as_ref().unwrap()[i], [(i / 16) as f32 / 12.0; 3]);
        assert_eq!(usize::from(refined.material_slots.as_ref().unwrap()[i]), i / 16);
        for &v in triangle {
            // Before the subdivision, colours and texture coordinates were linear over each face; they must still be.
            let position = (refined.vertices[v as usize] + 0.5).as_vec3().to_array();
            assert_eq!(refined.vertex_colors.as_ref().unwrap()[v as usize], position);
        }
    }
    let sphere = midpoint(&primitive::sphere(1.0, 1).unwrap(), 1).unwrap();
    for normal in sphere.normals.unwrap() {
        let length = DVec3::from_array(normal.map(f64::from)).length();
        assert!((length - 1.0).abs() < 1e-6);
    }
}

#[test]
fn triangles_without_area_do_not_affect_refinement() {
    let clean = primitive::sphere(1.0, 1).unwrap();
    let mut mesh = clean.clone();
    let [a, b, _] = mesh.triangles[0];
    mesh.triangles.push([a, a, b]);
    let refined = loop_subdivide(&mesh, 2).unwrap();
    let expected = loop_subdivide(&clean, 2).unwrap();
    assert_eq!(refined.degenerate_count(), 16);
    assert_eq!(positions(&refined), positions(&expected));
}

#[test]
fn subdivision_beyond_the_limit_is_refused_before_it_starts() {
    let mesh = primitive::box_([1.0; 3]).unwrap();
    for levels in [11, 31, u32::MAX] {
        let error = loop_subdivide(&mesh, levels).unwrap_err().to_string();
        assert!(error.contains("12 triangles into more than 33554432"), "{error}");
    }
    assert_eq!(midpoint(&mesh, 0).unwrap(), mesh);
}

#[test]
fn subdivided_meshes_interpolate_every_attribute_of_their_vertices() {
    let square = primitive::plane([2.0, 2.0]).unwrap();
    let count = square.vertices.len();
    let mesh = Mesh {
        more_uvs: vec![square.uvs.clone().unwrap()],
        tangents: Some(vec![[1.0, 0.0, 0.0, 1.0]; count]),
        vertex_opacities: Some((0..count).map(|i| i as f32 / 4.0).collect()),
        vertex_colors: Some(vec![[0.5; 3]; count]),
        ..square
    };
    for refined in [loop_subdivide(&mesh, 2).unwrap(), midpoint(&mesh, 2).unwrap()] {
        refined.validate().unwrap();
        assert_eq!(refined.more_uvs[0], refined.uvs.unwrap());
        let opacities = refined.vertex_opacities.unwrap();
        // The first new vertex is the middle of the edge between the first two corners.
        assert_eq!(opacities[count], f32::midpoint(opacities[0], opacities[1]));
    }
}

//! Primitives: closed, facing outwards, watertight, and of the requested size.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::DVec3;
use raycam_scene::Mesh;
use raycam_scene::mesh::primitive;

/// Corners with equal coordinates are the same corner.
fn corners(mesh: &Mesh) -> Vec<[[u64; 3]; 3]> {
    let bits = |&v: &u32| mesh.vertices[v as usize].to_array().map(|x| (x + 0.0).to_bits());
    mesh.triangles.iter().map(|t| [bits(&t[0]), bits(&t[1]), bits(&t[2])]).collect()
}

/// Every edge has exactly two triangles, which run along it in opposite directions.
fn assert_closed(mesh: &Mesh) {
    let mut directed: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
    for [a, b, c] in corners(mesh) {
        for edge in [[a, b], [b, c], [c, a]] {
            assert_ne!(edge[0], edge[1], "no triangle without area");
            *directed.entry(edge).or_default() += 1;
        }
    }
    for ([a, b], count) in &directed {
        assert_eq!(*count, 1);
        assert_eq!(directed.get(&[*b, *a]), Some(&1));
    }
}

fn volume(mesh: &Mesh) -> f64 {
    let corner = |v: u32| mesh.vertices[v as usize];
    mesh.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
}

fn area(mesh: &Mesh) -> f64 {
    let corner = |v: u32| mesh.vertices[v as usize];
    mesh.triangles.iter().map(|&[a, b, c]| (corner(b) - corner(a)).cross(corner(c) - corner(a)).length() / 2.0).sum()
}

fn assert_sound(mesh: &Mesh) {
    mesh.validate().unwrap();
    assert_eq!(mesh.degenerate_count(), 0);
    assert!(mesh.uvs.is_some());
    for (triangle, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = [a, b, c].map(|v| v as usize);
        let face = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).normalize();
        for normal in mesh.normals.iter().flat_map(|normals| [normals[a], normals[b], normals[c]]) {
            let normal = DVec3::from_array(normal.map(f64::from));
            assert!((normal.length() - 1.0).abs() < 1e-6);
            assert!(normal.dot(face) > 0.3, "shading normal of triangle {triangle} faces the other way");
        }
        // The texture is not mirrored on the surface.
        let [p, q, r] = [a, b, c].map(|v| mesh.uvs.as_ref().unwrap()[v].map(f64::from));
        let turn = (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
        assert!(turn < 1e-12, "texture coordinates of triangle {triangle} are mirrored");
    }
}

#[test]
fn boxes_have_twelve_outward_triangles() {
    let mesh = primitive::box_([1.0, 2.0, 3.0]).unwrap();
    assert_sound(&mesh);
    assert_closed(&mesh);
    assert_eq!(mesh.triangles.len(), 12);
    assert_eq!(mesh.bounds(), Some((DVec3::new(-0.5, -1.0, -1.5), DVec3::new(0.5, 1.0, 1.5))));
    assert!((volume(&mesh) - 6.0).abs() < 1e-14);
    assert!((area(&mesh) - 22.0).abs() < 1e-13);
    assert!(mesh.normals.is_none(), "flat");
}

#[test]
fn planes_face_up() {
    let mesh = primitive::plane([4.0, 3.0]).unwrap();
    assert_sound(&mesh);
    assert_eq!(mesh.triangles.len(), 2);
    assert!((area(&mesh) - 12.0).abs() < 1e-14);
    let [a, b, c] = mesh.triangles[0].map(|v| mesh.vertices[v as usize]);
    assert!((b - a).cross(c - a).z > 0.0);
}

#[test]
fn spheres_are_closed_and_round_at_every_level() {
    for level in 0..6 {
        let mesh = primitive::sphere(2.0, level).unwrap();
        assert_sound(&mesh);
        assert_closed(&mesh);
        assert_eq!(mesh.triangles.len(), 20 * 4_usize.pow(level));
        assert!(mesh.vertices.iter().all(|v| (v.length() - 2.0).abs() < 1e-14));
        let ball = 4.0 / 3.0 * PI * 8.0;
        let missing = 1.0 - volume(&mesh) / ball;
        // The difference from the exact volume decreases by a factor of four per level.
        assert!(missing > 0.0 && missing < 0.6 / 4_f64.powi(level as i32), "{level} {missing}");
    }
    let uvs = primitive::sphere(1.0, 3).unwrap().uvs.unwrap();
    assert!(uvs.iter().all(|&[u, v]| (0.0..1.5).contains(&u) && (0.0..=1.0).contains(&v)));
}

#[test]
fn sphere_textures_are_not_stretched_across_the_seam() {
    let mesh = primitive::sphere(1.0, 3).unwrap();
    let uvs = mesh.uvs.as_ref().unwrap();
    for &[a, b, c] in &mesh.triangles {
        let u = [a, b, c].map(|v| uvs[v as usize][0]);
        let spread = u.iter().fold(f32::MIN, |m, &v| m.max(v)) - u.iter().fold(f32::MAX, |m, &v| m.min(v));
        assert!(spread < 0.26, "{u:?}");
    }
}

#[test]
fn cylinders_cones_and_tori_are_closed_and_have_the_exact_volume() {
    // Exact volumes of the polyhedra: a regular n-gon has the area n/2 sin(2 pi / n) r^2.
    for n in [3_u32, 4, 7, 64, 301] {
        let polygon = |r: f64| f64::from(n) / 2.0 * (2.0 * PI / f64::from(n)).sin() * r * r;
        let cylinder = primitive::cylinder(0.5, 3.0, n).unwrap();
        assert_sound(&cylinder);
        assert_closed(&cylinder);
        assert!((volume(&cylinder) - polygon(0.5) * 3.0).abs() < 1e-12);
        assert_eq!(cylinder.bounds().unwrap().1.z, 1.5);
        assert_eq!(cylinder.triangles.len(), 4 * n as usize);

        let cone = primitive::cone(0.5, 3.0, n).unwrap();
        assert_sound(&cone);
        assert_closed(&cone);
        assert!((volume(&cone) - polygon(0.5)).abs() < 1e-12);
        assert_eq!(cone.triangles.len(), 2 * n as usize);
    }
    for n in [3, 8, 64, 129] {
        let torus = primitive::torus(2.0, 0.5, n).unwrap();
        assert_closed(&torus);
        assert_eq!(torus.triangles.len() as u32, 2 * n * (n / 2).max(3));
        assert!(volume(&torus) > 0.0);
    }
    let torus = primitive::torus(2.0, 0.5, 256).unwrap();
    assert_sound(&torus);
    assert!((volume(&torus) / (2.0 * PI * PI * 2.0 * 0.25) - 1.0).abs() < 1e-3);
}

#[test]
fn shapes_with_invalid_sizes_are_refused() {
    for error in [
        primitive::box_([1.0, 0.0, 1.0]),
        primitive::box_([1.0, f64::NAN, 1.0]),
        primitive::plane([f64::INFINITY, 1.0]),
        primitive::sphere(-1.0, 2),
        primitive::sphere(1.0, 10),
        primitive::cylinder(1.0, 1.0, 2),
        primitive::cone(1.0, 1.0, 5000),
        primitive::torus(1.0, 1.0, 16),
        primitive::torus(1.0, 0.5, 2049),
    ] {
        assert!(error.unwrap_err().to_string().contains("expected"));
    }
}

//! Geometry and rays that are difficult for ray tracers.

use crate::support::*;
use raycam_bvh::{BuildError, Bvh, Coherence, ExactHit, ExactRay, ExactTriangles, Hit, INVALID_ID, Ray, Scene};

fn one(scene: &Scene, origin: [f32; 3], direction: [f32; 3]) -> Hit {
    let mut hit = [Hit::MISS];
    scene.closest(&[Ray { origin, direction, t_max: f32::INFINITY }], &mut hit, Coherence::Unknown);
    hit[0]
}

#[test]
fn empty_scenes_return_misses() {
    let empty = Mesh { vertices: vec![], triangles: vec![] };
    assert_eq!(one(&empty.scene(), [0.0; 3], [0.0, 0.0, 1.0]), Hit::MISS);
    let nothing = Scene::build(vec![], [0.0; 3]).unwrap();
    assert_eq!(one(&nothing, [0.0; 3], [0.0, 0.0, 1.0]), Hit::MISS);
}

#[test]
fn errors_of_invalid_meshes_contain_the_index() {
    let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, f32::NAN, 0.0]];
    let built = Bvh::build(&vertices, &[[0, 1, 2]]);
    assert_eq!(built.unwrap_err(), BuildError::NonFinite { what: "vertex 2".into() });
    let built = Bvh::build(&vertices[..2], &[[0, 1, 0], [0, 1, 9]]);
    assert_eq!(built.unwrap_err(), BuildError::IndexOutOfRange { triangle: 1, index: 9, vertices: 2 });
}

#[test]
fn rays_without_direction_return_misses() {
    let scene = sphere(8, &mut Rng(6)).scene();
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    for x in odd {
        for axis in 0..3 {
            let mut v = [0.1, 0.2, 0.3];
            v[axis] = x;
            assert_eq!(one(&scene, v, [0.0, 0.0, 1.0]), Hit::MISS);
            assert_eq!(one(&scene, [0.0; 3], v), Hit::MISS);
        }
    }
    assert_eq!(one(&scene, [0.0; 3], [0.0; 3]), Hit::MISS);
    for t_max in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        let mut hit = [Hit::MISS];
        let ray = Ray { origin: [0.0; 3], direction: [0.0, 0.0, 1.0], t_max };
        scene.closest(&[ray], &mut hit, Coherence::Unknown);
        assert_eq!(hit[0], Hit::MISS);
    }
    // Directions of any length are valid.
    for scale in [1e-42, 1e-30, 1.0, 1e30, 3e38] {
        let hit = one(&scene, [0.0; 3], [scale, 0.3 * scale, 0.2 * scale]);
        assert_ne!(hit.triangle, INVALID_ID, "{scale}");
    }
}

#[test]
fn flat_triangles_are_kept_but_never_hit() {
    let mut mesh = sphere(8, &mut Rng(7));
    let solid = mesh.triangles.len() as u32;
    for i in 0..1000 {
        mesh.triangles.push([i % 50, (i + 3) % 50, i % 50]);
        mesh.triangles.push([i % 50; 3]);
    }
    let bvh = mesh.build();
    assert_eq!(bvh.triangle_count(), mesh.triangles.len());
    let scene = mesh.scene();
    for v in &mesh.vertices {
        let hit = one(&scene, [0.0; 3], *v);
        assert!(hit.triangle < solid, "{hit:?}");
    }
}

/// The triangle's corners are collinear, but float64 arithmetic relative to the first corner gives a nonzero area.
#[test]
fn rounding_does_not_make_flat_triangles_hittable() {
    let line = [-3.404_480_2, -3.404_479_7, -3.404_479];
    let mesh = Mesh { vertices: line.map(|y| [-16.090_368, y, 17.793_077]).to_vec(), triangles: vec![[0, 1, 2]] };
    let (scene, world) = (mesh.scene(), World::of(&mesh));
    let mut rng = Rng(13);
    for _ in 0..10_000 {
        let from = rng.vector().map(f64::from);
        let target = world.corners(0, 0)[rng.below(3)];
        let ray = ExactRay {
            origin: std::array::from_fn(|i| target[i] + from[i]),
            direction: from.map(|x| -x),
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let mut hit = [ExactHit::MISS];
        scene.closest_exact(&[ray], &world, &mut hit);
        assert_eq!(hit[0], ExactHit::MISS, "{ray:?}");
    }
}

#[test]
fn rays_hit_duplicate_triangles_and_triangles_with_equal_centroids() {
    let n = 200_000;
    let copies = Mesh { vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], triangles: vec![[0, 1, 2]; n] };
    let hit = one(&copies.scene(), [0.2, 0.2, 1.0], [0.0, 0.0, -1.0]);
    assert_eq!((hit.t, hit.triangle), (1.0, 0));
    // Nested squares around one centre, each slightly larger.
    let mut nested = Mesh { vertices: vec![], triangles: vec![] };
    for i in 0..20_000u32 {
        let r = 1.0 + i as f32 * 1e-3;
        nested.vertices.extend([[-r, -r, 0.0], [r, -r, 0.0], [r, r, 0.0], [-r, r, 0.0]]);
        nested.triangles.extend([[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]);
    }
    let hit = one(&nested.scene(), [15.0005, 14.0, 1.0], [0.0, 0.0, -1.0]);
    assert_eq!((hit.t, hit.triangle), (1.0, 2 * 14_001));
}

#[test]
fn rays_hit_meshes_of_extreme_extents() {
    for scale in [1e-36f32, 1e-20, 1e-6, 1.0, 1e6, 1e20, 1e37] {
        let mut mesh = sphere(12, &mut Rng(8));
        mesh.vertices.iter_mut().for_each(|v| *v = v.map(|x| x * scale));
        let scene = mesh.scene();
        for v in &mesh.vertices {
            let hit = one(&scene, [0.0; 3], v.map(|x| x / scale));
            assert!((hit.t / scale - 1.0).abs() < 1e-4, "{scale}: {hit:?}");
        }
    }
    // Exponentially shrinking triangles: the heuristic alone would create a tree as deep as there are triangles.
    let mut mesh = Mesh { vertices: vec![], triangles: vec![] };
    for i in 0..120u32 {
        let r = 0.5f32.powi(i as i32);
        mesh.vertices.extend([[r, 0.0, 0.0], [r, r, 0.0], [r, 0.0, r]]);
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let scene = mesh.scene();
    let hit = one(&scene, [-1.0, 0.1, 0.1], [1.0, 0.0, 0.0]);
    assert_eq!(hit.triangle, 2, "{hit:?}");
}

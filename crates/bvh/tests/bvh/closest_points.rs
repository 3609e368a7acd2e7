//! Closest points of placed meshes compared with every triangle.

use crate::support::{Mesh, Rng, soup, sphere};
use raycam_bvh::{
    ClosestPoint, ExactTriangles, INVALID_ID, Instance, InstructionSet, Scene, squared_distance_to_triangle,
};

/// Meshes, each with a float32 transform to the scene.
struct Placed(Vec<(Mesh, [[f32; 4]; 3])>);

impl Placed {
    fn scene(&self) -> Scene {
        let instance = |(mesh, place): &(Mesh, _)| Instance { bvh: mesh.build(), world_from_mesh: *place };
        Scene::build(self.0.iter().map(instance).collect(), [0.0; 3]).unwrap()
    }

    /// The smallest squared distance and the triangles at this distance, by brute force.
    fn brute(&self, point: [f64; 3]) -> (f64, Vec<(u32, u32)>) {
        let mut best = (f64::INFINITY, vec![]);
        for (instance, (mesh, _)) in self.0.iter().enumerate() {
            for triangle in 0..mesh.triangles.len() as u32 {
                let distance = squared_distance_to_triangle(point, self.corners(instance as u32, triangle));
                if distance < best.0 {
                    best = (distance, vec![]);
                }
                if distance == best.0 && distance < f64::INFINITY {
                    best.1.push((instance as u32, triangle));
                }
            }
        }
        best
    }

    /// Cosine between a triangle's normal and the direction from a point on it to another point.
    fn cosine(&self, (instance, triangle): (u32, u32), on: [f64; 3], point: [f64; 3]) -> f64 {
        let [a, b, c] = self.corners(instance, triangle);
        let sub = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| p[k] - q[k]) };
        let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let (e, f, towards) = (sub(b, a), sub(c, a), sub(point, on));
        let normal: [f64; 3] = std::array::from_fn(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            e[i] * f[j] - e[j] * f[i]
        });
        let product = dot(normal, towards);
        if product == 0.0 { 0.0 } else { product / (dot(normal, normal) * dot(towards, towards)).sqrt() }
    }
}

impl ExactTriangles for Placed {
    fn corners(&self, instance: u32, triangle: u32) -> [[f64; 3]; 3] {
        let (mesh, place) = &self.0[instance as usize];
        mesh.triangles[triangle as usize].map(|vertex| {
            let at = mesh.vertices[vertex as usize].map(f64::from);
            place.map(|[x, y, z, w]| f64::from(x) * at[0] + f64::from(y) * at[1] + f64::from(z) * at[2] + f64::from(w))
        })
    }
}

#[test]
fn closest_points_match_brute_force_on_every_instruction_set() {
    let mut rng = Rng(11);
    let turned = [[0.8, -0.6, 0.0, 2.0], [0.06, 0.08, 1.5, -1.0], [0.3, 0.4, 0.0, 0.5]];
    let moved = [[1.0, 0.0, 0.0, -3.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]];
    // The inverse transform increases the length of some vectors by a larger factor than their largest coordinate.
    let skewed = [[0.4, -0.4, 1.0, 4.0], [-0.9, -0.8, 0.0, 0.0], [-0.2, 0.3, -0.1, 0.0]];
    let world = Placed(vec![
        (sphere(12, &mut rng), turned),
        (soup(200, 0.3, &mut rng), skewed),
        (soup(60, 0.3, &mut rng), moved),
        (soup(60, 0.001, &mut rng), turned),
    ]);
    let mut points: Vec<[f64; 3]> = (0..400).map(|_| rng.vector().map(|x| 4.0 * f64::from(x))).collect();
    // Points on corners, far away, and outside the range of float32.
    points.extend((0..60).map(|i| world.corners(0, i)[0]));
    points.extend([[1e5, 2e5, -3e5], [1e12, 0.0, 0.0], [0.0, 1e30, 1e30], [0.0, f64::NAN, 0.0]]);
    let expected: Vec<_> = points.iter().map(|point| world.brute(*point)).collect();
    let mut scene = world.scene();
    let mut answers: Option<Vec<ClosestPoint>> = None;
    let mut ties = 0;
    for isa in InstructionSet::ALL.into_iter().filter(|isa| isa.is_available()) {
        assert!(scene.set_instruction_set(isa));
        let mut found = vec![ClosestPoint::MISS; points.len()];
        scene.closest_points(&points, &[f64::INFINITY], &world, None, &mut found);
        for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let (squared, tied) = expected;
            assert_eq!(found.distance, squared.sqrt(), "{isa:?}, {:?}", points[i]);
            let chosen = (found.instance, found.triangle);
            assert_eq!(tied.contains(&chosen), found.instance != INVALID_ID, "{isa:?}, {:?}", points[i]);
            let cosine = |of: (u32, u32)| world.cosine(of, found.position, points[i]);
            for &other in tied {
                let (own, others) = (cosine(chosen), cosine(other));
                let is_first = own > others - 2e-9 && ((own - others).abs() > 1e-12 || chosen <= other);
                assert!(is_first, "{isa:?}, {:?}: {chosen:?} ({own}), {other:?} ({others})", points[i]);
            }
            ties += usize::from(tied.len() > 1);
        }
        let bits = |all: &[ClosestPoint]| all.iter().map(|found| found.position.map(f64::to_bits)).collect::<Vec<_>>();
        let first = answers.get_or_insert_with(|| found.clone());
        assert_eq!(bits(first), bits(&found), "{isa:?}");
    }
    assert!(ties > 50, "{ties}");
}

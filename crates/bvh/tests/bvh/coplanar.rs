//! If surfaces of several instances are coplanar, rays hit the surface of the last instance, in every order of
//! traversal.

use crate::support::*;
use raycam_bvh::{Coherence, ExactHit, ExactRay, ExactTriangles, Hit, Ray, Scene};

/// A square in the plane z = `height`, divided into `cells` x `cells` cells, so that coplanar squares have different
/// triangles.
fn square(size: f64, cells: usize, height: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let grid = grid(cells);
    let at = |x: f32| size * (f64::from(x) / cells as f64 - 0.5);
    (grid.vertices.iter().map(|&[x, y, _]| [at(x), at(y), height]).collect(), grid.triangles)
}

/// A tilted plane with three coplanar squares, the last of which is the smallest, and a square above the plane.
fn world() -> World {
    // A rotation about an axis that is not a coordinate axis, so that rounding differs between instances.
    let (sin, cos) = 0.7f64.sin_cos();
    let turn = [[cos, -sin * 0.6, sin * 0.8, 3.0], [sin, cos * 0.6, -cos * 0.8, -2.0], [0.0, 0.8, 0.6, 1.0]];
    let squares = [square(2.0, 7, 0.0), square(6.0, 3, 0.0), square(1.0, 5, 0.0), square(4.0, 2, 1e-4)];
    let instances = squares.map(|(vertices, triangles)| (vertices, triangles, turn));
    World { instances: instances.into(), origin: [0.0; 3] }
}

/// The same instances, merged into one tree.
fn flattened(world: &World) -> Scene {
    let (mut vertices, mut triangles, mut firsts) = (vec![], vec![], vec![]);
    for (i, (_, own, _)) in world.instances.iter().enumerate() {
        firsts.push(triangles.len() as u32);
        for k in 0..own.len() {
            let first = vertices.len() as u32;
            let corners = world.corners(i as u32, k as u32);
            vertices.extend(corners.map(|corner| corner.map(|x| x as f32)));
            triangles.push([first, first + 1, first + 2]);
        }
    }
    Scene::flattened(&vertices, &triangles, firsts, [0.0; 3]).unwrap()
}

/// Rays from below towards random points of the largest square, most of them at grazing angles. Each ray is returned
/// with the instance that it must hit: the last instance at this point of the plane.
fn rays_from_below(world: &World) -> Vec<(ExactRay, u32)> {
    let mut rng = Rng(7);
    let (_, _, matrix) = world.instances[1];
    let place = |p: [f64; 3]| matrix.map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3]);
    let mut rays = vec![];
    while rays.len() < 4000 {
        let [x, y, _] = rng.vector().map(|x| 3.0 * f64::from(x));
        let [a, b, c] = rng.vector().map(f64::from);
        // Near the border of a square, the rounding of the ray decides whether it hits, so such points are skipped.
        let border = |size: f64| (x.abs().max(y.abs()) - size / 2.0).abs() < 1e-4;
        if border(1.0) || border(2.0) || border(6.0) {
            continue;
        }
        let expected = if x.abs().max(y.abs()) < 0.5 { 2 } else { 1 };
        let from = place([x + 8.0 * a, y + 8.0 * b, -0.2 - c.abs()]);
        let (from, to) = (from.map(|x| f64::from(x as f32)), place([x, y, 0.0]));
        let direction = std::array::from_fn(|axis| f64::from((to[axis] - from[axis]) as f32));
        rays.push((ExactRay { origin: from, direction, t_min: 0.0, t_max: f64::INFINITY }, expected));
    }
    rays
}

/// Rays that cross the plane inside the square of two metres, by brute force.
fn rays_of_overlap(world: &World, rays: &[ExactRay]) -> Vec<u32> {
    let crosses = |ray: &ExactRay| {
        let triangles = 0..world.instances[0].1.len() as u32;
        triangles.into_iter().any(|k| intersect(ray, world.corners(0, k)).is_some())
    };
    (0..rays.len() as u32).filter(|&i| crosses(&rays[i as usize])).collect()
}

#[test]
fn rays_hit_the_last_of_coplanar_instances_with_every_instruction_set() {
    let world = world();
    let (rays, expected): (Vec<_>, Vec<_>) = rays_from_below(&world).into_iter().unzip();
    let local = |ray: &ExactRay| Ray {
        origin: ray.origin.map(|x| x as f32),
        direction: ray.direction.map(|x| x as f32),
        t_max: f32::INFINITY,
    };
    let float: Vec<Ray> = rays.iter().map(local).collect();
    let mut known: Option<Vec<ExactHit>> = None;
    for isa in available() {
        for mut scene in [world.scene(), flattened(&world)] {
            assert!(scene.set_instruction_set(isa));
            let mut hits = vec![ExactHit::MISS; rays.len()];
            let ties = scene.closest_exact(&rays, &world, &mut hits);
            let known = known.get_or_insert_with(|| hits.clone());
            assert_eq!(&hits, known, "{isa:?}");
            let wrong = (0..rays.len()).filter(|&i| hits[i].instance != expected[i]).count();
            assert_eq!(wrong, 0, "{isa:?}");
            let overlaps = rays_of_overlap(&world, &rays);
            let tied: Vec<u32> = ties.iter().map(|tie| tie.ray).collect();
            assert_eq!(tied, overlaps, "{isa:?}");
            let inside = ties.iter().filter(|tie| tie.is_coplanar).count();
            assert!(inside > tied.len() * 9 / 10, "{isa:?}: {inside} of {}", tied.len());
            assert!(overlaps.len() > 300);
            for coherence in [Coherence::Unknown, Coherence::Coherent, Coherence::Incoherent] {
                let mut found = vec![Hit::MISS; rays.len()];
                let mut marked = scene.closest(&float, &mut found, coherence);
                marked.sort_unstable();
                let unmarked = tied.iter().filter(|i| marked.binary_search(i).is_err()).count();
                assert_eq!(unmarked, 0, "{isa:?} {coherence:?}");
            }
        }
    }
}

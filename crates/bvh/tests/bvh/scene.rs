//! These tests compare queries with float64 brute force and with each other.

use crate::support::*;
use raycam_bvh::{Coherence, ExactHit, ExactRay, ExactTriangles, Hit, HitDetail, INVALID_ID, Instance, Ray, Scene};

fn closest(scene: &Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    scene.closest(rays, &mut hits, Coherence::Unknown);
    hits
}

fn exact_hits(scene: &Scene, rays: &[ExactRay], world: &World) -> Vec<ExactHit> {
    let mut hits = vec![ExactHit::MISS; rays.len()];
    scene.closest_exact(rays, world, &mut hits);
    hits
}

/// Random transforms: rotation, shear, mirroring and translation.
fn transforms(rng: &mut Rng, n: usize, spread: f64) -> Vec<[[f64; 4]; 3]> {
    (0..n)
        .map(|_| {
            std::array::from_fn(|_| {
                let [x, y, z] = rng.vector().map(f64::from);
                [x, y, z, spread * f64::from(rng.signed())]
            })
        })
        .collect()
}

#[test]
fn closest_hits_match_brute_force_up_to_rounding() {
    let mut rng = Rng(1);
    for (n, size) in [(1, 1.0), (7, 0.7), (100, 0.3), (3000, 0.05)] {
        let mesh = soup(n, size, &mut rng);
        let (world, scene) = (World::of(&mesh), mesh.scene());
        let rays = rays(2000, 1.2, &mut rng);
        let mut met = 0;
        for (ray, hit) in rays.iter().zip(closest(&scene, &rays)) {
            let (t, _, triangle, next) = world.nearest(&exact(ray));
            met += u32::from(triangle != INVALID_ID);
            if next - t > 1e-5 && hit.triangle != triangle {
                // Only rays that graze an edge may have different answers.
                let other = world.nearest(&ExactRay { t_max: f64::INFINITY, ..exact(ray) });
                panic!("{n} triangles, {ray:?}: {hit:?}, brute force {triangle} at {t}, {other:?}");
            }
            if hit.triangle == triangle && triangle != INVALID_ID {
                assert!((f64::from(hit.t) - t).abs() <= 2e-6 * (1.0 + t), "{hit:?} {t}");
            }
        }
        assert!(met > 50, "{met} of 2000 rays met {n} triangles");
    }
}

#[test]
fn occlusion_matches_closest_hits() {
    let mut rng = Rng(2);
    let mesh = soup(2000, 0.1, &mut rng);
    let scene = mesh.scene();
    let rays = rays(20_000, 1.2, &mut rng);
    let mut occluded = vec![false; rays.len()];
    scene.occluded(&rays, &mut occluded, Coherence::Unknown);
    for (hit, occluded) in closest(&scene, &rays).iter().zip(occluded) {
        assert_eq!(hit.triangle != INVALID_ID, occluded);
    }
}

#[test]
fn hits_on_instances_match_brute_force() {
    let mut rng = Rng(3);
    for offset in [0.0, 1e6] {
        let instances = transforms(&mut rng, 9, 3.0).into_iter().map(|mut matrix| {
            matrix.iter_mut().for_each(|row| row[3] += offset);
            let mesh = sphere(9, &mut rng);
            (mesh.vertices.iter().map(|v| v.map(|x| f64::from(x) + 1e-9)).collect(), mesh.triangles, matrix)
        });
        let world = World { instances: instances.collect(), origin: [offset; 3] };
        let scene = world.scene();
        let rays = rays(4000, 4.0, &mut rng);
        let exact: Vec<_> = rays
            .iter()
            .map(|r| {
                let mut e = exact(r);
                e.origin.iter_mut().for_each(|x| *x += offset);
                e
            })
            .collect();
        let (near, far) = (closest(&scene, &rays), exact_hits(&scene, &exact, &world));
        let mut differ = 0;
        for i in 0..rays.len() {
            let (t, instance, triangle, next) = world.nearest(&exact[i]);
            if next - t > 1e-9 * t || next.is_infinite() {
                assert_eq!(
                    (far[i].instance, far[i].triangle),
                    (instance, triangle),
                    "ray {i}: {:?} {t} {next}",
                    far[i]
                );
            }
            differ += u32::from((near[i].instance, near[i].triangle) != (instance, triangle));
        }
        assert!(differ <= 4, "{differ} float32 answers differ");
    }
}

#[test]
fn exact_hits_match_brute_force_far_from_the_origin() {
    let mut rng = Rng(4);
    for (offset, back) in [(0.0, 0.0), (1e6, 0.0), (-3e4, 1e5), (0.0, 1e9)] {
        let mesh = soup(800, 0.2, &mut rng);
        let mut world = World::of(&mesh);
        world.origin = [offset; 3];
        for v in &mut world.instances[0].0 {
            *v = v.map(|x| x * 1.000_000_1);
        }
        (0..3).for_each(|a| world.instances[0].2[a][3] += offset);
        let scene = world.scene();
        let rays: Vec<_> = rays(3000, 1.2, &mut rng)
            .iter()
            .map(|r| {
                let mut e = exact(r);
                for a in 0..3 {
                    e.origin[a] += offset - back * e.direction[a];
                }
                e.t_max += back;
                e
            })
            .collect();
        for (ray, hit) in rays.iter().zip(exact_hits(&scene, &rays, &world)) {
            let (t, _, triangle, next) = world.nearest(ray);
            if next - t > 1e-9 * t {
                assert_eq!(hit.triangle, triangle, "{ray:?} {hit:?} {t} {next}");
            }
        }
    }
}

/// Rays end just before a surface, so close that float32 cannot distinguish the surface's t from t_max. They are traced
/// in packets and individually.
#[test]
fn surfaces_just_behind_the_end_of_a_ray_are_neither_hit_nor_counted() {
    let mut rng = Rng(21);
    let mesh = sphere(12, &mut rng);
    let (world, scene) = (World::of(&mesh), mesh.scene());
    let aimed: Vec<ExactRay> = (0..600)
        .map(|i| {
            let target = rng.vector().map(|x| 0.3 * f64::from(x));
            let spread = if i < 300 { 0.01 } else { 1.0 };
            let origin = rng.vector().map(|x| 2.0 + spread * f64::from(x));
            let direction = std::array::from_fn(|a| target[a] - origin[a]);
            ExactRay { origin, direction, t_min: 0.0, t_max: f64::INFINITY }
        })
        .collect();
    let mut hits = vec![ExactHit::MISS; aimed.len()];
    scene.closest_exact_with(&aimed, &world, None, HitDetail::Refined, &mut hits);
    for (relative, expected) in [(1e-12, false), (1e-9, false), (1e-6, false), (2e-5, false), (-1e-12, true)] {
        let end = |(ray, hit): (&ExactRay, &ExactHit)| ExactRay { t_max: hit.t * (1.0 - relative), ..*ray };
        let rays: Vec<ExactRay> = aimed.iter().zip(&hits).map(end).collect();
        for batch in [1, 3, 64, 600] {
            for rays in rays.chunks(batch) {
                let (mut occluded, mut counts) = (vec![false; rays.len()], vec![0; rays.len()]);
                scene.occluded_exact(rays, &world, None, &mut occluded);
                scene.count_crossings(rays, &world, None, false, &mut counts);
                let hit = exact_hits(&scene, rays, &world);
                for i in 0..rays.len() {
                    let found = (occluded[i], counts[i] > 0, hit[i].triangle != INVALID_ID);
                    assert_eq!(found, (expected, expected, expected), "{:?} at {relative}", rays[i]);
                }
            }
        }
    }
}

#[test]
fn fields_of_exact_hits_do_not_depend_on_the_requested_detail() {
    let mut rng = Rng(22);
    let meshes = [soup(400, 0.3, &mut rng), sphere(10, &mut rng)];
    for mesh in meshes {
        let (world, scene) = (World::of(&mesh), mesh.scene());
        let rays: Vec<ExactRay> = rays(2000, 1.2, &mut rng).iter().map(exact).collect();
        let with = |detail: HitDetail| {
            let mut hits = vec![ExactHit::MISS; rays.len()];
            scene.closest_exact_with(&rays, &world, None, detail, &mut hits);
            hits
        };
        let plain = with(HitDetail::Intersection);
        let mut refined = plain.clone();
        scene.refine(&rays, &world, &mut refined);
        assert_eq!(with(HitDetail::Refined), refined);
        let (ids, sides) = (with(HitDetail::Triangle), with(HitDetail::Side));
        for (i, hit) in plain.iter().enumerate() {
            assert_eq!((ids[i].instance, ids[i].triangle), (hit.instance, hit.triangle));
            assert_eq!((sides[i].normal, sides[i].side), (hit.normal, hit.side));
        }
    }
}

/// The normal (b - a) x (c - a) of the triangle a, b, c.
fn normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let edge = |to: [f64; 3]| -> [f64; 3] { std::array::from_fn(|x| to[x] - a[x]) };
    let (e, f) = (edge(b), edge(c));
    [[1, 2], [2, 0], [0, 1]].map(|[y, z]| e[y] * f[z] - e[z] * f[y])
}

/// Rays from one eye point are traced in packets if possible. The eye points are near and far; some rays are aimed at
/// corners and edges.
#[test]
fn exact_packets_match_brute_force() {
    let mut rng = Rng(11);
    for (offset, distance) in [(0.0, 0.3), (0.0, 2.0), (1e6, 6.0), (0.0, 40.0), (-3e4, 1e7)] {
        for mesh in [soup(300, 0.3, &mut rng), sphere(8, &mut rng)] {
            let mut world = World::of(&mesh);
            world.origin = [offset; 3];
            for v in &mut world.instances[0].0 {
                *v = v.map(|x| x * 1.000_000_1 + offset);
            }
            let local = Mesh {
                vertices: mesh.vertices.iter().map(|v| v.map(|x| (f64::from(x) * 1.000_000_1) as f32)).collect(),
                triangles: mesh.triangles.clone(),
            };
            let instance = Instance { bvh: local.build(), world_from_mesh: IDENTITY };
            let scene = Scene::build(vec![instance], world.origin).unwrap();
            let away = rng.vector().map(|x| f64::from(x) + 0.1);
            let length = away.iter().map(|x| x * x).sum::<f64>().sqrt();
            let eye: [f64; 3] = std::array::from_fn(|a| offset + distance * away[a] / length);
            let rays: Vec<_> = (0..1500)
                .map(|i| {
                    let k = rng.below(mesh.triangles.len()) as u32;
                    let [a, b, c] = world.corners(0, k);
                    let (u, v) = match i % 3 {
                        // The ray passes closer to a corner or an edge than float32 can resolve.
                        0 => (1e-6 * f64::from(rng.signed()), 1e-6 * f64::from(rng.signed())),
                        1 => (0.5, 1e-6 * f64::from(rng.signed())),
                        _ => (f64::from(rng.signed()), f64::from(rng.signed())),
                    };
                    let target: [f64; 3] = std::array::from_fn(|x| a[x] + u * (b[x] - a[x]) + v * (c[x] - a[x]));
                    ExactRay {
                        origin: eye,
                        direction: std::array::from_fn(|x| target[x] - eye[x]),
                        t_min: 0.0,
                        t_max: if i % 7 == 0 { 0.99 } else { f64::INFINITY },
                    }
                })
                .collect();
            for (ray, hit) in rays.iter().zip(exact_hits(&scene, &rays, &world)) {
                let (t, _, triangle, next) = world.nearest(ray);
                if next - t > 1e-9 * t || t == f64::INFINITY {
                    assert_eq!(hit.triangle, triangle, "{ray:?} {hit:?} {t} {next}");
                }
                let normal = match hit.triangle {
                    INVALID_ID => [0.0; 3],
                    triangle => normal(world.corners(hit.instance, triangle)),
                };
                assert_eq!(hit.normal, normal, "{ray:?}");
            }
        }
    }
}

/// Rays from one eye point among transformed instances.
#[test]
fn exact_packets_on_instances_match_brute_force() {
    let mut rng = Rng(12);
    let meshes = [soup(60, 0.3, &mut rng), sphere(6, &mut rng)];
    for (offset, distance) in [(0.0, 0.2), (1e5, 3.0), (0.0, 200.0)] {
        let instances = transforms(&mut rng, 12, 1.5).into_iter().enumerate();
        let world = World {
            instances: instances
                .map(|(i, mut matrix)| {
                    let mesh = &meshes[i % 2];
                    (0..3).for_each(|a| matrix[a][3] += offset);
                    let vertices = mesh.vertices.iter().map(|v| v.map(f64::from));
                    (vertices.collect(), mesh.triangles.clone(), matrix)
                })
                .collect(),
            origin: [offset; 3],
        };
        let scene = world.scene();
        let away = [0.6, -0.48, 0.64];
        let eye: [f64; 3] = std::array::from_fn(|a| offset + distance * away[a]);
        let mut rays = vec![];
        // Most tiles contain rays with similar directions; some contain rays with different directions.
        for tile in 0..40u32 {
            let at = world.corners(tile % 12, rng.below(60) as u32)[0];
            let wide = [1e-3, 0.05, 0.4, 3.0][tile as usize % 4];
            for k in 0..64 {
                let target = at.map(|x| x + wide * f64::from(rng.signed()));
                rays.push(ExactRay {
                    origin: eye,
                    direction: std::array::from_fn(|x| target[x] - eye[x]),
                    t_min: 0.0,
                    t_max: if k % 7 == 0 { 0.99 } else { f64::INFINITY },
                });
            }
        }
        let mut met = 0;
        for (ray, hit) in rays.iter().zip(exact_hits(&scene, &rays, &world)) {
            let (t, instance, triangle, next) = world.nearest(ray);
            met += u32::from(t.is_finite());
            if next - t > 1e-9 * t || t == f64::INFINITY {
                let found = (hit.instance, hit.triangle);
                assert_eq!(found, (instance, triangle), "{ray:?} {hit:?} {t} {next}");
            }
        }
        assert!(met > 800, "{met}");
    }
}

#[test]
fn ties_return_the_smallest_triangle_of_the_first_instance_in_float32_and_of_the_last_in_float64() {
    let mut mesh = grid(8);
    let copies = mesh.triangles.clone();
    mesh.triangles.extend(copies);
    let world = World { instances: vec![(vec![], vec![], [[0.0; 4]; 3]); 3], origin: [0.0; 3] };
    let mut world = world;
    for place in &mut world.instances {
        *place = World::of(&mesh).instances.remove(0);
    }
    let scene = world.scene();
    // Rays through every vertex, edge midpoint and diagonal.
    let rays: Vec<_> = (0..17 * 17)
        .map(|k| Ray {
            origin: [(k % 17) as f32 / 2.0, (k / 17) as f32 / 2.0, 5.0],
            direction: [0.0, 0.0, -1.0],
            t_max: f32::INFINITY,
        })
        .collect();
    let exact: Vec<_> = rays.iter().map(exact).collect();
    for ((ray, hit), far) in rays.iter().zip(closest(&scene, &rays)).zip(exact_hits(&scene, &exact, &world)) {
        let first = (0..mesh.triangles.len() as u32)
            .find(|&k| intersect(&crate::support::exact(ray), world.corners(0, k)).is_some())
            .unwrap();
        assert_eq!((hit.t, hit.instance, hit.triangle), (5.0, 0, first));
        assert_eq!((far.t, far.instance, far.triangle), (5.0, 2, first));
    }
}

#[test]
fn hits_are_bit_identical_for_every_instruction_set() {
    let mut rng = Rng(5);
    let mesh = soup(3000, 0.2, &mut rng);
    let rays = rays(20_000, 1.2, &mut rng);
    let mut scene = mesh.scene();
    let expected = closest(&scene, &rays);
    for isa in available() {
        assert!(scene.set_instruction_set(isa));
        for (i, (a, b)) in expected.iter().zip(closest(&scene, &rays)).enumerate() {
            assert_eq!(*a, b, "ray {i}, {}", isa.name());
        }
    }
}

/// Pinhole rays in tiles of 8 x 8, and shadow rays from their hits to a distant light, to a light among the objects,
/// and along one direction.
fn camera_rays(scene: &Scene, eye: [f32; 3], n: usize) -> [Vec<Ray>; 4] {
    let mut primary = vec![];
    for tile in 0..n * n {
        for k in 0..64 {
            let (x, y) = (tile % n * 8 + k % 8, tile / n * 8 + k / 8);
            let (x, y) = (x as f32 / (8 * n) as f32 - 0.5, y as f32 / (8 * n) as f32 - 0.5);
            primary.push(Ray { origin: eye, direction: [x + 0.013, y + 0.007, -1.0], t_max: f32::INFINITY });
        }
    }
    let hits = closest(scene, &primary);
    let (mut bulbs, mut sun) = ([vec![], vec![]], vec![]);
    for (ray, hit) in primary.iter().zip(&hits).filter(|(_, hit)| hit.instance != INVALID_ID) {
        let origin: [f32; 3] = std::array::from_fn(|a| ray.origin[a] + ray.direction[a] * hit.t * 0.999);
        for (bulb, light) in bulbs.iter_mut().zip([[1.5, 2.5, 4.0], [0.1, 0.15, 1.1]]) {
            bulb.push(Ray { origin, direction: std::array::from_fn(|a| light[a] - origin[a]), t_max: 1.0 });
        }
        sun.push(Ray { origin, direction: [0.3, 0.4, 1.0], t_max: f32::INFINITY });
    }
    let [far, near] = bulbs;
    [primary, far, near, sun]
}

#[test]
fn packets_and_single_rays_give_identical_bits() {
    let mut rng = Rng(9);
    let turned = transforms(&mut rng, 5, 1.0);
    let place = |mesh: &Mesh, matrix: [[f64; 4]; 3]| {
        (mesh.vertices.iter().map(|v| v.map(f64::from)).collect(), mesh.triangles.clone(), matrix)
    };
    let fine = sphere(120, &mut rng);
    let coarse = soup(300, 0.4, &mut rng);
    let many = turned.iter().map(|m| place(&fine, *m)).collect();
    let worlds = [fine.scene(), coarse.scene(), grid(16).scene(), World { instances: many, origin: [0.0; 3] }.scene()];
    for (w, mut scene) in worlds.into_iter().enumerate() {
        for (k, rays) in camera_rays(&scene, [0.1, 0.2, 3.0], 16).iter().enumerate() {
            for isa in available() {
                assert!(scene.set_instruction_set(isa));
                let mut together = vec![Hit::MISS; rays.len()];
                let mut apart = together.clone();
                scene.closest(rays, &mut together, Coherence::Coherent);
                scene.closest(rays, &mut apart, Coherence::Incoherent);
                assert!(
                    k > 0 || apart.iter().any(|hit| hit.instance != INVALID_ID),
                    "scene {w}, rays {k}: no ray hits the scene"
                );
                assert!(together == apart, "scene {w}, rays {k}, {}", isa.name());
                let mut occluded = vec![false; rays.len()];
                for coherence in [Coherence::Coherent, Coherence::Incoherent] {
                    scene.occluded(rays, &mut occluded, coherence);
                    let wrong = occluded.iter().zip(&apart).position(|(d, hit)| *d != (hit.instance != INVALID_ID));
                    assert_eq!(wrong, None, "scene {w}, rays {k}, {} {coherence:?}", isa.name());
                }
            }
        }
    }
}

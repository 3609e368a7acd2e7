//! Ground truth compared with closed forms, and the corresponding colour.

use std::collections::HashSet;

use crate::common::*;
use glam::{DAffine3, DMat3, DVec3};
use raycam_render::queries::fields::{Column, Columns, Field};
use raycam_render::queries::rays::{self as ray_queries, Kernel, RayArrays};
use raycam_render::queries::selection::Selection;
use raycam_render::{Channel, Control, Filter, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::{Camera, Light, Mesh, PixelCenter, Texture, TextureSlot, World, Wrap};

fn settings() -> Settings {
    Settings { channels: all_channels(), ..Settings::default() }
}

#[test]
fn plane_depth_matches_the_closed_form() {
    let world = plane(40.0, 1.0);
    for pixel_center in [PixelCenter::Integer, PixelCenter::Half] {
        // The camera has unequal focal lengths, skew, and a principal point that is not in the middle.
        let k = DMat3::from_cols(DVec3::new(90.0, 0.0, 0.0), DVec3::new(3.0, 70.0, 0.0), DVec3::new(20.0, 50.0, 1.0));
        let eye = DVec3::new(0.3, -2.0, 3.0);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, k, [64, 48], pixel_center).unwrap();
        let frame = render(&world, &camera, &settings());
        for i in 0..64 * 48 {
            let pixel = camera.pixel_center_of(i as u32 % 64, i as u32 / 64);
            let ray = camera.r().transpose() * (k.inverse() * pixel.extend(1.0));
            // The ray's direction vector has the depth 1, and the plane is z = 0.
            let depth = -eye.z / ray.z;
            let position = eye + depth * ray;
            if position.truncate().abs().max_element() > 19.9 || depth < 0.0 {
                continue;
            }
            let found = f64::from(f32s(&frame, Channel::Depth)[i]);
            assert!((found - depth).abs() <= 1e-6 * depth, "{found} {depth}");
            let distance = depth * ray.length();
            let found = f64::from(f32s(&frame, Channel::Distance)[i]);
            assert!((found - distance).abs() <= 1e-6 * distance);
            let found = DVec3::from_slice(&f64s(&frame, Channel::Position)[3 * i..3 * i + 3]);
            assert!((found - position).length() < 1e-12 * distance);
            let (back, in_front) = camera.project(found);
            assert!(in_front && (back - pixel).length() < 1e-9);
            assert_eq!(f32s(&frame, Channel::Normal)[3 * i..3 * i + 3], [0.0, 0.0, 1.0]);
            assert_eq!(i32s(&frame, Channel::Instance)[i], 0);
            let weights = &f32s(&frame, Channel::Barycentric)[3 * i..3 * i + 3];
            let corners = world.meshes[0].triangles[i32s(&frame, Channel::Triangle)[i] as usize];
            let sum: DVec3 =
                (0..3).map(|k| f64::from(weights[k]) * world.meshes[0].vertices[corners[k] as usize]).sum();
            assert!((sum - position).length() < 1e-5);
        }
    }
}

#[test]
fn background_values_differ_from_surfaces() {
    let world = plane(1.0, 1.0);
    let camera = look_at(DVec3::new(0.0, -3.0, 0.5), DVec3::new(0.0, 0.0, 9.0), 20.0, [8, 8]);
    let frame = render(&world, &camera, &settings());
    for channel in [Channel::Depth, Channel::Distance] {
        assert!(f32s(&frame, channel).iter().all(|v| *v == f32::INFINITY));
    }
    assert!(f64s(&frame, Channel::Position).iter().all(|v| v.is_nan()));
    for channel in [Channel::Normal, Channel::Barycentric, Channel::Color] {
        assert!(f32s(&frame, channel).iter().all(|v| *v == 0.0));
    }
    for channel in [Channel::Instance, Channel::Triangle] {
        assert!(i32s(&frame, channel).iter().all(|v| *v == -1));
    }
    assert!(f32s(&frame, Channel::Coverage).iter().all(|v| *v == 1.0));
    let mut lit = world;
    lit.add_light(Light::uniform_sky([0.5, 1.5, 2.5])).unwrap();
    let frame = render(&lit, &camera, &settings());
    assert_eq!(f32s(&frame, Channel::Color)[..3], [0.5, 1.5, 2.5]);
    let frame = render(&World::default(), &camera, &settings());
    assert!(i32s(&frame, Channel::Instance).iter().all(|v| *v == -1));
}

#[test]
fn sphere_depth_and_normals_match_the_closed_form() {
    let mut world = World::default();
    let ball = primitive::sphere(1.0, 6).unwrap();
    add(&mut world, ball, material([1.0; 3], 1.0, 0.0, 1.0), DAffine3::IDENTITY);
    let eye = DVec3::new(2.0, -3.0, 1.0);
    let camera = look_at(eye, DVec3::ZERO, 30.0, [120, 120]);
    let frame = render(&world, &camera, &settings());
    // The ball has 81,920 triangles, with edges of about 0.018 whose middles are up to 5e-5 inside the sphere.
    let mut hits = 0;
    for i in 0..120 * 120 {
        let (_, ray) = camera.ray(camera.pixel_center_of(i as u32 % 120, i as u32 / 120));
        let b = eye.dot(ray);
        let square = b * b - eye.length_squared() + 1.0;
        let hit = i32s(&frame, Channel::Instance)[i] == 0;
        if square.abs() > 1e-3 {
            assert_eq!(hit, square > 0.0);
        }
        if hit && square > 0.05 {
            hits += 1;
            let t = -b - square.sqrt();
            let found = f64::from(f32s(&frame, Channel::Distance)[i]);
            assert!((found - t).abs() < 5e-4, "{found} {t}");
            let normal = f32s(&frame, Channel::Normal)[3 * i..3 * i + 3].iter().map(|v| f64::from(*v));
            let normal = DVec3::from_slice(&normal.collect::<Vec<_>>());
            assert!((normal.length() - 1.0).abs() < 1e-6);
            assert!((normal - (eye + t * ray)).length() < 0.02);
            let (back, _) = camera.project(DVec3::from_slice(&f64s(&frame, Channel::Position)[3 * i..3 * i + 3]));
            assert!((back - camera.pixel_center_of(i as u32 % 120, i as u32 / 120)).length() < 1e-9);
        }
    }
    assert!(hits > 3000, "{hits}");
}

#[test]
fn coverage_equals_the_visible_fraction_of_the_object() {
    // The world is a half plane whose slanted edge crosses the image.
    let edge = |x: f64, y: f64| x + 0.3 * y;
    let world = {
        let mut world = World::default();
        let far = 50.0;
        let vertices = vec![
            DVec3::new(-0.3 * far, far, 0.0),
            DVec3::new(-0.3 * -far, -far, 0.0),
            DVec3::new(far, -far, 0.0),
            DVec3::new(far, far, 0.0),
        ];
        let mesh = Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
        add(&mut world, mesh, material([1.0; 3], 1.0, 0.0, 1.0), DAffine3::IDENTITY);
        world
    };
    // The camera looks straight down with one pixel per unit: pixel (u, v) shows the point (u - 16, 16 - v).
    let k = DMat3::from_cols(DVec3::X * 10.0, DVec3::Y * 10.0, DVec3::new(16.0, 16.0, 1.0));
    let r = DMat3::from_cols(DVec3::X, -DVec3::Y, -DVec3::Z);
    let camera = Camera::new(k, r, DVec3::Z * 10.0, [33, 33], PixelCenter::Integer).unwrap();
    let settings = |filter| Settings {
        samples: 256,
        filter,
        // The channel `error` is not requested, because it would distribute the samples over independent sequences.
        channels: vec![Channel::Color, Channel::Instance, Channel::Coverage],
        ..settings()
    };
    let frame = render(&world, &camera, &settings(Filter::Box));
    for i in 0..33 * 33 {
        let (x, y) = (i as f64 % 33.0 - 16.0, 16.0 - f64::from(i / 33));
        let mut inside = 0;
        for a in 0..64 {
            for b in 0..64 {
                let at = |c: i32| (f64::from(c) + 0.5) / 64.0 - 0.5;
                inside += i32::from(edge(x + at(a), y + at(b)) > 0.0);
            }
        }
        let area = f64::from(inside) / 4096.0;
        let center = i32s(&frame, Channel::Instance)[i as usize] == 0;
        let expected = if center { area } else { 1.0 - area };
        let found = f64::from(f32s(&frame, Channel::Coverage)[i as usize]);
        assert!((found - expected).abs() < 0.02, "pixel {i}: {found}, area {expected}");
        if expected == 1.0 {
            assert_eq!(found, 1.0, "a pure pixel");
        }
        let color = f64::from(f32s(&frame, Channel::Color)[3 * i as usize]);
        assert!((color - area).abs() < 0.02, "the colour is anti-aliased");
    }
    // The wide filter blurs over three pixels and keeps the mean.
    let wide = render(&world, &camera, &settings(Filter::BlackmanHarris));
    let mixed = |frame| f32s(frame, Channel::Coverage).iter().filter(|c| **c < 1.0).count();
    assert!(mixed(&wide) > mixed(&frame) * 3 / 2);
    let mean = |frame| f32s(frame, Channel::Color).iter().map(|c| f64::from(*c)).sum::<f64>();
    assert!((mean(&wide) / mean(&frame) - 1.0).abs() < 0.005);
    // A single sample is at the pixel's centre, so no colours are mixed.
    let one = render(&world, &camera, &Settings { samples: 1, ..settings(Filter::BlackmanHarris) });
    assert!(f32s(&one, Channel::Coverage).iter().all(|c| *c == 1.0));
    assert!(f32s(&one, Channel::Color).iter().all(|c| *c == 0.0 || *c == 1.0));
}

/// Four placements of one mesh, including mirrored and sheared placements, and the same geometry as one mesh without
/// transforms.
fn placed_and_flattened() -> (World, World) {
    let (mut placed, mut flattened) = (World::default(), World::default());
    let mut mesh = primitive::torus(1.0, 0.4, 24).unwrap();
    // The mesh has no vertex normals, because only the placement would transform them, but not the change of the
    // vertices.
    mesh.normals = None;
    let shared = placed.add_mesh(mesh.clone());
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.8, 1.0, 0.0), DVec3::new(0.0, 0.5, 0.6));
    let transforms = [
        DAffine3::from_translation(DVec3::new(-2.0, 0.0, 0.0)) * DAffine3::from_rotation_y(1.0),
        DAffine3::from_translation(DVec3::new(1.0, 1.0, 0.5)) * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 2.0)),
        DAffine3::from_translation(DVec3::new(1.0, -1.0, -0.5)) * DAffine3::from_mat3(shear),
        DAffine3::from_translation(DVec3::new(0.0, 2.0, 1.0)) * DAffine3::from_scale(DVec3::new(0.01, 3.0, 1.0)),
    ];
    for transform in transforms {
        let matte = material([1.0; 3], 1.0, 0.0, 1.0);
        let material = placed.add_material(matte.clone()).unwrap();
        let object = raycam_scene::world::Object::new("", shared, vec![material], transform);
        placed.add_object(object).unwrap();
        let mut flat = mesh.clone();
        flat.vertices.iter_mut().for_each(|v| *v = transform.transform_point3(*v));
        add(&mut flattened, flat, matte, DAffine3::IDENTITY);
    }
    (placed, flattened)
}

#[test]
fn placed_meshes_equal_meshes_with_transformed_vertices() {
    let (placed, flattened) = placed_and_flattened();
    let mut seen = HashSet::new();
    for i in 0..12 {
        let angle = f64::from(i) * 0.55;
        let eye = 6.0 * DVec3::new(angle.cos(), angle.sin(), 0.7 * (2.0 * angle).sin());
        let camera = look_at(eye, DVec3::ZERO, 45.0, [80, 60]);
        let mut settings = settings();
        // Object coordinates differ between the worlds, because they depend on the transform.
        settings.channels.retain(|channel| *channel != Channel::Nocs);
        let (a, b) = (render(&placed, &camera, &settings), render(&flattened, &camera, &settings));
        assert!(bits(&a) == bits(&b));
        seen.extend(i32s(&a, Channel::Instance).iter().copied());
    }
    assert_eq!(seen.len(), 5, "every object and the background are seen");
}

#[test]
fn cast_rays_agrees_with_the_image() {
    let (world, _) = placed_and_flattened();
    let camera = look_at(DVec3::new(3.0, -5.0, 2.0), DVec3::ZERO, 45.0, [80, 60]);
    let frame = render(&world, &camera, &settings());
    let prepared = prepare(&world);
    let rays = (0..80 * 60).map(|i| camera.ray(camera.pixel_center_of(i % 80, i / 80)));
    let (origins, directions): (Vec<_>, Vec<_>) = rays.map(|(o, d)| (o.to_array(), d.to_array())).unzip();
    let cast = |kernel, threads| {
        let rays = RayArrays { kernel, ..all_of(&origins, &directions) };
        Hits::new(ray_queries::cast_rays(&prepared, &rays, &FIELDS, threads, &Control::new()).unwrap())
    };
    let hits = cast(Kernel::Exact, None);
    let exactly = |i: usize| hits.instance[i] == i32s(&frame, Channel::Instance)[i];
    assert!((0..80 * 60).all(exactly), "queries and ground truth are decided by one function");
    let hits = cast(Kernel::Float32 { coherent: None }, None);
    // Float32 and float64 may rarely differ on a silhouette.
    let same: Vec<usize> = (0..80 * 60)
        .filter(|&i| {
            hits.instance[i] == i32s(&frame, Channel::Instance)[i]
                && hits.triangle[i] == i32s(&frame, Channel::Triangle)[i]
        })
        .collect();
    assert!(same.len() >= 80 * 60 - 3, "{}", same.len());
    for i in same {
        let t = f64::from(f32s(&frame, Channel::Distance)[i]);
        if hits.instance[i] < 0 {
            assert_eq!(hits.t[i], f64::INFINITY);
            assert!(hits.position[i].iter().all(|v| v.is_nan()));
            assert_eq!((hits.normal[i], hits.barycentric[i]), ([0.0; 3], [0.0; 3]));
            continue;
        }
        assert!((hits.t[i] - t).abs() <= 1e-6 * t);
        let position = DVec3::from_slice(&f64s(&frame, Channel::Position)[3 * i..3 * i + 3]);
        assert!((DVec3::from(hits.position[i]) - position).length() < 1e-6);
        assert_eq!(hits.normal[i].map(|x| x as f32), f32s(&frame, Channel::Normal)[3 * i..3 * i + 3]);
    }
    for (coherent, threads) in [(Some(true), Some(1)), (Some(false), Some(3))] {
        let other = cast(Kernel::Float32 { coherent }, threads);
        assert_eq!(other.instance, hits.instance);
        assert_eq!(other.t, hits.t);
    }
    assert_eq!(cast(Kernel::Exact, Some(1)).t, cast(Kernel::Exact, Some(3)).t);
}

const FIELDS: [Field; 6] =
    [Field::T, Field::Instance, Field::Triangle, Field::Barycentric, Field::Normal, Field::Position];

/// Fields of hits by name.
struct Hits {
    t: Vec<f64>,
    instance: Vec<i32>,
    triangle: Vec<i32>,
    barycentric: Vec<[f64; 3]>,
    normal: Vec<[f64; 3]>,
    position: Vec<[f64; 3]>,
}

impl Hits {
    fn new(columns: Columns) -> Self {
        let floats = |field| match columns.get(field) {
            Some(Column::Float64(values)) => values.clone(),
            other => panic!("{field:?}: {other:?}"),
        };
        let integers = |field| match columns.get(field) {
            Some(Column::Int32(values)) => values.clone(),
            other => panic!("{field:?}: {other:?}"),
        };
        let vectors = |field| floats(field).as_chunks::<3>().0.to_vec();
        Self {
            t: floats(Field::T),
            instance: integers(Field::Instance),
            triangle: integers(Field::Triangle),
            barycentric: vectors(Field::Barycentric),
            normal: vectors(Field::Normal),
            position: vectors(Field::Position),
        }
    }
}

/// Rays that start at t = 0.
fn all_of<'a>(origins: &'a [[f64; 3]], directions: &'a [[f64; 3]]) -> RayArrays<'a> {
    let selection = Selection::default();
    RayArrays { origins, directions, t_min: &[0.0], t_max: &[f64::INFINITY], kernel: Kernel::Exact, selection }
}

#[test]
fn queries_accept_rays_of_any_length_and_position() {
    let prepared = prepare(&plane(2.0, 1.0));
    let nan = f64::NAN;
    let down = [0.0, 0.0, -1.0];
    let rays = [
        ([0.5, 0.2, 3.0], down, 3.0),
        ([0.5, 0.2, 3.0], [0.0, 0.0, -1e-3], 3000.0),
        ([0.5, 0.2, 3.0], [0.0, 0.0, -1e30], 3e-30),
        ([0.5, 0.2, 3e7], down, 3e7),
        ([0.5e9, 0.2e9, 1e9], [-0.5, -0.2, -1.0], 1e9),
        ([0.5, 0.2, 0.0], down, 0.0),
        ([0.5, 0.2, -3.0], down, f64::INFINITY),
        ([5.0, 0.2, 3.0], down, f64::INFINITY),
        ([0.5, 0.2, 3.0], [0.0; 3], f64::INFINITY),
        ([nan, 0.2, 3.0], down, f64::INFINITY),
        ([0.5, 0.2, 3.0], [0.0, nan, -1.0], f64::INFINITY),
        ([0.5, 0.2, f64::INFINITY], down, f64::INFINITY),
        ([0.5, 0.2, 3.0], [0.0, 0.0, f64::NEG_INFINITY], f64::INFINITY),
        ([1e300, 1e300, 1e300], [-1e300, -1e300, -1e300], 1.0),
    ];
    let origins = rays.map(|ray| ray.0);
    let directions = rays.map(|ray| ray.1);
    let control = Control::new();
    let all = all_of(&origins, &directions);
    let hits = Hits::new(ray_queries::cast_rays(&prepared, &all, &FIELDS, None, &control).unwrap());
    let limit = |factor: f64| {
        let t_max = rays.map(|ray| if ray.2 > 0.0 { ray.2 * factor } else { ray.2 });
        ray_queries::occluded(&prepared, &RayArrays { t_max: &t_max, ..all }, None, &control).unwrap()
    };
    let (beyond, before) = (limit(1.001), limit(0.999));
    for (i, &(_, _, t)) in rays.iter().enumerate().take(rays.len() - 1) {
        let found = hits.t[i];
        assert!(found == t || (found - t).abs() <= 1e-9 * t, "ray {i}: {found}, expected {t}");
        assert_eq!(hits.instance[i] == 0, t.is_finite(), "ray {i}");
        assert_eq!(beyond[i], t.is_finite(), "ray {i}");
        assert_eq!(before[i], t == 0.0, "ray {i}");
    }
    assert_eq!(ray_queries::occluded(&prepared, &all, None, &control).unwrap()[..13], beyond[..13]);
    let error = |rays: RayArrays| ray_queries::occluded(&prepared, &rays, None, &control).unwrap_err().to_string();
    let message = error(RayArrays { directions: &directions[1..], ..all });
    assert!(message.contains("14 origins and 13 directions"), "{message}");
    let message = error(RayArrays { t_max: &[1.0; 3], ..all });
    assert!(message.contains("t_max has 3 values for 14 rays"), "{message}");
    let message = error(RayArrays { t_min: &[nan], ..all });
    assert!(message.contains("t_min[0] is NaN"), "{message}");
    let none = Hits::new(ray_queries::cast_rays(&prepared, &all_of(&[], &[]), &FIELDS, None, &control).unwrap());
    assert!(none.t.is_empty());
    assert!(!hits.t[13].is_nan());
}

#[test]
fn flat_colours_are_exact_products() {
    let size = [4, 2];
    let texels: Vec<[u8; 3]> = (0..8).map(|i| [i * 31, 255 - i * 17, i * i * 5]).collect();
    let mut world = World::default();
    let texture = Texture::from_srgb8("", size, texels.iter().copied(), [Wrap::Clamp; 2]);
    let texture = world.add_texture(texture);
    let mesh = primitive::plane([4.0, 2.0]).unwrap();
    let mut painted = material([1.0; 3], 0.0, 0.0, 1.0);
    painted.texture = Some(TextureSlot::plain(texture));
    add(&mut world, mesh, painted, DAffine3::IDENTITY);
    // The image shows one texel per pixel.
    let k = DMat3::from_cols(DVec3::X * 10.0, DVec3::Y * 10.0, DVec3::new(1.5, 0.5, 1.0));
    let r = DMat3::from_cols(DVec3::X, -DVec3::Y, -DVec3::Z);
    let camera = Camera::new(k, r, DVec3::Z * 10.0, size, PixelCenter::Integer).unwrap();
    let frame = render(&world, &camera, &settings());
    let found = f32s(&frame, Channel::Color).chunks(3);
    let found: Vec<[u8; 3]> = found.map(|c| raycam_scene::color::srgb8_from_linear([c[0], c[1], c[2]])).collect();
    assert_eq!(found, texels);
    // The object, its triangles and its vertices all have colours.
    let mut mesh = primitive::plane([4.0, 2.0]).unwrap();
    mesh.face_colors = Some(vec![[0.5, 1.0, 0.25]; mesh.triangles.len()]);
    let corner = |v: &DVec3| [((v.x + 2.0) / 4.0) as f32, 1.0, 0.5];
    mesh.vertex_colors = Some(mesh.vertices.iter().map(corner).collect());
    let mut world = World::default();
    add(&mut world, mesh, material([1.0, 0.5, 0.5], 0.0, 0.0, 1.0), DAffine3::IDENTITY);
    let frame = render(&world, &camera, &settings());
    for (i, color) in f32s(&frame, Channel::Color).chunks(3).enumerate() {
        let red = 0.5 * ((i % 4) as f32 + 0.5) / 4.0;
        let expected = [red, 0.5, 0.0625];
        assert!((0..3).all(|k| (color[k] - expected[k]).abs() < 1e-6), "{color:?} {expected:?}");
    }
}

//! Small worlds and cameras shared by the tests.
#![allow(dead_code, reason = "each test file uses only some of these functions")]

use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Control, Frame, ImagePlane, PreparedWorld, Settings};
use raycam_scene::camera::intrinsics_from_fov;
use raycam_scene::mesh::primitive;
use raycam_scene::world::Object;
use raycam_scene::{Camera, Light, Material, MaterialModel, Mesh, PixelCenter, World};

/// The material of the lecture's example.
pub fn material(color: [f32; 3], diffuse: f32, specular: f32, shininess: f32) -> Material {
    let specular = [specular; 3];
    let reflectance = MaterialModel::Phong { diffuse, specular, shininess };
    Material { color, model: reflectance, ..Material::default() }
}

/// Adds an object with its own material.
pub fn add(world: &mut World, mesh: Mesh, material: Material, world_from_mesh: DAffine3) -> usize {
    let mesh = world.add_mesh(mesh);
    let material = world.add_material(material).unwrap();
    let object = Object::new("", mesh, vec![material], world_from_mesh);
    world.add_object(object).unwrap()
}

/// A matte plane through the origin, facing up.
pub fn plane(size: f64, albedo: f32) -> World {
    let mut world = World::default();
    let mesh = primitive::plane([size, size]).unwrap();
    add(&mut world, mesh, material([1.0; 3], albedo, 0.0, 1.0), DAffine3::IDENTITY);
    world
}

pub fn look_at(eye: DVec3, target: DVec3, fov: f64, size: [u32; 2]) -> Camera {
    let up = if (target - eye).normalize().z.abs() > 0.99 { DVec3::Y } else { DVec3::Z };
    let k = intrinsics_from_fov(fov, size, PixelCenter::Integer).unwrap();
    Camera::look_at(eye, target, up, k, size, PixelCenter::Integer).unwrap()
}

pub fn prepare(world: &World) -> PreparedWorld {
    PreparedWorld::new(world, None, None, &Control::new()).unwrap()
}

pub fn render(world: &World, camera: &Camera, settings: &Settings) -> Frame {
    raycam_render::render(&prepare(world), camera, settings, &Control::new()).unwrap()
}

pub fn all_channels() -> Vec<Channel> {
    Channel::all().collect()
}

pub fn f32s(frame: &Frame, channel: Channel) -> &[f32] {
    match frame.plane(channel) {
        Some(ImagePlane::F32 { data, .. }) => data,
        other => panic!("{channel:?}: {other:?}"),
    }
}

pub fn f64s(frame: &Frame, channel: Channel) -> &[f64] {
    match frame.plane(channel) {
        Some(ImagePlane::F64 { data, .. }) => data,
        other => panic!("{channel:?}: {other:?}"),
    }
}

pub fn i32s(frame: &Frame, channel: Channel) -> &[i32] {
    match frame.plane(channel) {
        Some(ImagePlane::I32 { data, .. }) => data,
        other => panic!("{channel:?}: {other:?}"),
    }
}

/// Bits of every value in a frame, including NaN: equal bits mean equal bytes.
pub fn bits(frame: &Frame) -> Vec<(Channel, Vec<u64>)> {
    let of = |plane: &ImagePlane| match plane {
        ImagePlane::F32 { data, .. } => data.iter().map(|v| u64::from(v.to_bits())).collect(),
        ImagePlane::F64 { data, .. } => data.iter().map(|v| v.to_bits()).collect(),
        ImagePlane::I32 { data, .. } => data.iter().map(|&v| v as u64).collect(),
    };
    frame.planes.iter().map(|(c, p)| (*c, of(p))).collect()
}

/// Several objects with every kind of colour, light and normal.
pub fn still_life() -> World {
    let mut world = World::default();
    let ground = primitive::plane([12.0, 12.0]).unwrap();
    add(&mut world, ground, material([0.7, 0.6, 0.5], 0.8, 0.0, 1.0), DAffine3::IDENTITY);
    let ball = primitive::sphere(1.0, 3).unwrap();
    let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, 1.0));
    add(&mut world, ball, material([0.8, 0.1, 0.1], 0.7, 0.3, 40.0), place);
    let mut ring = primitive::torus(0.8, 0.25, 32).unwrap();
    ring.normals = None;
    let count = ring.triangles.len();
    ring.face_colors = Some((0..count).map(|i| [i as f32 / count as f32, 0.5, 0.2]).collect());
    let place = DAffine3::from_translation(DVec3::new(-2.0, 0.3, 0.25));
    add(&mut world, ring, material([1.0; 3], 0.9, 0.1, 8.0), DAffine3::from_rotation_x(0.4) * place);
    let sun = Light::Sun { direction: [-1.0, 0.5, -2.0], irradiance: [2.0, 1.9, 1.7], angular_diameter: 0.0 };
    world.add_light(sun).unwrap();
    let bulb = Light::Point { position: [2.0, -2.0, 3.0], power: Some([90.0; 3]), intensity: None, radius: 0.3 };
    world.add_light(bulb).unwrap();
    world.add_light(Light::uniform_sky([0.1, 0.12, 0.2])).unwrap();
    world
}

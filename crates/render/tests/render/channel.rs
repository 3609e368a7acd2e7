//! Channels of surface properties: colours, normals, coordinates, materials and categories.

use std::sync::Arc;

use crate::common::*;
use glam::{DAffine3, DVec3};
use raycam_render::{Channel, Frame, Settings};
use raycam_scene::mesh::primitive;
use raycam_scene::texture::{Image, Texels, TextureSampler, TextureSlot};
use raycam_scene::{Texture, World, Wrap};

fn settings() -> Settings {
    Settings { channels: all_channels(), ..Settings::default() }
}

fn vector(frame: &Frame, channel: Channel, pixel: usize) -> DVec3 {
    let values = &f32s(frame, channel)[3 * pixel..3 * pixel + 3];
    DVec3::new(values[0].into(), values[1].into(), values[2].into())
}

#[test]
fn channel_names_are_unique_and_parse_to_their_channel() {
    for channel in Channel::all() {
        assert_eq!(Channel::from_name(channel.name()), Some(channel));
    }
    assert_eq!(Channel::all().count(), 30);
}

/// Depth and normals of a distant small ball, whose facets are below the sphere by at most 2.5e-7 of the distance.
#[test]
fn sphere_depth_and_normals_match_the_closed_form() {
    let radius = 0.1;
    let mut world = World::default();
    let shift = DVec3::new(4.0, 5.0, -6.0);
    add(
        &mut world,
        primitive::sphere(radius, 6).unwrap(),
        material([1.0; 3], 1.0, 0.0, 1.0),
        DAffine3::from_translation(shift),
    );
    let eye = shift + DVec3::new(12.0, -15.0, 5.0);
    let camera = look_at(eye, shift, 0.6, [100, 100]);
    let frame = render(&world, &camera, &settings());
    let mut hits = 0;
    for i in 0..100 * 100 {
        let (_, ray) = camera.ray(camera.pixel_center_of(i as u32 % 100, i as u32 / 100));
        let b = (eye - shift).dot(ray);
        let square = b * b - (eye - shift).length_squared() + radius * radius;
        // Pixels at the rim are excluded, because a facet's depth differs from the sphere's depth there.
        if square < 0.25 * radius * radius {
            continue;
        }
        hits += 1;
        let distance = -b - square.sqrt();
        let depth = distance * ray.dot(camera.forward());
        for (channel, closed) in [(Channel::Distance, distance), (Channel::Depth, depth)] {
            let found = f64::from(f32s(&frame, channel)[i]);
            assert!((found / closed - 1.0).abs() < 1e-6, "{found} {closed}");
        }
        // A corner's normal is proportional to the corner's position relative to the centre. The interpolated
        // normal is therefore proportional to the interpolated position relative to the centre.
        let at = DVec3::from_slice(&f64s(&frame, Channel::Position)[3 * i..3 * i + 3]);
        let smooth = (at - shift).normalize();
        let shading = vector(&frame, Channel::ShadingNormal, i);
        assert!((shading - smooth).length() < 1e-6, "{shading} {smooth}");
        for (channel, world_channel) in
            [(Channel::NormalCamera, Channel::Normal), (Channel::ShadingNormalCamera, Channel::ShadingNormal)]
        {
            let expected = camera.r() * vector(&frame, world_channel, i);
            assert!((vector(&frame, channel, i) - expected).length() < 1e-6);
            assert!(vector(&frame, channel, i).z < 0.0, "towards the camera");
        }
    }
    assert!(hits > 4000, "{hits}");
}

#[test]
fn channels_of_a_plane_equal_its_normal_uv_albedo_and_material() {
    let mut world = World::default();
    let _unused = world.add_material(material([0.1; 3], 1.0, 0.0, 1.0)).unwrap();
    let mesh = primitive::plane([2.0, 2.0]).unwrap();
    let image = Image::new("two", [2, 1], Texels::Srgb8(vec![[255, 0, 0, 255], [0, 0, 255, 255]]));
    let sampler = TextureSampler { wrap: [Wrap::Clamp; 2], ..TextureSampler::default() };
    let texture = world.add_texture(Texture { image: Arc::new(image), sampler });
    let mut stuff = material([0.5, 1.0, 0.25], 0.8, 0.0, 1.0);
    stuff.texture = Some(TextureSlot::plain(texture));
    let turned = DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 0.5).normalize(), 0.4);
    let id = add(&mut world, mesh, stuff, turned);
    world.objects[id].category = Some("floor".into());
    let camera = look_at(DVec3::new(0.3, -0.5, 4.0), DVec3::ZERO, 40.0, [60, 40]);
    let frame = render(&world, &camera, &settings());
    let normal = turned.transform_vector3(DVec3::Z);
    let (mut inside, mut outside) = (0, 0);
    for i in 0..60 * 40 {
        let uv = &f32s(&frame, Channel::Uv)[2 * i..2 * i + 2];
        let albedo = vector(&frame, Channel::Albedo, i);
        if i32s(&frame, Channel::Instance)[i] == -1 {
            outside += 1;
            assert!(uv.iter().all(|v| v.is_nan()));
            assert_eq!(albedo, DVec3::ZERO);
            assert_eq!(i32s(&frame, Channel::Material)[i], -1);
            assert_eq!(i32s(&frame, Channel::Category)[i], -1);
            assert_eq!(vector(&frame, Channel::ShadingNormalCamera, i), DVec3::ZERO);
            continue;
        }
        inside += 1;
        assert_eq!(i32s(&frame, Channel::Material)[i], 1);
        assert_eq!(i32s(&frame, Channel::Category)[i], 1);
        let at = DVec3::from_slice(&f64s(&frame, Channel::Position)[3 * i..3 * i + 3]);
        let local = turned.inverse().transform_point3(at);
        assert!((f64::from(uv[0]) - (local.x + 1.0) / 2.0).abs() < 1e-6);
        assert!((f64::from(uv[1]) - (1.0 - local.y) / 2.0).abs() < 1e-6);
        assert!((vector(&frame, Channel::Normal, i) - normal).length() < 1e-6);
        // At texel centres nothing is interpolated.
        if uv[0] < 0.25 {
            assert!((albedo - DVec3::new(0.5, 0.0, 0.0)).length() < 1e-6, "{albedo}");
        } else if uv[0] > 0.75 {
            assert!((albedo - DVec3::new(0.0, 0.0, 0.25)).length() < 1e-6, "{albedo}");
        }
    }
    assert!(inside > 500 && outside > 100, "{inside} {outside}");
}

#[test]
fn meshes_without_texture_coordinates_have_nan_coordinates() {
    let mut world = World::default();
    let mut mesh = primitive::plane([9.0, 9.0]).unwrap();
    (mesh.uvs, mesh.normals) = (None, None);
    add(&mut world, mesh, material([1.0; 3], 1.0, 0.0, 1.0), DAffine3::IDENTITY);
    let camera = look_at(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 40.0, [8, 8]);
    let frame = render(&world, &camera, &settings());
    assert!(f32s(&frame, Channel::Uv).iter().all(|v| v.is_nan()));
    assert!(i32s(&frame, Channel::Category).iter().all(|v| *v == -1));
    assert_eq!(f32s(&frame, Channel::ShadingNormal), f32s(&frame, Channel::Normal));
}

use glam::{DAffine3, DVec3, dvec3};
use raycam_render::*;
use raycam_scene::world::Object;
use raycam_scene::{
    Camera, Light, Material, PixelCenter, Reflectance, World, camera, color, primitive,
};
use std::time::Instant;
fn ppm(path: &str, frame: &Frame) {
    let Some(Plane::F32 { data, .. }) = frame.plane(Channel::Color) else {
        panic!()
    };
    let mut out = format!("P6 {} {} 255\n", frame.region[2], frame.region[3]).into_bytes();
    for p in data.chunks(3) {
        out.extend(color::srgb8_from_linear([p[0], p[1], p[2]]));
    }
    std::fs::write(path, out).unwrap();
}
fn material(color: [f32; 3], specular: f32, shininess: f32) -> Material {
    Material {
        name: String::new(),
        color,
        texture: None,
        reflectance: Reflectance::Lecture {
            diffuse: 0.8,
            specular: [specular; 3],
            shininess,
        },
    }
}
fn main() {
    let mut w = World::default();
    let ms = [
        material([0.8, 0.7, 0.6], 0.0, 1.0),
        material([0.8, 0.1, 0.1], 0.2, 40.0),
        material([0.1, 0.4, 0.8], 0.2, 200.0),
        material([0.2, 0.7, 0.2], 0.0, 1.0),
    ];
    for m in ms {
        w.add_material(m).unwrap();
    }
    let pl = w.add_mesh(primitive::plane([20.0, 20.0]).unwrap());
    let sp = w.add_mesh(primitive::sphere(1.0, 2).unwrap());
    let bx = w.add_mesh(primitive::box_([1.0, 1.0, 1.0]).unwrap());
    let to = w.add_mesh(primitive::torus(1.0, 0.3, 48).unwrap());
    w.add_object(Object::new("p", pl, vec![0], DAffine3::IDENTITY))
        .unwrap();
    w.add_object(Object::new(
        "s",
        sp,
        vec![1],
        DAffine3::from_translation(dvec3(0.0, 0.0, 1.0)),
    ))
    .unwrap();
    w.add_object(Object::new(
        "b",
        bx,
        vec![2],
        DAffine3::from_translation(dvec3(2.0, 0.5, 0.5)),
    ))
    .unwrap();
    w.add_object(Object::new(
        "t",
        to,
        vec![3],
        DAffine3::from_translation(dvec3(-2.2, 0.5, 0.3)),
    ))
    .unwrap();
    w.add_light(Light::Sun {
        direction: [-2.0, -1.0, -2.0],
        irradiance: [2.0; 3],
    })
    .unwrap();
    w.add_light(Light::Bulb {
        position: [2.0, -2.0, 3.0],
        power: Some([100.0, 80.0, 50.0]),
        intensity: None,
        radius: 0.3,
    })
    .unwrap();
    w.add_light(Light::Sky {
        radiance: [0.15, 0.18, 0.25],
    })
    .unwrap();
    let size = [640, 480];
    let k = camera::intrinsics_from_fov(40.0, size, PixelCenter::Integer).unwrap();
    let cam = Camera::look_at(
        dvec3(1.0, -7.0, 4.0),
        dvec3(0.0, 0.0, 0.6),
        DVec3::Z,
        k,
        size,
        PixelCenter::Integer,
    )
    .unwrap();
    let c = Control::new();
    let pw = PreparedWorld::new(&w, None, None, &c).unwrap();
    for (name, integrator, samples, ao) in [("flat", Integrator::Flat, 4, None)] {
        let t = Instant::now();
        let f = render(
            &pw,
            &cam,
            &Settings {
                integrator,
                samples,
                ambient_occlusion: ao,
                filter: Filter::BlackmanHarris,
                ..Default::default()
            },
            &c,
        )
        .unwrap();
        println!("{name} {:?} {:?}", t.elapsed(), f.notices);
        ppm(&format!("/tmp/look_{name}.ppm"), &f);
    }
    // speed: 1.3M triangle sphere, bumpy
    let mut m = primitive::sphere(1.0, 8).unwrap();
    println!("{} triangles", m.triangles.len());
    for v in &mut m.vertices {
        let s = 1.0 + 0.02 * (v.x * 40.0).sin() * (v.y * 37.0).sin() * (v.z * 33.0).sin();
        *v *= s;
    }
    m.normals = None;
    m.uvs = None;
    let mut w = World::default();
    w.add_material(material([0.8; 3], 0.0, 1.0)).unwrap();
    let m = w.add_mesh(m);
    w.add_object(Object::new("m", m, vec![0], DAffine3::IDENTITY))
        .unwrap();
    let size = [1024, 768];
    let k = camera::intrinsics_from_fov(40.0, size, PixelCenter::Integer).unwrap();
    let cam = Camera::look_at(
        dvec3(1.0, -2.0, 1.0),
        DVec3::ZERO,
        DVec3::Z,
        k,
        size,
        PixelCenter::Integer,
    )
    .unwrap();
    let t = Instant::now();
    let pw = PreparedWorld::new(&w, None, None, &c).unwrap();
    println!("prepare {:?}", t.elapsed());
    let channels = vec![
        Channel::Color,
        Channel::Depth,
        Channel::Instance,
        Channel::Triangle,
    ];
    for samples in [1, 1] {
        let t = Instant::now();
        let s = Settings {
            channels: channels.clone(),
            samples,
            ..Default::default()
        };
        render(&pw, &cam, &s, &c).unwrap();
        println!("flat {samples} {:?}", t.elapsed());
    }
    let mut o = vec![];
    let mut d = vec![];
    for y in 0..768 {
        for x in 0..1024 {
            let (a, b) = cam.ray(cam.pixel_center_of(x, y));
            o.push(a.to_array());
            d.push(b.to_array());
        }
    }
    for _ in 0..1 {
        let t = Instant::now();
        queries::cast_rays(&pw, &o, &d, Some(true), None, &c).unwrap();
        println!("cast {:?}", t.elapsed());
    }
}

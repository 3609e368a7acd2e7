//! Points that are computed many at a time are what they are alone.

use glam::{DAffine3, Vec3};
use raycam_bvh::{Hit, dispatch_simd};
use raycam_scene::mesh::primitive;
use raycam_scene::{Glass, Material, MaterialModel, Metal, Object, Principled, World};

use crate::bsdf::ShadingPoint;
use crate::bsdf::batch::glossy::GlossyBsdfBatch;
use crate::bsdf::batch::glossy_sample::SampleGlossy;
use crate::bsdf::batch::rough_dielectric::RoughDielectricBsdfBatch;
use crate::bsdf::batch::rough_dielectric_sample::SampleRoughDielectric;
use crate::bsdf::batch::specular::{SampleSpecular, SpecularBsdfBatch};
use crate::bsdf::specular::FORCE_TRANSMISSION;
use crate::bsdf::{BsdfEval, BsdfModel, BsdfSample};
use crate::control::Control;
use crate::interaction::batch::SurfaceInteractions;
use crate::prepare::world::PreparedWorld;
use crate::soa::{LANES, get_lane, set_lane, set_triangle};

/// A ball of each of these.
fn world(reflectances: &[MaterialModel]) -> PreparedWorld {
    let mut world = World::default();
    let ball = world.add_mesh(primitive::sphere(0.5, 2).unwrap());
    for reflectance in reflectances {
        let material = Material {
            model: reflectance.clone(),
            color: [0.9, 0.8, 0.5],
            ..Material::default()
        };
        let material = world.add_material(material).unwrap();
        let object = Object::new("", ball, vec![material], DAffine3::IDENTITY);
        world.add_object(object).unwrap();
    }
    PreparedWorld::new(&world, None, None, &Control::new()).unwrap()
}

fn unit(i: usize) -> Vec3 {
    let angle = i as f32;
    Vec3::new(angle.sin(), angle.cos(), (3.0 * angle).sin()).normalize()
}

/// Numbers in 0..1, one for each lane.
fn numbers(first: usize, step: usize) -> [f32; LANES] {
    std::array::from_fn(|lane| unit(first + step * lane).x.abs())
}

/// What rays meet, the first of which is `first`.
struct Met {
    hits: [Hit; LANES],
    directions: [Vec3; LANES],
    places: SurfaceInteractions<LANES>,
}

impl Met {
    fn new(world: &PreparedWorld, first: usize, object: impl Fn(usize) -> usize) -> Self {
        let hits = std::array::from_fn(|lane| Hit {
            t: 1.0,
            u: 0.2,
            v: 0.3,
            instance: object(first + lane) as u32,
            triangle: (first + lane) as u32 % 80,
        });
        let directions = std::array::from_fn(|lane| unit(first + lane));
        let mut places = SurfaceInteractions::default();
        let corners = places.clear();
        for (lane, hit) in hits.iter().enumerate() {
            set_triangle(
                corners,
                lane,
                world.geometry.corners(hit.instance, hit.triangle),
            );
        }
        for (lane, hit) in hits.iter().enumerate() {
            places.set_lane(lane, &world.geometry, directions[lane], hit, 0.0);
        }
        dispatch_simd(&mut places);
        Self {
            hits,
            directions,
            places,
        }
    }
}

fn metal(name: &str, roughness: f32) -> MaterialModel {
    let metal = Metal::named(name).unwrap();
    MaterialModel::Metal(Metal { roughness, ..metal })
}

#[test]
fn smooth_ones() {
    let glass = |thin| {
        MaterialModel::Glass(Glass {
            thin,
            ..Glass::default()
        })
    };
    let principled = |thickness| {
        let mut p = Principled::default();
        (p.metallic.value, p.roughness.value) = (0.0, 0.0);
        (p.transmission.value, p.thickness.value) = (1.0, thickness);
        p.specular_color.value = [1.0, 0.5, 2.0];
        MaterialModel::Principled(p.into())
    };
    let world = world(&[
        glass(false),
        glass(true),
        metal("gold", 0.0),
        metal("silver", 0.0),
        principled(0.0),
        principled(1.0),
    ]);
    // Glass alone, metal alone, glTF's glass alone, and all.
    let object = |i: usize| match i / LANES % 4 {
        kind @ 0..3 => 2 * kind + i % 2,
        _ => i * 7 / 3 % 6,
    };
    let (mut on, mut through, mut lost, mut forked) = (0, 0, 0, 0);
    let mut points = SpecularBsdfBatch::<LANES>::default();
    for first in (0..480).step_by(LANES) {
        let Met {
            hits,
            directions,
            places,
        } = Met::new(&world, first, object);
        let channel = [None, Some(0)][first % 3 % 2];
        let around = |lane| [1.0, 1.33][lane % 2];
        let choice = numbers(first, 5);
        let forks = |lane: usize| (first / LANES + lane).is_multiple_of(3);
        points.clear();
        for (lane, hit) in hits.iter().enumerate() {
            let (forks, around) = (forks(lane), around(lane));
            points.set_lane(
                (&places, lane),
                (&world.geometry, hit),
                channel,
                around,
                forks,
            );
            assert!(points.is_active[lane]);
        }
        dispatch_simd(SampleSpecular {
            places: &places,
            choice: &choice,
            batch: &mut points,
        });
        for (lane, hit) in hits.iter().enumerate() {
            let place = places.lane(lane);
            let ShadingPoint {
                bsdf: scatter,
                frame,
                ..
            } = ShadingPoint::new(
                &world.geometry,
                &place,
                directions[lane],
                hit,
                channel,
                around(lane),
            );
            let transmissive = scatter.is_transmissive();
            assert_eq!(points.transmission(lane) != Vec3::ZERO, transmissive);
            let sample = |choice| {
                let sample = scatter.sample(&frame, [choice, 0.0, 0.0]);
                sample.map(|sample| (sample, place.offset_ray_origin(sample.wi).as_vec3()))
            };
            let alone = sample(choice[lane]);
            if forks(lane) && transmissive {
                // The weight is another test's.
                let ways = |(sample, start): (BsdfSample, Vec3)| (sample.wi, start);
                if let Some(fork) = points.transmitted_sample(lane) {
                    assert_eq!(ways(fork), ways(sample(FORCE_TRANSMISSION).unwrap()));
                    assert_eq!(points.sample(lane).map(ways), sample(0.0).map(ways));
                    forked += 1;
                }
                continue;
            }
            assert!(points.transmitted_sample(lane).is_none());
            assert_eq!(format!("{:?}", points.sample(lane)), format!("{alone:?}"));
            match alone {
                None => lost += 1,
                Some((sample, _)) if frame.geometric.dot(sample.wi) < 0.0 => {
                    through += 1;
                }
                Some(_) => on += 1,
            }
        }
    }
    assert!(on > 40 && through > 40 && lost > 3, "{on} {through} {lost}");
    assert!(forked > 20, "{forked}");
}

#[test]
fn glossy_ones() {
    let principled = |metallic, roughness| {
        let mut p = Principled::default();
        (p.metallic.value, p.roughness.value) = (metallic, roughness);
        p.specular_color.value = [1.0, 0.5, 2.0];
        MaterialModel::Principled(p.into())
    };
    let layered = |coat: [f32; 2], sheen: [f32; 3]| {
        let mut p = Principled::default();
        (p.metallic.value, p.roughness.value) = (0.2, 0.5);
        (p.clearcoat.value, p.clearcoat_roughness.value) = coat.into();
        (p.sheen_color.value, p.sheen_roughness.value) = (sheen, 0.6);
        MaterialModel::Principled(p.into())
    };
    let world = world(&[
        principled(0.0, 0.4),
        principled(0.3, 1.0),
        principled(1.0, 0.1),
        metal("gold", 0.4),
        metal("silver", 0.05),
        layered([0.7, 0.4], [0.0; 3]),
        layered([1.0, 0.0], [0.0; 3]),
        layered([0.5, 0.2], [0.3, 0.6, 0.2]),
        layered([0.0, 0.0], [0.9; 3]),
    ]);
    // The principled material alone, metal alone, coats alone, and all.
    let object = |i: usize| match i / LANES % 4 {
        0 => i % 3,
        1 => 3 + i % 2,
        2 => 5 + i % 2,
        _ => i * 7 / 3 % 9,
    };
    let (mut on, mut lost, mut lit, mut mirrored) = (0, 0, 0, 0);
    let mut points = GlossyBsdfBatch::<LANES>::default();
    for first in (0..1920).step_by(LANES) {
        let Met {
            hits,
            directions,
            places,
        } = Met::new(&world, first, object);
        points.clear();
        for (lane, hit) in hits.iter().enumerate() {
            points.set_lane(
                (&places, lane),
                &world.geometry,
                world.geometry.material(hit),
                hit,
            );
        }
        assert_eq!(points.is_active, [true; LANES]);
        let (choice, random) = (numbers(first, 5), [numbers(first, 7), numbers(first, 11)]);
        dispatch_simd(SampleGlossy {
            places: &places,
            random: &random,
            choice: &choice,
            batch: &mut points,
        });
        let mut lights = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            set_lane(&mut lights, lane, unit(first + 13 * lane).to_array());
        }
        let values = points.eval(&places, &lights);
        for (lane, hit) in hits.iter().enumerate() {
            let place = places.lane(lane);
            let ShadingPoint {
                frame,
                bsdf: scatter,
                ..
            } = ShadingPoint::new(&world.geometry, &place, directions[lane], hit, None, 1.0);
            let random = [choice[lane], random[0][lane], random[1][lane]];
            let alone = scatter.sample(&frame, random);
            let alone = alone.map(|sample| (sample, place.offset_ray_origin(sample.wi).as_vec3()));
            assert_eq!(format!("{:?}", points.sample(lane)), format!("{alone:?}"));
            let BsdfEval { value, pdf } = scatter.eval(&frame, get_lane(&lights, lane).into());
            assert_eq!(Vec3::from(get_lane(&values.value, lane)), value);
            assert_eq!(values.pdf[lane], pdf);
            match alone {
                None => lost += 1,
                Some((
                    BsdfSample {
                        is_specular: delta, ..
                    },
                    _,
                )) => {
                    on += 1;
                    mirrored += usize::from(delta);
                }
            }
            lit += usize::from(value != Vec3::ZERO);
        }
    }
    assert!(on > 1200 && lost > 20 && lit > 600, "{on} {lost} {lit}");
    assert!(mirrored > 10, "{mirrored}");
}

#[test]
fn frosted_ones() {
    let glass = |roughness, ior| {
        MaterialModel::Glass(Glass {
            roughness,
            ior,
            ..Glass::default()
        })
    };
    let principled = |roughness, metallic| {
        let mut p = Principled::default();
        (p.transmission.value, p.thickness.value) = (1.0, 1.0);
        (p.metallic.value, p.roughness.value) = (metallic, roughness);
        p.specular_color.value = [1.0, 0.5, 2.0];
        MaterialModel::Principled(p.into())
    };
    // The second loses next to nothing.
    let world = world(&[
        glass(0.4, 1.5),
        glass(0.04, 1.3),
        glass(1.0, 1.1),
        principled(0.3, 0.0),
        principled(0.9, 0.4),
    ]);
    let object = |i: usize| match i / LANES % 3 {
        0 => i % 3,
        1 => 3 + i % 2,
        _ => i * 7 / 3 % 5,
    };
    let (mut on, mut through, mut lost, mut lit) = (0, 0, 0, [0; 2]);
    let mut points = RoughDielectricBsdfBatch::<LANES>::default();
    for first in (0..1920).step_by(LANES) {
        let Met {
            hits,
            directions,
            places,
        } = Met::new(&world, first, object);
        points.clear();
        for (lane, hit) in hits.iter().enumerate() {
            points.set_lane((&places, lane), &world.geometry, hit, None, 1.0);
        }
        assert_eq!(points.is_active, [true; LANES]);
        let (choice, random) = (numbers(first, 5), [numbers(first, 7), numbers(first, 11)]);
        dispatch_simd(SampleRoughDielectric {
            world: &world.geometry,
            places: &places,
            random: &random,
            choice: &choice,
            batch: &mut points,
        });
        let mut lights = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            set_lane(&mut lights, lane, unit(first + 13 * lane).to_array());
        }
        let values = points.eval(&world.geometry, &places, &lights);
        for (lane, hit) in hits.iter().enumerate() {
            let place = places.lane(lane);
            let ShadingPoint {
                frame,
                bsdf: scatter,
                ..
            } = ShadingPoint::new(&world.geometry, &place, directions[lane], hit, None, 1.0);
            let random = [choice[lane], random[0][lane], random[1][lane]];
            let alone = scatter.sample(&frame, random);
            let alone = alone.map(|sample| (sample, place.offset_ray_origin(sample.wi).as_vec3()));
            assert_eq!(format!("{:?}", points.sample(lane)), format!("{alone:?}"));
            let light = Vec3::from(get_lane(&lights, lane));
            let BsdfEval { value, pdf } = scatter.eval(&frame, light);
            assert_eq!(Vec3::from(get_lane(&values.value, lane)), value);
            assert_eq!(values.pdf[lane], pdf);
            let below = |direction: Vec3| frame.geometric.dot(direction) < 0.0;
            match alone {
                None => lost += 1,
                Some((sample, _)) if below(sample.wi) => through += 1,
                Some(_) => on += 1,
            }
            lit[usize::from(below(light))] += usize::from(value != Vec3::ZERO);
        }
    }
    assert!(
        on > 400 && through > 400 && lost > 10,
        "{on} {through} {lost}"
    );
    assert!(lit[0] > 300 && lit[1] > 300, "{lit:?}");
}

#[test]
fn what_is_more_than_frosted_goes_one_by_one() {
    let with = |change: fn(&mut Principled)| {
        let mut p = Principled::default();
        (p.transmission.value, p.thickness.value) = (1.0, 1.0);
        (p.metallic.value, p.roughness.value) = (0.0, 0.5);
        change(&mut p);
        MaterialModel::Principled(p.into())
    };
    let world = world(&[
        with(|_| {}),
        with(|p| p.transmission.value = 0.5),
        with(|p| p.roughness.value = 0.0),
        with(|p| p.clearcoat.value = 1.0),
        with(|p| p.anisotropy.value = 0.5),
        MaterialModel::Glass(Glass {
            thin: true,
            roughness: 0.5,
            ..Glass::default()
        }),
    ]);
    let Met { hits, places, .. } = Met::new(&world, 0, |i| i % 6);
    let mut points = RoughDielectricBsdfBatch::<LANES>::default();
    for (lane, hit) in hits.iter().enumerate() {
        points.set_lane((&places, lane), &world.geometry, hit, None, 1.0);
        assert_eq!(
            points.is_active[lane],
            hit.instance == 0,
            "{}",
            hit.instance
        );
    }
}

//! Properties of every BSDF: energy conservation, reciprocity, and samples that follow the reported density.

pub(crate) mod batch_equals_scalar;
pub(crate) mod density;
pub(crate) mod diffuse_lanes;
pub(crate) mod furnace;
pub(crate) mod reciprocity;

use std::sync::LazyLock;

use glam::Vec3;
use raycam_scene::{Glass, Metal};

use crate::bsdf::BsdfModel;
use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::layered::LayeredBsdf;
use crate::bsdf::phong::ModifiedPhong;
use crate::bsdf::shading_point::Bsdf;
use crate::lobes::albedo_dielectric::{DielectricAlbedo, FresnelModel};
use crate::lobes::clearcoat::Clearcoat;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;
use crate::lobes::phong_lobe::PhongLobe;
use crate::lobes::shading_frame::ShadingFrame;
use crate::lobes::sheen::Sheen;
use crate::lobes::thin_film::ThinFilm;

/// True for the exhaustive form of the tests; `make proof` sets `RAYCAM_PROOF`.
fn is_proof() -> bool {
    std::env::var_os("RAYCAM_PROOF").is_some()
}

/// A flat surface that is viewed at an angle given in degrees.
fn frame(degrees: f32, turn: f32) -> ShadingFrame {
    let (sin, cos) = degrees.to_radians().sin_cos();
    seen_from(Vec3::new(sin * turn.cos(), sin * turn.sin(), cos))
}

pub(crate) fn seen_from(view: Vec3) -> ShadingFrame {
    ShadingFrame { geometric: Vec3::Z, normal: Vec3::Z, tangent: Vec3::X, bitangent: Vec3::Y, wo: view }
}

/// Integral over all directions above the surface, with points that are denser towards the horizon.
pub(crate) fn over_the_hemisphere(f: impl Fn(Vec3) -> f32) -> f64 {
    const RINGS: u32 = 400;
    const TURNS: u32 = 400;
    let mut sum = 0.0;
    for ring in 0..RINGS {
        let root = (f64::from(ring) + 0.5) / f64::from(RINGS);
        let z = root * root;
        let radius = (1.0 - z * z).sqrt();
        for turn in 0..TURNS {
            let (sin, cos) = (std::f64::consts::TAU * (f64::from(turn) + 0.5) / f64::from(TURNS)).sin_cos();
            let direction = glam::DVec3::new(radius * cos, radius * sin, z).as_vec3();
            sum += f64::from(f(direction)) * 2.0 * root;
        }
    }
    sum * std::f64::consts::TAU / f64::from(RINGS * TURNS)
}

/// A white dielectric without other layers.
fn plastic(roughness: f32) -> LayerStack<'static> {
    let fresnel = Fresnel::Schlick { f0: Vec3::splat(0.04), f90: Vec3::ONE, eta: None };
    LayerStack {
        fresnel,
        base_fresnel: fresnel,
        ggx: Ggx::isotropic(roughness),
        diffuse: Vec3::ONE,
        diffuse_transmission: Vec3::ZERO,
        transmission: Vec3::ZERO,
        eta: 1.0,
        dielectric_albedo: None,
        coat: None,
        sheen: None,
    }
}

fn white_metal(roughness: f32) -> LayerStack<'static> {
    let fresnel = Fresnel::Schlick { f0: Vec3::ONE, f90: Vec3::ONE, eta: None };
    LayerStack { fresnel, diffuse: Vec3::ZERO, ..plastic(roughness) }
}

/// A metal that is rougher along the tangent, as in `KHR_materials_anisotropy`.
fn brushed(roughness: f32, strength: f32) -> LayerStack<'static> {
    let alpha = (roughness * roughness).max(1e-3);
    LayerStack { ggx: Ggx { alpha_x: alpha + (1.0 - alpha) * strength * strength, alpha_y: alpha }, ..white_metal(0.0) }
}

fn coated<'a>(layers: LayerStack<'a>, frame: &ShadingFrame) -> LayerStack<'a> {
    LayerStack { coat: Some(Clearcoat { weight: 0.8, ggx: Ggx::isotropic(0.3), frame: *frame }), ..layers }
}

static EXACT: LazyLock<DielectricAlbedo> = LazyLock::new(|| DielectricAlbedo::new(1.5, FresnelModel::Exact));
static SCHLICK: LazyLock<DielectricAlbedo> = LazyLock::new(|| DielectricAlbedo::new(1.5, FresnelModel::Schlick));

/// A white principled material with a volume and an index of refraction of 1.5.
fn solid(roughness: f32, front: bool) -> LayerStack<'static> {
    let eta = if front { 1.5 } else { 1.0 / 1.5 };
    let fresnel = Fresnel::Schlick { f0: Vec3::splat(0.04), f90: Vec3::ONE, eta: (!front).then_some(eta) };
    LayerStack {
        fresnel,
        base_fresnel: fresnel,
        diffuse: Vec3::ZERO,
        transmission: Vec3::ONE,
        eta,
        dielectric_albedo: Some(&SCHLICK),
        ..plastic(roughness)
    }
}

const FILM: ThinFilm = ThinFilm { ior: 1.4, thickness: 450.0 };

type Make = Box<dyn Fn(&ShadingFrame) -> Bsdf<'static>>;
/// Kinds of scattering: each has a name, which includes the roughness, and a constructor.
type Named = Vec<(String, Make)>;

const ROUGHNESS_VALUES: [f32; 5] = [0.0, 0.1, 0.3, 0.6, 1.0];

/// All kinds of scattering by name: first the lossless kinds, then the others.
fn all() -> (Named, Named) {
    fn layers(name: String, make: impl Fn(&ShadingFrame) -> LayerStack<'static> + 'static) -> (String, Make) {
        let make = move |frame: &ShadingFrame| Bsdf::Layered(LayeredBsdf::new(make(frame), frame));
        (name, Box::new(make))
    }
    let mut lossless = vec![];
    let mut lossy = vec![];
    for roughness in ROUGHNESS_VALUES {
        lossless.push(layers(format!("metal {roughness}"), move |_| white_metal(roughness)));
        lossless.push(layers(format!("plastic {roughness}"), move |_| plastic(roughness)));
        lossless.push(layers(format!("translucent {roughness}"), move |_| LayerStack {
            diffuse: Vec3::splat(0.3),
            diffuse_transmission: Vec3::splat(0.7),
            ..plastic(roughness)
        }));
        lossy.push(layers(format!("cloth {roughness}"), move |_| LayerStack {
            sheen: Some(Sheen { color: Vec3::ONE, roughness }),
            ..plastic(0.5)
        }));
        lossy.push(layers(format!("film {roughness}"), move |_| {
            let fresnel = Fresnel::ThinFilm { thin_film: FILM, f0: Vec3::splat(0.04), f90: Vec3::ONE, weight: 1.0 };
            LayerStack { fresnel, base_fresnel: fresnel, ..plastic(roughness) }
        }));
        lossless.push(layers(format!("brushed {roughness}"), move |_| brushed(roughness, 0.7)));
        lossless.push(layers(format!("thin {roughness}"), move |_| LayerStack {
            diffuse: Vec3::splat(0.2),
            transmission: Vec3::splat(0.8),
            ..plastic(roughness)
        }));
        for front in [false, true] {
            lossless.push(layers(format!("solid {roughness} {front}"), move |_| solid(roughness, front)));
        }
        lossless.push(layers(format!("mixed {roughness} false"), move |_| LayerStack {
            diffuse: Vec3::splat(0.6),
            transmission: Vec3::splat(0.4),
            ..solid(roughness, false)
        }));
        for thin in [false, true] {
            for front in [false, true] {
                let glass = Glass { roughness, thin, ..Glass::default() };
                let name = format!("glass {roughness} {thin} {front}");
                let make = move |frame: &ShadingFrame| {
                    let eta = crate::bsdf::dielectric::eta_of_side(&glass, front, None, 1.0);
                    let layers = crate::bsdf::dielectric::layer_stack(&glass, eta, Vec3::ONE, Some(&EXACT));
                    Bsdf::Layered(LayeredBsdf::new(layers, frame))
                };
                lossless.push((name, Box::new(make)));
            }
        }
        let gold = Metal { roughness, ..Metal::named("gold").unwrap() };
        let make = move |frame: &ShadingFrame| {
            Bsdf::Layered(LayeredBsdf::new(crate::bsdf::conductor::layer_stack(&gold, Vec3::ONE), frame))
        };
        lossy.push((format!("gold {roughness}"), Box::new(make)));
    }
    let matte = |_: &ShadingFrame| Bsdf::Phong(ModifiedPhong { diffuse: Vec3::ONE, specular: Vec3::ZERO, lobe: None });
    lossless.push(("matte".into(), Box::new(matte)));
    for roughness in ROUGHNESS_VALUES {
        lossless.push(layers(format!("coated plastic {roughness}"), move |frame| coated(plastic(roughness), frame)));
        lossless.push(layers(format!("coated metal {roughness}"), move |frame| coated(white_metal(roughness), frame)));
    }
    let lobe: &'static PhongLobe = Box::leak(Box::new(PhongLobe::new(20.0)));
    let lecture = move |_: &ShadingFrame| {
        Bsdf::Phong(ModifiedPhong { diffuse: Vec3::splat(0.6), specular: Vec3::splat(0.4), lobe: Some(lobe) })
    };
    lossy.push(("lecture".into(), Box::new(lecture)));
    (lossless, lossy)
}

/// Independent random numbers.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// The i-th point of a sequence that covers the unit cube evenly: M. Roberts's additive sequence R3.
fn spread(i: u32) -> [f32; 3] {
    let at = |step: f64| ((0.5 + step * f64::from(i)).fract() * 0.999_999_9) as f32;
    [at(0.819_172_513_396_164_4), at(0.671_043_606_703_789_2), at(0.549_700_477_901_970_3)]
}

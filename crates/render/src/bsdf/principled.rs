//! glTF's principled material at a point: textures looked up, layers filled in.
//!
//! glTF 2.0, appendix B, and the `KHR_materials_*` extensions. The interface shares energy with the base by albedo
//! instead of by the half vector, so that nothing is lost or gained.

use std::cell::Cell;

use glam::Vec3;
use raycam_bvh::Hit;
use raycam_scene::{Principled, TextureSlot, Textured};

use crate::bsdf::layered::LayerStack;
use crate::bsdf::specular::is_smooth;
use crate::interaction::batch::SurfaceInteractions;
use crate::interaction::ray_cone::Footprint;
use crate::lobes::albedo_dielectric::DielectricAlbedo;
use crate::lobes::clearcoat::Clearcoat;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;
use crate::lobes::shading_frame::ShadingFrame;
use crate::lobes::sheen::Sheen;
use crate::lobes::thin_film::ThinFilm;
use crate::prepare::geometry::Geometry;

/// A point whose textures are looked up.
pub(crate) struct TextureLookup<'a> {
    world: &'a Geometry,
    hit: &'a Hit,
    footprint: &'a Footprint,
    /// The last one: channels of one texture are several values.
    cached: Cell<Option<(TextureSlot, [f32; 4])>>,
}

impl<'a> TextureLookup<'a> {
    pub fn new(world: &'a Geometry, hit: &'a Hit, footprint: &'a Footprint) -> Self {
        Self {
            world,
            hit,
            footprint,
            cached: Cell::new(None),
        }
    }

    /// The direction along which highlights are wider, where that matters: the tangent, turned by the material's rotation
    /// and its texture's.
    pub fn tangent(&self, p: &Principled) -> Option<Vec3> {
        if p.anisotropy.value == 0.0 {
            return None;
        }
        let set = p.anisotropy.texture.map_or(0, |slot| slot.uv_set);
        let [tangent, bitangent] = self.world.tangents(self.hit, set)?;
        let (sin, cos) = p.anisotropy_rotation.sin_cos();
        let [x, y] = match p.anisotropy.texture {
            None => [1.0, 0.0],
            slot => {
                let [red, green, ..] = self.texel(slot);
                [red, green].map(|v| 2.0 * v - 1.0)
            }
        };
        Some(tangent * (cos * x - sin * y) + bitangent * (sin * x + cos * y))
    }

    fn texel(&self, slot: Option<TextureSlot>) -> [f32; 4] {
        let Some(slot) = slot else { return [1.0; 4] };
        if let Some((last, texel)) = self.cached.get()
            && last == slot
        {
            return texel;
        }
        let texel = self
            .world
            .filtered_texel(&slot, self.hit, self.footprint)
            .unwrap_or([1.0; 4]);
        self.cached.set(Some((slot, texel)));
        texel
    }

    fn value(&self, value: &Textured<f32>, channel: usize) -> f32 {
        match value.texture {
            None => value.value,
            slot => value.value * self.texel(slot)[channel],
        }
    }

    fn color(&self, value: &Textured<[f32; 3]>) -> Vec3 {
        let color = Vec3::from(value.value);
        match value.texture {
            None => color,
            slot => color * Vec3::from_slice(&self.texel(slot)),
        }
    }
}

/// What is seen from where.
pub(crate) struct ViewContext<'a> {
    /// Without any normal map.
    pub unmapped_frame: ShadingFrame,
    pub front: bool,
    /// Of the three colours, the one that the path carries; all where `None`.
    pub channel: Option<usize>,
    /// The index of refraction of what is around its matter.
    pub outside_ior: f32,
    pub base: Vec3,
    /// What its roughness loses where it refracts.
    pub dielectric_albedo: Option<&'a DielectricAlbedo>,
}

impl ViewContext<'_> {
    /// What is seen at a lane from empty space in all colours.
    pub fn for_lane<const N: usize>(
        places: &SurfaceInteractions<N>,
        lane: usize,
        base: Vec3,
    ) -> Self {
        Self {
            unmapped_frame: places.shading_frame(lane),
            front: places.is_front(lane),
            channel: None,
            outside_ior: 1.0,
            base,
            dielectric_albedo: None,
        }
    }
}

/// Index of refraction of a channel (`KHR_materials_dispersion`).
pub(crate) fn ior_of_channel(ior: f32, dispersion: f32, channel: Option<usize>) -> f32 {
    let spread = (ior - 1.0) * 0.025 * dispersion;
    ior + match channel {
        Some(0) => -spread,
        Some(2) => spread,
        _ => 0.0,
    }
}

/// The layers of a point.
pub(crate) fn layer_stack<'a>(
    p: &Principled,
    lookup: &TextureLookup,
    seen: &ViewContext<'a>,
) -> LayerStack<'a> {
    let metallic = lookup.value(&p.metallic, 2);
    let roughness = lookup.value(&p.roughness, 1);
    let transmission = lookup.value(&p.transmission, 0);
    let strength = lookup.value(&p.specular, 3);
    let ior = ior_of_channel(p.ior, p.dispersion, seen.channel);
    let eta = match (has_interior(p), seen.front) {
        (false, _) => 1.0,
        (true, true) => ior / seen.outside_ior,
        (true, false) => seen.outside_ior / ior,
    };
    let f0 = if p.ior == 0.0 {
        1.0
    } else {
        let ior = if has_interior(p) {
            ior / seen.outside_ior
        } else {
            ior
        };
        ((ior - 1.0) / (ior + 1.0)).powi(2)
    };
    let f0 = (f0 * lookup.color(&p.specular_color)).min(Vec3::ONE) * strength;
    let f90 = Vec3::splat(strength);
    let iridescence = lookup.value(&p.iridescence, 0);
    let film = ThinFilm {
        ior: p.iridescence_ior,
        thickness: {
            let [thin, thick] = p.iridescence_thickness;
            let texel = lookup.texel(p.iridescence_thickness_texture);
            thin + (thick - thin) * texel[1]
        },
    };
    let interface = |f0: Vec3, f90: Vec3| {
        if eta < 1.0 {
            Fresnel::Schlick {
                f0,
                f90,
                eta: Some(eta),
            }
        } else if iridescence > 0.0 && film.thickness > 0.0 {
            Fresnel::ThinFilm {
                thin_film: film,
                f0,
                f90,
                weight: iridescence,
            }
        } else {
            Fresnel::Schlick { f0, f90, eta: None }
        }
    };
    let base = seen.base * (1.0 - metallic);
    let through = lookup.value(&p.diffuse_transmission, 3);
    let diffuse = 1.0 - transmission;
    LayerStack {
        fresnel: interface(f0.lerp(seen.base, metallic), f90.lerp(Vec3::ONE, metallic)),
        base_fresnel: interface(f0, f90),
        ggx: ggx(p, lookup, roughness),
        diffuse: base * (diffuse * (1.0 - through)),
        diffuse_transmission: lookup.color(&p.diffuse_transmission_color)
            * ((1.0 - metallic) * diffuse * through),
        transmission: base * transmission,
        eta,
        dielectric_albedo: seen.dielectric_albedo,
        coat: coat(p, lookup, seen),
        sheen: (p.sheen_color.value != [0.0; 3]).then(|| Sheen {
            color: lookup.color(&p.sheen_color),
            roughness: lookup.value(&p.sheen_roughness, 3),
        }),
    }
}

fn coat(p: &Principled, lookup: &TextureLookup, seen: &ViewContext) -> Option<Clearcoat> {
    let weight = lookup.value(&p.clearcoat, 0);
    let smooth = &seen.unmapped_frame;
    let mapped = || {
        let (hit, footprint) = (lookup.hit, lookup.footprint);
        let map = p.clearcoat_normal?;
        lookup
            .world
            .mapped_normal(&map, hit, footprint, smooth.normal, seen.front)
    };
    (weight > 0.0).then(|| Clearcoat {
        weight,
        ggx: Ggx::isotropic(lookup.value(&p.clearcoat_roughness, 1)),
        frame: smooth.with_shading_normal(mapped().unwrap_or(smooth.normal), None),
    })
}

/// The interface's roughness, wider along the tangent (`KHR_materials_anisotropy`); the frame has turned already.
fn ggx(p: &Principled, lookup: &TextureLookup, roughness: f32) -> Ggx {
    let Ggx { alpha_x: alpha, .. } = Ggx::isotropic(roughness);
    let strength = lookup.value(&p.anisotropy, 2);
    Ggx {
        alpha_x: alpha + (1.0 - alpha) * strength * strength,
        // A mirror across, rough along: float32 needs some width.
        alpha_y: if strength > 0.0 {
            alpha.max(1e-3)
        } else {
            alpha
        },
    }
}

/// Whether it is an interface over a diffuse base, as wide in all directions, perhaps under a coat and a sheen, and no more.
pub(crate) fn is_rough_reflective(p: &Principled) -> bool {
    p.transmission.value == 0.0 && is_achromatic_isotropic(p)
}

/// Whether it is an interface that refracts and no more, as wide in all directions, where its textures do not say otherwise.
pub(crate) fn is_rough_refractive(p: &Principled) -> bool {
    has_interior(p)
        && is_achromatic_isotropic(p)
        && has_no_layers(p)
        && !is_smooth(p.roughness.value)
}

/// Whether it is clear glass, where its textures do not say otherwise.
pub(crate) fn is_specular(p: &Principled) -> bool {
    let passes = p.transmission.value == 1.0 && p.metallic.value == 0.0;
    passes && is_achromatic_isotropic(p) && has_no_layers(p) && is_smooth(p.roughness.value)
}

/// Whether nothing lies on its interface.
fn has_no_layers(p: &Principled) -> bool {
    p.clearcoat.value == 0.0 && p.sheen_color.value == [0.0; 3]
}

/// Whether its interface has no film and no direction, and sends all colours the same way on.
fn is_achromatic_isotropic(p: &Principled) -> bool {
    let strengths = [&p.diffuse_transmission, &p.iridescence, &p.anisotropy];
    strengths.iter().all(|strength| strength.value == 0.0) && p.dispersion == 0.0
}

/// Whether light that enters it is refracted: it has an inside and lets light through.
pub(crate) fn has_interior(p: &Principled) -> bool {
    p.thickness.value > 0.0 && p.ior > 0.0 && p.transmission.value > 0.0
}

/// Its absorption per metre, where it has an inside.
pub(crate) fn interior_absorption(p: &Principled) -> Option<Vec3> {
    let passes = p.transmission.value > 0.0 || p.diffuse_transmission.value > 0.0;
    (passes && p.thickness.value > 0.0)
        .then(|| absorption_coefficient(p.attenuation_color, p.attenuation_distance))
}

/// Beer's law: what leaves this share of white light after this distance.
pub(crate) fn absorption_coefficient(color: [f32; 3], distance: f32) -> Vec3 {
    if distance.is_infinite() {
        return Vec3::ZERO;
    }
    // Black swallows all: a finite number that leaves nothing of it after a small part of the distance.
    Vec3::from(color.map(|share| -share.max(1e-30).ln() / distance))
}

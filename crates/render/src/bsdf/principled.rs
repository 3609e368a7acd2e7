//! glTF's principled material: glTF 2.0, appendix B, and the `KHR_materials_*` extensions.
//!
//! The interface shares energy with the base by albedo instead of by the half vector, so that no energy is lost or
//! gained.

use glam::Vec3;
use raycam_scene::Principled;

use crate::bsdf::layer_stack::LayerStack;
use crate::bsdf::material_hit::MaterialHit;
use crate::lobes::classify::{has_interior, ior_of_channel};
use crate::lobes::clearcoat::Clearcoat;
use crate::lobes::fresnel::Fresnel;
use crate::lobes::ggx::Ggx;
use crate::lobes::sheen::Sheen;
use crate::lobes::thin_film::ThinFilm;

/// Tangent along which highlights are wider, for an anisotropic material: the mesh tangent, rotated by the material and
/// its texture.
pub(crate) fn anisotropy_tangent(p: &Principled, hit: &MaterialHit) -> Option<Vec3> {
    if p.anisotropy.value == 0.0 {
        return None;
    }
    let set = p.anisotropy.texture.map_or(0, |slot| slot.uv_set);
    let [tangent, bitangent] = hit.geometry.tangents(hit.hit, set)?;
    let (sin, cos) = p.anisotropy_rotation.sin_cos();
    let [x, y] = match p.anisotropy.texture {
        None => [1.0, 0.0],
        slot => {
            let [red, green, ..] = hit.texel(slot);
            [red, green].map(|v| 2.0 * v - 1.0)
        }
    };
    Some(tangent * (cos * x - sin * y) + bitangent * (sin * x + cos * y))
}

/// Layer stack of a hit with this base colour.
pub(crate) fn layer_stack<'a>(p: &Principled, hit: &MaterialHit<'a>, base: Vec3) -> LayerStack<'a> {
    let metallic = hit.value(&p.metallic, 2);
    let roughness = hit.value(&p.roughness, 1);
    let transmission = hit.value(&p.transmission, 0);
    let strength = hit.value(&p.specular, 3);
    let ior = ior_of_channel(p.ior, p.dispersion, hit.channel);
    let eta = match (has_interior(p), hit.is_front) {
        (false, _) => 1.0,
        (true, true) => ior / hit.outside_ior,
        (true, false) => hit.outside_ior / ior,
    };
    let f0 = if p.ior == 0.0 {
        1.0
    } else {
        let ior = if has_interior(p) { ior / hit.outside_ior } else { ior };
        ((ior - 1.0) / (ior + 1.0)).powi(2)
    };
    let f0 = (f0 * hit.color(&p.specular_color)).min(Vec3::ONE) * strength;
    let f90 = Vec3::splat(strength);
    let iridescence = hit.value(&p.iridescence, 0);
    let thin_film = thin_film(p, hit);
    let interface = |f0: Vec3, f90: Vec3| {
        if eta < 1.0 {
            Fresnel::Schlick { f0, f90, eta: Some(eta) }
        } else if iridescence > 0.0 && thin_film.thickness > 0.0 {
            Fresnel::ThinFilm { thin_film, f0, f90, weight: iridescence }
        } else {
            Fresnel::Schlick { f0, f90, eta: None }
        }
    };
    let base_color = base;
    let base = base_color * (1.0 - metallic);
    let through = hit.value(&p.diffuse_transmission, 3);
    let diffuse = 1.0 - transmission;
    LayerStack {
        fresnel: interface(f0.lerp(base_color, metallic), f90.lerp(Vec3::ONE, metallic)),
        base_fresnel: interface(f0, f90),
        ggx: ggx(p, hit, roughness),
        diffuse: base * (diffuse * (1.0 - through)),
        diffuse_transmission: hit.color(&p.diffuse_transmission_color) * ((1.0 - metallic) * diffuse * through),
        transmission: base * transmission,
        eta,
        dielectric_albedo: hit.dielectric_albedo(),
        coat: clearcoat(p, hit),
        sheen: (p.sheen_color.value != [0.0; 3])
            .then(|| Sheen { color: hit.color(&p.sheen_color), roughness: hit.value(&p.sheen_roughness, 3) }),
    }
}

fn thin_film(p: &Principled, hit: &MaterialHit) -> ThinFilm {
    let [thin, thick] = p.iridescence_thickness;
    let texel = hit.texel(p.iridescence_thickness_texture);
    ThinFilm { ior: p.iridescence_ior, thickness: thin + (thick - thin) * texel[1] }
}

fn clearcoat(p: &Principled, hit: &MaterialHit) -> Option<Clearcoat> {
    let weight = hit.value(&p.clearcoat, 0);
    let frame = &hit.unmapped_frame;
    let mapped = || hit.bent_normal(p.clearcoat_normal.as_ref()).map(|normal| frame.keep_mirror_above(normal));
    (weight > 0.0).then(|| Clearcoat {
        weight,
        ggx: Ggx::isotropic(hit.value(&p.clearcoat_roughness, 1)),
        frame: frame.with_shading_normal(mapped().unwrap_or(frame.normal), None),
    })
}

/// Microfacet distribution of the interface, wider along the tangent (`KHR_materials_anisotropy`).
fn ggx(p: &Principled, hit: &MaterialHit, roughness: f32) -> Ggx {
    let Ggx { alpha_x: alpha, .. } = Ggx::isotropic(roughness);
    let strength = hit.value(&p.anisotropy, 2);
    Ggx {
        alpha_x: alpha + (1.0 - alpha) * strength * strength,
        // A surface that is rough along one direction may be a mirror along the other; the minimum roughness keeps
        // float32 numbers finite.
        alpha_y: if strength > 0.0 { alpha.max(1e-3) } else { alpha },
    }
}

//! What an object's description says about its materials.

use super::keys::Keys;
use super::object::{KEYS, MaterialType, ObjectSpec};
use super::words::{Color, Splat};
use crate::color::Rgb;
use crate::error::{SceneError, suggestion};
use crate::glass::Glass;
use crate::material::{Alpha, Material, Reflectance};
use crate::metal::Metal;
use crate::principled::{Principled, Textured};
use crate::texture::TextureSlot;

/// The keys that change a material.
pub(super) const STYLE: [&str; 30] = [
    "type",
    "color",
    "texture",
    "wrap",
    "diffuse",
    "specular",
    "shininess",
    "emission",
    "opacity",
    "metal",
    "roughness",
    "ior",
    "thin",
    "dispersion",
    "attenuation_color",
    "attenuation_distance",
    "metallic",
    "specular_color",
    "transmission",
    "clearcoat",
    "clearcoat_roughness",
    "sheen_color",
    "sheen_roughness",
    "iridescence",
    "iridescence_ior",
    "iridescence_thickness",
    "anisotropy",
    "anisotropy_rotation",
    "diffuse_transmission",
    "diffuse_transmission_color",
];

/// The keys that the lecture's material alone has, and those of metal, of glass and of principled.
const LECTURE: [&str; 2] = ["diffuse", "shininess"];
const METAL: [&str; 1] = ["metal"];
const GLASS: [&str; 5] = [
    "ior",
    "thin",
    "dispersion",
    "attenuation_color",
    "attenuation_distance",
];
const PRINCIPLED: [&str; 14] = [
    "metallic",
    "specular_color",
    "transmission",
    "clearcoat",
    "clearcoat_roughness",
    "sheen_color",
    "sheen_roughness",
    "iridescence",
    "iridescence_ior",
    "iridescence_thickness",
    "anisotropy",
    "anisotropy_rotation",
    "diffuse_transmission",
    "diffuse_transmission_color",
];

impl ObjectSpec {
    /// Whether the keys of the material go together, and their values make sense.
    pub(super) fn check_style(&self, keys: &Keys<KEYS>) -> Result<(), SceneError> {
        let needs = |named: &str| format!("it goes with type = {named}");
        match self.type_ {
            Some(MaterialType::Unlit) => {
                let reason = "type = \"unlit\" shows the base colour itself and reflects no light";
                keys.refuse(&["diffuse", "specular", "shininess", "roughness"], reason)?;
            }
            Some(MaterialType::Matte) => {
                let reason = "type = \"matte\" is diffuse alone; leave out the type for diffuse and specular";
                keys.refuse(&["specular", "shininess", "roughness"], reason)?;
            }
            Some(MaterialType::Metal | MaterialType::Glass) => {
                let reason = "metal and glass have no diffuse part; leave out the type for diffuse and specular";
                keys.refuse(&["diffuse", "specular", "shininess"], reason)?;
            }
            Some(MaterialType::Principled) => {
                let reason = "type = \"principled\" has metallic and roughness; leave out the type for diffuse and shininess";
                keys.refuse(&LECTURE, reason)?;
            }
            None => {
                let reason = needs("\"metal\", \"glass\" or \"principled\"");
                keys.refuse(&["roughness"], &reason)?;
            }
        }
        if self.type_ != Some(MaterialType::Metal) {
            keys.refuse(&METAL, &needs("\"metal\""))?;
        }
        if !matches!(
            self.type_,
            Some(MaterialType::Glass | MaterialType::Principled)
        ) {
            keys.refuse(&GLASS, &needs("\"glass\" or \"principled\""))?;
        }
        if self.type_ != Some(MaterialType::Principled) {
            keys.refuse(&PRINCIPLED, &needs("\"principled\""))?;
        }
        if self.metal.is_some() {
            keys.refuse(
                &["color"],
                "a metal has either a name or a color of its own",
            )?;
        }
        if self.texture.is_none() {
            keys.refuse(&["wrap"], "it goes with \"texture\", which is missing")?;
        }
        let share = |key: &str, values: &[f64]| {
            if values.iter().all(|v| (0.0..=1.0).contains(v)) {
                return Ok(());
            }
            let given = if let [value] = values {
                value.to_string()
            } else {
                format!("{values:?}")
            };
            Err(SceneError::schema(key, format!("{given}: expected 0..=1")))
        };
        if let Some(Color(color)) = self.color {
            share("color", &color.map(f64::from))?;
        }
        share("diffuse", self.diffuse.map(f64::from).as_slice())?;
        if let Some(Splat(specular)) = self.specular {
            share("specular", &specular)?;
        }
        share("opacity", self.opacity.map(f64::from).as_slice())?;
        if let Some(name) = &self.metal
            && Metal::named(name).is_none()
        {
            let known: Vec<_> = Metal::names().collect();
            return Err(SceneError::schema(
                "metal",
                format!(
                    "no metal {name:?}{}; there are {}",
                    suggestion(name, known.iter().copied()),
                    known.join(", ")
                ),
            ));
        }
        if self.shininess.is_some_and(|v| !(v.is_finite() && v >= 0.0)) {
            let given = self.shininess.unwrap_or_default();
            return Err(SceneError::schema(
                "shininess",
                format!("{given}: expected a finite number >= 0, the Phong exponent"),
            ));
        }
        let mut material = Material::default();
        self.restyle(&mut material, None);
        material
            .validate()
            .map_err(|error| SceneError::schema("type", error.to_string()))
    }

    /// Changes a material to what is said here; `texture` is where the image named here is.
    pub(super) fn restyle(&self, material: &mut Material, texture: Option<TextureSlot>) {
        // An image named here shows as it is, unless a colour to multiply it by is named here too.
        match self.color {
            Some(Color(color)) => material.color = color,
            None if texture.is_some() || self.is_clear() => material.color = [1.0; 3],
            None => {}
        }
        if let Some(Splat(emission)) = self.emission {
            material.emission = emission.map(|v| v as f32).into();
        }
        if let Some(opacity) = self.opacity {
            material.opacity = opacity;
            material.alpha = Alpha::Blend;
        }
        material.texture = texture.or(material.texture);
        let base = match &material.reflectance {
            Reflectance::Lecture { .. } => material.reflectance.clone(),
            _ if self.relit() => Reflectance::DEFAULT,
            base => base.clone(),
        };
        material.reflectance = match (self.type_, base) {
            (Some(MaterialType::Unlit), _) => Reflectance::Unlit,
            (Some(MaterialType::Matte), _) => Reflectance::Lecture {
                diffuse: self.diffuse.unwrap_or(1.0),
                specular: [0.0; 3],
                shininess: 32.0,
            },
            (Some(MaterialType::Metal), _) => self.metal(),
            (Some(MaterialType::Glass), _) => self.glass(),
            (Some(MaterialType::Principled), _) => self.principled(),
            (
                None,
                Reflectance::Lecture {
                    diffuse,
                    specular,
                    shininess,
                },
            ) => Reflectance::Lecture {
                diffuse: self.diffuse.unwrap_or(diffuse),
                specular: self
                    .specular
                    .map_or(specular, |Splat(rgb)| rgb.map(|v| v as f32)),
                shininess: self.shininess.unwrap_or(shininess),
            },
            (None, base) => base,
        };
    }

    /// Whether its color multiplies what passes or is reflected unchanged, so that it is white where nothing is said.
    fn is_clear(&self) -> bool {
        self.metal.is_some() || self.type_ == Some(MaterialType::Glass)
    }

    fn metal(&self) -> Reflectance {
        let roughness = self.roughness.unwrap_or(0.0);
        match self.metal.as_deref().and_then(Metal::named) {
            Some(metal) => Reflectance::Metal(Metal { roughness, ..metal }),
            None => Reflectance::Principled(Box::new(Principled {
                roughness: roughness.into(),
                ..Principled::default()
            })),
        }
    }

    fn glass(&self) -> Reflectance {
        let plain = Glass::default();
        Reflectance::Glass(Glass {
            ior: self.ior.unwrap_or(plain.ior),
            roughness: self.roughness.unwrap_or(plain.roughness),
            thin: self.thin.unwrap_or(plain.thin),
            dispersion: self.dispersion.unwrap_or(plain.dispersion),
            attenuation_color: rgb(self.attenuation_color, plain.attenuation_color),
            attenuation_distance: self
                .attenuation_distance
                .unwrap_or(plain.attenuation_distance),
        })
    }

    fn principled(&self) -> Reflectance {
        let plain = Principled::default();
        let number =
            |given: Option<f32>, plain: &Textured<f32>| given.unwrap_or(plain.value).into();
        let solid = !self.thin.unwrap_or(false);
        let thickness = self.iridescence_thickness.unwrap_or(400.0);
        Reflectance::Principled(Box::new(Principled {
            metallic: self.metallic.unwrap_or(0.0).into(),
            roughness: self.roughness.unwrap_or(0.5).into(),
            ior: self.ior.unwrap_or(plain.ior),
            specular: self.specular.map_or(1.0, |Splat([v, ..])| v as f32).into(),
            specular_color: rgb(self.specular_color, [1.0; 3]).into(),
            transmission: number(self.transmission, &plain.transmission),
            thickness: f32::from(u8::from(solid)).into(),
            attenuation_color: rgb(self.attenuation_color, plain.attenuation_color),
            attenuation_distance: self
                .attenuation_distance
                .unwrap_or(plain.attenuation_distance),
            dispersion: self.dispersion.unwrap_or(plain.dispersion),
            clearcoat: number(self.clearcoat, &plain.clearcoat),
            clearcoat_roughness: number(self.clearcoat_roughness, &plain.clearcoat_roughness),
            sheen_color: rgb(self.sheen_color, [0.0; 3]).into(),
            sheen_roughness: number(self.sheen_roughness, &plain.sheen_roughness),
            iridescence: number(self.iridescence, &plain.iridescence),
            iridescence_ior: self.iridescence_ior.unwrap_or(plain.iridescence_ior),
            iridescence_thickness: [thickness; 2],
            anisotropy: number(self.anisotropy, &plain.anisotropy),
            anisotropy_rotation: self.anisotropy_rotation.unwrap_or(0.0).to_radians() as f32,
            diffuse_transmission: number(self.diffuse_transmission, &plain.diffuse_transmission),
            diffuse_transmission_color: rgb(self.diffuse_transmission_color, [1.0; 3]).into(),
            ..plain
        }))
    }

    /// Whether anything said here needs light.
    fn relit(&self) -> bool {
        self.diffuse.is_some() || self.specular.is_some() || self.shininess.is_some()
    }
}

/// A colour, or another where none is given.
fn rgb(given: Option<Color>, otherwise: Rgb) -> Rgb {
    given.map_or(otherwise, |Color(rgb)| rgb)
}

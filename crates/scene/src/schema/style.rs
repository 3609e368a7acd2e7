//! What an object's description says about its materials.

use super::keys::Keys;
use super::object::{KEYS, MaterialType, ObjectSpec};
use super::words::{Color, Splat};
use crate::error::SceneError;
use crate::material::{Material, Reflectance};
use crate::texture::TextureSlot;

/// The keys that change a material.
pub(super) const STYLE: [&str; 7] = [
    "type",
    "color",
    "texture",
    "wrap",
    "diffuse",
    "specular",
    "shininess",
];

impl ObjectSpec {
    /// Whether the keys of the material go together, and their values make sense.
    pub(super) fn check_style(&self, keys: &Keys<KEYS>) -> Result<(), SceneError> {
        match self.type_ {
            Some(MaterialType::Unlit) => {
                let reason = "type = \"unlit\" shows the base colour itself and reflects no light";
                keys.refuse(&["diffuse", "specular", "shininess"], reason)?;
            }
            Some(MaterialType::Matte) => {
                let reason = "type = \"matte\" is diffuse alone; leave out the type for diffuse and specular";
                keys.refuse(&["specular", "shininess"], reason)?;
            }
            None => {}
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
        match self.shininess {
            Some(shininess) if !(shininess.is_finite() && shininess >= 0.0) => {
                Err(SceneError::schema(
                    "shininess",
                    format!("{shininess}: expected a finite number >= 0, the Phong exponent"),
                ))
            }
            _ => Ok(()),
        }
    }

    /// Changes a material to what is said here; `texture` is where the image named here is.
    pub(super) fn restyle(&self, material: &mut Material, texture: Option<TextureSlot>) {
        // An image named here shows as it is, unless a colour to multiply it by is named here too.
        match self.color {
            Some(Color(color)) => material.color = color,
            None if texture.is_some() => material.color = [1.0; 3],
            None => {}
        }
        material.texture = texture.or(material.texture);
        let base = match &material.reflectance {
            Reflectance::Unlit | Reflectance::Principled(_) if self.relit() => Reflectance::DEFAULT,
            base => base.clone(),
        };
        material.reflectance = match (self.type_, base) {
            (Some(MaterialType::Unlit), _) | (None, Reflectance::Unlit) => Reflectance::Unlit,
            (None, principled @ Reflectance::Principled(_)) => principled,
            (Some(MaterialType::Matte), _) => Reflectance::Lecture {
                diffuse: self.diffuse.unwrap_or(1.0),
                specular: [0.0; 3],
                shininess: 32.0,
            },
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
        };
    }

    /// Whether anything said here needs light.
    fn relit(&self) -> bool {
        self.diffuse.is_some() || self.specular.is_some() || self.shininess.is_some()
    }
}

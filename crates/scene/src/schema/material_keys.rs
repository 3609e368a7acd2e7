//! Material keys of an object's description.

use crate::color::Rgb;
use crate::error::{Result, SceneError, suggestion};
use crate::error_code::ErrorCode;
use crate::material::glass::Glass;
use crate::material::height_map::HeightUnit;
use crate::material::metal::Metal;
use crate::material::principled::Principled;
use crate::material::{Alpha, Material, MaterialModel};
use crate::schema::keys::Keys;
use crate::schema::object_keys::{
    COMMON_KEYS, GLASS_KEYS, MATERIAL_KEYS, MEDIUM_KEYS, METAL_KEYS, PHONG_KEYS, PRINCIPLED_KEYS,
};
use crate::schema::shorthand::{Color, Splat};
use crate::schema::spec::object::{AlphaMode, KEYS, MaterialType, ObjectSpec};
use crate::schema::texture_binding::TextureBinding;

/// True if a key that changes a material is present.
pub(crate) fn has_material_keys(keys: &Keys<KEYS>) -> bool {
    MATERIAL_KEYS.into_iter().any(|some| !keys.given(some).is_empty())
}

impl ObjectSpec {
    /// Checks that the material keys can be combined and that their values are valid. `has_material` is true if a file
    /// or another object already provides a material.
    pub(crate) fn check_material(&self, keys: &Keys<KEYS>, has_material: bool) -> Result<()> {
        if self.alpha == Some(AlphaMode::Opaque) {
            keys.refuse(&["opacity"], "cannot be combined with alpha = \"opaque\"; use only one of them")?;
        }
        let needs = |named: &str| format!("requires type = {named}");
        // A material of a file or of another object accepts keys according to its own type, which `apply_material_all`
        // checks.
        let known = self.type_.is_none() && has_material;
        match self.type_ {
            Some(MaterialType::Unlit) => {
                let reason = "type = \"unlit\" shows only the base colour and reflects no light";
                keys.refuse(&["diffuse", "specular", "shininess", "roughness"], reason)?;
            }
            Some(MaterialType::Matte) => {
                let reason = "type = \"matte\" is only diffuse; omit the type for diffuse and specular";
                keys.refuse(&["specular", "shininess", "roughness"], reason)?;
            }
            Some(MaterialType::Metal | MaterialType::Glass) => {
                let reason = "metal and glass have no diffuse part; omit the type for diffuse and specular";
                keys.refuse(&["diffuse", "specular", "shininess"], reason)?;
            }
            Some(MaterialType::Principled) => {
                let reason =
                    "type = \"principled\" has metallic and roughness; omit the type for diffuse and shininess";
                keys.refuse(&PHONG_KEYS, reason)?;
            }
            Some(MaterialType::Boundary) => {
                let reason = "type = \"boundary\" is invisible by itself; it has only medium and priority";
                keys.refuse(&COMMON_KEYS[1..], reason)?;
                keys.refuse(&PHONG_KEYS, reason)?;
                keys.refuse(&GLASS_KEYS[..GLASS_KEYS.len() - 1], reason)?;
            }
            None if known => {}
            None => {
                let reason = needs("\"metal\", \"glass\" or \"principled\"");
                keys.refuse(&["roughness"], &reason)?;
            }
        }
        if self.type_ != Some(MaterialType::Metal) {
            keys.refuse(&METAL_KEYS, &needs("\"metal\""))?;
        }
        let is_clear = matches!(self.type_, Some(MaterialType::Glass | MaterialType::Principled));
        let is_boundary = self.type_ == Some(MaterialType::Boundary);
        if !known && !is_clear && !is_boundary {
            keys.refuse(&MEDIUM_KEYS, &needs("\"glass\", \"principled\" or \"boundary\""))?;
        }
        if self.medium.is_some() {
            let reason = "cannot be combined with medium, which includes absorption; use only one of them";
            keys.refuse(&["attenuation_color", "attenuation_distance"], reason)?;
            if self.thin == Some(true) {
                return Err(SceneError::schema(
                    ErrorCode::ConflictingValues,
                    "medium",
                    "cannot be combined with thin = true, because a thin wall has no inside",
                ));
            }
        }
        if !known && !is_clear && !is_boundary {
            keys.refuse(&GLASS_KEYS, &needs("\"glass\" or \"principled\""))?;
        }
        if !known && self.type_ != Some(MaterialType::Principled) {
            keys.refuse(&PRINCIPLED_KEYS, &needs("\"principled\""))?;
        }
        if self.metal.is_some() {
            keys.refuse(&["color"], "a metal has either a name or a color; use one of them")?;
        }
        if self.texture.is_none() && self.textures.is_none() {
            keys.refuse_without("\"texture\"", &["wrap"])?;
        }
        self.check_material_values()
    }

    /// Checks the values of the material keys.
    fn check_material_values(&self) -> Result<()> {
        let share = |key: &str, values: &[f64]| {
            if values.iter().all(|v| (0.0..=1.0).contains(v)) {
                return Ok(());
            }
            let given = if let [value] = values { value.to_string() } else { format!("{values:?}") };
            Err(SceneError::schema(ErrorCode::OutOfRange, key, format!("{given}; expected 0 to 1")))
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
                ErrorCode::UnknownName,
                "metal",
                format!(
                    "unknown metal {name:?}{}; available: {}",
                    suggestion(name, known.iter().copied()),
                    known.join(", ")
                ),
            ));
        }
        if self.shininess.is_some_and(|v| !(v.is_finite() && v >= 0.0)) {
            let given = self.shininess.unwrap_or_default();
            return Err(SceneError::schema(
                ErrorCode::OutOfRange,
                "shininess",
                format!("{given}; expected a finite number >= 0, the Phong exponent"),
            ));
        }
        if let Some(scale) = self.height_scale.filter(|scale| !scale.is_finite()) {
            let message = format!("{scale}; expected a finite number of metres");
            return Err(SceneError::schema(ErrorCode::OutOfRange, "height_scale", message));
        }
        if let Some(medium) = &self.medium {
            medium.build().map_err(|error| error.in_context("medium"))?;
        }
        let mut material = Material::default();
        self.apply_material(&mut material, &[]);
        material.validate().map_err(|error| SceneError::at_key("type", error))
    }

    /// Changes materials as described.
    ///
    /// # Errors
    /// [`SceneError::Schema`] if none of the materials has a described property.
    pub(crate) fn apply_material_all(
        &self,
        materials: &mut [Material],
        textures: &[TextureBinding],
        keys: &Keys<KEYS>,
    ) -> Result<()> {
        let mut unused: Vec<_> = textures.iter().map(|_| true).collect();
        for material in &mut *materials {
            for (unused, used) in unused.iter_mut().zip(self.apply_material(material, textures)) {
                *unused &= !used;
            }
        }
        if let Some((put, _)) = textures.iter().zip(unused).find(|(_, unused)| *unused) {
            let path = format!("textures.{}", put.key);
            return Err(SceneError::schema(ErrorCode::ConflictingValues, path, "requires type = \"principled\""));
        }
        if self.height_scale.is_some() && !materials.iter().any(|material| material.height_map.is_some()) {
            let message = "requires textures.height, which this object does not have";
            return Err(SceneError::schema(ErrorCode::MissingValue, "height_scale", message));
        }
        // If the description contains a type, `check_material` has already checked its keys.
        let takes = |material: &Material, key: &str| match &material.model {
            MaterialModel::Principled(_) => !METAL_KEYS.contains(&key),
            MaterialModel::Glass(_) => GLASS_KEYS.contains(&key) || MEDIUM_KEYS.contains(&key) || key == "roughness",
            MaterialModel::Boundary => MEDIUM_KEYS.contains(&key) || key == "priority",
            MaterialModel::Metal(_) => key == "roughness",
            MaterialModel::Phong { .. } | MaterialModel::Unlit => false,
        };
        let mut given = keys.given(&GLASS_KEYS);
        given.extend(keys.given(&PRINCIPLED_KEYS));
        given.extend(keys.given(&MEDIUM_KEYS));
        given.extend(keys.given(&["roughness"]));
        let lacking = |key: &&&str| !materials.iter().any(|material| takes(material, key));
        match given.iter().find(lacking) {
            Some(key) if self.type_.is_none() => Err(SceneError::schema(
                ErrorCode::ConflictingValues,
                *key,
                "no material of this object has this property; add a material type that supports the property",
            )),
            _ => Ok(()),
        }
    }

    /// Changes a material as described; returns, for each texture, true if the material has a slot for it.
    fn apply_material(&self, material: &mut Material, textures: &[TextureBinding]) -> Vec<bool> {
        // A texture of the description is shown unchanged, unless the description also contains a colour that
        // multiplies it.
        let textured = textures.iter().any(|put| put.key == "texture");
        match self.color {
            Some(Color(color)) => material.color = color,
            None if textured || self.color_is_filter() => material.color = [1.0; 3],
            None => {}
        }
        if let Some(Splat(emission)) = self.emission {
            material.emission = emission.map(|v| v as f32).into();
        }
        if let Some(opacity) = self.opacity {
            material.opacity = opacity;
            material.alpha = Alpha::Blend;
        }
        match self.alpha {
            Some(AlphaMode::Opaque) => (material.opacity, material.alpha) = (1.0, Alpha::Opaque),
            Some(AlphaMode::Blend) => material.alpha = Alpha::Blend,
            None if material.alpha == Alpha::Opaque && textures.iter().any(|put| put.translucent) => {
                material.alpha = Alpha::Blend;
            }
            None => {}
        }
        // The default priority is 0 if the description contains a type; otherwise, it is the material's previous
        // priority.
        let known = if self.type_.is_some() { 0 } else { material.priority };
        material.priority = self.priority.unwrap_or(known);
        // `check_material` has already rejected media that cannot be built.
        match &self.medium {
            Some(medium) => material.medium = medium.build().ok(),
            None if self.type_.is_some() || self.attenuation_distance.is_some() => material.medium = None,
            None => {}
        }
        let reflectance = std::mem::replace(&mut material.model, MaterialModel::Unlit);
        material.model = self.material_model(reflectance);
        let used = textures.iter().map(|put| put.bind(material, !self.has_value(put.key))).collect();
        if let (Some(scale), Some(heights)) = (self.height_scale, &mut material.height_map) {
            (heights.scale, heights.unit) = (scale, HeightUnit::Metre);
        }
        used
    }

    /// Returns the reflection model that the keys specify, based on the material's previous model.
    fn material_model(&self, base: MaterialModel) -> MaterialModel {
        match (self.type_, base) {
            (Some(MaterialType::Unlit), _) => MaterialModel::Unlit,
            (Some(MaterialType::Boundary), _) => MaterialModel::Boundary,
            (None, MaterialModel::Boundary) => MaterialModel::Boundary,
            (Some(MaterialType::Matte), _) => {
                MaterialModel::Phong { diffuse: self.diffuse.unwrap_or(1.0), specular: [0.0; 3], shininess: 32.0 }
            }
            (Some(MaterialType::Metal), _) => self.metal(),
            (Some(MaterialType::Glass), _) => MaterialModel::Glass(self.glass(Glass::default())),
            (Some(MaterialType::Principled), _) => MaterialModel::Principled(Box::new(self.principled(Principled {
                metallic: 0.0.into(),
                roughness: 0.5.into(),
                thickness: 1.0.into(),
                iridescence_thickness: [400.0; 2],
                ..Principled::default()
            }))),
            (None, MaterialModel::Principled(base)) if !self.is_phong() => {
                MaterialModel::Principled(Box::new(self.principled(*base)))
            }
            (None, MaterialModel::Glass(base)) if !self.needs_lighting() => MaterialModel::Glass(self.glass(base)),
            (None, MaterialModel::Metal(base)) if !self.needs_lighting() => {
                MaterialModel::Metal(Metal { roughness: self.roughness.unwrap_or(base.roughness), ..base })
            }
            (None, MaterialModel::Unlit) if !self.needs_lighting() => MaterialModel::Unlit,
            (None, base) => {
                let (diffuse, specular, shininess) = match base {
                    MaterialModel::Phong { diffuse, specular, shininess } => (diffuse, specular, shininess),
                    _ => (1.0, [0.0; 3], 32.0),
                };
                MaterialModel::Phong {
                    diffuse: self.diffuse.unwrap_or(diffuse),
                    specular: self.specular.map_or(specular, |Splat(rgb)| rgb.map(|v| v as f32)),
                    shininess: self.shininess.unwrap_or(shininess),
                }
            }
        }
    }

    /// True if the description contains the value that a texture multiplies.
    fn has_value(&self, key: &str) -> bool {
        !self.keys().given(&[key]).is_empty()
    }

    /// True if the colour filters transmitted or reflected light; its default is then white.
    fn color_is_filter(&self) -> bool {
        self.metal.is_some() || self.type_ == Some(MaterialType::Glass)
    }

    fn metal(&self) -> MaterialModel {
        let roughness = self.roughness.unwrap_or(0.0);
        match self.metal.as_deref().and_then(Metal::named) {
            Some(metal) => MaterialModel::Metal(Metal { roughness, ..metal }),
            None => {
                MaterialModel::Principled(Box::new(Principled { roughness: roughness.into(), ..Principled::default() }))
            }
        }
    }

    /// Returns glass with the given keys; all other values come from `base`.
    fn glass(&self, base: Glass) -> Glass {
        Glass {
            ior: self.ior.unwrap_or(base.ior),
            roughness: self.roughness.unwrap_or(base.roughness),
            thin: self.thin.unwrap_or(base.thin),
            dispersion: self.dispersion.unwrap_or(base.dispersion),
            attenuation_color: rgb(self.attenuation_color, base.attenuation_color),
            attenuation_distance: self.attenuation_distance.unwrap_or(base.attenuation_distance),
        }
    }

    /// Returns a principled material with the given keys; all other values come from another material. A given value
    /// keeps the texture that multiplies it.
    fn principled(&self, mut p: Principled) -> Principled {
        fn set<T>(value: &mut T, given: Option<T>) {
            if let Some(given) = given {
                *value = given;
            }
        }
        let color = |given: Option<Color>| given.map(|Color(rgb)| rgb);
        set(&mut p.metallic.value, self.metallic);
        set(&mut p.roughness.value, self.roughness);
        set(&mut p.ior, self.ior);
        set(&mut p.specular.value, self.specular.map(|Splat([v, ..])| v as f32));
        set(&mut p.specular_color.value, color(self.specular_color));
        set(&mut p.transmission.value, self.transmission);
        set(&mut p.thickness.value, self.thin.map(|thin| f32::from(u8::from(!thin))));
        set(&mut p.attenuation_color, color(self.attenuation_color));
        set(&mut p.attenuation_distance, self.attenuation_distance);
        set(&mut p.dispersion, self.dispersion);
        set(&mut p.clearcoat.value, self.clearcoat);
        set(&mut p.clearcoat_roughness.value, self.clearcoat_roughness);
        set(&mut p.sheen_color.value, color(self.sheen_color));
        set(&mut p.sheen_roughness.value, self.sheen_roughness);
        set(&mut p.iridescence.value, self.iridescence);
        set(&mut p.iridescence_ior, self.iridescence_ior);
        set(&mut p.iridescence_thickness, self.iridescence_thickness.map(|v| [v; 2]));
        set(&mut p.anisotropy.value, self.anisotropy);
        set(&mut p.anisotropy_rotation, self.anisotropy_rotation.map(|v| v.to_radians() as f32));
        set(&mut p.diffuse_transmission.value, self.diffuse_transmission);
        set(&mut p.diffuse_transmission_color.value, color(self.diffuse_transmission_color));
        p
    }

    /// True if a key that only the Phong model has is given.
    fn is_phong(&self) -> bool {
        self.diffuse.is_some() || self.shininess.is_some()
    }

    /// True if the description contains a key that has no effect without light.
    fn needs_lighting(&self) -> bool {
        self.diffuse.is_some() || self.specular.is_some() || self.shininess.is_some()
    }
}

/// The given colour, or `otherwise` if no colour is given.
fn rgb(given: Option<Color>, otherwise: Rgb) -> Rgb {
    given.map_or(otherwise, |Color(rgb)| rgb)
}

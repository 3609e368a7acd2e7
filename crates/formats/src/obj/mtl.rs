//! MTL: materials of OBJ files (Alias Wavefront, 1995, appendix "Material Library File"), with the keys for physically
//! based materials (Pr, Pm, Ps, Pc, Pcr, aniso, anisor, norm) that Clara.io, Blender and others write.
//!
//! A material with any of those keys, or with an illumination model that refracts, is principled; all others use the
//! Phong model with Kd, Ks and Ns. Colours are interpreted as linear, as written by Blender. Values that differ from
//! their default and have no equivalent cause a notice.

use std::ops::RangeInclusive;
use std::path::Path;

use raycam_scene::color::Rgb;
use raycam_scene::{
    Alpha, ErrorCode, HeightMap, HeightUnit, Material, MaterialModel, NormalMap, Notice, NoticeCode, Principled,
    TextureSlot,
};

use crate::error::{FormatError, Location, Result};
use crate::io::Diagnostics;
use crate::io::lexer::{self, Lines, Words};
use crate::obj::mtl_map::{self, MapRole, MtlMap};

/// Maximum number of materials in one file.
const MAX_MATERIALS: usize = 1 << 16;

/// Material before its textures are read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MtlMaterial {
    /// The name as bytes, because names need not be UTF-8.
    pub(crate) name: Vec<u8>,
    pub(crate) line: usize,
    /// Kd. If the colour is missing, an image is shown unchanged; without an image, the colour is light grey.
    diffuse: Option<Rgb>,
    specular: Rgb,
    emission: Rgb,
    shininess: f32,
    opacity: f32,
    /// Transmittance (Tf).
    filter: Rgb,
    ior: f32,
    /// Illumination model: 0 and 1 have no highlights, 6 and 7 refract.
    illumination: i64,
    /// Keys of physically based materials, if there are any.
    principled: Option<Principled>,
    pub(crate) maps: Vec<MtlMap>,
}

impl MtlMaterial {
    /// Creates a material with only a linear colour and an opacity.
    pub(crate) fn plain(name: &[u8], color: Rgb, opacity: f32) -> Self {
        let share = |value: f32| if value.is_finite() { value.clamp(0.0, 1.0) } else { 1.0 };
        Self { diffuse: Some(color.map(share)), opacity: share(opacity), ..Self::with_defaults(name) }
    }

    /// Creates a material with the values that apply if no statement sets them.
    fn with_defaults(name: &[u8]) -> Self {
        Self {
            name: name.into(),
            line: 0,
            diffuse: None,
            specular: [0.0; 3],
            emission: [0.0; 3],
            shininess: 32.0,
            opacity: 1.0,
            filter: [1.0; 3],
            ior: 1.0,
            illumination: 2,
            principled: None,
            maps: Vec::new(),
        }
    }

    /// Converts to a material of a world, with the texture of each map.
    pub(crate) fn material(
        &self,
        path: &Path,
        textures: &[(MapRole, TextureSlot, f32)],
        notices: &mut Vec<Notice>,
    ) -> Material {
        let refracts = matches!(self.illumination, 6 | 7);
        let slot = |role| (textures.iter().rev()).find(|&&(r, ..)| r == role);
        let texture = |role| slot(role).map(|&(_, slot, _)| slot);
        let image = texture(MapRole::Color);
        let diffuse = self.diffuse.unwrap_or(if image.is_some() { [1.0; 3] } else { [0.8; 3] });
        if image.is_some() && diffuse == [0.0; 3] && !refracts {
            notices.push(Notice::new(NoticeCode::Implausible, format!(
                "{}:{}: material {:?} has Kd 0 0 0, which multiplies the image of map_Kd and makes it black; use Kd 1 \
                 1 1 to show the image",
                path.display(),
                self.line,
                lexer::name(&self.name),
            )));
        }
        let mut material = Material {
            name: lexer::name(&self.name),
            color: diffuse,
            texture: image,
            emission: self.emission.into(),
            ..Material::default()
        };
        material.emission.texture = texture(MapRole::Emission);
        if material.emission.texture.is_some() && self.emission == [0.0; 3] {
            material.emission.value = [1.0; 3];
        }
        material.normal_map = slot(MapRole::Normal).map(|&(_, texture, scale)| NormalMap { texture, scale });
        let unit = HeightUnit::Texel;
        material.height_map = slot(MapRole::Height).map(|&(_, texture, scale)| HeightMap { texture, scale, unit });
        if !refracts && (self.opacity < 1.0 || texture(MapRole::Opacity).is_some()) {
            material.opacity = self.opacity;
            material.alpha = Alpha::Blend;
        }
        material.model = match &self.principled {
            None if !refracts => {
                let (specular, shininess) = (self.clamped_specular(diffuse, path, notices), self.shininess);
                MaterialModel::Phong { diffuse: 1.0, specular, shininess }
            }
            given => {
                let mut principled = given.clone().unwrap_or_else(|| self.glass());
                principled.metallic.texture = texture(MapRole::Metallic);
                principled.roughness.texture = texture(MapRole::Roughness);
                principled.sheen_color.texture = texture(MapRole::Sheen);
                // A map has an effect although the default of the value is 0, because the map replaces the value.
                if principled.metallic.texture.is_some() && principled.metallic.value == 0.0 {
                    principled.metallic.value = 1.0;
                }
                if principled.sheen_color.texture.is_some() && principled.sheen_color.value == [0.0; 3] {
                    principled.sheen_color.value = [1.0; 3];
                }
                if self.ior > 1.0 {
                    principled.ior = self.ior;
                }
                if refracts {
                    principled.transmission = 1.0.into();
                    principled.thickness = 1.0.into();
                    material.color = self.filter;
                }
                MaterialModel::Principled(Box::new(principled))
            }
        };
        material
    }

    /// Ks, reduced with a notice if Kd and Ks reflect more light than arrives.
    fn clamped_specular(&self, diffuse: Rgb, path: &Path, notices: &mut Vec<Notice>) -> Rgb {
        let wanted = if self.illumination < 2 { [0.0; 3] } else { self.specular };
        let mut specular = wanted;
        for (ks, kd) in specular.iter_mut().zip(diffuse) {
            *ks = ks.min(1.0 - kd);
        }
        if specular != wanted {
            notices.push(Notice::new(NoticeCode::ClampedValue, format!(
                "{}:{}: material {:?} reflects more light than arrives (Kd + Ks > 1); Ks is reduced from {wanted:?} \
                 to {specular:?}",
                path.display(),
                self.line,
                lexer::name(&self.name),
            )));
        }
        specular
    }

    /// Principled model of a material that refracts and has no physically based key. Its roughness is computed from the
    /// exponent (Walter et al., 2007: alpha^2 = 2 / (Ns + 2)).
    fn glass(&self) -> Principled {
        Principled {
            metallic: 0.0.into(),
            roughness: (2.0 / (self.shininess + 2.0)).powf(0.25).into(),
            ..Principled::default()
        }
    }

    /// Values of the physically based keys; initially, the material is rough and not metallic.
    fn principled_mut(&mut self) -> &mut Principled {
        self.principled.get_or_insert_with(|| Principled {
            metallic: 0.0.into(),
            roughness: 1.0.into(),
            ..Principled::default()
        })
    }
}

/// Reads the materials of an MTL file, in order. Invalid values are clamped or ignored, with a notice for each kind.
pub(crate) fn parse(path: &Path, bytes: &[u8], notices: &mut Vec<Notice>) -> Result<Vec<MtlMaterial>> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut unused: Vec<(usize, String)> = Vec::new();
    let mut odd = Diagnostics::default();
    for (line, text) in Lines::new(&lexer::plain_text(bytes)) {
        let text = lexer::trim(text);
        let (key, rest) = lexer::split_word(text);
        if key.is_empty() || key[0] == b'#' {
            continue;
        }
        if key.eq_ignore_ascii_case(b"newmtl") {
            if materials.len() == MAX_MATERIALS {
                let message = format!("more than {MAX_MATERIALS} materials in one file; divide the file");
                return Err(FormatError::line(path, line, ErrorCode::TooLarge.message(message)));
            }
            materials.push(MtlMaterial { line, ..MtlMaterial::with_defaults(lexer::trim(rest)) });
            continue;
        }
        let statement = Statement { line, text, key, rest };
        match materials.last_mut() {
            Some(material) => statement.apply(material, &mut unused, &mut odd),
            None => notice_once(&mut unused, line, key),
        }
    }
    notices.extend(odd.into_notices(path));
    if !unused.is_empty() {
        let keys: Vec<_> = unused.iter().map(|(line, key)| format!("{key} (line {line})")).collect();
        notices.push(Notice::new(
            NoticeCode::IgnoredKey,
            format!("{}: unsupported statements ignored: {}", path.display(), keys.join(", ")),
        ));
    }
    Ok(materials)
}

/// A statement of a material: number and text of the line, its key and the rest of the line.
struct Statement<'a> {
    line: usize,
    text: &'a [u8],
    key: &'a [u8],
    rest: &'a [u8],
}

/// Function that sets a colour, or a number in 0..=1.
type SetColor = fn(&mut MtlMaterial, Rgb);
type SetNumber = fn(&mut MtlMaterial, f32);

/// Setters of colours by key, and true if the colour may be brighter than 1.
const COLORS: &[(&[u8], bool, SetColor)] = &[
    (b"kd", false, |m, value| m.diffuse = Some(value)),
    (b"ks", false, |m, value| m.specular = value),
    (b"ke", true, |m, value| m.emission = value),
    (b"tf", false, |m, value| m.filter = value),
];

/// Setters of numbers in 0..=1, by key.
const NUMBERS: &[(&[u8], SetNumber)] = &[
    (b"d", |m, value| m.opacity = value),
    (b"tr", |m, value| m.opacity = 1.0 - value),
    (b"pr", |m, value| m.principled_mut().roughness = value.into()),
    (b"pm", |m, value| m.principled_mut().metallic = value.into()),
    (b"ps", |m, value| m.principled_mut().sheen_color = [value; 3].into()),
    (b"pc", |m, value| m.principled_mut().clearcoat = value.into()),
    (b"pcr", |m, value| m.principled_mut().clearcoat_roughness = value.into()),
    (b"aniso", |m, value| m.principled_mut().anisotropy = value.into()),
    (b"anisor", |m, value| {
        m.principled_mut().anisotropy_rotation = std::f32::consts::TAU * value;
    }),
];

impl Statement<'_> {
    /// Changes the material according to the statement.
    fn apply(&self, material: &mut MtlMaterial, unused: &mut Vec<(usize, String)>, odd: &mut Diagnostics) {
        let lower = &self.key.to_ascii_lowercase()[..];
        if let Some((_, bright, set)) = COLORS.iter().find(|(key, ..)| *key == lower) {
            if matches!(Words(self.rest).next(), Some(b"spectral" | b"xyz")) {
                return notice_once(unused, self.line, self.text);
            }
            if let Some(value) = self.color(*bright, odd) {
                set(material, value);
            }
            return;
        }
        if let Some((_, set)) = NUMBERS.iter().find(|(key, _)| *key == lower) {
            // With `-halo`, the opacity would depend on the viewing direction.
            if Words(self.rest).next().is_some_and(|word| word.starts_with(b"-halo")) {
                return notice_once(unused, self.line, self.text);
            }
            if let Some(value) = self.unit_number(odd) {
                set(material, value);
            }
            return;
        }
        match lower {
            b"ns" => {
                if let Some(value) = self.number("0 to 1000000", 0.0..=1e6, odd) {
                    material.shininess = value as f32;
                }
            }
            b"illum" => match Words(self.rest).next().and_then(lexer::number) {
                Some(value) if value.fract() == 0.0 && (0.0..=10.0).contains(&value) => {
                    material.illumination = value as i64;
                }
                _ => self.note(NoticeCode::ReplacedValue, odd, "a whole number from 0 to 10", "ignored"),
            },
            b"ni" => match Words(self.rest).next().and_then(lexer::number) {
                Some(value) if (0.001..=10.0).contains(&value) => material.ior = value as f32,
                // Several exporters write the index 0 if they do not know it.
                Some(0.0) => {}
                _ => {
                    self.note(NoticeCode::ReplacedValue, odd, "a number from 0.001 to 10, or 0 for unknown", "ignored")
                }
            },
            _ => match MapRole::from_key(lower) {
                Some(role) => {
                    if matches!(role, MapRole::Roughness | MapRole::Metallic | MapRole::Sheen) {
                        material.principled_mut();
                    }
                    material.maps.extend(mtl_map::read(self.line, role, self.key, self.rest, odd));
                }
                None if is_default_value(lower, self.rest) => {}
                None => notice_once(unused, self.line, self.key),
            },
        }
    }

    /// Adds a notice about an invalid value, once for each key and each consequence.
    fn note(&self, code: NoticeCode, odd: &mut Diagnostics, expected: &str, done: &str) {
        let (key, value) = (String::from_utf8_lossy(self.key), lexer::for_message(lexer::trim(self.rest)));
        let message = format!("{key} is {value}; expected {expected}; the value is {done}");
        odd.note_kind(code, &format!("{} {done}", key.to_lowercase()), Location::Line(self.line), message);
    }

    /// The statement's first number, clamped to a range; `None` if the word is not a number.
    fn number(&self, expected: &str, range: RangeInclusive<f64>, odd: &mut Diagnostics) -> Option<f64> {
        let expected = format!("a number from {expected}");
        match Words(self.rest).next().and_then(lexer::number).filter(|value| !value.is_nan()) {
            Some(value) if range.contains(&value) => Some(value),
            Some(value) => {
                self.note(NoticeCode::ClampedValue, odd, &expected, "clamped");
                Some(value.clamp(*range.start(), *range.end()))
            }
            None => {
                self.note(NoticeCode::ReplacedValue, odd, &expected, "ignored");
                None
            }
        }
    }

    /// Reads one number for all channels, or three numbers, which may exceed 1 if `bright`. Other values are clamped,
    /// and whole numbers up to 255 are interpreted as bytes.
    fn color(&self, bright: bool, odd: &mut Diagnostics) -> Option<Rgb> {
        let expected = format!("1 or 3 numbers {}", if bright { "of 0 or more" } else { "from 0 to 1" });
        let values: Option<Vec<f64>> = Words(self.rest).map(lexer::number).collect();
        let values = values.filter(|values| matches!(values.len(), 1 | 3 | 4) && values.iter().all(|v| v.is_finite()));
        let values = match values.as_deref() {
            // The specification: "If only r is specified, then g, and b are assumed to be equal to r."
            Some(&[grey]) => [grey; 3],
            Some(&[r, g, b]) => [r, g, b],
            Some(&[r, g, b, _]) => {
                self.note(NoticeCode::ReplacedValue, odd, &expected, "used without the fourth number");
                [r, g, b]
            }
            _ => {
                self.note(NoticeCode::ReplacedValue, odd, &expected, "ignored");
                return None;
            }
        };
        let most = if bright { 1e30 } else { 1.0 };
        if values.iter().all(|value| (0.0..=most).contains(value)) {
            return Some(values.map(|value| value as f32));
        }
        let bytes = |value: &f64| value.fract() == 0.0 && (0.0..=255.0).contains(value);
        if values.iter().all(bytes) && values.iter().any(|&value| value > 16.0) {
            self.note(NoticeCode::AssumedConvention, odd, &expected, "treated as 0 to 255");
            return Some(values.map(|value| (value / 255.0) as f32));
        }
        self.note(NoticeCode::ClampedValue, odd, &expected, "clamped");
        Some(values.map(|value| value.clamp(0.0, most) as f32))
    }

    /// The statement's number, clamped to 0..=1; `None` if the word is not a number, and for `Tr 1`.
    fn unit_number(&self, odd: &mut Diagnostics) -> Option<f32> {
        // Programs that use Tr as opacity instead of transparency write 1 for opaque.
        let value = self.number("0 to 1", 0.0..=1.0, odd)? as f32;
        if value == 1.0 && self.key.eq_ignore_ascii_case(b"tr") {
            let message = "Tr 1 (invisible) is treated as opaque, because some exporters write 1 for opaque; for \
                           invisible, use d 0";
            odd.note(NoticeCode::AssumedConvention, Location::Line(self.line), message);
            return None;
        }
        Some(value)
    }
}

/// Records each key once, up to a maximum number of keys.
fn notice_once(unused: &mut Vec<(usize, String)>, line: usize, key: &[u8]) {
    let key = String::from_utf8_lossy(&key[..key.len().min(40)]).escape_debug().to_string();
    if unused.len() < 12 && unused.iter().all(|(_, known)| *known != key) {
        unused.push((line, key));
    }
}

/// True if an unused key has its default value.
fn is_default_value(key: &[u8], rest: &[u8]) -> bool {
    let all = |expected: f64| {
        let mut values = Words(rest).map(lexer::number).peekable();
        values.peek().is_some() && values.all(|v| v == Some(expected))
    };
    match key {
        b"ka" => all(0.0),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn damaged_material_libraries_are_read_without_a_panic() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fuzz");
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let bytes = fs::read(&path).unwrap();
            for length in 0..bytes.len() {
                let text = [b"newmtl m\n", &bytes[..length]].concat();
                let mut notices = Vec::new();
                match parse(&path, &text, &mut notices) {
                    Ok(materials) => assert_eq!(materials[0].name, b"m"),
                    Err(error) => assert!(error.to_string().contains("fuzz"), "{error}"),
                }
            }
        }
    }
}

//! MTL: the materials of OBJ files (Alias Wavefront, 1995, appendix "Material Library File").
//!
//! Kd, Ks, Ns and map_Kd are used, with Kd and Ks taken as linear, as Blender writes them; everything else that says more
//! than its default is named in a notice.

use std::path::Path;

use raycam_scene::color::Rgb;
use raycam_scene::{Material, Reflectance, TextureSlot};

use crate::error::FormatError;
use crate::text::{self, Lines, Words};

/// A material before its texture is read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MtlMaterial {
    pub(crate) name: String,
    line: usize,
    diffuse: Rgb,
    specular: Rgb,
    shininess: f32,
    /// 0 and 1 have no highlights.
    illumination: i64,
    pub(crate) map: Option<Map>,
}

/// `map_Kd`.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Map {
    pub(crate) file: String,
    pub(crate) clamp: bool,
}

impl MtlMaterial {
    /// Before its first statement.
    fn grey(name: &str) -> Self {
        Self {
            name: name.into(),
            line: 0,
            diffuse: [0.8; 3],
            specular: [0.0; 3],
            shininess: 32.0,
            illumination: 2,
            map: None,
        }
    }

    /// As a material of a world. Where Kd and Ks reflect more light than falls in, Ks gives way, with a notice.
    pub(crate) fn material(
        &self,
        path: &Path,
        texture: Option<usize>,
        notices: &mut Vec<String>,
    ) -> Material {
        let wanted = if self.illumination < 2 {
            [0.0; 3]
        } else {
            self.specular
        };
        let mut specular = wanted;
        for (ks, kd) in specular.iter_mut().zip(self.diffuse) {
            *ks = ks.min(1.0 - kd);
        }
        if specular != wanted {
            notices.push(format!(
                "{}:{}: material {:?} reflects more than all light (Kd + Ks > 1): Ks reduced from {wanted:?} to {specular:?}",
                path.display(),
                self.line,
                self.name,
            ));
        }
        Material {
            name: self.name.clone(),
            color: self.diffuse,
            texture: texture.map(TextureSlot::plain),
            reflectance: Reflectance::Lecture {
                diffuse: 1.0,
                specular,
                shininess: self.shininess,
            },
            ..Material::default()
        }
    }
}

/// The materials of an MTL file, in its order.
pub(crate) fn parse(
    path: &Path,
    bytes: &[u8],
    notices: &mut Vec<String>,
) -> Result<Vec<MtlMaterial>, FormatError> {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut unused: Vec<(usize, String)> = Vec::new();
    for (line, text) in Lines::new(text::plain(path, bytes)?) {
        let text = text::trim(text);
        let (key, rest) = text::split_word(text);
        if key.is_empty() || key[0] == b'#' {
            continue;
        }
        if key.eq_ignore_ascii_case(b"newmtl") {
            if materials.len() == 1 << 16 {
                return Err(FormatError::line(
                    path,
                    line,
                    "more than 65536 materials in one file",
                ));
            }
            materials.push(MtlMaterial {
                line,
                ..MtlMaterial::grey(&text::name(rest))
            });
            continue;
        }
        let Some(material) = materials.last_mut() else {
            notice_once(&mut unused, line, key);
            continue;
        };
        let fail = |message: String| Err(FormatError::line(path, line, message));
        match &key.to_ascii_lowercase()[..] {
            b"kd" | b"ks" => match color(rest) {
                Ok(value) if key.eq_ignore_ascii_case(b"kd") => material.diffuse = value,
                Ok(value) => material.specular = value,
                Err(Reason::Kind) => notice_once(&mut unused, line, text),
                Err(Reason::Value) => {
                    let key = text::shown(key);
                    let value = text::shown(text::trim(rest));
                    return fail(format!(
                        "{key} is {value}, expected 1 or 3 numbers in 0..=1"
                    ));
                }
            },
            b"ns" => match Words(rest).next().and_then(text::number) {
                Some(value) if (0.0..=1e6).contains(&value) => material.shininess = value as f32,
                // Blender wrote -1.96 for a hardness of 0.
                Some(value) if (-2.0..0.0).contains(&value) => {
                    material.shininess = 0.0;
                    notices.push(format!(
                        "{}:{line}: Ns is {value}, taken as 0",
                        path.display()
                    ));
                }
                _ => {
                    let value = text::shown(text::trim(rest));
                    return fail(format!("Ns is {value}, expected a number in 0..=1000000"));
                }
            },
            b"illum" => match Words(rest).next().and_then(text::integer) {
                Some(value @ 0..=10) => material.illumination = value,
                _ => {
                    let value = text::shown(text::trim(rest));
                    return fail(format!("illum is {value}, expected 0 to 10"));
                }
            },
            b"map_kd" => material.map = map(path, line, rest, notices)?,
            other if says_nothing(other, rest) => {}
            _ => notice_once(&mut unused, line, key),
        }
    }
    if !unused.is_empty() {
        let keys: Vec<_> = unused
            .iter()
            .map(|(line, key)| format!("{key} (line {line})"))
            .collect();
        notices.push(format!("{}: not used: {}", path.display(), keys.join(", ")));
    }
    Ok(materials)
}

/// Notes each key once, and no more than a few of them.
fn notice_once(unused: &mut Vec<(usize, String)>, line: usize, key: &[u8]) {
    let key = String::from_utf8_lossy(&key[..key.len().min(40)])
        .escape_debug()
        .to_string();
    if unused.len() < 12 && unused.iter().all(|(_, known)| *known != key) {
        unused.push((line, key));
    }
}

/// Whether a key that raycam has no use for has the value of its absence.
fn says_nothing(key: &[u8], rest: &[u8]) -> bool {
    let all = |expected: f64| {
        let mut values = Words(rest).map(text::number).peekable();
        values.peek().is_some() && values.all(|v| v == Some(expected))
    };
    match key {
        b"ka" | b"ke" | b"tr" | b"pr" | b"pm" | b"ps" | b"pc" | b"pcr" | b"aniso" | b"anisor" => {
            all(0.0)
        }
        b"d" | b"tf" | b"ni" => all(1.0),
        _ => false,
    }
}

enum Reason {
    /// Given as a spectrum or in CIE XYZ.
    Kind,
    Value,
}

fn color(rest: &[u8]) -> Result<Rgb, Reason> {
    let mut values = [0.0; 3];
    let mut count = 0;
    for word in Words(rest) {
        if count == 0 && (word == b"spectral" || word == b"xyz") {
            return Err(Reason::Kind);
        }
        let value = text::number(word)
            .filter(|v| (0.0..=1.0).contains(v))
            .ok_or(Reason::Value)?;
        *values.get_mut(count).ok_or(Reason::Value)? = value as f32;
        count += 1;
    }
    match count {
        // "If only r is specified, then g, and b are assumed to be equal to r."
        1 => Ok([values[0]; 3]),
        3 => Ok(values),
        _ => Err(Reason::Value),
    }
}

/// The file and options of a `map_Kd`. The file name is the rest of the line and may have spaces.
fn map(
    path: &Path,
    line: usize,
    rest: &[u8],
    notices: &mut Vec<String>,
) -> Result<Option<Map>, FormatError> {
    let mut rest = text::trim(rest);
    let mut clamp = false;
    while rest.first() == Some(&b'-') {
        let (option, mut after) = text::split_word(rest);
        let option = option.to_ascii_lowercase();
        let mut values: Vec<&[u8]> = Vec::new();
        let (least, most) = match &option[..] {
            b"-clamp" | b"-blendu" | b"-blendv" | b"-cc" | b"-bm" | b"-boost" | b"-texres"
            | b"-imfchan" | b"-type" => (1, 1),
            b"-mm" => (2, 2),
            b"-s" | b"-o" | b"-t" => (1, 3),
            // A file name may begin with a dash.
            _ => break,
        };
        while values.len() < most {
            let (word, then) = text::split_word(after);
            let optional = values.len() >= least;
            if word.is_empty()
                || optional && (text::number(word).is_none() || text::trim(then).is_empty())
            {
                break;
            }
            values.push(word);
            after = then;
        }
        if values.len() < least {
            let message = format!("map_Kd: option {} without its value", text::shown(&option));
            return Err(FormatError::line(path, line, message));
        }
        let neutral = match &option[..] {
            b"-clamp" => {
                clamp = values[0].eq_ignore_ascii_case(b"on");
                true
            }
            b"-s" => values.iter().all(|v| text::number(v) == Some(1.0)),
            b"-o" | b"-t" => values.iter().all(|v| text::number(v) == Some(0.0)),
            b"-mm" => values
                .iter()
                .map(|v| text::number(v))
                .eq([Some(0.0), Some(1.0)]),
            b"-cc" => !values[0].eq_ignore_ascii_case(b"on"),
            // How to filter, and what bump maps need: nothing that changes a colour looked up.
            b"-imfchan" => false,
            _ => true,
        };
        if !neutral {
            let given = String::from_utf8_lossy(&rest[..rest.len() - after.len()]).into_owned();
            notices.push(format!(
                "{}:{line}: map_Kd option {given:?} is not applied to the texture",
                path.display()
            ));
        }
        rest = text::trim(after);
    }
    if rest.is_empty() {
        notices.push(format!(
            "{}:{line}: map_Kd without a file name",
            path.display()
        ));
        return Ok(None);
    }
    Ok(Some(Map {
        file: text::name(rest),
        clamp,
    }))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn damage_is_never_fatal() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fuzz");
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let bytes = fs::read(&path).unwrap();
            for length in 0..bytes.len() {
                let text = [b"newmtl m\n", &bytes[..length]].concat();
                let mut notices = Vec::new();
                match parse(&path, &text, &mut notices) {
                    Ok(materials) => assert_eq!(materials[0].name, "m"),
                    Err(error) => assert!(error.to_string().contains("fuzz"), "{error}"),
                }
            }
        }
    }
}

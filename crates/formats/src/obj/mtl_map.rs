//! Images that an MTL material refers to, and their mapping onto surfaces.

use std::path::Path;

use raycam_scene::{Notice, NoticeCode, Texture, Wrap};

use crate::error::{Location, Result};
use crate::image::texture;
use crate::io::{AssetRoot, Diagnostics, lexer};
use raycam_scene::ColorUse;

/// Use of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum MapRole {
    Color,
    Emission,
    Opacity,
    Roughness,
    Metallic,
    Sheen,
    Normal,
    /// A [`MapRole::Normal`] whose image turns out to contain heights.
    Height,
}

impl MapRole {
    /// Role of a key in lower case.
    pub(crate) fn from_key(key: &[u8]) -> Option<Self> {
        Some(match key {
            b"map_kd" => Self::Color,
            b"map_ke" => Self::Emission,
            b"map_d" => Self::Opacity,
            b"map_pr" => Self::Roughness,
            b"map_pm" => Self::Metallic,
            b"map_ps" => Self::Sheen,
            b"norm" | b"map_norm" | b"map_bump" | b"bump" => Self::Normal,
            _ => return None,
        })
    }
}

/// Image of a material: its role, file and options.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MtlMap {
    pub(crate) role: MapRole,
    pub(crate) file: Vec<u8>,
    pub(crate) clamp: bool,
    /// `-bm`: strength of a bump or normal map.
    pub(crate) strength: f32,
    /// Transform of texture coordinates from the mesh, whose origin is at the top left, to the image.
    pub(crate) image_from_mesh: [[f32; 3]; 2],
    /// Number of the line that contains the map.
    pub(crate) line: usize,
}

impl MtlMap {
    /// True if both maps have the same transform and clamping.
    pub(crate) fn same_placement(&self, other: &Self) -> bool {
        (self.image_from_mesh, self.clamp) == (other.image_from_mesh, other.clamp)
    }

    /// The map's image as a texture, if the image can be read.
    pub(crate) fn texture(
        &self,
        library: &Path,
        color_use: ColorUse,
        assets: &mut AssetRoot,
        notices: &mut Vec<Notice>,
    ) -> Result<Option<Texture>> {
        let wrap = if self.clamp { Wrap::Clamp } else { Wrap::Repeat };
        texture::optional_texture(library, &self.file, wrap, color_use, assets, notices)
    }
}

/// File and options of a map. The file name is the rest of the line and may contain spaces; options precede the name,
/// but some programs write options after the name.
pub(crate) fn read(line: usize, role: MapRole, key: &[u8], rest: &[u8], odd: &mut Diagnostics) -> Option<MtlMap> {
    let key = String::from_utf8_lossy(key);
    let mut options = MapOptions::default();
    let (mut given, mut rest) = leading_options(rest, true);
    for (at, _) in rest.iter().enumerate().filter(|&(at, _)| at > 0 && rest[at..].starts_with(b" -")) {
        let (behind, after) = leading_options(&rest[at..], false);
        if after.is_empty() && behind.iter().all(|option| option.has_values) {
            given.extend(behind);
            rest = lexer::trim(&rest[..at]);
            break;
        }
    }
    for option in &given {
        let text = String::from_utf8_lossy(option.text);
        if !option.has_values {
            odd.note(
                NoticeCode::ReplacedValue,
                Location::Line(line),
                format!("{key}: option {text:?} has no value; ignored"),
            );
        } else if !options.apply(&option.name, &option.values, role) {
            odd.note(NoticeCode::IgnoredKey, Location::Line(line), format!("{key}: option {text:?} is ignored"));
        }
    }
    if rest.is_empty() {
        odd.note(NoticeCode::ReplacedValue, Location::Line(line), format!("{key} without a file name"));
        return None;
    }
    // In the file, v increases upwards: 1 - v' = s (1 - v) + o.
    let ([su, sv], [ou, ov]) = (options.scale, options.offset);
    let image_from_mesh = [[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]].map(|row| row.map(|v| v as f32));
    Some(MtlMap {
        role,
        file: lexer::name_bytes(rest),
        clamp: options.clamp,
        strength: options.strength,
        image_from_mesh,
        line,
    })
}

/// An option and its values, as written in the file.
struct Given<'a> {
    text: &'a [u8],
    /// Name of the option in lower case.
    name: Vec<u8>,
    values: Vec<&'a [u8]>,
    /// False if the option has fewer values than required.
    has_values: bool,
}

/// Options at the beginning of a text, and the rest of the text. If `leaves_name` is true, the last word is a
/// file name and not the value of an option.
fn leading_options(text: &[u8], leaves_name: bool) -> (Vec<Given<'_>>, &[u8]) {
    let mut rest = lexer::trim(text);
    let mut found = Vec::new();
    while rest.first() == Some(&b'-') {
        let (option, after) = lexer::split_word(rest);
        let name = option.to_ascii_lowercase();
        // A file name may begin with a dash.
        let Some((least, most)) = value_counts(&name) else { break };
        let (values, after) = option_values(after, least, most, leaves_name);
        let text = lexer::trim(&rest[..rest.len() - after.len()]);
        let has_values = values.len() >= least;
        found.push(Given { text, name, values, has_values });
        rest = if has_values { lexer::trim(after) } else { b"" };
    }
    (found, rest)
}

/// Minimum and maximum number of values of an option; `None` if the option is unknown.
fn value_counts(option: &[u8]) -> Option<(usize, usize)> {
    match option {
        b"-clamp" | b"-blendu" | b"-blendv" | b"-cc" | b"-bm" | b"-boost" | b"-texres" | b"-imfchan" | b"-type"
        | b"-colorspace" => Some((1, 1)),
        b"-mm" => Some((2, 2)),
        b"-s" | b"-o" | b"-t" => Some((1, 3)),
        _ => None,
    }
}

/// Values of an option, and the text after them. Values beyond `least` must be numbers. If `leaves_name` is true, the
/// last word of the text is not an optional value, because it is the file name.
fn option_values(mut after: &[u8], least: usize, most: usize, leaves_name: bool) -> (Vec<&[u8]>, &[u8]) {
    let mut values: Vec<&[u8]> = Vec::new();
    while values.len() < most {
        let (word, then) = lexer::split_word(after);
        let optional = values.len() >= least;
        let takes_name = leaves_name && lexer::trim(then).is_empty();
        if word.is_empty() || optional && (lexer::number(word).is_none() || takes_name) {
            break;
        }
        values.push(word);
        after = then;
    }
    (values, after)
}

struct MapOptions {
    clamp: bool,
    strength: f32,
    scale: [f64; 2],
    offset: [f64; 2],
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { clamp: false, strength: 1.0, scale: [1.0; 2], offset: [0.0; 2] }
    }
}

impl MapOptions {
    /// Applies an option; false if its value is not supported.
    fn apply(&mut self, option: &[u8], values: &[&[u8]], role: MapRole) -> bool {
        let numbers = || values.iter().map(|v| lexer::number(v).filter(|v| v.abs() < 1e6));
        // Returns two numbers, with defaults for missing ones; `None` if one of the words is not a number.
        let pair = |default: f64| {
            let mut pair = [default; 2];
            for (to, number) in pair.iter_mut().zip(numbers()) {
                *to = number?;
            }
            Some(pair)
        };
        match option {
            b"-clamp" => {
                self.clamp = values[0].eq_ignore_ascii_case(b"on");
                true
            }
            b"-bm" => match numbers().next().flatten() {
                Some(value) => {
                    self.strength = value as f32;
                    role == MapRole::Normal || value == 1.0
                }
                None => false,
            },
            b"-s" => pair(1.0).inspect(|given| self.scale = *given).is_some(),
            b"-o" => pair(0.0).inspect(|given| self.offset = *given).is_some(),
            b"-t" => numbers().all(|v| v == Some(0.0)),
            b"-mm" => numbers().eq([Some(0.0), Some(1.0)]),
            b"-cc" => !values[0].eq_ignore_ascii_case(b"on"),
            // The option is accepted if it specifies the colour space in which maps of this role are read anyway.
            b"-colorspace" => {
                let color = matches!(role, MapRole::Color | MapRole::Emission);
                values[0].eq_ignore_ascii_case(if color { b"sRGB" } else { b"linear" })
            }
            b"-imfchan" => role == MapRole::Opacity,
            // Filtering options do not change the values of texels.
            _ => true,
        }
    }
}

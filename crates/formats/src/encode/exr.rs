//! Writing of OpenEXR: all channels of a frame in one part, with lossless compression.

use ::exr::image::write::WritableImage;
use ::exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer as Part};
use ::exr::meta::attribute::{AttributeValue, LineOrder, Text};
use ::exr::meta::header::{ImageAttributes, LayerAttributes};
use ::exr::prelude::{Compression, IntegerBounds, Vec2};
use glam::DMat3;
use half::f16;
use raycam_scene::camera::Center;
use raycam_scene::{Camera, PixelCenter};

use crate::error::{FormatError, Result};

/// Channel of a frame: an EXR layer.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// `color`, `depth`, `normal`, ...; unique within the file.
    pub name: &'a str,
    /// Number of values per pixel, 1 to 4.
    pub components: usize,
    /// Values row by row from the top left; the components of a pixel are adjacent.
    pub samples: LayerSamples<'a>,
}

/// Values of a layer, and their storage type.
#[derive(Clone, Copy, Debug)]
pub enum LayerSamples<'a> {
    /// Stored as float32, exactly.
    F32(&'a [f32]),
    /// Stored as float16, rounded to nearest even; values beyond 65504 become infinite.
    F16(&'a [f32]),
    /// Ids, stored as EXR's uint32 with the same bits, so that none is rounded: -1 (background) is 4294967295, and
    /// NumPy's `.view("int32")` returns the ids.
    Id(&'a [i32]),
}

impl LayerSamples<'_> {
    fn len(&self) -> usize {
        match self {
            Self::F32(v) | Self::F16(v) => v.len(),
            Self::Id(v) => v.len(),
        }
    }

    /// Returns one component of every pixel as the samples of an EXR channel.
    fn plane(&self, component: usize, components: usize) -> FlatSamples {
        fn every<T: Copy>(data: &[T], first: usize, step: usize) -> impl Iterator<Item = T> + '_ {
            data.iter().skip(first).step_by(step).copied()
        }
        match self {
            Self::F32(v) => FlatSamples::F32(every(v, component, components).collect()),
            Self::F16(v) => FlatSamples::F16(every(v, component, components).map(f16::from_f32).collect()),
            Self::Id(v) => FlatSamples::U32(every(v, component, components).map(|id| id.cast_unsigned()).collect()),
        }
    }
}

/// EXR channel names of a layer. `color` is R, G, B, A without a prefix, so that every viewer shows it. Other layers
/// have a prefix: `albedo.R`, `depth.Z`, `distance.Z`; ids `instance.id`; other single values `coverage.V`. Two
/// components are U and V, more are X, Y, Z, W.
pub fn channel_names(layer: &Layer<'_>) -> Result<Vec<String>> {
    let name = layer.name;
    let letters: &[&str] = match (name, layer.components, &layer.samples) {
        ("color" | "albedo" | "shadow" | "transmittance", 1..=4, _) => &["R", "G", "B", "A"],
        ("emission" | "direct" | "indirect" | "diffuse" | "specular" | "volume", 3, _) => &["R", "G", "B"],
        (light, 3, _) if light.starts_with("light:") => &["R", "G", "B"],
        ("depth" | "distance", 1, _) => &["Z"],
        (_, 1, LayerSamples::Id(_)) => &["id"],
        (_, 1, _) => &["V"],
        (_, 2, _) => &["U", "V"],
        (_, 3 | 4, _) => &["X", "Y", "Z", "W"],
        (_, n, _) => {
            return Err(FormatError::encode(format!("EXR: layer {name:?} has {n} components; expected 1 to 4")));
        }
    };
    let prefix = if name == "color" { String::new() } else { format!("{name}.") };
    Ok(letters[..layer.components].iter().map(|letter| format!("{prefix}{letter}")).collect())
}

/// Returns an EXR file of `size` (columns, rows): one part of scan lines, ZIP-compressed. Equal input gives equal
/// bytes.
///
/// The header always contains `raycam.version` and `raycam.conventions`, and every `(key, value)` of `notes`, as
/// strings. With a camera, it also contains:
///
/// * `raycam.K` and `raycam.R` (m33d, row-major) and `raycam.C` (v3d),
/// * `raycam.P` (m44d: the 3 x 4 matrix and a row 0 0 0 1),
/// * `raycam.pixelCenter` (`integer` or `half`),
/// * with a lens model that has coefficients, `raycam.lens` (the model's name, such as `opencv`) and
///   `raycam.distortion` (the coefficients as decimals separated by spaces).
///
/// # Errors
/// An error if there are no layers, if a layer does not have columns x rows x components values, or if two layers have
/// the same channels. An error if a name is empty or not plain text.
pub fn encode(
    size: [u32; 2],
    layers: &[Layer<'_>],
    camera: Option<&Camera>,
    notes: &[(&str, &str)],
) -> Result<Vec<u8>> {
    let [columns, rows] = size.map(|side| side as usize);
    if columns == 0 || rows == 0 || layers.is_empty() {
        return Err(FormatError::encode(format!(
            "EXR: {} layers of {columns} x {rows} pixels; expected at least one layer, column and row",
            layers.len()
        )));
    }
    let channels = channels_of(layers, [columns, rows])?;
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions((columns, rows)));
    let mut header = camera.map_or(Vec::new(), camera_attributes);
    header.push(("raycam.version", string_attribute(env!("CARGO_PKG_VERSION"))));
    header.push(("raycam.conventions", string_attribute(CONVENTIONS)));
    header.extend(notes.iter().map(|(key, value)| (*key, string_attribute(value))));
    for (key, value) in header {
        if attributes.other.insert(text(key)?, value).is_some() {
            return Err(FormatError::encode(format!("EXR: the header contains {key} twice")));
        }
    }
    let image = Image {
        attributes,
        layer_data: Part {
            channel_data: AnyChannels { list: channels.into() },
            attributes: LayerAttributes::default(),
            size: Vec2(columns, rows),
            encoding: Encoding {
                compression: Compression::ZIP16,
                blocks: Blocks::ScanLines,
                line_order: LineOrder::Increasing,
            },
        },
    };
    let mut file = std::io::Cursor::new(Vec::new());
    // Encoding is not parallel, because the crate uses rayon's global pool, which does not survive a fork.
    image.write().non_parallel().to_buffered(&mut file).map_err(|e| FormatError::encode(format!("EXR: {e}")))?;
    let mut file = file.into_inner();
    sort_header(&mut file);
    Ok(file)
}

/// Channels of all layers, sorted by name.
fn channels_of(layers: &[Layer<'_>], [columns, rows]: [usize; 2]) -> Result<Vec<AnyChannel<FlatSamples>>> {
    let mut channels = Vec::new();
    for layer in layers {
        let expected = columns.checked_mul(rows).and_then(|n| n.checked_mul(layer.components));
        if expected != Some(layer.samples.len()) {
            return Err(FormatError::encode(format!(
                "EXR: layer {:?} has {} values; expected {columns} x {rows} x {}",
                layer.name,
                layer.samples.len(),
                layer.components
            )));
        }
        for (component, name) in channel_names(layer)?.iter().enumerate() {
            channels.push(AnyChannel {
                name: text(name)?,
                sample_data: layer.samples.plane(component, layer.components),
                quantize_linearly: false,
                sampling: Vec2(1, 1),
            });
        }
    }
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    if let Some(twice) = channels.windows(2).find(|pair| pair[0].name == pair[1].name) {
        return Err(FormatError::encode(format!("EXR: two channels are named {}", twice[0].name)));
    }
    Ok(channels)
}

/// Sorts the header's attributes by name, because the crate writes them in the order of a hash map, which varies. The
/// header keeps its length, so that the following offsets stay valid.
fn sort_header(file: &mut [u8]) {
    // After the magic number and the version, each attribute consists of name, 0, type, 0, length, value; a 0 in place
    // of a name ends the list.
    const START: usize = 8;
    let mut attributes = Vec::new();
    let mut at = START;
    while file.get(at).is_some_and(|&first| first != 0) {
        let after_zero = |from: usize| file[from..].iter().position(|&b| b == 0).map(|n| from + n + 1);
        let Some(length_at) = after_zero(at).and_then(after_zero) else { return };
        let Some(length) = file[length_at..].first_chunk() else { return };
        let end = length_at + 4 + u32::from_le_bytes(*length) as usize;
        let Some(attribute) = file.get(at..end) else { return };
        attributes.push(attribute.to_vec());
        at = end;
    }
    attributes.sort();
    file[START..at].copy_from_slice(&attributes.concat());
}

/// Conventions that are necessary for reading the channels.
const CONVENTIONS: &str = "P = K R [I | -C], camera axes x right, y down, z forward; pixel (u, v) from the top left, \
    the centre of the first pixel at (0, 0) if pixelCenter is integer, (0.5, 0.5) if it is half; depth is z along \
    the principal axis, distance the length of the ray, both +inf in the background; ids are int32 in uint32 bits, \
    4294967295 (-1) in the background; color is linear Rec. 709";

fn camera_attributes(camera: &Camera) -> Vec<(&'static str, AttributeValue)> {
    let row_major = |m: DMat3| m.transpose().to_cols_array();
    let p = camera.p().into_iter().chain([[0.0, 0.0, 0.0, 1.0]]).flatten().collect::<Vec<_>>();
    let center = match camera.pixel_center() {
        PixelCenter::Integer => "integer",
        PixelCenter::Half => "half",
    };
    let mut attributes = vec![
        ("raycam.K", f64_attribute("m33d", &row_major(camera.k()))),
        ("raycam.R", f64_attribute("m33d", &row_major(camera.r()))),
        ("raycam.P", f64_attribute("m44d", &p)),
        ("raycam.pixelCenter", string_attribute(center)),
    ];
    // The centre of a camera with parallel rays is at infinity.
    if camera.center() == Center::Point {
        attributes.push(("raycam.C", f64_attribute("v3d", &camera.c().to_array())));
    }
    if let Some((model, coefficients)) = camera.lens().coefficients() {
        let numbers: Vec<_> = coefficients.iter().map(f64::to_string).collect();
        attributes.push(("raycam.lens", string_attribute(model.name())));
        attributes.push(("raycam.distortion", string_attribute(&numbers.join(" "))));
    }
    attributes
}

/// Attribute of one of OpenEXR's float64 types, which the crate writes as bytes.
fn f64_attribute(kind: &str, values: &[f64]) -> AttributeValue {
    let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    AttributeValue::Custom { kind: Text::from(kind), bytes }
}

/// A string attribute, in UTF-8.
fn string_attribute(value: &str) -> AttributeValue {
    AttributeValue::Text(Text::from_bytes_unchecked(value.bytes().collect()))
}

fn text(name: &str) -> Result<Text> {
    let printable = !name.is_empty() && name.bytes().all(|b| b.is_ascii_graphic() || b == b' ');
    let text = if printable { Text::new_or_none(name) } else { None };
    text.ok_or_else(|| FormatError::encode(format!("EXR: {name:?} is not a valid name; expected printable ASCII")))
}

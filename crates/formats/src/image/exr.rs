//! Reading of OpenEXR: the first part with colours or grey values, or all channels of a single-part file.

use std::io::Cursor;
use std::path::Path;

use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::CompressedBlock;
use ::exr::block::reader::ChunksReader;
use ::exr::image::{AnyChannel, FlatSamples};
use ::exr::meta::attribute::EnvironmentMap;
use ::exr::meta::header::Header;
use ::exr::meta::{BlockDescription, Headers, MetaData};
use ::exr::prelude::{Compression, Error, ReadChannels, ReadLayers, ReadSpecificChannel, Vec2, read};
use ::image::metadata::Orientation;
use raycam_scene::{ColorUse, ErrorCode, Image, NoticeCode};

use crate::budget::Budget;
use crate::error::{FormatError, Result};
use crate::image::cube_map;
use crate::image::decoder::{Decoder, MAX_UNBACKED_BYTES};
use crate::io::catch_panic::catch_decoder_panic;
use crate::io::{AssetRoot, stand_in};

/// Channel of an EXR file: its name, true for whole numbers, and the bits of its float32 or uint32 samples.
pub type ExrChannel = (String, bool, Vec<u32>);

/// Returns every channel of a single-part EXR file at the file's largest level, row by row from the top, and the number
/// of columns and rows.
///
/// # Errors
/// Errors of [`decode_image`](super::decode_image), and for several parts, deep samples and subsampled channels.
pub fn read_exr(path: &Path, budget: &Budget) -> Result<([u32; 2], Vec<ExrChannel>)> {
    let source = AssetRoot::containing(path, budget).read(path)?;
    stand_in::check(path, &source.bytes)?;
    let (bytes, budget, notices) = (&source.bytes[..], &mut { *budget }, &mut Vec::new());
    let (color_use, trusted) = (ColorUse::Data, MAX_UNBACKED_BYTES);
    catch_decoder_panic(path, || {
        one_part(&mut Decoder {
            bytes,
            path,
            color_use,
            trusted,
            budget,
            notices,
            orientation: Orientation::NoTransforms,
        })
    })
}

fn one_part(file: &mut Decoder<'_>) -> Result<([u32; 2], Vec<ExrChannel>)> {
    let headers = headers(file)?;
    let [part] = &headers[..] else {
        let message =
            format!("an EXR file of {} parts; expected one part (save each part to a separate file)", headers.len());
        return Err(file.unsupported(message));
    };
    if part.deep {
        return Err(file.unsupported("an EXR image with deep samples; expected flat samples (flatten the image first)"));
    }
    if let Some(channel) = part.channels.list.iter().find(|channel| channel.sampling != Vec2(1, 1)) {
        let message = format!(
            "channel {} is subsampled, which is not supported; save the image with full R, G and B channels",
            channel.name
        );
        return Err(file.unsupported(message));
    }
    let size = take_part(file, part, 0)?;
    let unpacked = part.layer_size.area() * part.channels.list.len() * size_of::<u32>();
    file.budget.take_bytes(file.path, unpacked as u64)?;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = reader.non_parallel().from_buffered(Cursor::new(file.bytes)).map_err(|e| decoder_error(file, e))?;
    let channels = image.layer_data.channel_data.list.into_iter();
    let channels = channels.map(|AnyChannel { name, sample_data, .. }| match sample_data {
        FlatSamples::F16(samples) => (name.to_string(), false, samples.iter().map(|v| v.to_f32().to_bits()).collect()),
        FlatSamples::F32(samples) => (name.to_string(), false, samples.into_iter().map(f32::to_bits).collect()),
        FlatSamples::U32(samples) => (name.to_string(), true, samples),
    });
    Ok((size, channels.collect()))
}

/// Channels from which an image is read.
struct ShownChannels {
    /// Names of the channels red, green and blue, or the name of a single channel three times.
    colors: [String; 3],
    alpha: Option<String>,
    /// True if the channels are CIE X, Y and Z.
    xyz: bool,
}

/// Reads the largest level of the first part with colours or grey values, with alpha from A or otherwise 1. Colours are
/// premultiplied by alpha in the file, but not in the returned image. Cube maps are converted to latitude-longitude
/// images.
pub(super) fn decode(file: &mut Decoder<'_>) -> Result<Image> {
    let headers = headers(file)?;
    let (index, channels) = shown_part(file, &headers)?;
    let part = &headers[index];
    let size = take_part(file, part, index)?;
    if !channels.xyz && part.shared_attributes.chromaticities.is_some_and(other_primaries) {
        file.notice(
            NoticeCode::IgnoredColorProfile,
            "the image's primaries are ignored, although they differ from Rec. 709",
        );
    }
    let window = part.shared_attributes.display_window;
    if window.position != part.own_attributes.layer_position || window.size != part.layer_size {
        file.notice(NoticeCode::IgnoredFeature, "only the data window is read; it differs from the display window");
    }
    let cube = part.own_attributes.environment_map == Some(EnvironmentMap::Cube);
    if cube {
        file.budget.take_pixels(file.path, 8 * u64::from(size[0]) * u64::from(size[0]))?;
    }
    let texels = read_pixels(file, part.layer_size.0, &channels);
    let mut texels = texels.map_err(|e| decoder_error(file, e))?;
    if channels.alpha.is_some() {
        texels.iter_mut().for_each(straighten);
    }
    if channels.xyz && file.color_use == ColorUse::Color {
        file.notice(
            NoticeCode::AssumedConvention,
            "the image's channels X, Y and Z are converted from CIE XYZ to linear sRGB",
        );
        texels.iter_mut().for_each(|texel| *texel = srgb_of_xyz(*texel));
    }
    let side = part.layer_size.0;
    if cube && part.layer_size.1 == 6 * side {
        file.notice(NoticeCode::ApproximatedValue, "the cube map is converted to an equirectangular image");
        let ([columns, rows], texels) = cube_map::latitude_longitude(&texels, side);
        let texels = file.float_texels(texels);
        return Ok(file.image([columns, rows].map(|side| side as u32), texels));
    }
    if cube {
        let message =
            format!("a cube map of {} x {} pixels; expected six square faces on top of each other", size[0], size[1]);
        return Err(file.fault(ErrorCode::WrongShape, message));
    }
    let texels = file.float_texels(texels);
    Ok(file.image(size, texels))
}

/// Divides colours by alpha. A texel with alpha 0, which only adds light, is unchanged.
fn straighten(texel: &mut [f32; 4]) {
    let [r, g, b, alpha] = *texel;
    if alpha > 0.0 && alpha != 1.0 {
        *texel = [r / alpha, g / alpha, b / alpha, alpha];
    }
}

/// Converts CIE XYZ to linear RGB with the primaries of sRGB and the white point D65 (IEC 61966-2-1).
fn srgb_of_xyz([x, y, z, alpha]: [f32; 4]) -> [f32; 4] {
    [
        3.240_97 * x - 1.537_383_2 * y - 0.498_610_8 * z,
        -0.969_243_6 * x + 1.875_967_5 * y + 0.041_555_06 * z,
        0.055_630_08 * x - 0.203_976_96 * y + 1.056_971_5 * z,
        alpha,
    ]
}

fn headers(file: &Decoder<'_>) -> Result<Headers> {
    let meta = MetaData::read_from_buffered(Cursor::new(file.bytes), false);
    meta.map(|meta| meta.headers).map_err(|e| decoder_error(file, e))
}

/// Returns the size of a part, after charging its pixels to the budget and checking its blocks.
fn take_part(file: &mut Decoder<'_>, part: &Header, index: usize) -> Result<[u32; 2]> {
    let side = |length: usize| u32::try_from(length).unwrap_or(u32::MAX);
    let size = [side(part.layer_size.0), side(part.layer_size.1)];
    // The memory limit covers all channels, because the decoder also decompresses unused ones.
    let texel = part.channels.bytes_per_pixel.max(16) as u64;
    let whole = file.take_pixels(size, texel)?;
    check_blocks(file, part, index, whole)?;
    Ok(size)
}

/// Returns the index of the part to read, and its channels: the first part with channels R, G and B; otherwise with X,
/// Y and Z; otherwise with Y; otherwise with the colours of a layer, as written by Blender. If no part has such
/// channels, the only channel except alpha is read, as in depth maps and masks.
fn shown_part(file: &mut Decoder<'_>, headers: &[Header]) -> Result<(usize, ShownChannels)> {
    let has = |header: &Header, name: &str| header.channels.list.iter().any(|channel| channel.name.eq(name));
    let flat = || headers.iter().enumerate().filter(|(_, header)| !header.deep);
    let alpha = |header: &Header, name: &str| has(header, name).then(|| name.to_owned());
    for (names, xyz) in [(["R", "G", "B"], false), (["X", "Y", "Z"], true)] {
        let is_colored = |(_, header): &(usize, &Header)| names.iter().all(|name| has(header, name));
        let count = flat().filter(is_colored).count();
        if let Some((i, part)) = flat().find(is_colored) {
            if count > 1 {
                file.notice(NoticeCode::FirstOnly, format!("only the first of {count} parts with colours is read"));
            }
            return Ok((i, ShownChannels { colors: names.map(Into::into), alpha: alpha(part, "A"), xyz }));
        }
    }
    let grey = |part: &Header, name: &str| ShownChannels {
        colors: [name, name, name].map(Into::into),
        alpha: alpha(part, "A"),
        xyz: false,
    };
    if flat().any(|(_, header)| has(header, "Y") && (has(header, "RY") || has(header, "BY"))) {
        let message = "luminance and chroma (channels Y, RY and BY) are not supported; save the image with R, G and B";
        return Err(file.unsupported(message));
    }
    if let Some((i, part)) = flat().find(|(_, header)| has(header, "Y")) {
        return Ok((i, grey(part, "Y")));
    }
    if flat().next().is_none() {
        return Err(file.unsupported("an EXR image with deep samples; expected flat samples (flatten the image first)"));
    }
    let layers: Vec<(usize, String)> =
        flat().flat_map(|(i, part)| color_layers(part).map(move |name| (i, name))).collect();
    // Blender and other programs use these names for the layer that contains the whole image. Without such a layer, the
    // first layer is used.
    let whole = |(_, name): &&(usize, String)| {
        ["combined", "rgba", "beauty"].iter().any(|word| name.to_lowercase().ends_with(word))
    };
    if let Some((i, layer)) = layers.iter().find(whole).or(layers.first()) {
        if layers.len() > 1 {
            let count = layers.len();
            file.notice(NoticeCode::FirstOnly, format!("only layer {layer} of {count} layers with colours is read"));
        }
        let name = |channel: &str| format!("{layer}.{channel}");
        let colors = ["R", "G", "B"].map(name);
        return Ok((*i, ShownChannels { colors, alpha: alpha(&headers[*i], &name("A")), xyz: false }));
    }
    let names =
        |header: &Header| header.channels.list.iter().map(|channel| channel.name.to_string()).collect::<Vec<_>>();
    for (i, part) in flat() {
        let mut only = names(part);
        only.retain(|name| name != "A");
        if let [name] = &only[..] {
            file.notice(NoticeCode::AssumedConvention, format!("the image's only channel, {name}, is read as grey"));
            return Ok((i, grey(part, name)));
        }
    }
    let names: Vec<_> = flat().flat_map(|(_, part)| names(part)).collect();
    Err(file.unsupported(format!("channels {}; expected R, G and B, or a single channel", names.join(", "))))
}

/// Names of a part's layers with red, green and blue.
fn color_layers(part: &Header) -> impl Iterator<Item = String> {
    let has = |name: String| part.channels.list.iter().any(|channel| channel.name.eq(&name[..]));
    part.channels.list.iter().filter_map(move |channel| {
        let name = channel.name.to_string();
        let layer = name.strip_suffix(".R")?;
        (has(format!("{layer}.G")) && has(format!("{layer}.B"))).then(|| layer.to_owned())
    })
}

/// Reads the given channels of the first part that has them, as texels in rows of `columns` pixels.
fn read_pixels(file: &Decoder<'_>, columns: usize, channels: &ShownChannels) -> Result<Vec<[f32; 4]>, Error> {
    let set = move |texels: &mut Vec<[f32; 4]>, at: Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
        if let Some(texel) = texels.get_mut(at.1 * columns + at.0) {
            *texel = [r, g, b, a];
        }
    };
    let reader = || read().no_deep_data().largest_resolution_level().specific_channels();
    let bytes = Cursor::new(file.bytes);
    let [red, green, blue] = channels.colors.each_ref().map(|name| &name[..]);
    let alpha = channels.alpha.as_deref().unwrap_or("A");
    if red == green {
        let grey = reader().required(red).optional(alpha, 1.0_f32);
        let set = move |texels: &mut _, at, (y, a): (f32, f32)| set(texels, at, (y, y, y, a));
        let image = grey.collect_pixels(blank, set).first_valid_layer().all_attributes();
        let image = image.non_parallel().from_buffered(bytes);
        image.map(|image| image.layer_data.channel_data.pixels)
    } else {
        let colored = reader().required(red).required(green).required(blue).optional(alpha, 1.0_f32);
        let image = colored.collect_pixels(blank, set).first_valid_layer().all_attributes();
        let image = image.non_parallel().from_buffered(bytes);
        image.map(|image| image.layer_data.channel_data.pixels)
    }
}

/// Rejects tiles that are much larger than the image, and DWA blocks that declare more than they can contain, because
/// the decoder would allocate the declared sizes. With `whole`, each block is decompressed and then discarded.
fn check_blocks(file: &Decoder<'_>, part: &Header, index: usize, whole: bool) -> Result<()> {
    const SMALL: usize = 1 << 16;
    let pixels = part.layer_size.0.saturating_mul(part.layer_size.1);
    if let BlockDescription::Tiles(tiles) = part.blocks {
        let Vec2(columns, rows) = tiles.tile_size;
        if columns.saturating_mul(rows) > pixels.saturating_mul(4).max(SMALL) {
            return Err(file.fault(
                ErrorCode::OutOfRange,
                format!(
                    "tiles of {columns} x {rows} pixels are more than four times as large as the image of {pixels} \
                     pixels; save the image with smaller tiles"
                ),
            ));
        }
    }
    let sized = matches!(part.compression, Compression::DWAA(_) | Compression::DWAB(_));
    if !sized && !whole {
        return Ok(());
    }
    let most = (4 * part.max_block_byte_size() + SMALL) as u64;
    let reader = ::exr::block::read(Cursor::new(file.bytes), false);
    // Levels other than the largest are not read.
    let largest = Vec2(0, 0);
    let chunks = reader.and_then(|reader| {
        reader.filter_chunks(false, |_, tile, block| block.layer == index && tile.level_index == largest)
    });
    let chunks = chunks.map_err(|e| decoder_error(file, e))?;
    let meta = chunks.meta_data().clone();
    for chunk in chunks {
        let chunk = chunk.map_err(|e| decoder_error(file, e))?;
        if sized {
            check_sizes(file, part, &chunk.compressed_block, most)?;
        }
        if whole {
            UncompressedBlock::decompress_chunk(chunk, &meta, false).map_err(|e| decoder_error(file, e))?;
        }
    }
    Ok(())
}

/// Rejects a DWA block that declares more bytes than `most`.
fn check_sizes(file: &Decoder<'_>, part: &Header, block: &CompressedBlock, most: u64) -> Result<()> {
    let place = part.get_block_data_indices(block);
    let place = place.and_then(|place| part.get_absolute_block_pixel_coordinates(place));
    let place = place.map_err(|e| decoder_error(file, e))?;
    let bytes = match block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    // A block that compression would not shorten is stored uncompressed.
    if bytes.len() == place.size.area() * part.channels.bytes_per_pixel {
        return Ok(());
    }
    // The DWA block contains a version, followed by nine sizes and counts.
    let sizes = bytes.as_chunks().0.iter().skip(1).take(9);
    if let Some(size) = sizes.map(|&b| u64::from_le_bytes(b)).find(|&n| n > most) {
        return Err(
            file.fault(ErrorCode::ImplausibleSize, format!("a DWA block declares {size} bytes; the maximum is {most}"))
        );
    }
    Ok(())
}

fn blank<Channels>(size: Vec2<usize>, _: &Channels) -> Vec<[f32; 4]> {
    vec![[0.0; 4]; size.area()]
}

/// True if the primaries differ from the primaries of Rec. 709.
fn other_primaries(found: ::exr::meta::attribute::Chromaticities) -> bool {
    let expected = [(0.64, 0.33), (0.3, 0.6), (0.15, 0.06)];
    let found = [found.red, found.green, found.blue];
    let differs = |(found, (x, y)): (Vec2<f32>, (f32, f32))| (found.0 - x).abs() > 0.005 || (found.1 - y).abs() > 0.005;
    found.into_iter().zip(expected).any(differs)
}

/// True if the compression of the first part is not defined by OpenEXR 3.3.
fn has_unknown_compression(bytes: &[u8]) -> bool {
    const ATTRIBUTE: &[u8] = b"compression\0compression\0\x01\0\0\0";
    const LAST_METHOD: u8 = 9;
    let start = bytes.windows(ATTRIBUTE.len()).position(|window| window == ATTRIBUTE);
    let method = start.and_then(|start| bytes.get(start + ATTRIBUTE.len()));
    method.is_some_and(|method| *method > LAST_METHOD)
}

fn decoder_error(file: &Decoder<'_>, error: Error) -> FormatError {
    match error {
        Error::NotSupported(message) => file.unsupported(message.into_owned()),
        Error::Io(e) => file.truncated(format!("truncated: {e}")),
        Error::Invalid(_) if has_unknown_compression(file.bytes) => {
            file.unsupported("unknown compression; expected none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA or DWAB")
        }
        error => file.fault(ErrorCode::DamagedData, error.to_string()),
    }
}

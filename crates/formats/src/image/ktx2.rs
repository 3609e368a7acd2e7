//! Reading of KTX 2.0 (Khronos KTX File Format Specification): KTX2 files with Basis Universal or uncompressed
//! textures.

use std::io::{self, Read, Write};

use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
use half::f16;
use raycam_scene::{ErrorCode, Image, NoticeCode, Texels};
use ruzstd::decoding::StreamingDecoder;

use crate::error::Result;
use crate::image::decoder::{Decoder, grouped};
use raycam_scene::ColorUse;

pub(super) const MAGIC: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";

/// Size of the header, the index and the first entry of the level index.
const HEADER_BYTES: usize = 80;
const LEVEL_ENTRY_BYTES: usize = 24;

/// Colour models and transfer functions of a data format descriptor that are used here.
const ETC1S: u8 = 163;
const UASTC: u8 = 166;
const SRGB: u8 = 2;

/// Type of a channel of an uncompressed texture.
#[derive(Clone, Copy)]
enum SampleType {
    U8,
    U16,
    F16,
    F32,
}

/// Storage format of the largest level.
enum LevelFormat {
    Basis(SourceFormat),
    /// Adjacent channels, of which the first is blue or red.
    Plain {
        sample: SampleType,
        channels: usize,
        blue_first: bool,
    },
}

/// Contents of the header.
struct Ktx2Header {
    format: LevelFormat,
    size: [u32; 2],
    /// Supercompression scheme: 0 is none, 1 is BasisLZ, 2 is Zstandard.
    scheme: u32,
    /// Byte range of the largest level in the file (start, end), and the level's decompressed length.
    level: (usize, usize),
    unpacked: u64,
    descriptor: (usize, usize),
    srgb: bool,
    premultiplied: bool,
}

pub(super) fn decode(file: &mut Decoder<'_>) -> Result<Image> {
    let header = read_header(file)?;
    let [columns, rows] = header.size.map(u64::from);
    let (texel, expected) = match header.format {
        LevelFormat::Basis(SourceFormat::Etc1s) => (4, None),
        LevelFormat::Basis(_) => (4, Some(columns.div_ceil(4) * rows.div_ceil(4) * 16)),
        LevelFormat::Plain { sample, channels, .. } => {
            let (stored, texel) = match sample {
                SampleType::U8 => (1, 4),
                SampleType::U16 => (2, 8),
                SampleType::F16 => (2, 16),
                SampleType::F32 => (4, 16),
            };
            (texel, Some(columns * rows * channels as u64 * stored))
        }
    };
    let check = file.take_pixels(header.size, texel)?;
    if let Some(expected) = expected.filter(|&n| n != header.unpacked) {
        return Err(
            file.fault(ErrorCode::WrongShape, format!("a level has {} bytes; expected {expected}", header.unpacked))
        );
    }
    if header.srgb != (file.color_use == ColorUse::Color) && texel == 4 {
        let marked = if header.srgb { "sRGB" } else { "linear" };
        file.notice(
            NoticeCode::IgnoredKey,
            format_args!("the colour space {marked} does not match the use of the texture and is ignored"),
        );
    }
    if header.premultiplied {
        file.notice(NoticeCode::IgnoredFeature, "the image's colours are premultiplied by alpha and are not converted");
    }
    let stored = &file.bytes[header.level.0..header.level.1];
    let unpacked;
    let level = match header.scheme {
        2 => {
            unpacked = unpack(file, stored, header.unpacked, check)?;
            &unpacked
        }
        _ => stored,
    };
    let texels = match header.format {
        LevelFormat::Basis(source) => {
            let texels = transcode(file, &header, source, level)?;
            file.texels8(texels)
        }
        LevelFormat::Plain { sample, channels, blue_first } => {
            let mut texels = plain_texels(file, level, sample, channels);
            if blue_first {
                texels = swap_red_blue(texels);
            }
            texels
        }
    };
    Ok(file.image(header.size, texels))
}

/// Bytes of a file, from which little-endian numbers and byte ranges are read.
#[derive(Clone, Copy)]
struct FileBytes<'a>(&'a [u8]);

impl FileBytes<'_> {
    fn u32(self, at: usize) -> u32 {
        let bytes = self.0;
        u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    }

    fn u64(self, at: usize) -> u64 {
        u64::from(self.u32(at)) | u64::from(self.u32(at + 4)) << 32
    }

    /// Start and end of a part of the file; `what` is its name in errors.
    fn part(self, file: &Decoder<'_>, what: &str, start: u64, length: u64) -> Result<(usize, usize)> {
        let end = start.checked_add(length);
        match end.filter(|&end| end <= self.0.len() as u64) {
            Some(end) => Ok((start as usize, end as usize)),
            None => Err(file.truncated(format!(
                "truncated: {what} has {length} bytes from byte {start} on, but the file has {}",
                self.0.len()
            ))),
        }
    }
}

/// Reads and validates the header, the level index and the data format descriptor.
fn read_header(file: &Decoder<'_>) -> Result<Ktx2Header> {
    if file.bytes.len() < HEADER_BYTES {
        return Err(file.truncated("the file ends within its header"));
    }
    let bytes = FileBytes(file.bytes);
    let [vk_format, columns, rows, depth, layers, faces, levels, scheme] =
        [12, 20, 24, 28, 32, 36, 40, 44].map(|at| bytes.u32(at));
    if depth > 0 || layers > 0 || faces != 1 {
        let message =
            format!("a KTX2 texture of depth {depth}, {layers} layers and {faces} faces; expected a single image");
        return Err(file.unsupported(message));
    }
    if levels > 32 {
        return Err(file.fault(ErrorCode::OutOfRange, format!("{levels} mip levels; expected at most 32")));
    }
    let levels = levels.max(1) as usize;
    let index_bytes = (levels * LEVEL_ENTRY_BYTES) as u64;
    bytes.part(file, "the level index", HEADER_BYTES as u64, index_bytes)?;
    let mut largest = (0, 0);
    for level in (0..levels).rev() {
        let at = HEADER_BYTES + LEVEL_ENTRY_BYTES * level;
        largest = bytes.part(file, "a level", bytes.u64(at), bytes.u64(at + 8))?;
    }
    let unpacked = bytes.u64(HEADER_BYTES + 16);
    bytes.part(file, "the global data", bytes.u64(64), bytes.u64(72))?;
    let [start, length] = [56, 60].map(|at| bytes.u32(at).into());
    let keys = bytes.part(file, "the key and value data", start, length)?;
    check_keys(file, &file.bytes[keys.0..keys.1])?;
    let [start, length] = [48, 52].map(|at| bytes.u32(at).into());
    let descriptor = bytes.part(file, "the format descriptor", start, length)?;
    // The 12 bytes before these contain the size of all descriptors and the header of the first descriptor.
    let [model, _, transfer, flags] = match file.bytes[descriptor.0..descriptor.1].get(12..16) {
        Some(&[model, primaries, transfer, flags]) => [model, primaries, transfer, flags],
        _ => return Err(file.fault(ErrorCode::MissingValue, "the data format descriptor is missing")),
    };
    let format = level_format(file, vk_format, model, scheme)?;
    Ok(Ktx2Header {
        format,
        size: [columns, rows],
        scheme,
        level: largest,
        unpacked: if scheme == 2 { unpacked } else { (largest.1 - largest.0) as u64 },
        descriptor,
        srgb: transfer == SRGB,
        premultiplied: flags & 1 != 0,
    })
}

/// Format of the levels, from Vulkan's format, the descriptor's colour model and the supercompression.
fn level_format(file: &Decoder<'_>, vk_format: u32, model: u8, scheme: u32) -> Result<LevelFormat> {
    let format = match (vk_format, model) {
        (0, ETC1S) if scheme == 1 => LevelFormat::Basis(SourceFormat::Etc1s),
        (0, UASTC) if scheme != 1 => LevelFormat::Basis(SourceFormat::UastcLdr),
        _ => plain_format(vk_format).ok_or_else(|| {
            let name = block_compression(vk_format, model).map(|name| format!(" ({name})")).unwrap_or_default();
            file.unsupported(format!(
                "a KTX2 texture of Vulkan format {vk_format}{name} and colour model {model}; expected ETC1S or UASTC, \
                 or uncompressed channels of 8, 16 or 32 bits (create it \
                 from its source image with `ktx create --encode uastc`, or use a PNG)"
            ))
        })?,
    };
    match (scheme, &format) {
        (1, LevelFormat::Basis(_)) | (0 | 2, _) => Ok(format),
        _ => Err(file.unsupported(format!("KTX2 supercompression {scheme}; expected BasisLZ or Zstandard"))),
    }
}

/// Rejects textures with a `KTXorientation` or `KTXswizzle` that glTF does not allow, because raycam does not flip
/// images or rearrange channels.
fn check_keys(file: &Decoder<'_>, mut keys: &[u8]) -> Result<()> {
    while let Some((length, rest)) = keys.split_first_chunk() {
        let length = u32::from_le_bytes(*length) as usize;
        let Some(entry) = rest.get(..length) else {
            return Err(file.fault(ErrorCode::TruncatedFile, "truncated key and value data"));
        };
        keys = rest.get(length.next_multiple_of(4)..).unwrap_or_default();
        let mut words = entry.split(|&b| b == 0);
        let (key, value) = (words.next(), words.next().unwrap_or_default());
        let expected: &[u8] = match key {
            Some(b"KTXorientation") => b"rd",
            Some(b"KTXswizzle") => b"rgba",
            _ => continue,
        };
        if value != expected {
            let [key, value, expected] = [key.unwrap_or_default(), value, expected].map(String::from_utf8_lossy);
            return Err(file.unsupported(format!("{key} is {value:?}; expected {expected:?}")));
        }
    }
    Ok(())
}

/// Name of an unsupported block compression.
fn block_compression(vk_format: u32, model: u8) -> Option<&'static str> {
    Some(match (vk_format, model) {
        (131..=134, _) => "BC1",
        (135 | 136, _) => "BC2",
        (137 | 138, _) => "BC3",
        (139 | 140, _) => "BC4",
        (141 | 142, _) => "BC5",
        (143 | 144, _) => "BC6H",
        (145 | 146, _) => "BC7",
        (147..=152, _) => "ETC2",
        (153..=156, _) => "EAC",
        (157..=184 | 1_000_066_000..=1_000_066_013, _) => "ASTC",
        (1_000_054_000..=1_000_054_007, _) => "PVRTC",
        (0, 167) => "UASTC HDR",
        _ => return None,
    })
}

/// Storage format of an uncompressed texture, by the number of the Vulkan format; `None` for unknown formats and for
/// channels of different sizes.
fn plain_format(vk_format: u32) -> Option<LevelFormat> {
    let (sample, channels, blue_first) = match vk_format {
        9 | 15 => (SampleType::U8, 1, false),
        16 | 22 => (SampleType::U8, 2, false),
        23 | 29 => (SampleType::U8, 3, false),
        30 | 36 => (SampleType::U8, 3, true),
        37 | 43 => (SampleType::U8, 4, false),
        44 | 50 => (SampleType::U8, 4, true),
        70 | 77 | 84 | 91 => (SampleType::U16, (vk_format as usize - 63) / 7, false),
        76 | 83 | 90 | 97 => (SampleType::F16, (vk_format as usize - 69) / 7, false),
        100 | 103 | 106 | 109 => (SampleType::F32, (vk_format as usize - 97) / 3, false),
        _ => return None,
    };
    Some(LevelFormat::Plain { sample, channels, blue_first })
}

/// Decompresses Zstandard, never to more bytes than declared and charged; with `check`, a first pass checks the data
/// before anything is stored.
fn unpack(file: &Decoder<'_>, packed: &[u8], length: u64, check: bool) -> Result<Vec<u8>> {
    fn write(packed: &[u8], most: u64, to: &mut impl Write) -> Result<u64, String> {
        let decoder = StreamingDecoder::new(packed).map_err(|e| e.to_string())?;
        io::copy(&mut decoder.take(most), to).map_err(|e| e.to_string())
    }
    let mut unpacked = Vec::new();
    let written = match check {
        true => write(packed, length + 1, &mut io::sink()),
        false => Ok(length),
    };
    let written = written.and_then(|written| match written == length {
        true => write(packed, length + 1, &mut unpacked),
        false => Ok(written),
    });
    match written {
        Ok(written) if written == length => Ok(unpacked),
        Ok(_) => {
            let message = format!("Zstandard: expected {length} bytes, as specified in the level index");
            Err(file.fault(ErrorCode::DamagedData, message))
        }
        Err(message) => Err(file.fault(ErrorCode::DamagedData, format!("Zstandard: {message}"))),
    }
}

/// Decodes Basis Universal's blocks.
fn transcode(file: &Decoder<'_>, header: &Ktx2Header, source: SourceFormat, level: &[u8]) -> Result<Vec<[u8; 4]>> {
    // The decoder receives UASTC as a file with only this level and without supercompression. It receives ETC1S as the
    // original file, because all levels share the code books.
    let alone;
    let bytes = if source == SourceFormat::Etc1s {
        file.bytes
    } else {
        alone = single_level(file.bytes, header.descriptor, level);
        &alone
    };
    let fault = |error: basisu::Error| file.fault(ErrorCode::DamagedData, format!("Basis Universal: {error:?}"));
    let transcoder = Transcoder::new(bytes).map_err(fault)?;
    let pixels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE);
    let pixels = grouped(pixels.map_err(fault)?);
    if pixels.len() as u64 != u64::from(header.size[0]) * u64::from(header.size[1]) {
        return Err(file.fault(
            ErrorCode::DamagedData,
            format!(
                "Basis Universal: decoded {} pixels; expected {} x {}",
                pixels.len(),
                header.size[0],
                header.size[1]
            ),
        ));
    }
    Ok(pixels)
}

/// KTX2 file with the same size and format, but with one level and without supercompression.
fn single_level(bytes: &[u8], descriptor: (usize, usize), level: &[u8]) -> Vec<u8> {
    let descriptor = &bytes[descriptor.0..descriptor.1];
    let descriptor_at = HEADER_BYTES + LEVEL_ENTRY_BYTES;
    let level_at = (descriptor_at + descriptor.len()).next_multiple_of(16);
    let mut out = bytes[..40].to_vec();
    // The words are: number of levels, supercompression scheme, offset and length of the descriptor, offset and length
    // of the key list (empty). The global data is empty too.
    for word in [1, 0, descriptor_at as u32, descriptor.len() as u32, 0, 0] {
        out.extend(word.to_le_bytes());
    }
    for long in [0, 0, level_at, level.len(), level.len()] {
        out.extend((long as u64).to_le_bytes());
    }
    out.extend(descriptor);
    out.resize(level_at, 0);
    out.extend(level);
    out
}

/// Texels with the channels as stored; missing colour channels are 0, as in Vulkan, and missing alpha is 1.
fn plain_texels(file: &mut Decoder<'_>, level: &[u8], sample: SampleType, channels: usize) -> Texels {
    fn spread<T: Copy, const N: usize>(
        level: &[u8],
        channels: usize,
        [none, one]: [T; 2],
        from: impl Fn([u8; N]) -> T,
    ) -> Vec<[T; 4]> {
        let texel = |samples: &[[u8; N]]| {
            let mut texel = [none, none, none, one];
            for (to, &sample) in texel.iter_mut().zip(samples) {
                *to = from(sample);
            }
            texel
        };
        level.as_chunks().0.chunks_exact(channels).map(texel).collect()
    }
    match sample {
        SampleType::U8 => {
            let texels = spread(level, channels, [0, 255], u8::from_le_bytes);
            file.texels8(texels)
        }
        SampleType::U16 => {
            // The values are linear for every use, because KTX2 has no 16-bit sRGB format.
            Texels::Linear16(spread(level, channels, [0, u16::MAX], u16::from_le_bytes))
        }
        SampleType::F16 => {
            let from = |bytes| f16::from_le_bytes(bytes).to_f32();
            let texels = spread(level, channels, [0.0, 1.0], from);
            file.float_texels(texels)
        }
        SampleType::F32 => {
            let texels = spread(level, channels, [0.0, 1.0], f32::from_le_bytes);
            file.float_texels(texels)
        }
    }
}

/// Exchanges red and blue.
fn swap_red_blue(mut texels: Texels) -> Texels {
    if let Texels::Srgb8(texels) | Texels::Linear8(texels) = &mut texels {
        texels.iter_mut().for_each(|texel| texel.swap(0, 2));
    }
    texels
}

//! Samples of a TIFF image: strips and tiles are decoded by the crate `tiff`.
//!
//! That crate drops unknown channels before it undoes the predictor, reads uint32 as floats, and does not support
//! palettes, FillOrder 2, Zstandard in safe Rust and subsampled chroma. It therefore gets a copy of the file whose tags
//! describe plain channels, and the meaning of the channels is applied afterwards.

use raycam_scene::ErrorCode;
use std::io::{Cursor, Read};

use ::tiff::TiffError;
use ::tiff::decoder::{Decoder as TiffDecoder, DecodingResult, Limits};
use ruzstd::decoding::StreamingDecoder;

use crate::error::{FormatError, Result};
use crate::image::decoder::Decoder;
use crate::image::tiff::directory::Directory;
use crate::image::tiff::layout::{JPEG, Layout, SampleFormat, UNCOMPRESSED, ZSTD};

/// Layout passed to the `tiff` crate; unusual sample sizes are declared as bytes.
struct Presented {
    size: [u32; 2],
    chunk: [u32; 2],
    bits: usize,
    /// Number of samples per pixel, summed over all planes.
    samples: usize,
    format: SampleFormat,
}

impl Presented {
    fn new(layout: &Layout) -> Self {
        let Layout { size, chunk, bits, samples, format, .. } = *layout;
        let native = matches!(bits, 1..=8 | 16 | 32 | 64);
        let bytes = |columns: u32| match layout.chroma {
            [1, 1] => (u64::from(columns) * (layout.interleaved() * bits) as u64).div_ceil(8) as u32,
            [across, down] => columns.div_ceil(across) * (across * down + 2),
        };
        if native && layout.chroma == [1, 1] {
            return Self { size, chunk, bits, samples, format };
        }
        // The `tiff` crate receives samples of unusual sizes as bytes, which are unpacked later.
        let down = layout.chroma[1];
        Self {
            size: [bytes(size[0]), size[1].div_ceil(down)],
            chunk: [bytes(chunk[0]), chunk[1].div_ceil(down)],
            bits: 8,
            samples: if layout.planar { samples } else { 1 },
            format: SampleFormat::Unsigned,
        }
    }

    /// Number of bytes of an area of this size, a chunk or the whole image; each row is padded to a whole byte.
    fn bytes(&self, [columns, rows]: [u32; 2], interleaved: usize) -> u64 {
        u64::from(rows) * (u64::from(columns) * (interleaved * self.bits) as u64).div_ceil(8)
    }
}

/// All samples, pixel by pixel: whole numbers scaled to 0..=1 (-1..=1 if signed), floats unchanged.
pub(super) fn read(file: &mut Decoder<'_>, tags: &Directory<'_>, layout: &Layout) -> Result<Vec<f32>> {
    let presented = Presented::new(layout);
    let interleaved = if layout.planar { 1 } else { presented.samples };
    let planes = presented.samples / interleaved;
    let raw = presented.bytes(presented.size, interleaved) * planes as u64;
    let count = layout.samples as u64 * u64::from(layout.size[0]) * u64::from(layout.size[1]);
    file.budget.take_bytes(file.path, raw + 4 * count + file.bytes.len() as u64)?;
    let chunks = chunks(file, tags, layout, presented.bytes(presented.chunk, interleaved))?;
    let mut samples = Vec::new();
    for plane in chunks.chunks((chunks.len() / planes).max(1)) {
        let decoded = decode_plane(file, tags, layout, &presented, plane)?;
        let plane = if layout.chroma != [1, 1] {
            full_chroma(layout, &decoded)
        } else if matches!(layout.bits, 8 | 16 | 32 | 64) {
            normalized(decoded)
        } else {
            unpacked(layout, &decoded)
        };
        if samples.is_empty() {
            samples = plane;
        } else {
            samples.extend(plane);
        }
    }
    Ok(if layout.planar { interleave(&samples, layout.samples) } else { samples })
}

/// Decoded bytes of all strips or tiles, or of the strips or tiles of one plane, as one image.
fn decode_plane(
    file: &Decoder<'_>,
    tags: &Directory<'_>,
    layout: &Layout,
    presented: &Presented,
    chunks: &[Vec<u8>],
) -> Result<DecodingResult> {
    let interleaved = if layout.planar { 1 } else { presented.samples };
    let raw = presented.bytes(presented.size, interleaved);
    let plain = plain_file(tags, layout, presented, chunks);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::try_from(raw).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = plain.len();
    limits.ifd_value_size = plain.len();
    let mut decoded = DecodingResult::U8(Vec::new());
    let decoder = TiffDecoder::new(Cursor::new(plain)).map(|decoder| decoder.with_limits(limits));
    let read = decoder.and_then(|mut decoder| decoder.read_image_to_buffer(&mut decoded));
    read.map_err(|error| decoder_error(file, error))?;
    if (decoded.as_buffer(0).as_bytes().len() as u64) < raw {
        return Err(file.fault(ErrorCode::TruncatedFile, "some of the image's channels are missing"));
    }
    Ok(decoded)
}

/// Compressed bytes of each strip or tile, after undoing FillOrder and Zstandard.
fn chunks(file: &Decoder<'_>, tags: &Directory<'_>, layout: &Layout, unpacked: u64) -> Result<Vec<Vec<u8>>> {
    let (offset_tag, count_tag) = if layout.tiled { (324, 325) } else { (273, 279) };
    let offsets = tags.numbers(offset_tag).unwrap_or_default();
    let across = layout.size[0].div_ceil(layout.chunk[0]) as usize;
    let down = layout.size[1].div_ceil(layout.chunk[1]) as usize;
    let expected = across * down * if layout.planar { layout.samples } else { 1 };
    let counts = match tags.numbers(count_tag) {
        Some(counts) => counts,
        // Old programs omit these tags if the values follow from the image size.
        None if layout.compression == UNCOMPRESSED && offsets.len() == 1 => {
            vec![unpacked.min(file.bytes.len() as u64 - offsets[0].min(file.bytes.len() as u64))]
        }
        None => return Err(file.fault(ErrorCode::MissingValue, "the byte counts of the strips or tiles are missing")),
    };
    if offsets.len() != expected || counts.len() != expected {
        let message = format!("{} strips or tiles; expected {expected}", offsets.len().min(counts.len()));
        return Err(file.fault(ErrorCode::WrongShape, message));
    }
    let mut total = 0_u64;
    let chunk = |(&start, &length): (&u64, &u64)| {
        let end = start.checked_add(length).filter(|&end| end <= file.bytes.len() as u64);
        let Some(end) = end else { return Err(file.truncated("truncated: a strip or tile is missing")) };
        total += length;
        if total > 4 * file.bytes.len() as u64 {
            return Err(file.fault(ErrorCode::DamagedData, "strips or tiles overlap"));
        }
        let mut bytes = file.bytes[start as usize..end as usize].to_vec();
        if layout.reversed_bits && layout.compression != JPEG {
            bytes.iter_mut().for_each(|byte| *byte = byte.reverse_bits());
        }
        match layout.compression {
            JPEG => check_jpeg(file, layout, tags.bytes(347).unwrap_or_default(), &bytes)?,
            ZSTD => {
                let fault = |error: String| file.fault(ErrorCode::DamagedData, format!("Zstandard: {error}"));
                let stream = StreamingDecoder::new(&bytes[..]).map_err(|error| fault(error.to_string()))?;
                let mut plain = Vec::new();
                stream.take(unpacked).read_to_end(&mut plain).map_err(|error| fault(error.to_string()))?;
                bytes = plain;
            }
            _ => {}
        }
        Ok(bytes)
    };
    offsets.iter().zip(&counts).map(chunk).collect()
}

/// Rejects a JPEG strip or tile of another size, because the decoder would allocate the declared size.
fn check_jpeg(file: &Decoder<'_>, layout: &Layout, tables: &[u8], bytes: &[u8]) -> Result<()> {
    let fault = || file.fault(ErrorCode::DamagedData, "a JPEG strip or tile without a frame header");
    let mut at = 2;
    let [height, width, components] = loop {
        let header: &[u8; 4] = bytes.get(at..).and_then(<[u8]>::first_chunk).ok_or_else(fault)?;
        match *header {
            [0xff, 0xff, ..] => at += 1,
            [0xff, 0xd8 | 0x01, ..] => at += 2,
            [0xff, 0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf, ..] => {
                let frame: &[u8; 10] = bytes.get(at..).and_then(<[u8]>::first_chunk).ok_or_else(fault)?;
                let number = |i: usize| u32::from(u16::from_be_bytes([frame[i], frame[i + 1]]));
                break [number(5), number(7), u32::from(frame[9])];
            }
            [0xff, 0xd9 | 0xda, ..] => return Err(fault()),
            [0xff, _, high, low] => at += 2 + usize::from(u16::from_be_bytes([high, low])),
            _ => return Err(fault()),
        }
    };
    let interleaved = layout.interleaved() as u32;
    if width != layout.chunk[0] || height > layout.chunk[1] || components != interleaved || tables.len() == 1 {
        let [columns, rows] = layout.chunk;
        return Err(file.fault(ErrorCode::WrongShape, format!(
            "a JPEG strip or tile of {width} x {height} pixels and {components} channels; expected {columns} x {rows} \
             and {interleaved}"
        )));
    }
    Ok(())
}

/// A BigTIFF file of plain, adjacent channels.
fn plain_file(tags: &Directory<'_>, layout: &Layout, presented: &Presented, chunks: &[Vec<u8>]) -> Vec<u8> {
    let big = tags.big_endian;
    let bytes = |number: u64, size: usize| {
        let all = number.to_be_bytes();
        let mut bytes = all[8 - size..].to_vec();
        if !big {
            bytes.reverse();
        }
        bytes
    };
    let long = |number: u64| (16_u16, 1, bytes(number, 8));
    let list = |numbers: Vec<u64>| {
        (16, numbers.len(), numbers.into_iter().flat_map(|number| bytes(number, 8)).collect::<Vec<u8>>())
    };
    let short = |number: u64| (3, 1, bytes(number, 2));
    let format = match presented.format {
        SampleFormat::Unsigned => 1,
        SampleFormat::Signed => 2,
        SampleFormat::Float => 3,
    };
    let compression = if layout.compression == ZSTD { UNCOMPRESSED } else { layout.compression };
    let mut at = 16;
    let offsets = chunks.iter().map(|chunk| {
        at += chunk.len() as u64;
        at - chunk.len() as u64
    });
    let offsets = list(offsets.collect());
    let counts = list(chunks.iter().map(|chunk| chunk.len() as u64).collect());
    let [width, height] = presented.size.map(u64::from);
    let [across, down] = presented.chunk.map(u64::from);
    let mut entries = vec![
        (256, long(width)),
        (257, long(height)),
        (258, short(presented.bits as u64)),
        (259, short(compression)),
        (262, short(1)),
        (277, short(if layout.planar { 1 } else { presented.samples as u64 })),
        (284, short(1)),
        (317, short(layout.predictor)),
        (339, short(format)),
    ];
    if layout.tiled {
        entries.extend([(322, long(across)), (323, long(down)), (324, offsets), (325, counts)]);
    } else {
        entries.extend([(273, offsets), (278, long(down)), (279, counts)]);
    }
    if let Some(tables) = tags.bytes(347).filter(|_| layout.compression == JPEG) {
        entries.push((347, (7, tables.len(), tables.to_vec())));
    }
    entries.sort_unstable_by_key(|(tag, _)| *tag);
    let mut plain = if big { b"MM\0\x2b\0\x08\0\0".to_vec() } else { b"II\x2b\0\x08\0\0\0".to_vec() };
    plain.extend(bytes(at, 8));
    plain.extend(chunks.iter().flatten());
    plain.extend(bytes(entries.len() as u64, 8));
    let mut values = Vec::new();
    let after = at + 8 + 20 * entries.len() as u64 + 8;
    for (tag, (kind, count, mut value)) in entries {
        plain.extend([bytes(tag, 2), bytes(u64::from(kind), 2), bytes(count as u64, 8)].concat());
        if value.len() <= 8 {
            value.resize(8, 0);
            plain.extend(value);
        } else {
            plain.extend(bytes(after + values.len() as u64, 8));
            values.extend(value);
        }
    }
    plain.extend([0; 8]);
    plain.extend(values);
    plain
}

/// Samples of whole bytes as floats.
fn normalized(decoded: DecodingResult) -> Vec<f32> {
    fn scaled<T: Copy + Into<f64>>(values: Vec<T>, largest: f64) -> Vec<f32> {
        values.into_iter().map(|value| (value.into() / largest) as f32).collect()
    }
    match decoded {
        DecodingResult::U8(values) => scaled(values, u8::MAX.into()),
        DecodingResult::U16(values) => scaled(values, u16::MAX.into()),
        DecodingResult::U32(values) => scaled(values, u32::MAX.into()),
        DecodingResult::U64(values) => values.into_iter().map(|v| (v as f64 / u64::MAX as f64) as f32).collect(),
        DecodingResult::I8(values) => scaled(values, i8::MAX.into()),
        DecodingResult::I16(values) => scaled(values, i16::MAX.into()),
        DecodingResult::I32(values) => scaled(values, i32::MAX.into()),
        DecodingResult::I64(values) => values.into_iter().map(|v| (v as f64 / i64::MAX as f64) as f32).collect(),
        DecodingResult::F16(values) => values.into_iter().map(|value| value.to_f32()).collect(),
        DecodingResult::F32(values) => values,
        DecodingResult::F64(values) => values.into_iter().map(|value| value as f32).collect(),
    }
}

fn raw_bytes(decoded: &DecodingResult) -> &[u8] {
    match decoded {
        DecodingResult::U8(bytes) => bytes,
        _ => &[],
    }
}

/// Samples packed into bytes, the highest bit first; each row starts with a new byte.
fn unpacked(layout: &Layout, decoded: &DecodingResult) -> Vec<f32> {
    let per_row = layout.size[0] as usize * layout.interleaved();
    let largest = ((1_u32 << layout.bits) - 1) as f32;
    let rows = raw_bytes(decoded).chunks_exact((per_row * layout.bits).div_ceil(8).max(1));
    let sample = |row: &[u8], i: usize| {
        let bits = i * layout.bits..(i + 1) * layout.bits;
        let value = bits.fold(0, |value, bit| value << 1 | u32::from(row[bit / 8] >> (7 - bit % 8) & 1));
        value as f32 / largest
    };
    rows.flat_map(|row| (0..per_row).map(move |i| sample(row, i))).collect()
}

/// YCbCr samples of every pixel, from blocks with one sample per chroma channel (TIFF 6.0, section 21).
fn full_chroma(layout: &Layout, decoded: &DecodingResult) -> Vec<f32> {
    let [across, down] = layout.chroma.map(|n| n as usize);
    let [columns, rows] = layout.size.map(|n| n as usize);
    let unit = across * down + 2;
    let row_bytes = columns.div_ceil(across) * unit;
    let bytes = raw_bytes(decoded);
    let mut samples = Vec::with_capacity(3 * columns * rows);
    for y in 0..rows {
        for x in 0..columns {
            let block = y / down * row_bytes + x / across * unit;
            let luma = bytes[block + y % down * across + x % across];
            let chroma = [bytes[block + unit - 2], bytes[block + unit - 1]];
            samples.extend([luma, chroma[0], chroma[1]].map(|value| f32::from(value) / 255.0));
        }
    }
    samples
}

/// Samples pixel by pixel, from samples plane by plane.
fn interleave(planes: &[f32], samples: usize) -> Vec<f32> {
    let pixels = planes.len() / samples;
    (0..pixels * samples).map(|i| planes[i % samples * pixels + i / samples]).collect()
}

fn decoder_error(file: &Decoder<'_>, error: TiffError) -> FormatError {
    match error {
        TiffError::UnsupportedError(error) => file.unsupported(error.to_string()),
        TiffError::IoError(error) => file.truncated(format!("truncated: {error}")),
        error => file.fault(ErrorCode::DamagedData, error.to_string()),
    }
}

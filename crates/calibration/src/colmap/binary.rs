//! COLMAP's binary files: `cameras.bin`, `images.bin` and, if they exist, `rigs.bin` and `frames.bin`. Little endian.

use std::path::Path;

use crate::colmap::records::{self, ModelFormat, RecordReader, RecordWriter};
use crate::{Calibration, CameraRecord, OutputFiles, ReadHints};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Names and parameter counts of the camera models, indexed by model id (`sensor/models.h`).
const MODELS: [(&str, usize); 18] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    ("SIMPLE_DIVISION", 4),
    ("DIVISION", 5),
    ("SIMPLE_FISHEYE", 3),
    ("FISHEYE", 4),
    ("EUCM", 6),
    ("EQUIRECTANGULAR", 2),
];

/// Number of bytes of each entry of an image's POINTS2D.
const POINT2D_BYTES: usize = 24;

pub(crate) fn detect(source: &InputFile, _: &str) -> bool {
    source.path.file_name().is_some_and(|name| Binary::NAMES.iter().any(|known| name == *known))
}

pub(crate) fn read(source: &InputFile, assets: &mut AssetRoot, _: &ReadHints) -> Result<Calibration> {
    records::read::<Binary>(source, assets)
}

pub(crate) fn write(cameras: &[CameraRecord], _: &Path) -> Result<OutputFiles> {
    records::write::<Binary>(cameras)
}

struct Binary;

impl ModelFormat for Binary {
    const NAMES: [&'static str; 5] = ["cameras.bin", "images.bin", "rigs.bin", "frames.bin", "points3D.bin"];
    type Reader<'a> = BinaryReader<'a>;
    type Writer = BinaryWriter;

    fn is_image_name(name: &str) -> bool {
        !name.contains('\0')
    }

    fn reader(file: &InputFile) -> Result<BinaryReader<'_>> {
        Ok(BinaryReader { path: &file.path, bytes: &file.bytes, offset: 0 })
    }
}

/// Reader of a binary file: its bytes, and the offset of the next field.
pub(crate) struct BinaryReader<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    offset: usize,
}

impl<'a> BinaryReader<'a> {
    fn read_bytes(&mut self, count: usize) -> Result<&'a [u8]> {
        let rest = self.bytes.get(self.offset..);
        let Some(bytes) = rest.and_then(|rest| rest.get(..count)) else {
            return Err(self.fail("unexpected end of file; the file may be truncated".into()));
        };
        self.offset += count;
        Ok(bytes)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.read_bytes(N)?);
        Ok(array)
    }

    fn u64(&mut self) -> Result<u64> {
        self.array().map(u64::from_le_bytes)
    }
}

impl RecordReader for BinaryReader<'_> {
    fn records<T>(&mut self, mut read: impl FnMut(&mut Self) -> Result<T>) -> Result<Vec<T>> {
        // No memory is reserved for the declared count, because a damaged file may declare any count.
        let mut records = Vec::new();
        for _ in 0..self.u64()? {
            records.push(read(self)?);
        }
        if self.offset == self.bytes.len() {
            Ok(records)
        } else {
            Err(self.fail(format!("{} unexpected bytes after the last record", self.bytes.len() - self.offset)))
        }
    }

    fn fail(&self, message: String) -> FormatError {
        FormatError::byte(self.path, self.offset, message)
    }

    fn u32(&mut self, _: &str) -> Result<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn size(&mut self, _: &str, what: &str) -> Result<u32> {
        let value = self.u64()?;
        u32::try_from(value).map_err(|_| self.fail(format!("invalid {what} {value}; expected at most {}", u32::MAX)))
    }

    fn f64(&mut self, _: &str) -> Result<f64> {
        self.array().map(f64::from_le_bytes)
    }

    fn flag(&mut self, _: &str) -> Result<bool> {
        Ok(self.array::<1>()? != [0])
    }

    fn is_camera(&mut self) -> Result<bool> {
        Ok(self.u32("SENSOR_TYPE")? == 0)
    }

    fn camera_model(&mut self, camera: u32) -> Result<String> {
        let number = self.u32("MODEL")?;
        match MODELS.get(number as usize) {
            Some((name, _)) => Ok((*name).to_owned()),
            None => Err(self.fail(format!(
                "camera {camera}: unknown COLMAP camera model {number}; expected 0 to {}",
                MODELS.len() - 1
            ))),
        }
    }

    fn camera_params(&mut self, model: &str) -> Result<Vec<f64>> {
        let known = MODELS.iter().find(|(name, _)| *name == model);
        let count = known.map_or(0, |(_, count)| *count);
        (0..count).map(|_| self.f64("PARAMS")).collect()
    }

    fn image_name(&mut self) -> Result<String> {
        let rest = self.bytes.get(self.offset..).unwrap_or_default();
        let length = rest.iter().position(|&b| b == 0).ok_or_else(|| self.fail("unterminated name".into()))?;
        let name =
            std::str::from_utf8(self.read_bytes(length)?).map_err(|_| self.fail("name is not valid UTF-8".into()))?;
        self.read_bytes(1)?;
        Ok(name.to_owned())
    }

    fn end_record(&mut self) -> Result<()> {
        Ok(())
    }

    fn skip_points2d(&mut self) -> Result<()> {
        let points = usize::try_from(self.u64()?).ok();
        let length = points.and_then(|points| points.checked_mul(POINT2D_BYTES));
        self.read_bytes(length.unwrap_or(usize::MAX))?;
        Ok(())
    }
}

/// Writer of a binary file: the bytes written so far.
pub(crate) struct BinaryWriter(Vec<u8>);

impl RecordWriter for BinaryWriter {
    fn new(_: &str, count: usize) -> Self {
        Self((count as u64).to_le_bytes().into())
    }

    fn u32(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    fn size(&mut self, value: u32) {
        self.0.extend(u64::from(value).to_le_bytes());
    }

    fn f64s(&mut self, values: &[f64]) {
        for value in values {
            self.0.extend(value.to_le_bytes());
        }
    }

    fn flag(&mut self) {
        self.0.push(1);
    }

    fn camera_sensor(&mut self, id: u32) {
        self.u32(0);
        self.u32(id);
    }

    fn camera_model(&mut self, name: &str) {
        let number = MODELS.iter().position(|(known, _)| *known == name);
        self.u32(number.unwrap_or_default() as u32);
    }

    fn image_name(&mut self, name: &str) {
        self.0.extend(name.bytes().chain([0]));
    }

    fn end_record(&mut self) {}

    fn no_points2d(&mut self) {
        self.size(0);
    }

    fn into_bytes(self) -> Vec<u8> {
        self.0
    }
}

//! COLMAP's binary files: `cameras.bin`, `images.bin`, and `rigs.bin` and `frames.bin` where they are. Little endian.

use std::path::Path;

use crate::calibration::colmap::{
    ColmapCamera, ColmapImage, Frame, Reconstruction, Rig, RigidPose, is_rigid,
};
use crate::calibration::{Calibration, CameraRecord, OutputFiles, ReadHints};
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

const NAMES: [&str; 5] = [
    "cameras.bin",
    "images.bin",
    "rigs.bin",
    "frames.bin",
    "points3D.bin",
];

/// The names and numbers of parameters of the models by their ids (`sensor/models.h`).
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

pub(crate) fn detect(path: &Path, _: &str) -> bool {
    path.file_name()
        .is_some_and(|name| NAMES.iter().any(|known| name == *known))
}

/// BinaryReader, one number after the other.
struct BinaryReader<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> BinaryReader<'a> {
    fn new(source: &'a InputFile) -> Self {
        Self {
            path: &source.path,
            bytes: &source.bytes,
            at: 0,
        }
    }

    fn fail(&self, message: impl Into<String>) -> FormatError {
        FormatError::byte(self.path, self.at, message)
    }

    fn read_bytes(&mut self, count: usize) -> Result<&'a [u8], FormatError> {
        let Some(taken) = self.bytes.get(self.at..).and_then(|rest| rest.get(..count)) else {
            return Err(self.fail("the file ends here; is it cut off?"));
        };
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], FormatError> {
        let mut array = [0; N];
        array.copy_from_slice(self.read_bytes(N)?);
        Ok(array)
    }

    fn u32(&mut self) -> Result<u32, FormatError> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, FormatError> {
        self.array().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, FormatError> {
        self.array().map(f64::from_le_bytes)
    }

    fn small(&mut self, what: &str) -> Result<u32, FormatError> {
        let value = self.u64()?;
        u32::try_from(value).map_err(|_| self.fail(format!("{what} {value}")))
    }

    fn rigid(&mut self) -> Result<RigidPose, FormatError> {
        let mut rigid = [0.0; 7];
        for value in &mut rigid {
            *value = self.f64()?;
        }
        if is_rigid(&rigid) {
            Ok(rigid)
        } else {
            Err(self.fail("no pose: a quaternion of length 0, or not finite"))
        }
    }

    fn sensor(&mut self) -> Result<(bool, u32), FormatError> {
        Ok((self.u32()? == 0, self.u32()?))
    }

    fn end(&self) -> Result<(), FormatError> {
        if self.at == self.bytes.len() {
            Ok(())
        } else {
            Err(self.fail("more bytes than belong here"))
        }
    }
}

pub(crate) fn read(
    source: &InputFile,
    assets: &mut AssetRoot,
    _: &ReadHints,
) -> Result<Calibration, FormatError> {
    let mut model = Reconstruction::default();
    let mut open = |name: &str| assets.read_reference(&source.path, name);
    let file = open("cameras.bin")?;
    let mut bytes = BinaryReader::new(&file);
    for _ in 0..bytes.u64()? {
        let (id, number) = (bytes.u32()?, bytes.u32()?);
        let Some(&(name, count)) = MODELS.get(number as usize) else {
            return Err(bytes.fail(format!("camera {id}: COLMAP has no model {number}")));
        };
        let size = [bytes.small("a width of")?, bytes.small("a height of")?];
        let params: Result<_, _> = (0..count).map(|_| bytes.f64()).collect();
        model.cameras.push(ColmapCamera {
            id,
            model: name.into(),
            size,
            params: params?,
        });
    }
    bytes.end()?;
    if let Some(file) = optional(open("images.bin"))? {
        let mut bytes = BinaryReader::new(&file);
        for _ in 0..bytes.u64()? {
            let (id, pose, camera) = (bytes.u32()?, bytes.rigid()?, bytes.u32()?);
            let rest = bytes.bytes.get(bytes.at..).unwrap_or_default();
            let length = rest
                .iter()
                .position(|&b| b == 0)
                .ok_or_else(|| bytes.fail("a name without an end"))?;
            let name = std::str::from_utf8(bytes.read_bytes(length)?)
                .map_err(|_| bytes.fail("a name that is not UTF-8"))?;
            bytes.read_bytes(1)?;
            let points = bytes.u64()?;
            let length = usize::try_from(points)
                .ok()
                .and_then(|points| points.checked_mul(24));
            bytes.read_bytes(length.unwrap_or(usize::MAX))?;
            model.images.push(ColmapImage {
                id,
                pose,
                camera,
                name: name.into(),
            });
        }
        bytes.end()?;
    }
    if let (Some(rigs), Some(frames)) = (optional(open("rigs.bin"))?, optional(open("frames.bin"))?)
    {
        read_rigs(&mut model, &rigs, &frames)?;
    }
    model.calibration(&source.path)
}

fn optional(file: Result<InputFile, FormatError>) -> Result<Option<InputFile>, FormatError> {
    match file {
        Ok(file) => Ok(Some(file)),
        Err(FormatError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

fn read_rigs(
    model: &mut Reconstruction,
    rigs: &InputFile,
    frames: &InputFile,
) -> Result<(), FormatError> {
    let mut bytes = BinaryReader::new(rigs);
    for _ in 0..bytes.u64()? {
        let (id, count) = (bytes.u32()?, bytes.u32()?);
        let mut cameras = Vec::new();
        for i in 0..count {
            let (is_camera, sensor) = bytes.sensor()?;
            // The first is the origin of the rig.
            let pose = match i > 0 && bytes.array::<1>()? != [0] {
                true => Some(bytes.rigid()?),
                false if i > 0 => {
                    return Err(bytes.fail(format!("sensor {sensor} has no pose in its rig")));
                }
                false => None,
            };
            if is_camera {
                cameras.push((sensor, pose));
            }
        }
        model.rigs.push(Rig { id, cameras });
    }
    bytes.end()?;
    let mut bytes = BinaryReader::new(frames);
    for _ in 0..bytes.u64()? {
        let id = bytes.u32()?;
        let (rig, pose, count) = (bytes.u32()?, bytes.rigid()?, bytes.u32()?);
        let mut images = Vec::new();
        for _ in 0..count {
            let (is_camera, sensor) = bytes.sensor()?;
            let image = bytes.small("an image id of")?;
            if is_camera {
                images.push((sensor, image));
            }
        }
        model.frames.push(Frame {
            id,
            rig,
            pose,
            images,
        });
    }
    bytes.end()
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles, FormatError> {
    let model = Reconstruction::from_records(records)?;
    let mut files: [Vec<u8>; 5] = Default::default();
    let counts = [
        model.cameras.len(),
        model.images.len(),
        model.rigs.len(),
        model.frames.len(),
        0,
    ];
    for (file, count) in files.iter_mut().zip(counts) {
        file.extend((count as u64).to_le_bytes());
    }
    let [cameras, images, rigs, frames, _] = &mut files;
    let u32s = |file: &mut Vec<u8>, values: &[u32]| {
        values.iter().for_each(|v| file.extend(v.to_le_bytes()))
    };
    let f64s = |file: &mut Vec<u8>, values: &[f64]| {
        values.iter().for_each(|v| file.extend(v.to_le_bytes()))
    };
    for ColmapCamera {
        id,
        model,
        size,
        params,
    } in &model.cameras
    {
        let number = MODELS
            .iter()
            .position(|(name, _)| name == model)
            .unwrap_or_default();
        u32s(cameras, &[*id, number as u32]);
        size.iter()
            .for_each(|side| cameras.extend(u64::from(*side).to_le_bytes()));
        f64s(cameras, params);
    }
    for rig in &model.rigs {
        u32s(rigs, &[rig.id, rig.cameras.len() as u32]);
        for (camera, pose) in &rig.cameras {
            u32s(rigs, &[0, *camera]);
            if let Some(pose) = pose {
                rigs.push(1);
                f64s(rigs, pose);
            }
        }
    }
    for ColmapImage {
        id,
        pose,
        camera,
        name,
    } in &model.images
    {
        u32s(images, &[*id]);
        f64s(images, pose);
        u32s(images, &[*camera]);
        images.extend(name.bytes().chain([0]));
        images.extend(0_u64.to_le_bytes());
    }
    for frame in &model.frames {
        u32s(frames, &[frame.id, frame.rig]);
        f64s(frames, &frame.pose);
        u32s(frames, &[frame.images.len() as u32]);
        for (camera, image) in &frame.images {
            u32s(frames, &[0, *camera]);
            frames.extend(u64::from(*image).to_le_bytes());
        }
    }
    let named = NAMES.iter().map(|name| (*name).to_owned());
    Ok(OutputFiles {
        files: named.zip(files).collect(),
        notices: vec![],
    })
}

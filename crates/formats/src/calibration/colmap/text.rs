//! COLMAP's text files: `cameras.txt`, `images.txt`, and `rigs.txt` and `frames.txt` where they are.

use std::path::Path;

use crate::calibration::colmap::{
    ColmapCamera, ColmapImage, Frame, Reconstruction, Rig, RigidPose, is_rigid,
};
use crate::calibration::document::number_format::{joined, yaml_float};
use crate::calibration::{Calibration, CameraRecord, OutputFiles, ReadHints, text};
use crate::error::FormatError;
use crate::io::asset_root::AssetRoot;
use crate::io::input_file::InputFile;

const NAMES: [&str; 5] = [
    "cameras.txt",
    "images.txt",
    "rigs.txt",
    "frames.txt",
    "points3D.txt",
];

pub(crate) fn detect(path: &Path, text: &str) -> bool {
    path.file_name()
        .is_some_and(|name| NAMES.iter().any(|known| name == *known))
        && !text.trim_start().starts_with('{')
}

/// The words of a line, one after the other.
struct LineTokens<'a> {
    path: &'a Path,
    line: usize,
    words: std::str::SplitWhitespace<'a>,
}

impl<'a> LineTokens<'a> {
    fn fail(&self, message: impl Into<String>) -> FormatError {
        FormatError::line(self.path, self.line, message)
    }

    fn word(&mut self, what: &str) -> Result<&'a str, FormatError> {
        self.words
            .next()
            .ok_or_else(|| self.fail(format!("{what} is missing")))
    }

    fn parse<T: std::str::FromStr>(&mut self, what: &str) -> Result<T, FormatError> {
        let word = self.word(what)?;
        word.parse()
            .map_err(|_| self.fail(format!("{word:?} is no {what}")))
    }

    fn rigid(&mut self) -> Result<RigidPose, FormatError> {
        let mut rigid = [0.0; 7];
        for value in &mut rigid {
            *value = self.parse("number of a pose")?;
        }
        if is_rigid(&rigid) {
            Ok(rigid)
        } else {
            Err(self.fail("no pose: a quaternion of length 0, or not finite"))
        }
    }

    /// Whether the sensor is a camera, and its id.
    fn sensor(&mut self) -> Result<(bool, u32), FormatError> {
        Ok((
            self.word("SENSOR_TYPE")? == "CAMERA",
            self.parse("SENSOR_ID")?,
        ))
    }

    fn end(mut self) -> Result<(), FormatError> {
        match self.words.next() {
            Some(word) => Err(self.fail(format!("{word:?} is more than belongs here"))),
            None => Ok(()),
        }
    }
}

/// The lines that are no comments. Empty ones count in `images.txt`: that image has no points.
fn lines<'a>(text: &'a str, path: &'a Path) -> impl Iterator<Item = LineTokens<'a>> {
    let comment = |line: &str| line.trim_start().starts_with('#');
    text.lines()
        .enumerate()
        .filter(move |(_, line)| !comment(line))
        .map(move |(i, line)| LineTokens {
            path,
            line: i + 1,
            words: line.split_whitespace(),
        })
}

fn non_empty<'a>(text: &'a str, path: &'a Path) -> impl Iterator<Item = LineTokens<'a>> {
    lines(text, path).filter(|row| row.words.clone().next().is_some())
}

pub(crate) fn read(
    source: &InputFile,
    assets: &mut AssetRoot,
    _: &ReadHints,
) -> Result<Calibration, FormatError> {
    let mut model = Reconstruction::default();
    let mut open = |name: &str| assets.read_reference(&source.path, name);
    let cameras = open("cameras.txt")?;
    for mut row in non_empty(text(&cameras)?, &cameras.path) {
        let (id, name) = (row.parse("CAMERA_ID")?, row.word("MODEL")?.to_owned());
        let size = [row.parse("WIDTH")?, row.parse("HEIGHT")?];
        let mut params = Vec::new();
        while let Some(word) = row.words.next() {
            params.push(
                word.parse()
                    .map_err(|_| row.fail(format!("{word:?} is no number")))?,
            );
        }
        model.cameras.push(ColmapCamera {
            id,
            model: name,
            size,
            params,
        });
    }
    if let Some(images) = optional(open("images.txt"))? {
        let mut rows = lines(text(&images)?, &images.path);
        while let Some(mut row) = rows.next() {
            if row.words.clone().next().is_none() {
                continue;
            }
            let (id, pose, camera) = (
                row.parse("IMAGE_ID")?,
                row.rigid()?,
                row.parse("CAMERA_ID")?,
            );
            let name = row.word("NAME")?.to_owned();
            row.end()?;
            model.images.push(ColmapImage {
                id,
                pose,
                camera,
                name,
            });
            match rows.next() {
                Some(points) if points.words.clone().count() % 3 != 0 => {
                    return Err(
                        points.fail("expected X Y POINT3D_ID, three numbers for each point")
                    );
                }
                Some(_) => {}
                // A file whose last newline is missing ends with the last image, which has no points.
                None => break,
            }
        }
    }
    if let (Some(rigs), Some(frames)) = (optional(open("rigs.txt"))?, optional(open("frames.txt"))?)
    {
        for row in non_empty(text(&rigs)?, &rigs.path) {
            model.rigs.push(rig(row)?);
        }
        for row in non_empty(text(&frames)?, &frames.path) {
            model.frames.push(frame(row)?);
        }
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

fn rig(mut row: LineTokens<'_>) -> Result<Rig, FormatError> {
    let (id, count): (u32, u32) = (row.parse("RIG_ID")?, row.parse("NUM_SENSORS")?);
    let mut cameras = Vec::new();
    for i in 0..count {
        let (is_camera, sensor) = row.sensor()?;
        // The first is the origin of the rig.
        let pose = match i > 0 && row.parse::<u8>("HAS_POSE")? != 0 {
            true => Some(row.rigid()?),
            false if i > 0 => {
                return Err(row.fail(format!("sensor {sensor} has no pose in its rig")));
            }
            false => None,
        };
        if is_camera {
            cameras.push((sensor, pose));
        }
    }
    row.end()?;
    Ok(Rig { id, cameras })
}

fn frame(mut row: LineTokens<'_>) -> Result<Frame, FormatError> {
    let (id, rig, pose, count): (_, _, _, u32) = (
        row.parse("FRAME_ID")?,
        row.parse("RIG_ID")?,
        row.rigid()?,
        row.parse("NUM_DATA_IDS")?,
    );
    let mut images = Vec::new();
    for _ in 0..count {
        let (is_camera, sensor) = row.sensor()?;
        let image = row.parse("DATA_ID")?;
        if is_camera {
            images.push((sensor, image));
        }
    }
    row.end()?;
    Ok(Frame {
        id,
        rig,
        pose,
        images,
    })
}

pub(crate) fn write(records: &[CameraRecord], _: &Path) -> Result<OutputFiles, FormatError> {
    let model = Reconstruction::from_records(records)?;
    let mut cameras = String::from("# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
    for ColmapCamera {
        id,
        model,
        size: [width, height],
        params,
    } in &model.cameras
    {
        cameras += &format!("{id} {model} {width} {height} {}\n", joined(params, " "));
    }
    let mut images = String::from(
        "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n",
    );
    let mut rigs = String::from(
        "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID, HAS_POSE, [QW, \
         QX, QY, QZ, TX, TY, TZ])\n",
    );
    for rig in &model.rigs {
        rigs += &format!("{} {}", rig.id, rig.cameras.len());
        for (camera, pose) in &rig.cameras {
            rigs += &match pose {
                None => format!(" CAMERA {camera}"),
                Some(pose) => format!(" CAMERA {camera} 1 {}", pose.map(yaml_float).join(" ")),
            };
        }
        rigs.push('\n');
    }
    let mut frames = String::from(
        "# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as (SENSOR_TYPE, \
         SENSOR_ID, DATA_ID)\n",
    );
    for ColmapImage {
        id,
        pose,
        camera,
        name,
    } in &model.images
    {
        let pose = pose.map(yaml_float).join(" ");
        images += &format!("{id} {pose} {camera} {name}\n\n");
    }
    for frame in &model.frames {
        let pose = frame.pose.map(yaml_float).join(" ");
        frames += &format!("{} {} {pose} {}", frame.id, frame.rig, frame.images.len());
        for (camera, image) in &frame.images {
            frames += &format!(" CAMERA {camera} {image}");
        }
        frames.push('\n');
    }
    let points =
        "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n".to_owned();
    let texts = [cameras, images, rigs, frames, points];
    let files = NAMES
        .iter()
        .zip(texts)
        .map(|(name, text)| ((*name).to_owned(), text.into_bytes()));
    Ok(OutputFiles {
        files: files.collect(),
        notices: vec![],
    })
}

//! Records of a model and the order of their fields, common to text and binary files.

use crate::colmap::reconstruction::{ColmapCamera, ColmapImage, Frame, Reconstruction, Rig, RigidPose, is_rigid};
use crate::{Calibration, CameraRecord, OutputFiles};
use raycam_formats::io::{AssetRoot, InputFile};
use raycam_formats::{FormatError, Result};

/// Headers of the text files: cameras, images, rigs, frames, points.
const HEADS: [&str; 5] = [
    "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n",
    "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[] as (X, Y, POINT3D_ID)\n",
    "# RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, SENSOR_ID, HAS_POSE, [QW, \
     QX, QY, QZ, TX, TY, TZ])\n",
    "# FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as (SENSOR_TYPE, \
     SENSOR_ID, DATA_ID)\n",
    "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n",
];

/// Format of a model's files: text or binary.
pub(crate) trait ModelFormat {
    /// Names of the files of cameras, images, rigs, frames and points.
    const NAMES: [&'static str; 5];
    type Reader<'a>: RecordReader;
    type Writer: RecordWriter;

    fn reader(file: &InputFile) -> Result<Self::Reader<'_>>;

    /// True if the files can store an image's name.
    fn is_image_name(name: &str) -> bool;
}

/// Reads the fields of a file in order. Field names equal the names in the headers and are used in errors.
pub(crate) trait RecordReader {
    /// Calls `read` for every record of the file, and returns the results.
    fn records<T>(&mut self, read: impl FnMut(&mut Self) -> Result<T>) -> Result<Vec<T>>;

    /// Error in the current record.
    fn fail(&self, message: String) -> FormatError;

    fn u32(&mut self, field: &str) -> Result<u32>;

    /// Reads a number, which has 64 bits in binary files. `what` is the beginning of the error message for a number
    /// that is too large.
    fn size(&mut self, field: &str, what: &str) -> Result<u32>;

    fn f64(&mut self, field: &str) -> Result<f64>;

    fn flag(&mut self, field: &str) -> Result<bool>;

    /// Reads the type of a sensor; returns true for a camera.
    fn is_camera(&mut self) -> Result<bool>;

    /// Reads the name of a camera's model.
    fn camera_model(&mut self, camera: u32) -> Result<String>;

    /// Reads the parameters of a camera with this model.
    fn camera_params(&mut self, model: &str) -> Result<Vec<f64>>;

    fn image_name(&mut self) -> Result<String>;

    /// Ends a record; returns an error if the line of a text file contains further fields.
    fn end_record(&mut self) -> Result<()>;

    /// Skips the points of an image, which follow the image's record.
    fn skip_points2d(&mut self) -> Result<()>;
}

/// Writes the fields of a file in order.
pub(crate) trait RecordWriter: Sized {
    /// Starts a file with this number of records.
    fn new(head: &str, count: usize) -> Self;

    fn u32(&mut self, value: u32);

    /// Writes a number, which has 64 bits in binary files.
    fn size(&mut self, value: u32);

    fn f64s(&mut self, values: &[f64]);

    fn flag(&mut self);

    /// Writes the type and the id of a sensor that is a camera.
    fn camera_sensor(&mut self, id: u32);

    fn camera_model(&mut self, name: &str);

    fn image_name(&mut self, name: &str);

    fn end_record(&mut self);

    /// Writes that an image has no points.
    fn no_points2d(&mut self);

    fn into_bytes(self) -> Vec<u8>;
}

/// Reads the cameras of the model whose files are in the folder of `source`.
pub(crate) fn read<F: ModelFormat>(source: &InputFile, assets: &mut AssetRoot) -> Result<Calibration> {
    let [cameras, images, rigs, frames, _] = F::NAMES;
    let mut model = Reconstruction::default();
    let mut open = |name: &str| assets.read_reference(&source.path, name);
    let cameras = open(cameras)?;
    model.cameras = F::reader(&cameras)?.records(read_camera)?;
    if let Some(images) = optional(open(images))? {
        model.images = F::reader(&images)?.records(read_image)?;
    }
    if let (Some(rigs), Some(frames)) = (optional(open(rigs))?, optional(open(frames))?) {
        model.rigs = F::reader(&rigs)?.records(read_rig)?;
        model.frames = F::reader(&frames)?.records(read_frame)?;
    }
    model.calibration(&source.path)
}

/// Returns the file, or `None` if it is missing; all other errors are kept.
fn optional(file: Result<InputFile>) -> Result<Option<InputFile>> {
    match file {
        Ok(file) => Ok(Some(file)),
        Err(FormatError::Io { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

fn read_pose(reader: &mut impl RecordReader) -> Result<RigidPose> {
    let mut pose = [0.0; 7];
    for value in &mut pose {
        *value = reader.f64("number of a pose")?;
    }
    if is_rigid(&pose) {
        Ok(pose)
    } else {
        Err(reader.fail(format!(
            "invalid pose {pose:?} (QW QX QY QZ TX TY TZ); expected finite numbers and a quaternion other than 0"
        )))
    }
}

fn read_camera(reader: &mut impl RecordReader) -> Result<ColmapCamera> {
    let id = reader.u32("CAMERA_ID")?;
    let model = reader.camera_model(id)?;
    let size = [reader.size("WIDTH", "a width of")?, reader.size("HEIGHT", "a height of")?];
    let params = reader.camera_params(&model)?;
    reader.end_record()?;
    Ok(ColmapCamera { id, model, size, params })
}

fn read_image(reader: &mut impl RecordReader) -> Result<ColmapImage> {
    let image = ColmapImage {
        id: reader.u32("IMAGE_ID")?,
        pose: read_pose(reader)?,
        camera: reader.u32("CAMERA_ID")?,
        name: reader.image_name()?,
    };
    reader.end_record()?;
    reader.skip_points2d()?;
    Ok(image)
}

fn read_rig(reader: &mut impl RecordReader) -> Result<Rig> {
    let (id, count) = (reader.u32("RIG_ID")?, reader.u32("NUM_SENSORS")?);
    let mut cameras = Vec::new();
    let mut unplaced = Vec::new();
    for i in 0..count {
        let (is_camera, sensor) = (reader.is_camera()?, reader.u32("SENSOR_ID")?);
        // The first sensor is the origin of the rig. An IMU, or a camera that was not registered, may have no pose.
        let pose = match i > 0 && reader.flag("HAS_POSE")? {
            true => Some(read_pose(reader)?),
            false => None,
        };
        match (is_camera, i > 0 && pose.is_none()) {
            (true, false) => cameras.push((sensor, pose)),
            (true, true) => unplaced.push(sensor),
            (false, _) => {}
        }
    }
    reader.end_record()?;
    Ok(Rig { id, cameras, unplaced })
}

fn read_frame(reader: &mut impl RecordReader) -> Result<Frame> {
    let (id, rig) = (reader.u32("FRAME_ID")?, reader.u32("RIG_ID")?);
    let pose = read_pose(reader)?;
    let mut images = Vec::new();
    for _ in 0..reader.u32("NUM_DATA_IDS")? {
        let (is_camera, sensor) = (reader.is_camera()?, reader.u32("SENSOR_ID")?);
        let image = reader.size("DATA_ID", "an image id of")?;
        if is_camera {
            images.push((sensor, image));
        }
    }
    reader.end_record()?;
    Ok(Frame { id, rig, pose, images })
}

/// Returns the files of a model with these cameras.
pub(crate) fn write<F: ModelFormat>(records: &[CameraRecord]) -> Result<OutputFiles> {
    let model = Reconstruction::from_records(records, F::is_image_name)?;
    let files = [
        write_file::<F, _>(0, &model.cameras, write_camera),
        write_file::<F, _>(1, &model.images, write_image),
        write_file::<F, _>(2, &model.rigs, write_rig),
        write_file::<F, _>(3, &model.frames, write_frame),
        write_file::<F, ()>(4, &[], |_, ()| {}),
    ];
    Ok(OutputFiles { files: files.into(), notices: vec![] })
}

/// Returns the name and the bytes of a file; `file` is its index in [`ModelFormat::NAMES`].
fn write_file<F: ModelFormat, T>(file: usize, records: &[T], write: impl Fn(&mut F::Writer, &T)) -> (String, Vec<u8>) {
    let mut writer = F::Writer::new(HEADS[file], records.len());
    for record in records {
        write(&mut writer, record);
    }
    (F::NAMES[file].to_owned(), writer.into_bytes())
}

fn write_camera(writer: &mut impl RecordWriter, camera: &ColmapCamera) {
    writer.u32(camera.id);
    writer.camera_model(&camera.model);
    for side in camera.size {
        writer.size(side);
    }
    writer.f64s(&camera.params);
    writer.end_record();
}

fn write_image(writer: &mut impl RecordWriter, image: &ColmapImage) {
    writer.u32(image.id);
    writer.f64s(&image.pose);
    writer.u32(image.camera);
    writer.image_name(&image.name);
    writer.end_record();
    writer.no_points2d();
}

fn write_rig(writer: &mut impl RecordWriter, rig: &Rig) {
    writer.u32(rig.id);
    writer.u32(rig.cameras.len() as u32);
    for (camera, pose) in &rig.cameras {
        writer.camera_sensor(*camera);
        if let Some(pose) = pose {
            writer.flag();
            writer.f64s(pose);
        }
    }
    writer.end_record();
}

fn write_frame(writer: &mut impl RecordWriter, frame: &Frame) {
    writer.u32(frame.id);
    writer.u32(frame.rig);
    writer.f64s(&frame.pose);
    writer.u32(frame.images.len() as u32);
    for (camera, image) in &frame.images {
        writer.camera_sensor(*camera);
        writer.size(*image);
    }
    writer.end_record();
}

//! `aperture` and `shutter` of a camera.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::{Aperture, Pose, ReadoutDirection, ShutterMotion};
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::schema::spec::pose::PoseSpec;

/// The opening of a thin lens: `radius`, or `f_number` with `focal_length`; and `focus`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ApertureSpec {
    /// Radius of the opening (for a polygon, of its corners), in world units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Focal length divided by the diameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Focal length in world units (50 mm is 0.05), with `f_number`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_length: Option<f64>,
    /// Depth at which points are sharp, in world units; for wide-angle lens models, the distance.
    pub focus: Option<f64>,
    /// Number of sides of a polygonal opening, 3 to 64; default 0, a round opening.
    pub blades: u32,
    /// Rotation of the polygon in degrees from the camera's x axis towards its y axis; at 0, a corner is on the x axis.
    pub rotation: f64,
}

/// Exposure of an image's lines, and the camera's motion during the exposure: `end`, a pose to which the camera moves
/// from its own pose, or a complete `track`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ShutterSpec {
    /// Exposure time of each line in seconds; default 0.
    pub exposure: f64,
    /// Time from the first line to the last in seconds, for a rolling shutter; default 0.
    pub readout: f64,
    /// Readout order of the lines: "down" (rows, from the top), "up", "right" (columns, from the left) or "left".
    pub direction: ReadoutDirection,
    /// Pose of the camera when the last line closes, after `readout + exposure`. Without `end` and `track` the camera
    /// does not move; moving objects are blurred nevertheless.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<PoseSpec>,
    /// Poses at times, in seconds from the opening of the first line. They replace the camera's own pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub track: Option<Vec<TrackSpec>>,
    /// Pose of the camera in the axes of a body that carries it; `track` then contains the poses of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mount: Option<PoseSpec>,
}

/// Pose at a time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TrackSpec {
    /// Time in seconds from the opening of the first line.
    pub time: f64,
    /// The pose at this time.
    pub pose: PoseSpec,
}

impl ApertureSpec {
    /// Describes an aperture.
    pub fn from_aperture(aperture: &Aperture) -> Self {
        Self {
            radius: Some(aperture.radius()),
            focus: Some(aperture.focus()),
            blades: aperture.blades(),
            rotation: aperture.rotation(),
            ..Self::default()
        }
    }

    /// Returns the described aperture.
    ///
    /// # Errors
    /// [`SceneError`] if the opening's size or focus is missing or given twice, and the errors of [`Aperture::new`].
    pub fn build(&self) -> Result<Aperture> {
        let fail = |code, message: &str| Err(SceneError::schema(code, "", message));
        let radius = match (self.radius, self.f_number, self.focal_length) {
            (Some(radius), None, None) => radius,
            (None, Some(f_number), Some(focal_length)) => {
                if !(f_number > 0.0 && focal_length > 0.0) {
                    let message = format!(
                        "f_number is {f_number}, focal_length is {focal_length}; expected numbers greater than 0"
                    );
                    return fail(ErrorCode::OutOfRange, &message);
                }
                focal_length / (2.0 * f_number)
            }
            _ => return fail(ErrorCode::MissingValue, "expected radius, or f_number with focal_length"),
        };
        let Some(focus) = self.focus else {
            return fail(
                ErrorCode::MissingValue,
                "focus is missing; set it to the depth in metres at which the image is sharp",
            );
        };
        Aperture::new(radius, focus, self.blades, self.rotation)
    }
}

impl ShutterSpec {
    /// Describes a motion.
    pub fn from_motion(motion: &ShutterMotion) -> Self {
        let track =
            motion.poses().iter().map(|(time, pose)| TrackSpec { time: *time, pose: PoseSpec::from_pose(pose) });
        Self {
            exposure: motion.exposure(),
            readout: motion.readout(),
            direction: motion.direction(),
            end: None,
            track: Some(track.collect()),
            mount: motion.camera_from_body().map(PoseSpec::from_pose),
        }
    }

    /// The first pose of the track, if a track is given.
    pub fn first_pose(&self) -> Option<&PoseSpec> {
        Some(&self.track.as_ref()?.first()?.pose)
    }

    /// Returns the described motion of a camera that starts at a pose; `read` reads the poses.
    ///
    /// # Errors
    /// [`SceneError`] if the path is given twice, and the errors of [`ShutterMotion::new`].
    pub fn build(&self, start: Pose, read: impl Fn(&PoseSpec) -> Result<Pose>) -> Result<ShutterMotion> {
        let poses = match (&self.end, &self.track) {
            (Some(end), None) => {
                let end = read(end).map_err(|error| error.in_context("end"))?;
                let last = self.exposure + self.readout;
                if last.is_nan() || last <= 0.0 {
                    let message = "exposure and readout are both 0, so the pose \"end\" is never reached; set one \
                                   of them";
                    return Err(SceneError::schema(ErrorCode::OutOfRange, "", message));
                }
                vec![(0.0, start), (last, end)]
            }
            (None, Some(track)) => track
                .iter()
                .enumerate()
                .map(|(i, key)| {
                    let pose = read(&key.pose).map_err(|error| error.in_context(&format!("track[{i}].pose")))?;
                    Ok((key.time, pose))
                })
                .collect::<Result<_>>()?,
            (None, None) => vec![(0.0, start)],
            (Some(_), Some(_)) => {
                let message =
                    "cannot be combined with \"track\", which already contains the path; use only one of them";
                return Err(SceneError::schema(ErrorCode::ConflictingValues, "end", message));
            }
        };
        ShutterMotion::new(self.exposure, self.readout, self.direction, poses)
    }
}

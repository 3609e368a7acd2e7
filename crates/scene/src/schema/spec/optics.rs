//! `aperture` and `shutter` of a camera.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::{Aperture, Pose, ReadoutDirection, ShutterMotion};
use crate::error::{Result, SceneError};
use crate::schema::spec::pose::PoseSpec;

/// The opening of a thin lens: `radius`, or `f_number` with `focal_length`; and `focus`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ApertureSpec {
    /// Its radius, or that of its corners, in units of the world.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// The focal length over the diameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// The focal length in units of the world (50 mm is 0.05), with `f_number`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal_length: Option<f64>,
    /// The depth that is sharp, in units of the world; a distance for lenses that see to the sides and behind.
    pub focus: Option<f64>,
    /// The sides of a polygonal opening, 3 to 64; 0, a round one, where not given.
    pub blades: u32,
    /// How far the polygon is turned, in degrees from the camera's x towards its y, where a corner lies at 0.
    pub rotation: f64,
}

/// When the lines of a moving camera's picture are exposed, and where it is then: `end`, where it starts from its own
/// pose, or a whole `track`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ShutterSpec {
    /// How long a line is open, in seconds; 0 where not given.
    pub exposure: f64,
    /// How long it takes from the first line to the last, in seconds: a rolling shutter. 0 where not given.
    pub readout: f64,
    /// Which lines there are, and which is the first: "down" (rows, from the top), "up", "right" (columns, from the
    /// left) or "left".
    pub direction: ReadoutDirection,
    /// The pose when the last line closes, after `readout + exposure`; it stands where neither this nor `track` is given,
    /// and what moves before it is blurred all the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<PoseSpec>,
    /// Poses at times, in seconds from when the first line opens. The camera's own pose is then not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub track: Option<Vec<TrackSpec>>,
    /// The pose of a camera that a body carries, in the axes of the body; `track` then has the poses of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mount: Option<PoseSpec>,
}

/// A pose at a time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TrackSpec {
    /// In seconds from when the first line opens.
    pub time: f64,
    /// The pose at this time.
    pub pose: PoseSpec,
}

impl ApertureSpec {
    /// As it is written.
    pub fn from_aperture(aperture: &Aperture) -> Self {
        Self {
            radius: Some(aperture.radius()),
            focus: Some(aperture.focus()),
            blades: aperture.blades(),
            rotation: aperture.rotation(),
            ..Self::default()
        }
    }

    /// The aperture it describes.
    ///
    /// # Errors
    /// [`SceneError`] where its size or focus is missing or given twice, and those of [`Aperture::new`].
    pub fn build(&self) -> Result<Aperture> {
        let fail = |message: &str| Err(SceneError::schema("", message));
        let radius = match (self.radius, self.f_number, self.focal_length) {
            (Some(radius), None, None) => radius,
            (None, Some(f_number), Some(focal_length)) => {
                if !(f_number > 0.0 && focal_length > 0.0) {
                    return fail("f_number and focal_length must be greater than 0");
                }
                focal_length / (2.0 * f_number)
            }
            _ => return fail("expected radius, or f_number with focal_length"),
        };
        let Some(focus) = self.focus else { return fail("focus, the depth that is sharp, is missing") };
        Aperture::new(radius, focus, self.blades, self.rotation)
    }
}

impl ShutterSpec {
    /// As it is written.
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

    /// The first pose of the track, where there is one.
    pub fn first_pose(&self) -> Option<&PoseSpec> {
        Some(&self.track.as_ref()?.first()?.pose)
    }

    /// The motion it describes, of a camera that starts at a pose, or of what has its poses read by `read`.
    ///
    /// # Errors
    /// [`SceneError`] where the way is given twice, and those of [`ShutterMotion::new`].
    pub fn build(&self, start: Pose, read: impl Fn(&PoseSpec) -> Result<Pose>) -> Result<ShutterMotion> {
        let poses = match (&self.end, &self.track) {
            (Some(end), None) => {
                let end = read(end).map_err(|error| error.in_context("end"))?;
                let last = self.exposure + self.readout;
                if last.is_nan() || last <= 0.0 {
                    let message = "exposure and readout are both 0: there is no time to move in";
                    return Err(SceneError::schema("", message));
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
                let message = "\"track\" is given too, and says already where it goes";
                return Err(SceneError::schema("end", message));
            }
        };
        ShutterMotion::new(self.exposure, self.readout, self.direction, poses)
    }
}

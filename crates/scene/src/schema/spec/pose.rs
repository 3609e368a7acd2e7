//! Pose of a camera or body.

use glam::{DMat3, DVec3};

use crate::camera::{Camera, PixelCenter, Pose};
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::math::rotation::CAMERA_FROM_BODY;
use crate::schema::keys::{Keys, by_key};
use crate::up::Up;

/// Defines a table that contains the nine keys of a pose: the position and the orientation. The documentation of some
/// keys depends on the placed part. The keys are written out instead of flattened, so that errors list all names and
/// lines.
macro_rules! with_pose {
    (
        $(#[$about:meta])*
        pub struct $name:ident { $($before:tt)* }
        camera pose
        { $($after:tt)* }
    ) => {
        $crate::schema::spec::pose::with_pose! {
            $(#[$about])*
            pub struct $name { $($before)* }
            pose {
                location: "The camera centre in the world.",
                target: "A point to look at, instead of angles.",
                up: "Direction that points up in the image, with `target`; default: the world's up axis.",
                R: "The rotation camera_from_world, camera axes x right, y down, z forward.",
                C: "The camera centre in the world, with `R`.",
            }
            { $($after)* }
        }
    };
    (
        $(#[$about:meta])*
        pub struct $name:ident { $($before:tt)* }
        pose {
            location: $location:literal, target: $target:literal, up: $up:literal, R: $r:literal, C: $c:literal,
        }
        { $($after:tt)* }
    ) => {
        $(#[$about])*
        #[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name {
            $($before)*
            #[doc = $location]
            #[serde(skip_serializing_if = "Option::is_none")]
            pub location: Option<[f64; 3]>,
            /// Roll in degrees, positive to the right; default 0.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub roll: Option<f64>,
            /// Pitch in degrees, positive downwards; default 0.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub pitch: Option<f64>,
            /// Yaw in degrees, positive to the left; default 0. 0 looks along +x in a z-up world, along -z in a y-up
            /// world.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub yaw: Option<f64>,
            #[doc = $target]
            #[serde(skip_serializing_if = "Option::is_none")]
            pub target: Option<[f64; 3]>,
            #[doc = $up]
            #[serde(skip_serializing_if = "Option::is_none")]
            pub up: Option<[f64; 3]>,
            #[doc = $r]
            #[serde(rename = "R", skip_serializing_if = "Option::is_none")]
            pub r: Option<[[f64; 3]; 3]>,
            #[doc = $c]
            #[serde(rename = "C", skip_serializing_if = "Option::is_none")]
            pub c: Option<[f64; 3]>,
            /// The translation -R C, with `R`.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub t: Option<[f64; 3]>,
            $($after)*
        }
    };
}
pub(crate) use with_pose;

/// Returns the [`PoseSpec`] of a table defined by [`with_pose`].
macro_rules! pose_of {
    ($table:expr) => {
        $crate::schema::spec::pose::PoseSpec {
            location: $table.location,
            roll: $table.roll,
            pitch: $table.pitch,
            yaw: $table.yaw,
            target: $table.target,
            up: $table.up,
            r: $table.r,
            c: $table.c,
            t: $table.t,
        }
    };
}
pub(crate) use pose_of;

with_pose! {
    /// A camera's pose: `location` with angles or a `target`, or `R` with `C` or `t`.
    #[derive(PartialEq)]
    pub struct PoseSpec {}
    camera pose
    {}
}

/// Keys of a pose; the first six are used without `R`.
pub const POSE: [&str; 9] = ["location", "roll", "pitch", "yaw", "target", "up", "R", "C", "t"];

impl PoseSpec {
    /// Describes a pose exactly, by R and C.
    pub fn from_pose(pose: &Pose) -> Self {
        Self { r: Some(pose.r.transpose().to_cols_array_2d()), c: Some(pose.c.to_array()), ..Self::default() }
    }

    /// Returns the described pose.
    ///
    /// # Errors
    /// [`SceneError`] if the pose is missing or given twice, and the errors of [`Camera`]'s constructors.
    pub fn build(&self, up: Up) -> Result<Pose> {
        // A pose does not depend on the camera's intrinsics.
        let (k, size, center) = (DMat3::IDENTITY, [1, 1], PixelCenter::default());
        let keys = self.keys();
        let camera = if let Some(r) = self.r {
            keys.refuse(&POSE[..6], "cannot be combined with \"R\"; use R with only C or t")?;
            let r = DMat3::from_cols_array_2d(&r).transpose();
            let c = match keys.exactly_one("camera position", &["C", "t"])? {
                "C" => DVec3::from_array(self.c.unwrap_or_default()),
                _ => -(r.transpose() * DVec3::from_array(self.t.unwrap_or_default())),
            };
            Camera::new(k, r, c, size, center)?
        } else {
            keys.refuse_without("\"R\" (with angles or a target, use \"location\")", &["C", "t"])?;
            let Some(location) = self.location.map(DVec3::from_array) else {
                let message = "no pose; expected location with roll, pitch, yaw or target, or R with C or t, or matrix";
                return Err(SceneError::schema(ErrorCode::MissingValue, "", message));
            };
            if let Some(target) = self.target {
                keys.refuse(
                    &["roll", "pitch", "yaw"],
                    "cannot be combined with \"target\"; use either angles or a target",
                )?;
                let up = self.up.map_or(up.axis(), DVec3::from_array);
                let target = DVec3::from_array(target);
                Camera::look_at(location, target, up, k, size, center)?
            } else {
                keys.refuse_as(
                    ErrorCode::MissingValue,
                    &["up"],
                    "requires \"target\", which is missing; with angles, use roll to tilt the camera",
                )?;
                let [roll, pitch, yaw] = [self.roll, self.pitch, self.yaw].map(Option::unwrap_or_default);
                Camera::from_pose(location, roll, pitch, yaw, up, k, size, center)?
            }
        };
        Ok(Pose { r: camera.r(), c: camera.c() })
    }

    /// Returns the described pose of a body, whose axes are x forward, y left, z up if all angles are 0.
    ///
    /// # Errors
    /// The errors of [`PoseSpec::build`].
    pub fn build_body(&self, up: Up) -> Result<Pose> {
        let pose = self.build(up)?;
        Ok(match self.r {
            Some(_) => pose,
            None => Pose { r: CAMERA_FROM_BODY.transpose() * pose.r, ..pose },
        })
    }

    /// Returns the keys that are present.
    pub fn keys(&self) -> Keys<9> {
        Keys(by_key! { self, is_some: location, roll, pitch, yaw, target, up, "R" r, "C" c, t })
    }
}

//! `[camera]`.

use glam::{DMat3, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::keys::Keys;
use super::words::Splat;
use crate::camera::{
    Camera, Lens, LensModel, PixelCenter, intrinsics_from_focal, intrinsics_from_fov,
};
use crate::error::SceneError;
use crate::world::Up;

/// A camera: its size, its intrinsics (exactly one of `focal`, `fov`, `K`) and its pose (`location` with angles or a
/// `target`, or `R` with `C` or `t`), or all of it as one `matrix`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSpec {
    /// What it is asked for by; `camera` where not given.
    pub name: Option<String>,
    /// Columns and rows of the picture; 640 x 480 where not given.
    pub size: Option<[u32; 2]>,
    /// The focal length in pixels, or those of x and y.
    pub focal: Option<Splat<2>>,
    /// The vertical field of view in degrees, with square pixels.
    pub fov: Option<f64>,
    /// The intrinsic matrix [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels.
    #[serde(rename = "K")]
    pub k: Option<[[f64; 3]; 3]>,
    /// The whole 3x4 camera matrix P, of any scale and sign.
    pub matrix: Option<[[f64; 4]; 3]>,
    /// The skew of `focal` or `fov`, in pixels; 0 where not given.
    pub skew: Option<f64>,
    /// The principal point of `focal` or `fov`, in pixels; the image's centre where not given.
    pub principal_point: Option<[f64; 2]>,
    /// The lens's distortion coefficients, in the order of OpenCV; no distortion where not given.
    pub distortion: Option<Vec<f64>>,
    /// The model of `distortion`: "opencv" (4, 5, 8, 12 or 14 coefficients k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 taux
    /// tauy) or "fisheye" (4: k1 k2 k3 k4); "opencv" where not given.
    pub lens: Option<LensModel>,
    /// Where the centre of the first pixel lies: "integer" at (0, 0) as in OpenCV, "half" at (0.5, 0.5) as in COLMAP.
    pub pixel_center: PixelCenter,
    /// The camera centre in the world.
    pub location: Option<[f64; 3]>,
    /// Leaning to the right, in degrees; 0 where not given.
    pub roll: Option<f64>,
    /// Looking down, in degrees; 0 where not given.
    pub pitch: Option<f64>,
    /// Turning left, in degrees; 0 looks along +x of a z-up world, along -z of a y-up one.
    pub yaw: Option<f64>,
    /// A point to look at, instead of angles.
    pub target: Option<[f64; 3]>,
    /// What points up in the picture, with `target`; the world's up where not given.
    pub up: Option<[f64; 3]>,
    /// The rotation camera_from_world, camera axes x right, y down, z forward.
    #[serde(rename = "R")]
    pub r: Option<[[f64; 3]; 3]>,
    /// The camera centre in the world, with `R`.
    #[serde(rename = "C")]
    pub c: Option<[f64; 3]>,
    /// The translation -R C, with `R`.
    pub t: Option<[f64; 3]>,
}

/// The keys that say what the camera's intrinsics are; the first four each say all of it.
const INTRINSICS: [&str; 6] = ["focal", "fov", "K", "matrix", "skew", "principal_point"];
/// The keys that say where the camera is; the first six do without `R`.
const POSE: [&str; 9] = [
    "location", "roll", "pitch", "yaw", "target", "up", "R", "C", "t",
];

impl CameraSpec {
    /// The camera it describes.
    ///
    /// # Errors
    /// [`SceneError`] where intrinsics or pose are missing or given twice, and those of [`Camera`]'s constructors.
    pub fn build(&self, up: Up) -> Result<Camera, SceneError> {
        let lens = match &self.distortion {
            Some(distortion) => Lens::new(self.lens.unwrap_or_default(), distortion)
                .map_err(|error| error.within("distortion"))?,
            None => {
                let message = "\"distortion\", the coefficients of the lens, is missing: [0, 0, 0, 0] is a fisheye \
                               whose radius is the angle";
                self.keys().refuse(&["lens"], message)?;
                Lens::Pinhole
            }
        };
        Ok(self.pinhole(up)?.with_lens(lens))
    }

    /// The camera without its lens.
    fn pinhole(&self, up: Up) -> Result<Camera, SceneError> {
        let size = self.size.unwrap_or([640, 480]);
        let keys = self.keys();
        if let Some(matrix) = self.matrix {
            keys.refuse(
                &["distortion", "lens"],
                "\"matrix\" is given too, which says what a pinhole does: expected K and R with C or t beside a lens",
            )?;
            let others = INTRINSICS
                .iter()
                .chain(&POSE)
                .filter(|key| **key != "matrix")
                .copied()
                .collect::<Vec<_>>();
            keys.refuse(
                &others,
                "\"matrix\" is given too, and says it already: give one of them",
            )?;
            return Camera::from_matrix(matrix, size, self.pixel_center)
                .map_err(|error| error.within("matrix"));
        }
        let k = self.intrinsics(size, &keys)?;
        if let Some(r) = self.r {
            keys.refuse(
                &POSE[..6],
                "\"R\" is given too: expected R with C or t alone",
            )?;
            let r = DMat3::from_cols_array_2d(&r).transpose();
            let c = match keys.exactly_one("position beside R", &["C", "t"])? {
                "C" => DVec3::from_array(self.c.unwrap_or_default()),
                _ => -(r.transpose() * DVec3::from_array(self.t.unwrap_or_default())),
            };
            return Camera::new(k, r, c, size, self.pixel_center);
        }
        keys.refuse(
            &["C", "t"],
            "it goes with \"R\", which is missing; with angles or a target it is \"location\"",
        )?;
        let Some(location) = self.location.map(DVec3::from_array) else {
            let message = "no pose: expected location with roll, pitch, yaw or target, or R with C or t, or matrix";
            return Err(SceneError::schema("", message));
        };
        if let Some(target) = self.target {
            keys.refuse(
                &["roll", "pitch", "yaw"],
                "\"target\" is given too: expected angles or a target",
            )?;
            let up = self.up.map_or(up.axis(), DVec3::from_array);
            return Camera::look_at(
                location,
                DVec3::from_array(target),
                up,
                k,
                size,
                self.pixel_center,
            );
        }
        keys.refuse(
            &["up"],
            "it goes with \"target\", which is missing; with angles, roll leans the camera",
        )?;
        let [roll, pitch, yaw] = [self.roll, self.pitch, self.yaw].map(Option::unwrap_or_default);
        Camera::from_pose(location, roll, pitch, yaw, up, k, size, self.pixel_center)
    }

    fn intrinsics(&self, size: [u32; 2], keys: &Keys<17>) -> Result<DMat3, SceneError> {
        keys.exactly_one("intrinsics", &INTRINSICS[..4])?;
        if let Some(k) = self.k {
            keys.refuse(
                &["skew", "principal_point"],
                "\"K\" is given too, and says it already",
            )?;
            return Ok(DMat3::from_cols_array_2d(&k).transpose());
        }
        let mut k = match (self.fov, self.focal) {
            (Some(fov), _) => intrinsics_from_fov(fov, size, self.pixel_center)
                .map_err(|error| error.within("fov"))?,
            (None, focal) => {
                let [fx, fy] = focal.unwrap_or(Splat([1.0; 2])).0;
                let mut k = intrinsics_from_focal(fx, size, self.pixel_center);
                k.y_axis.y = fy;
                k
            }
        };
        k.y_axis.x = self.skew.unwrap_or(0.0);
        if let Some([cx, cy]) = self.principal_point {
            (k.z_axis.x, k.z_axis.y) = (cx, cy);
        }
        Ok(k)
    }

    fn keys(&self) -> Keys<17> {
        Keys([
            ("focal", self.focal.is_some()),
            ("fov", self.fov.is_some()),
            ("K", self.k.is_some()),
            ("matrix", self.matrix.is_some()),
            ("skew", self.skew.is_some()),
            ("principal_point", self.principal_point.is_some()),
            ("distortion", self.distortion.is_some()),
            ("lens", self.lens.is_some()),
            ("location", self.location.is_some()),
            ("roll", self.roll.is_some()),
            ("pitch", self.pitch.is_some()),
            ("yaw", self.yaw.is_some()),
            ("target", self.target.is_some()),
            ("up", self.up.is_some()),
            ("R", self.r.is_some()),
            ("C", self.c.is_some()),
            ("t", self.t.is_some()),
        ])
    }
}

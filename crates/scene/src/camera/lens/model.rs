//! Lens models.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::counted::counted;
use crate::error::{Result, SceneError, suggestion};
use crate::error_code::ErrorCode;

/// Lens models, with the names used in files and arguments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LensModel {
    /// OpenCV's main model: 4, 5, 8, 12 or 14 coefficients.
    #[default]
    #[serde(rename = "opencv")]
    OpenCv,
    /// OpenCV's fisheye model (Kannala and Brandt), Kalibr's `equi`: 4 coefficients.
    Fisheye,
    /// COLMAP's THIN_PRISM_FISHEYE: 8 coefficients.
    ThinPrismFisheye,
    /// COLMAP's RAD_TAN_THIN_PRISM_FISHEYE, Project Aria's fisheye: 12 coefficients.
    RadTanThinPrismFisheye,
    /// The field-of-view model: 1 coefficient.
    Fov,
    /// The division model: 1 coefficient.
    Division,
    /// The unified model without distortion (1 coefficient) or with radial and tangential distortion (5).
    Omni,
    /// The enhanced unified model: 2 coefficients.
    Eucm,
    /// The double sphere model: 2 coefficients.
    #[serde(rename = "ds")]
    DoubleSphere,
    /// The panorama of longitude and latitude: no coefficients.
    Equirectangular,
    /// The panorama of longitude and height: no coefficients.
    Cylindrical,
}

impl LensModel {
    /// All models.
    pub const ALL: [Self; 11] = [
        Self::OpenCv,
        Self::Fisheye,
        Self::ThinPrismFisheye,
        Self::RadTanThinPrismFisheye,
        Self::Fov,
        Self::Division,
        Self::Omni,
        Self::Eucm,
        Self::DoubleSphere,
        Self::Equirectangular,
        Self::Cylindrical,
    ];

    /// Name in files and arguments.
    pub fn name(self) -> &'static str {
        match self {
            Self::OpenCv => "opencv",
            Self::Fisheye => "fisheye",
            Self::ThinPrismFisheye => "thin_prism_fisheye",
            Self::RadTanThinPrismFisheye => "rad_tan_thin_prism_fisheye",
            Self::Fov => "fov",
            Self::Division => "division",
            Self::Omni => "omni",
            Self::Eucm => "eucm",
            Self::DoubleSphere => "ds",
            Self::Equirectangular => "equirectangular",
            Self::Cylindrical => "cylindrical",
        }
    }

    /// Names of the model's coefficients, in the order of `distortion`; a camera may use only the first few.
    pub fn coefficient_names(self) -> &'static [&'static str] {
        match self {
            Self::OpenCv => &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y"],
            Self::Fisheye => &["k1", "k2", "k3", "k4"],
            Self::ThinPrismFisheye => &["k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"],
            Self::RadTanThinPrismFisheye => &["k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3"],
            Self::Fov => &["omega"],
            Self::Division => &["k"],
            Self::Omni => &["xi", "k1", "k2", "p1", "p2"],
            Self::Eucm => &["alpha", "beta"],
            Self::DoubleSphere => &["xi", "alpha"],
            Self::Equirectangular | Self::Cylindrical => &[],
        }
    }

    /// Returns the model with this name.
    ///
    /// # Errors
    /// [`SceneError::Camera`] with the nearest name if there is no such model.
    pub fn from_name(name: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|model| model.name() == name);
        found.ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            let hint = suggestion(name, names);
            let message = format!("unknown lens model {name:?}{hint}; expected one of {}", names.join(", "));
            SceneError::Camera(ErrorCode::UnknownName.message(message))
        })
    }

    /// True if the model is a panorama, which has no coefficients and repeats every 360 degrees.
    pub fn is_panorama(self) -> bool {
        matches!(self, Self::Equirectangular | Self::Cylindrical)
    }
}

/// Error for a wrong number of coefficients.
pub(super) fn wrong_count(given: &[f64], model: LensModel, expected: &str) -> SceneError {
    SceneError::lens(format!(
        "distortion {given:?} has {}; the {} model requires {expected}",
        counted(given.len(), "coefficient"),
        model.name()
    ))
}

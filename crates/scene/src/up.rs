//! Axis that points up.

use glam::{DMat3, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Axis of the world that points up. Roll, pitch, yaw, orbits and skies refer to this axis; vertices are never rotated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// z up, as in robotics and most CAD.
    #[default]
    Z,
    /// y up, as in glTF.
    Y,
}

impl Up {
    /// Unit vector that points up.
    pub fn axis(self) -> DVec3 {
        match self {
            Up::Z => DVec3::Z,
            Up::Y => DVec3::Y,
        }
    }

    /// Rotation about the x axis that maps the axis `from` to this axis; exact.
    pub fn rotation_from(self, from: Up) -> DMat3 {
        match (from, self) {
            (Up::Y, Up::Z) => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
            (Up::Z, Up::Y) => DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
            _ => DMat3::IDENTITY,
        }
    }

    /// The axis's name in descriptions.
    pub fn name(self) -> &'static str {
        match self {
            Up::Z => "z",
            Up::Y => "y",
        }
    }
}

//! The axis that points up.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The axis of the world that points up. Roll, pitch, yaw, orbits and skies refer to it; vertices are never turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Up {
    /// z up, as in robotics and most CAD.
    #[default]
    Z,
    /// y up, as in glTF.
    Y,
}

impl Up {
    /// The unit vector that points up.
    pub fn axis(self) -> DVec3 {
        match self {
            Up::Z => DVec3::Z,
            Up::Y => DVec3::Y,
        }
    }
}

//! Properties that lights of every type have.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Name, visibility and body of a light.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LightTraits {
    /// Name in channels; default: the light's type.
    pub name: Option<String>,
    /// The kinds of rays to which the light is visible.
    pub visible: LightVisibility,
    /// True if an object with the light's shape occludes what is behind it and appears in ground truth.
    #[serde(default)]
    pub has_body: bool,
}

/// The kinds of rays to which a light is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LightVisibility {
    /// True if the camera shows the light: its shape, or the background that it forms.
    pub camera: bool,
    /// True if mirrors and glass show the light.
    pub reflection: bool,
    /// True if the light illuminates surfaces and media.
    pub light: bool,
}

impl Default for LightVisibility {
    fn default() -> Self {
        Self { camera: true, reflection: true, light: true }
    }
}

impl LightVisibility {
    /// True if the light is visible to all kinds of rays.
    pub fn is_everywhere(self) -> bool {
        self == Self::default()
    }
}

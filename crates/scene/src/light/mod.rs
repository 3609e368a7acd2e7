//! Lights, in radiometric units.

pub(crate) mod blackbody;
pub(crate) mod file_ref;
pub(crate) mod ies_profile;
mod strength;
pub(crate) mod traits;
pub(crate) mod validate;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::Camera;
use crate::counted::counted;
use crate::light::strength::{Strength, optional_strength, strength};
use crate::notice::{Notice, NoticeCode};
use crate::texture::{Image, Texels};

pub use crate::light::file_ref::FileRef;
pub use crate::light::ies_profile::IesProfile;
pub use crate::light::traits::{LightTraits, LightVisibility};

/// Luminous efficacy in lm/W by which photometric units are converted: the efficacy of light at 555 nm, to which the
/// eye is most sensitive.
pub const LUMENS_PER_WATT: f64 = 683.0;

/// A light of the type specified by `type`: `{ type = "sun", ... }`. All values are radiometric and linear; a single
/// number instead of red, green and blue means grey.
///
/// A light has no mesh: if it has a size, it is visible directly and in mirrors, but casts no shadow and does not
/// appear in ground truth, unless `body = true`. To make an object shine, set its `emission`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
// The schema's deserialiser selects the variant by the table's `type`, so that errors inside the table keep their
// position.
#[serde(rename_all = "lowercase", deny_unknown_fields)]
#[schemars(tag = "type")]
pub enum Light {
    /// Distant light: parallel or, with `angular_diameter` > 0, from a disk in the sky.
    Sun {
        /// The direction in which the light travels, in the world; any length except zero.
        direction: [f64; 3],
        /// Linear RGB in W/m² on a surface that faces the sun.
        #[serde(deserialize_with = "strength")]
        #[schemars(with = "Strength")]
        irradiance: [f32; 3],
        /// Angle that the sun subtends, in degrees, below 180; Earth's sun subtends 0.53. An angle above 0 gives
        /// shadows soft edges and shows a bright disk in the sky.
        #[serde(default)]
        angular_diameter: f64,
    },
    /// A light bulb: a point or, with `radius` > 0, a sphere of uniform radiance. Requires exactly one of `power` and
    /// `intensity`.
    #[serde(alias = "bulb")]
    Point {
        /// The centre, in the world.
        position: [f64; 3],
        /// Linear RGB in W, over the whole sphere of directions.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        power: Option<[f32; 3]>,
        /// Linear RGB in W/sr.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        intensity: Option<[f32; 3]>,
        /// Radius in metres.
        #[serde(default)]
        radius: f64,
    },
    /// A point that shines into a cone, as in glTF's `KHR_lights_punctual`: full intensity up to `inner`, none beyond
    /// `outer`, and ((cos a - cos outer) / (cos inner - cos outer))² at an angle a in between. Requires exactly one of
    /// `power` and `intensity`.
    Spot {
        /// The tip of the cone, in the world.
        position: [f64; 3],
        /// The axis of the cone, in the direction in which the light travels; any length except zero.
        direction: [f64; 3],
        /// Linear RGB in W: all emitted light.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        power: Option<[f32; 3]>,
        /// Linear RGB in W/sr, on the axis.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        intensity: Option<[f32; 3]>,
        /// Angle from the axis in degrees, up to which the intensity is full; 0 <= inner <= outer.
        #[serde(default)]
        inner: f64,
        /// Angle from the axis in degrees, at most 90.
        #[serde(default = "default_outer_angle")]
        outer: f64,
        /// Radius in metres. With a radius above 0, the light is a sphere, which gives soft shadows and is visible; its
        /// light falls off with the angle between the axis and the direction from its centre.
        #[serde(default)]
        radius: f64,
    },
    /// A parallelogram of uniform radiance.
    #[serde(rename = "area")]
    Rectangle {
        /// The centre, in the world.
        position: [f64; 3],
        /// One edge, as a vector over its full length.
        u: [f64; 3],
        /// The second edge vector. The light shines towards u x v.
        v: [f64; 3],
        /// Linear RGB in W/(m² sr).
        #[serde(deserialize_with = "strength")]
        #[schemars(with = "Strength")]
        radiance: [f32; 3],
        /// True if the light emits to both sides.
        #[serde(default)]
        two_sided: bool,
    },
    /// A disk of uniform radiance.
    Disk {
        /// The centre, in the world.
        position: [f64; 3],
        /// Direction of emission, perpendicular to the disk; any length except zero.
        direction: [f64; 3],
        /// Radius in metres.
        radius: f64,
        /// Linear RGB in W/(m² sr).
        #[serde(deserialize_with = "strength")]
        #[schemars(with = "Strength")]
        radiance: [f32; 3],
        /// True if the light emits to both sides.
        #[serde(default)]
        two_sided: bool,
    },
    /// A measured luminaire: a point with the intensities of an IES file (ANSI/IES LM-63).
    Ies {
        /// The `.ies` file, in the world file's folder or below.
        #[schemars(with = "String")]
        profile: FileRef<IesProfile>,
        /// Position in the world.
        position: [f64; 3],
        /// The luminaire's nadir (vertical angle 0): straight down for a hanging luminaire; any length except zero.
        direction: [f64; 3],
        /// Direction of the luminaire's horizontal angle 0; its part perpendicular to `direction` is used. Any length
        /// except zero. Default: as close as possible to the world's x axis (its y axis for a light that shines along
        /// x).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        front: Option<[f64; 3]>,
        /// Linear RGB in W: all emitted light. Default: the file's candela values as white light of 683 lm/W.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        power: Option<[f32; 3]>,
    },
    /// A projector: an image that shines from one point through the lens of a camera, each pixel in the direction of
    /// the camera's ray. Every pixel of an evenly white image emits the same power. Requires exactly one of `power` and
    /// `irradiance`.
    Projector {
        /// The image file, in the world file's folder or below. Its values are factors, 1 for white; they are
        /// interpolated linearly between the centres of texels. An image whose size differs from the camera's is
        /// stretched over the camera's image.
        #[schemars(with = "String")]
        image: FileRef<Image>,
        /// The camera along whose rays the light is projected; descriptions contain it as
        /// [`CameraSpec`](crate::schema::CameraSpec).
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[schemars(skip)]
        camera: Option<Box<Camera>>,
        /// Linear RGB in W: the light that a white image emits.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        power: Option<[f32; 3]>,
        /// Linear RGB in W/m²: the light of a white image on a plane at a distance of 1 metre on the camera's axis,
        /// which faces the projector.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        irradiance: Option<[f32; 3]>,
    },
    /// The background, and light from everywhere: equal `radiance` in all directions, or from `zenith` to `horizon`.
    Sky {
        /// Linear RGB in W/(m² sr).
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        radiance: Option<[f32; 3]>,
        /// Radiance straight up. Radiance is linear in the sine of the elevation: a horizon with a third of the
        /// zenith's radiance is the overcast sky of Moon and Spencer (1942), a CIE standard.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        zenith: Option<[f32; 3]>,
        /// Radiance at the horizon, and below it if `ground` is not given.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        horizon: Option<[f32; 3]>,
        /// Radiance below the horizon.
        #[serde(default, deserialize_with = "optional_strength", skip_serializing_if = "Option::is_none")]
        #[schemars(with = "Option<Strength>")]
        ground: Option<[f32; 3]>,
    },
    /// A clear sky with its sun: A. J. Preetham, P. Shirley and B. Smits, "A practical analytic model for daylight",
    /// SIGGRAPH 1999. Luminance is converted with 683 lm/W, so that a clear noon gives about 150 W/m².
    #[serde(rename = "daylight")]
    Preetham {
        /// The direction in which sunlight travels, in the world. It points downwards, because the sun must be above
        /// the horizon; any length except zero.
        direction: [f64; 3],
        /// Haziness of the air, 1.9 to 10: 2 is very clear, 3 clear, 6 warm and moist, 10 hazy.
        #[serde(default = "default_turbidity")]
        turbidity: f64,
        /// Factor by which all radiance of the light is multiplied.
        #[serde(default = "default_scale")]
        scale: f32,
    },
    /// An equirectangular image around the world, twice as wide as high, with up at the top; usually high dynamic
    /// range.
    Environment {
        /// The image file, in the world file's folder or below. Its values are radiance in W/(m² sr).
        #[schemars(with = "String")]
        image: FileRef<Image>,
        /// Direction of the image's middle in degrees, like the yaw of a camera that looks there. 0 is along x in a
        /// z-up world and along -z in a y-up world; positive angles turn left.
        #[serde(default)]
        yaw: f64,
        /// Factor by which the image's values are multiplied.
        #[serde(default = "default_scale")]
        scale: f32,
    },
}

fn default_scale() -> f32 {
    1.0
}

fn default_turbidity() -> f64 {
    3.0
}

fn default_outer_angle() -> f64 {
    45.0
}

impl Light {
    /// The name of the light's type in descriptions.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Sun { .. } => "sun",
            Self::Point { .. } => "point",
            Self::Spot { .. } => "spot",
            Self::Rectangle { .. } => "area",
            Self::Disk { .. } => "disk",
            Self::Ies { .. } => "ies",
            Self::Projector { .. } => "projector",
            Self::Sky { .. } => "sky",
            Self::Preetham { .. } => "daylight",
            Self::Environment { .. } => "environment",
        }
    }

    /// Sets negative values of the light's image to 0, because light cannot be negative; returns a notice if there were
    /// any.
    pub(crate) fn clamp_negative_texels(&mut self) -> Option<Notice> {
        let (Self::Environment { image: FileRef { file, content: Some(image) }, .. }
        | Self::Projector { image: FileRef { file, content: Some(image) }, .. }) = self
        else {
            return None;
        };
        let Texels::Float(texels) = &image.texels else { return None };
        let count = texels.iter().flat_map(|texel| &texel[..3]).filter(|value| **value < 0.0).count();
        if count == 0 {
            return None;
        }
        let texels = texels.iter().map(|texel| texel.map(|value| value.max(0.0))).collect();
        *image = Arc::new(Image::new(image.name.clone(), image.size, Texels::Float(texels)));
        let message = format!(
            "image {file:?} of a light: negative values are treated as 0, because light cannot be negative ({})",
            counted(count, "value")
        );
        Some(Notice::new(NoticeCode::ClampedValue, message))
    }

    /// A uniform sky.
    pub fn uniform_sky(radiance: [f32; 3]) -> Self {
        Self::Sky { radiance: Some(radiance), zenith: None, horizon: None, ground: None }
    }
}

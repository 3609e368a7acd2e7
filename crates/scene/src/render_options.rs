//! Render options: one table, from which world files, Python, pages, the command line and the reference take names,
//! types, defaults, ranges and descriptions.

use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Serialize};

use crate::color::view_transform::ViewTransform;
use crate::error::{Result, SceneError};
use crate::error_code::ErrorCode;
use crate::named_enum::named_enum;
use crate::written::written;

/// Maximum number of samples per pixel.
pub const MAX_SAMPLES: u32 = 1 << 24;
/// Maximum number of threads.
pub const MAX_THREADS: usize = 1024;
/// Maximum samples per pixel if `noise_threshold` or `time_limit` is given, but not `samples`.
pub const ADAPTIVE_SAMPLES: u32 = 1 << 14;
/// Maximum absolute exposure in stops.
const MAX_STOPS: f64 = 100.0;

/// Defines [`RenderOptions`] and [`RENDER_OPTIONS`]. A row is an option's description, name, type, default and range.
macro_rules! render_options {
    ($($(#[doc = $help:literal])+ $name:ident: $type:ty = $default:expr, $range:expr;)+) => {
        /// Render settings. Arguments of the call and options of the command line take precedence.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, default)]
        pub struct RenderOptions {
            $($(#[doc = $help])+ pub $name: Option<$type>,)+
        }

        /// The table of options, in the order in which they are documented.
        pub const RENDER_OPTIONS: &[RenderOption] = &[
            $(RenderOption { name: stringify!($name), help: concat!($($help),+), range: $range },)+
        ];

        impl RenderOptions {
            /// Returns the default options; an option without a default is absent.
            pub fn defaults() -> Self {
                Self { $($name: $default,)+ }
            }

            /// Returns these options; an option that is not given here is taken from `others`.
            pub fn or(&self, others: &Self) -> Self {
                Self { $($name: self.$name.or(others.$name),)+ }
            }

            /// Returns the given options with their rows of the table.
            pub fn values(&self) -> impl Iterator<Item = (&'static RenderOption, OptionValue)> {
                let values = [$(self.$name.map(OptionValue::from),)+];
                RENDER_OPTIONS.iter().zip(values).filter_map(|(row, value)| Some((row, value?)))
            }
        }
    };
}

render_options! {
    /// Algorithm that computes the colour. "direct": light that reaches a surface directly, with shadows, mirrors and
    /// clear glass. "path": path tracing, with any number of bounces. "ao": ambient occlusion, the visible fraction of
    /// the sky. "flat": the base colour of the first triangle, without light.
    integrator: Integrator = Some(Integrator::Direct), OptionRange::Names(Integrator::NAMES);
    /// Samples per pixel. With `noise_threshold` or `time_limit`, the maximum per pixel, 16384 unless given.
    samples: u32 = Some(16), OptionRange::Whole { min: 1, max: MAX_SAMPLES as u64 };
    /// Target standard error of a pixel's luminance. A first pass, which is not shown, measures the noise and chooses
    /// the number of samples of each pixel; the image is unbiased.
    noise_threshold: f64 = None, OptionRange::Radiance;
    /// Time in seconds after which the image is finished. The result depends on the machine; a notice reports the
    /// number of samples that reproduces it.
    time_limit: f64 = None, OptionRange::Seconds;
    /// Maximum number of path segments, without a limit by default: 1 shows only surfaces that emit light, 2 adds direct
    /// light, and so on.
    max_depth: u32 = None, OptionRange::Whole { min: 1, max: u32::MAX as u64 };
    /// Maximum radiance of a sample, without a limit by default. A limit removes bright specks (fireflies), and darkens
    /// the image.
    clamp: f64 = None, OptionRange::Radiance;
    /// Reconstruction filter of pixels. "box": the mean over the pixel's square. "blackman-harris": smoother, 3 pixels
    /// wide.
    filter: Filter = Some(Filter::Box), OptionRange::Names(Filter::NAMES);
    /// Seed of all random numbers.
    seed: u64 = Some(0), OptionRange::Whole { min: 0, max: u64::MAX };
    /// Number of threads (default: all that the process may use). The image does not depend on this option.
    threads: usize = None, OptionRange::Whole { min: 1, max: MAX_THREADS as u64 };
    /// Ambient occlusion of the sky's light in corners and under objects: true, false, or the distance in metres up to
    /// which surfaces occlude the sky.
    ambient_occlusion: AmbientOcclusion = Some(AmbientOcclusion::Switch(false)), OptionRange::SwitchOrDistance;
    /// Brightness of PNG images and videos in stops; +1 doubles it.
    exposure: f64 = Some(0.0), OptionRange::Stops;
    /// View transform of PNG images and videos. "standard" clips values above 1; "agx" and "pbr_neutral" compress them.
    view: ViewTransform = Some(ViewTransform::Standard), OptionRange::Names(ViewTransform::NAMES);
}

named_enum! {
    /// Integrators.
    #[schemars(rename = "IntegratorName")]
    pub enum Integrator {
        /// Base colour of the first triangle, unlit (glTF `KHR_materials_unlit`).
        Flat = "flat",
        /// Direct light with shadows, also in mirrors and through clear glass.
        Direct = "direct",
        /// Unbiased path tracing.
        Path = "path",
        /// Ambient occlusion: the visible fraction of the sky.
        Ao = "ao",
    }
}

named_enum! {
    /// Pixel filters.
    #[schemars(rename = "FilterName")]
    pub enum Filter {
        /// The mean over the pixel's square.
        Box = "box",
        /// Four-term Blackman-Harris window, 3 pixels wide: smoother edges, no ringing.
        BlackmanHarris = "blackman-harris",
    }
}

/// A row of [`RENDER_OPTIONS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOption {
    /// The name, which is the same in every interface.
    pub name: &'static str,
    /// The description, for help texts and the reference.
    help: &'static str,
    /// The valid values.
    pub range: OptionRange,
}

impl RenderOption {
    /// The description, for help texts and the reference.
    pub fn help(&self) -> &'static str {
        self.help.trim_start()
    }

    /// Checks a value.
    ///
    /// # Errors
    /// [`SceneError::Schema`] with the option's name, the value and the valid values.
    pub fn check(&self, value: OptionValue) -> Result<()> {
        if self.range.contains(value) {
            return Ok(());
        }
        Err(SceneError::schema(ErrorCode::OutOfRange, self.name, format!("{value}; expected {}", self.range)))
    }
}

/// The type of an option and its valid values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OptionRange {
    /// One name from a fixed list.
    Names(&'static [&'static str]),
    /// A whole number from `min` to `max`, both included.
    Whole {
        /// Smallest value.
        min: u64,
        /// Largest value.
        max: u64,
    },
    /// A radiance above 0, in float32.
    Radiance,
    /// A number of seconds above 0.
    Seconds,
    /// A number of stops between -100 and 100.
    Stops,
    /// True, false, or a distance in metres above 0.
    SwitchOrDistance,
}

impl OptionRange {
    /// True if the value is valid.
    fn contains(self, value: OptionValue) -> bool {
        match (self, value) {
            (Self::Names(names), OptionValue::Name(name)) => names.contains(&name),
            (Self::Whole { min, max }, OptionValue::Whole(v)) => (min..=max).contains(&v),
            (Self::Radiance, OptionValue::Number(v)) => (v as f32).is_finite() && v as f32 > 0.0,
            (Self::Seconds, OptionValue::Number(v)) => v.is_finite() && v > 0.0,
            (Self::Stops, OptionValue::Number(v)) => v.abs() <= MAX_STOPS,
            (Self::SwitchOrDistance, OptionValue::Number(v)) => v > 0.0,
            (Self::SwitchOrDistance, OptionValue::Switch(_)) => true,
            _ => false,
        }
    }
}

impl std::fmt::Display for OptionRange {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Names(names) => write!(f, "one of {}", names.join(", ")),
            Self::Whole { min, max } => write!(f, "a whole number from {min} to {max}"),
            Self::Radiance => f.write_str("a radiance greater than 0"),
            Self::Seconds => f.write_str("a number of seconds greater than 0"),
            Self::Stops => write!(f, "a number of stops from -{MAX_STOPS} to {MAX_STOPS}"),
            Self::SwitchOrDistance => f.write_str("true, false or a distance in metres greater than 0"),
        }
    }
}

/// Value of an option.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OptionValue {
    /// The name of an enum variant.
    Name(&'static str),
    /// A whole number.
    Whole(u64),
    /// A number.
    Number(f64),
    /// On or off.
    Switch(bool),
}

impl std::fmt::Display for OptionValue {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Name(name) => write!(f, "{name:?}"),
            Self::Whole(v) => write!(f, "{v}"),
            Self::Number(v) => write!(f, "{v}"),
            Self::Switch(v) => write!(f, "{v}"),
        }
    }
}

/// Implements the conversion of each option's type to [`OptionValue`].
macro_rules! option_value {
    ($($type:ty: |$value:ident| $converted:expr),+ $(,)?) => {
        $(impl From<$type> for OptionValue {
            fn from($value: $type) -> Self {
                $converted
            }
        })+
    };
}

option_value! {
    Integrator: |v| Self::Name(v.name()),
    Filter: |v| Self::Name(v.name()),
    ViewTransform: |v| Self::Name(v.name()),
    u32: |v| Self::Whole(v.into()),
    u64: |v| Self::Whole(v),
    usize: |v| Self::Whole(v as u64),
    f64: |v| Self::Number(v),
    AmbientOcclusion: |v| match v {
        AmbientOcclusion::Switch(on) => Self::Switch(on),
        AmbientOcclusion::Distance(distance) => Self::Number(distance),
    },
}

/// `true`, `false` or a distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(untagged)]
pub enum AmbientOcclusion {
    /// On for surfaces at any distance, or off.
    Switch(bool),
    /// Distance in metres up to which surfaces occlude the sky.
    Distance(f64),
}

impl AmbientOcclusion {
    /// The distance in metres up to which surfaces occlude the sky, which may be infinite; `None` if the option is off.
    pub fn max_distance(self) -> Option<f64> {
        match self {
            Self::Switch(false) => None,
            Self::Switch(true) => Some(f64::INFINITY),
            Self::Distance(distance) => Some(distance),
        }
    }
}

written! {
    AmbientOcclusion: "true, false or a distance in metres greater than 0",

    fn visit_bool<E: Error>(self, v: bool) -> Result<AmbientOcclusion, E> {
        Ok(AmbientOcclusion::Switch(v))
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<AmbientOcclusion, E> {
        Ok(AmbientOcclusion::Distance(v as f64))
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<AmbientOcclusion, E> {
        Ok(AmbientOcclusion::Distance(v))
    }
}

impl RenderOptions {
    /// Checks the values.
    ///
    /// # Errors
    /// [`SceneError::Schema`] for a value outside its option's range, or for both `noise_threshold` and `time_limit`.
    pub fn validate(&self) -> Result<()> {
        for (option, value) in self.values() {
            option.check(value)?;
        }
        if self.noise_threshold.is_some() && self.time_limit.is_some() {
            return Err(SceneError::schema(
                ErrorCode::ConflictingValues,
                "",
                "noise_threshold and time_limit cannot be combined; use only one of \
                them",
            ));
        }
        Ok(())
    }

    /// Validates the options and adds the defaults of the options that are not given.
    ///
    /// # Errors
    /// The errors of [`RenderOptions::validate`].
    pub fn complete(&self) -> Result<Self> {
        self.validate()?;
        let mut defaults = Self::defaults();
        if self.noise_threshold.is_some() || self.time_limit.is_some() {
            defaults.samples = Some(ADAPTIVE_SAMPLES);
        }
        Ok(self.or(&defaults))
    }
}

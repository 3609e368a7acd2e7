//! Passes: parts of the colour, separated by the light's way to the camera and by its source.
//!
//! Every contribution to a sample's radiance is recorded with its way and its source, and each pass sums its part. A
//! contribution that belongs to several passes of a kind is divided, so that the passes of each kind add up to the
//! colour: emission, direct and indirect; emission, diffuse, specular and volume; and all lights.

use std::cell::RefCell;

use glam::Vec3;

use crate::error::RenderError;
use crate::film::channel::Channel;
use crate::integrator::requirements::{effective_lights, needs_light};
use crate::light::light_sampling::SampledLight;
use crate::light::lights::{LightOwner, LightView, Lights};
use crate::light::prepared_light::PreparedLight;
use crate::light::samples::LightLiSample;
use crate::prepare::world::PreparedWorld;
use crate::settings::Settings;

/// Part of the colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pass {
    /// Light that nothing scatters.
    Emission,
    /// Light that is scattered once.
    Direct,
    /// Light that is scattered several times.
    Indirect,
    /// Light whose last scattering before the camera is at a diffuse lobe.
    Diffuse,
    /// Light whose last scattering before the camera is at any other lobe of a surface.
    Specular,
    /// Light whose last scattering before the camera is in a medium.
    Volume,
    /// Light of one source.
    Light(LightOwner),
}

/// Number of times that something scatters light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scatterings {
    None,
    One,
    Several,
}

/// The first surface or medium that scatters a path, counted from the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FirstScattering {
    /// A surface, with the fraction of each colour that its diffuse lobes scatter.
    Surface {
        diffuse: Vec3,
    },
    Medium,
}

/// Way of light to the camera: the number of scatterings, and the kind of the scattering that is nearest to the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightWay {
    scatterings: Scatterings,
    /// `None` if nothing scatters the light.
    first: Option<FirstScattering>,
}

impl LightWay {
    const STRAIGHT: Self = Self { scatterings: Scatterings::None, first: None };

    /// The way with one more scattering, of the kind `first` if the light has not been scattered yet.
    pub fn scattered(self, first: impl FnOnce() -> FirstScattering) -> Self {
        match self.scatterings {
            Scatterings::None => Self { scatterings: Scatterings::One, first: Some(first()) },
            _ => Self { scatterings: Scatterings::Several, ..self },
        }
    }

    /// True if a further scattering does not change the way.
    pub fn is_final(&self) -> bool {
        self.scatterings == Scatterings::Several
    }

    /// Fraction of each colour channel that belongs to a pass; does not apply to passes of single lights.
    fn share(&self, pass: Pass) -> Vec3 {
        let all = |is_part: bool| Vec3::splat(f32::from(u8::from(is_part)));
        match (pass, self.first) {
            (Pass::Emission, _) => all(self.scatterings == Scatterings::None),
            (Pass::Direct, _) => all(self.scatterings == Scatterings::One),
            (Pass::Indirect, _) => all(self.scatterings == Scatterings::Several),
            (Pass::Diffuse, Some(FirstScattering::Surface { diffuse })) => diffuse,
            (Pass::Specular, Some(FirstScattering::Surface { diffuse })) => Vec3::ONE - diffuse,
            (Pass::Volume, first) => all(matches!(first, Some(FirstScattering::Medium))),
            _ => Vec3::ZERO,
        }
    }
}

/// Source of the light in a contribution.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LightSource {
    /// A finite light, given by its index among the lights that a ray finds.
    Finite {
        index: usize,
        view: LightView,
    },
    /// A sun without a size, by its index among the infinite lights.
    Sun(usize),
    /// All infinite lights with an extent, as received from one direction. Constant skies are included only if
    /// `has_ambient` is true.
    Infinite {
        direction: Vec3,
        has_ambient: bool,
        view: LightView,
    },
    /// All constant skies.
    Ambient,
    Surfaces,
}

impl LightSource {
    /// Source of a light sample.
    pub fn of_sample(light: SampledLight, sample: &LightLiSample, has_ambient: bool) -> Self {
        let view = LightView::Scattered;
        match light {
            SampledLight::Finite(index) => Self::Finite { index, view },
            SampledLight::Infinite(index) if sample.is_delta => Self::Sun(index),
            SampledLight::Infinite(_) => Self::Infinite { direction: sample.direction, has_ambient, view },
            SampledLight::Surfaces => Self::Surfaces,
        }
    }
}

/// Way and source of a contribution's light, which determine the passes to which it is added.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PassTag {
    pub way: LightWay,
    pub source: LightSource,
}

/// Passes of the samples of a batch.
#[derive(Debug)]
pub(crate) struct PassRecorder {
    passes: Vec<Pass>,
    /// For each camera ray: the values of all passes.
    values: Vec<Vec3>,
    /// Ways to which paths refer by their indices; way 0 has no scattering.
    ways: Vec<LightWay>,
}

impl PassRecorder {
    /// Creates a recorder for a batch of camera rays; reuses the buffer `values`.
    pub fn new(passes: &[Pass], ray_count: usize, mut values: Vec<Vec3>) -> RefCell<Self> {
        values.clear();
        values.resize(ray_count * passes.len(), Vec3::ZERO);
        RefCell::new(Self { passes: passes.to_vec(), values, ways: vec![LightWay::STRAIGHT] })
    }

    pub fn into_values(self) -> Vec<Vec3> {
        self.values
    }
}

/// Recorder of a batch, and the lights of the world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passes<'a> {
    pub recorder: &'a RefCell<PassRecorder>,
    pub lights: &'a Lights,
}

impl Passes<'_> {
    /// Adds light to the passes of a camera ray.
    pub fn add(&self, ray_index: usize, PassTag { way, source }: PassTag, light: Vec3) {
        let mut recorder = self.recorder.borrow_mut();
        let PassRecorder { passes, values, .. } = &mut *recorder;
        let values = &mut values[ray_index * passes.len()..][..passes.len()];
        for (value, &pass) in values.iter_mut().zip(&*passes) {
            *value += light
                * match pass {
                    Pass::Light(owner) => share_of_light(self.lights, owner, source),
                    pass => way.share(pass),
                };
        }
    }

    /// Way of a path, by its index.
    pub fn way(&self, index: u32) -> LightWay {
        self.recorder.borrow().ways[index as usize]
    }

    /// Adds a way and returns its index.
    pub fn push_way(&self, way: LightWay) -> u32 {
        let ways = &mut self.recorder.borrow_mut().ways;
        ways.push(way);
        ways.len() as u32 - 1
    }

    /// Adds air light to the passes of a camera ray. For each pass, `light` is called with a function that maps a medium's
    /// mean cosine to the fraction of each colour that belongs to the pass.
    pub fn add_air_light(
        &self,
        ray_index: usize,
        (way, direction): (LightWay, Vec3),
        light: impl Fn(&dyn Fn(f32) -> Vec3) -> Vec3,
    ) {
        let mut recorder = self.recorder.borrow_mut();
        let PassRecorder { passes, values, .. } = &mut *recorder;
        let values = &mut values[ray_index * passes.len()..][..passes.len()];
        for (value, &pass) in values.iter_mut().zip(&*passes) {
            *value += light(&|g| match pass {
                Pass::Light(owner) => self.lights.share_of_air_light(owner, direction, g),
                pass => way.share(pass),
            });
        }
    }
}

/// Fraction of each colour of a contribution that comes from one light.
fn share_of_light(lights: &Lights, owner: LightOwner, source: LightSource) -> Vec3 {
    let is_own = |own: LightOwner| Vec3::splat(f32::from(u8::from(own == owner)));
    match source {
        LightSource::Surfaces => is_own(LightOwner::Surfaces),
        LightSource::Finite { index, view } => is_own(lights.view(view).owner_of_finite(index)),
        LightSource::Sun(index) => is_own(lights.owner_of_infinite(index)),
        LightSource::Infinite { direction, has_ambient, view } => {
            let radiance = |light: &PreparedLight| light.radiance_and_pdf(Vec3::ZERO, direction).0;
            lights.view(view).share_of_infinite(owner, radiance, has_ambient)
        }
        LightSource::Ambient => {
            lights.share_of_infinite(owner, |light| light.constant_radiance().unwrap_or_default(), true)
        }
    }
}

/// Passes of a frame's channels, in order.
///
/// # Errors
/// [`RenderError::Settings`] if a light does not exist, or if lights are requested from an integrator that computes no
/// light.
pub(crate) fn passes_of(settings: &Settings, world: &PreparedWorld) -> Result<Vec<Pass>, RenderError> {
    let mut passes = vec![];
    for &channel in &settings.channels {
        passes.extend(match channel {
            Channel::Emission => Some(Pass::Emission),
            Channel::Direct => Some(Pass::Direct),
            Channel::Indirect => Some(Pass::Indirect),
            Channel::Diffuse => Some(Pass::Diffuse),
            Channel::Specular => Some(Pass::Specular),
            Channel::Volume => Some(Pass::Volume),
            Channel::Light(name) if needs_light(settings.integrator) => {
                let lights = effective_lights(settings.integrator, world);
                Some(Pass::Light(lights.owner(name.light()).map_err(RenderError::settings)?))
            }
            Channel::Light(_) => {
                return Err(RenderError::settings(format!(
                    "channel {:?} requires the integrator direct or path; flat and ao compute no light",
                    channel.name()
                )));
            }
            _ => None,
        });
    }
    Ok(passes)
}

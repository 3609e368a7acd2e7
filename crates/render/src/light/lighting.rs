//! Lighting of a world: its lights or default lights, prepared when an image first requires them.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use glam::DVec3;
use raycam_scene::{Light, LightTraits, Up, World};

use crate::error::RenderError;
use crate::light::default_lights::default_lights;
use crate::light::emissive_triangles::{EmissiveKey, EmissiveTriangles};
use crate::light::lights::Lights;
use crate::prepare::geometry::Geometry;

/// Maximum number of lightings that are kept for later worlds, so that two alternating lightings are both kept.
const MAX_RECENT: usize = 2;

/// Lights of a prepared world.
#[derive(Debug)]
pub(crate) struct Lighting {
    pub lights: Lights,
    /// Default lights, if the world has no lights.
    pub default_lights: Option<Lights>,
}

/// Lighting prepared on demand, with its inputs. Worlds with equal inputs share the lighting.
#[derive(Debug)]
pub(crate) struct LightingCell {
    lights: Vec<Light>,
    traits: Vec<LightTraits>,
    up: Up,
    emission_keeps_default_lights: bool,
    origin: DVec3,
    emissive: EmissiveKey,
    made: OnceLock<Lighting>,
}

/// The most recently prepared lightings of a family of worlds.
#[derive(Debug, Default)]
pub(crate) struct RecentLighting {
    /// Kept lightings; locked only while they are looked up.
    cells: Mutex<Vec<Arc<LightingCell>>>,
}

impl RecentLighting {
    fn lock(&self) -> MutexGuard<'_, Vec<Arc<LightingCell>>> {
        self.cells.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lightings, the oldest first.
    pub fn cells(&self) -> Vec<Arc<LightingCell>> {
        self.lock().clone()
    }

    fn keep(&self, cell: &Arc<LightingCell>) {
        let mut cells = self.lock();
        cells.retain(|known| !Arc::ptr_eq(known, cell));
        cells.push(cell.clone());
        let first = cells.len().saturating_sub(MAX_RECENT);
        let freed: Vec<_> = cells.drain(..first).collect();
        drop(cells);
        drop(freed);
    }
}

impl LightingCell {
    /// Lighting of a world. Lighting with equal inputs is reused from `known`; other lights are validated.
    ///
    /// # Errors
    /// [`RenderError::World`] for invalid lights.
    pub fn new<'a>(
        world: &World,
        geometry: &Geometry,
        known: impl IntoIterator<Item = &'a Arc<LightingCell>>,
    ) -> Result<Arc<Self>, RenderError> {
        let emissive = EmissiveKey::new(geometry);
        let is_same = |cell: &&Arc<LightingCell>| {
            cell.has_lights_of(world)
                && cell.traits == world.light_traits
                && cell.up == world.up
                && cell.emission_keeps_default_lights == world.emission_keeps_default_lights
                && cell.origin == geometry.origin
                && cell.emissive == emissive
        };
        let known: Vec<_> = known.into_iter().collect();
        if let Some(same) = known.iter().copied().find(is_same) {
            return Ok(same.clone());
        }
        if !known.iter().any(|cell| cell.has_lights_of(world)) {
            let checked = world.lights.iter().try_for_each(Light::validate);
            checked.map_err(RenderError::world)?;
        }
        Ok(Arc::new(Self {
            lights: world.lights.clone(),
            traits: world.light_traits.clone(),
            up: world.up,
            emission_keeps_default_lights: world.emission_keeps_default_lights,
            origin: geometry.origin,
            emissive,
            made: OnceLock::new(),
        }))
    }

    /// True if the lights equal a world's lights, with the same images.
    pub fn has_lights_of(&self, world: &World) -> bool {
        let same = self.lights.iter().zip(&world.lights).all(|(a, b)| is_same_light(a, b));
        same && self.lights.len() == world.lights.len()
    }

    /// True if the lights have been prepared.
    pub fn is_made(&self) -> bool {
        self.made.get().is_some()
    }

    /// Returns the lights; created if necessary. Data that they have in common with `recent` lightings is shared.
    pub fn get(self: &Arc<Self>, geometry: &Geometry, recent: &RecentLighting) -> &Lighting {
        if let Some(made) = self.made.get() {
            return made;
        }
        // The value is not computed inside `get_or_init`, because a waiting thread would steal work of other images.
        let made = self.make(geometry, &recent.cells());
        let made = self.made.get_or_init(|| made);
        recent.keep(self);
        made
    }

    fn make(&self, geometry: &Geometry, known: &[Arc<LightingCell>]) -> Lighting {
        let same = known.iter().rev().filter(|cell| cell.emissive == self.emissive);
        let emissive = same.into_iter().find_map(|cell| Some(cell.made.get()?.lights.emissive_triangles.clone()));
        let emissive = emissive.unwrap_or_else(|| Arc::new(EmissiveTriangles::new(geometry)));
        let known: Vec<&Lights> = known.iter().rev().filter_map(|cell| Some(&cell.made.get()?.lights)).collect();
        let build = |lights: &[Light], traits: &[LightTraits]| {
            let lights = Lights::sharing(lights, traits, self.up, self.origin, &known);
            Lights { emissive_triangles: emissive.clone(), ..lights }
        };
        let lights = build(&self.lights, &self.traits);
        let unlit = match self.emission_keeps_default_lights {
            true => self.lights.is_empty(),
            false => lights.count() == 0 && !lights.has_views(),
        };
        Lighting { lights, default_lights: unlit.then(|| build(&default_lights(self.up), &[])) }
    }
}

/// True if two lights are equal and refer to the same image; the contents of images are not compared.
fn is_same_light(a: &Light, b: &Light) -> bool {
    let same = |a: &Option<Arc<_>>, b: &Option<Arc<_>>| match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    };
    match (a, b) {
        (Light::Environment { image, yaw, scale }, Light::Environment { image: i, yaw: y, scale: s }) => {
            same(&image.content, &i.content) && (yaw, scale) == (y, s)
        }
        (
            Light::Projector { image, camera, power, irradiance },
            Light::Projector { image: i, camera: c, power: p, irradiance: r },
        ) => same(&image.content, &i.content) && (camera, power, irradiance) == (c, p, r),
        _ => a == b,
    }
}

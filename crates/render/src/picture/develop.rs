//! From what the rays of a tile have brought to the pixels of the film.

use super::{Buffers, Picture};
use crate::channel::Channel;
use crate::film::{self, Film};
use crate::frame::Plane;
use crate::integrator;
use crate::settings::Settings;
use crate::tile::Tile;
use crate::truth::{Exact, id, stored};

impl Picture<'_> {
    /// Writes a tile's pixels to the film.
    pub fn develop(&self, tile: &Tile, buffers: &Buffers, film: &Film) {
        let estimate = &buffers.estimate;
        let still = self.camera.r();
        let mut turned = vec![];
        if self.camera.motion().is_some() {
            let pixels = buffers.pixels.iter();
            turned.extend(pixels.map(|&pixel| self.camera.rotation_at(self.center_of(pixel))));
        }
        let truth = |i: usize| {
            let camera_from_world = turned.get(i).unwrap_or(&still);
            let world = buffers.seen.get(i).map_or(self.world, |world| &**world);
            buffers.exact.truth(world, camera_from_world, i)
        };
        if let Some((_, background)) = &self.cover {
            film.fill(tile, &buffers.blank, background);
        }
        use Channel as C;
        film.write(tile, &buffers.pixels, |channel, strip, at| match channel {
            C::Color => strip.put(at, |i| estimate.color(i).to_array()),
            C::Albedo => strip.put(at, |i| truth(i).albedo()),
            C::Depth => strip.put(at, |i| [truth(i).depth()]),
            C::Distance => strip.put(at, |i| [truth(i).distance()]),
            C::Position => strip.put(at, |i| truth(i).position()),
            C::Normal => strip.put(at, |i| stored(truth(i).normals.geometric)),
            C::NormalCamera => strip.put(at, |i| truth(i).in_camera(|n| n.geometric)),
            C::ShadingNormal => strip.put(at, |i| stored(truth(i).normals.shading)),
            C::ShadingNormalCamera => strip.put(at, |i| truth(i).in_camera(|n| n.shading)),
            C::Instance => strip.put(at, |i| [id(truth(i).hit.instance)]),
            C::Category => strip.put(at, |i| [truth(i).category()]),
            C::Triangle => strip.put(at, |i| [id(truth(i).hit.triangle)]),
            C::Barycentric => strip.put(at, |i| truth(i).barycentric()),
            C::Uv => strip.put(at, |i| truth(i).uv()),
            C::Material => strip.put(at, |i| [truth(i).material()]),
            C::Coverage => strip.put(at, |i| [estimate.coverage(i)]),
            C::Alpha => strip.put(at, |i| [estimate.alpha(i)]),
            C::Error => strip.put(at, |i| [estimate.error(i)]),
        });
    }

    /// A pixel of which all rays meet nothing, where that is the same all over the picture.
    pub(super) fn background(&self) -> Option<Vec<(Channel, Plane)>> {
        let Settings { time, clamp, .. } = self.settings;
        if self.estimated || time.is_some() || self.camera.vignetting().is_some() {
            return None;
        }
        let mut buffers = Buffers {
            pixels: vec![[0, 0]],
            exact: Exact::nothing(),
            ..Buffers::default()
        };
        let estimate = &mut buffers.estimate;
        estimate.reset(1, false);
        estimate.count(0, true);
        estimate.see_sky(0);
        if self.colored {
            let radiance = integrator::background(self.world, self.settings)?;
            if !(radiance.is_finite() && radiance.min_element() >= 0.0)
                || radiance.max_element() > clamp.unwrap_or(f32::INFINITY)
            {
                return None;
            }
            estimate.add(0, 0, radiance);
        }
        let pixel = [0, 0, 1, 1];
        let mut planes = film::planes(pixel, &self.settings.channels).ok()?;
        let film = Film::new(pixel, &mut planes);
        for tile in Tile::of_region(pixel) {
            self.develop(&tile, &buffers, &film);
        }
        drop(film);
        Some(planes)
    }
}

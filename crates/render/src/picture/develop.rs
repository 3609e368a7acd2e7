//! From what the rays of a tile have brought to the pixels of the film.

use super::{Buffers, Picture};
use crate::channel::Channel;
use crate::film::{self, Film, Target};
use crate::frame::Plane;
use crate::integrator;
use crate::settings::Settings;
use crate::tile::Tile;
use crate::told::{Found, Told};
use crate::truth::Exact;

impl Picture<'_> {
    /// Writes a tile's pixels to the film.
    pub fn develop(&self, tile: &Tile, buffers: &Buffers, film: &Film) {
        let estimate = &buffers.estimate;
        let mut turned = vec![];
        if self.camera.motion().is_some() {
            let pixels = buffers.pixels.iter();
            turned.extend(pixels.map(|&pixel| self.camera.rotation_at(self.center_of(pixel))));
        }
        let exact = &buffers.exact;
        let told = Told::new(exact, self.world, &buffers.seen, self.camera.r(), &turned);
        if let Some((_, background)) = &self.cover {
            film.fill(tile, &buffers.blank, background);
        }
        let mut corners = Found::new(None);
        use Channel as C;
        film.write(tile, &buffers.pixels, |channel, strip, at| match channel {
            C::Color => strip.put(at, |i| estimate.color(i).to_array()),
            C::Albedo => strip.put(at, |i| told.albedo(i)),
            C::Depth => strip.put(at, |i| [told.depth(i)]),
            C::Distance => strip.put(at, |i| [told.distance(i)]),
            C::Position => strip.put(at, |i| told.position(i)),
            C::Normal => strip.put(at, |i| told.normal(i, |n| n.geometric)),
            C::NormalCamera => strip.put(at, |i| told.in_camera(i, |n| n.geometric)),
            C::ShadingNormal => strip.put(at, |i| told.normal(i, |n| n.shading)),
            C::ShadingNormalCamera => strip.put(at, |i| told.in_camera(i, |n| n.shading)),
            C::Instance => strip.put(at, |i| [told.instance(i)]),
            C::Category => strip.put(at, |i| [told.category(i)]),
            C::Triangle => strip.put(at, |i| [told.triangle(i)]),
            C::Barycentric => strip.put(at, |i| told.barycentric(i)),
            C::Uv => strip.put(at, |i| told.uv(i, &mut corners)),
            C::Material => strip.put(at, |i| [told.material(i)]),
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
        let film = Film::new(pixel, planes.iter_mut().map(Target::of))?;
        for tile in Tile::of_region(pixel) {
            self.develop(&tile, &buffers, &film);
        }
        drop(film);
        Some(planes)
    }
}

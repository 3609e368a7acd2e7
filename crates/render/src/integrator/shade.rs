//! What a path does where it meets a surface or the sky: it picks up light, asks for that of lights, and goes on.

use glam::Vec3;
use raycam_bvh::{Hit, Ray};
use raycam_scene::{Alpha, Material, Reflectance};

use crate::bsdf::{Matte, ScatterSample, Scattering, is_dispersive};
use crate::guiding::caustic_casters::Mirror;
use crate::guiding::caustic_map::Thrown;
use crate::integrator::Rules;
use crate::integrator::batch::hits::Meeting;
use crate::integrator::nested_dielectrics::{Media, Skin};
use crate::integrator::path::{Path, Wave};
use crate::interaction::Places;
use crate::interaction::attributes::Surface;
use crate::light::{BEFORE_LIGHT, Choice, Known, Lights, Reference, Source};
use crate::prepare::PreparedWorld;
use crate::prepare::material::PreparedMaterial;
use crate::prepare::texture::Footprint;
use crate::sampling::sampler::{Pair, Sampler};
use crate::soa::LANES;

/// Segments before a path may end by roulette: the noise of ending sooner costs more than the time that it saves.
const SAFE_DEPTH: u32 = 6;

/// What all paths share.
pub(crate) struct Walk<'a> {
    pub world: &'a PreparedWorld,
    pub lights: &'a Lights,
    pub rules: &'a Rules<'a>,
    pub samplers: &'a [Sampler],
    /// Whether a ray may find light that `Lights::sample` finds too.
    pub found: bool,
    /// Whether `Lights::sample` finds any.
    pub sampled: bool,
    /// Whether there is more than one to choose from.
    pub chosen: bool,
    /// The only one that is sampled, if there is but one.
    pub only: Option<&'a Source>,
    /// Whether what lights bring to matte and glossy surfaces is found for many at a time.
    pub many: bool,
    /// Whether surfaces that the camera sees sample several of them.
    pub splits: bool,
    /// Whether of what stands in the way of a path's last segment only counts that it does.
    pub blind: bool,
    /// Whether some surfaces choose between two ways.
    pub branches: bool,
    /// What the rays of matte surfaces are aimed at.
    pub mirrors: &'a [Mirror],
    /// What each of these throws, where that is known.
    pub thrown: &'a [Thrown],
    /// Surfaces that all paths at hand have met: which random numbers they have used.
    pub turn: u32,
}

impl Walk<'_> {
    /// What one path does where it meets nothing; `known` is what is behind it of one of the lights there.
    pub fn miss(&self, path: &Path, known: Option<Known>, out: &mut Vec3) {
        self.pick_up(path, f64::INFINITY, out);
        if !(path.from_camera && self.rules.transparent) {
            self.see_sky(path, known, out);
        }
    }

    /// What one path does at what it met; whether it goes on.
    #[inline]
    pub fn step(
        &self,
        path: &mut Path,
        meeting: &Meeting,
        wave: &mut Wave,
        radiance: &mut [Vec3],
    ) -> bool {
        let Meeting {
            hit,
            material,
            ref place,
            ..
        } = *meeting;
        // What all paths do at most surfaces is compiled by itself, without the layers of others.
        if let Some(albedo) = material.matte(self.world, hit, &place.footprint) {
            let surface = Surface {
                place,
                frame: place.frame(path.direction),
                scatter: Matte {
                    albedo,
                    direction: meeting.matte,
                    aims: None,
                },
            };
            let skin = Skin::none(path.media);
            return self.meet(path, &surface, skin, meeting, wave, radiance);
        }
        self.split(path, &material.material);
        let (direction, channel) = (path.direction, path.channel.map(usize::from));
        let skin = Skin::of(self.world, path.media, hit, place.front, channel);
        let smooth = material.smooth(self.world, hit, place, direction, channel, skin.around);
        if let Some((scatter, frame)) = smooth {
            let surface = Surface {
                place,
                frame,
                scatter,
            };
            return self.meet(path, &surface, skin, meeting, wave, radiance);
        }
        let surface = Surface::new(self.world, place, direction, hit, channel, skin.around);
        self.meet(path, &surface, skin, meeting, wave, radiance)
    }

    /// Chooses the colour that a path carries from its first surface with dispersion.
    fn split(&self, path: &mut Path, material: &Material) {
        if path.channel.is_none() && is_dispersive(material) {
            let [choice, _] = self.samplers[path.ray].pair(Pair::Spectrum);
            let channel = ((choice * 3.0) as u8).min(2);
            path.channel = Some(channel);
            path.throughput *= 3.0 * Vec3::AXES[usize::from(channel)];
        }
    }

    #[inline]
    fn meet<S: Scattering>(
        &self,
        path: &mut Path,
        surface: &Surface<S>,
        skin: Skin,
        meeting: &Meeting,
        wave: &mut Wave,
        radiance: &mut [Vec3],
    ) -> bool {
        let Meeting {
            hit,
            material: PreparedMaterial { material, .. },
            ref place,
            ..
        } = *meeting;
        let out = &mut radiance[path.ray];
        if self.passes(path, material, surface, hit) {
            // The same ray, from the other side.
            wave.rays.push(place.leaving(path.direction, f32::INFINITY));
            return true;
        }
        let distance = (place.position - path.from.position).length();
        path.media = skin.before;
        self.absorb(path, distance);
        self.pick_up(path, distance, out);
        if skin.hidden {
            self.go_on(path, surface, skin, wave);
            return true;
        }
        self.see_surface(path, material, hit, distance, out);
        if self.free(path) || path.depth < self.rules.max_depth {
            self.sample_lights(path, surface, skin, meeting, wave, out);
            return self.scatter(path, surface, skin, meeting, wave);
        }
        false
    }

    /// Whether a path that may not grow may still go on through mirrors.
    pub(crate) fn free(&self, path: &Path) -> bool {
        self.rules.free_mirrors && path.straight
    }

    /// Whether the camera sees the back of a one-sided surface.
    pub(crate) fn is_back(&self, path: &Path, material: &Material, front: bool) -> bool {
        path.depth == 1 && path.straight && !front && !material.double_sided
    }

    /// The albedo of a plain surface in empty space.
    #[inline]
    pub fn plain(
        &self,
        path: &Path,
        (material, hit): (&PreparedMaterial, &Hit),
        places: &Places<LANES>,
        lane: usize,
    ) -> Option<Vec3> {
        let diffuse = material.plain.filter(|_| path.media.is_empty())?;
        if self.is_back(path, &material.material, places.front(lane)) {
            return None;
        }
        let base = self
            .world
            .base_color_of(material, hit, places.footprint(lane));
        Some(base * diffuse)
    }

    /// Whether a surface is not there for this ray: by its opacity, or because the camera sees the back of a one-sided
    /// one (glTF 2.0, 3.9.4 and 3.9.6).
    fn passes<S: Scattering>(
        &self,
        path: &Path,
        material: &Material,
        surface: &Surface<S>,
        hit: &Hit,
    ) -> bool {
        if self.is_back(path, material, surface.place.front) {
            return !surface.scatter.is_transmissive();
        }
        self.is_absent(path, material, hit)
    }

    /// Whether a surface is not there for this ray by its opacity.
    #[inline]
    pub(crate) fn is_absent(&self, path: &Path, material: &Material, hit: &Hit) -> bool {
        if material.alpha == Alpha::Opaque {
            return false;
        }
        let [chance, _] = self.samplers[path.ray].pair(Pair::Fate(self.turn));
        chance >= self.world.opacity(hit)
    }

    /// The weight of light that the surface's own sampling found, where light sampling has this density.
    fn weight(&self, path: &Path, pdf: f32) -> f32 {
        if path.straight || pdf == 0.0 {
            1.0
        } else {
            let count = match path.choice {
                Choice::Several => 1.0,
                _ => self.rules.light_samples as f32,
            };
            1.0 / (1.0 + count * pdf / path.pdf)
        }
    }

    /// Lights without a mesh that the ray crosses.
    pub(crate) fn pick_up(&self, path: &Path, distance: f64, out: &mut Vec3) {
        self.lights.crossed(
            &path.from,
            path.choice,
            path.direction,
            distance,
            |_, radiance, pdf| {
                *out += path.throughput * radiance * self.weight(path, pdf);
            },
        );
    }

    fn see_sky(&self, path: &Path, known: Option<Known>, out: &mut Vec3) {
        let (lights, direction) = (self.lights, path.direction);
        let (radiance, pdf) = if path.straight {
            (lights.sky(direction, known), 0.0)
        } else {
            lights.behind(&path.from, path.choice, direction, known)
        };
        *out += path.throughput * self.sky(path.straight, radiance) * self.weight(path, pdf);
    }

    /// The part of the sky's radiance that is not in the ambient term.
    pub(crate) fn sky(&self, straight: bool, radiance: Vec3) -> Vec3 {
        if straight || self.rules.ambient.is_none() {
            radiance
        } else {
            (radiance - self.lights.ambient).max(Vec3::ZERO)
        }
    }

    /// What the surface at a hit shines by itself.
    pub(crate) fn see_surface(
        &self,
        path: &Path,
        material: &Material,
        hit: &Hit,
        distance: f64,
        out: &mut Vec3,
    ) {
        let (world, direction) = (self.world, path.direction);
        if path.straight && matches!(material.reflectance, Reflectance::Unlit) {
            *out += path.throughput * world.base_color(hit, &Footprint::default());
        }
        if material.emission.value == [0.0; 3] {
            return;
        }
        let emitted = self.lights.emitted(world, hit, direction);
        if emitted != Vec3::ZERO {
            let pdf =
                self.lights
                    .emitted_pdf(&path.from, path.choice, world, hit, direction, distance);
            *out += path.throughput * emitted * self.weight(path, pdf);
        }
    }

    /// Sends the path on, where it has a future: whether it has.
    #[inline]
    fn scatter<S: Scattering>(
        &self,
        path: &mut Path,
        surface: &Surface<S>,
        skin: Skin,
        meeting: &Meeting,
        wave: &mut Wave,
    ) -> bool {
        let sampler = &self.samplers[path.ray];
        let choice = if surface.scatter.chooses() {
            sampler.pair(Pair::Which(self.turn))[0]
        } else {
            0.0
        };
        let [x, y] = meeting.scatter;
        let Some(sample) = surface.scatter.sample(&surface.frame, [choice, x, y]) else {
            return false;
        };
        let start = surface.place.start(sample.direction).as_vec3();
        let media = skin.beyond(surface.frame.geometric, sample.direction);
        self.send(path, &sample, start, surface.reference(), media, wave)
    }

    /// The same where it is known how: in which direction, where the ray starts, from where and through what.
    #[inline(always)]
    pub(crate) fn send(
        &self,
        path: &mut Path,
        sample: &ScatterSample,
        start: Vec3,
        from: Reference,
        media: Media,
        wave: &mut Wave,
    ) -> bool {
        let free = self.free(path) && sample.delta;
        let depth = path.depth + u32::from(!free);
        // The last segment only looks for lights.
        let last = depth >= self.rules.max_depth && !sample.delta;
        if depth > self.rules.max_depth || (last && !self.found) {
            return false;
        }
        let mut throughput = path.throughput * sample.weight;
        let squeeze = path.squeeze * sample.squeeze;
        if self.turn.saturating_add(2) > SAFE_DEPTH {
            let survival = (throughput.max_element() * squeeze).min(0.95);
            let [_, chance] = self.samplers[path.ray].pair(Pair::Fate(self.turn));
            if chance >= survival {
                return false;
            }
            throughput /= survival;
        }
        if throughput == Vec3::ZERO {
            return false;
        }
        path.throughput = throughput;
        path.direction = sample.direction;
        path.from = from;
        path.pdf = sample.pdf;
        path.straight = sample.delta;
        path.choice = self.choice(path);
        path.from_camera = false;
        path.depth = depth;
        path.media = media;
        path.squeeze = squeeze;
        path.cone = path.cone.scattered(sample.delta);
        if last && self.blind && path.media.is_empty() {
            self.look(path, start, wave);
            return false;
        }
        wave.rays.push(Ray {
            origin: start.to_array(),
            direction: sample.direction.to_array(),
            t_max: f32::INFINITY,
        });
        true
    }

    /// What [`Walk::miss`] and [`Walk::pick_up`] would find, by shadow rays: those need not know what is met.
    #[inline(never)]
    fn look(&self, path: &Path, start: Vec3, wave: &mut Wave) {
        let ray = Ray {
            origin: start.to_array(),
            direction: path.direction.to_array(),
            t_max: f32::INFINITY,
        };
        let ways = &mut wave.scattered;
        self.lights.crossed(
            &path.from,
            path.choice,
            path.direction,
            f64::INFINITY,
            |at, radiance, pdf| {
                let t_max = at as f32 * BEFORE_LIGHT;
                let light = path.throughput * radiance * self.weight(path, pdf);
                ways.ask(Ray { t_max, ..ray }, path.ray, light);
            },
        );
        let mut sky = Vec3::ZERO;
        self.see_sky(path, None, &mut sky);
        if sky != Vec3::ZERO {
            ways.ask(ray, path.ray, sky);
        }
    }
}

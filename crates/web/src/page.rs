//! Classes for JavaScript.

use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use raycam_formats::encode::png;
use raycam_formats::{Budget, MemoryFiles, bundle, load_from_memory};
use raycam_render::film::display;
use raycam_render::{Channel, Control, ImagePlane, PixelType, PreparedFamily, PreparedWorld, render_moving};
use raycam_scene::{Notice, Up, ViewTransform, camera, triangles};
use serde_json::json;
use wasm_bindgen::prelude::*;

use crate::failure::{failure, format_failure, internal_failure};
use crate::request;

/// Converts a panic to an exception with the panic's text. The instance cannot be used afterwards.
#[wasm_bindgen(start)]
pub fn start() {
    std::panic::set_hook(Box::new(|info| {
        let text = internal_failure(format!("internal error: {info}\nThis is a bug in raycam; please report it."));
        wasm_bindgen::throw_str(&text);
    }));
}

/// Returns the version of raycam.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// Returns name, number type, and numbers per pixel of each channel, as JSON; channels that contain a part of the
/// colour, such as `direct`, are omitted.
#[wasm_bindgen]
pub fn channels() -> String {
    let row = |channel: Channel| {
        let dtype = match channel.pixel_type() {
            PixelType::F32 => "float32",
            PixelType::F64 => "float64",
            PixelType::I32 => "int32",
        };
        json!({ "name": channel.name(), "dtype": dtype, "components": channel.components() })
    };
    json!(Channel::all().filter(|channel| !channel.is_pass()).map(row).collect::<Vec<_>>()).to_string()
}

/// Files by name.
#[wasm_bindgen]
#[derive(Default)]
pub struct Files(MemoryFiles);

#[wasm_bindgen]
impl Files {
    /// Creates an empty set of files.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file.
    pub fn add(&mut self, path: &str, bytes: Vec<u8>) {
        self.0.insert(path, bytes);
    }
}

/// World, prepared when its first image is rendered.
#[wasm_bindgen]
pub struct World {
    world: raycam_scene::World,
    prepared: Option<PreparedWorld>,
    family: Arc<PreparedFamily>,
}

#[wasm_bindgen]
impl World {
    /// Reads the world in one of these files, by name.
    ///
    /// # Errors
    /// Errors of `raycam_formats::load`.
    pub fn load(path: &str, files: Files) -> Result<World, String> {
        load_from_memory(Path::new(path), files.0, &Budget::of_page())
            .map(Self::from_scene)
            .map_err(|e| format_failure(&e))
    }

    /// Reads the world in the bytes of a bundle.
    ///
    /// # Errors
    /// Errors of `raycam_formats::bundle::read`.
    pub fn unpack(bytes: &[u8]) -> Result<World, String> {
        let world = bundle::read(bytes, Path::new("world"), Budget::of_page());
        world.map(Self::from_scene).map_err(|e| format_failure(&e))
    }

    /// Returns objects, cameras, bounds and notices as JSON.
    pub fn about(&self) -> String {
        let world = &self.world;
        let objects: Vec<_> = world.objects.iter().map(|object| &object.name).collect();
        let cameras: Vec<_> = world.cameras.iter().map(|camera| &camera.name).collect();
        let bounds = world.bounds().map(|(low, high)| [low.to_array(), high.to_array()]);
        json!({
            "up": if world.up == Up::Z { "z" } else { "y" },
            "objects": objects,
            "categories": world.categories().names,
            "cameras": cameras,
            "bounds": bounds,
            "triangles": world.stats().object_triangles,
            "lights": world.lights.len(),
            "moves": world.time.is_some() && world.is_animated(),
            "notices": world.notices.iter().map(Notice::to_string).collect::<Vec<_>>(),
            "render": world.render,
        })
        .to_string()
    }

    /// Returns the camera with this name; without a name, the first camera or, if the world has no camera, a camera
    /// that frames everything in an image of this size.
    ///
    /// # Errors
    /// If there is no camera with this name, or no object to frame.
    pub fn camera(&self, name: Option<String>, width: u32, height: u32) -> Result<Camera, String> {
        let found = match name {
            Some(name) => self.world.find_camera(&name).map(|found| found.camera.clone()),
            None => self.world.default_camera([width, height]),
        };
        found.map(|inner| Camera { inner }).map_err(failure)
    }

    /// Returns the world at the middle of the exposure of the line that contains this pixel.
    ///
    /// # Errors
    /// Errors of `raycam_scene::World::at_line`.
    #[wasm_bindgen(js_name = atLine)]
    pub fn at_line(&self, camera: &Camera, u: f64, v: f64) -> Result<World, String> {
        self.world.at_line(&camera.inner, DVec2::new(u, v)).map(Self::from_scene).map_err(failure)
    }

    /// Returns the corners of all visible triangles, nine numbers each, in the order of object and triangle.
    pub fn triangles(&self) -> Vec<f64> {
        triangles::corners(&self.world, None).into_flattened().into_flattened()
    }

    /// Returns the object and the triangle index of each visible triangle, in the order of the corners.
    #[wasm_bindgen(js_name = triangleIds)]
    pub fn triangle_ids(&self) -> Vec<i32> {
        triangles::ids(&self.world).into_flattened()
    }

    /// Returns the linear colour of each visible triangle, in the order of the corners.
    #[wasm_bindgen(js_name = triangleColors)]
    pub fn triangle_colors(&self) -> Vec<f32> {
        triangles::colors(&self.world).into_flattened()
    }

    /// Renders a camera's image. `request` is JSON: see `request.rs`.
    ///
    /// # Errors
    /// Invalid settings, or not enough memory in the page.
    pub fn render(&mut self, camera: &Camera, request: &str) -> Result<Frame, String> {
        let (settings, mut notices) = request::settings(request, &self.world.render)?;
        let control = Control::new();
        let prepared = match self.prepared.take() {
            Some(prepared) => prepared,
            None => PreparedWorld::in_family(&self.world, &self.family, None, None, &control).map_err(failure)?,
        };
        let frame = render_moving(&self.world, &prepared, &camera.inner, &settings, &control);
        self.prepared = Some(prepared);
        let mut inner = frame.map_err(failure)?;
        notices.append(&mut inner.notices);
        Ok(Frame { inner, notices })
    }
}

impl World {
    fn from_scene(world: raycam_scene::World) -> Self {
        Self { world, prepared: None, family: Arc::default() }
    }
}

/// Camera.
#[wasm_bindgen]
#[derive(Clone)]
pub struct Camera {
    inner: camera::Camera,
}

#[wasm_bindgen]
impl Camera {
    /// Intrinsics K, row by row.
    #[wasm_bindgen(getter, js_name = K)]
    pub fn k(&self) -> Vec<f64> {
        self.inner.k().transpose().to_cols_array().into()
    }

    /// Rotation R from world axes to camera axes, row by row.
    #[wasm_bindgen(getter, js_name = R)]
    pub fn r(&self) -> Vec<f64> {
        self.inner.r().transpose().to_cols_array().into()
    }

    /// Centre C in world coordinates.
    #[wasm_bindgen(getter, js_name = C)]
    pub fn c(&self) -> Vec<f64> {
        self.inner.c().to_array().into()
    }

    /// Camera matrix P, row by row.
    #[wasm_bindgen(getter, js_name = P)]
    pub fn p(&self) -> Vec<f64> {
        self.inner.p().as_flattened().into()
    }

    /// Width and height of the camera's image, in pixels.
    #[wasm_bindgen(getter)]
    pub fn size(&self) -> Vec<u32> {
        self.inner.size().into()
    }

    /// Pixel coordinates of the first pixel's centre: 0 or 0.5.
    #[wasm_bindgen(getter)]
    pub fn offset(&self) -> f64 {
        self.inner.pixel_center().offset()
    }

    /// Roll, pitch and yaw in degrees, in a world with z or y up.
    #[wasm_bindgen(js_name = rollPitchYaw)]
    pub fn roll_pitch_yaw(&self, z_up: bool) -> Vec<f64> {
        self.inner.roll_pitch_yaw(if z_up { Up::Z } else { Up::Y }).into()
    }

    /// Origin and unit direction of the ray at pixel coordinates; NaN if no such ray exists.
    pub fn ray(&self, u: f64, v: f64) -> Vec<f64> {
        let (origin, direction) = self.inner.ray(DVec2::new(u, v));
        [origin.to_array(), direction.to_array()].as_flattened().into()
    }

    /// The ray at pixel coordinates as JSON: `origin` and unit `direction` (null without a ray), `R` in the middle of
    /// the exposure of the pixel's line, `back` (the pixel to which a point of the ray projects), `model` and
    /// `coefficients` of the lens, and `further`, the names of the camera's other properties.
    #[wasm_bindgen(js_name = lensRay)]
    pub fn lens_ray(&self, u: f64, v: f64) -> String {
        let (camera, pixel) = (&self.inner, DVec2::new(u, v));
        let (origin, direction) = camera.ray(pixel);
        let (model, coefficients) = camera.lens().coefficients().map_or(("pinhole", &[][..]), |(m, n)| (m.name(), n));
        json!({
            "model": if camera.center() == camera::Center::Point { model } else { "parallel" },
            "coefficients": coefficients,
            "origin": origin.to_array(),
            "direction": direction.to_array(),
            "R": camera.rotation_at(pixel).transpose().to_cols_array(),
            "back": camera.project(origin + direction).0.to_array(),
            "further": camera.further_properties().collect::<Vec<_>>(),
        })
        .to_string()
    }

    /// Returns a copy with another pose: R row by row, and C.
    ///
    /// # Errors
    /// If R is not a rotation, or the centre is not finite.
    #[wasm_bindgen(js_name = atPose)]
    pub fn at_pose(&self, r: &[f64], c: &[f64]) -> Result<Camera, String> {
        let (Ok(r), Ok(c)) = (r.try_into(), c.try_into()) else {
            return Err(failure("expected 9 numbers for R and 3 for C"));
        };
        let moved = self.inner.at_pose(DMat3::from_cols_array(r).transpose(), DVec3::from_array(c));
        moved.map(|inner| Camera { inner }).map_err(failure)
    }

    /// Returns the same view with another image size: K is scaled so that the edges of the view do not change.
    ///
    /// # Errors
    /// If a side is 0 or too large.
    pub fn resized(&self, width: u32, height: u32) -> Result<Camera, String> {
        let [old_width, old_height] = self.inner.size().map(f64::from);
        let (x, y) = (f64::from(width) / old_width, f64::from(height) / old_height);
        let corner = self.inner.pixel_center().offset() - 0.5;
        let moved = DVec3::new((1.0 - x) * corner, (1.0 - y) * corner, 1.0);
        let k = DMat3::from_cols(x * DVec3::X, y * DVec3::Y, moved) * self.inner.k();
        self.inner.with_intrinsics(k, [width, height]).map(|inner| Camera { inner }).map_err(failure)
    }
}

/// Image.
#[wasm_bindgen]
pub struct Frame {
    inner: raycam_render::Frame,
    notices: Vec<Notice>,
}

#[wasm_bindgen]
impl Frame {
    /// Left, top, width and height within the whole image.
    #[wasm_bindgen(getter)]
    pub fn region(&self) -> Vec<u32> {
        self.inner.region.into()
    }

    /// Notices about everything that was omitted or repaired.
    #[wasm_bindgen(getter)]
    pub fn notices(&self) -> Vec<String> {
        self.notices.iter().map(Notice::to_string).collect()
    }

    /// Code of each notice, as listed in the documentation.
    #[wasm_bindgen(getter, js_name = noticeCodes)]
    pub fn notice_codes(&self) -> Vec<String> {
        self.notices.iter().map(|notice| notice.code.to_string()).collect()
    }

    /// Values of a channel as a typed array, row by row; undefined if the image does not have the channel.
    pub fn plane(&self, name: &str) -> JsValue {
        match self.find_plane(name) {
            Some(ImagePlane::F32 { data, .. }) => js_sys::Float32Array::from(&data[..]).into(),
            Some(ImagePlane::F64 { data, .. }) => js_sys::Float64Array::from(&data[..]).into(),
            Some(ImagePlane::I32 { data, .. }) => js_sys::Int32Array::from(&data[..]).into(),
            None => JsValue::UNDEFINED,
        }
    }

    /// The colour as the bytes of a PNG file, with `exposure` in stops and a view transform by name.
    ///
    /// # Errors
    /// If there is no colour, or no view transform with this name.
    pub fn png(&self, exposure: f64, view: &str) -> Result<Vec<u8>, String> {
        let Some(ImagePlane::F32 { data, .. }) = self.find_plane("color") else {
            return Err(failure("the image has no channel color; request it"));
        };
        let view = ViewTransform::from_name(view).ok_or_else(|| failure(format!("unknown view {view:?}")))?;
        let pixels = display::srgb8(data.as_chunks().0, exposure.exp2() as f32, view).map_err(failure)?;
        let [_, _, width, height] = self.inner.region;
        png::encode([width, height], 3, png::Samples::U8(&pixels)).map_err(|e| format_failure(&e))
    }
}

impl Frame {
    fn find_plane(&self, name: &str) -> Option<&ImagePlane> {
        self.inner.planes.iter().find(|(channel, _)| channel.name() == name).map(|(_, plane)| plane)
    }
}

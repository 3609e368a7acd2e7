//! Worlds: building, queries, preparation and rendering.

mod array_images;
pub(crate) mod bundle;
pub(crate) mod edit;
pub(crate) mod from_description;
mod light;
pub(crate) mod many;
pub(crate) mod polygons;
pub(crate) mod rigs;
pub(crate) mod settle;
pub(crate) mod shared_files;
pub(crate) mod state;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use glam::DAffine3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use raycam_formats::MemoryFiles;
use raycam_render::RenderError;
use raycam_scene::mesh::primitive;
use raycam_scene::world::WorldTime;
use raycam_scene::{Fog, Object, TextureCache, World as Inner, triangles};

use crate::arrays::{ArrayResult, DictResult, array};
use crate::camera::{Camera, up};
use crate::error::{OrRaise, catch_panic, check_memory, detached, world_error};
use crate::notice::Notices;
use crate::render;
use crate::render::frame::FrameParts;
use crate::render::settings::RenderArguments;
use crate::world::light::light_dict;
use crate::world::state::{World, budget};

/// Entry of `objects`: name, category, mesh, triangles, world_from_mesh, visible, shadow catcher, names of materials.
type ObjectParts = (String, Option<String>, usize, usize, [[f64; 4]; 4], bool, bool, Vec<String>);

#[pymethods]
impl World {
    #[new]
    fn new(up: &str, folder: PathBuf, texture_memory: Option<u64>) -> PyResult<Self> {
        Ok(Self::from_inner(
            Inner {
                up: self::up(up)?,
                texture_cache: texture_memory.map(TextureCache::new).map(Arc::new),
                ..Inner::default()
            },
            folder,
        ))
    }

    /// Reads a world from a file. The files that it names are in `folder` (default: the world file's folder).
    #[staticmethod]
    #[pyo3(signature = (path, folder, texture_memory))]
    fn load(py: Python<'_>, path: PathBuf, folder: Option<PathBuf>, texture_memory: Option<u64>) -> PyResult<Self> {
        let budget = budget(texture_memory);
        let read = || raycam_formats::load_within(&path, folder.as_deref(), &budget);
        Ok(Self::from_inner(detached(py, read)?, PathBuf::new()))
    }

    /// Reads a world from the bytes of a file with this name; the world must not refer to other files.
    #[staticmethod]
    #[pyo3(signature = (bytes, name, texture_memory))]
    fn load_bytes(py: Python<'_>, bytes: Vec<u8>, name: PathBuf, texture_memory: Option<u64>) -> PyResult<Self> {
        let budget = budget(texture_memory);
        let mut files = MemoryFiles::default();
        files.insert(&name, bytes);
        let read = || raycam_formats::load_from_memory(&name, files, &budget);
        Ok(Self::from_inner(detached(py, read)?, PathBuf::new()))
    }

    /// Multiplies all coordinates of the objects by a factor.
    fn scale_objects(&self, factor: f64) -> PyResult<()> {
        self.modify_unseen(|world| {
            for object in &mut world.objects {
                object.world_from_mesh.matrix3 *= factor;
                object.world_from_mesh.translation *= factor;
                object.scale_shear *= factor;
            }
            Ok(())
        })
    }

    fn add_camera(&self, name: &str, camera: &Camera) -> PyResult<usize> {
        self.modify_unseen(|world| Ok(world.add_camera(name, camera.inner.clone())))
    }

    #[getter]
    fn up(&self) -> &'static str {
        self.snapshot().up.name()
    }

    #[getter]
    fn notices(&self) -> Notices {
        self.snapshot().notices.clone().into()
    }

    /// Replaces the notices of the world.
    fn set_notices(&self, notices: Notices) -> PyResult<()> {
        self.modify_unseen(|world| {
            world.notices = notices.0;
            Ok(())
        })
    }

    /// Returns the limit of texture memory in bytes, or none without a limit.
    #[getter]
    fn texture_memory(&self) -> Option<u64> {
        self.snapshot().texture_cache.as_ref().map(|memory| memory.limit())
    }

    /// Returns the names of the image files.
    #[getter]
    fn textures(&self) -> Vec<String> {
        self.snapshot().textures.iter().map(|texture| texture.image.name.clone()).collect()
    }

    #[getter]
    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.snapshot().bounds().map(|(low, high)| [low.to_array(), high.to_array()])
    }

    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> DictResult<'py> {
        let counts = self.snapshot().stats();
        let dict = PyDict::new(py);
        dict.set_item("objects", counts.objects)?;
        dict.set_item("meshes", counts.meshes)?;
        dict.set_item("triangles", counts.object_triangles)?;
        dict.set_item("mesh_triangles", counts.mesh_triangles)?;
        dict.set_item("zero_area_triangles", counts.degenerate_triangles)?;
        dict.set_item("vertices", counts.vertices)?;
        dict.set_item("materials", counts.materials)?;
        dict.set_item("textures", counts.textures)?;
        dict.set_item("lights", counts.lights)?;
        dict.set_item("cameras", counts.cameras)?;
        Ok(dict)
    }

    #[getter]
    fn objects(&self) -> Vec<ObjectParts> {
        let world = self.snapshot();
        let parts = world.objects.iter().map(|object| {
            let rows = glam::DMat4::from(object.world_from_mesh).transpose().to_cols_array_2d();
            let triangles = world.meshes[object.mesh].triangles.len();
            let flags = (object.visible, object.shadow_catcher);
            let materials = object.materials.iter().map(|&i| world.materials[i].name.clone()).collect();
            (object.name.clone(), object.category.clone(), object.mesh, triangles, rows, flags.0, flags.1, materials)
        });
        parts.collect()
    }

    /// Returns the number of objects.
    #[getter]
    fn object_count(&self) -> usize {
        self.state().world.objects.len()
    }

    /// True if any visible object is a shadow catcher.
    #[getter]
    fn has_catchers(&self) -> bool {
        self.state().world.objects.iter().any(|object| object.shadow_catcher && object.visible)
    }

    /// True if the world has no lights, so that the default sky and sun illuminate it.
    #[getter]
    fn lit_by_default_lights(&self, py: Python<'_>) -> PyResult<bool> {
        let (_, prepared) = self.prepared_world(py, None)?;
        detached(py, || Ok::<_, RenderError>(prepared.lit_by_default_lights()))
    }

    /// Returns the world with only its shadow catchers.
    fn only_catchers(&self) -> PyResult<Self> {
        self.derive(|world| {
            let mut alone = world.clone();
            alone.objects.iter_mut().for_each(|object| object.visible &= object.shadow_catcher);
            Ok(alone)
        })
    }

    /// Returns the names of categories by number.
    #[getter]
    fn categories(&self) -> BTreeMap<i32, String> {
        self.snapshot().categories().names
    }

    #[getter]
    fn lights<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let world = self.snapshot();
        let lights = world.lights.iter().enumerate();
        lights.map(|(number, light)| light_dict(py, light, &world.traits_of_light(number))).collect()
    }

    #[getter]
    fn cameras(&self) -> Vec<(String, Camera)> {
        self.snapshot().cameras.iter().map(|c| (c.name.clone(), Camera { inner: c.camera.clone() })).collect()
    }

    /// Returns the camera with this name; errors suggest the nearest name.
    fn camera(&self, name: &str) -> PyResult<Camera> {
        let world = self.snapshot();
        let found = world.find_camera(name).or_raise()?;
        Ok(Camera { inner: found.camera.clone() })
    }

    fn default_camera(&self, size: [u32; 2]) -> PyResult<Camera> {
        let inner = self.snapshot().default_camera(size).or_raise()?;
        Ok(Camera { inner })
    }

    /// The fog with the keys of `[fog]`, if any.
    #[getter]
    fn fog<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(Fog { extinction, albedo, g, height }) = self.snapshot().fog else { return Ok(None) };
        let dict = PyDict::new(py);
        dict.set_item("extinction", extinction)?;
        dict.set_item("albedo", albedo)?;
        dict.set_item("g", g)?;
        if let Some(height) = height {
            dict.set_item("height", height)?;
        }
        Ok(Some(dict))
    }

    /// Returns the options of the world's `[render]` section, with the argument names of `raycam.render`.
    #[getter]
    fn render_settings<'py>(&self, py: Python<'py>) -> DictResult<'py> {
        crate::render::settings::options_dict(py, &self.snapshot().render)
    }

    /// Returns (fps, seconds, frames) of `[video]`.
    #[getter]
    fn video(&self) -> Option<(f64, f64, usize)> {
        self.snapshot().video.as_ref().map(|video| (video.fps(), video.seconds(), video.frame_count()))
    }

    /// Returns the camera `base` as moved by `[video]`. If a camera of the world has the pose of `base` and its own
    /// keyframes, these keyframes move `base`.
    fn video_camera(&self, base: &Camera, time: f64) -> PyResult<Camera> {
        let world = self.snapshot();
        let video = world.video.as_ref().ok_or_else(|| {
            world_error(
                "the world has no [video]; add one with an orbit \
            or keyframes",
            )
        })?;
        let index = world.keyframed_camera(&base.inner);
        let inner = video.camera_at(&base.inner, index, time).or_raise()?;
        Ok(Camera { inner })
    }

    /// Returns the world at a time of an animation and of its video. The default animation is the animation of the
    /// world's time, otherwise the first animation. Both worlds share everything that has been built.
    #[pyo3(name = "at", signature = (time, animation))]
    fn at_time(&self, time: f64, animation: Option<usize>) -> PyResult<Self> {
        self.derive(|world| {
            let animation = animation.or(world.time.and_then(|clock| clock.animation));
            world.at_time(WorldTime { time, animation })
        })
    }

    /// Returns the world at the middle of the exposure of a pixel's line; unchanged if the world has no time.
    fn at_line(&self, camera: &Camera, pixel: [f64; 2]) -> PyResult<Self> {
        self.derive(|world| world.at_line(&camera.inner, pixel.into()))
    }

    /// Returns the world's time in seconds, or none for a world without a time.
    #[getter]
    fn time(&self) -> Option<f64> {
        self.state().world.time.map(|clock| clock.time)
    }

    /// True if any part moves.
    #[getter]
    fn is_animated(&self) -> bool {
        self.state().world.is_animated()
    }

    /// Returns (name, seconds) of each animation.
    #[getter]
    fn animations(&self) -> Vec<(String, f64)> {
        let world = self.snapshot();
        let animations = world.node_tree.iter().flat_map(|rig| &rig.animations);
        animations.map(|a| (a.name.clone(), a.duration())).collect()
    }

    /// Returns the index of an animation; errors suggest the nearest name.
    fn find_animation(&self, name: &str) -> PyResult<usize> {
        self.snapshot().find_animation(name).or_raise()
    }

    #[getter]
    fn variants(&self) -> Vec<String> {
        self.snapshot().variants.iter().map(|v| v.name.clone()).collect()
    }

    /// Returns the world with the materials of a variant; both worlds share everything that has been built.
    fn with_variant(&self, name: &str) -> PyResult<Self> {
        self.derive(|world| world.with_variant(name))
    }

    /// Returns the corners [n, 3, 3] of one object's triangles, or of all visible objects' triangles, in the world and
    /// in the order of (instance, triangle).
    #[pyo3(signature = (object))]
    fn triangles<'py>(&self, py: Python<'py>, object: Option<usize>) -> ArrayResult<'py, f64> {
        let world = self.snapshot();
        let count = triangles::count(&world, object);
        check_memory(&format!("the array of {count} triangles"), triangles::corner_bytes(&world, object))?;
        let corners = py.detach(|| catch_panic(|| triangles::corners(&world, object)))?;
        let n = corners.len();
        array(py, corners.into_flattened().into_flattened(), &[n, 3, 3])
    }

    /// Returns (instance, triangle) [n, 2] of the triangles, in the order of [`Self::triangles`].
    fn triangle_ids<'py>(&self, py: Python<'py>) -> ArrayResult<'py, i32> {
        let world = self.snapshot();
        let count = triangles::count(&world, None);
        check_memory(&format!("the array of {count} ids"), count * size_of::<[i32; 2]>())?;
        let ids = triangles::ids(&world);
        let n = ids.len();
        array(py, ids.into_flattened(), &[n, 2])
    }

    /// Returns one linear colour per triangle, [n, 3].
    fn triangle_colors<'py>(&self, py: Python<'py>) -> ArrayResult<'py, f32> {
        let world = self.snapshot();
        let count = triangles::count(&world, None);
        check_memory(&format!("the array of {count} colours"), count * size_of::<[f32; 3]>())?;
        let colors = py.detach(|| catch_panic(|| triangles::colors(&world)))?;
        let n = colors.len();
        array(py, colors.into_flattened(), &[n, 3])
    }

    /// Returns the material of a triangle of an object as JSON, with the names of `raycam_scene::Material`.
    fn material(&self, object: usize, triangle: usize) -> PyResult<String> {
        let world = self.snapshot();
        let material = slot_of(&world, object, triangle)
            .and_then(|slot| world.materials.get(*world.objects[object].materials.get(slot)?));
        serde_json::to_string(&material).map_err(|error| world_error(error.to_string()))
    }

    /// Returns the materials of an object's slots as a JSON list; the list is empty if the object does not exist.
    fn materials(&self, object: usize) -> PyResult<String> {
        let world = self.snapshot();
        let slots = world.objects.get(object).map_or(&[][..], |placed| &placed.materials);
        let materials: Vec<_> = slots.iter().map(|&number| &world.materials[number]).collect();
        serde_json::to_string(&materials).map_err(|error| world_error(error.to_string()))
    }

    /// Returns a world that contains only a square with sides of 1 m and the material of an object's slot. Raises an error
    /// if the object or the slot does not exist.
    fn material_square(&self, object: usize, slot: usize) -> PyResult<Self> {
        self.derive(|world| {
            world.check_slot(object, slot)?;
            let material = world.objects[object].materials[slot];
            let mut square = Inner {
                up: world.up,
                textures: world.textures.clone(),
                texture_cache: world.texture_cache.clone(),
                materials: vec![world.materials[material].clone()],
                ..Inner::default()
            };
            let mesh = square.add_shared_mesh(Arc::new(primitive::plane([1.0; 2])?));
            square.add_object(Object::new("square", mesh, vec![0], DAffine3::IDENTITY))?;
            Ok(square)
        })
    }

    /// Returns the material slot of a triangle; `None` if the object or the triangle does not exist.
    fn slot(&self, object: usize, triangle: usize) -> Option<usize> {
        slot_of(&self.snapshot(), object, triangle)
    }

    /// Builds everything that rendering requires. Without this call, the first render builds these structures.
    fn prepare(&self, py: Python<'_>, threads: Option<usize>) -> PyResult<()> {
        self.prepared(py, threads).map(drop)
    }

    /// Returns the number of objects whose prepared parts are shared with another world.
    fn objects_shared_with(&self, py: Python<'_>, other: &World) -> PyResult<usize> {
        let [mine, theirs] = [self, other].map(|world| world.prepared(py, None));
        Ok(mine?.objects_shared_with(&*theirs?))
    }

    fn render<'py>(
        &self,
        py: Python<'py>,
        camera: &Camera,
        request: RenderArguments,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<FrameParts<'py>> {
        render::render(py, self, camera, &request, progress.as_ref())
    }

    fn brightest_samples(
        &self,
        py: Python<'_>,
        camera: &Camera,
        request: RenderArguments,
        pixels: Vec<[u32; 2]>,
    ) -> PyResult<Vec<Option<render::BrightestSample>>> {
        render::brightest(py, self, camera, &request, &pixels)
    }
}

/// Material slot of a triangle; `None` if the object or the triangle does not exist.
fn slot_of(world: &Inner, object: usize, triangle: usize) -> Option<usize> {
    let mesh = world.meshes.get(world.objects.get(object)?.mesh)?;
    match &mesh.material_slots {
        Some(slots) => slots.get(triangle).map(|&slot| usize::from(slot)),
        None => (triangle < mesh.triangles.len()).then_some(0),
    }
}

//! The extension module `raycam._core`. It converts arrays and errors and releases the GIL. The public names, their
//! defaults and their documentation are in the Python package.

#![forbid(unsafe_code)]

mod arrays;
mod buffer_pool;
mod camera;
mod cancel;
mod elementary;
mod error;
mod interruptible;
mod notice;
mod py_value;
mod queries;
mod render;
mod world;

use pyo3::prelude::*;

/// The private Rust core of raycam; use the package `raycam`.
#[pymodule(name = "_core")]
mod core {
    use super::*;
    use raycam_scene::foreign_terms::{FOREIGN_TERMS, schema_names};

    #[pymodule_export]
    use crate::camera::calibration::{
        PyCameraRecord, calibration_endings, calibration_formats, read_cameras, write_cameras,
    };
    #[pymodule_export]
    use crate::camera::rig::Rig;
    #[pymodule_export]
    use crate::camera::{Camera, intrinsics_from_focal, intrinsics_from_fov, lens_coefficients, lens_models};
    #[pymodule_export]
    use crate::cancel::Cancel;
    #[pymodule_export]
    use crate::elementary::elementary;
    #[pymodule_export]
    use crate::notice::codes;
    #[pymodule_export]
    use crate::queries::lidar::{lidar_beam_rays, lidar_echoes, lidar_returned_light};
    #[pymodule_export]
    use crate::queries::photo_pyramid::PhotoPyramid;
    #[pymodule_export]
    use crate::queries::points::{
        world_closest_points, world_distance, world_faces_in_sight, world_inside, world_points_in_sight,
        world_signed_distance, world_topology, world_velocities, world_visible, world_winding_number,
    };
    #[pymodule_export]
    use crate::queries::rays::{
        ray_fields, world_cast_rays, world_count_intersections, world_intersections, world_occluded,
    };
    #[pymodule_export]
    use crate::queries::texel_views::TexelViews;
    #[pymodule_export]
    use crate::render::annotations::{amodal_masks, flow, keypoints, oriented_boxes};
    #[pymodule_export]
    use crate::render::encode::{
        check_stand_in, compress_lzf, encode_exr, encode_hdr, encode_jpeg, encode_png, linear_from_srgb8,
        mask_polygons, mask_runs, read_exr, read_photo, read_picture, read_texels, shown_from_linear, srgb_from_linear,
    };
    #[pymodule_export]
    use crate::render::frame::{channels, merge};
    #[pymodule_export]
    use crate::render::light::{world_light_at, world_radiance_along};
    #[pymodule_export]
    use crate::render::progressive::Progressive;
    #[pymodule_export]
    use crate::render::settings::{complete_render_options, render_options};
    #[pymodule_export]
    use crate::world::bundle::{world_from_bytes, world_from_gltf, world_to_bytes, world_to_gltf, world_with_cameras};
    #[pymodule_export]
    use crate::world::edit::{
        world_remove_camera, world_remove_light, world_remove_object, world_set_camera, world_set_light,
        world_set_object,
    };
    #[pymodule_export]
    use crate::world::from_description::{
        world_add_light, world_add_object, world_from_dict, world_set_fog, world_set_video,
    };
    #[pymodule_export]
    use crate::world::many::render_many;
    #[pymodule_export]
    use crate::world::polygons::{world_add_polygons, world_from_polygons};
    #[pymodule_export]
    use crate::world::settle::{world_overlaps, world_settle};
    #[pymodule_export]
    use crate::world::shared_files::SharedFiles;
    #[pymodule_export]
    use crate::world::state::World;

    #[pymodule_export]
    use crate::world::rigs::{
        world_add_rig, world_add_sensor, world_has_reflectances, world_lidar_surfaces, world_rig_at, world_rigs,
        world_sensors,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }

    /// Returns the JSON Schema of a world file as text.
    #[pyfunction]
    fn json_schema() -> PyResult<String> {
        serde_json::to_string_pretty(&raycam_scene::schema::json_schema())
            .map_err(|e| error::raycam_error(e.to_string()))
    }

    /// Returns terms of other programs that users may try in `place` ("render", "raycam", "World", "Frame" or
    /// "Camera"), each with raycam's counterpart.
    #[pyfunction]
    fn foreign_terms(place: &str) -> Vec<(&'static str, &'static str)> {
        let rows = FOREIGN_TERMS.iter().filter(|row| row.place.name() == place);
        rows.flat_map(|row| row.words.iter().map(|word| (*word, row.ours[0]))).collect()
    }

    /// Returns the names among `expected` that mean the same as `word`, a term of other programs.
    #[pyfunction]
    fn names_for_foreign_term(word: &str, expected: Vec<String>) -> Vec<String> {
        let names: Vec<&str> = expected.iter().map(String::as_str).collect();
        schema_names(word, &names).into_iter().map(str::to_owned).collect()
    }

    /// Returns two lists of file extensions without the dot: of files that `load` reads, and of files to which such
    /// files refer.
    #[pyfunction]
    fn file_extensions() -> (Vec<&'static str>, Vec<&'static str>) {
        (raycam_formats::extensions().collect(), raycam_formats::COMPANION_EXTENSIONS.to_vec())
    }

    /// Returns the instruction set used to trace rays.
    #[pyfunction]
    fn instruction_set() -> &'static str {
        raycam_render::InstructionSet::detect().name()
    }

    /// Returns the number of threads that this process may use, according to the operating system and its control
    /// groups.
    #[pyfunction]
    fn available_threads() -> usize {
        std::thread::available_parallelism().map_or(1, usize::from)
    }
}

//! Terms of other programs and raycam's equivalents, used as hints in error messages. They are not accepted as
//! synonyms.

/// The place in which a term was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TermPlace {
    /// A key, or a name from a fixed set, of a world file or a dict. [`ForeignTerm::ours`] contains schema names; a row
    /// applies if one of these names is expected.
    Schema,
    /// An option of `raycam.render`.
    Render,
    /// An attribute of the module `raycam`.
    Module,
    /// An attribute of `raycam.World`.
    World,
    /// An attribute of `raycam.Frame`.
    Frame,
    /// An attribute of `raycam.Camera`.
    Camera,
}

impl TermPlace {
    /// The place's name in Python: a class, `raycam`, `render` or `schema`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Schema => "schema",
            Self::Render => "render",
            Self::Module => "raycam",
            Self::World => "World",
            Self::Frame => "Frame",
            Self::Camera => "Camera",
        }
    }
}

/// A row of [`FOREIGN_TERMS`]: terms of other programs, and raycam's equivalents.
#[derive(Clone, Copy, Debug)]
pub struct ForeignTerm {
    /// Place in which the terms have this meaning.
    pub place: TermPlace,
    /// Terms of other programs: in lower case with underscores for [`TermPlace::Schema`], otherwise in their original
    /// spelling.
    pub words: &'static [&'static str],
    /// Names or expressions to use in raycam. A term whose spelling is close to raycam's name needs no row.
    pub ours: &'static [&'static str],
}

const fn term(place: TermPlace, words: &'static [&'static str], ours: &'static [&'static str]) -> ForeignTerm {
    ForeignTerm { place, words, ours }
}

use TermPlace::{Camera, Frame, Module, Render, Schema, World};

const LOAD: &str = "raycam.load(path)";
const CAST_RAYS: &str = "world.cast_rays(origins, directions)";
const CAMERA_SIZE: &str =
    "the camera determines the size: world.default_camera((640, 480)), world.view_from(size=...), camera.resized(...)";

/// All rows.
#[rustfmt::skip]
pub const FOREIGN_TERMS: &[ForeignTerm] = &[
    // Types of lights.
    term(Schema, &["directional", "distant"], &["sun"]),
    term(Schema, &["omni", "lamp"], &["point"]),
    term(Schema, &["hdri", "envmap", "dome"], &["environment"]),
    term(Schema, &["infinite"], &["environment", "sky"]),
    term(Schema, &["background"], &["sky", "light"]),
    term(Schema, &["constant"], &["sky"]),
    term(Schema, &["preetham", "sunsky"], &["daylight"]),
    // Types of materials.
    term(Schema, &["diffuse", "lambert", "lambertian"], &["matte"]),
    term(Schema, &["conductor", "mirror"], &["metal"]),
    term(Schema, &["dielectric"], &["glass"]),
    term(Schema, &["pbr", "disney"], &["principled"]),
    term(Schema, &["emissive"], &["emission", "unlit"]),
    // Shapes.
    term(Schema, &["cube", "cuboid"], &["box"]),
    term(Schema, &["ball"], &["sphere"]),
    term(Schema, &["quad", "rectangle"], &["plane", "area"]),
    term(Schema, &["file", "filename"], &["mesh", "image", "profile"]),
    term(Schema, &["model"], &["mesh"]),
    term(Schema, &["faces", "indices"], &["triangles"]),
    term(Schema, &["texcoords"], &["uvs"]),
    term(Schema, &["subdivide", "subdivision"], &["refine"]),
    // Poses.
    term(Schema, &["position"], &["location"]),
    term(Schema, &["location"], &["position"]),
    term(Schema, &["translation", "translate", "origin"], &["location", "position"]),
    term(Schema, &["eye"], &["location"]),
    term(Schema, &["rotation", "rotate", "orientation"], &["roll", "pitch", "yaw"]),
    term(Schema, &["look_at", "lookat"], &["target"]),
    term(Schema, &["transform"], &["matrix"]),
    term(Schema, &["resolution"], &["size"]),
    term(Schema, &["focal_length"], &["focal"]),
    term(Schema, &["intrinsics"], &["K"]),
    // Materials.
    term(Schema, &["material"], &["type"]),
    term(Schema, &["albedo"], &["color", "flat"]),
    term(Schema, &["base_color"], &["color"]),
    term(Schema, &["metalness"], &["metallic"]),
    // Strengths of lights.
    term(Schema, &["color", "colour"], &["irradiance", "power", "intensity", "radiance"]),
    term(Schema, &["power", "intensity", "irradiance", "radiance", "energy", "strength", "brightness", "watts"],
        &["irradiance", "power", "intensity", "radiance", "emission", "scale"]),
    // Options of rendering.
    term(Schema, &["spp", "samples_per_pixel", "sample_count", "num_samples"], &["samples"]),
    term(Schema, &["bounces", "max_bounces"], &["max_depth"]),
    term(Schema, &["tonemap", "tone_mapping", "view_transform"], &["view"]),
    term(Schema, &["timeout"], &["time_limit"]),
    term(Schema, &["workers"], &["threads"]),
    term(Schema, &["pathtracer"], &["path"]),
    term(Schema, &["whitted"], &["direct"]),
    term(Schema, &["unlit"], &["flat"]),
    // Tables of a world file.
    term(Schema, &["emitter"], &["light"]),
    term(Schema, &["sensor"], &["camera"]),
    term(Schema, &["shape"], &["object"]),
    term(Schema, &["settings"], &["render"]),
    // Arguments of raycam.render.
    term(Render, &["size", "resolution", "width", "height"], &[CAMERA_SIZE]),
    term(Render, &["light", "lights"], &["lights belong to the world: world.add_light(...)"]),
    term(Render, &["background_color"], &["use background=color"]),
    term(Render, &["output"], &["use frame.save(path)"]),
    // Attributes of the module.
    term(Module, &["read", "open", "load_mesh", "load_scene", "load_world", "load_model", "load_file"], &[LOAD]),
    term(Module, &["Scene", "Mesh", "Model"], &["raycam.World(), or raycam.load(path)"]),
    term(Module, &["load_camera", "load_calibration", "read_cameras"], &["raycam.load_cameras(path)"]),
    term(Module, &["Light", "PointLight", "DirectionalLight", "SpotLight"], &[r#"world.add_light("sun", ...)"#]),
    term(Module, &["Material", "BSDF"], &["the keys of world.add_object(..., color=, roughness=, metallic=)"]),
    term(Module, &["cast_rays", "ray_intersect", "raycast"], &[CAST_RAYS]),
    term(Module, &["show", "Viewer3D", "viewer_open"], &["raycam.view(world)"]),
    term(Module, &["Renderer", "OffscreenRenderer"], &["raycam.render(world, camera)"]),
    term(Module, &["imwrite", "save", "write_image"], &["frame.save(path)"]),
    term(Module, &["look_at", "PinholeCamera", "PerspectiveCamera"], &["raycam.Camera.look_at(...)"]),
    // Attributes of worlds.
    term(World, &["contains", "contains_points", "compute_occupancy"], &["world.inside(points)"]),
    term(World, &["ray", "raycast", "ray_intersect", "intersects_location", "trace", "intersect"], &[CAST_RAYS]),
    term(World, &["compute_distance", "nearest", "closest_point"], &["world.closest_points(points)"]),
    term(World, &["compute_signed_distance"], &["world.signed_distance(points)"]),
    term(World, &["add_box", "add_cube", "add_sphere", "add_cylinder", "add_plane", "add_shape"],
        &[r#"world.add_object(box={"size": 1}), sphere=, cylinder=, plane=, ..."#]),
    term(World, &["add", "add_geometry", "add_triangles", "add_model"], &["world.add_mesh, world.add_object"]),
    term(World, &["add_floor", "ground"], &["world.add_ground()"]),
    term(World, &["move_object", "move", "set_pose", "set_transform", "set_location", "apply_transform"],
        &["world.set_object(name, location=...), or matrix=..."]),
    term(World, &["meshes", "geometry", "nodes", "instances", "get_object"], &["world.objects, world.triangles(i)"]),
    term(World, &["vertices", "faces"], &["world.triangles(), the corners [n, 3, 3] in the world"]),
    term(World, &["bounding_box", "aabb", "extents", "extent", "bbox"], &["world.bounds"]),
    term(World, &["save", "export", "write", "to_glb"], &["world.to_gltf(path)"]),
    term(World, &["render", "snapshot"], &["raycam.render(world, camera)"]),
    term(World, &["show", "view", "plot"], &["raycam.view(world)"]),
    term(World, &["size", "resolution"], &["the size belongs to the camera: world.view_from(side, size=(width, \
        height))"]),
    term(World, &["animate", "add_keyframe", "keyframes"], &["world.set_video(keyframe=[...])"]),
    // Attributes of frames.
    term(Frame, &["image", "rgb", "img", "pixels"], &[r#"frame["color"], linear; frame.to_srgb8() as bytes"#]),
    term(Frame, &["rgba"], &["frame.to_srgba8()"]),
    term(Frame, &["mask", "masks", "segmentation", "ids"], &[r#"frame["instance"], -1 for the background"#]),
    term(Frame, &["normals"], &[r#"frame["normal"]"#]),
    term(Frame, &["points", "point_cloud"], &[r#"frame["position"], NaN for the background"#]),
    term(Frame, &["bboxes", "boxes", "labels", "bbox"], &["raycam.label(world, camera)"]),
    term(Frame, &["shape", "width", "height", "resolution"], &["frame.size, (width, height)"]),
    term(Frame, &["plot", "display"], &["frame.show()"]),
    term(Frame, &["to_file", "write", "imwrite", "export"], &["frame.save(path)"]),
    // Attributes of cameras.
    term(Camera, &["width", "height", "resolution", "image_size"], &["camera.size, (width, height)"]),
    term(Camera, &["intrinsics", "intrinsic", "matrix", "camera_matrix", "k"], &["camera.K"]),
    term(Camera, &["fx", "fy", "cx", "cy", "focal", "focal_length"], &["camera.K, [[fx, skew, cx], [0, fy, cy], ...]"]),
    term(Camera, &["fov", "yfov", "hfov"], &["camera.K; raycam.Camera.look_at(..., fov=degrees) creates a camera"]),
    term(Camera, &["dist", "dist_coeffs", "D", "coeffs"], &["camera.distortion"]),
    term(Camera, &["extrinsics", "transform", "T", "world_to_camera"],
        &["camera.R (camera_from_world), camera.C"]),
    term(Camera, &["position", "eye", "origin"], &["camera.location"]),
    term(Camera, &["set_pose", "move_to"], &["camera.at_pose(R, C), which returns another camera"]),
    term(Camera, &["world_to_pixel", "project_points", "projectPoints"], &["camera.project(points)"]),
    term(Camera, &["unproject", "pixel_to_ray", "ray"], &["camera.rays(pixels)"]),
];

/// Returns the expected schema names that mean the same as another program's word.
pub fn schema_names<'a>(word: &str, expected: &[&'a str]) -> Vec<&'a str> {
    let word = word.to_lowercase().replace(['-', ' '], "_");
    let rows = FOREIGN_TERMS.iter().filter(|row| row.place == Schema && row.words.contains(&word.as_str()));
    rows.flat_map(|row| row.ours).filter_map(|ours| expected.iter().find(|name| *name == ours).copied()).collect()
}

/// Returns `; did you mean "name"?` if a term of another program means the same as one or more of the expected names.
pub fn foreign_hint(word: &str, expected: &[&str]) -> Option<String> {
    let names: Vec<String> = schema_names(word, expected).iter().map(|name| format!("{name:?}")).collect();
    let (last, others) = names.split_last()?;
    Some(match others {
        [] => format!("; did you mean {last}?"),
        others => format!("; did you mean {} or {last}?", others.join(", ")),
    })
}

//! Words of other programs, and ours for the same things.

/// A word and what it is called here. A row counts where the schema expects one of our words.
struct ForeignWord(&'static str, &'static [&'static str]);

/// In lower case with underscores. Spellings that are near to ours need no row.
const FOREIGN_WORDS: [ForeignWord; 73] = [
    // Types of lights.
    ForeignWord("directional", &["sun"]),
    ForeignWord("distant", &["sun"]),
    ForeignWord("omni", &["point"]),
    ForeignWord("lamp", &["point"]),
    ForeignWord("hdri", &["environment"]),
    ForeignWord("envmap", &["environment"]),
    ForeignWord("dome", &["environment"]),
    ForeignWord("infinite", &["environment", "sky"]),
    ForeignWord("background", &["sky", "light"]),
    ForeignWord("constant", &["sky"]),
    ForeignWord("preetham", &["daylight"]),
    ForeignWord("sunsky", &["daylight"]),
    // Types of materials.
    ForeignWord("diffuse", &["matte"]),
    ForeignWord("lambert", &["matte"]),
    ForeignWord("lambertian", &["matte"]),
    ForeignWord("conductor", &["metal"]),
    ForeignWord("mirror", &["metal"]),
    ForeignWord("dielectric", &["glass"]),
    ForeignWord("pbr", &["principled"]),
    ForeignWord("disney", &["principled"]),
    ForeignWord("emissive", &["emission", "unlit"]),
    // Shapes.
    ForeignWord("cube", &["box"]),
    ForeignWord("cuboid", &["box"]),
    ForeignWord("ball", &["sphere"]),
    ForeignWord("quad", &["plane", "area"]),
    ForeignWord("rectangle", &["plane", "area"]),
    ForeignWord("file", &["mesh", "image", "profile"]),
    ForeignWord("filename", &["mesh", "image", "profile"]),
    ForeignWord("model", &["mesh"]),
    ForeignWord("faces", &["triangles"]),
    ForeignWord("indices", &["triangles"]),
    ForeignWord("texcoords", &["uvs"]),
    ForeignWord("subdivide", &["refine"]),
    ForeignWord("subdivision", &["refine"]),
    // Poses.
    ForeignWord("position", &["location"]),
    ForeignWord("location", &["position"]),
    ForeignWord("translation", &["location", "position"]),
    ForeignWord("translate", &["location", "position"]),
    ForeignWord("origin", &["location", "position"]),
    ForeignWord("eye", &["location"]),
    ForeignWord("rotation", &["roll", "pitch", "yaw"]),
    ForeignWord("rotate", &["roll", "pitch", "yaw"]),
    ForeignWord("orientation", &["roll", "pitch", "yaw"]),
    ForeignWord("look_at", &["target"]),
    ForeignWord("lookat", &["target"]),
    ForeignWord("transform", &["matrix"]),
    ForeignWord("resolution", &["size"]),
    ForeignWord("focal_length", &["focal"]),
    ForeignWord("intrinsics", &["K"]),
    // Materials.
    ForeignWord("material", &["type"]),
    ForeignWord("albedo", &["color", "flat"]),
    ForeignWord("base_color", &["color"]),
    ForeignWord("alpha", &["opacity"]),
    ForeignWord("metalness", &["metallic"]),
    // Strengths of lights.
    ForeignWord("color", &["irradiance", "power", "intensity", "radiance"]),
    ForeignWord("energy", &["irradiance", "power", "radiance"]),
    ForeignWord("strength", &["irradiance", "power", "radiance", "scale"]),
    // Rendering.
    ForeignWord("spp", &["samples"]),
    ForeignWord("samples_per_pixel", &["samples"]),
    ForeignWord("bounces", &["max_depth"]),
    ForeignWord("max_bounces", &["max_depth"]),
    ForeignWord("tonemap", &["view"]),
    ForeignWord("tone_mapping", &["view"]),
    ForeignWord("view_transform", &["view"]),
    ForeignWord("timeout", &["time_limit"]),
    ForeignWord("workers", &["threads"]),
    ForeignWord("pathtracer", &["path"]),
    ForeignWord("whitted", &["direct"]),
    ForeignWord("unlit", &["flat"]),
    // Tables.
    ForeignWord("emitter", &["light"]),
    ForeignWord("sensor", &["camera"]),
    ForeignWord("shape", &["object"]),
    ForeignWord("settings", &["render"]),
];

/// Names that are understood until 0.2, with the name of each today: no error proposes them.
const OLD_NAMES: [[&str; 2]; 2] = [["noise", "noise_threshold"], ["time", "time_limit"]];
/// Names that are understood as well as ours: no error proposes them.
const OTHER_NAMES: [[&str; 2]; 1] = [["bulb", "point"]];

/// The expected names without those that have another one among them.
pub fn current_names(expected: &[&'static str]) -> Vec<&'static str> {
    let is_other = |name: &str| {
        let mut pairs = OLD_NAMES.iter().chain(&OTHER_NAMES);
        pairs.any(|[old, new]| *old == name && expected.contains(new))
    };
    expected.iter().copied().filter(|name| !is_other(name)).collect()
}

/// `; here it is called "name"` for a word of other programs whose counterpart is among the expected names.
pub fn translation(given: &str, expected: &[&str]) -> Option<String> {
    let word = given.to_lowercase().replace(['-', ' '], "_");
    let rows = FOREIGN_WORDS.iter().filter(|row| row.0 == word);
    let ours: Vec<String> =
        rows.flat_map(|row| row.1).filter(|name| expected.contains(name)).map(|name| format!("{name:?}")).collect();
    let (last, others) = ours.split_last()?;
    Some(match others {
        [] => format!("; here it is called {last}"),
        others => format!("; here it is called {} or {last}", others.join(", ")),
    })
}

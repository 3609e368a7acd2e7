//! Recognition of raycam's world files, which are TOML files but not calibrations.

/// True for a world file of raycam, whose tables have these names.
pub(crate) fn is_world_file(text: &str) -> bool {
    let tables = ["[[object]]", "[[light]]", "[[camera]]", "[camera]", "[object]", "[light]", "[[rig]]"];
    let has_table = text.lines().any(|line| tables.contains(&line.trim()));
    let has_object = ["[object]", "[light]"].iter().any(|table| text.contains(table));
    has_table && (has_object || ["location", "target", "fov"].iter().any(|key| text.contains(key)))
}

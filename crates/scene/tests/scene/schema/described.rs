//! Worlds from JSON text, and their errors.

use raycam_scene::schema::{self, ObjectSpec, WorldFile};
use raycam_scene::{AssetLoader, NoAssets, SceneError, World};

use crate::common::node;

pub fn build(json: &str) -> Result<World, SceneError> {
    schema::from_value::<WorldFile>(&node(json))?.build(&mut NoAssets)
}

pub fn object(json: &str) -> Result<World, SceneError> {
    object_with(json, &mut NoAssets)
}

pub fn object_with(json: &str, files: &mut impl AssetLoader<Error = SceneError>) -> Result<World, SceneError> {
    let mut world = World::default();
    schema::from_value::<ObjectSpec>(&node(json))?.build(&mut world, files)?;
    Ok(world)
}

/// Builds a world with a camera that has the keys common to these tests, and the given keys.
pub fn camera(json: &str) -> Result<World, SceneError> {
    build(&format!(r#"{{ "camera": {{ "size": [640, 480], {json} }} }}"#))
}

#[track_caller]
pub fn assert_error(result: Result<World, SceneError>, expected: &str) {
    let given = result.expect_err("an error").to_string();
    // The list of available names is removed, because it is long and covered by a separate test.
    let (short, _) = given.split_once(" (available: ").unwrap_or((&given, ""));
    assert_eq!(short, expected);
}

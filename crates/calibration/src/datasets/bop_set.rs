//! Data set in BOP's folders, `SPLIT/000000/scene_camera.json`: each scene is a separate world.

use crate::{Calibration, Folder, ReadHints, bop};
use raycam_formats::io::AssetRoot;
use raycam_formats::{FormatError, Result};

const CAMERAS: &str = "scene_camera.json";

/// Returns the folders of scenes, which are in the folders of the splits.
fn scenes(folder: &Folder, assets: &AssetRoot) -> Vec<String> {
    let digits = |name: &&String| name.len() == 6 && name.bytes().all(|b| b.is_ascii_digit());
    let mut found = Vec::new();
    for split in folder.names.iter().filter(|name| !name.contains('.') && *name != "models") {
        let inner = folder.inner(split, assets);
        for scene in inner.names.iter().filter(digits) {
            if inner.inner(scene, assets).has(CAMERAS) {
                found.push(format!("{split}/{scene}"));
            }
        }
    }
    found
}

pub(crate) fn detect(folder: &Folder, assets: &mut AssetRoot) -> bool {
    !scenes(folder, assets).is_empty()
}

pub(crate) fn read(folder: &Folder, assets: &mut AssetRoot, hints: &ReadHints) -> Result<Calibration> {
    match &scenes(folder, assets)[..] {
        [scene] => bop::read(&folder.read(&format!("{scene}/{CAMERAS}"), assets)?, assets, hints),
        found => Err(FormatError::unsupported(
            &folder.path,
            format!(
                "the folder contains {} scenes with separate worlds; open the folder of one scene, for example {}",
                found.len(),
                found[0]
            ),
        )),
    }
}

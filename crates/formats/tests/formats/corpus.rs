//! Files on which other readers failed: reading each gives a world or an error, and takes no more memory than the
//! file's size justifies.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use raycam_formats::{Budget, ColorUse, load, read_image, read_model};

use crate::support::data;

/// Every file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn every_corpus_file_is_read_or_refused() {
    let mut answered = 0;
    for path in files(&data("")) {
        let name = path.file_name().unwrap().to_str().unwrap();
        let error = match path.extension().and_then(|e| e.to_str()).unwrap() {
            "obj" | "ply" | "stl" | "off" => match read_model(&path, &Budget::default()) {
                Ok(model) => {
                    for part in &model.parts {
                        part.mesh.validate().unwrap();
                    }
                    None
                }
                Err(error) => Some(error.to_string()),
            },
            "png" | "jpg" | "jpeg" | "exr" => match read_image(&path, ColorUse::Color, &Budget::default()) {
                Ok((image, _)) => {
                    let [columns, rows] = image.size.map(|side| side as usize);
                    assert_eq!(image.texels.len(), columns * rows, "{name}");
                    None
                }
                Err(error) => Some(error.to_string()),
            },
            "gltf" | "glb" => match load(&path, &Budget::default()) {
                Ok(world) => {
                    world.validated().unwrap();
                    None
                }
                Err(error) => Some(error.to_string()),
            },
            _ => continue,
        };
        answered += 1;
        if let Some(error) = error {
            assert!(error.contains(name), "{name}: {error}");
            assert!(error.len() > name.len() + 10, "{name}: {error}");
        }
    }
    assert!(answered > 150, "{answered}");
}

/// Runs the test above in a separate process with at most 640 MiB of address space: a file of a kilobyte that allocates
/// gigabytes would end that process.
#[test]
#[cfg(target_os = "linux")]
fn no_corpus_file_allocates_much_memory() {
    let own = std::env::current_exe().unwrap();
    let limited =
        "ulimit -v 655360 && exec \"$0\" --exact corpus::every_corpus_file_is_read_or_refused --test-threads 1";
    let output = Command::new("sh").args(["-c", limited]).arg(own).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("1 passed"), "{said}");
}

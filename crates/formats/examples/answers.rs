//! Whether every file of some folders is answered: within a second, and within 64 MiB and 16 times its size.
//!
//!     cargo run --release -p raycam-formats --example answers -- FOLDER...
//!     cargo run --release -p raycam-formats --example answers -- --damage 1000 FOLDER...
//!
//! Each file is read in a process of its own. With `--damage`, up to so many of its beginnings and as many copies with one
//! flipped bit are read instead, in one process for each file. The second is of the process's own time, that others on
//! the machine do not count; memory is its peak, less that before reading (Linux). Prints every file that fails, then
//! the sums; the exit status says whether all were answered.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use raycam_formats::calibration::{self, Known};
use raycam_formats::{
    Budget, ColorUse, FormatError, bundle, decode_image, decode_model, load, world_file,
};

const MEMORY: u64 = 64 << 20;
const TIMES: u64 = 16;
const SECONDS: f64 = 1.0;

fn main() -> io::Result<ExitCode> {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let mut cases = 0;
    if words.first().is_some_and(|word| word == "--damage") {
        cases = words
            .get(1)
            .and_then(|count| count.parse().ok())
            .unwrap_or(1000);
        words.drain(..2.min(words.len()));
    }
    if words.first().is_some_and(|word| word == "--one") {
        one(Path::new(&words[1]), words[2].parse().unwrap_or(0))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut all: Vec<PathBuf> = words
        .iter()
        .flat_map(|folder| files(Path::new(folder)))
        .collect();
    all.retain(|path| kind(path).is_some());
    let own = std::env::current_exe()?;
    let (mut failed, mut answers, mut good, mut peak, mut slowest) = (0, 0, 0, 0_u64, 0.0_f64);
    for path in &all {
        let output = Command::new(&own)
            .arg("--one")
            .arg(path)
            .arg(cases.to_string())
            .output()?;
        let said = String::from_utf8_lossy(&output.stdout);
        let numbers: Vec<f64> = (said.lines().last().unwrap_or_default().split(' '))
            .filter_map(|word| word.parse().ok())
            .collect();
        let [count, read, memory, seconds] = numbers[..] else {
            failed += 1;
            let error = String::from_utf8_lossy(&output.stderr);
            println!("{}: {} {said} {error}", path.display(), output.status);
            continue;
        };
        answers += count as u64;
        good += read as u64;
        let size = fs::metadata(path).map_or(0, |status| status.len());
        let allowed = MEMORY + TIMES * size;
        peak = peak.max(memory as u64);
        slowest = slowest.max(seconds);
        for line in said.lines().filter(|line| line.starts_with('!')) {
            failed += 1;
            println!("{}: {line}", path.display());
        }
        if memory as u64 > allowed || seconds > SECONDS {
            failed += 1;
            println!(
                "{}: {size} bytes took {memory} bytes and {seconds:.3} s",
                path.display()
            );
        }
    }
    println!(
        "{} files, {answers} answers, {good} of them read; {failed} failed; peak {:.1} MiB, slowest {slowest:.3} s",
        all.len(),
        peak as f64 / f64::from(1 << 20)
    );
    Ok(ExitCode::from(u8::from(failed > 0)))
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

enum Kind {
    World,
    Mesh,
    Scene,
    Image,
    Cameras,
    Bundle,
}

fn kind(path: &Path) -> Option<Kind> {
    let extension = path.extension()?.to_string_lossy().to_lowercase();
    Some(match &extension[..] {
        "toml" => Kind::World,
        "gltf" | "glb" => Kind::Scene,
        "obj" | "ply" | "stl" | "off" => Kind::Mesh,
        "png" | "jpg" | "jpeg" | "webp" | "ktx2" | "exr" | "hdr" | "bmp" | "tga" => Kind::Image,
        "yaml" | "yml" | "xml" | "ini" => Kind::Cameras,
        "txt" if path.with_file_name("cameras.txt").exists() => Kind::Cameras,
        "bin" if path.with_file_name("cameras.bin").exists() => Kind::Cameras,
        "json" if !path.to_string_lossy().ends_with(".report.json") => Kind::Cameras,
        "world" => Kind::Bundle,
        _ => return None,
    })
}

/// The answer to the bytes of a file at a path.
fn answer(path: &Path, bytes: Vec<u8>, whole: bool) -> Result<(), FormatError> {
    let budget = Budget::default();
    match kind(path) {
        Some(Kind::Scene) if whole => {
            load(path, &budget)?.validated()?;
        }
        Some(Kind::Mesh | Kind::Scene) => {
            for part in &decode_model(bytes, path, &budget)?.parts {
                part.mesh.validate()?;
            }
        }
        Some(Kind::World) => {
            let text = String::from_utf8_lossy(&bytes);
            let folder = path.parent().unwrap_or(Path::new(""));
            world_file::parse(&text, folder, path, &budget)?.validated()?;
        }
        Some(Kind::Image) => {
            decode_image(
                &bytes,
                path,
                ColorUse::Color,
                &mut budget.clone(),
                &mut Vec::new(),
            )?;
        }
        Some(Kind::Cameras) => {
            let known = Known::default();
            calibration::decode(bytes, path, None, &known, &budget)?;
        }
        Some(Kind::Bundle) => {
            bundle::read(&bytes, path, budget)?;
        }
        None => {}
    }
    Ok(())
}

/// Prints how many answers there were, how many of them were no errors, the memory and the longest time.
fn one(path: &Path, cases: usize) -> io::Result<()> {
    let bytes = fs::read(path)?;
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let (before, mut slowest, mut good) = (peak(), 0.0_f64, 0);
    let mut ask = |bytes: Vec<u8>, what: &str| {
        let start = own_seconds();
        let answer = answer(path, bytes, cases == 0);
        slowest = slowest.max(own_seconds() - start);
        match answer {
            Ok(()) => good += 1,
            // A file that it names may be the one at fault.
            Err(error) if error.to_string().len() > 10 => {
                let text = error.to_string();
                let named =
                    text.contains(&name) || text.contains("file name") || text.contains('/');
                if !named {
                    println!("! {what}: {text:?} does not name the file");
                }
            }
            Err(error) => println!("! {what}: {error}"),
        }
    };
    let mut count = 1;
    if cases == 0 {
        ask(bytes, "as it is");
    } else {
        let spread = |limit: usize| {
            let step = limit.div_ceil(cases).max(1);
            (0..limit)
                .step_by(step)
                .chain((limit.saturating_sub(20)..limit).filter(move |_| step > 1))
        };
        count = 0;
        for length in spread(bytes.len()) {
            ask(
                bytes[..length].to_vec(),
                &format!("its first {length} bytes"),
            );
            count += 1;
        }
        for bit in spread(8 * bytes.len()) {
            let mut damaged = bytes.clone();
            // Not the same bit of every byte that is met.
            let bit = 8 * (bit / 8) + (bit + bit / 8) % 8;
            damaged[bit / 8] ^= 1 << (bit % 8);
            ask(damaged, &format!("with bit {bit} flipped"));
            count += 1;
        }
    }
    println!("{count} {good} {} {slowest}", peak().saturating_sub(before));
    Ok(())
}

/// The most bytes that this process has had in memory.
fn peak() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kibibytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<u64>().ok());
    kibibytes.unwrap_or(0) * 1024
}

/// The seconds that this process has computed, on all cores, to a hundredth.
fn own_seconds() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks = |field: usize| {
        after_name
            .split_whitespace()
            .nth(field)?
            .parse::<f64>()
            .ok()
    };
    (ticks(11).unwrap_or(0.0) + ticks(12).unwrap_or(0.0)) / 100.0
}

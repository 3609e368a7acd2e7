//! Traces recorded rays through a mesh: `ray_bench SCENE.tri [--threads N] [--isa NAME] [--coherent yes|no|unknown]
//! [--repeat 7] [--cpu] [--exact] RAYS...`
//!
//! `.tri`: u32 vertex count, u32 triangle count, f32 positions, u32 indices, little endian. `.rays`: 7 f32 per ray
//! (origin, direction, t_max); the `.hits` file next to it: f32 t and u32 triangle per ray, or 1 for an occluded shadow
//! ray. Files whose names start with `shadow` test for any hit, all others for the nearest; `bounce` rays count as
//! incoherent and all other rays as coherent, unless `--coherent` is given. `--cpu` traces the rays on one thread and
//! measures the thread's CPU time (Linux), for a busy machine. `--exact` traces with the float64 queries.

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

use raycam_bvh::{
    Bvh, Coherence, ExactHit, ExactRay, ExactTriangles, Hit, INVALID_ID, Instance, InstructionSet, Ray, Scene,
};

/// Allocator that records the number of bytes held and its maximum.
struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Relaxed) + layout.size();
        PEAK.fetch_max(held, Relaxed);
        // SAFETY: guaranteed by the caller.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: guaranteed by the caller.
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: guaranteed by the caller.
        let moved = unsafe { System.realloc(at, layout, size) };
        // A reallocation that moves the block holds the old and the new block at the same time.
        let twice = if moved == at { 0 } else { layout.size() };
        let held = HELD.fetch_add(size, Relaxed) + size - layout.size();
        HELD.fetch_sub(layout.size(), Relaxed);
        PEAK.fetch_max(held + twice, Relaxed);
        moved
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Number of rays per batch, as in images and ray queries.
const BATCH: usize = 4096;

struct Options {
    threads: usize,
    repeat: usize,
    coherence: Option<Coherence>,
    isa: InstructionSet,
    cpu: bool,
    exact: bool,
    files: Vec<String>,
}

type Error = Box<dyn std::error::Error>;

fn main() -> Result<(), Error> {
    let options = options()?;
    let [tri, rays @ ..] = options.files.as_slice() else {
        return Err("the argument SCENE.tri is missing".into());
    };
    let (vertices, triangles) = read_tri(tri)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build()?;
    let (mut bvh, mut build, mut held, mut peak) = (None, f64::INFINITY, 0, 0);
    for _ in 0..3 {
        drop(bvh.take());
        let before = HELD.load(Relaxed);
        PEAK.store(before, Relaxed);
        let start = Instant::now();
        let built = pool.install(|| Bvh::build(&vertices, &triangles))?;
        build = build.min(start.elapsed().as_secs_f64());
        held = HELD.load(Relaxed) - before;
        peak = PEAK.load(Relaxed) - before;
        bvh = Some(Arc::new(built));
    }
    let bvh = bvh.ok_or("the BVH cannot be built")?;
    let n = triangles.len() as f64;
    println!(
        "build {build:.3} s  {:.2} Mtri/s  held {:.1} B/tri  peak {:.1} B/tri",
        n / build / 1e6,
        held as f64 / n,
        peak as f64 / n
    );
    let world_from_mesh = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let mut scene = Scene::build(vec![Instance { bvh, world_from_mesh }], [0.0; 3])?;
    if !scene.set_instruction_set(options.isa) {
        return Err(format!("this machine does not support {}", options.isa.name()).into());
    }
    let mesh = Corners { vertices: &vertices, triangles: &triangles };
    rays.iter().try_for_each(|path| replay(&scene, &mesh, path, &options))
}

fn replay(scene: &Scene, mesh: &Corners, path: &str, options: &Options) -> Result<(), Error> {
    let rays: Vec<Ray> = read(Path::new(path))?
        .chunks_exact(28)
        .map(|ray| {
            let f = |i: usize| f32::from_le_bytes([ray[4 * i], ray[4 * i + 1], ray[4 * i + 2], ray[4 * i + 3]]);
            Ray { origin: [f(0), f(1), f(2)], direction: [f(3), f(4), f(5)], t_max: f(6) }
        })
        .collect();
    let name = Path::new(path).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let any = name.starts_with("shadow");
    let coherence = options.coherence.unwrap_or(match name.starts_with("bounce") {
        true => Coherence::Incoherent,
        false => Coherence::Coherent,
    });
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut occluded = vec![false; rays.len()];
    let mut times = vec![];
    for _ in 0..=options.repeat {
        let start = Instant::now();
        let cpu_start = cpu_seconds();
        if options.cpu {
            for ((rays, hits), occluded) in
                rays.chunks(BATCH).zip(hits.chunks_mut(BATCH)).zip(occluded.chunks_mut(BATCH))
            {
                match any {
                    true => scene.occluded(rays, occluded, coherence),
                    false if options.exact => closest_exact(scene, mesh, rays, hits),
                    false => drop(scene.closest(rays, hits, coherence)),
                }
            }
        } else if any {
            in_parallel(options.threads, &rays, &mut occluded, |rays, occluded| {
                scene.occluded(rays, occluded, coherence)
            });
        } else if options.exact {
            in_parallel(options.threads, &rays, &mut hits, |rays, hits| closest_exact(scene, mesh, rays, hits));
        } else {
            in_parallel(options.threads, &rays, &mut hits, |rays, hits| drop(scene.closest(rays, hits, coherence)));
        }
        times.push(match options.cpu {
            true => cpu_seconds() - cpu_start,
            false => start.elapsed().as_secs_f64(),
        });
    }
    times.remove(0);
    times.sort_by(f64::total_cmp);
    let rate = |seconds: f64| rays.len() as f64 / seconds / 1e6;
    let recorded = read(&Path::new(path).with_extension("hits")).unwrap_or_default();
    let differ = recorded
        .chunks_exact(8)
        .enumerate()
        .filter(|(i, hit)| {
            let t = f32::from_le_bytes([hit[0], hit[1], hit[2], hit[3]]);
            let id = u32::from_le_bytes([hit[4], hit[5], hit[6], hit[7]]);
            if any {
                return occluded[*i] != (id == 1);
            }
            let ours = &hits[*i];
            (ours.triangle == INVALID_ID) != (id == INVALID_ID)
                || id != INVALID_ID && (ours.t - t).abs() > 1e-4 * t.abs()
        })
        .count();
    let median = times.get(times.len() / 2).copied().unwrap_or(f64::NAN);
    let best = times.first().copied().unwrap_or(f64::NAN);
    println!("{name:<10} best {:7.2}  median {:7.2} Mray/s  differ {differ}", rate(best), rate(median));
    Ok(())
}

/// The mesh's corners, converted to float64.
struct Corners<'a> {
    vertices: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
}

impl ExactTriangles for Corners<'_> {
    fn corners(&self, _instance: u32, triangle: u32) -> [[f64; 3]; 3] {
        self.triangles[triangle as usize].map(|i| self.vertices[i as usize].map(f64::from))
    }
}

/// Finds the nearest hits with the float64 query; rounds them to float32.
fn closest_exact(scene: &Scene, mesh: &Corners, rays: &[Ray], hits: &mut [Hit]) {
    let rays: Vec<_> = rays
        .iter()
        .map(|ray| ExactRay {
            origin: ray.origin.map(f64::from),
            direction: ray.direction.map(f64::from),
            t_min: 0.0,
            t_max: f64::from(ray.t_max),
        })
        .collect();
    let mut exact = vec![ExactHit::MISS; rays.len()];
    scene.closest_exact(&rays, mesh, &mut exact);
    for (hit, exact) in hits.iter_mut().zip(exact) {
        let ExactHit { t, u, v, instance, triangle, .. } = exact;
        *hit = Hit { t: t as f32, u: u as f32, v: v as f32, instance, triangle };
    }
}

/// CPU time of this thread, in seconds.
fn cpu_seconds() -> f64 {
    // Yielding makes the Linux kernel update the thread's CPU time.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}

/// Distributes rays to threads, a batch at a time.
fn in_parallel<T: Send>(threads: usize, rays: &[Ray], answers: &mut [T], query: impl Fn(&[Ray], &mut [T]) + Sync) {
    let work = std::sync::Mutex::new(rays.chunks(BATCH).zip(answers.chunks_mut(BATCH)));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let Some((rays, answers)) = work.lock().ok().and_then(|mut work| work.next()) else {
                        return;
                    };
                    query(rays, answers);
                }
            });
        }
    });
}

fn options() -> Result<Options, Error> {
    let mut options = Options {
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        repeat: 7,
        coherence: None,
        isa: InstructionSet::detect(),
        cpu: false,
        exact: false,
        files: vec![],
    };
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or(format!("{arg} requires a value"));
        match arg.as_str() {
            "--threads" => options.threads = value()?.parse()?,
            "--repeat" => options.repeat = value()?.parse()?,
            "--coherent" => {
                options.coherence = Some(match value()?.as_str() {
                    "yes" => Coherence::Coherent,
                    "no" => Coherence::Incoherent,
                    "unknown" => Coherence::Unknown,
                    other => return Err(format!("coherent is {other}; expected yes, no or unknown").into()),
                })
            }
            "--cpu" => options.cpu = true,
            "--exact" => options.exact = true,
            "--isa" => {
                let name = value()?;
                let known = InstructionSet::ALL.into_iter().find(|isa| isa.name() == name);
                options.isa = known.ok_or(format!("unknown instruction set {name}"))?;
            }
            _ => options.files.push(arg),
        }
    }
    Ok(options)
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()).into())
}

type Indexed = (Vec<[f32; 3]>, Vec<[u32; 3]>);

fn read_tri(path: &str) -> Result<Indexed, Error> {
    let bytes = read(Path::new(path))?;
    let mut words = bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (Some(v), Some(t)) = (words.next(), words.next()) else {
        return Err("empty .tri file".into());
    };
    let mut three = |n: u32| -> Vec<[u32; 3]> {
        (0..n).map_while(|_| Some([words.next()?, words.next()?, words.next()?])).collect()
    };
    let vertices = three(v).into_iter().map(|p| p.map(f32::from_bits)).collect();
    let triangles = three(t);
    if triangles.len() != t as usize {
        return Err(format!("{path}: shorter than its header declares").into());
    }
    Ok((vertices, triangles))
}

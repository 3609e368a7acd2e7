use raycam_formats::{Budget, load};
fn main() {
    for path in std::env::args().skip(1) {
        let start = std::time::Instant::now();
        let short = path.rsplit("assets/").next().unwrap().to_owned();
        match load(std::path::Path::new(&path), &Budget::default()) {
            Ok(world) => {
                let t: usize = world.objects.iter().map(|o| world.meshes[o.mesh].triangles.len()).sum();
                let v: usize = world.objects.iter().map(|o| world.meshes[o.mesh].vertices.len()).sum();
                let ms = start.elapsed().as_secs_f64() * 1e3;
                println!("OK  {short}: {} obj {v} v {t} t {} mat {} tex {ms:.1} ms {:?}", world.objects.len(), world.materials.len(), world.textures.len(), world.bounds());
                for n in &world.notices { println!("      notice: {n}"); }
            }
            Err(e) => println!("ERR {e}"),
        }
    }
}

//! Crossings: closed meshes are crossed an even number of times, with equal answers for every instruction set.

use crate::support::{Mesh, Rng, World, sphere};
use raycam_bvh::{ExactHit, ExactRay, HitDetail, HitFilter, InstructionSet};

/// Lines from one vertex of a mesh through other vertices, and through midpoints of its edges.
fn lines(mesh: &Mesh, count: usize, rng: &mut Rng) -> Vec<ExactRay> {
    let vertex = |rng: &mut Rng| mesh.vertices[rng.below(mesh.vertices.len())].map(f64::from);
    let line = |i: usize| {
        let (origin, to) = (vertex(rng), vertex(rng));
        let [a, b, _] = mesh.triangles[rng.below(mesh.triangles.len())].map(|k| mesh.vertices[k as usize]);
        let middle: [f64; 3] = std::array::from_fn(|k| (f64::from(a[k]) + f64::from(b[k])) / 2.0);
        let aim = if i.is_multiple_of(2) { to } else { middle };
        let direction = std::array::from_fn(|k| aim[k] - origin[k]);
        ExactRay { origin, direction, t_min: f64::NEG_INFINITY, t_max: f64::INFINITY }
    };
    (0..count).map(line).collect()
}

#[test]
fn lines_through_vertices_and_edges_have_an_even_number_of_crossings_with_every_instruction_set() {
    let mut rng = Rng(3);
    let mesh = sphere(24, &mut rng);
    let world = World::of(&mesh);
    let mut scene = world.scene();
    let lines = lines(&mesh, 4000, &mut rng);
    let mut expected = None;
    for isa in InstructionSet::ALL.into_iter().filter(|isa| isa.is_available()) {
        assert!(scene.set_instruction_set(isa));
        let (mut counts, mut signed) = (vec![0; lines.len()], vec![0; lines.len()]);
        scene.count_crossings(&lines, &world, None, false, &mut counts);
        scene.count_crossings(&lines, &world, None, true, &mut signed);
        assert!(counts.iter().all(|count| count % 2 == 0), "{isa:?}");
        assert!(signed.iter().all(|sum| *sum == 0), "lines must enter as often as they leave");
        let (mut of_ray, mut found) = (vec![0; lines.len()], vec![]);
        scene.crossings(&lines, &world, None, usize::MAX, (&mut of_ray, &mut found));
        assert!(of_ray.iter().zip(&counts).all(|(list, count)| *list as i32 == *count));
        let expected = expected.get_or_insert_with(|| (counts.clone(), found.clone()));
        assert!(expected.0 == counts && expected.1 == found, "{isa:?}");
    }
}

/// A filter that accepts all triangles except one.
struct Without(u32);

impl HitFilter for Without {
    fn accepts_instance(&self, _: usize, _: u32) -> bool {
        true
    }

    fn accepts(&self, _: usize, hit: &ExactHit) -> bool {
        hit.triangle != self.0
    }
}

#[test]
fn limited_crossings_are_the_nearest_crossings_that_pass_the_filter() {
    // A stack of sheets, with more crossings than the search keeps at once.
    let (mut vertices, mut triangles) = (vec![], vec![]);
    for sheet in 0..300u32 {
        let z = (sheet * 7 % 300) as f32;
        vertices.extend([[-1.0, -1.0, z], [3.0, -1.0, z], [-1.0, 3.0, z]]);
        triangles.push([3 * sheet, 3 * sheet + 1, 3 * sheet + 2]);
    }
    let mesh = Mesh { vertices, triangles };
    let world = World::of(&mesh);
    let scene = world.scene();
    let ray = ExactRay { origin: [0.0, 0.0, -1.0], direction: [0.0, 0.0, 2.0], t_min: 0.0, t_max: f64::INFINITY };
    for limit in [0, 1, 5, 100, 1000] {
        let (mut counts, mut found) = ([0], vec![]);
        scene.crossings(&[ray], &world, None, limit, (&mut counts, &mut found));
        assert_eq!(counts[0] as usize, limit.min(300));
        let t: Vec<f64> = found.iter().map(|crossing| crossing.t).collect();
        let expected: Vec<f64> = (0..limit.min(300)).map(|i| (i as f64 + 1.0) / 2.0).collect();
        assert_eq!(t, expected);
    }
    let mut counts = [0];
    scene.count_crossings(&[ray], &world, Some(&Without(17)), false, &mut counts);
    assert_eq!(counts, [299]);
    let mut hits = [ExactHit::MISS];
    scene.closest_exact_with(&[ray], &world, Some(&Without(0)), HitDetail::Intersection, &mut hits);
    assert_eq!((hits[0].t, hits[0].triangle), (1.0, 43));
}

//! Cutting of polygons: every triangulation covers the polygon exactly once.

use glam::DQuat;
use glam::DVec3;

use crate::geometry::ear_clipping::*;

fn cut(corners: &[DVec3]) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    triangulate(corners, &mut u64::MAX.clone(), &mut triangles).unwrap();
    assert_eq!(triangles.len(), corners.len() - 2);
    triangles
}

/// Signed area of every triangle as seen along `normal`.
fn areas(corners: &[DVec3], normal: DVec3) -> Vec<f64> {
    let area = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
        (b - a).cross(c - a).dot(normal) / 2.0
    };
    cut(corners).into_iter().map(area).collect()
}

fn signed_area(corners: &[DVec3], normal: DVec3) -> f64 {
    let count = corners.len();
    (0..count).map(|i| corners[i].cross(corners[(i + 1) % count]).dot(normal) / 2.0).sum()
}

fn flat(points: &[[f64; 2]]) -> Vec<DVec3> {
    points.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect()
}

/// Asserts that no triangle is reversed and that the areas of all triangles add up to the polygon's area.
fn covers(corners: &[DVec3], normal: DVec3) {
    let areas = areas(corners, normal);
    let whole = signed_area(corners, normal);
    let sum: f64 = areas.iter().sum();
    assert!((sum - whole).abs() <= 1e-12 * whole, "{sum} of {whole}");
    assert!(areas.iter().all(|&area| area >= -1e-13 * whole), "{areas:?}");
}

/// Reproducible random numbers from 0 to 1.
fn random() -> impl FnMut() -> f64 {
    let mut state = 7_u64;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[test]
fn triangulation_covers_stars_in_any_plane_exactly_once() {
    let mut random = random();
    for round in 0..400 {
        let count = 4 + round % 60;
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 6.0 * random(), 6.0 * random(), 6.0 * random());
        let shift = DVec3::new(random(), random(), random()) * 100.0;
        let corners: Vec<DVec3> = (0..count)
            .map(|i| {
                let (sin, cos) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
                let radius = 0.05 + random();
                turn * DVec3::new(radius * cos, radius * sin, 0.0) + shift
            })
            .collect();
        let centred: Vec<DVec3> = corners.iter().map(|&c| c - shift).collect();
        let areas = areas(&corners, turn * DVec3::Z);
        let whole = signed_area(&centred, turn * DVec3::Z);
        assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-9 * whole);
        assert!(areas.iter().all(|&area| area > -1e-9), "{areas:?}");
    }
}

#[test]
fn corners_on_straight_sides_do_not_create_flat_triangles() {
    let square = flat(&[[0., 0.], [1., 0.], [2., 0.], [2., 2.], [1., 2.], [0., 2.], [0., 1.]]);
    assert!(areas(&square, DVec3::Z).iter().all(|&area| area > 0.1));
    covers(&square, DVec3::Z);
    let triangle = flat(&[[0., 0.], [1., 0.], [2., 0.], [3., 0.], [0., 3.]]);
    assert!(areas(&triangle, DVec3::Z).iter().all(|&area| area > 0.1));
}

#[test]
fn concave_polygons_are_cut_at_the_notch() {
    for start in 0..4 {
        let mut arrow = flat(&[[0., 0.], [2., 1.], [0., 2.], [0.5, 1.]]);
        arrow.rotate_left(start);
        covers(&arrow, DVec3::Z);
        arrow.reverse();
        covers(&arrow, DVec3::NEG_Z);
    }
}

#[test]
fn holes_connected_by_a_bridge_stay_open() {
    let ring =
        flat(&[[0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.], [1., 1.], [1., 3.], [3., 3.], [3., 1.], [1., 1.]]);
    covers(&ring, DVec3::Z);
    assert!((areas(&ring, DVec3::Z).iter().sum::<f64>() - 12.0).abs() < 1e-12);
}

#[test]
fn triangulation_covers_combs_and_spirals_exactly_once() {
    let teeth = 200;
    let mut comb = vec![[0.0, 0.0], [2.0 * teeth as f64, 0.0]];
    comb.extend((0..2 * teeth).map(|i| [(2 * teeth - i) as f64, if i % 2 == 0 { 10.0 } else { 1.0 }]));
    covers(&flat(&comb), DVec3::Z);
    let arm = |i: usize, width: f64| {
        let angle = 0.1 * i as f64;
        [(1.0 + angle + width) * angle.cos(), (1.0 + angle + width) * angle.sin()]
    };
    let spiral: Vec<_> = (0..300).map(|i| arm(i, 3.0)).chain((0..300).rev().map(|i| arm(i, 0.0))).collect();
    covers(&flat(&spiral), DVec3::Z);
}

#[test]
fn degenerate_polygons_keep_their_signed_area() {
    // These polygons intersect themselves, are collinear, have all corners at one point, or are not planar.
    let pentagram: Vec<_> = (0..5).map(|i| (f64::from(i) * 2.0 * 72.0).to_radians().sin_cos().into()).collect();
    let bow = vec![[0., 0.], [2., 2.], [2., 0.], [0., 2.1], [-1., 1.]];
    for points in [pentagram, bow, vec![[0., 0.], [1., 0.], [2., 0.], [3., 0.]], vec![[1., 1.]; 6]] {
        let corners = flat(&points);
        let sum: f64 = areas(&corners, DVec3::Z).iter().sum();
        assert!((sum - signed_area(&corners, DVec3::Z)).abs() < 1e-12);
    }
    let saddle: Vec<DVec3> =
        (0..4).map(|i| DVec3::new(f64::from(i & 1 ^ i >> 1), f64::from(i >> 1), f64::from(i & 1))).collect();
    assert_eq!(cut(&saddle), [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn triangulation_stops_at_the_step_limit() {
    let zigzag: Vec<_> = (0..1000).map(|i| [f64::from(i), f64::from(i % 2)]).chain([[500.0, 900.0]]).collect();
    let (mut steps, mut triangles) = (1000, Vec::new());
    assert!(triangulate(&flat(&zigzag), &mut steps, &mut triangles).is_err());
    assert!(triangles.len() < 999);
}

#[test]
fn large_contours_need_at_most_1000_steps_per_corner() {
    let count = 40_000;
    let around = |i: usize, radius: f64| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / count as f64).sin_cos();
        [radius * cos, radius * sin]
    };
    let mut random = random();
    let star: Vec<_> = (0..count).map(|i| around(i, 0.3 + random())).collect();
    let gear: Vec<_> = (0..count).map(|i| around(i, if i % 4 < 2 { 1.0 } else { 0.9 })).collect();
    for points in [star, gear] {
        let corners = flat(&points);
        let (mut steps, mut triangles) = (1000 * count as u64, Vec::new());
        triangulate(&corners, &mut steps, &mut triangles).unwrap();
        covers(&corners, DVec3::Z);
    }
}

use raycam_formats::encode::mask::{coco_rle, polygons};

fn mask(rows: &[&str]) -> (Vec<bool>, usize, usize) {
    let pixels = rows.iter().flat_map(|row| row.bytes().map(|c| c == b'#'));
    (pixels.collect(), rows[0].len(), rows.len())
}

/// Fills polygons by the even-odd rule, at pixel centres.
fn fill(polygons: &[Vec<[u32; 2]>], width: usize, height: usize) -> Vec<u32> {
    let mut count = vec![0; width * height];
    for corners in polygons {
        for y in 0..height {
            for x in 0..width {
                let next = corners.iter().cycle().skip(1);
                // Counts the edges that a ray from the pixel's centre to the left crosses.
                let crossed = corners.iter().zip(next).filter(|(a, b)| {
                    let (low, high) = (a[1].min(b[1]) as usize, a[1].max(b[1]) as usize);
                    a[0] == b[0] && (low..high).contains(&y) && a[0] as usize <= x
                });
                count[y * width + x] += crossed.count() as u32 % 2;
            }
        }
    }
    count
}

#[test]
fn run_lengths_go_down_the_columns() {
    // The run lengths are 0, 2, 4, 1 and 2, starting with a run of 0. They are encoded as characters from '0' on; the
    // last two are differences from the run two before.
    let (pixels, width, height) = mask(&["#..", "#..", "..#"]);
    assert_eq!(coco_rle(&pixels, width, height), "026O");
    assert_eq!(coco_rle(&[false; 6], 3, 2), "6");
    assert_eq!(coco_rle(&[true; 40], 40, 1), "0X1");
}

#[test]
fn outlines_follow_pixel_edges() {
    let (pixels, width, height) = mask(&["....", ".##.", ".#..", "...."]);
    let expected = [[3, 1], [3, 2], [2, 2], [2, 3], [1, 3], [1, 1]];
    assert_eq!(polygons(&pixels, width, height), [expected]);
    // Regions that touch only at a corner are separate.
    let (pixels, width, height) = mask(&["#.", ".#"]);
    assert_eq!(polygons(&pixels, width, height).len(), 2);
    assert!(polygons(&[false; 4], 2, 2).is_empty());
}

#[test]
fn outline_polygons_fill_the_mask_exactly_including_holes() {
    let mut state = 7u64;
    let mut random = |n: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % n
    };
    for share in [2, 3, 10, 90] {
        for _ in 0..40 {
            let (width, height) = (1 + random(20) as usize, 1 + random(20) as usize);
            let pixels: Vec<bool> = (0..width * height).map(|_| random(100) >= 100 / share).collect();
            let found = polygons(&pixels, width, height);
            let expected: Vec<u32> = pixels.iter().map(|&p| u32::from(p)).collect();
            assert_eq!(fill(&found, width, height), expected);
            assert!(found.iter().all(|corners| corners.len() >= 4 && corners.len() % 2 == 0));
        }
    }
}

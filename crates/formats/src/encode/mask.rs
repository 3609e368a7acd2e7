//! Masks in the formats of data sets: run lengths and polygons.

/// Returns COCO's run-length encoding of a mask given row by row: alternating run lengths of 0 and 1, column by column,
/// packed as text. A character contains five bits, the lowest first, and a sixth bit that marks a continuation. From
/// the fourth run on, a run is encoded as the difference from the run two before (`maskApi.c` of COCO's API).
pub fn coco_rle(mask: &[bool], width: usize, height: usize) -> String {
    let mut runs: Vec<i64> = vec![];
    let (mut last, mut length) = (false, 0);
    for x in 0..width {
        for y in 0..height {
            let value = mask[y * width + x];
            if value != last {
                runs.push(length);
                (last, length) = (value, 0);
            }
            length += 1;
        }
    }
    runs.push(length);
    let mut text = String::new();
    for (i, &run) in runs.iter().enumerate() {
        let mut value = if i > 2 { run - runs[i - 2] } else { run };
        loop {
            let bits = (value & 0x1f) as u8;
            value >>= 5;
            let more = if bits & 0x10 != 0 { value != -1 } else { value != 0 };
            text.push(char::from(48 + bits + if more { 0x20 } else { 0 }));
            if !more {
                break;
            }
        }
    }
    text
}

/// Returns the outlines of a mask along its pixel edges, as closed polygons of corners (x, y) without repeating the
/// first corner. Polygons have no holes and do not overlap: a region with a hole is cut in two through the hole.
/// Filling all polygons restores the mask.
pub fn polygons(mask: &[bool], width: usize, height: usize) -> Vec<Vec<[u32; 2]>> {
    let mut found = vec![];
    // These are the ranges of columns that have not been outlined yet.
    let mut parts = vec![(0, width)];
    while let Some((left, right)) = parts.pop() {
        let loops = trace_outlines(mask, [width, height], left, right);
        let hole = loops.iter().find(|corners| area(corners) < 0);
        let columns = |corners: &Vec<[u32; 2]>| {
            let widen = |(low, high): (u32, u32), c: &[u32; 2]| (low.min(c[0]), high.max(c[0]));
            corners.iter().fold((u32::MAX, 0), widen)
        };
        match hole.map(columns) {
            // The region is cut through the hole, so that the hole is open on one side in each half.
            Some((from, to)) => {
                let cut = (from + ((to - from) / 2).max(1)) as usize;
                parts.push((cut, right));
                parts.push((left, cut));
            }
            None => found.extend(loops),
        }
    }
    found
}

/// Twice the area inside a closed polygon, positive if it runs clockwise in the image.
fn area(corners: &[[u32; 2]]) -> i64 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| i64::from(a[0]) * i64::from(b[1]) - i64::from(b[0]) * i64::from(a[1])).sum()
}

/// Directions in which an outline continues from a corner: right, down, left, up.
const DIRECTIONS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// All outlines of the columns from `left` up to `right`, with the mask on their right side: clockwise around regions,
/// counter-clockwise around holes. Pixels that touch only at a corner are separate.
fn trace_outlines(mask: &[bool], [width, height]: [usize; 2], left: usize, right: usize) -> Vec<Vec<[u32; 2]>> {
    let inside = |x: i64, y: i64| {
        (left as i64..right as i64).contains(&x)
            && (0..height as i64).contains(&y)
            && mask[y as usize * width + x as usize]
    };
    // True if an edge leaves a corner in this direction with the mask on its right side and not on its left side.
    let leaves = |[x, y]: [i64; 2], direction: usize| {
        let (a, b) = match direction {
            0 => (inside(x, y), inside(x, y - 1)),
            1 => (inside(x - 1, y), inside(x, y)),
            2 => (inside(x - 1, y - 1), inside(x - 1, y)),
            _ => (inside(x, y - 1), inside(x - 1, y - 1)),
        };
        a && !b
    };
    let columns = right - left;
    // Outlines start at edges that run to the right; each outline has at least one such edge.
    let mut walked = vec![false; (columns + 1) * (height + 1)];
    let place = |[x, y]: [i64; 2]| y as usize * (columns + 1) + x as usize - left;
    let mut loops = vec![];
    for y in 0..=height as i64 {
        for x in left as i64..right as i64 {
            if !leaves([x, y], 0) || walked[place([x, y])] {
                continue;
            }
            let (mut corners, mut at, mut direction) = (vec![], [x, y], 0);
            loop {
                if direction == 0 {
                    walked[place(at)] = true;
                }
                at = [at[0] + DIRECTIONS[direction][0], at[1] + DIRECTIONS[direction][1]];
                // Right turns are preferred, so that regions that touch only at a corner stay separate polygons.
                let turn = [(direction + 1) % 4, direction, (direction + 3) % 4];
                let next = turn.into_iter().find(|&next| leaves(at, next)).unwrap_or(direction);
                if next != direction {
                    corners.push([at[0] as u32, at[1] as u32]);
                }
                direction = next;
                if at == [x, y] && direction == 0 {
                    break;
                }
            }
            loops.push(corners);
        }
    }
    loops
}

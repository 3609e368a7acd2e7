//! Trajectories whose header names the columns: the names determine the meaning of each number, whatever the format's
//! usual order.

use std::path::Path;

use glam::DVec3;
use raycam_scene::{NoticeCode, PixelCenter};

use crate::{Calibration, CameraRecord, Pose, Rotation};
use raycam_formats::{FormatError, Result};

/// Columns of a header.
#[derive(Debug, PartialEq)]
pub(crate) struct NamedColumns {
    /// Time, with the length of its unit in seconds if the header names the unit.
    time: Option<(usize, Option<f64>)>,
    position: [usize; 3],
    /// w, x, y, z.
    quaternion: [usize; 4],
    count: usize,
    /// Names of columns that are not read.
    pub(crate) unread: Vec<String>,
    /// True if the position is north, east, down.
    pub(crate) north_east_down: bool,
    comma: bool,
    /// Number of the header's line, from 1.
    line: usize,
}

/// Role of a column.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Time(Option<f64>),
    Position(usize),
    /// Index, counted from w.
    Quaternion(usize),
    /// x, y, z or w without a group.
    Letter(usize),
    North(usize),
    None,
}

/// Columns named by the header of a text; None for a text whose header names no quaternion.
///
/// # Errors
/// The reason if the header names only a part of a pose.
pub(crate) fn columns_of(text: &str) -> Option<Result<NamedColumns, String>> {
    let is_data = |line: &str| line.split([',', ' ', '\t', ';']).next().is_some_and(|word| word.parse::<f64>().is_ok());
    let lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty()).take(32);
    let headers: Vec<(usize, &str)> = lines.take_while(|(_, line)| !is_data(line)).collect();
    headers.into_iter().rev().find_map(|(i, line)| {
        let columns = columns_of_line(line.trim_start_matches(['#', '%', '/', ' ', '\t']))?;
        Some(columns.map(|columns| NamedColumns { line: i + 1, ..columns }))
    })
}

fn columns_of_line(line: &str) -> Option<Result<NamedColumns, String>> {
    // In "translation (tx, ty, tz)" the brackets group names; in "time (s)" they contain a unit.
    let mut plain = String::new();
    let mut rest = line;
    while let Some(open) = rest.find('(') {
        let Some(close) = rest[open..].find(')').map(|length| open + length) else { break };
        let inner = &rest[open + 1..close];
        let grouped = inner.contains(',');
        if grouped {
            let start = rest[..open].rfind(',').map_or(0, |comma| comma + 1);
            plain.push_str(&rest[..start]);
            let group = rest[start..open].trim();
            let names: Vec<String> = inner.split(',').map(|name| format!("{group} {}", name.trim())).collect();
            plain.push_str(&names.join(", "));
        } else {
            plain.push_str(&rest[..=close]);
        }
        rest = &rest[close + 1..];
    }
    plain.push_str(rest);
    let comma = plain.contains(',');
    let names: Vec<String> = if comma {
        plain.split(',').map(|name| name.trim().to_lowercase()).collect()
    } else {
        // Units are separate words: "timestamp [ns] x [m]".
        let words = plain.split_whitespace().map(str::to_lowercase);
        words.fold(Vec::new(), |mut names: Vec<String>, word| {
            match (word.starts_with(['[', '(']), names.last_mut()) {
                (true, Some(last)) => last.push_str(&word),
                _ => names.push(word),
            }
            names
        })
    };
    let roles: Vec<Role> = names.iter().map(|name| role_of(name)).collect();
    let has_quaternion = roles.iter().filter(|role| matches!(role, Role::Quaternion(_))).count();
    let letters = roles.iter().filter(|role| matches!(role, Role::Letter(_))).count();
    if has_quaternion == 0 && letters < 7 || names.len() < 7 {
        return None;
    }
    Some(assign(&names, &roles, comma))
}

/// Role of a name in lower case.
fn role_of(name: &str) -> Role {
    let unit = ["ns", "us", "\u{b5}s", "ms", "s"].into_iter().zip([1e-9, 1e-6, 1e-6, 1e-3, 1.0]);
    let bare = name.split(['[', '(']).next().unwrap_or_default();
    let parts: Vec<&str> = bare.split(|c: char| !c.is_ascii_alphanumeric()).filter(|part| !part.is_empty()).collect();
    let Some(last) = parts.last() else { return Role::None };
    let has = |words: &[&str]| parts.iter().any(|part| words.contains(part));
    if parts.iter().any(|part| part.contains("time") || part.contains("stamp"))
        || has(&["t", "sec", "nsec", "seconds"]) && parts.len() == 1
    {
        let stated = unit.clone().find(|(unit, _)| {
            name.contains(&format!("[{unit}]")) || name.contains(&format!("({unit})")) || parts.contains(unit)
        });
        return Role::Time(stated.map(|(_, length)| length));
    }
    // Velocities, biases and covariances have separate groups.
    if has(&[
        "ecef", "v", "vel", "velocity", "b", "bias", "acc", "gyro", "omega", "cov", "gravity", "std", "angular",
        "linear",
    ]) {
        return Role::None;
    }
    let letter = |text: &str| ["w", "x", "y", "z"].iter().position(|letter| *letter == text);
    for part in &parts {
        let (group, rest) = part.split_at(part.len().saturating_sub(1));
        match (group, letter(rest)) {
            ("q" | "quat" | "rot" | "o", Some(i)) => return Role::Quaternion(i),
            ("t" | "p" | "pos" | "trans", Some(i @ 1..)) => return Role::Position(i - 1),
            _ => {}
        }
    }
    let quaternion = ["q", "quat", "quaternion", "orientation", "rotation", "rot", "attitude", "qvec"];
    let position = ["p", "t", "pos", "position", "translation", "trans", "location", "tvec"];
    match (letter(last), has(&quaternion), has(&position)) {
        (Some(i), true, _) => Role::Quaternion(i),
        (Some(i @ 1..), false, true) => Role::Position(i - 1),
        (Some(i), false, _) if parts.len() == 1 => Role::Letter(i),
        _ => match *last {
            "n" | "north" | "northing" => Role::North(0),
            "e" | "east" | "easting" => Role::North(1),
            "d" | "down" => Role::North(2),
            _ => Role::None,
        },
    }
}

fn assign(names: &[String], roles: &[Role], comma: bool) -> Result<NamedColumns, String> {
    let (mut time, mut position, mut quaternion) = (None, [None; 3], [None; 4]);
    let (mut unread, mut north_east_down) = (Vec::new(), false);
    let twice = |name: &str| format!("the header contains column {name:?} twice");
    let quaternion_named = roles.iter().any(|role| matches!(role, Role::Quaternion(1..)));
    for (column, (name, role)) in names.iter().zip(roles).enumerate() {
        let (slot, is_position) = match *role {
            Role::Time(unit) => {
                if time.is_none() {
                    time = Some((column, unit));
                } else {
                    unread.push(name.clone());
                }
                continue;
            }
            Role::Position(i) | Role::North(i) => (i, true),
            Role::Quaternion(i) => (i, false),
            // Single letters: first the position, then the quaternion.
            Role::Letter(0) => (0, false),
            Role::Letter(i) if quaternion_named || position[i - 1].is_none() => (i - 1, true),
            Role::Letter(i) => (i, false),
            Role::None => {
                unread.push(name.clone());
                continue;
            }
        };
        north_east_down |= matches!(role, Role::North(_)) || name.contains("ned");
        let place = if is_position { &mut position[slot] } else { &mut quaternion[slot] };
        if place.replace(column).is_some() {
            return Err(twice(name));
        }
    }
    let missing = |what: &str| {
        format!("the header has no columns for a {what}; expected x y z of a position and w x y z of a quaternion")
    };
    let [Some(x), Some(y), Some(z)] = position else { return Err(missing("complete position")) };
    let [Some(qw), Some(qx), Some(qy), Some(qz)] = quaternion else { return Err(missing("complete quaternion")) };
    Ok(NamedColumns {
        time,
        position: [x, y, z],
        quaternion: [qw, qx, qy, qz],
        count: names.len(),
        unread,
        north_east_down,
        comma,
        line: 0,
    })
}

/// Time in seconds from its text; integers with at least 15 digits are microseconds, with at least 18 digits
/// nanoseconds.
pub(crate) fn seconds_of(word: &str, unit: Option<f64>) -> Option<f64> {
    if let Ok(whole) = word.parse::<u64>() {
        let per_second: u64 = match unit {
            Some(unit) => (1.0 / unit).round() as u64,
            None if word.len() >= 18 => 1_000_000_000,
            None if word.len() >= 15 => 1_000_000,
            None => 1,
        };
        // Whole seconds and the fraction are converted separately to lose fewer digits.
        return Some((whole / per_second) as f64 + (whole % per_second) as f64 / per_second as f64);
    }
    word.parse::<f64>().ok().filter(|value| value.is_finite()).map(|value| value * unit.unwrap_or(1.0))
}

/// Poses, world_from_camera, of the rows below a header.
pub(crate) fn read(text: &str, path: &Path, columns: &NamedColumns) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let below = numbered.filter(|(line, _)| *line > columns.line);
    let rows = below.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    for (line, row) in rows {
        let fail = |message: String| FormatError::line(path, line, message);
        let words: Vec<&str> = if columns.comma && row.contains(',') {
            row.split(',').map(str::trim).collect()
        } else {
            row.split([',', ' ', '\t', ';']).filter(|word| !word.is_empty()).collect()
        };
        if words.len() != columns.count {
            return Err(fail(format!("the row has {} columns, but the header has {}", words.len(), columns.count)));
        }
        let number = |column: usize| {
            let value = words[column].parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| fail(format!("{:?}; expected a finite number", words[column])))
        };
        let [qw, qx, qy, qz] = columns.quaternion;
        let rotation = Rotation::unit_quaternion([number(qw)?, number(qx)?, number(qy)?, number(qz)?]);
        let rotation = rotation.map_err(|message| fail(format!("columns named by the header: {message}")))?;
        let [x, y, z] = columns.position;
        let center = DVec3::new(number(x)?, number(y)?, number(z)?);
        let name = match columns.time {
            Some((column, _)) => words[column].to_owned(),
            None => format!("{:06}", calibration.records.len()),
        };
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        if let Some((column, unit)) = columns.time {
            let seconds = seconds_of(words[column], unit);
            record.time = Some(seconds.ok_or_else(|| fail(format!("{:?}; expected a time", words[column])))?);
        }
        record.pose = Some(Pose::world_from_camera(rotation, center));
        calibration.records.push(record);
    }
    if !columns.unread.is_empty() {
        calibration.note(NoticeCode::IgnoredKey, format!("ignored columns: {}", columns.unread.join(", ")));
    }
    if columns.north_east_down {
        calibration
            .note(NoticeCode::PlacedCameras, "the header names north, east, down; the world's z axis points down");
    }
    Ok(calibration)
}

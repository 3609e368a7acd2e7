//! Trajectories whose header names the columns: the names determine the meaning of each number, whatever the format's
//! usual order.

use std::path::Path;

use glam::DVec3;
use raycam_scene::{NoticeCode, PixelCenter, counted};

use crate::document::length_unit::{LengthUnit, is_micro_sign};
use crate::document::number_lines::without_comment;
use crate::pose::SCALED_QUATERNION;
use crate::trajectory::stated_order::{StatedOrder, stated_order};
use crate::{Calibration, CameraRecord, Pose, Rotation};
use raycam_formats::{FormatError, Result};

/// The columns that a header names; columns are stored by their index.
#[derive(Debug, PartialEq)]
pub(crate) struct NamedColumns {
    /// Column of the time, with the length of the time unit in seconds if the header names the unit.
    time: Option<(usize, Option<f64>)>,
    position: [usize; 3],
    /// Columns of the quaternion's w, x, y and z.
    quaternion: [usize; 4],
    /// Column of the nanoseconds that are added to a time in whole seconds.
    nanoseconds: Option<usize>,
    /// True if the quaternion's columns are single letters next to the same letters of the position.
    has_letters: bool,
    /// Names of all columns.
    names: Vec<String>,
    /// Names of columns that are not read.
    pub(crate) unread: Vec<String>,
    /// True if the position's coordinates are north, east and down.
    pub(crate) north_east_down: bool,
    /// Character between columns; `None` for white space.
    separator: Option<char>,
    /// Line number of the header, from 1; 0 without a header.
    line: usize,
}

impl NamedColumns {
    /// Sets the unit of the time column, in seconds, if the header does not specify it.
    pub(crate) fn with_time_unit(mut self, seconds: f64) -> Self {
        self.time = self.time.map(|(column, unit)| (column, unit.or(Some(seconds))));
        self
    }

    /// Number of columns up to and including the last column that belongs to the pose or its time.
    fn end_of_pose(&self) -> usize {
        let own = self.position.into_iter().chain(self.quaternion);
        let time = self.time.map(|(column, _)| column).into_iter().chain(self.nanoseconds);
        own.chain(time).max().map_or(0, |last| last + 1)
    }
}

/// Role of a column, according to its name.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Time(Option<f64>),
    /// The fraction of a second, in nanoseconds.
    Nanoseconds,
    Position(usize),
    /// A component of the quaternion, by its index in the order w x y z.
    Quaternion(usize),
    /// A component of `rw rx ry rz`, by its index in this order. Without `rw`, the other three columns are a rotation
    /// vector or angles.
    RotationLetter(usize),
    /// A component of a quaternion whose order is not specified: `q0` to `q3`, or `q1` to `q4`.
    Numbered,
    /// A column named x, y or z after another word, by the axis's index. It belongs to the position if no other columns
    /// do.
    Other(usize),
    /// i, j or k without a group: x, y and z of a quaternion if all three are present.
    Imaginary(usize),
    /// x, y, z or w without a group.
    Letter(usize),
    North(usize),
    None,
}

/// Returns the columns that the header of a text names. If no header names a quaternion, but a comment above the rows
/// states the quaternion's order in prose, the columns are an optional time, a position and the quaternion. Otherwise,
/// returns `None`.
///
/// # Errors
/// The reason if the header names only a part of a pose, or if the comments state two orders.
pub(crate) fn columns_of(text: &str) -> Option<Result<NamedColumns, String>> {
    let is_data = |line: &str| words_of(line, None).next().is_some_and(|word| word.parse::<f64>().is_ok());
    let text = text.trim_start_matches('\u{feff}');
    let lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty()).take(32);
    let (headers, rows): (Vec<_>, Vec<_>) = lines.partition(|(_, line)| !is_data(line));
    let first_row = rows.first().map_or(usize::MAX, |(i, _)| *i);
    let headers: Vec<(usize, &str)> = headers.into_iter().filter(|(i, _)| *i < first_row).collect();
    let named = headers.iter().rev().find_map(|(i, line)| {
        let line = line.trim_start_matches(['#', '%', '/', ' ', '\t']);
        // The names may follow a label that ends with a colon: "format: timestamp tx ty tz qx qy qz qw".
        let labelled = line.rsplit_once(':').map(|(_, names)| names);
        let names = labelled.into_iter().chain([line]).map(Header::new).find(Header::names_a_quaternion)?;
        let names =
            headers.iter().find_map(|(above, line)| names.with_groups(line).filter(|_| above < i)).unwrap_or(names);
        let units = headers.iter().find(|(below, line)| below > i && names.has_units(line));
        let (i, names) = match units {
            Some((below, units)) => (below, names.with_units(units)),
            None => (i, names),
        };
        let count = rows.first().map(|(_, row)| words_of(row, names.separator).count());
        let columns = count.map_or(names.clone(), |count| names.without_labels(count)).assign();
        Some(columns.map(|columns| NamedColumns { line: i + 1, ..columns }))
    });
    named.or_else(|| {
        let prose: Vec<&str> = headers.iter().map(|(_, line)| *line).collect();
        columns_of_prose(&prose.join("\n"), rows.first()?.1)
    })
}

/// Returns the columns of rows whose order is stated in prose. Rows have 7 numbers (position and quaternion), 8 (with a
/// time) or 17 (EuRoC, with further columns); returns `None` for other rows.
///
/// # Errors
/// The reason if the prose states two orders.
fn columns_of_prose(prose: &str, row: &str) -> Option<Result<NamedColumns, String>> {
    let separator = SEPARATORS.into_iter().find(|separator| row.contains(*separator));
    let count = words_of(row, separator).count();
    let start = match count {
        7 => 0,
        8 | 17 => 1,
        _ => return None,
    };
    let columns = |StatedOrder { w_first, quaternion_first }| {
        let (position, q) = if quaternion_first { (start + 4, start) } else { (start, start + 3) };
        NamedColumns {
            time: (start == 1).then_some((0, None)),
            position: [position, position + 1, position + 2],
            quaternion: if w_first { [q, q + 1, q + 2, q + 3] } else { [q + 3, q, q + 1, q + 2] },
            nanoseconds: None,
            has_letters: false,
            names: vec![String::new(); count],
            unread: Vec::new(),
            north_east_down: false,
            separator,
            line: 0,
        }
    };
    Some(stated_order(prose)?.map(columns))
}

/// Separators of columns other than white space, by precedence.
const SEPARATORS: [char; 3] = [',', ';', '|'];

/// Words before the names of columns that are not names of columns themselves.
const LABELS: [&str; 12] =
    ["tum", "euroc", "format", "trajectory", "columns", "column", "fields", "data", "each", "line", "header", "order"];

/// Splits a row into words.
fn words_of(row: &str, separator: Option<char>) -> Box<dyn Iterator<Item = &str> + '_> {
    match separator.filter(|separator| row.contains(*separator)) {
        Some(separator) => {
            let row = row.trim_matches(|c: char| c == '|' || c.is_whitespace());
            Box::new(row.strip_suffix(separator).unwrap_or(row).split(separator).map(|word| unquoted(word.trim())))
        }
        None => {
            let words = row.split(|c: char| SEPARATORS.contains(&c) || c.is_whitespace());
            Box::new(words.filter(|word| !word.is_empty()).map(unquoted))
        }
    }
}

/// Splits a row of names, of which some may be empty.
fn words_of_row(row: &str, separator: char) -> impl Iterator<Item = &str> {
    row.split(separator).map(|word| unquoted(word.trim()))
}

fn unquoted(word: &str) -> &str {
    word.trim_matches('"')
}

/// Removes the brackets around names: in "translation (tx, ty, tz)" and "quaternion(w x y z)", brackets group names.
/// Brackets with a unit, as in "time (s)", are kept; a remark such as "(camera to world)" is removed with its brackets.
fn without_brackets(line: &str) -> String {
    let mut plain = String::new();
    let mut rest = line;
    while let Some(open) = rest.find('(') {
        let Some(close) = rest[open..].find(')').map(|length| open + length) else { break };
        let inner = &rest[open + 1..close];
        let members: Vec<&str> = inner.split([',', ' ']).filter(|name| !name.is_empty()).collect();
        let letters = members.iter().all(|name| name.len() <= 2 && name.to_lowercase().ends_with(['w', 'x', 'y', 'z']));
        let has_commas = inner.contains(',');
        if members.len() < 2 {
            plain.push_str(&rest[..=close]);
        } else if has_commas || letters {
            let before = rest[..open].trim_end();
            let start = before.rfind(|c: char| SEPARATORS.contains(&c));
            let start = start.or_else(|| before.rfind(char::is_whitespace).filter(|_| !has_commas));
            let start = start.map_or(0, |at| at + 1);
            let group = rest[start..open].trim();
            let (within, between) = if has_commas { (" ", ", ") } else { ("_", " ") };
            let names: Vec<String> = members.iter().map(|name| format!("{group}{within}{name}")).collect();
            plain.push_str(&rest[..start]);
            plain.push_str(&names.join(between));
        } else {
            plain.push_str(&rest[..open]);
        }
        rest = &rest[close + 1..];
    }
    plain + rest
}

/// The names of a header's columns in lower case, with their roles.
#[derive(Clone)]
struct Header {
    names: Vec<String>,
    roles: Vec<Role>,
    separator: Option<char>,
}

impl Header {
    fn new(line: &str) -> Self {
        let plain = without_brackets(line);
        let separator = SEPARATORS.into_iter().find(|separator| plain.contains(*separator));
        let names: Vec<String> = if separator.is_some() {
            words_of(&plain, separator).map(str::to_lowercase).collect()
        } else {
            // Units are separate words: "timestamp [ns] x [m]".
            let words = plain.split_whitespace().map(|word| unquoted(word).to_lowercase());
            words.fold(Vec::new(), |mut names: Vec<String>, word| {
                match (word.starts_with(['[', '(']), names.last_mut()) {
                    (true, Some(last)) => last.push_str(&word),
                    _ => names.push(word),
                }
                names
            })
        };
        Self { roles: roles_of(&names), names, separator }
    }

    /// True for a row of units below the names: `s,m,m,m,-,-,-,-`.
    fn has_units(&self, row: &str) -> bool {
        let is_unit = |word: &str| {
            let word = word.trim_matches(|c: char| !c.is_alphanumeric() && !is_micro_sign(c)).to_lowercase();
            let others = ["", "s", "ms", "us", "\u{b5}s", "ns", "sec", "rad", "none", "na", "1"];
            others.contains(&&word[..]) || LengthUnit::from_name(&word).is_some()
        };
        let words: Vec<&str> = words_of(row, self.separator).collect();
        words.len() == self.names.len() && words.into_iter().all(is_unit)
    }

    /// The names after the names of groups in a row above, `Rotation,Rotation,...,Position` (Motive's files); `None` if the
    /// row does not contain the groups of the quaternion and of the position.
    fn with_groups(&self, row: &str) -> Option<Self> {
        let groups: Vec<String> = words_of_row(row, self.separator?).map(str::to_lowercase).collect();
        let count = |name: &str| groups.iter().filter(|group| *group == name).count();
        if groups.len() != self.names.len() || count("rotation") < 4 || count("position") < 3 {
            return None;
        }
        let names: Vec<String> =
            groups.iter().zip(&self.names).map(|(group, name)| format!("{group} {name}").trim().to_owned()).collect();
        Some(Self { roles: roles_of(&names), names, separator: self.separator })
    }

    /// Appends the units in a row below the names to the names.
    fn with_units(&self, row: &str) -> Self {
        let units =
            words_of(row, self.separator).map(|word| word.trim_matches(['[', ']', '(', ')', '-']).to_lowercase());
        let names = self.names.iter().zip(units).map(|(name, unit)| match &unit[..] {
            "" => name.clone(),
            unit => format!("{name}[{unit}]"),
        });
        let names = names.collect::<Vec<_>>();
        Self { roles: roles_of(&names), names, separator: self.separator }
    }

    /// True if the names include the names of a quaternion.
    fn names_a_quaternion(&self) -> bool {
        let count = |is: fn(&Role) -> bool| self.roles.iter().filter(|role| is(role)).count();
        let quaternion = count(|role| matches!(role, Role::Quaternion(_)));
        let letters = count(|role| matches!(role, Role::Letter(_)));
        let numbered = count(|role| *role == Role::Numbered);
        (quaternion > 0 || letters >= 7 || numbered == 4) && self.names.len() >= 7
    }

    /// Removes the words of a label before the names, if the rows have fewer columns.
    fn without_labels(mut self, count: usize) -> Self {
        let words = self.names.iter().take_while(|name| LABELS.contains(&&name[..])).count();
        let labels = self.names.len().saturating_sub(count).min(words);
        self.names.drain(..labels);
        self.roles.drain(..labels);
        self
    }

    fn assign(self) -> Result<NamedColumns, String> {
        if self.roles.contains(&Role::Numbered) {
            let numbered = self.names.iter().zip(&self.roles).filter(|(_, role)| **role == Role::Numbered);
            let names: Vec<&str> = numbered.map(|(name, _)| name.as_str()).collect();
            return Err(format!(
                "the columns {} do not specify which number of the quaternion is w; rename them in the header, to qw \
                 qx qy qz or qx qy qz qw",
                names.join(" ")
            ));
        }
        assign(&self.names, &self.roles, self.separator)
    }
}

/// The roles of columns, by their names in lower case.
fn roles_of(names: &[String]) -> Vec<Role> {
    let mut roles: Vec<Role> = names.iter().map(|name| role_of(name)).collect();
    let has = |role: Role| roles.contains(&role);
    let rotation = has(Role::RotationLetter(0));
    let imaginary = (1..4).all(|i| has(Role::Imaginary(i)));
    for role in &mut roles {
        *role = match *role {
            Role::RotationLetter(i) if rotation => Role::Quaternion(i),
            Role::Imaginary(i) if imaginary => Role::Quaternion(i),
            Role::Letter(0) if imaginary => Role::Quaternion(0),
            Role::RotationLetter(_) | Role::Imaginary(_) => Role::None,
            role => role,
        };
    }
    roles
}

/// Returns the remedy for a text whose header names a rotation in another form than a quaternion: angles, a rotation
/// vector, or the elements of a matrix. `None` for other texts.
pub(crate) fn remedy_for_other_rotations(text: &str) -> Option<String> {
    const ANGLES: [[&str; 3]; 4] =
        [["roll", "pitch", "yaw"], ["omega", "phi", "kappa"], ["heading", "pitch", "roll"], ["rx", "ry", "rz"]];
    let line = text.trim_start_matches('\u{feff}').lines().find(|line| !line.trim().is_empty())?;
    let names = Header::new(line.trim_start_matches(['#', '%', '/', ' ', '\t'])).names;
    let starts = |word: &str| names.iter().any(|name| name.starts_with(word));
    let has = |word: &str| names.iter().any(|name| name == word);
    if let Some(found) = ANGLES.iter().find(|words| words.iter().all(|word| starts(word))) {
        let [a, b, c] = found;
        return Some(format!(
            "the header names {a}, {b} and {c}, but not their axes, order, direction and unit; convert them to a \
             quaternion (scipy.spatial.transform.Rotation.from_euler or from_rotvec) in columns qx qy qz qw"
        ));
    }
    let elements =
        ["r", "m", "t", "rot_"].iter().any(|letter| has(&format!("{letter}11")) && has(&format!("{letter}22")));
    elements.then(|| {
        "the header names the elements of matrices; remove the header and the columns that are not elements, and write \
         16 numbers per line (the 4x4 matrix by rows)"
            .into()
    })
}

/// Parts of the names of velocities, biases, covariances and other quantities; the x, y or z in such names does not
/// belong to a pose.
const OTHER_QUANTITIES: [&str; 24] = [
    "ecef",
    "v",
    "vel",
    "velocity",
    "b",
    "ba",
    "bg",
    "bias",
    "a",
    "acc",
    "accel",
    "acceleration",
    "gyr",
    "gyro",
    "mag",
    "omega",
    "cov",
    "gravity",
    "std",
    "angular",
    "linear",
    "euler",
    "rpy",
    "scale",
];

/// The unit of length at the end of a column's name: metres for `x_m` and `x [m]`.
fn length_unit(name: &str) -> Option<LengthUnit> {
    LengthUnit::from_name(words_of_name(name).skip(1).last()?)
}

/// Words of a column's name.
fn words_of_name(name: &str) -> impl Iterator<Item = &str> {
    name.split(|c: char| !c.is_ascii_alphanumeric() && !is_micro_sign(c)).filter(|word| !word.is_empty())
}

/// Returns the role of a column by its name in lower case.
fn role_of(name: &str) -> Role {
    let unit = ["ns", "us", "\u{b5}s", "ms", "s"].into_iter().zip([1e-9, 1e-6, 1e-6, 1e-3, 1.0]);
    let bare = name.split(['[', '(']).next().unwrap_or_default();
    let mut parts: Vec<&str> = words_of_name(bare).collect();
    if length_unit(bare).is_some() {
        parts.pop();
    }
    let Some(last) = parts.last() else { return Role::None };
    let has = |words: &[&str]| parts.iter().any(|part| words.contains(part));
    if parts.iter().any(|part| part.contains("time") || part.contains("stamp"))
        || has(&["t", "ts", "sec", "secs", "nsec", "seconds", "epoch"]) && parts.len() == 1
    {
        if parts.len() > 1 && matches!(*last, "nsec" | "nsecs" | "nanosec") {
            return Role::Nanoseconds;
        }
        let stated = unit.clone().find(|(unit, _)| {
            name.contains(&format!("[{unit}]")) || name.contains(&format!("({unit})")) || parts.contains(unit)
        });
        return Role::Time(stated.map(|(_, length)| length));
    }
    if has(&OTHER_QUANTITIES) {
        return Role::None;
    }
    let letter = |text: &str| ["w", "x", "y", "z"].iter().position(|letter| *letter == text);
    let imaginary = |text: &str| ["r", "i", "j", "k"].iter().position(|letter| *letter == text);
    for part in &parts {
        let (group, rest) = part.split_at(part.char_indices().next_back().map_or(0, |(at, _)| at));
        match (group, letter(rest)) {
            ("q" | "quat" | "rot" | "o", Some(i)) => return Role::Quaternion(i),
            ("r", Some(i)) if parts.len() == 1 => return Role::RotationLetter(i),
            ("t" | "p" | "pos" | "trans", Some(i @ 1..)) => return Role::Position(i - 1),
            _ => {}
        }
        if let ("q" | "quat", Some(i)) = (group, imaginary(rest)) {
            return Role::Quaternion(i);
        }
        if matches!(group, "q" | "quat") && matches!(rest, "0" | "1" | "2" | "3" | "4") {
            return Role::Numbered;
        }
    }
    let quaternion = ["q", "quat", "quaternion", "orientation", "rotation", "rot", "attitude", "qvec"];
    let position = ["p", "t", "pos", "position", "translation", "trans", "location", "tvec"];
    match (letter(last), has(&quaternion), has(&position)) {
        (Some(i), true, _) => Role::Quaternion(i),
        (Some(i @ 1..), false, true) => Role::Position(i - 1),
        (Some(i), false, _) if parts.len() == 1 => Role::Letter(i),
        (Some(i @ 1..), false, false) => Role::Other(i - 1),
        _ if has(&quaternion) && matches!(*last, "0" | "1" | "2" | "3" | "4") => Role::Numbered,
        _ if has(&quaternion) && imaginary(last).is_some() => Role::Quaternion(imaginary(last).unwrap_or_default()),
        _ => match *last {
            "i" | "j" | "k" if parts.len() == 1 => Role::Imaginary(imaginary(last).unwrap_or_default()),
            "n" | "north" | "northing" => Role::North(0),
            "e" | "east" | "easting" => Role::North(1),
            "d" | "down" => Role::North(2),
            _ => Role::None,
        },
    }
}

fn assign(names: &[String], roles: &[Role], separator: Option<char>) -> Result<NamedColumns, String> {
    let (mut time, mut nanoseconds, mut position, mut quaternion) = (None, None, [None; 3], [None; 4]);
    let (mut unread, mut north_east_down) = (Vec::new(), false);
    let twice = |name: &str| format!("the header contains column {name:?} twice");
    let quaternion_named = roles.iter().any(|role| matches!(role, Role::Quaternion(1..)));
    let own_position = |role: &Role| matches!(role, Role::Position(_) | Role::North(_) | Role::Letter(_));
    // Columns named x, y or z after another word are the position only if exactly one group has an x, a y and a z.
    let other_is_position = !roles.iter().any(own_position)
        && (0..3).all(|i| roles.iter().filter(|role| **role == Role::Other(i)).count() == 1);
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
            Role::Nanoseconds => {
                nanoseconds = Some(column);
                continue;
            }
            Role::Position(i) | Role::North(i) => (i, true),
            Role::Other(i) if other_is_position => (i, true),
            Role::Quaternion(i) => (i, false),
            // Single letters belong to the position first; when the position has its x, y or z, they belong to the
            // quaternion.
            Role::Letter(0) => (0, false),
            Role::Letter(i) if quaternion_named || position[i - 1].is_none() => (i - 1, true),
            Role::Letter(i) => (i, false),
            _ => {
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
        nanoseconds,
        position: [x, y, z],
        quaternion: [qw, qx, qy, qz],
        has_letters: matches!(roles[qx], Role::Letter(_)),
        names: names.to_vec(),
        unread,
        north_east_down,
        separator,
        line: 0,
    })
}

/// Reads a time in seconds. If the unit is unknown, integers with at least 15 digits are microseconds, and with at
/// least 18 digits nanoseconds.
pub(crate) fn seconds_of(word: &str, unit: Option<f64>) -> Option<f64> {
    if let Ok(whole) = word.parse::<u64>() {
        let per_second: u64 = match unit {
            Some(unit) => (1.0 / unit).round() as u64,
            None if word.len() >= 18 => 1_000_000_000,
            None if word.len() >= 15 => 1_000_000,
            None => 1,
        };
        // Whole seconds and the fraction are converted separately, so that fewer digits are lost.
        return Some((whole / per_second) as f64 + (whole % per_second) as f64 / per_second as f64);
    }
    word.parse::<f64>().ok().filter(|value| value.is_finite()).map(|value| value * unit.unwrap_or(1.0))
}

/// Reads the poses, world_from_camera, of the rows below a header.
pub(crate) fn read(text: &str, path: &Path, columns: &NamedColumns) -> Result<Calibration> {
    let mut calibration = Calibration::default();
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, without_comment(line.trim())));
    let below = numbered.filter(|(line, _)| *line > columns.line);
    let rows = below.filter(|(_, line)| !line.is_empty() && !line.starts_with(['#', '%', '/']));
    let mut expected = None;
    for (line, row) in rows {
        let fail = |message: String| FormatError::line(path, line, message);
        let words: Vec<&str> = words_of(row, columns.separator).collect();
        let named = columns.names.len();
        // The last columns of the header may be missing in all rows, if a pose does not need them.
        let may_lack_columns = (columns.end_of_pose()..named).contains(&words.len());
        let expected = *expected.get_or_insert(if may_lack_columns { words.len() } else { named });
        if words.len() != expected {
            let what = match (columns.line, expected == named) {
                (0, _) => "the first row has",
                (_, true) => "the header has",
                (_, false) => "the rows above have",
            };
            return Err(fail(format!("the row has {}, but {what} {expected}", counted(words.len(), "column"))));
        }
        let number = |column: usize| {
            let value = words[column].parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| fail(format!("{:?}; expected a finite number", words[column])))
        };
        let [qw, qx, qy, qz] = columns.quaternion;
        let quaternion = [number(qw)?, number(qx)?, number(qy)?, number(qz)?];
        // If a row does not have as many values as the header has names, the names may be shifted; letters do not
        // specify whether the position or the quaternion is first. The quaternion's length must then be 1.
        let rotation = match expected == named && !columns.has_letters {
            true => Rotation::scaled_quaternion(quaternion),
            false => Rotation::unit_quaternion(quaternion).map(|rotation| (rotation, false)),
        };
        let source =
            if columns.line == 0 { "quaternion in the comment's order" } else { "quaternion in the header's columns" };
        let (rotation, is_scaled) = rotation.map_err(|message| fail(format!("{source}: {message}")))?;
        let [x, y, z] = columns.position;
        let center = DVec3::new(number(x)?, number(y)?, number(z)?);
        let name = match columns.time {
            Some((column, _)) => match columns.nanoseconds.and_then(|column| words[column].parse::<u32>().ok()) {
                Some(nanoseconds) => format!("{}.{nanoseconds:09}", words[column]),
                None => words[column].to_owned(),
            },
            None => format!("{:06}", calibration.records.len()),
        };
        if is_scaled {
            calibration.note_about(NoticeCode::Implausible, format!("pose {name}"), SCALED_QUATERNION);
        }
        let mut record = CameraRecord::new(name, PixelCenter::Integer);
        if let Some((column, unit)) = columns.time {
            let seconds = seconds_of(words[column], unit);
            let seconds = seconds.ok_or_else(|| fail(format!("{:?}; expected a time", words[column])))?;
            let fraction = columns.nanoseconds.map_or(Ok(0.0), number)?;
            record.time = Some(seconds + fraction * 1e-9);
        }
        record.pose = Some(Pose::world_from_camera(rotation, center));
        calibration.records.push(record);
    }
    let missing = expected.map_or(&[][..], |expected| &columns.names[expected..]);
    if !missing.is_empty() {
        let names = missing.join(", ");
        calibration.note(NoticeCode::MissingValue, format!("the header names columns that the rows lack: {names}"));
    }
    let unread: Vec<&str> =
        columns.unread.iter().map(String::as_str).filter(|name| !missing.iter().any(|other| other == name)).collect();
    if !unread.is_empty() {
        calibration.note(NoticeCode::IgnoredKey, format!("ignored columns: {}", unread.join(", ")));
    }
    let units = columns.position.iter().filter_map(|column| length_unit(&columns.names[*column]));
    if let Some(unit) = units.filter_map(LengthUnit::other_than_metres).next() {
        let message = format!("the header specifies positions in {unit}; they are not converted to metres");
        calibration.note(NoticeCode::PlacedCameras, message);
    }
    if columns.north_east_down {
        calibration
            .note(NoticeCode::PlacedCameras, "the header names north, east, down; the world's z axis points down");
    }
    Ok(calibration)
}

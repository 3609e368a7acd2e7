//! Tables of cameras with a header, `name,fx,fy,cx,cy,width,height`, as a tree: a list with a map for each row.

use crate::document::{DocumentNode, Value};

/// Names of which a table of cameras has at least one.
const FOCAL_NAMES: [&str; 5] = ["fx", "fl_x", "focal_x", "focal_length_x", "focal_length"];

/// Parses a table; `None` for a text whose first line is not the header of a table of cameras, or whose rows differ in
/// length from the header.
pub(crate) fn parse(text: &str) -> Option<DocumentNode> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim).enumerate();
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with(['#', '%']));
    let (_, header) = lines.next()?;
    let separator = [',', ';', '\t'].into_iter().find(|separator| header.contains(*separator))?;
    let cells = |line: &str| -> Vec<String> {
        line.split(separator).map(|cell| cell.trim().trim_matches('"').to_owned()).collect()
    };
    let names = cells(header);
    let own = |name: &String| name.split(['[', '(']).next().unwrap_or_default().trim().to_lowercase();
    if !names.iter().any(|name| FOCAL_NAMES.iter().any(|focal| own(name).starts_with(focal))) {
        return None;
    }
    let is_number = |cell: &String| cell.parse::<f64>().is_ok();
    let mut rows = Vec::new();
    for (i, line) in lines {
        let row = cells(line);
        if row.len() != names.len() || rows.is_empty() && !row.iter().any(is_number) {
            return None;
        }
        let scalar = |value: String| DocumentNode { value: Value::Scalar(value), line: i + 1 };
        let entries = names.iter().cloned().zip(row.into_iter().map(scalar)).collect();
        rows.push(DocumentNode { value: Value::Map(entries), line: i + 1 });
    }
    (!rows.is_empty()).then_some(DocumentNode { value: Value::List(rows), line: 1 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_table_become_maps_with_the_names_of_the_header() {
        let node = parse("# cameras\nname; fx [px]; \"fy\"\nfront; 500; 510\n").unwrap();
        let Value::List(rows) = node.value else { panic!() };
        let Value::Map(entries) = &rows[0].value else { panic!() };
        let found: Vec<_> = entries.iter().map(|(key, node)| (key.as_str(), &node.value, node.line)).collect();
        let scalar = |text: &str| Value::Scalar(text.into());
        let expected = [("name", scalar("front")), ("fx [px]", scalar("500")), ("fy", scalar("510"))];
        assert!(found.iter().zip(&expected).all(|(a, b)| a.0 == b.0 && *a.1 == b.1 && a.2 == 3), "{found:?}");
    }

    #[test]
    fn texts_without_a_focal_length_or_with_uneven_rows_are_not_tables() {
        for text in ["a,b\n1,2\n", "fx,fy\n1,2,3\n", "fx,fy\n", "500,510\n1,2\n", ""] {
            assert_eq!(parse(text), None, "{text:?}");
        }
    }
}

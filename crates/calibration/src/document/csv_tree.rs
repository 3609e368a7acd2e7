//! Tables of cameras with a header, `name,fx,fy,cx,cy,width,height`, as a tree: a list with a map for each row.

use crate::document::number_lines::data_lines;
use crate::document::{DocumentNode, Value};

/// Parses a table; `None` for a text whose first line contains no name for which `is_focal_length` returns true, or whose
/// rows differ in length from the header.
pub(crate) fn parse(text: &str, is_focal_length: impl Fn(&str) -> bool) -> Option<DocumentNode> {
    let mut lines = data_lines(text);
    let (_, header) = lines.next()?;
    let separator = [',', ';', '\t'].into_iter().find(|separator| header.contains(*separator))?;
    let cells = |line: &str| -> Vec<String> {
        line.split(separator).map(|cell| cell.trim().trim_matches('"').to_owned()).collect()
    };
    let names = cells(header);
    if !names.iter().any(|name| is_focal_length(name)) {
        return None;
    }
    let is_number = |cell: &String| cell.parse::<f64>().is_ok();
    let mut rows = Vec::new();
    for (number, line) in lines {
        let row = cells(line);
        if row.len() != names.len() || rows.is_empty() && !row.iter().any(is_number) {
            return None;
        }
        let scalar = |value: String| DocumentNode { value: Value::Scalar(value), line: number };
        let entries = names.iter().cloned().zip(row.into_iter().map(scalar)).collect();
        rows.push(DocumentNode { value: Value::Map(entries), line: number });
    }
    (!rows.is_empty()).then_some(DocumentNode { value: Value::List(rows), line: 1 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_table_become_maps_with_the_names_of_the_header() {
        let node = parse("# cameras\nname; fx [px]; \"fy\"\nfront; 500; 510\n", |name| name == "fy").unwrap();
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
            assert_eq!(parse(text, |name| name == "fx"), None, "{text:?}");
        }
    }
}

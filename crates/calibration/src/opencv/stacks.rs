//! Calibrations as stacked arrays, as `np.savez` writes them: K [n, 3, 3] (or one K for all cameras), P [n, 3, 4], poses
//! [n, 4, 4], coefficients [n, 5]. A document with such arrays becomes a list of n maps, one for each camera.

use crate::document::lens_keys::plain;
use crate::document::{DocumentNode, Value};
use crate::opencv::{keys, projection};

/// Maximum number of copied nodes. Values that are not stacked are copied to each camera.
const MAX_COPIED_NODES: usize = 1 << 20;

/// Splits a document with stacked arrays into a list with a map for each camera; returns other documents unchanged.
///
/// # Errors
/// The reason if the document contains stacks of matrices of different lengths.
pub(super) fn unstack(node: DocumentNode) -> Result<DocumentNode, String> {
    let Value::Map(entries) = &node.value else { return Ok(node) };
    let Some(count) = stack_length(entries) else { return Ok(node) };
    for (key, value) in entries {
        if let [other, 3 | 4, 3 | 4] = shape(value)[..]
            && other != count
        {
            return Err(format!("{key} contains {other} matrices, but the file has {count} cameras; expected {count}"));
        }
    }
    let shared = entries.iter().filter(|(key, value)| !is_stacked(key, value, count));
    if shared.map(|(_, value)| node_count(value)).sum::<usize>().saturating_mul(count) > MAX_COPIED_NODES {
        return Ok(node);
    }
    let camera = |i: usize| {
        let own = |(key, value): &(String, DocumentNode)| (key.clone(), part(key, value, count, i).clone());
        DocumentNode { value: Value::Map(entries.iter().map(own).collect()), line: node.line }
    };
    Ok(DocumentNode { value: Value::List((0..count).map(camera).collect()), line: node.line })
}

/// Number of cameras in the stack of K or P or, next to a single K, in the stack of poses; `None` without a stack.
fn stack_length(entries: &[(String, DocumentNode)]) -> Option<usize> {
    let is_k = |key: &str| keys::is_camera_matrix(key);
    let of_matrix = |(key, node): &(String, DocumentNode)| match shape(node)[..] {
        [count, 3, 3] | [count, 4, 4] if is_k(key) => Some(count),
        [count, 3, 4] if projection::is_key(key) => Some(count),
        _ => None,
    };
    let of_poses = |(_, node): &(String, DocumentNode)| match shape(node)[..] {
        [count, 3 | 4, 4] => Some(count),
        _ => None,
    };
    let has_k = entries.iter().any(|(key, node)| is_k(key) && matches!(shape(node)[..], [3 | 4, 3 | 4]));
    entries.iter().find_map(of_matrix).or_else(|| entries.iter().filter(|_| has_k).find_map(of_poses))
}

/// The value of camera `i`: its part of a stack, or the whole value if it is not stacked.
fn part<'a>(key: &str, node: &'a DocumentNode, count: usize, i: usize) -> &'a DocumentNode {
    match &node.value {
        Value::List(items) if is_stacked(key, node, count) => &items[i],
        _ => node,
    }
}

/// True for a value with a part for each of `count` cameras. A single matrix K or R with `count` rows is not stacked.
fn is_stacked(key: &str, node: &DocumentNode, count: usize) -> bool {
    let single = keys::is_camera_matrix(key) || keys::R.contains(&&plain(key)[..]);
    match shape(node)[..] {
        [first, _, _] => first == count,
        [first, inner] => first == count && inner > 1 && !single,
        _ => false,
    }
}

/// Number of nodes of a value.
fn node_count(node: &DocumentNode) -> usize {
    match &node.value {
        Value::Scalar(_) => 1,
        Value::List(items) => 1 + items.iter().map(node_count).sum::<usize>(),
        Value::Map(entries) => 1 + entries.iter().map(|(_, value)| node_count(value)).sum::<usize>(),
    }
}

/// Lengths of the nested lists, along the first items.
fn shape(node: &DocumentNode) -> Vec<usize> {
    let mut sides = Vec::new();
    let mut node = Some(node);
    while let Some(DocumentNode { value: Value::List(items), .. }) = node {
        sides.push(items.len());
        node = items.first();
    }
    sides
}

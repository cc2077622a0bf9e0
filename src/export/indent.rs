//! Indentation of text formats, whose depth is limited.

/// The largest number of levels by which lines are indented. Without it the size of a file would be
/// quadratic in the depth of its nodes.
const DEEPEST: usize = 40;

/// Begins a line: adds one `unit` for each level, up to 40 levels.
pub(super) fn indent(out: &mut String, unit: &str, levels: usize) {
    out.extend(std::iter::repeat_n(unit, levels.min(DEEPEST)));
}

//! Text of USD: lines with indents, tuples and lists.

use std::fmt::{Display, Write};

use glam::DAffine3;
use ivcam_base::work::until_stopped;

use crate::export::indent::indent;

/// A text that is indented by the depth of its blocks.
#[derive(Debug, Default)]
pub(super) struct UsdText {
    pub text: String,
    depth: usize,
}

impl UsdText {
    /// A text inside some blocks.
    pub(super) fn inside(depth: usize) -> Self {
        Self {
            text: String::new(),
            depth,
        }
    }

    /// Adds a line.
    pub(super) fn line(&mut self, line: impl Display) {
        indent(&mut self.text, "    ", self.depth);
        let _ = writeln!(self.text, "{line}");
    }

    /// Opens a block after a line.
    pub(super) fn open(&mut self, line: impl Display) {
        self.line(line);
        self.line("{");
        self.depth += 1;
    }

    /// Closes the last block.
    pub(super) fn close(&mut self) {
        self.depth = self.depth.saturating_sub(1);
        self.line("}");
    }
}

/// A tuple of numbers: `(1, 2, 3)`.
pub(super) fn tuple<const N: usize>(numbers: [f32; N]) -> String {
    format!("({})", joined(&numbers))
}

/// A list of tuples.
pub(super) fn tuples<const N: usize>(list: impl Iterator<Item = [f32; N]>) -> String {
    let mut out = String::from("[");
    for (i, numbers) in until_stopped(list).enumerate() {
        let comma = if i > 0 { ", " } else { "" };
        let _ = write!(out, "{comma}({})", joined(&numbers));
    }
    out.push(']');
    out
}

/// A list of numbers.
pub(super) fn numbers<T: Display>(list: &[T]) -> String {
    format!("[{}]", joined(list))
}

fn joined<T: Display>(list: &[T]) -> String {
    let mut out = String::new();
    for (i, number) in until_stopped(list.iter()).enumerate() {
        let comma = if i > 0 { ", " } else { "" };
        let _ = write!(out, "{comma}{number}");
    }
    out
}

/// A matrix, which USD applies to row vectors.
pub(super) fn matrix(m: &DAffine3) -> String {
    let row = |v: glam::DVec3, w: u8| format!("({}, {}, {}, {w})", v.x, v.y, v.z);
    format!(
        "({}, {}, {}, {})",
        row(m.matrix3.x_axis, 0),
        row(m.matrix3.y_axis, 0),
        row(m.matrix3.z_axis, 0),
        row(m.translation, 1)
    )
}

/// The path of a file. One that contains `@` is between `@@@`.
pub(super) fn asset(path: &str) -> String {
    let path: String = path.chars().filter(|c| !c.is_control()).collect();
    if path.contains('@') {
        format!("@@@{}@@@", path.replace("@@@", "\\@@@"))
    } else {
        format!("@{path}@")
    }
}

/// A quoted string.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\n' | '\r' => out.push(' '),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_files_may_contain_the_sign_that_ends_them() {
        assert_eq!(asset("./a-1.png"), "@./a-1.png@");
        assert_eq!(asset("./a@b\n-1.png"), "@@@./a@b-1.png@@@");
        assert_eq!(asset("./a@@@b.png"), "@@@./a\\@@@b.png@@@");
    }
}

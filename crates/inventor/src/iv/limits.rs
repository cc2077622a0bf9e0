//! Limits on the size of scenes, which protect against hostile and damaged files.

use ivcam_base::diag::{Diagnostic, ErrorKind, Sink, Span};
use ivcam_base::work::{Budget, Cut};

/// Limits on the size of a scene and of its files. What exceeds a limit is reported and left out,
/// or reading fails with a message that names the limit.
///
/// The defaults bound memory and time. A picture of cubes in one place, at 300,000 visits, took
/// 3.5 s (docs/decisions/0005-who-builds-the-tree.md), and one with 16 million triangles 2.8 GB
/// (docs/decisions/0027-nurbs-by-pixels.md). No search for the other limits is recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The size in bytes of one file after decompression, of the files that a document includes
    /// together, and of the lists that expanding protos copies. Default: 512 MiB.
    pub bytes: usize,
    /// The number of nodes of a document, with the files that it includes. Default: 10 million.
    pub nodes: usize,
    /// The number of nodes that expanding protos creates. Default: 1 million.
    pub copies: usize,
    /// The nesting depth of nodes. Default: 1 million.
    pub depth: usize,
    /// The nesting depth of included files. Default: 32.
    pub include_depth: usize,
    /// The number of files that a document includes. Default: 1,000.
    pub files: usize,
    /// The number of nodes that a traversal of the scene visits. A node counts once for each use.
    /// Default: 300,000, or twice the number of nodes of the document if that is more.
    pub visits: usize,
    /// The number of triangles, quadrics and strokes. Default: 16 million, which take less than
    /// 3 GB.
    pub primitives: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            bytes: 512 << 20,
            nodes: 10_000_000,
            copies: 1_000_000,
            depth: 1_000_000,
            include_depth: 32,
            files: 1_000,
            visits: 300_000,
            primitives: 16_000_000,
        }
    }
}

impl Limits {
    /// The names that [`Self::set`] accepts.
    pub const NAMES: [&'static str; 8] = [
        "bytes",
        "nodes",
        "copies",
        "depth",
        "include-depth",
        "files",
        "visits",
        "primitives",
    ];

    /// Returns every limit with its name.
    pub fn entries(&self) -> [(&'static str, usize); 8] {
        let values = [
            self.bytes,
            self.nodes,
            self.copies,
            self.depth,
            self.include_depth,
            self.files,
            self.visits,
            self.primitives,
        ];
        std::array::from_fn(|i| (Self::NAMES[i], values[i]))
    }

    /// Sets a limit from text such as `bytes=2G` or `visits=100000`. The suffixes k, M and G mean
    /// powers of 1024. Returns `None` if the text is not a limit.
    pub fn set(&mut self, word: &str) -> Option<()> {
        let (name, value) = word.split_once('=')?;
        let (digits, power) = match value.trim_end_matches(|c: char| c.is_ascii_alphabetic()) {
            digits if digits.len() == value.len() => (digits, 0),
            digits => match &value[digits.len()..] {
                "k" | "K" | "KiB" => (digits, 10),
                "M" | "MiB" => (digits, 20),
                "G" | "GiB" => (digits, 30),
                _ => return None,
            },
        };
        let value = digits.parse::<usize>().ok()?.checked_mul(1 << power)?;
        let limit = match name {
            "bytes" => &mut self.bytes,
            "nodes" => &mut self.nodes,
            "copies" => &mut self.copies,
            "depth" => &mut self.depth,
            "include-depth" => &mut self.include_depth,
            "files" => &mut self.files,
            "visits" => &mut self.visits,
            "primitives" => &mut self.primitives,
            _ => return None,
        };
        *limit = value;
        Some(())
    }
}

/// Creates the error that reading reached a limit at a place in the current source. `limit` is its
/// name in [`Limits::NAMES`].
pub(super) fn beyond(sink: &Sink, span: Span, message: String, limit: &str) -> Box<Diagnostic> {
    let help =
        format!("`--scene-limit {limit}=N` raises this, if the scene is meant to be that big");
    sink.error(span, message)
        .of_kind(ErrorKind::Limit)
        .with_help(help)
}

/// Creates the error that the account of the scene cut reading at a place in the current source.
pub(super) fn cut_at(sink: &Sink, span: Span, cut: Cut) -> Box<Diagnostic> {
    let refusal = Budget::current().refusal(cut);
    let error = sink.error(span, refusal.message).of_kind(ErrorKind::Limit);
    match refusal.help {
        Some(help) => error.with_help(help),
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_limit_can_be_set_by_its_name() {
        let mut limits = Limits::default();
        for name in Limits::NAMES {
            assert_eq!(limits.set(&format!("{name}=7")), Some(()), "{name}");
            let mut changed = limits.entries().into_iter().filter(|(_, n)| *n == 7);
            assert_eq!(changed.next().map(|(name, _)| name), Some(name));
            limits = Limits::default();
        }
        assert_eq!(limits.set("visits=7"), Some(()));
        assert_eq!(limits.set("bytes=2M"), Some(()));
        assert_eq!((limits.bytes, limits.visits), (2 << 20, 7));
        assert_eq!(limits.set("bytes=lots"), None);
        assert_eq!(limits.set("bites=1"), None);
    }
}

//! What a file is: its first line, and the gzip around it.
//!
//! The header decides the format, never the extension.

use std::io::Read;

use crate::diag::{Diagnostic, Result};
use crate::grammar::Dialect;
use crate::iv::limits::Limits;

/// The first line of a file, understood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// The classes to look names up in first: bits of [`Dialect`].
    pub dialect: u8,
    pub version: (u8, u8),
    pub binary: bool,
    /// The header's words, such as `Inventor V2.1 ascii`.
    pub words: String,
    /// Bytes up to and with the end of the line.
    pub length: usize,
}

impl Header {
    /// What a `.dat` or `.env` file without a header is taken for.
    pub fn ascii_2_1() -> Self {
        Self {
            dialect: Dialect::IV2 | Dialect::COIN,
            version: (2, 1),
            binary: false,
            words: "Inventor V2.1 ascii".into(),
            length: 0,
        }
    }

    pub fn is_vrml97(&self) -> bool {
        self.dialect == Dialect::VRML97
    }

    /// Reads the first line. `Err` says what the file begins with instead.
    pub fn parse(bytes: &[u8], name: &str) -> Result<Self> {
        let skipped = usize::from(bytes.starts_with(b"\xef\xbb\xbf")) * 3;
        let blank = bytes[skipped..]
            .iter()
            .take_while(|b| b.is_ascii_whitespace())
            .count();
        let start = skipped + blank;
        let line = &bytes[start..];
        let end = line
            .iter()
            .position(|b| matches!(b, b'\n' | b'\r'))
            .unwrap_or(line.len());
        let text = String::from_utf8_lossy(&line[..end.min(200)]).into_owned();
        let words: Vec<&str> = text.trim_start_matches('#').split_whitespace().collect();
        let found = text.starts_with('#').then(|| match words.as_slice() {
            ["Inventor", "V1.0", kind, ..] => known(Dialect::IV1, (1, 0), kind),
            ["Inventor", "V2.0", kind, ..] => known(Dialect::IV2, (2, 0), kind),
            ["Inventor", _, kind, ..] => known(Dialect::IV2, (2, 1), kind),
            ["VRML", "V1.0", kind, ..] => known(Dialect::VRML1, (1, 0), kind),
            ["VRML", "V2.0", kind, ..] => known(Dialect::VRML97, (2, 0), kind),
            _ => None,
        });
        let Some(Some((dialect, version, binary))) = found else {
            return Err(wrong(name, &text));
        };
        let newline = line[end..]
            .iter()
            .take_while(|b| matches!(b, b'\n' | b'\r'));
        let newline = if binary {
            newline.take(1).count()
        } else {
            newline.count().min(1)
        };
        Ok(Self {
            dialect,
            version,
            binary,
            words: words[..3].join(" "),
            length: start + end + newline,
        })
    }
}

fn known(dialect: u8, version: (u8, u8), kind: &str) -> Option<(u8, (u8, u8), bool)> {
    match kind {
        "ascii" | "utf8" => Some((dialect, version, false)),
        "binary" => Some((dialect, version, true)),
        _ => None,
    }
}

fn wrong(name: &str, text: &str) -> Box<Diagnostic> {
    let begins: String = text
        .chars()
        .take(40)
        .map(|c| if c.is_control() { '?' } else { c })
        .collect();
    let message =
        format!("`{name}` is neither an Inventor nor a VRML file: it begins with `{begins}`");
    let help = if text.starts_with("#X3D") || text.starts_with("<?xml") {
        "X3D is not read; most tools that write it can write VRML97 too"
    } else {
        "the first line should be `#Inventor V2.1 ascii`, `#VRML V2.0 utf8` or one of their kin"
    };
    Diagnostic::error(message).in_file(name).with_help(help)
}

/// Unpacks gzip, as long as what comes out stays within the limit.
pub fn unpack(bytes: Vec<u8>, name: &str, limits: &Limits) -> Result<Vec<u8>> {
    let too_big = |n: usize| {
        Diagnostic::error(format!("`{name}` is larger than {n} bytes"))
            .in_file(name)
            .with_help("`--scene-limit bytes=N` raises this, if the file is meant to be that big")
    };
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return if bytes.len() > limits.bytes {
            Err(too_big(limits.bytes))
        } else {
            Ok(bytes)
        };
    }
    let mut out = Vec::new();
    let read = flate2::read::MultiGzDecoder::new(bytes.as_slice())
        .take(limits.bytes as u64 + 1)
        .read_to_end(&mut out);
    match read {
        Ok(_) if out.len() > limits.bytes => Err(too_big(limits.bytes)),
        Ok(_) => Ok(out),
        // A truncated archive still has its beginning; the reader says where that ends.
        Err(_) if !out.is_empty() => Ok(out),
        Err(error) => {
            Err(Diagnostic::error(format!("`{name}` cannot be unpacked: {error}")).in_file(name))
        }
    }
}

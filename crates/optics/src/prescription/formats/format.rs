//! The description of a file format of prescriptions: how it is recognized, and its reader.

use ivcam_base::diag::{Result, Sink};

use crate::prescription::formats::reader::PrescriptionReader;
use crate::prescription::glass::catalogue::Catalogue;
use crate::prescription::prescription::Prescription;
use crate::prescription::text;

/// A file format of prescriptions.
pub(crate) struct PrescriptionFormat {
    /// The name in messages.
    #[cfg_attr(
        not(test),
        expect(dead_code, reason = "tests ask which format was recognized")
    )]
    pub name: &'static str,
    /// Whether a text is in this format, judged by its content.
    pub recognizes: fn(&str) -> bool,
    /// Reads a file in this format. What is wrong but not fatal goes to the sink.
    pub read: fn(PrescriptionReader<'_>, &mut Sink) -> Result<Prescription>,
}

/// Options of reading that a file does not state.
#[derive(Clone, Debug, Default)]
pub struct Reading {
    /// The glasses that a file may name beside the built-in ones.
    pub glasses: Catalogue,
    /// In tables of four columns: the meaning of the second. None: the file's evidence decides.
    pub gap: Option<Gap>,
    /// Whether lengths stay as the file has them. Otherwise a lens whose file states a nominal
    /// focal length (`# nominal: 28 mm`) is scaled to it.
    pub as_published: bool,
}

/// The meaning of the column of gaps in a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gap {
    /// The distance to the next vertex (pbrt).
    Next,
    /// The distance from the vertex before (the older files of Kolb and CS348b).
    Previous,
    /// The position of the vertex on the axis.
    Position,
}

impl Gap {
    /// The meanings with the words of the command line.
    pub const ALL: [(&'static str, Self); 3] = [
        ("next", Self::Next),
        ("previous", Self::Previous),
        ("position", Self::Position),
    ];

    /// The word of the command line.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].0
    }

    /// The meaning in words.
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Self::Next => "the distance to the next vertex",
            Self::Previous => "the distance from the vertex before",
            Self::Position => "the position of the vertex on the axis",
        }
    }
}

/// The first word outside comments, in capitals; empty if there is none.
pub(super) fn first_word(text: &str) -> String {
    text::lines(text)
        .find_map(|(start, line)| {
            let words = text::words(line.split(['#', '!']).next().unwrap_or(""), start);
            let first = words.first()?.text.split(';').next()?;
            Some(first.to_ascii_uppercase())
        })
        .unwrap_or_default()
}

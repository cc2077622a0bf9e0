//! The description of a file format of prescriptions: how it is recognized, and its reader.

use ivcam_base::diag::{Result, Sink};

use crate::prescription::formats::reader::PrescriptionReader;
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

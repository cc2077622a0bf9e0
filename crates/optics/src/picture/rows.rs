//! Pictures as a heading and a source of rows, which are made while they are written.

use std::borrow::Cow;
use std::io::Write;

use indexmap::IndexMap;
use ivcam_base::files::WriteSeek;

use super::developed::{Depth, Picture, levels};
use crate::film::{Resolution, Response};

/// Rows that a [`RowSource`] returns at once are a multiple of this, except for the last ones. It
/// is the height of the blocks in which OpenEXR compresses.
pub const ROWS: u32 = 16;

/// The length of the text of a late entry, in formats that have it before the pixels. A longer
/// text is cut off.
pub(super) const LATE_LENGTH: usize = 240;

/// What is known of a picture before its pixels.
#[derive(Clone, Debug)]
pub struct Heading {
    /// The size of the picture.
    pub resolution: Resolution,
    /// The response that levels in integer formats are computed with.
    pub response: Response,
    /// The provenance, without the late entry.
    pub provenance: IndexMap<String, String>,
    /// The key of an entry whose value is known only after the last row, if there is one.
    pub late: Option<&'static str>,
}

/// Makes the rows of a picture, from the top.
pub trait RowSource {
    /// Returns further whole rows, a multiple of [`ROWS`] of them or the last ones; nothing after
    /// the last row.
    ///
    /// # Errors
    /// Fails if the rows cannot be made.
    fn next_rows(&mut self) -> std::io::Result<Option<Cow<'_, [[f32; 3]]>>>;

    /// Returns the value of the late entry. It is called after the last row.
    fn late(&self) -> String;
}

impl Heading {
    /// Returns the provenance with a placeholder for the late entry.
    pub(super) fn with_placeholder(&self) -> IndexMap<String, String> {
        let mut provenance = self.provenance.clone();
        if let Some(key) = self.late {
            provenance.insert(key.to_owned(), " ".repeat(LATE_LENGTH));
        }
        provenance
    }
}

/// Returns the beginning of a late entry that its place has room for.
pub(super) fn cut_off(late: &str) -> &str {
    let mut length = late.len().min(LATE_LENGTH);
    while !late.is_char_boundary(length) {
        length -= 1;
    }
    &late[..length]
}

/// Replaces the placeholder of the late entry, or its beginning. `head` is the beginning of the
/// file, and `start` the bytes that are in front of what is replaced.
pub(super) fn fill_placeholder(
    file: &mut dyn WriteSeek,
    head: &[u8],
    start: &[u8],
    late: &[u8],
) -> std::io::Result<()> {
    let missing = || std::io::Error::other("the late entry has no place in the file");
    let found = head.windows(start.len()).position(|bytes| bytes == start);
    let at = found.ok_or_else(missing)? + start.len();
    let end = file.stream_position()?;
    file.seek(std::io::SeekFrom::Start(at as u64))?;
    file.write_all(late)?;
    file.seek(std::io::SeekFrom::Start(end)).map(|_| ())
}

/// Writes the levels of all pixels, row by row.
pub(super) fn write_levels(
    heading: &Heading,
    depth: Depth,
    rows: &mut dyn RowSource,
    to: &mut dyn Write,
) -> std::io::Result<()> {
    while let Some(pixels) = rows.next_rows()? {
        for part in pixels.chunks((ROWS * heading.resolution.width) as usize) {
            to.write_all(&levels(part, &heading.response, depth))?;
        }
    }
    Ok(())
}

/// The rows of a picture that is in memory.
pub(super) struct PictureRows<'a>(Option<&'a Picture>);

impl<'a> PictureRows<'a> {
    /// Returns the picture's heading and its rows.
    pub(super) fn of(picture: &'a Picture) -> (Heading, Self) {
        let heading = Heading {
            resolution: Resolution::of(picture.width, picture.height),
            response: picture.response.clone(),
            provenance: picture.provenance.clone(),
            late: None,
        };
        (heading, Self(Some(picture)))
    }
}

impl RowSource for PictureRows<'_> {
    fn next_rows(&mut self) -> std::io::Result<Option<Cow<'_, [[f32; 3]]>>> {
        Ok(self.0.take().map(|picture| Cow::Borrowed(&*picture.pixels)))
    }

    fn late(&self) -> String {
        String::new()
    }
}

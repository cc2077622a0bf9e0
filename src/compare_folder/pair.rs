//! Compares one pair.

use ivcam_base::diag::{Diagnostic, Result};

use super::entry::PairEntry;
use super::files::PictureFile;
use super::options::FolderOptions;
use super::pairing::{FilePair, PairedBy};
use super::pictures;
use crate::compare::{Options, Plate, Registration, compare};

/// Compares a pair and writes its pictures. A pair that cannot be compared has the reason in its
/// entry. One pair is in memory at a time.
pub(super) fn entry(
    options: &FolderOptions,
    pair: &FilePair,
    new: &PictureFile,
    old: &PictureFile,
) -> PairEntry {
    let mut entry = PairEntry::of(pair, new, old);
    if let Err(error) = fill(&mut entry, options, new, old) {
        set_error(&mut entry, &error);
    }
    entry
}

/// Writes an error into the entry of its pair.
pub(super) fn set_error(entry: &mut PairEntry, error: &Diagnostic) {
    entry.comparison = None;
    entry.pictures = None;
    entry.measures.clear();
    entry.error = Some(error.message.clone());
    entry.help.clone_from(&error.help);
}

fn fill(
    entry: &mut PairEntry,
    options: &FolderOptions,
    new: &PictureFile,
    old: &PictureFile,
) -> Result<()> {
    let (new_plate, old_plate) = (Plate::open(&new.path)?, Plate::open(&old.path)?);
    let is_same_size = (new_plate.width, new_plate.height) == (old_plate.width, old_plate.height);
    let registration = match options.registration {
        // What paired them is their alignment.
        _ if entry.paired_by == PairedBy::Picture => Registration::Align,
        Some(registration) => registration,
        None if is_same_size => Registration::None,
        None => Registration::Align,
    };
    entry.registration = match registration {
        Registration::Align => "align",
        Registration::Resize if !is_same_size => "resize",
        _ => "none",
    }
    .to_owned();
    let comparison = compare(
        &new_plate,
        &old_plate,
        &Options {
            registration,
            matching: options.matching,
            mask: options
                .selection
                .of((new_plate.width, new_plate.height), &new.name)?,
            pixels_per_degree: options.pixels_per_degree,
        },
    )?;
    drop((new_plate, old_plate));
    entry.measures = PairEntry::values_of(&comparison.measures);
    entry.pictures = Some(pictures::write(&comparison, &options.out, &new.name)?);
    let json = serde_json::to_value(&comparison);
    let json = json.map_err(|e| Diagnostic::error(format!("the result has no JSON: {e}")))?;
    entry.comparison = Some(json);
    Ok(())
}

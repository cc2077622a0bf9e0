//! Adds the parts of a picture that checkpoints hold, made anywhere in any order.
//!
//! Parts have other samples of the same pixels, or other regions with the same samples. The sum of
//! all has the bits of one render.

use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::film::Region;
use ivcam_render::render::PicturePlace;

use super::checkpoint::{Checkpoint, Label};

/// A part that is not in memory.
struct PicturePart<'p> {
    path: &'p Path,
    label: Label,
    place: PicturePlace,
}

/// Adds the parts of a picture.
///
/// # Errors
/// Fails if a file cannot be read, if the parts are not of one picture, or if they overlap or leave
/// gaps. A single one may be unfinished.
pub(crate) fn merge(paths: &[PathBuf]) -> Result<Checkpoint> {
    if let [path] = paths {
        return Checkpoint::read(path);
    }
    let mut parts = Vec::new();
    for path in paths {
        let Checkpoint { label, sums } = Checkpoint::read(path)?;
        let place = sums.place;
        parts.push(PicturePart { path, label, place });
    }
    let key = |part: &PicturePart<'_>| {
        let PicturePlace { region, first, .. } = part.place;
        (region.top, region.left, first)
    };
    check_parts(&parts)?;
    parts.sort_by_key(key);
    let mut regions: Vec<(&PicturePart<'_>, Checkpoint)> = Vec::new();
    for column in parts.chunk_by(|a, b| a.place.region == b.place.region) {
        check_samples(column)?;
        let mut whole = Checkpoint::read(column[0].path)?;
        for part in &column[1..] {
            whole.sums.append(Checkpoint::read(part.path)?.sums);
        }
        regions.push((&column[0], whole));
    }
    let whole = check_regions(&regions)?;
    let mut regions = regions.into_iter().map(|(_, checkpoint)| checkpoint);
    let Some(mut first) = regions.next() else {
        return Err(Diagnostic::error("there is nothing to merge"));
    };
    match whole == Region::whole(first.sums.place.picture) {
        true => first.label.described.shift_remove("region"),
        false => first
            .label
            .described
            .insert("region".into(), whole.to_string()),
    };
    if first.sums.place.region == whole {
        return Ok(first);
    }
    let mut sums = first.sums.on(whole);
    regions.for_each(|part| sums.lay(&part.sums));
    Ok(Checkpoint {
        label: first.label,
        sums,
    })
}

/// Checks that all parts are finished parts of the picture of the first.
fn check_parts(parts: &[PicturePart<'_>]) -> Result<()> {
    for part in parts {
        let path = part.path.display();
        let places = ["in the first", "in the second"];
        let differences = parts[0].label.differences(&part.label, places);
        if !differences.is_empty() || part.place.picture != parts[0].place.picture {
            let first = parts[0].path.display();
            let differences = differences.join("; ");
            let error =
                format!("`{first}` and `{path}` are parts of different pictures: {differences}");
            return Err(
                Diagnostic::error(error).with_help("merge parts of the same scene and options")
            );
        }
        if !part.place.is_even() {
            let error = format!("`{path}` is unfinished: not all pixels have the same samples");
            let help = "run its command again, which continues it";
            return Err(Diagnostic::error(error).with_help(help));
        }
    }
    Ok(())
}

/// Checks that the samples of parts of one region follow each other.
fn check_samples(parts: &[PicturePart<'_>]) -> Result<()> {
    for pair in parts.windows(2) {
        let [a, b] = [&pair[0], &pair[1]];
        let (end, start) = (a.place.done, b.place.first);
        let names = format!("`{}` and `{}`", a.path.display(), b.path.display());
        if start < end {
            let last = end.min(b.place.done) - 1;
            let error = format!("{names} overlap: both have the samples {start} to {last}");
            return Err(Diagnostic::error(error).with_help("merge each sample once"));
        }
        if start > end {
            let error = format!(
                "the samples {end} to {} are missing between {names}",
                start - 1
            );
            return Err(Diagnostic::error(error).with_help("render them, or finish the first one"));
        }
    }
    Ok(())
}

/// Checks that regions have the same samples, do not overlap, and fill a rectangle. Returns it.
fn check_regions(regions: &[(&PicturePart<'_>, Checkpoint)]) -> Result<Region> {
    let place = |i: usize| &regions[i].1.sums.place;
    let name = |i: usize| regions[i].0.path.display();
    let mut whole = place(0).region;
    let mut pixels = 0;
    for i in 0..regions.len() {
        let (own, first) = (place(i), place(0));
        if (own.first, own.done) != (first.first, first.done) {
            let error = format!(
                "the regions of `{}` and `{}` have other samples: {}..{} and {}..{}",
                name(0),
                name(i),
                first.first,
                first.done,
                own.first,
                own.done
            );
            return Err(Diagnostic::error(error).with_help("give all regions the same samples"));
        }
        if let Some(other) = (0..i).find(|j| place(*j).region.overlaps(own.region)) {
            let error = format!("the regions of `{}` and `{}` overlap", name(other), name(i));
            return Err(Diagnostic::error(error).with_help("merge each pixel once"));
        }
        whole = whole.around(own.region);
        pixels += own.region.resolution().pixels();
    }
    if pixels != whole.resolution().pixels() {
        let error = format!("the regions leave gaps in the rectangle {whole}");
        return Err(Diagnostic::error(error).with_help("render the missing regions"));
    }
    Ok(whole)
}

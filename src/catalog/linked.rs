//! Writes a catalog as linked data: JSON-LD with the vocabulary of schema.org.

use std::path::Path;

use ivcam_base::diag::Result;
use ivcam_base::files::write_whole;
use serde_json::{Value as Json, json};

use super::entry::Entry;
use super::formats::{GZIP, media_type};
use super::heading::CatalogHeading;
use super::links::{joined, original};
use super::numbers::date;
use super::place;

/// Where PRONOM describes a format, before its identifier.
const PRONOM: &str = "https://www.nationalarchives.gov.uk/PRONOM/";

/// Writes `catalog.jsonld`: a `Collection` of `3DModel`s. Addresses are relative to it.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub(super) fn write_linked(out: &Path, heading: &CatalogHeading, entries: &[Entry]) -> Result<()> {
    let mut collection = json!({
        "@context": "https://schema.org/",
        "@type": "Collection",
        "@id": place::PAGE,
        "name": heading.title,
        "collectionSize": entries.len(),
    });
    if let Some(about) = &heading.about {
        collection["description"] = json!(about);
    }
    // The scenes are written one after another, so that they are not all in memory.
    let head = collection.to_string();
    write_whole(&out.join(place::LINKED), |file| {
        write!(file, "{},\"hasPart\":[", &head[..head.len() - 1])?;
        for (i, entry) in entries.iter().enumerate() {
            let comma = if i > 0 { "," } else { "" };
            write!(file, "{comma}\n{}", model(heading, entry))?;
        }
        writeln!(file, "\n]}}")
    })
}

/// Returns a scene. What is not known is left out.
fn model(heading: &CatalogHeading, entry: &Entry) -> Json {
    let address = |path: &String| joined("", path);
    let pronom = entry.pronom.as_ref().map(|id| format!("{PRONOM}{id}"));
    let media = entry
        .format
        .as_deref()
        .and_then(media_type)
        .map(str::to_owned);
    let packed = entry.packed.iter().flat_map(|_| {
        let (id, media) = GZIP;
        [media.to_owned(), format!("{PRONOM}{id}")]
    });
    let formats: Vec<String> = media.into_iter().chain(pronom).chain(packed).collect();
    let all = json!({
        "@type": "3DModel",
        "@id": joined("", &place::scene_page(&entry.file)),
        "name": entry.file,
        "url": joined("", &place::scene_page(&entry.file)),
        "contentUrl": original(&heading.folder, &entry.file),
        "contentSize": entry.bytes.to_string(),
        "sha256": Some(&entry.sha256).filter(|hash| !hash.is_empty()),
        "encodingFormat": formats,
        "dateModified": date(entry.modified),
        "thumbnailUrl": entry.picture.as_ref().map(address),
        "image": entry.large.as_ref().map(address),
        "description": entry.notes.join("\n"),
    });
    let Json::Object(mut all) = all else {
        return all;
    };
    all.retain(|_, value| !value.is_null() && *value != json!("") && *value != json!([]));
    Json::Object(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_a_model_with_what_is_known_of_it() {
        let heading = CatalogHeading {
            folder: "../in".to_owned(),
            ..CatalogHeading::default()
        };
        let entry = Entry {
            file: "a/b c.wrl".to_owned(),
            format: Some("VRML V2.0 utf8".to_owned()),
            pronom: Some("fmt/94".to_owned()),
            bytes: 12,
            ..Entry::default()
        };
        let expected = json!({
            "@type": "3DModel",
            "@id": "scenes/a/b%20c.wrl.html",
            "url": "scenes/a/b%20c.wrl.html",
            "name": "a/b c.wrl",
            "contentUrl": "../in/a/b%20c.wrl",
            "contentSize": "12",
            "encodingFormat": ["model/vrml", "https://www.nationalarchives.gov.uk/PRONOM/fmt/94"],
            "dateModified": "1970-01-01",
        });
        assert_eq!(model(&heading, &entry), expected);
    }
}

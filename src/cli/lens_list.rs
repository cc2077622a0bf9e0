//! The list of the lenses that come with the program, as text or as JSON.

use std::fmt::Write as _;

use ivcam_base::diag::Result;
use ivcam_optics::lens::{About, Lens, shipped_names};

use super::lens_json::{Object, field, pretty};
use super::lens_request::Content;

/// The names of makers that lens files state otherwise.
const MAKERS: [(&str, &str); 2] = [("nikon", "nikkor"), ("pentax", "takumar")];

/// Lists the shipped lenses, by kind.
pub(super) fn list(is_json: bool) -> Result<Content> {
    let mut list = of(&shipped()?, is_json)?;
    if let Content::Text(text) = &mut list
        && !is_json
    {
        text.push_str(
            "\nmany lenses have about 100 mm, as published; `--efl 50mm` scales any of them\n",
        );
    }
    Ok(list)
}

/// Lists the shipped lenses whose name, title, kind or source has a word, if there are any and none
/// has the word as its name.
pub(super) fn named_like(word: &str, is_json: bool) -> Result<Option<Content>> {
    let word = word.to_ascii_lowercase();
    if shipped_names().any(|name| name == word) {
        return Ok(None);
    }
    let maker = MAKERS.iter().find(|(maker, _)| *maker == word);
    let has = |text: &str| {
        let text = text.to_ascii_lowercase();
        text.contains(&word) || maker.is_some_and(|(_, series)| text.contains(series))
    };
    let is_like = |(name, lens): &(&str, Lens)| {
        let about = About::of(lens.prescription());
        let texts = [about.title, about.kind, about.source];
        has(name) || texts.iter().flatten().any(|text| has(text))
    };
    let found: Vec<_> = shipped()?.into_iter().filter(is_like).collect();
    if word.len() < 3 || found.is_empty() {
        return Ok(None);
    }
    of(&found, is_json).map(Some)
}

/// The shipped lenses with their names.
fn shipped() -> Result<Vec<(&'static str, Lens)>> {
    let open = |name| Ok((name, Lens::named(name)?));
    shipped_names().map(open).collect()
}

/// Lists lenses, in the order of their kinds.
fn of(lenses: &[(&str, Lens)], is_json: bool) -> Result<Content> {
    let names = lenses.iter().map(|(name, lens)| (*name, lens));
    if is_json {
        return pretty(
            &names
                .map(|(name, lens)| row(name, lens))
                .collect::<Vec<_>>(),
        );
    }
    let mut text = String::new();
    let mut kind = None;
    for (name, lens) in names {
        let about = About::of(lens.prescription());
        if kind.as_ref() != Some(&about.kind) {
            let gap = if kind.is_some() { "\n" } else { "" };
            let _ = writeln!(text, "{gap}{}", about.kind.as_deref().unwrap_or("other"));
            kind = Some(about.kind.clone());
        }
        let _ = writeln!(text, "{}", line(name, lens, about));
    }
    Ok(Content::Text(text))
}

/// A lens of the list, for JSON.
fn row(name: &str, lens: &Lens) -> Object {
    let about = About::of(lens.prescription());
    Object::from([
        ("name", field(name)),
        ("title", field(about.title)),
        ("kind", field(about.kind)),
        ("year", field(about.year)),
        ("field", field(about.field)),
        ("efl", field(lens.first_order().efl())),
        ("f_number", field(lens.real_f_number())),
        ("source", field(about.source)),
    ])
}

/// A lens of the list, as a line of text.
fn line(name: &str, lens: &Lens, about: About) -> String {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".into());
    let f_number = lens.real_f_number().map_or("-".into(), |n| {
        let digits = if n < 1.0 { 2 } else { 1 };
        format!("f/{n:.digits$}")
    });
    let field = or_dash(about.field).replace(" degrees", "\u{b0}");
    format!(
        "  {name:<19} {:>6.1} mm  {f_number:<6} {field:<12} {:<4}  {} \u{b7} {}",
        lens.first_order().efl(),
        or_dash(about.year),
        or_dash(about.title),
        or_dash(about.source)
    )
}

//! The camera menu: the shipped lenses, each with a small section.

use std::sync::{Arc, OnceLock};

use ivcam_optics::diagram::drawing::{Drawing, DrawingItem};
use ivcam_optics::diagram::{LensDiagram, SectionOptions};
use ivcam_optics::lens::{About, Lens, shipped_names};

/// A lens of the menu.
#[derive(Clone, Debug)]
pub(crate) struct MenuEntry {
    pub name: &'static str,
    pub title: String,
    pub kind: String,
    /// The focal length in millimeters; infinite for an afocal lens.
    pub efl: f64,
    pub f_number: Option<f64>,
    pub section: Drawing,
    /// What a search looks in: all that is known of the lens, in small letters.
    words: String,
}

impl MenuEntry {
    fn of(name: &'static str) -> Option<Self> {
        let lens = Lens::named(name).ok()?;
        let about = About::of(lens.prescription());
        let mut section = LensDiagram::of(&lens, thumbnail()).drawing();
        // Letters would be illegible at this size.
        section
            .items
            .retain(|item| !matches!(item, DrawingItem::Text(_)));
        let mut entry = Self {
            name,
            title: about.title.unwrap_or_else(|| name.to_owned()),
            kind: about.kind.unwrap_or_else(|| "other".into()),
            efl: lens.first_order().efl(),
            f_number: lens.real_f_number(),
            section,
            words: String::new(),
        };
        let stated = [about.year, about.field, about.source];
        let words = [
            name.into(),
            entry.title.clone(),
            entry.kind.clone(),
            entry.numbers(),
        ];
        let words: Vec<String> = words
            .into_iter()
            .chain(stated.into_iter().flatten())
            .collect();
        entry.words = words.join(" ").to_lowercase();
        Some(entry)
    }

    /// Returns whether all words of a search are in what is known of the lens.
    pub(crate) fn matches(&self, search: &str) -> bool {
        let search = search.to_lowercase();
        search
            .split_whitespace()
            .all(|word| self.words.contains(word))
    }

    /// Formats focal length and f-number.
    pub(crate) fn numbers(&self) -> String {
        let efl = if self.efl.is_finite() {
            format!("{:.0} mm", self.efl)
        } else {
            "afocal".into()
        };
        self.f_number
            .map_or(efl.clone(), |n| format!("{efl}  f/{n:.1}"))
    }
}

/// Returns the options of a section without rays, which would be indistinct at this size.
fn thumbnail() -> SectionOptions {
    SectionOptions {
        width: 360.0,
        height: 200.0,
        film_z: None,
        distance: f64::INFINITY,
        fields: Vec::new(),
        rays: 2,
        lost: false,
        marks: false,
    }
}

/// The menu, which a thread of its own prepares.
#[derive(Clone, Default)]
pub(crate) struct LensMenu {
    entries: Arc<OnceLock<Vec<MenuEntry>>>,
}

impl LensMenu {
    /// Starts the thread that prepares the menu; `wake` is called when it is complete.
    pub(crate) fn start(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        let menu = Self::default();
        let entries = menu.entries.clone();
        std::thread::spawn(move || {
            let _ = entries.set(shipped_names().filter_map(MenuEntry::of).collect());
            wake();
        });
        menu
    }

    /// Returns the menu with all lenses, which is prepared once for all tests.
    #[cfg(test)]
    pub(crate) fn ready() -> Self {
        static MENU: std::sync::LazyLock<LensMenu> = std::sync::LazyLock::new(|| {
            let menu = LensMenu::default();
            let _ = menu
                .entries
                .set(shipped_names().filter_map(MenuEntry::of).collect());
            menu
        });
        MENU.clone()
    }

    /// Returns the lenses of the menu, or none while it is prepared.
    pub(crate) fn entries(&self) -> &[MenuEntry] {
        self.entries.get().map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_lens_is_in_the_menu_with_its_section() {
        let menu = LensMenu::ready();
        assert_eq!(menu.entries().len(), shipped_names().count());
        assert!(menu.entries().iter().all(|e| !e.section.items.is_empty()));
        let gauss = menu
            .entries()
            .iter()
            .find(|e| e.name == "double-gauss")
            .unwrap();
        assert_eq!(gauss.numbers(), "101 mm  f/2.0");
    }

    #[test]
    fn a_search_finds_by_name_kind_source_and_numbers_and_groups_are_whole() {
        let menu = LensMenu::ready();
        let found = |search: &str| -> Vec<&str> {
            let entries = menu.entries().iter();
            entries
                .filter(|e| e.matches(search))
                .map(|e| e.name)
                .collect()
        };
        assert_eq!(found("Gauss"), ["double-gauss"]);
        assert_eq!(found("nikkor fisheye"), ["nikkor-16", "nikkor-6"]);
        assert_eq!(found("bertele wide"), ["biogon"]);
        assert!(found("28 mm").contains(&"nikkor-28") && found("1902") == ["tessar"]);
        assert_eq!(found(" ").len(), menu.entries().len());
        assert!(found("no such lens").is_empty());
        // Lenses of a kind stand together, so that each kind has one heading.
        let kinds: Vec<&str> = menu.entries().iter().map(|e| e.kind.as_str()).collect();
        let mut runs = kinds.clone();
        runs.dedup();
        let all: std::collections::BTreeSet<&str> = kinds.into_iter().collect();
        assert_eq!(runs.len(), all.len());
    }
}

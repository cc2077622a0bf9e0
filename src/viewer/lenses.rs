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
        Some(Self {
            name,
            title: about.title.unwrap_or_else(|| name.to_owned()),
            kind: about.kind.unwrap_or_default(),
            efl: lens.first_order().efl(),
            f_number: lens.real_f_number(),
            section,
        })
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
}

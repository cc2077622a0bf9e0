//! The panels around the picture that fold away in a small window, and the buttons that show them.

use egui::{Ui, Vec2};

/// The width in points below which the panels at the sides fold away.
const NARROW: f32 = 640.0;
/// The height in points below which the section of the lens folds away.
const LOW: f32 = 480.0;

/// Which panels are shown.
#[derive(Clone, Debug, Default)]
pub(super) struct Fold {
    pub lenses: bool,
    pub settings: bool,
    pub section: bool,
    /// Whether the window was narrow and low in the last frame; `None` before the first.
    small: Option<(bool, bool)>,
}

impl Fold {
    /// Folds or shows the panels when the window becomes small or large. The user's choice is kept
    /// in between.
    pub(super) fn fit(&mut self, window: Vec2) {
        let small = (window.x < NARROW, window.y < LOW);
        if self.small != Some(small) {
            self.small = Some(small);
            (self.lenses, self.settings) = (!small.0, !small.0);
            self.section = !small.1;
        }
    }

    /// Shows a button for each panel. In a narrow window, one panel at a side hides the other.
    pub(super) fn buttons(&mut self, ui: &mut Ui) {
        let narrow = self.small.is_some_and(|(narrow, _)| narrow);
        let lenses = ui.toggle_value(&mut self.lenses, "Lenses");
        let settings = ui.toggle_value(&mut self.settings, "Settings");
        ui.toggle_value(&mut self.section, "Section");
        if narrow && lenses.clicked() && self.lenses {
            self.settings = false;
        }
        if narrow && settings.clicked() && self.settings {
            self.lenses = false;
        }
    }
}

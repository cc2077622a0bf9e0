//! The panels around the picture that fold away in a small window, and the buttons that show them.

use egui::{Ui, Vec2};

/// The widths in points from which the lenses and the settings are beside the picture. Below, one
/// of them at a time can be shown.
const WIDE: f32 = 1160.0;
const MEDIUM: f32 = 960.0;
/// The height in points from which the section of the lens is below the picture.
const HIGH: f32 = 640.0;

/// Which panels are shown.
#[derive(Clone, Debug, Default)]
pub(super) struct Fold {
    pub lenses: bool,
    pub settings: bool,
    pub section: bool,
    /// The panels that there was room for in the last frame: lenses, settings, section; `None`
    /// before the first.
    room: Option<[bool; 3]>,
}

impl Fold {
    /// Folds or shows panels when the room for them changes, so that the picture has the larger
    /// part of a small window. The user's choice is kept in between.
    pub(super) fn fit(&mut self, window: Vec2) {
        let room = [window.x >= WIDE, window.x >= MEDIUM, window.y >= HIGH];
        if self.room != Some(room) {
            self.room = Some(room);
            [self.lenses, self.settings, self.section] = room;
        }
    }

    /// Shows a button for each panel. Without room for both, one panel at a side hides the other.
    pub(super) fn buttons(&mut self, ui: &mut Ui) {
        let is_narrow = self.room.is_some_and(|[lenses, ..]| !lenses);
        let lenses = ui.toggle_value(&mut self.lenses, "Lenses");
        let settings = ui.toggle_value(&mut self.settings, "Settings");
        ui.toggle_value(&mut self.section, "Section");
        if is_narrow && lenses.clicked() && self.lenses {
            self.settings = false;
        }
        if is_narrow && settings.clicked() && self.settings {
            self.lenses = false;
        }
    }
}

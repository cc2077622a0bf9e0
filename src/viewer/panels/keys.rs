//! The keys of the window, and the list of them that F1 shows.

use egui::{Align2, Context, Grid, Key, Modifiers, Vec2};

use super::{Kit, dialog, picture};
use crate::viewer::model::WindowModel;
use crate::viewer::navigate::Tool;

/// The keys and the actions of the mouse, with what they do.
pub(super) const LIST: [(&str, &str); 17] = [
    ("1 to 6", "focus, orbit, pan, dolly, fly, seek"),
    ("click", "focuses there, with the tool Focus"),
    ("right button", "orbits, with any tool"),
    ("middle button", "pans, with any tool"),
    ("wheel", "moves the camera forward and back"),
    ("Ctrl or Shift + wheel", "focuses"),
    (
        "Left, Right",
        "turn the focus wheel after a click on it; Shift: faster",
    ),
    ("W A S D Q E", "fly, with the tool Fly; Shift: faster"),
    (
        "Shift + click",
        "uses the tool on what would react to a touch",
    ),
    ("Home", "views all"),
    ("[ and ]", "set both ends of a focus pull: A and B"),
    ("P", "plays the focus pull"),
    ("Ctrl + Z", "undoes"),
    ("Ctrl + Y", "repeats what was undone"),
    ("Ctrl + O", "opens a file"),
    ("Ctrl + S", "saves the picture"),
    ("F1 or ?", "shows and hides this list"),
];

/// Shows the list of keys until it is closed.
pub(super) fn show(ctx: &Context, open: &mut bool) {
    egui::Window::new("Keys and mouse")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .show(ctx, |ui| {
            Grid::new("keys")
                .num_columns(2)
                .striped(true)
                .show(ui, |ui| {
                    for (keys, action) in LIST {
                        ui.strong(keys);
                        ui.label(action);
                        ui.end_row();
                    }
                });
        });
}

/// Handles keys that work at any position of the cursor, unless a text is being typed.
pub(super) fn handle(ctx: &Context, model: &mut WindowModel, kit: &mut Kit) {
    let pressed = |modifiers, key| ctx.input_mut(|i| i.consume_key(modifiers, key));
    if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) || pressed(Modifiers::COMMAND, Key::Y)
    {
        model.redo();
    }
    if pressed(Modifiers::COMMAND, Key::Z) {
        model.undo();
    }
    if pressed(Modifiers::COMMAND, Key::O) {
        kit.dialog = Some(dialog::Dialog::open(dialog::Purpose::Open, model));
    }
    if pressed(Modifiers::COMMAND, Key::S) && model.open {
        model.save_picture();
    }
    if pressed(Modifiers::NONE, Key::F1) {
        kit.keys = !kit.keys;
    }
    if ctx.egui_wants_keyboard_input() {
        return;
    }
    if pressed(Modifiers::SHIFT, Key::Questionmark) || pressed(Modifiers::NONE, Key::Questionmark) {
        kit.keys = !kit.keys;
    }
    if kit.keys && pressed(Modifiers::NONE, Key::Escape) {
        kit.keys = false;
    }
    let digits = [
        Key::Num1,
        Key::Num2,
        Key::Num3,
        Key::Num4,
        Key::Num5,
        Key::Num6,
    ];
    for (key, (tool, ..)) in digits.into_iter().zip(Tool::ALL) {
        if pressed(Modifiers::NONE, key) {
            model.tool = tool;
        }
    }
    if pressed(Modifiers::NONE, Key::Home) {
        model.view_all();
    }
    for (key, end) in [(Key::OpenBracket, 0), (Key::CloseBracket, 1)] {
        if pressed(Modifiers::NONE, key) {
            model.set_pull_key(end);
        }
    }
    if pressed(Modifiers::NONE, Key::P) {
        model.preview_pull();
    }
    picture::fly(ctx, model);
}

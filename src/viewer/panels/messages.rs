//! The messages about the scene and the lens; a click shows the source lines.

use egui::{Color32, RichText, Role, Ui, WidgetInfo};
use ivcam_base::diag::{Diagnostic, Severity, counted};

use super::wheel::meters;
use crate::viewer::model::WindowModel;

pub(super) fn show(ui: &mut Ui, model: &mut WindowModel) {
    refusal(ui, model);
    if model.messages.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        ui.strong(counted(model.messages.len(), "message"));
        if ui.button("Clear").clicked() {
            model.messages.clear();
            model.shown_message = None;
        }
        if ui
            .button("Try again")
            .on_hover_text("renders the same picture again")
            .clicked()
        {
            model.try_again();
        }
    });
    egui::ScrollArea::vertical()
        .max_height(180.0)
        .show(ui, |ui| {
            for (i, message) in model.messages.iter().enumerate() {
                let shown = model.shown_message == Some(i);
                if ui.selectable_label(shown, line(ui, message)).clicked() {
                    model.shown_message = (!shown).then_some(i);
                }
                let lines = message.render(false);
                // A message without source lines or help has nothing to add.
                if shown && lines.trim_end() != message.to_string() {
                    let lines = RichText::new(lines).monospace();
                    ui.add(egui::Label::new(lines).selectable(true));
                }
            }
        });
}

/// Shows the number of messages about the lens and the camera of the picture, which open at a
/// click. They come and go with every choice, so their place moves no control.
pub(super) fn about_camera(ui: &mut Ui, model: &WindowModel) {
    let Some(frame) = &model.frame else { return };
    let messages = &frame.view.messages;
    let Some(worst) = messages.iter().map(|message| message.severity).max() else {
        return;
    };
    let title = RichText::new(format!("⚠ {}", messages.len())).color(color(ui, worst));
    let menu = ui.menu_button(title, |ui| {
        for message in messages {
            ui.label(line(ui, message));
            if let Some(help) = &message.help {
                ui.weak(help);
            }
        }
    });
    let count = counted(messages.len(), "message");
    let name = format!("{count} about lens and camera");
    let button = menu.response.on_hover_text(&name);
    button.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
}

/// Formats a message with its location.
fn line(ui: &Ui, message: &Diagnostic) -> RichText {
    RichText::new(message.to_string()).color(color(ui, message.severity))
}

/// Returns the color of messages of a severity in the theme of the window.
fn color(ui: &Ui, severity: Severity) -> Color32 {
    let visuals = ui.visuals();
    match severity {
        Severity::Error => visuals.error_fg_color,
        Severity::Warning => visuals.warn_fg_color,
        Severity::Note => visuals.weak_text_color(),
    }
}

/// Shows that the lens cannot focus there, with the nearest distance at which it can.
fn refusal(ui: &mut Ui, model: &mut WindowModel) {
    let Some(refusal) = model.refusal.clone() else {
        return;
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(line(ui, &refusal.why));
        if let Some(help) = &refusal.why.help {
            ui.label(help);
        }
        if let Some(nearest) = refusal.nearest
            && ui.button(format!("Focus at {}", meters(nearest))).clicked()
        {
            model.edit("focus", |s| s.set_focus(nearest));
        }
    });
}

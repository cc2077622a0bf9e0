//! The messages about the scene and the lens; a click shows the source lines.

use egui::{Color32, RichText, Ui};
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
                if ui.selectable_label(shown, line(message)).clicked() {
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

/// Formats a message with its location.
fn line(message: &Diagnostic) -> RichText {
    let color = match message.severity {
        Severity::Error => Color32::from_rgb(240, 90, 80),
        Severity::Warning => Color32::from_rgb(220, 170, 60),
        Severity::Note => Color32::GRAY,
    };
    RichText::new(message.to_string()).color(color)
}

/// Shows that the lens cannot focus there, with the nearest distance at which it can.
fn refusal(ui: &mut Ui, model: &mut WindowModel) {
    let Some(refusal) = model.refusal.clone() else {
        return;
    };
    ui.horizontal_wrapped(|ui| {
        ui.label(line(&refusal.why));
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

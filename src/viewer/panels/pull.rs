//! The focus pull: its two ends, the preview and the command.

use egui::{Button, DragValue, Ui};

use super::wheel::meters;
use crate::viewer::model::WindowModel;

pub(super) fn show(ui: &mut Ui, model: &mut WindowModel) {
    egui::CollapsingHeader::new("Focus pull")
        .default_open(super::is_high(ui))
        .show_unindented(ui, |ui| controls(ui, model));
}

fn controls(ui: &mut Ui, model: &mut WindowModel) {
    ui.horizontal(|ui| {
        ui.label("from");
        for (end, name, help) in [
            (
                0,
                "A",
                "the focus of the first frame: sets it to the present one ([)",
            ),
            (
                1,
                "B",
                "the focus of the last frame: sets it to the present one (])",
            ),
        ] {
            if end == 1 {
                ui.label("to");
            }
            let text = match model.pull.keys[end] {
                Some(distance) => format!("{name} {}", meters(distance)),
                None => format!("{name} –"),
            };
            if ui.button(text).on_hover_text(help).clicked() {
                model.set_pull_key(end);
            }
        }
    });
    ui.horizontal(|ui| {
        let is_set = model.pull.keys.iter().all(Option::is_some);
        let name = if model.pull.is_shown() {
            "Stop"
        } else {
            "Preview"
        };
        if ui
            .add_enabled(is_set, Button::new(name))
            .on_hover_text("plays the focus pull (P); set A and B first")
            .clicked()
        {
            model.preview_pull();
        }
        ui.add(
            DragValue::new(&mut model.pull.seconds)
                .range(0.5..=600.0)
                .clamp_existing_to_range(false)
                .max_decimals(1)
                .speed(0.1)
                .suffix(" s"),
        )
        .on_hover_text("how long it takes");
        if ui
            .add_enabled(is_set, Button::new("Copy movie command"))
            .on_hover_text("the command that makes the movie, 24 frames a second")
            .clicked()
            && let Some(command) = model.pull_command()
        {
            ui.ctx().copy_text(command.clone());
            model.status = format!("copied: {command}");
        }
    });
}

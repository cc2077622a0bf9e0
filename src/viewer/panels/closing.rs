//! The question before the window closes over pictures that are being saved.

use egui::{Context, ViewportCommand};

use crate::viewer::model::{Closing, WindowModel};

/// Keeps the window open while pictures are being saved, and asks what to do.
pub(super) fn show(ctx: &Context, model: &mut WindowModel) {
    if ctx.input(|input| input.viewport().close_requested()) && !model.may_close() {
        ctx.send_viewport_cmd(ViewportCommand::CancelClose);
    }
    match model.closing {
        Closing::Not => {}
        Closing::Asked => ask(ctx, model),
        Closing::WhenSaved if model.saving.is_empty() => {
            ctx.send_viewport_cmd(ViewportCommand::Close)
        }
        Closing::WhenSaved => ctx.request_repaint(),
    }
}

fn ask(ctx: &Context, model: &mut WindowModel) {
    let modal = egui::Modal::new(egui::Id::unique("closing")).show(ctx, |ui| {
        ui.heading("Close while a picture is made?");
        for saving in &model.saving {
            ui.label(format!("{} is not written yet.", saving.path.display()));
        }
        ui.horizontal(|ui| {
            if ui.button("Keep the window").clicked() {
                model.closing = Closing::Not;
            }
            if ui.button("Close when it is saved").clicked() {
                model.closing = Closing::WhenSaved;
            }
            if ui.button("Discard it and close").clicked() {
                model.saving.iter().for_each(|saving| saving.cancel());
                model.closing = Closing::WhenSaved;
            }
        });
    });
    // The picture may have been saved while the question was open.
    let is_over = modal.should_close() || model.saving.is_empty();
    if model.closing == Closing::Asked && is_over {
        model.closing = Closing::Not;
    }
}

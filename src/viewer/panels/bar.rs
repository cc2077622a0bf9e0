//! The bar at the top with tools, views and undo, and the status line at the bottom.

use std::path::PathBuf;

use egui::{Role, Ui, WidgetInfo};
use ivcam_base::diag::counted;
use ivcam_render::render::report::account::count;

use super::Kit;
use crate::viewer::draft::Preview;
use crate::viewer::model::{Closing, WindowModel};
use crate::viewer::navigate::Tool;

/// The width in points below which the status line leaves out speed and losses.
const WIDE: f32 = 720.0;

/// The largest width in points of the name of the scene.
const SCENE_WIDTH: f32 = 220.0;

pub(super) fn top(ui: &mut Ui, model: &mut WindowModel, kit: &mut Kit) {
    ui.horizontal_wrapped(|ui| {
        scenes(ui, model);
        ui.separator();
        for (tool, name, help) in Tool::ALL {
            ui.selectable_value(&mut model.tool, tool, name)
                .on_hover_text(help);
        }
        if ui
            .button("View all")
            .on_hover_text("step back until everything is in the picture (Home)")
            .clicked()
        {
            model.view_all();
        }
        ui.separator();
        for (preview, name, help) in Preview::ALL {
            ui.selectable_value(&mut model.preview, preview, name)
                .on_hover_text(help);
        }
        ui.separator();
        if ui
            .add_enabled(model.history.can_undo(), egui::Button::new("Undo"))
            .clicked()
        {
            model.undo();
        }
        if ui
            .add_enabled(model.history.can_redo(), egui::Button::new("Redo"))
            .clicked()
        {
            model.redo();
        }
        ui.separator();
        kit.fold.buttons(ui);
        ui.toggle_value(&mut kit.keys, "?")
            .on_hover_text("keys and mouse (F1)");
    });
}

fn scenes(ui: &mut Ui, model: &mut WindowModel) {
    let name = |path: &std::path::Path| {
        path.file_name()
            .map_or_else(|| "no scene".into(), |n| n.to_string_lossy().into_owned())
    };
    let mut chosen = None;
    let open = model.setup.plan.scene.clone();
    let combo = egui::ComboBox::from_id_salt("scenes").selected_text(name(&open));
    let menu = |ui: &mut Ui| {
        ui.set_max_width(SCENE_WIDTH);
        combo.truncate().show_ui(ui, |ui| {
            let mut entry = |ui: &mut Ui, scene: &std::path::Path| {
                let label = ui.selectable_label(scene == open, name(scene));
                if label.on_hover_text(scene.display().to_string()).clicked() && scene != open {
                    chosen = Some(scene.to_owned());
                }
            };
            for scene in &model.scenes {
                entry(ui, scene);
            }
            let known: Vec<_> = model
                .scenes
                .iter()
                .map(|scene| scene.canonicalize().ok())
                .collect();
            let mut recent = model.recent.scenes.iter();
            let is_new = |scene: &&PathBuf| !known.contains(&Some(scene.to_path_buf()));
            if let Some(first) = recent.by_ref().find(is_new) {
                ui.weak("opened before");
                entry(ui, first);
                recent.filter(is_new).for_each(|scene| entry(ui, scene));
            }
            ui.weak("drop files here to open more");
        })
    };
    let combo = ui.scope(menu).inner;
    let info = || WidgetInfo::labeled(Role::ComboBox, true, "Scenes");
    combo.response.widget_info(info);
    if let Some(scene) = chosen {
        model.open_scene(&scene);
    }
}

pub(super) fn status(ui: &mut Ui, model: &mut WindowModel) {
    ui.horizontal(|ui| {
        ui.checkbox(&mut model.refine, "Refine")
            .on_hover_text("continue to refine the picture");
        if let Some(frame) = &model.frame {
            let size = frame.resolution;
            let text = if frame.whole {
                let samples = counted(frame.samples as usize, "sample");
                format!("{}x{}  {samples}", size.width, size.height)
            } else {
                format!("preview {}x{}", size.width, size.height)
            };
            ui.label(text);
            match &frame.error {
                Ok(e) => ui.label(format!("error {:.2}%", 100.0 * e.relative_rmse)),
                Err(reason) => ui.label("error unknown").on_hover_text(reason.to_string()),
            };
            if ui.ctx().content_rect().width() >= WIDE {
                ui.label(format!("{} rays/s", count(frame.rate as u64)));
                let passed = 100.0 * frame.counts.passed_share();
                ui.label(format!("{passed:.0}% through the lens"));
            }
        }
        if model.opening || !model.saving.is_empty() {
            ui.spinner();
        }
        for saving in &model.saving {
            ui.label(saving.progress())
                .on_hover_text(saving.path.display().to_string());
            let button = ui.small_button("Cancel saving");
            let button = button.on_hover_text("ends the picture; nothing is written");
            if button.clicked() {
                saving.cancel();
            }
        }
        if model.closing == Closing::WhenSaved {
            ui.label("then the window closes");
        }
        super::messages::about_camera(ui, model);
        ui.separator();
        let under = model.hovered.as_ref().and_then(|hovered| hovered.text());
        ui.add(egui::Label::new(under.as_ref().unwrap_or(&model.status)).truncate());
    });
}

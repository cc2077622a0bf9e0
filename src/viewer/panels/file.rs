//! Files: the picture to save, its command line, scenes, cameras and environments.

use std::path::PathBuf;

use egui::{Context, Role, Ui, WidgetInfo};

use super::dialog::{Dialog, Purpose};
use super::{Kit, rule};
use crate::viewer::model::{OutputFile, WindowModel};

pub(super) fn show(ui: &mut Ui, model: &mut WindowModel, kit: &mut Kit) {
    ui.horizontal(|ui| {
        ui.heading("Save");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            copy_command(ui, model);
        });
    });
    size(ui, model);
    ui.horizontal(|ui| {
        let name = egui::TextEdit::singleline(&mut model.output).desired_width(124.0);
        let formats = "the picture's name: .png, .jpg, .tif, .exr, .ppm, .rgb or .sgi";
        ui.add(name)
            .on_hover_text(format!("{}\n{formats}", model.output));
        browse(ui, model, kit, Purpose::Picture);
        if ui
            .add_enabled(model.open, egui::Button::new("Save picture"))
            .on_hover_text("makes the same picture as the command line, bit for bit")
            .clicked()
        {
            model.save_picture();
        }
    });
    rule(ui);
    // A lower window has room for the header, and files can be dropped on it too.
    egui::CollapsingHeader::new("Files")
        .default_open(super::is_high(ui))
        .show_unindented(ui, |ui| {
            read(ui, model, kit);
            write(ui, model, kit);
        });
}

/// Shows the size of the saved picture, which is that of the one in the window or a chosen one, and
/// its samples.
fn size(ui: &mut Ui, model: &mut WindowModel) {
    let shown = model.to_save().plan.resolution;
    let mut next = model.setup.clone();
    ui.horizontal(|ui| {
        let name = ui.label("Size");
        let mut width = shown.width;
        let field = egui::DragValue::new(&mut width)
            .range(16..=8192)
            .clamp_existing_to_range(false)
            .suffix(" px");
        if ui.add(field).labelled_by(name.id).changed() {
            next.as_shown = false;
            next.set_width(width);
        }
        ui.label(format!("x {}", shown.height));
        let was_shown = next.as_shown;
        ui.checkbox(&mut next.as_shown, "as shown")
            .on_hover_text("the saved picture has as many pixels as the one in the window");
        if was_shown && !next.as_shown {
            next.plan.resolution = shown;
        }
    });
    ui.horizontal(|ui| {
        let samples = &mut next.plan.stop.samples;
        let name = ui.label("Samples");
        let field = egui::DragValue::new(samples)
            .range(1..=65_536)
            .clamp_existing_to_range(false);
        ui.add(field).labelled_by(name.id);
    });
    model.change("size", next);
}

fn copy_command(ui: &mut Ui, model: &mut WindowModel) {
    if ui
        .button("Copy command")
        .on_hover_text("the command that makes this picture without a window")
        .clicked()
    {
        ui.ctx().copy_text(model.command());
        model.status = format!("copied: {}", model.command());
    }
}

/// Shows the button that opens the file dialog.
fn browse(ui: &mut Ui, model: &WindowModel, kit: &mut Kit, purpose: Purpose) {
    let help = match purpose {
        Purpose::Open => "choose a file to open (Ctrl+O)",
        Purpose::Picture => "choose the name of the picture",
        Purpose::Written => "choose the name of the camera or environment",
    };
    let button = ui.button("…").on_hover_text(help);
    button.widget_info(|| WidgetInfo::labeled(Role::Button, true, help));
    if button.clicked() {
        kit.dialog = Some(Dialog::open(purpose, model));
    }
}

fn read(ui: &mut Ui, model: &mut WindowModel, kit: &mut Kit) {
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut model.file)
            .hint_text("open: scene, camera, picture, …")
            .desired_width(236.0);
        let field = ui.add(field);
        field.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "File to open"));
        let enter = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        if enter && !model.file.trim().is_empty() {
            let path = PathBuf::from(model.file.trim());
            model.take_file(&path);
        }
        if !model.file.is_empty() {
            field.on_hover_text(&model.file);
        }
        browse(ui, model, kit, Purpose::Open);
    });
    let path = PathBuf::from(model.file.trim());
    let named = !model.file.trim().is_empty();
    ui.horizontal(|ui| {
        let mut button = |name: &str, help: &str| {
            ui.add_enabled(named, egui::Button::new(name))
                .on_hover_text(help)
                .clicked()
        };
        if button(
            "Open",
            "opens a scene, camera (.dat), environment (.env), lens or picture, as if dropped here",
        ) {
            model.take_file(&path);
        }
        if button(
            "Read environment",
            "a file that SceneViewer saved: camera, fog, lights, headlight",
        ) {
            model.read_environment(&path);
        }
    });
}

fn write(ui: &mut Ui, model: &mut WindowModel, kit: &mut Kit) {
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut model.written)
            .hint_text("write: a new .dat or .env")
            .desired_width(236.0);
        let field = ui.add(field);
        if !model.written.is_empty() {
            field.on_hover_text(&model.written);
        }
        browse(ui, model, kit, Purpose::Written);
    });
    let path = PathBuf::from(model.written.trim());
    let named = !model.written.trim().is_empty();
    ui.horizontal(|ui| {
        let mut button = |name: &str, help: &str| {
            ui.add_enabled(named, egui::Button::new(name))
                .on_hover_text(help)
                .clicked()
        };
        if button("Write camera", "a camera file, for --camera and -camread") {
            model.write(OutputFile::Camera, &path);
        }
        if button(
            "Write environment",
            "camera, environment and headlight, as SceneViewer saves them",
        ) {
            model.write(OutputFile::Environment, &path);
        }
    });
}

/// Asks before a file is replaced.
pub(super) fn confirm(ctx: &Context, model: &mut WindowModel) {
    let Some((_, path)) = &model.replacing else {
        return;
    };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut answer = None;
    let modal = egui::Modal::new(egui::Id::unique("replace")).show(ctx, |ui| {
        ui.heading(format!("Replace {name}?"));
        ui.label(format!("{} exists.", path.display()));
        ui.horizontal(|ui| {
            for (text, replace) in [("Keep it", false), ("Replace it", true)] {
                if ui.button(text).clicked() {
                    answer = Some(replace);
                }
            }
        });
    });
    if modal.should_close() {
        answer = answer.or(Some(false));
    }
    if let Some(replace) = answer {
        model.answer_replacing(replace);
    }
}

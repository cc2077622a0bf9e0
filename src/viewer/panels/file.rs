//! Files: the picture to save, its command line, scenes, cameras and environments.

use std::path::PathBuf;

use egui::Ui;

use crate::viewer::model::Model;

/// Whether the picture is to be saved.
pub fn show(ui: &mut Ui, model: &mut Model) -> bool {
    ui.heading("Save");
    let mut next = model.setup.clone();
    ui.horizontal(|ui| {
        let size = &mut next.plan.resolution;
        let name = ui.label("Size");
        let aspect = next.plan.film.width / next.plan.film.height;
        let field = egui::DragValue::new(&mut size.width)
            .range(16..=8192)
            .suffix(" px");
        if ui.add(field).labelled_by(name.id).changed() {
            size.height = ((f64::from(size.width) / aspect).round() as u32).max(1);
        }
        ui.label(format!("x {}", size.height));
        let samples = &mut next.plan.sampler.samples;
        let field = ui.add(egui::DragValue::new(samples).range(1..=65_536));
        let name = ui.label("samples");
        if field.labelled_by(name.id).changed() {
            next.plan.stop.samples = *samples;
        }
    });
    model.change("size", next);
    let save = ui
        .horizontal(|ui| {
            ui.add(egui::TextEdit::singleline(&mut model.output).desired_width(140.0))
                .on_hover_text("the picture's name: .png, .exr or .ppm");
            ui.add_enabled(model.open, egui::Button::new("Save picture"))
                .on_hover_text("makes what the command line makes, bit for bit")
                .clicked()
        })
        .inner;
    if ui
        .button("Copy command")
        .on_hover_text("the line that makes this picture without a window")
        .clicked()
    {
        ui.ctx().copy_text(model.command());
        model.status = format!("copied: {}", model.command());
    }
    ui.separator();
    named_files(ui, model);
    save
}

fn named_files(ui: &mut Ui, model: &mut Model) {
    ui.heading("Files");
    ui.add(
        egui::TextEdit::singleline(&mut model.file)
            .hint_text("scene, camera, environment, picture"),
    );
    let path = PathBuf::from(model.file.trim());
    let named = !model.file.trim().is_empty();
    ui.horizontal_wrapped(|ui| {
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
        if button("Write camera", "a camera file, for --camera and -camread") {
            model.write_file(&path, false);
        }
        if button(
            "Write environment",
            "camera, environment and headlight, as SceneViewer saves them",
        ) {
            model.write_file(&path, true);
        }
    });
    ui.separator();
}

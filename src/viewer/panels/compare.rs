//! The panel that compares an archival picture with the live one.

use egui::{Color32, Painter, Rect, Stroke, TextureHandle, Ui, pos2, vec2};

use crate::viewer::archive::{Archive, ArchiveMode, Levels};
use crate::viewer::model::WindowModel;

use super::Kit;

pub(super) fn show(ui: &mut Ui, model: &mut WindowModel) {
    ui.heading("Comparison");
    let archive = &mut model.archive;
    if archive.picture.is_none() {
        ui.weak("drop a picture here, or open one above");
        return;
    }
    ui.label(
        archive
            .path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy(),
    );
    ui.horizontal(|ui| {
        for (mode, name) in ArchiveMode::ALL {
            ui.selectable_value(&mut archive.mode, mode, name);
        }
    });
    match archive.mode {
        ArchiveMode::Wipe => {
            ui.add(egui::Slider::new(&mut archive.line, 0.0..=1.0).text("line"));
        }
        ArchiveMode::Onion => {
            ui.add(egui::Slider::new(&mut archive.opacity, 0.0..=1.0).text("opacity"));
        }
        ArchiveMode::Off | ArchiveMode::Blink => {}
    }
    ui.horizontal(|ui| {
        if ui
            .button("Align")
            .on_hover_text("finds the shift, scale and rotation to the live picture again")
            .clicked()
        {
            archive.realign();
        }
        ui.add(egui::Label::new(egui::RichText::new(&archive.note).small()).truncate());
    });
}

/// Draws the old picture over the live one.
pub(super) fn paint(painter: &Painter, rect: Rect, model: &WindowModel, kit: &mut Kit) {
    let archive = &model.archive;
    let Some(texture) = texture(painter, archive, kit) else {
        return;
    };
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let Some(aspect) = archive.aspect() else {
        return;
    };
    let place = inside(rect, aspect, archive.aligned.is_some());
    match archive.mode {
        ArchiveMode::Off => {}
        ArchiveMode::Blink if !archive.blinks_on(model.now) => {}
        ArchiveMode::Blink => {
            painter.image(texture, place, whole, Color32::WHITE);
        }
        ArchiveMode::Onion => {
            painter.image(
                texture,
                place,
                whole,
                Color32::WHITE.gamma_multiply(archive.opacity),
            );
        }
        ArchiveMode::Wipe => {
            let x = rect.left() + archive.line * rect.width();
            let left = Rect::from_min_max(rect.min, pos2(x, rect.bottom()));
            let left = painter.with_clip_rect(left.intersect(painter.clip_rect()));
            left.image(texture, place, whole, Color32::WHITE);
            painter.vline(x, rect.y_range(), Stroke::new(1.5, Color32::WHITE));
        }
    }
}

/// Returns the place of the old picture: the film's if it is aligned, or else the largest one with
/// its own aspect ratio.
fn inside(film: Rect, aspect: f32, aligned: bool) -> Rect {
    if aligned {
        return film;
    }
    let width = film.width().min(film.height() * aspect);
    Rect::from_center_size(film.center(), vec2(width, width / aspect))
}

fn texture(painter: &Painter, archive: &Archive, kit: &mut Kit) -> Option<egui::TextureId> {
    let fresh = kit
        .archive
        .as_ref()
        .is_none_or(|(version, _)| *version != archive.version);
    if fresh && let Some(Levels { size, rgba }) = archive.levels() {
        let image = egui::ColorImage::from_rgba_unmultiplied(size, &rgba);
        let handle: TextureHandle =
            painter
                .ctx()
                .load_texture("archive", image, egui::TextureOptions::LINEAR);
        kit.archive = Some((archive.version, handle));
    }
    archive.picture.as_ref()?;
    kit.archive.as_ref().map(|(_, handle)| handle.id())
}

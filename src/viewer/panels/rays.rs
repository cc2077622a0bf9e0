//! The live diagram of the lens, with rays of the pixel under the cursor.

use egui::Ui;
use ivcam_render::camera::{Camera, LensCamera};

use super::drawing;
use super::wheel::meters;
use crate::photo::{RAYS, ray_section};
use crate::viewer::model::WindowModel;

/// The width in points below which the caption has two lines.
const TWO_LINES: f32 = 540.0;

/// The section with its rays, kept until the pixel or the lens changes.
#[derive(Default)]
pub(super) struct Section {
    of: Option<(u64, [u32; 2], [f32; 2])>,
    drawing: ivcam_optics::diagram::drawing::Drawing,
    passed: usize,
}

pub(super) fn show(ui: &mut Ui, model: &WindowModel, section: &mut Section) {
    let Some(frame) = &model.frame else { return };
    let Some(camera) = frame.view.lens_camera() else {
        ui.weak(match frame.view.camera {
            Camera::Ideal(_) => "an ideal lens has no surfaces",
            _ => "no lens: a pinhole",
        });
        return;
    };
    let (x, y) = model.cursor.unwrap_or((0.5, 0.5));
    let size = model.setup.plan.resolution;
    let cell = |t: f64, n: u32| ((t * f64::from(n)) as u32).min(n.saturating_sub(1));
    let pixel = [cell(x, size.width), cell(y, size.height)];
    caption(ui, model, camera, pixel, section.passed);
    let (rect, _) = ui.allocate_exact_size(ui.available_size(), egui::Sense::hover());
    let painter = ui.painter_at(rect);
    // The letters above the section reach a little beyond the drawing.
    let rect = rect.shrink2(egui::vec2(0.0, 6.0));
    let room: [f32; 2] = rect.size().into();
    if section.of != Some((frame.serial, pixel, room)) {
        let plan = &model.setup.plan;
        (section.drawing, section.passed) = ray_section(camera, plan, pixel, room.map(f64::from));
        section.of = Some((frame.serial, pixel, room));
    }
    drawing::paint(&painter, rect, &section.drawing, ui.visuals().dark_mode);
}

/// Shows the lens, and what the rays of the pixel meet; in two lines if the panel is narrow.
fn caption(
    ui: &mut Ui,
    model: &WindowModel,
    camera: &LensCamera,
    [px, py]: [u32; 2],
    passed: usize,
) {
    let optics = camera.lens.first_order();
    let f = camera
        .lens
        .real_f_number()
        .map_or(String::new(), |n| format!(" f/{n:.2}"));
    let lens = format!("{} {:.1} mm{f}", camera.lens.name(), optics.efl());
    let (x, y) = model.cursor.unwrap_or((0.5, 0.5));
    let seen = model.look(x, y);
    let there = seen.map_or(String::new(), |s| format!("; {} away", meters(s.distance)));
    let rays = format!("{passed} of {RAYS} rays at {px}, {py}{there}");
    let show = |ui: &mut Ui| {
        ui.strong(lens);
        ui.add(egui::Label::new(rays).truncate())
            .on_hover_text("rays of the pixel under the cursor that pass through the lens");
    };
    if ui.available_width() < TWO_LINES {
        show(ui);
    } else {
        ui.horizontal(show);
    }
}

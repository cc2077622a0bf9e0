//! The live diagram of the lens, with rays of the pixel under the cursor.

use egui::Ui;
use glam::{DVec2, DVec3};
use ivcam_optics::diagram::drawing::Ink;
use ivcam_optics::diagram::{LensDiagram, SectionOptions};
use ivcam_optics::lens::{LensRay, RayPath};
use ivcam_render::camera::LensCamera;

use super::drawing;
use super::settings::meters;
use crate::viewer::model::WindowModel;

/// The number of samples of the pixel that are drawn.
const RAYS: u32 = 24;
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
        ui.weak("no lens: a pinhole");
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
        let number = u64::from(pixel[1] * size.width + pixel[0]);
        (section.drawing, section.passed) = draw(camera, model, pixel, number, room);
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

/// Returns the section with the size of the room, in which its letters are legible, and the number
/// of rays that pass through the lens.
fn draw(
    camera: &LensCamera,
    model: &WindowModel,
    [px, py]: [u32; 2],
    number: u64,
    [width, height]: [f32; 2],
) -> (ivcam_optics::diagram::drawing::Drawing, usize) {
    let plan = &model.setup.plan;
    let options = SectionOptions {
        width: width.max(80.0).into(),
        height: height.max(80.0).into(),
        fields: Vec::new(),
        lost: false,
        ..SectionOptions::of(camera.focus.film_z, 0.0)
    };
    let mut diagram = LensDiagram::of(&camera.lens, options);
    let mut passed = 0;
    let pixel = plan.pixel_sampler().pixel(number, [px, py]);
    for index in 0..RAYS {
        let sample = pixel.sample(index);
        let x = (f64::from(px) + sample.film[0]) / f64::from(plan.resolution.width);
        let y = (f64::from(py) + sample.film[1]) / f64::from(plan.resolution.height);
        let Some((start, path)) = camera.path(camera.film_point(x, y), sample.pupil) else {
            continue;
        };
        passed += usize::from(path.outcome.is_ok());
        let ink = match path.outcome {
            Ok(_) => Ink::Ray(0),
            Err(_) => Ink::Lost(2),
        };
        let lost = path.outcome.is_err();
        diagram.add_path(flat(&start, &path, camera.lens.length()), ink, lost);
    }
    (diagram.drawing(), passed)
}

/// Projects a path to the plane of the axis and the film point: z, and the height along that
/// direction.
fn flat(start: &LensRay, path: &RayPath, length: f64) -> Vec<DVec2> {
    let up = start.origin.truncate().try_normalize().unwrap_or(DVec2::Y);
    // The film point is drawn below the axis, as its image is upside down.
    let place = |p: DVec3| DVec2::new(p.z, -p.truncate().dot(up));
    let mut points = vec![place(start.origin)];
    points.extend(path.hits.iter().map(|p| place(*p)));
    if let Ok(out) = path.outcome {
        let lead = 0.35 * length.max(start.origin.z);
        points.push(place(
            out.origin + lead / out.direction.z.abs().max(0.2) * out.direction,
        ));
    }
    points
}

//! The camera menu with the lenses, and the film formats.

use egui::{Response, Sense, Ui, WidgetInfo, WidgetType, vec2};
use ivcam_base::math::Mm;
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::FocusMethod;

use super::{Kit, drawing};
use crate::photo::Optics;
use crate::viewer::lenses::MenuEntry;
use crate::viewer::model::WindowModel;

/// Film formats: the name, and width and height in millimeters.
pub(super) const FILMS: [(&str, f64, f64); 10] = [
    ("35 mm", 36.0, 24.0),
    ("35 mm upright", 24.0, 36.0),
    ("Half frame", 18.0, 24.0),
    ("APS-C", 23.6, 15.7),
    ("Four Thirds", 17.3, 13.0),
    ("Super 35", 24.89, 18.66),
    ("16 mm", 10.26, 7.49),
    ("6x6", 56.0, 56.0),
    ("6x7", 70.0, 56.0),
    ("4x5 in", 121.0, 97.0),
];

pub(super) fn menu(ui: &mut Ui, model: &mut WindowModel, kit: &mut Kit) {
    ui.heading("Camera");
    film(ui, model);
    ui.separator();
    let pinhole = model.setup.plan.optics == Optics::Pinhole;
    if ui
        .selectable_label(pinhole, "Pinhole of the scene")
        .on_hover_text("the scene's own camera, without a lens")
        .clicked()
    {
        model.edit("lens", |s| s.plan.optics = Optics::Pinhole);
    }
    ui.separator();
    let chosen = model
        .setup
        .lens()
        .map(|l| l.name.clone())
        .unwrap_or_default();
    let mut wanted = None;
    let lenses = kit.lenses.clone();
    let shipped = lenses.entries().iter().any(|e| e.name == chosen);
    if !(chosen.is_empty() || shipped || lenses.entries().is_empty()) {
        let file = std::path::Path::new(&chosen).file_name();
        let name = file.map_or(chosen.clone(), |n| n.to_string_lossy().into_owned());
        let _ = ui.selectable_label(true, name).on_hover_text(&chosen);
    }
    egui::ScrollArea::vertical()
        .auto_shrink(false)
        .show(ui, |ui| {
            for entry in lenses.entries() {
                let response = row(ui, entry, entry.name == chosen);
                if entry.name == chosen && kit.lens_in_view != chosen {
                    kit.lens_in_view.clone_from(&chosen);
                    if !ui.clip_rect().contains_rect(response.rect) {
                        response.scroll_to_me(Some(egui::Align::Center));
                    }
                }
                if response.clicked() {
                    wanted = Some(entry.name);
                }
            }
            if lenses.entries().is_empty() {
                ui.spinner();
            }
        });
    if let Some(name) = wanted {
        model.edit("lens", |s| s.choose_lens(name));
    }
}

/// Shows one lens; a click chooses it.
fn row(ui: &mut Ui, entry: &MenuEntry, chosen: bool) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 46.0), Sense::click());
    response
        .widget_info(|| WidgetInfo::selected(WidgetType::RadioButton, true, chosen, entry.name));
    if ui.is_rect_visible(rect) {
        let visuals = ui.style().interact_selectable(&response, chosen);
        if chosen || response.hovered() {
            ui.painter().rect_filled(rect, 3.0, visuals.weak_bg_fill);
        }
        let picture = egui::Rect::from_min_size(rect.min + vec2(2.0, 3.0), vec2(72.0, 40.0));
        drawing::paint(
            &ui.painter_at(picture),
            picture,
            &entry.section,
            ui.visuals().dark_mode,
        );
        let text = ui.painter_at(rect);
        let at = rect.min + vec2(80.0, 6.0);
        let font = egui::TextStyle::Body.resolve(ui.style());
        text.text(
            at,
            egui::Align2::LEFT_TOP,
            entry.name,
            font,
            visuals.text_color(),
        );
        let small = egui::FontId::proportional(12.0);
        text.text(
            at + vec2(0.0, 20.0),
            egui::Align2::LEFT_TOP,
            entry.numbers(),
            small,
            visuals.text_color(),
        );
    }
    let facts = format!("{}\n{}\n{}", entry.title, entry.kind, entry.numbers());
    response.on_hover_text(facts)
}

fn film(ui: &mut Ui, model: &mut WindowModel) {
    let now = model.setup.plan.film;
    let name = FILMS
        .iter()
        .find(|(_, w, h)| (*w, *h) == (now.width, now.height));
    let text = name.map_or_else(
        || format!("{}x{} mm", now.width, now.height),
        |(n, ..)| (*n).into(),
    );
    let mut wanted = None;
    egui::ComboBox::from_label("Film")
        .selected_text(text)
        .show_ui(ui, |ui| {
            for (name, width, height) in FILMS {
                let film = FilmFormat { width, height };
                if ui
                    .selectable_label(film == now, format!("{name}  {width}x{height}"))
                    .clicked()
                {
                    wanted = Some(film);
                }
            }
        });
    if let Some(film) = wanted {
        model.edit("film", |s| s.set_film(film));
    }
}

/// Shows the lens's size: the paper's zoom, or a focal length.
pub(super) fn zoom(ui: &mut Ui, model: &mut WindowModel) {
    let Some(lens) = model.setup.lens().cloned() else {
        return;
    };
    let mut next = lens.clone();
    ui.horizontal(|ui| {
        let name = ui.label("Zoom");
        ui.add(
            egui::Slider::new(&mut next.zoom, 0.05..=5.0)
                .logarithmic(true)
                .max_decimals(3)
                .clamping(egui::SliderClamping::Never),
        )
        .labelled_by(name.id)
        .on_hover_text("scales the lens, as -z does");
    });
    ui.horizontal(|ui| {
        let mut set = next.efl.is_some();
        let name = ui.checkbox(&mut set, "Focal length");
        let mut efl = next.efl.map_or(50.0, |l| l.0);
        let field = egui::DragValue::new(&mut efl)
            .range(0.5..=5000.0)
            .max_decimals(2)
            .suffix(" mm");
        ui.add_enabled(set, field).labelled_by(name.id);
        next.efl = set.then_some(Mm(efl));
    });
    method(ui, &mut next.method);
    if next != lens && next.zoom > 0.0 {
        model.edit("zoom", |s| s.plan.optics = Optics::Lens(next));
    }
}

/// Shows the movements of a view camera.
pub(super) fn movements(ui: &mut Ui, model: &mut WindowModel) {
    let mut next = model.setup.clone();
    let moved = &mut next.plan.movements;
    egui::CollapsingHeader::new("Movements").show(ui, |ui| {
        for (name, radians) in [("tilt", &mut moved.tilt), ("swing", &mut moved.swing)] {
            let mut degrees = (radians.to_degrees() * 100.0).round() / 100.0;
            let slider = egui::Slider::new(&mut degrees, -30.0..=30.0)
                .step_by(0.1)
                .suffix("°")
                .text(name);
            if ui.add(slider).changed() {
                *radians = ((degrees * 100.0).round() / 100.0).to_radians();
            }
        }
        for (name, mm) in [("rise", &mut moved.rise), ("shift", &mut moved.shift)] {
            ui.add(
                egui::Slider::new(mm, -30.0..=30.0)
                    .step_by(0.1)
                    .suffix(" mm")
                    .text(name),
            );
        }
    });
    model.change("movements", next);
}

fn method(ui: &mut Ui, method: &mut FocusMethod) {
    egui::ComboBox::from_label("moves to focus")
        .selected_text(method.name())
        .show_ui(ui, |ui| {
            for (choice, help) in [
                (FocusMethod::Film, "the film, to the paraxial image"),
                (
                    FocusMethod::Lens,
                    "the whole lens; distances are measured from the film",
                ),
                (FocusMethod::Group, "the focusing group of the prescription"),
                (
                    FocusMethod::Best,
                    "the film, to the smallest spot of real rays",
                ),
            ] {
                ui.selectable_value(method, choice, choice.name())
                    .on_hover_text(help);
            }
        });
}

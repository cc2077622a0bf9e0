//! The camera menu with the lenses, and the film formats.

use egui::{Response, Role, Sense, Ui, WidgetInfo, vec2};
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
    let lenses = kit.lenses.clone();
    let shipped = lenses.entries().iter().any(|e| e.name == chosen);
    if !(chosen.is_empty() || shipped || lenses.entries().is_empty()) {
        let file = std::path::Path::new(&chosen).file_name();
        let name = file.map_or(chosen.clone(), |n| n.to_string_lossy().into_owned());
        let _ = ui.selectable_label(true, name).on_hover_text(&chosen);
    }
    let field = egui::TextEdit::singleline(&mut kit.lens_search)
        .hint_text("search: wide, nikkor, 28 mm")
        .desired_width(f32::INFINITY);
    let field = ui.add(field);
    field.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "Search for a lens"));
    let takes_first = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
    let entries = lenses.entries().iter();
    let found: Vec<_> = entries.filter(|e| e.matches(&kit.lens_search)).collect();
    let mut wanted = found.first().filter(|_| takes_first).map(|e| e.name);
    egui::ScrollArea::vertical()
        .auto_shrink(false)
        .show(ui, |ui| {
            wanted = wanted.or(list(ui, &found, &chosen, &mut kit.lens_in_view));
            if lenses.entries().is_empty() {
                ui.spinner();
            } else if found.is_empty() {
                ui.weak("no lens has these words");
            }
        });
    if let Some(name) = wanted {
        model.edit("lens", |s| s.choose_lens(name));
    }
}

/// Lists lenses below the names of their kinds, and returns the one that is clicked. The chosen one
/// is scrolled into view when it is another than `in_view`.
fn list(
    ui: &mut Ui,
    lenses: &[&MenuEntry],
    chosen: &str,
    in_view: &mut String,
) -> Option<&'static str> {
    let (mut clicked, mut kind) = (None, "");
    for entry in lenses {
        if entry.kind != kind {
            kind = &entry.kind;
            let (first, rest) = kind.split_at(kind.len().min(1));
            ui.strong(first.to_uppercase() + rest);
        }
        let response = row(ui, entry, entry.name == chosen);
        if entry.name == chosen && in_view != chosen {
            chosen.clone_into(in_view);
            if !ui.clip_rect().contains_rect(response.rect) {
                response.scroll_to_me(Some(egui::Align::Center));
            }
        }
        if response.clicked() {
            clicked = Some(entry.name);
        }
    }
    clicked
}

/// Shows one lens; a click chooses it.
fn row(ui: &mut Ui, entry: &MenuEntry, chosen: bool) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 46.0), Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::RadioButton, true, chosen, entry.name));
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
            .clamp_existing_to_range(false)
            .max_decimals(2)
            .suffix(" mm");
        ui.add_enabled(set, field).labelled_by(name.id);
        next.efl = set.then_some(Mm(efl));
    });
    if next != lens && next.zoom > 0.0 {
        model.edit("zoom", |s| s.plan.optics = Optics::Lens(next));
    }
}

/// Shows what moves to focus, and the movements of a view camera.
pub(super) fn movements(ui: &mut Ui, model: &mut WindowModel) {
    let mut next = model.setup.clone();
    egui::CollapsingHeader::new("Movements").show(ui, |ui| {
        if let Some(lens) = next.plan.lens_mut() {
            method(ui, &mut lens.method);
        }
        let moved = &mut next.plan.movements;
        for (name, radians) in [("tilt", &mut moved.tilt), ("swing", &mut moved.swing)] {
            let mut degrees = (radians.to_degrees() * 100.0).round() / 100.0;
            let slider = egui::Slider::new(&mut degrees, -30.0..=30.0)
                .clamping(egui::SliderClamping::Edits)
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
                    .clamping(egui::SliderClamping::Edits)
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

//! The panels of focus and aperture, with the depth of field.

use egui::{Grid, Ui};
use ivcam_optics::lens::Iris;

use super::wheel::meters;
use super::{Kit, Turn, camera, pull, rule, wheel};
use crate::viewer::model::WindowModel;
use crate::viewer::sharpness::{self, DepthOfField};

/// The full f-stops, from f/1.
pub(super) const STOPS: [f64; 13] = [
    1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0, 45.0, 64.0,
];

pub(super) fn focus(ui: &mut Ui, model: &mut WindowModel, kit: &mut Kit) {
    let heading = ui.heading(format!("Focus {}", meters(model.setup.focus())));
    let (_, turn) = wheel(ui, "Focus wheel", &mut kit.wheel);
    if turn != Turn::default() && turn.radians != 0.0 {
        let there = sharpness::wheel(model.setup.focus(), turn.radians, turn.speed);
        model.edit("focus wheel", |s| s.set_focus(there));
    }
    ui.horizontal(|ui| {
        let mut distance = model.setup.focus().min(1e6);
        let field = egui::DragValue::new(&mut distance)
            .range(1e-3..=1e6)
            .clamp_existing_to_range(false)
            .max_decimals(4)
            .suffix(" m");
        if ui
            .add(field.speed(0.01))
            .labelled_by(heading.id)
            .on_hover_text("the focus distance")
            .changed()
        {
            model.edit("focus", |s| s.set_focus(distance));
        }
        if ui.button("∞").on_hover_text("focus at infinity").clicked() {
            model.edit("focus", |s| s.set_focus(f64::INFINITY));
        }
    });
    autofocus(ui, model);
    depth_of_field(ui, model);
    camera::zoom(ui, model);
    camera::movements(ui, model);
    pull::show(ui, model);
    rule(ui);
}

/// Shows the result of autofocus in one line, which is reserved while it is empty, so that nothing
/// below moves.
fn autofocus(ui: &mut Ui, model: &WindowModel) {
    // A result is out of date when the focus has been changed by other means.
    let current = model
        .focused
        .filter(|_| model.focused_at == model.setup.focus());
    let text = match current {
        None => " ".into(),
        Some(found) => {
            let distance = meters(found.distance);
            match found.gain {
                Some(gain) if gain > 1.0 => format!(
                    "autofocus {distance}: {:.0}% more contrast than at {}",
                    100.0 * (gain - 1.0),
                    meters(found.plain)
                ),
                Some(_) => format!("autofocus {distance}: contrast agrees"),
                None => format!("autofocus {distance}: nothing to see contrast by"),
            }
        }
    };
    ui.add(egui::Label::new(egui::RichText::new(text).small()).truncate());
}

/// Shows the depth of field. The rows exist before the first picture, so that nothing below them
/// moves.
fn depth_of_field(ui: &mut Ui, model: &WindowModel) {
    if model.setup.lens().is_none() {
        return;
    }
    let field = model.depth_of_field();
    let or_none = |value: Option<String>| value.unwrap_or_else(|| "–".into());
    Grid::new("depth of field")
        .num_columns(2)
        .spacing([12.0, 2.0])
        .show(ui, |ui| {
            let mut row = |name: &str, value: Option<String>| {
                ui.label(name);
                ui.label(or_none(value));
                ui.end_row();
            };
            let range =
                |field: &DepthOfField| format!("{} to {}", meters(field.near), meters(field.far));
            row("sharp from", field.as_ref().map(range));
            let circle =
                |f: &DepthOfField| format!("{}, circle {:.3} mm", meters(f.hyperfocal), f.circle);
            row("hyperfocal", field.as_ref().map(circle));
            let angle = format!("{:.2}°", model.height_angle().to_degrees());
            row("height angle", field.as_ref().map(|_| angle));
        });
}

pub(super) fn aperture(ui: &mut Ui, model: &mut WindowModel, kit: &mut Kit) {
    let Some(lens) = model.setup.lens().cloned() else {
        return;
    };
    let mut next = lens.clone();
    let widest = kit.widest_f_number(&lens);
    let text = match (next.f_number, widest) {
        (Some(n), _) => format!("f/{n}"),
        (None, Some(n)) => format!("open, f/{n:.2}"),
        (None, None) => "open".into(),
    };
    ui.heading(format!("Aperture {text}"));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        if ui
            .selectable_label(next.f_number.is_none(), "open")
            .clicked()
        {
            next.f_number = None;
        }
        // All stops are shown, so that nothing moves when another lens is chosen.
        for stop in STOPS {
            let chosen = next.f_number == Some(stop);
            let label = egui::Button::selectable(chosen, format!("f/{stop}"));
            let possible = widest.is_none_or(|widest| stop > widest);
            if ui.add_enabled(possible, label).clicked() {
                next.f_number = Some(stop);
            }
        }
    });
    blades(ui, &mut next.iris);
    if next != lens {
        model.edit("aperture", |s| {
            s.plan.optics = crate::photo::Optics::Lens(next)
        });
    }
}

fn blades(ui: &mut Ui, iris: &mut Iris) {
    let (mut count, mut turn) = match iris {
        Iris::Blades { count, rotation } => (*count, rotation.to_degrees().round()),
        _ => (0, 0.0),
    };
    let before = (count, turn);
    ui.horizontal(|ui| {
        let name = ui.label("Blades");
        ui.add(
            egui::DragValue::new(&mut count)
                .range(0..=64)
                .clamp_existing_to_range(false)
                .speed(0.1)
                .custom_formatter(|n, _| {
                    if n < 3.0 {
                        "round".into()
                    } else {
                        format!("{n:.0}")
                    }
                }),
        )
        .labelled_by(name.id)
        .on_hover_text("straight blades of the iris; fewer than three is a round hole");
        let name = ui.label("turned");
        ui.add_enabled(
            count >= 3,
            egui::DragValue::new(&mut turn)
                .range(0.0..=360.0)
                .clamp_existing_to_range(false)
                .suffix("°")
                .max_decimals(0),
        )
        .labelled_by(name.id);
    });
    if (count, turn) != before {
        *iris = if count < 3 {
            Iris::Round
        } else {
            Iris::Blades {
                count,
                rotation: turn.round().to_radians(),
            }
        };
    }
}

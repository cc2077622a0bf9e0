//! What the glass does to the light: coating, dispersion, ghosts and diffraction.

use egui::Ui;
use ivcam_optics::lens::Coating;

use super::rule;
use crate::viewer::model::WindowModel;

/// The coatings with their names and descriptions in the window.
const COATINGS: [(Option<Coating>, &str, &str); 4] = [
    (
        None,
        "its own",
        "the coating that the prescription states; without one, ideal",
    ),
    (
        Some(Coating::Ideal),
        "ideal",
        "no surface reflects, as in the paper",
    ),
    (
        Some(Coating::MagnesiumFluoride),
        "MgF2",
        "one layer, as on lenses from about 1940 on",
    ),
    (
        Some(Coating::Bare),
        "none",
        "bare glass, which loses 4 to 8% at each surface",
    ),
];

pub(super) fn show(ui: &mut Ui, model: &mut WindowModel) {
    let Some(mut coating) = model.setup.lens().map(|lens| lens.coating) else {
        return;
    };
    let mut next = model.setup.clone();
    let plan = &mut next.plan;
    ui.horizontal(|ui| {
        let name = |coating| {
            COATINGS
                .iter()
                .find(|(c, ..)| *c == coating)
                .map_or("", |c| c.1)
        };
        egui::ComboBox::from_label("Coating")
            .selected_text(name(coating))
            .width(70.0)
            .show_ui(ui, |ui| {
                for (choice, name, help) in COATINGS {
                    ui.selectable_value(&mut coating, choice, name)
                        .on_hover_text(help);
                }
            });
        ui.checkbox(&mut plan.dispersion, "Dispersion")
            .on_hover_text("glass bends blue light more than red");
    });
    ui.horizontal(|ui| {
        ui.checkbox(&mut plan.ghosts, "Ghosts").on_hover_text(
            "reflections of the scene's lights between surfaces; only the saved picture has them",
        );
        ui.checkbox(&mut plan.diffraction, "Diffraction")
            .on_hover_text("the aperture spreads the light; only the saved picture has it");
        if plan.ghosts && !model.reflects() {
            ui.weak("none: ideal coating")
                .on_hover_text("choose the coating MgF2 or none, which reflect");
        } else if plan.ghosts || plan.diffraction {
            ui.weak("when saved");
        }
    });
    if let Some(lens) = plan.lens_mut() {
        lens.coating = coating;
    }
    model.change("glass", next);
    rule(ui);
}

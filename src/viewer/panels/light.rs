//! The light panel: exposure with its histogram, headlight and shading.

use egui::{Color32, Sense, Ui, pos2, vec2};
use ivcam_optics::film::Response;
use ivcam_render::shade::Shading;

use super::{Kit, rule};
use crate::photo::Headlight;
use crate::viewer::develop::{BINS, Histogram};
use crate::viewer::model::WindowModel;

pub(super) fn show(ui: &mut Ui, model: &mut WindowModel, kit: &Kit) {
    let mut next = model.setup.clone();
    let plan = &mut next.plan;
    ui.horizontal(|ui| {
        let name = ui.heading("Exposure");
        let mut stops = libm::log2(plan.exposure);
        let slider = egui::Slider::new(&mut stops, -8.0..=8.0)
            .step_by(0.1)
            .custom_formatter(|stops, _| format!("{stops:+.1}"))
            .suffix(" EV");
        if ui.add(slider).labelled_by(name.id).changed() {
            // The number is rounded so that it is short on the command line.
            plan.exposure = (libm::exp2(stops) * 1e4).round().max(1.0) / 1e4;
        }
    });
    bars(ui, kit.histogram.as_ref());
    ui.horizontal(|ui| {
        ui.label("Response");
        for (response, name, help) in [
            (Response::Linear, "linear", "the paper's film"),
            (
                Response::Srgb,
                "sRGB",
                "the display's curve over linear light",
            ),
            (
                Response::Filmic,
                "filmic",
                "sRGB whose highlights do not clip",
            ),
        ] {
            let response = response.balanced(plan.response.balance());
            ui.selectable_value(&mut plan.response, response, name)
                .on_hover_text(help);
        }
    });
    let mut lit = model.headlight.resolve(plan.headlight).on;
    ui.horizontal(|ui| {
        if ui
            .checkbox(&mut lit, "Headlight")
            .on_hover_text("a light at the camera, as Inventor's viewers have")
            .changed()
        {
            plan.headlight = Headlight::Set(lit);
        }
        egui::ComboBox::from_label("Shading")
            .selected_text(plan.shading.name())
            .show_ui(ui, |ui| {
                let before = plan.usual_response();
                for model in Shading::ALL {
                    ui.selectable_value(&mut plan.shading, model, model.name());
                }
                if *plan.response.unbalanced() == before {
                    plan.response = plan.usual_response().balanced(plan.response.balance());
                }
            });
    });
    model.change("light", next);
    rule(ui);
}

/// Draws the curves of the channels with the shares of full and black pixels, or reserves their
/// space before the first picture.
fn bars(ui: &mut Ui, histogram: Option<&Histogram>) {
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width().min(260.0), 50.0), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, Color32::from_gray(16));
    let Some(histogram) = histogram else { return };
    let colors = [
        Color32::from_rgb(230, 70, 60),
        Color32::from_rgb(70, 190, 90),
        Color32::from_rgb(80, 130, 250),
    ];
    for (bins, color) in histogram.bins.iter().zip(colors) {
        let at = |(i, height): (usize, &f32)| {
            let x = rect.left() + (i as f32 + 0.5) / BINS as f32 * rect.width();
            pos2(x, rect.bottom() - 1.0 - height * (rect.height() - 4.0))
        };
        let points = bins.iter().enumerate().map(at).collect();
        painter.add(egui::Shape::line(points, egui::Stroke::new(1.2, color)));
    }
    let text = format!(
        "{:.1}% full, {:.1}% black",
        100.0 * histogram.clipped,
        100.0 * histogram.black
    );
    let corner = rect.right_top() + vec2(-4.0, 2.0);
    let font = egui::FontId::proportional(10.0);
    let gray = Color32::from_gray(170);
    painter.text(corner, egui::Align2::RIGHT_TOP, text, font, gray);
    response.on_hover_text("the number of pixels at each level");
}

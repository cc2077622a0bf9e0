//! The light panel: exposure with its histogram, the film, and the light of the scene.

use std::path::Path;

use egui::{Color32, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use ivcam_base::math::Meters;
use ivcam_optics::film::{Metering, Response, WhiteBalance};
use ivcam_render::shade::Shading;

use super::{Kit, rule};
use crate::photo::{Headlight, Plan};
use crate::viewer::develop::{BINS, Histogram};
use crate::viewer::model::{WindowModel, file_name};
use crate::viewer::setup::Setup;

/// Shutter times of a camera's dial: seconds, then parts of a second.
const SECONDS: [f64; 5] = [30.0, 15.0, 8.0, 4.0, 2.0];
const PARTS: [f64; 14] = [
    1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0,
];

/// Responses, as `--response` names them, with their descriptions.
const RESPONSES: [(&str, &str); 7] = [
    ("linear", "the paper's film"),
    ("srgb", "the display's curve over linear light"),
    ("filmic", "sRGB whose highlights do not clip"),
    ("reversal", "slide film"),
    ("negative,paper", "negative film, printed on paper"),
    ("mono,linear", "black and white, like `linear`"),
    ("mono,filmic", "black and white, like `filmic`"),
];

/// The width in points of the menu of responses.
const FILM_WIDTH: f32 = 134.0;

/// Daylight in kelvin, from which a white balance starts.
const DAYLIGHT: f64 = 5500.0;

pub(super) fn show(ui: &mut Ui, model: &mut WindowModel, kit: &Kit) {
    let mut next = model.setup.clone();
    let metered = model.frame.as_ref().map(|frame| frame.auto_exposure);
    exposure(ui, &mut next.plan, metered);
    bars(ui, kit.histogram.as_ref());
    shutter(ui, &mut next.plan, model);
    film(ui, &mut next.plan);
    shading(ui, &mut next, model);
    let studio = lamps(ui, &mut next.plan);
    model.change("light", next);
    if studio != model.setup.plan.light.studio {
        model.set_studio(studio);
    }
    rule(ui);
}

/// Shows the exposure, from which the slider goes on if it was metered.
fn exposure(ui: &mut Ui, plan: &mut Plan, metered: Option<f64>) {
    let factor = match (plan.meters, metered) {
        (true, Some(metered)) => metered,
        _ => plan.exposure,
    };
    ui.horizontal(|ui| {
        let name = ui.heading("Exposure");
        let mut stops = libm::log2(factor);
        let slider = egui::Slider::new(&mut stops, -8.0..=8.0)
            .clamping(egui::SliderClamping::Edits)
            .step_by(0.1)
            .custom_formatter(|stops, _| format!("{stops:+.1}"))
            .suffix(" EV");
        if ui.add(slider).labelled_by(name.id).changed() {
            // The number is rounded so that it is short on the command line.
            plan.exposure = (libm::exp2(stops) * 1e4).round().max(1.0) / 1e4;
            plan.meters = false;
        }
    });
}

/// Shows shutter and ISO. When they are switched on, the shutter time is the one of the dial with
/// which the picture keeps its brightness best.
fn shutter(ui: &mut Ui, plan: &mut Plan, model: &WindowModel) {
    ui.horizontal(|ui| {
        let mut on = plan.metering.is_some();
        let help = "exposes by shutter, ISO and aperture in the light of the sun";
        if ui
            .checkbox(&mut on, "Shutter")
            .on_hover_text(help)
            .changed()
        {
            plan.metering = on.then(|| Metering::new(usual_shutter(model)));
        }
        let mut metering = plan.metering.unwrap_or(Metering::new(1.0 / 60.0));
        ui.add_enabled_ui(on, |ui| {
            let combo = egui::ComboBox::from_id_salt("shutter")
                .selected_text(metering.dial())
                .width(76.0)
                .height(440.0)
                .show_ui(ui, |ui| {
                    for seconds in dial() {
                        let name = Metering::new(seconds).dial();
                        ui.selectable_value(&mut metering.shutter, seconds, name);
                    }
                });
            let info = || WidgetInfo::labeled(Role::ComboBox, on, "Shutter time");
            combo.response.widget_info(info);
            let name = ui.label("ISO");
            let field = egui::DragValue::new(&mut metering.iso)
                .range(1.0..=1e6)
                .clamp_existing_to_range(false);
            ui.add(field.max_decimals(0)).labelled_by(name.id);
        });
        if on {
            plan.metering = Some(metering);
        }
    });
}

/// Returns the shutter times in seconds.
fn dial() -> impl Iterator<Item = f64> {
    let parts = PARTS.into_iter().map(|part| 1.0 / part);
    SECONDS.into_iter().chain(parts)
}

/// Returns the shutter time with which a white surface comes nearest to white at ISO 100.
fn usual_shutter(model: &WindowModel) -> f64 {
    let view = model.frame.as_ref().map(|frame| &frame.view);
    let Some(camera) = view.and_then(|view| view.lens_camera()) else {
        return 1.0 / 60.0;
    };
    let white = |shutter| Metering::new(shutter).level_of_white(camera.metered_irradiance());
    let off = |shutter: &f64| libm::log2(white(*shutter)).abs();
    let nearest = dial().min_by(|a, b| off(a).total_cmp(&off(b)));
    nearest.unwrap_or(1.0 / 60.0)
}

/// Shows the response of the film and the white balance.
fn film(ui: &mut Ui, plan: &mut Plan) {
    ui.horizontal(|ui| {
        let now = plan.response.unbalanced().name();
        let mut chosen = now.clone();
        let names = now.split(',').map(|part| file_name(Path::new(part)));
        let shown = names.collect::<Vec<_>>().join(",");
        let combo =
            egui::ComboBox::from_id_salt("response").selected_text(format!("Film: {shown}"));
        let menu = |ui: &mut Ui| {
            ui.set_max_width(FILM_WIDTH);
            combo.width(FILM_WIDTH).truncate().show_ui(ui, |ui| {
                for (name, help) in RESPONSES {
                    ui.selectable_value(&mut chosen, name.to_owned(), name)
                        .on_hover_text(help);
                }
            })
        };
        let combo = ui.scope(menu).inner.response;
        let help = "how the film turns exposure into levels; drop a film's table for another";
        let combo = combo.on_hover_text(format!("{now}: {help}"));
        combo.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "Response"));
        if chosen != now
            && let Ok(response) = Response::open(&chosen)
        {
            plan.response = response.balanced(plan.response.balance());
        }
        let balance = plan.response.balance();
        let mut on = balance.is_some();
        let name = ui
            .checkbox(&mut on, "WB")
            .on_hover_text("white balance: the color temperature that shows as white");
        let mut kelvin = balance.map_or(DAYLIGHT, |balance| balance.kelvin());
        let field = egui::DragValue::new(&mut kelvin)
            .range(WhiteBalance::RANGE)
            .clamp_existing_to_range(false)
            .speed(20.0)
            .max_decimals(0)
            .suffix(" K");
        ui.add_enabled(on, field).labelled_by(name.id);
        let balance = WhiteBalance::of_kelvin(kelvin.round()).filter(|_| on);
        plan.response = plan.response.balanced(balance);
    });
}

fn shading(ui: &mut Ui, setup: &mut Setup, model: &WindowModel) {
    let plan = &mut setup.plan;
    let mut shading = plan.shading;
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
                for choice in Shading::ALL {
                    ui.selectable_value(&mut shading, choice, choice.name());
                }
            });
    });
    setup.set_shading(shading);
}

/// Shows the size of the lamps, and returns whether the scene is to be in a studio.
fn lamps(ui: &mut Ui, plan: &mut Plan) -> bool {
    let mut studio = plan.light.studio;
    ui.horizontal(|ui| {
        ui.checkbox(&mut studio, "Studio")
            .on_hover_text("puts the scene on white paper under soft lamps, by model path");
        let is_path = plan.shading == Shading::Path;
        let name = ui.label("Lamps");
        let mut centimeters = 100.0 * plan.light.light_size.0;
        let field = egui::DragValue::new(&mut centimeters)
            .range(0.0..=1000.0)
            .clamp_existing_to_range(false)
            .speed(0.2)
            .max_decimals(1)
            .suffix(" cm");
        let field = ui.add_enabled(is_path, field).labelled_by(name.id);
        let help = "the diameter of point and spot lights, whose shadows it makes soft";
        let field = field.on_hover_text(help);
        if field
            .on_disabled_hover_text(
                "choose the shading path: other models have lights without size",
            )
            .changed()
        {
            plan.light.light_size = Meters((10.0 * centimeters).round() / 1000.0);
        }
    });
    studio
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

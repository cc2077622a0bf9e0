//! The panels of the window. Each shows the [`WindowModel`] and changes it; they do not use each
//! other.

mod bar;
mod camera;
mod closing;
mod compare;
mod dialog;
mod drawing;
mod file;
mod fold;
mod glass;
mod keys;
mod light;
mod messages;
mod outside;
mod overlay;
mod picture;
mod pull;
mod rays;
mod settings;
mod wheel;
mod world;

use std::path::PathBuf;
use std::sync::Arc;

use egui::{Context, TextureHandle, Ui, vec2};
use ivcam_base::diag::Sink;

use super::engine::Engine;
use super::files::DroppedKind;
use super::lenses::LensMenu;
use super::model::WindowModel;
use crate::photo::LensChoice;

pub(crate) use wheel::{Turn, wheel};

/// The state of the panels from one frame of the window to the next, besides the model.
pub(crate) struct Kit {
    pub lenses: LensMenu,
    /// The picture on screen, with the inputs that it was made of.
    picture: Option<TextureHandle>,
    shown: Option<picture::Shown>,
    histogram: Option<super::develop::Histogram>,
    archive: Option<(u64, TextureHandle)>,
    /// The lens that was last scrolled into view in the menu.
    lens_in_view: String,
    /// The words that the lenses of the menu have.
    lens_search: String,
    dialog: Option<dialog::Dialog>,
    fold: fold::Fold,
    outside: outside::DesktopRequests,
    /// Whether the list of keys is shown.
    keys: bool,
    hovering: Hovering,
    /// Whether the window has its style.
    compact: bool,
    wheel: f32,
    rays: rays::Section,
    /// A lens wide open, with its f-number.
    widest: Option<(LensChoice, Option<f64>)>,
}

/// The files that hover over the window, and what happens when they are dropped.
#[derive(Default)]
struct Hovering {
    paths: Vec<PathBuf>,
    text: String,
}

impl Kit {
    /// Returns the f-number of a lens wide open, from its prescription, because there may be no
    /// picture yet.
    fn widest_f_number(&mut self, lens: &LensChoice) -> Option<f64> {
        let open = LensChoice {
            f_number: None,
            ..lens.clone()
        };
        if let Some((known, f_number)) = &self.widest
            && *known == open
        {
            return *f_number;
        }
        let lens = open.open(&mut Sink::new()).ok();
        let f_number = lens.and_then(|lens| lens.real_f_number());
        self.widest = Some((open, f_number));
        f_number
    }
}

/// The window with its model, renderer and panels.
pub(crate) struct Window {
    pub model: WindowModel,
    pub engine: Engine,
    kit: Kit,
}

impl Window {
    /// Returns the window of a model and a renderer.
    pub(crate) fn new(model: WindowModel, engine: Engine, lenses: LensMenu) -> Self {
        let kit = Kit {
            lenses,
            picture: None,
            shown: None,
            histogram: None,
            archive: None,
            lens_in_view: String::new(),
            lens_search: String::new(),
            dialog: None,
            fold: fold::Fold::default(),
            outside: outside::DesktopRequests::default(),
            keys: false,
            hovering: Hovering::default(),
            compact: false,
            wheel: 0.0,
            rays: rays::Section::default(),
            widest: None,
        };
        Self { model, engine, kit }
    }

    /// Runs one frame: handles news, shows the panels, and sends orders.
    pub(crate) fn show(&mut self, ui: &mut Ui) {
        let ctx = &ui.ctx().clone();
        if !self.kit.compact {
            self.kit.compact = true;
            ctx.all_styles_mut(make_compact);
            ui.set_style(ctx.global_style());
        }
        let model = &mut self.model;
        for news in self.engine.news() {
            model.handle(news);
        }
        ctx.input(|i| {
            model.now = i.time;
            model.held = i.pointer.any_down();
        });
        dropped(ctx, model, &mut self.kit.hovering);
        keys::handle(ctx, model, &mut self.kit);
        self.kit.outside.ask(ctx, model);
        self.panels(ui);
        let model = &mut self.model;
        let plays = model.continue_playing() | model.continue_pull();
        if model.continue_flight()
            || plays
            || model.archive.mode == super::archive::ArchiveMode::Blink
        {
            ctx.request_repaint();
        }
        for order in model.orders() {
            self.engine.order(order);
        }
        if let Some(request) = model.take_request() {
            self.engine.show(request);
        }
        self.engine.refine(model.refine);
        for (setup, saving) in model.saves() {
            self.engine.save(setup, saving);
        }
        closing::show(ctx, model);
        if let Some(job) = model.alignment_job() {
            self.engine.align(job);
        }
    }

    fn panels(&mut self, ui: &mut Ui) {
        let ctx = &ui.ctx().clone();
        let (model, kit) = (&mut self.model, &mut self.kit);
        kit.fold.fit(ctx.content_rect().size());
        egui::Panel::top("bar").show(ui, |ui| bar::top(ui, model, kit));
        egui::Panel::bottom("status").show(ui, |ui| bar::status(ui, model));
        if !model.messages.is_empty() || model.refusal.is_some() {
            egui::Panel::bottom("messages")
                .resizable(true)
                .max_size(260.0)
                .show(ui, |ui| messages::show(ui, model));
        }
        if kit.fold.lenses {
            egui::Panel::left("camera")
                .exact_size(214.0)
                .show(ui, |ui| camera::menu(ui, model, kit));
        }
        if kit.fold.settings {
            let panel = egui::Panel::right("settings").exact_size(298.0);
            panel.show(ui, |ui| {
                // A solid bar shows that there is more below.
                ui.spacing_mut().scroll = egui::style::ScrollStyle::solid();
                let heading = egui::FontId::proportional(15.0);
                ui.style_mut()
                    .text_styles
                    .insert(egui::TextStyle::Heading, heading);
                egui::ScrollArea::vertical().show(ui, |ui| {
                    settings::focus(ui, model, kit);
                    settings::aperture(ui, model, kit);
                    glass::show(ui, model);
                    world::show(ui, model);
                    light::show(ui, model, kit);
                    overlay::choices(ui, model);
                    file::show(ui, model, kit);
                    compare::show(ui, model);
                });
            });
        }
        if kit.fold.section {
            let height = section_height(ui, model);
            egui::Panel::bottom("lens")
                .exact_size(height)
                .show(ui, |ui| rays::show(ui, model, &mut kit.rays));
        }
        egui::CentralPanel::default().show(ui, |ui| picture::show(ui, model, kit));
        file::confirm(ctx, model);
        keys::show(ctx, &mut kit.keys);
        if let Some(dialog) = &mut kit.dialog
            && !dialog.show(ctx, model)
        {
            kit.dialog = None;
        }
    }
}

/// Makes rows and buttons so low that the settings fit into a window of the first size.
fn make_compact(style: &mut egui::Style) {
    style.spacing.button_padding = vec2(4.0, 1.0);
    style.spacing.interact_size = vec2(40.0, 18.0);
}

/// Returns the height of the lens section: what the picture leaves of the room, within limits.
fn section_height(ui: &Ui, model: &WindowModel) -> f32 {
    let room = ui.available_rect_before_wrap();
    let film = model.setup.plan.film;
    let margin = 16.0;
    let picture = (room.width() - margin) * (film.height / film.width) as f32 + margin;
    let least = (0.21 * ui.ctx().content_rect().height()).clamp(120.0, 260.0);
    (room.height() - picture).floor().clamp(least, 260.0)
}

/// Returns whether the window is high enough to begin with all sections of the panel open.
fn is_high(ui: &Ui) -> bool {
    ui.ctx().content_rect().height() >= 1000.0
}

/// Draws a line between two sections of a panel.
fn rule(ui: &mut Ui) {
    ui.add(egui::Separator::default().spacing(4.0));
}

/// Opens files dropped on the window, and says what happens to those that hover over it.
fn dropped(ctx: &Context, model: &mut WindowModel, hovering: &mut Hovering) {
    let paths: Vec<PathBuf> = ctx.input(|i| {
        i.raw
            .hovered_files
            .iter()
            .filter_map(|f| f.path.clone())
            .collect()
    });
    if paths != hovering.paths {
        let action = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            format!("{name}: {}", DroppedKind::of(path).action())
        };
        hovering.text = paths.iter().map(action).collect::<Vec<_>>().join("\n");
        hovering.paths = paths;
    }
    if !hovering.paths.is_empty() {
        egui::Modal::new(egui::Id::unique("dropping")).show(ctx, |ui| ui.label(&hovering.text));
    }
    let files = ctx.input(|i| i.raw.dropped_files.clone());
    for file in files {
        model.take_file(file.path());
    }
}

/// Returns a function that wakes the window when there is news.
pub(crate) fn waker(ctx: &Context) -> Arc<dyn Fn() + Send + Sync> {
    let ctx = ctx.clone();
    Arc::new(move || ctx.request_repaint())
}

//! The native window: eframe around [`Window`].

use eframe::egui;
use ivcam_base::diag::{Diagnostic, Result};

use super::engine::Engine;
use super::lenses::LensMenu;
use super::model::WindowModel;
use super::panels::{Window, waker};
use super::recent::RecentScenes;

/// The help for systems without a display.
const BATCH: &str = "make the picture without a window: `-batch`, or `ivcam render`";

/// Opens the window on a model and returns when it is closed. `print` receives lines for the
/// terminal.
///
/// # Errors
/// Fails if there is no display, or no OpenGL on it.
pub(crate) fn run(
    mut model: WindowModel,
    output: Option<String>,
    threads: usize,
    print: fn(&str),
) -> Result<()> {
    displayed()?;
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("ivcam")
            .with_app_id("ivcam")
            .with_inner_size([1360.0, 860.0])
            .with_drag_and_drop(true),
        ..Default::default()
    };
    let start = move |cc: &eframe::CreationContext<'_>| {
        let wake = waker(&cc.egui_ctx);
        let engine = Engine::start(threads, wake.clone())?;
        model.recent = RecentScenes::of_user();
        if let Some(output) = output {
            model.output = output;
        }
        let window = Window::new(model, engine, LensMenu::start(wake));
        Ok(Box::new(App { window, print }) as Box<dyn eframe::App>)
    };
    eframe::run_native("ivcam", options, Box::new(start)).map_err(|error| not_opened(&error))
}

/// Returns the message of a window that cannot be opened. That of the window system about a display
/// names a line of its source, and no display.
fn not_opened(error: &eframe::Error) -> Box<Diagnostic> {
    use eframe::Error::{Winit, WinitEventLoop};
    let why = match error {
        Winit(_) | WinitEventLoop(_) => format!("no display answers{}", named_displays()),
        other => other.to_string(),
    };
    Diagnostic::error(format!("the window can't be opened: {why}")).with_help(BATCH)
}

/// Returns the displays that the environment names, in parentheses.
fn named_displays() -> String {
    let named = |name: &&str| std::env::var(name).is_ok_and(|value| !value.is_empty());
    let names = ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().filter(named);
    let values = names.map(|name| format!("`{name}={}`", std::env::var(name).unwrap_or_default()));
    match values.collect::<Vec<_>>().join(", ") {
        values if values.is_empty() => values,
        values => format!(" ({values})"),
    }
}

/// Checks that Unix has a display server, for a better message than the window system's.
fn displayed() -> Result<()> {
    let named = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    if cfg!(all(unix, not(target_os = "macos"))) && !named("DISPLAY") && !named("WAYLAND_DISPLAY") {
        return Err(Diagnostic::error(
            "there is no display for the window; `-batch` (or `ivcam render`) makes the picture without one",
        ));
    }
    Ok(())
}

struct App {
    window: Window,
    print: fn(&str),
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        self.window.show(ui);
        if let Some(notice) = self.window.model.notice.take() {
            (self.print)(notice);
        }
    }
}

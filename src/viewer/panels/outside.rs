//! What the window asks of the desktop: a title with the file, and a size that fits the screen.

use egui::{Context, Vec2, ViewportCommand, vec2};

use crate::viewer::model::WindowModel;

/// The space in points that a desktop keeps for its bars and the window's own title.
const DESKTOP: Vec2 = vec2(0.0, 72.0);

/// What was asked of the desktop so far.
#[derive(Default)]
pub(super) struct DesktopRequests {
    title: String,
    fits: bool,
}

impl DesktopRequests {
    /// Sets the title when the scene changes, and once, as soon as the size of the screen is known,
    /// reduces a window that is larger.
    pub(super) fn ask(&mut self, ctx: &Context, model: &WindowModel) {
        let title = model.title();
        if title != self.title {
            ctx.send_viewport_cmd(ViewportCommand::Title(title.clone()));
            self.title = title;
        }
        let (screen, window) = ctx.input(|i| {
            let viewport = i.viewport();
            (viewport.monitor_size, viewport.inner_rect)
        });
        if let (false, Some(screen), Some(window)) = (self.fits, screen, window) {
            self.fits = true;
            let size = window.size().min(screen - DESKTOP);
            if size != window.size() {
                ctx.send_viewport_cmd(ViewportCommand::InnerSize(size));
            }
        }
    }
}

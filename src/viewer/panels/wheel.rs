//! The focus wheel, a thumb wheel as along the edges of SGI's viewers.

use egui::{Color32, Response, Role, Sense, Ui, WidgetInfo, pos2, vec2};

/// The radius of the wheel in points: the travel that turns it by a radian.
const RADIUS: f32 = 60.0;
/// The number of ridges around the wheel.
const RIDGES: usize = 36;

/// The turn of the wheel in this frame, in radians and in radians per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Turn {
    pub radians: f64,
    pub speed: f64,
}

/// Formats a distance with a unit.
pub(super) fn meters(distance: f64) -> String {
    match distance {
        d if !d.is_finite() => "∞".into(),
        d if d < 1.0 => format!("{:.1} cm", 100.0 * d),
        d if d < 10.0 => format!("{d:.3} m"),
        d if d < 100.0 => format!("{d:.2} m"),
        d => format!("{d:.0} m"),
    }
}

/// Shows a wheel that can be dragged, scrolled over, or turned by the arrow keys when it has the
/// keyboard focus. `angle` is its angle, for the ridges.
pub(crate) fn wheel(ui: &mut Ui, name: &str, angle: &mut f32) -> (Response, Turn) {
    let size = vec2(ui.available_width().min(260.0), 26.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Slider, true, name));
    if response.clicked() || response.drag_started() {
        response.request_focus();
    }
    let mut turned = response.drag_delta().x / RADIUS;
    if response.hovered() {
        let scroll = ui.input_mut(|i| {
            let delta = i.smooth_scroll_delta;
            i.smooth_scroll_delta = egui::Vec2::ZERO;
            delta
        });
        turned += (scroll.y + scroll.x) / RADIUS / 4.0;
    }
    if response.has_focus() {
        ui.memory_mut(|m| {
            m.set_focus_lock_filter(
                response.id,
                egui::EventFilter {
                    horizontal_arrows: true,
                    vertical_arrows: true,
                    ..Default::default()
                },
            );
        });
        turned += keys(ui);
    }
    let seconds = ui.input(|i| i.stable_dt).max(1e-3);
    *angle += turned;
    draw(ui, rect, *angle, &response);
    let turn = Turn {
        radians: f64::from(turned),
        speed: f64::from(turned / seconds),
    };
    (response, turn)
}

fn keys(ui: &Ui) -> f32 {
    use egui::Key;
    let pressed = |key| ui.input(|i| i.num_presses(key)) as f32;
    let step = if ui.input(|i| i.modifiers.shift) {
        0.2
    } else {
        0.04
    };
    step * (pressed(Key::ArrowRight) + pressed(Key::ArrowUp)
        - pressed(Key::ArrowLeft)
        - pressed(Key::ArrowDown))
}

fn draw(ui: &Ui, rect: egui::Rect, angle: f32, response: &Response) {
    let painter = ui.painter_at(rect);
    let visuals = ui.style().interact(response);
    painter.rect_filled(rect, 4.0, visuals.bg_fill);
    let half = 0.5 * rect.width();
    for ridge in 0..RIDGES {
        let around = angle + ridge as f32 / RIDGES as f32 * std::f32::consts::TAU;
        let (sin, cos) = (libm::sinf(around), libm::cosf(around));
        if cos <= 0.0 {
            continue;
        }
        let x = rect.center().x + half * sin;
        let shade = Color32::from_gray((40.0 + 120.0 * cos) as u8);
        painter.line_segment(
            [pos2(x, rect.top() + 3.0), pos2(x, rect.bottom() - 3.0)],
            (1.5, shade),
        );
    }
    painter.rect_stroke(rect, 4.0, visuals.bg_stroke, egui::StrokeKind::Inside);
}

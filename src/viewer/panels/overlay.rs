//! The marks over the picture: their menu, and those that are lines.

use egui::{Color32, Painter, Rect, Stroke, Ui, pos2, vec2};

use crate::viewer::model::WindowModel;

use super::rule;

pub(super) fn choices(ui: &mut Ui, model: &mut WindowModel) {
    ui.heading("Overlays");
    let marks = &mut model.marks;
    ui.horizontal(|ui| {
        ui.checkbox(&mut marks.plane, "Focus plane").on_hover_text(
            "a tint over everything behind the focus distance, and a frame at that distance whose size shows it",
        );
        ui.checkbox(&mut marks.curved, "curved").on_hover_text(
            "the surface of sharp focus, traced through the lens, instead of the plane",
        );
        ui.checkbox(&mut marks.thirds, "Thirds");
    });
    ui.horizontal(|ui| {
        ui.checkbox(&mut marks.peaking, "Peaking")
            .on_hover_text("marks edges that are sharp");
        ui.checkbox(&mut marks.clipping, "Clipping")
            .on_hover_text("stripes where the picture is clipped or black");
        ui.checkbox(&mut marks.grid, "Grid");
    });
    rule(ui);
}

/// Draws the lines over the picture.
pub(super) fn lines(painter: &Painter, rect: Rect, model: &WindowModel) {
    let pen = Stroke::new(1.0, Color32::from_white_alpha(90));
    if model.marks.thirds {
        parts(painter, rect, 3, pen);
    }
    if model.marks.grid {
        parts(
            painter,
            rect,
            8,
            Stroke::new(0.6, Color32::from_white_alpha(70)),
        );
    }
    if model.marks.plane {
        region(painter, rect, model);
    }
}

fn parts(painter: &Painter, rect: Rect, count: usize, pen: Stroke) {
    for i in 1..count {
        let t = i as f32 / count as f32;
        painter.vline(rect.left() + t * rect.width(), rect.y_range(), pen);
        painter.hline(rect.x_range(), rect.top() + t * rect.height(), pen);
    }
}

/// Draws the scaled region of the paper: a frame in the focus plane, one tenth of the scene across.
/// Surfaces in front of it hide it.
fn region(painter: &Painter, rect: Rect, model: &WindowModel) {
    let distance = model.setup.focus();
    if !distance.is_finite() {
        return;
    }
    let half =
        0.05 * model.viewpoint().extent / distance / libm::tan(0.5 * model.height_angle()) / 2.0;
    let height = (half as f32 * rect.height()).clamp(2.0, 4.0 * rect.height());
    let frame = Rect::from_center_size(rect.center(), 2.0 * vec2(1.5 * height, height));
    let sight = PlaneVisibility {
        model,
        rect,
        distance,
    };
    let pen = Stroke::new(2.0, Color32::from_rgb(120, 190, 255));
    let corners = [
        frame.left_top(),
        frame.right_top(),
        frame.right_bottom(),
        frame.left_bottom(),
    ];
    for i in 0..4 {
        sight.line(painter, corners[i], corners[(i + 1) % 4], pen);
    }
    let c = frame.center();
    for across in [vec2(6.0, 0.0), vec2(0.0, 6.0)] {
        sight.line(painter, c - across, c + across, pen);
    }
    let fill = Color32::from_rgba_unmultiplied(90, 170, 255, 26);
    sight.fill(painter, frame.intersect(rect), fill);
}

/// The visibility of the focus plane behind nearer surfaces.
struct PlaneVisibility<'a> {
    model: &'a WindowModel,
    rect: Rect,
    distance: f64,
}

impl PlaneVisibility<'_> {
    fn sees(&self, at: egui::Pos2) -> bool {
        let t = (at - self.rect.min) / self.rect.size();
        let inside = self.rect.contains(at);
        let depth = self
            .model
            .depths
            .as_ref()
            .map(|d| d.at(f64::from(t.x), f64::from(t.y)));
        inside && depth.is_none_or(|depth| depth >= 0.999 * self.distance)
    }

    /// Draws the visible parts of a line, in pieces of a few points.
    fn line(&self, painter: &Painter, from: egui::Pos2, to: egui::Pos2, pen: Stroke) {
        let pieces = ((to - from).length() / 3.0).clamp(1.0, 2000.0) as usize;
        let at = |i: usize| from + (to - from) * (i as f32 / pieces as f32);
        for i in 0..pieces {
            if self.sees(at(i)) && self.sees(at(i + 1)) {
                painter.line_segment([at(i), at(i + 1)], pen);
            }
        }
    }

    fn fill(&self, painter: &Painter, rect: Rect, color: Color32) {
        const CELL: f32 = 6.0;
        let (columns, rows) = (
            (rect.width() / CELL) as usize + 1,
            (rect.height() / CELL) as usize + 1,
        );
        for row in 0..rows.min(400) {
            for column in 0..columns.min(400) {
                let min = pos2(
                    rect.left() + CELL * column as f32,
                    rect.top() + CELL * row as f32,
                );
                let cell = Rect::from_min_size(min, vec2(CELL, CELL)).intersect(rect);
                if cell.is_positive() && self.sees(cell.center()) {
                    painter.rect_filled(cell, 0.0, color);
                }
            }
        }
    }
}

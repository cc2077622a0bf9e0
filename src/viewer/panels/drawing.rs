//! A lens diagram on screen.

use egui::epaint::{Mesh, Vertex, WHITE_UV};
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Shape, Stroke, pos2};
use ivcam_optics::diagram::drawing::{Anchor, Drawing, DrawingOutput, DrawingText, Ink, Path};

/// Draws into a rectangle at the largest size that fits.
pub(super) fn paint(painter: &Painter, rect: Rect, drawing: &Drawing, dark: bool) {
    let (w, h) = (
        drawing.width.max(1.0) as f32,
        drawing.height.max(1.0) as f32,
    );
    let scale = (rect.width() / w).min(rect.height() / h);
    let corner = rect.center() - 0.5 * scale * egui::vec2(w, h);
    drawing.draw(&mut DrawingScreen {
        painter,
        corner,
        scale,
        dark,
    });
}

/// A part of the window that a drawing fills.
struct DrawingScreen<'a> {
    painter: &'a Painter,
    corner: Pos2,
    scale: f32,
    dark: bool,
}

impl DrawingScreen<'_> {
    fn place(&self, [x, y]: [f64; 2]) -> Pos2 {
        pos2(
            self.corner.x + self.scale * x as f32,
            self.corner.y + self.scale * y as f32,
        )
    }
}

impl DrawingOutput for DrawingScreen<'_> {
    fn path(&mut self, path: &Path) {
        let points: Vec<Pos2> = path.points.iter().map(|p| self.place(*p)).collect();
        if let (true, Ink::Glass(dense)) = (path.closed, path.ink) {
            self.painter.add(filled(&points, glass(dense, self.dark)));
        }
        let pen = line(path.ink, self.dark);
        stroke(self.painter, points, path.closed, path.dashed, pen);
    }

    fn dot(&mut self, at: [f64; 2], radius: f64, ink: Ink) {
        let radius = (radius as f32 * self.scale).max(1.0);
        let color = line(ink, self.dark).color;
        self.painter.circle_filled(self.place(at), radius, color);
    }

    fn dots(&mut self, places: &[[f64; 2]], radius: f64, ink: Ink) {
        let radius = radius as f32 * self.scale;
        let color = line(ink, self.dark).color;
        for at in places {
            self.painter.circle_filled(self.place(*at), radius, color);
        }
    }

    fn cross(&mut self, at: [f64; 2], _: f64, ink: Ink) {
        let (at, pen) = (self.place(at), line(ink, self.dark));
        for d in [egui::vec2(2.0, 2.0), egui::vec2(2.0, -2.0)] {
            self.painter.line_segment([at - d, at + d], pen);
        }
    }

    fn text(&mut self, text: &DrawingText) {
        let size = (text.size as f32 * self.scale).max(8.0);
        let align = match text.anchor {
            Anchor::Start => Align2::LEFT_BOTTOM,
            Anchor::Middle => Align2::CENTER_BOTTOM,
            Anchor::End => Align2::RIGHT_BOTTOM,
        };
        // The window's font lacks the prime.
        let words = text.words.replace('\u{2032}', "'");
        let color = line(text.ink, self.dark).color;
        let font = FontId::proportional(size);
        self.painter
            .text(self.place(text.at), align, words, font, color);
    }
}

fn stroke(painter: &Painter, points: Vec<Pos2>, closed: bool, dashed: bool, pen: Stroke) {
    if dashed || pen.width < 0.0 {
        painter.extend(Shape::dashed_line(
            &points,
            Stroke::new(1.0, pen.color),
            3.0,
            2.5,
        ));
    } else if closed {
        painter.add(Shape::closed_line(points, pen));
    } else {
        painter.add(Shape::line(points, pen));
    }
}

/// Returns a filled polygon of any shape; a meniscus is not convex.
fn filled(points: &[Pos2], color: Color32) -> Shape {
    let mut triangles: Vec<u32> = Vec::new();
    let corners = points.iter().map(|p| [f64::from(p.x), f64::from(p.y)]);
    earcut::Earcut::new().earcut(corners, &[], &mut triangles);
    Shape::mesh(Mesh {
        indices: triangles,
        vertices: points
            .iter()
            .map(|&pos| Vertex {
                pos,
                uv: WHITE_UV,
                color,
            })
            .collect(),
        texture_id: egui::TextureId::default(),
    })
}

fn glass(dense: u8, dark: bool) -> Color32 {
    let dense = dense.min(3);
    if dark {
        Color32::from_rgb(31 + 7 * dense, 43 + 10 * dense, 52 + 12 * dense)
    } else {
        Color32::from_rgb(233 - 16 * dense, 242 - 12 * dense, 248 - 10 * dense)
    }
}

/// Returns the line of an ink, with colors as in the files (after Okabe and Ito).
fn line(ink: Ink, dark: bool) -> Stroke {
    let pick = |light: u32, night: u32| {
        let c = if dark { night } else { light };
        Color32::from_rgb((c >> 16) as u8, (c >> 8) as u8, c as u8)
    };
    let rays = [
        (0x0072b2, 0x56b4e9),
        (0x009e73, 0x2fc79a),
        (0xd55e00, 0xf28a3c),
        (0xa0528e, 0xcc79a7),
    ];
    match ink {
        Ink::Axis => Stroke::new(0.7, pick(0x9aa5ad, 0x5b666e)),
        Ink::Glass(_) => Stroke::new(0.9, pick(0x40566b, 0x9db6ca)),
        Ink::Stop => Stroke::new(2.2, pick(0x1c2227, 0xe6eaed)),
        Ink::Film => Stroke::new(1.6, pick(0x1c2227, 0xe6eaed)),
        Ink::Ray(n) | Ink::Curve(n) => {
            let (light, night) = rays[usize::from(n) % 4];
            Stroke::new(0.8, pick(light, night))
        }
        Ink::Lost(n) => {
            let (light, night) = rays[usize::from(n) % 4];
            Stroke::new(0.6, pick(light, night).gamma_multiply(0.5))
        }
        Ink::Plane => Stroke::new(0.8, pick(0x68737c, 0x98a4ad)),
        Ink::Mark | Ink::Label => Stroke::new(0.9, pick(0x1c2227, 0xe6eaed)),
        Ink::Faint => Stroke::new(0.6, pick(0xc3cbd1, 0x3b444b)),
    }
}

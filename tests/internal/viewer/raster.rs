//! Rasterizes egui's triangles without a GPU: textured, blended, in single precision and in one
//! order, so that a picture of the window is the same on every machine.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use egui::epaint::{ImageData, Mesh, Primitive, Vertex};
use egui::{Color32, Rect, TextureId, TexturesDelta};

/// A texture's width and height, and its pixels row by row.
type Texels = ([usize; 2], Vec<Color32>);

/// The textures that egui has sent so far.
#[derive(Clone, Default)]
pub(crate) struct Textures(Arc<Mutex<HashMap<TextureId, Texels>>>);

impl egui_kittest::TestRenderer for Textures {
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        let mut all = self.0.lock().unwrap();
        let parts = |(id, parts)| std::iter::repeat(id).zip(parts);
        for (id, part) in delta.set.iter().flat_map(parts) {
            let ImageData::Color(image) = &part.image;
            match part.pos {
                None => {
                    all.insert(*id, (image.size, image.pixels.clone()));
                }
                Some([x, y]) => {
                    let Some((size, pixels)) = all.get_mut(id) else {
                        continue;
                    };
                    for (row, line) in image.pixels.chunks(image.size[0]).enumerate() {
                        let at = (y + row) * size[0] + x;
                        pixels[at..at + line.len()].copy_from_slice(line);
                    }
                }
            }
        }
        for id in &delta.free {
            all.remove(id);
        }
        delta.clear();
    }
}

/// A picture of the window in red, green and blue.
pub(crate) struct Canvas {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[f32; 3]>,
}

impl Canvas {
    pub(crate) fn draw(
        ctx: &egui::Context,
        output: &egui::FullOutput,
        textures: &Textures,
    ) -> Self {
        let screen = ctx.viewport_rect();
        let (width, height) = (screen.width() as usize, screen.height() as usize);
        let mut canvas = Self {
            width,
            height,
            pixels: vec![[0.0; 3]; width * height],
        };
        let all = textures.0.lock().unwrap();
        for part in ctx.tessellate(output.shapes.clone(), 1.0) {
            let Primitive::Mesh(mesh) = &part.primitive else {
                continue;
            };
            if let Some((size, pixels)) = all.get(&mesh.texture_id) {
                canvas.mesh(mesh, part.clip_rect, *size, pixels);
            }
        }
        canvas
    }

    fn mesh(&mut self, mesh: &Mesh, clip: Rect, size: [usize; 2], texture: &[Color32]) {
        for corners in mesh.indices.chunks_exact(3) {
            let corner = |i: usize| &mesh.vertices[corners[i] as usize];
            self.triangle([corner(0), corner(1), corner(2)], clip, size, texture);
        }
    }

    fn triangle(&mut self, v: [&Vertex; 3], clip: Rect, size: [usize; 2], texture: &[Color32]) {
        let [a, b, c] = v.map(|v| v.pos);
        let area = (b - a).x * (c - a).y - (b - a).y * (c - a).x;
        if area == 0.0 {
            return;
        }
        let low = |x: f32, edge: f32| x.max(edge).max(0.0) as usize;
        let high = |x: f32, edge: f32, end: usize| (x.min(edge).ceil().max(0.0) as usize).min(end);
        let (x0, x1) = (
            low(a.x.min(b.x).min(c.x), clip.left()),
            high(a.x.max(b.x).max(c.x), clip.right(), self.width),
        );
        let (y0, y1) = (
            low(a.y.min(b.y).min(c.y), clip.top()),
            high(a.y.max(b.y).max(c.y), clip.bottom(), self.height),
        );
        for y in y0..y1 {
            for x in x0..x1 {
                let p = egui::pos2(x as f32 + 0.5, y as f32 + 0.5);
                let side = |p0: egui::Pos2, p1: egui::Pos2| {
                    ((p1 - p0).x * (p - p0).y - (p1 - p0).y * (p - p0).x) / area
                };
                let (wa, wb, wc) = (side(b, c), side(c, a), side(a, b));
                // A pixel on a shared edge belongs to one triangle, by the top-left rule.
                let inside = |w: f32, p0: egui::Pos2, p1: egui::Pos2| {
                    w > 0.0
                        || (w == 0.0
                            && (p1.y > p0.y || (p1.y == p0.y && p1.x < p0.x)) == (area > 0.0))
                };
                if !(inside(wa, b, c) && inside(wb, c, a) && inside(wc, a, b) && clip.contains(p)) {
                    continue;
                }
                let mix = |f: fn(&Vertex) -> f32| wa * f(v[0]) + wb * f(v[1]) + wc * f(v[2]);
                let texel = sample(texture, size, mix(|v| v.uv.x), mix(|v| v.uv.y));
                let color = [
                    mix(|v| v.color.r().into()),
                    mix(|v| v.color.g().into()),
                    mix(|v| v.color.b().into()),
                    mix(|v| v.color.a().into()),
                ];
                let alpha = texel[3] * color[3] / 255.0;
                let pixel = &mut self.pixels[y * self.width + x];
                for i in 0..3 {
                    pixel[i] =
                        (texel[i] * color[i] / 255.0 + pixel[i] * (1.0 - alpha)).clamp(0.0, 1.0);
                }
            }
        }
    }

    pub(crate) fn levels(&self) -> Vec<u8> {
        let level = |x: &f32| (255.0 * x).round() as u8;
        self.pixels.iter().flatten().map(level).collect()
    }
}

/// Returns the texture interpolated between its four nearest texels, premultiplied, from 0 to 1.
fn sample(texture: &[Color32], [width, height]: [usize; 2], u: f32, v: f32) -> [f32; 4] {
    let (x, y) = (u * width as f32 - 0.5, v * height as f32 - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let texel = |x: f32, y: f32| {
        let at = |t: f32, n: usize| (t.max(0.0) as usize).min(n - 1);
        texture[at(y, height) * width + at(x, width)]
            .to_array()
            .map(|l| f32::from(l) / 255.0)
    };
    let (a, b, c, d) = (
        texel(x0, y0),
        texel(x0 + 1.0, y0),
        texel(x0, y0 + 1.0),
        texel(x0 + 1.0, y0 + 1.0),
    );
    std::array::from_fn(|i| {
        let top = a[i] + fx * (b[i] - a[i]);
        let bottom = c[i] + fx * (d[i] - c[i]);
        top + fy * (bottom - top)
    })
}

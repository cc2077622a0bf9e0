//! Flattens the curves of a glyph's outlines to lines.

use glam::Vec2;
use skrifa::outline::OutlinePen;

/// Flattens a glyph's curves to lines.
pub(super) struct Flattener {
    scale: f32,
    tolerance: f32,
    /// The closed polylines so far.
    pub outlines: Vec<Vec<Vec2>>,
}

impl Flattener {
    /// Returns a pen that scales its points, and flattens within a tolerance in scaled units.
    pub(super) fn new(scale: f32, tolerance: f32) -> Self {
        Self {
            scale,
            tolerance,
            outlines: Vec::new(),
        }
    }

    fn last(&self) -> Vec2 {
        let last = self.outlines.last().and_then(|o| o.last());
        last.copied().unwrap_or_default()
    }

    fn add(&mut self, p: Vec2) {
        let distinct = p != self.last();
        if let Some(outline) = self.outlines.last_mut()
            && (distinct || outline.is_empty())
        {
            outline.push(p);
        }
    }

    /// Returns the number of lines with which a curve is within the tolerance, if its middle is at
    /// most `sag` from its chord. Doubling the number of lines divides the error by four.
    fn pieces(&self, sag: f32) -> usize {
        ((sag / self.tolerance).sqrt().ceil() as usize).clamp(1, 64)
    }
}

impl OutlinePen for Flattener {
    fn move_to(&mut self, x: f32, y: f32) {
        self.outlines.push(vec![Vec2::new(x, y) * self.scale]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.add(Vec2::new(x, y) * self.scale);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        let (a, b) = (self.last(), Vec2::new(cx, cy) * self.scale);
        let c = Vec2::new(x, y) * self.scale;
        let pieces = self.pieces(0.25 * (a - 2.0 * b + c).length());
        for i in 1..=pieces {
            let t = i as f32 / pieces as f32;
            self.add(a.lerp(b, t).lerp(b.lerp(c, t), t));
        }
    }

    fn curve_to(&mut self, bx: f32, by: f32, cx: f32, cy: f32, x: f32, y: f32) {
        let a = self.last();
        let [b, c, d] = [(bx, by), (cx, cy), (x, y)].map(|(x, y)| Vec2::new(x, y) * self.scale);
        let bend = (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
        let pieces = self.pieces(0.75 * bend);
        for i in 1..=pieces {
            let t = i as f32 / pieces as f32;
            let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
            self.add(ab.lerp(bc, t).lerp(bc.lerp(cd, t), t));
        }
    }

    fn close(&mut self) {
        if let Some(outline) = self.outlines.last_mut()
            && outline.len() > 1
            && outline.first() == outline.last()
        {
            outline.pop();
        }
    }
}

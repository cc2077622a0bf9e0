//! Draws markers, which are bitmaps aligned to the pixels of the picture.

use glam::{DMat4, DVec2, Vec2, Vec3};

use super::quad;
use super::screen_aligned::facing;
use crate::geometry::{Corner, MarkerBitmap, marker_bitmap};
use crate::scene::canvas::Canvas;

/// Draws a marker with its center at the pixel of a corner. A negative index draws nothing.
pub(super) fn marker(corner: Corner, index: i32, world_from_object: DMat4, out: &mut dyn Canvas) {
    let Ok(index) = usize::try_from(index) else {
        return;
    };
    let MarkerBitmap { side, pixels } = marker_bitmap(index);
    let at = world_from_object.transform_point3(corner.position.as_dvec3());
    let Some(screen) = out.picture().screen() else {
        return out.dot(corner, side as f32);
    };
    let Some(point) = screen.project(at) else {
        return;
    };
    let middle = DVec2::new(0.0, 0.5 * f64::from(out.picture().rows % 2));
    let low = (point + middle).floor() - middle - point - (side / 2) as f64;
    facing(at, out, |out| {
        for (y, row) in pixels.chunks_exact(side).enumerate() {
            let mut from = 0;
            for run in row.chunk_by(|a, b| a == b) {
                if run[0] {
                    let low = low.as_vec2() + Vec2::new(from as f32, y as f32);
                    strip(corner, low, run.len() as f32, out);
                }
                from += run.len();
            }
        }
    });
}

/// Draws a horizontal run of pixels. `low` is its lower left corner relative to the marker's point.
fn strip(corner: Corner, low: Vec2, length: f32, out: &mut dyn Canvas) {
    let at = |x: f32, y: f32| Corner {
        position: Vec3::new(low.x + x, low.y + y, 0.0),
        normal: Vec3::Z,
        ..corner
    };
    let corners = [at(0.0, 0.0), at(length, 0.0), at(length, 1.0), at(0.0, 1.0)];
    quad(corners, out);
}

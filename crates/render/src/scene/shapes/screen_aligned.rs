//! Draws shapes with a size in pixels that face the camera: texts and images. `markers` has the
//! markers.

use std::sync::Arc;

use glam::{DMat4, DVec2, DVec3, Vec2, Vec3};
use ivcam_inventor::grammar::{Field, image};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{
    AlphaMode, State, TextureCoordinates, TextureElement, TextureModel,
};

use super::quad;
use crate::geometry::Corner;
use crate::geometry::text::PixelText;
use crate::scene::canvas::Canvas;
use crate::scene::looks::Texture;

/// Draws in a plane that faces the camera at a point of world space, with a pixel as the unit.
/// Draws nothing without a camera, or if the point is behind the camera.
pub(super) fn facing(at: DVec3, out: &mut dyn Canvas, draw: impl FnOnce(&mut dyn Canvas)) {
    let placed = out.picture().screen().and_then(|screen| {
        let scale = DVec3::splat(screen.pixel_at(at)?);
        let turn = screen.camera.orientation;
        Some(DMat4::from_scale_rotation_translation(scale, turn, at))
    });
    if let Some(world) = placed {
        out.with_world(world, draw);
    }
}

/// The aspect ratio of the window in which Coin measures a `Text2`.
const ASPECT: f64 = 4.0 / 3.0;

/// Returns the corners of Inventor's rectangle of a text at a point of world space, or `None` if it
/// is outside the view. Without a camera the view is Inventor's default, the cube from −1 to 1.
pub(super) fn text_rectangle(at: DVec3, text: &PixelText, out: &dyn Canvas) -> Option<[DVec3; 4]> {
    let (low, high) = text.rectangle;
    if low.x > high.x {
        return None;
    }
    let rows = f64::from(out.picture().rows);
    let window = DVec2::new(ASPECT * rows, rows);
    let (pixel, from_middle, right, up) = match out.picture().screen() {
        Some(screen) => {
            let turn = screen.camera.orientation;
            let pixel = DVec2::splat(screen.pixel_at(at)?);
            (pixel, screen.project(at)?, turn * DVec3::X, turn * DVec3::Y)
        }
        None => {
            let pixel = 2.0 / window;
            (pixel, at.truncate() / pixel, DVec3::X, DVec3::Y)
        }
    };
    let point = 0.5 * window + from_middle;
    let shift = if text.anchor == 0.0 {
        0.0
    } else if text.is_centered {
        -0.5 * f64::from(high.x - low.x)
    } else {
        -f64::from(high.x - low.x)
    };
    let corner = point.trunc() + DVec2::new(shift, 0.0);
    let (low, high) = (corner + low.as_dvec2(), corner + high.as_dvec2());
    // A rectangle that touches the right edge is outside; one that touches another edge is not
    // (Coin).
    let outside = low.x >= window.x || low.y > window.y || high.cmplt(DVec2::ZERO).any();
    let beyond = out.picture().screen().is_none() && at.z.abs() > 1.0;
    if outside || beyond {
        return None;
    }
    let place = |x: f64, y: f64| {
        let off = (DVec2::new(x, y) - point) * pixel;
        at + off.x * right + off.y * up
    };
    Some([
        place(low.x, low.y),
        place(high.x, low.y),
        place(high.x, high.y),
        place(low.x, high.y),
    ])
}

/// Draws rasterized text, aligned to the pixels of a picture with an even number of columns.
pub(super) fn pixels(at: DVec3, text: &PixelText, out: &mut dyn Canvas) {
    let shown = out.picture().screen().and_then(|screen| screen.project(at));
    let (Some(point), false) = (shown, text.coverage.is_empty()) else {
        return;
    };
    let middle = DVec2::new(0.0, 0.5 * f64::from(out.picture().rows % 2));
    let anchor = DVec2::new(f64::from(text.anchor), 0.0);
    let corner = (point + middle - anchor + 0.5).floor() - middle - point;
    let low = corner.as_vec2() + Vec2::new(text.left as f32, text.bottom as f32);
    let size = Vec2::new(text.width as f32, text.height as f32);
    out.set_text_texture(Texture::from_coverage(
        text.width,
        text.height,
        &text.coverage,
    ));
    facing(at, out, |out| rectangle(low, size, out));
}

/// Draws a rectangle with the whole texture. Its place and size are in pixels.
fn rectangle(low: Vec2, size: Vec2, out: &mut dyn Canvas) {
    let corner = |x: f32, y: f32| Corner {
        position: (low + size * Vec2::new(x, y)).extend(0.0),
        normal: Vec3::Z,
        material: 0,
        coordinates: Vec2::new(x, y),
        third: 0.0,
    };
    let corners = [
        corner(0.0, 0.0),
        corner(1.0, 0.0),
        corner(1.0, 1.0),
        corner(0.0, 1.0),
    ];
    quad(corners, out);
}

/// Sets the state for an `Image`: its picture is the texture, and it is unlit.
pub(super) fn prepare_image<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    state.texture = Some(TextureElement {
        node,
        model: TextureModel::Replace,
        blend_color: Vec3::ZERO,
        repeat_s: false,
        repeat_t: false,
        repeat_r: false,
        alpha: AlphaMode::Blend,
        quality: 0.1, // not interpolated, whatever the size in the node
    });
    state.further_textures = Arc::default();
    state.texture_matrix = glam::Mat4::IDENTITY;
    state.texture_coordinates = TextureCoordinates::Default;
    state.base_color = true;
}

/// Draws an `Image`: a picture at the origin that faces the camera. One texel is one pixel, unless
/// the node has another size.
pub(super) fn image<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    out.bound(Vec3::ZERO);
    let inline = node.find(image::IMAGE);
    let size = out
        .texture()
        .map(|t| (t.width as f32, t.height as f32))
        .or_else(|| {
            let image = inline.filter(|i| i.width > 0 && i.height > 0)?;
            Some((
                f64::from(image.width) as f32,
                f64::from(image.height) as f32,
            ))
        });
    let Some((width, height)) = size else {
        return;
    };
    let stated = |field: Field<i32>, own: f32| match node.get(field) {
        n if n > 0 => n as f32,
        _ => own,
    };
    let size = Vec2::new(stated(image::WIDTH, width), stated(image::HEIGHT, height));
    let across = match node.get(image::HOR_ALIGNMENT) {
        ..=image::HOR_ALIGNMENT_LEFT => 0.0,
        image::HOR_ALIGNMENT_CENTER => 0.5,
        _ => 1.0,
    };
    let up = match node.get(image::VERT_ALIGNMENT) {
        ..=image::VERT_ALIGNMENT_BOTTOM => 0.0,
        image::VERT_ALIGNMENT_HALF => 0.5,
        _ => 1.0,
    };
    let low = -size * Vec2::new(across, up);
    let at = state.world_from_object.transform_point3(DVec3::ZERO);
    facing(at, out, |out| rectangle(low, size, out));
}

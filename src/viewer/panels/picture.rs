//! The picture, the actions of the mouse on it, and the marks over it.

use egui::{
    Button, Color32, Context, Key, Label, PointerButton, Rect, Response, RichText, Role, Sense,
    TextureOptions, Ui, WidgetInfo, pos2, vec2,
};
use glam::{DVec2, DVec3};
use ivcam_optics::film::{Resolution, Response as FilmResponse};

use super::dialog::{Dialog, Purpose};
use super::{Kit, compare, overlay, world};
use crate::viewer::develop::{Marking, histogram, levels, mark};
use crate::viewer::model::{Marks, WindowModel};
use crate::viewer::navigate::Tool;

/// The inputs that the texture on screen was made of.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shown {
    serial: u64,
    samples: u32,
    width: u32,
    exposure: f64,
    response: FilmResponse,
    marks: Marks,
    focus: f64,
    depths: usize,
}

pub(super) fn show(ui: &mut Ui, model: &mut WindowModel, kit: &mut Kit) {
    let room = ui.available_rect_before_wrap();
    let film = model.setup.plan.film;
    let aspect = (film.width / film.height) as f32;
    let (rect, size) = place(room, aspect, ui.ctx().pixels_per_point());
    model.view_size = Some(size);
    let response = ui.allocate_rect(rect, Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Picture"));
    refresh(ui.ctx(), model, kit);
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, Color32::BLACK);
    if let Some(texture) = &kit.picture {
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), rect, whole, Color32::WHITE);
    }
    compare::paint(&painter, rect, model, kit);
    overlay::lines(&painter, rect, model);
    if !model.open && !model.opening {
        invite(ui, rect, model, kit);
    }
    mouse(ui, &response, rect, model);
}

/// Shows a button that opens a scene, where there is no picture yet.
fn invite(ui: &mut Ui, rect: Rect, model: &WindowModel, kit: &mut Kit) {
    let text = RichText::new("Open a scene …").size(18.0);
    let button = Rect::from_center_size(rect.center(), vec2(170.0, 36.0));
    if ui.put(button, Button::new(text)).clicked() {
        kit.dialog = Some(Dialog::open(Purpose::Open, model));
    }
    let hint = Rect::from_center_size(rect.center() + vec2(0.0, 40.0), vec2(rect.width(), 24.0));
    ui.put(
        hint,
        Label::new(RichText::new("or drop a file here").weak()),
    );
}

/// Returns the place of the picture in the middle of the room that there is, on whole pixels of the
/// screen, with the number of these pixels.
fn place(room: Rect, aspect: f32, pixels_per_point: f32) -> (Rect, Resolution) {
    let pixels = pixels_per_point * room.size();
    let width = pixels.x.min(pixels.y * aspect).max(1.0);
    let size = vec2(width.floor().max(1.0), (width / aspect).floor().max(1.0));
    let corner = (pixels_per_point * room.center() - 0.5 * size).round();
    let place = Rect::from_min_size(corner / pixels_per_point, size / pixels_per_point);
    let resolution = Resolution::of(size.x as u32, size.y as u32);
    (place, resolution)
}

/// Updates the texture if the picture or its marks have changed.
fn refresh(ctx: &Context, model: &WindowModel, kit: &mut Kit) {
    let Some(frame) = &model.frame else { return };
    let plan = &model.setup.plan;
    let shown = Shown {
        serial: frame.serial,
        samples: frame.samples,
        width: frame.resolution.width,
        exposure: plan.exposure,
        response: plan.response.clone(),
        marks: model.marks,
        focus: model.setup.focus(),
        depths: model
            .depths
            .as_ref()
            .map_or(0, |d| std::sync::Arc::as_ptr(d) as usize),
    };
    if kit.shown.as_ref() == Some(&shown) {
        return;
    }
    let size = [
        frame.resolution.width as usize,
        frame.resolution.height as usize,
    ];
    let mut pixels = levels(frame, plan.exposure, &plan.response);
    kit.histogram = Some(histogram(&pixels));
    let marking = Marking {
        marks: model.marks,
        depths: model.depths.as_deref(),
        surface: model.surface.as_ref(),
        focus: shown.focus,
    };
    mark(&mut pixels, size, &marking);
    let image = egui::ColorImage::from_rgb(size, &pixels);
    // A picture with the resolution of the view is shown pixel by pixel, others are interpolated.
    let options = TextureOptions::LINEAR;
    match &mut kit.picture {
        Some(texture) => texture.set(image, options),
        None => kit.picture = Some(ctx.load_texture("picture", image, options)),
    }
    kit.shown = Some(shown);
}

fn mouse(ui: &Ui, response: &Response, rect: Rect, model: &mut WindowModel) {
    let place = |at: egui::Pos2| {
        let t = (at - rect.min) / rect.size();
        (f64::from(t.x), f64::from(t.y))
    };
    model.cursor = response
        .hover_pos()
        .filter(|p| rect.contains(*p))
        .map(place);
    if world::feel(ui, response, rect, model) {
        return;
    }
    if response.clicked()
        && let Some((x, y)) = response.interact_pointer_pos().map(place)
    {
        match model.tool {
            Tool::Focus => model.focus_at(x, y),
            Tool::Seek => model.seek(x, y),
            _ => {}
        }
    }
    model.release_pivot();
    let drag = response.drag_delta() / rect.height();
    let drag = DVec2::new(f64::from(drag.x), f64::from(-drag.y));
    if drag != DVec2::ZERO {
        let tool = if response.dragged_by(PointerButton::Middle) {
            Tool::Pan
        } else if response.dragged_by(PointerButton::Secondary) {
            Tool::Orbit
        } else {
            model.tool
        };
        dragged(model, tool, drag);
    }
    if response.hovered() {
        scrolled(ui, model);
    }
}

/// Moves the camera by a drag, in fractions of the picture's height, y up.
fn dragged(model: &mut WindowModel, tool: Tool, by: DVec2) {
    let viewpoint = model.viewpoint();
    let angle = model.height_angle();
    let pose = match tool {
        Tool::Orbit => match model.orbit(DVec2::new(3.0 * by.x, -3.0 * by.y)) {
            Some(pose) => pose,
            None => return,
        },
        Tool::Pan => viewpoint.pan(DVec2::new(by.x, -by.y), angle),
        Tool::Dolly => viewpoint.dolly(2.0 * by.y),
        Tool::Fly => viewpoint.look(angle * by),
        Tool::Focus | Tool::Seek => return,
    };
    let control = if tool == Tool::Fly { "fly" } else { "camera" };
    keep_focus(model, control, &pose);
}

/// Moves the camera by the mouse wheel, or turns the focus wheel if Ctrl or Shift is held.
fn scrolled(ui: &Ui, model: &mut WindowModel) {
    let (scroll, focus, seconds) = ui.input(|i| {
        let by = i.smooth_scroll_delta.y + i.smooth_scroll_delta.x;
        let pinch = 300.0 * (i.zoom_delta() - 1.0);
        (
            by + pinch,
            i.modifiers.command || i.modifiers.shift,
            i.stable_dt,
        )
    });
    if scroll == 0.0 {
        return;
    }
    if focus {
        let radians = f64::from(scroll) / 240.0;
        let there = crate::viewer::sharpness::wheel(
            model.setup.focus(),
            radians,
            radians / f64::from(seconds.max(1e-3)),
        );
        model.edit("focus wheel", |s| s.set_focus(there));
    } else {
        let viewpoint = model.viewpoint();
        let pose = viewpoint.dolly(f64::from(scroll) / 400.0);
        keep_focus(model, "camera", &pose);
    }
}

/// Moves the camera without changing its own focal distance.
fn keep_focus(
    model: &mut WindowModel,
    control: &'static str,
    pose: &ivcam_inventor::pose::CameraPose,
) {
    let focus = model.setup.focus();
    model.go(control, pose);
    if model.setup.plan.focus.is_none() {
        model.edit(control, |s| s.set_focus(focus));
    }
}

/// Handles the keys of flying: a tenth of the scene per second, faster with Shift.
pub(super) fn fly(ctx: &Context, model: &mut WindowModel) {
    if model.tool != Tool::Fly {
        return;
    }
    let (by, seconds) = ctx.input(|i| {
        let way = |plus, minus| f64::from(i8::from(i.key_down(plus)) - i8::from(i.key_down(minus)));
        let by = DVec3::new(
            way(Key::D, Key::A),
            way(Key::E, Key::Q),
            way(Key::W, Key::S),
        );
        let speed = if i.modifiers.shift { 0.3 } else { 0.1 };
        (speed * by, f64::from(i.stable_dt.min(0.1)))
    });
    if by != DVec3::ZERO {
        let viewpoint = model.viewpoint();
        let pose = viewpoint.fly(seconds * by);
        keep_focus(model, "fly", &pose);
        ctx.request_repaint();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On screens of every density, so that no pixel of the picture is enlarged or interpolated.
    #[test]
    fn the_picture_has_whole_pixels_of_the_screen() {
        for density in [1.0, 1.25, 1.5, 2.0, 3.0] {
            for width in [300.0, 641.5, 848.0, 1332.3] {
                let room = Rect::from_min_size(pos2(222.0, 30.7), vec2(width, 0.63 * width));
                let (place, size) = place(room, 1.5, density);
                let pixels = density * place.size();
                let off = pixels - vec2(size.width as f32, size.height as f32);
                assert!(off.length() < 1e-2, "{density} {width}: {off}");
                let corner = density * place.min;
                assert!((corner - corner.round()).length() < 1e-2, "{corner}");
                assert!(room.expand(1.0).contains_rect(place));
            }
        }
    }
}

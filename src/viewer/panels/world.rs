//! The scene that answers to the pointer: its clock, and what the mouse does with sensors.

use egui::{CursorIcon, DragValue, PointerButton, Pos2, Rect, Response, Ui};

use super::rule;
use crate::viewer::model::WindowModel;

/// The seconds that *Play* lets pass.
const PLAY: f64 = 60.0;

/// Shows the time of the scene and what was touched, if the scene answers to the pointer.
pub(super) fn show(ui: &mut Ui, model: &mut WindowModel) {
    if !model.plays() {
        return;
    }
    ui.heading("World");
    ui.horizontal(|ui| {
        let mut time = model.setup.plan.time;
        let name = ui.label("Scene time");
        let field = DragValue::new(&mut time)
            .speed(0.02)
            .max_decimals(2)
            .suffix(" s");
        if ui.add(field).labelled_by(name.id).changed() {
            model.playing = None;
            model.edit("scene time", |s| s.plan.time = time);
        }
        let label = if model.playing.is_some() {
            "Pause"
        } else {
            "Play"
        };
        if ui
            .button(label)
            .on_hover_text("lets time pass in the scene")
            .clicked()
        {
            match model.playing {
                Some(_) => model.playing = None,
                None => {
                    model.history.keep(&model.setup, "play", model.now, false);
                    model.play_for(PLAY);
                }
            }
        }
    });
    let touches = model.setup.plan.actions.iter();
    let touches = touches.filter(|action| action.depends_on_viewer()).count();
    ui.horizontal(|ui| {
        ui.label(format!("Touches: {touches}"));
        let forget = ui.add_enabled(touches > 0, egui::Button::new("Forget touches"));
        if forget
            .on_hover_text("takes back all touches and drags")
            .clicked()
        {
            model.forget_touches();
        }
    });
    rule(ui);
}

/// Lets sensors and anchors feel the mouse, unless Shift is held. Returns whether they did, so that
/// the tool does nothing.
pub(super) fn feel(ui: &Ui, response: &Response, rect: Rect, model: &mut WindowModel) -> bool {
    let place = |at: Pos2| {
        let t = (at - rect.min) / rect.size();
        (f64::from(t.x), f64::from(t.y))
    };
    let (shift, origin) = ui.input(|i| (i.modifiers.shift, i.pointer.press_origin()));
    if model.sensor_drag.is_none() && shift {
        return false;
    }
    let at = response.interact_pointer_pos().map(place);
    if model.sensor_drag.is_some() {
        ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        match at.filter(|_| response.dragged_by(PointerButton::Primary)) {
            Some((x, y)) => model.drag_to(x, y),
            None => model.end_drag(at),
        }
        ui.ctx().request_repaint();
        return true;
    }
    if response.drag_started_by(PointerButton::Primary) {
        let pressed = origin.map(place).and_then(|(x, y)| model.pointed(x, y));
        let Some(pressed) = pressed.filter(|pressed| pressed.target.is_dragged) else {
            return false;
        };
        model.begin_drag(&pressed);
        return true;
    }
    let Some(under) = model.hover().filter(|_| !response.dragged()) else {
        return false;
    };
    ui.ctx().set_cursor_icon(match under.target.is_dragged {
        true => CursorIcon::Grab,
        false => CursorIcon::PointingHand,
    });
    if !response.clicked() {
        return false;
    }
    model.touch(&under);
    true
}

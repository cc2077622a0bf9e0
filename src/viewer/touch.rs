//! Clicks and drags on the picture that the scene answers to, and the scene's clock.
//!
//! A touch is an action of the plan, as `--touch` and `--drag` state it, at the time of the scene
//! when it was made and at the place where a viewer without a lens sees the point.

use glam::DVec2;
use ivcam_inventor::events::{Action, ActionKind, FRAME, PointerTarget};

use super::model::WindowModel;

/// The number of places of a drag that are kept. A longer drag has every second one.
const MOST_PLACES: usize = 33;
/// The seconds that the scene plays after a touch.
const AFTER_TOUCH: f64 = 3.0;

/// What a click at a place of the picture would act on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PointedTarget {
    pub target: PointerTarget,
    /// The place in the picture of a viewer without a lens.
    place: DVec2,
    /// The distance along the axis, in meters.
    depth: f64,
}

impl PointedTarget {
    /// Returns the name and the class of what acts.
    pub(crate) fn text(&self) -> String {
        let PointerTarget { name, class, .. } = &self.target;
        match name.is_empty() {
            true => (*class).to_owned(),
            false => format!("{class} {name}"),
        }
    }
}

/// What was last under the cursor.
pub(crate) struct Hovered {
    /// The cursor, and the view that it was on, by its address.
    at: ((f64, f64), usize),
    found: Option<PointedTarget>,
}

impl Hovered {
    /// Returns what a click does, for the status line.
    pub(crate) fn text(&self) -> Option<String> {
        let found = self.found.as_ref()?;
        let act = if found.target.is_dragged {
            "drag"
        } else {
            "click"
        };
        Some(format!("{act}: {}", found.text()))
    }
}

/// A drag of a sensor in progress.
#[derive(Clone, Debug)]
pub(crate) struct SensorDrag {
    /// The places of the pointer, each a step after the one before.
    places: Vec<DVec2>,
    /// The time of the scene at the press, in seconds.
    start: f64,
    step: f64,
    /// The present time at the press.
    since: f64,
    depth: f64,
}

impl SensorDrag {
    fn end(&self) -> f64 {
        rounded(self.start + (self.places.len() - 1) as f64 * self.step)
    }

    fn action(&self) -> Action {
        Action {
            time: self.start,
            node: String::new(),
            what: ActionKind::Drag {
                path: self.places.clone(),
                end: self.end(),
            },
            viewer: None,
        }
    }

    /// Adds the place of the pointer, for each step until a time.
    fn follow(&mut self, place: DVec2, now: f64) {
        let steps = ((now - self.since) / self.step) as usize;
        while self.places.len() <= steps {
            self.places.push(place);
        }
        if self.places.len() > MOST_PLACES {
            let mut number = 0;
            self.places.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.step *= 2.0;
        }
    }
}

/// Rounds a time or a place, so that command lines are short.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

impl WindowModel {
    /// Returns whether the scene answers to clicks, or was made to play.
    pub(crate) fn plays(&self) -> bool {
        let answers = self
            .frame
            .as_ref()
            .is_some_and(|f| f.view.pointer.is_some());
        answers || self.setup.plan.time != 0.0 || !self.setup.plan.actions.is_empty()
    }

    /// Returns what a click at a place of the picture, from 0 to 1, would act on.
    pub(crate) fn pointed(&self, x: f64, y: f64) -> Option<PointedTarget> {
        let view = &self.frame.as_ref()?.view;
        let scene = view.pointer.as_ref()?;
        let seen = view.look(x, y)?;
        let aspect = self.setup.plan.resolution.aspect();
        let place = view.pose.place_of_point(seen.point, aspect)?;
        let place = DVec2::new(rounded(place.x), rounded(place.y));
        let target = scene.target(&view.pose, place, aspect)?;
        Some(PointedTarget {
            target,
            place,
            depth: seen.distance,
        })
    }

    /// Finds what is under the cursor, unless it is known.
    pub(crate) fn hover(&mut self) -> Option<PointedTarget> {
        let (Some(cursor), Some(frame)) = (self.cursor, &self.frame) else {
            self.hovered = None;
            return None;
        };
        let at = (cursor, std::sync::Arc::as_ptr(&frame.view) as usize);
        if self.hovered.as_ref().is_none_or(|known| known.at != at) {
            let found = self.pointed(cursor.0, cursor.1);
            self.hovered = Some(Hovered { at, found });
        }
        self.hovered.as_ref()?.found.clone()
    }

    /// Touches what is at a place, and lets the scene play for a while.
    pub(crate) fn touch(&mut self, pointed: &PointedTarget) {
        let touch = Action {
            time: self.setup.plan.time,
            node: String::new(),
            what: ActionKind::Touch {
                place: Some(pointed.place),
            },
            viewer: None,
        };
        self.edit("touch", |s| s.plan.actions.push(touch));
        self.status = format!("touched the {}", pointed.text());
        self.play_for(AFTER_TOUCH);
    }

    /// Presses a sensor that is dragged.
    pub(crate) fn begin_drag(&mut self, pointed: &PointedTarget) {
        let drag = SensorDrag {
            places: vec![pointed.place, pointed.place],
            start: self.setup.plan.time,
            step: FRAME,
            since: self.now,
            depth: pointed.depth,
        };
        self.edit("drag", |s| s.plan.actions.push(drag.action()));
        self.status = format!("drags the {}", pointed.text());
        self.sensor_drag = Some(drag);
        self.playing = None;
    }

    /// Moves the pointer with the sensor that is dragged to a place of the picture, from 0 to 1.
    pub(crate) fn drag_to(&mut self, x: f64, y: f64) {
        let aspect = self.setup.plan.resolution.aspect();
        let (Some(mut drag), Some(frame)) = (self.sensor_drag.take(), &self.frame) else {
            return;
        };
        let view = &frame.view;
        let point = view.at_depth(x, y, drag.depth);
        let place = point.and_then(|point| view.pose.place_of_point(point, aspect));
        if let Some(place) = place {
            let place = DVec2::new(rounded(place.x), rounded(place.y));
            let before = drag.places.len();
            drag.follow(place, self.now);
            if drag.places.len() != before {
                self.show_drag(&drag);
            }
        }
        self.sensor_drag = Some(drag);
    }

    /// Releases the sensor that is dragged, where the pointer was last.
    pub(crate) fn end_drag(&mut self, last: Option<(f64, f64)>) {
        if let (Some((x, y)), Some(drag)) = (last, &mut self.sensor_drag) {
            // The release is a step of its own.
            drag.since -= drag.step;
            self.drag_to(x, y);
        }
        if let Some(drag) = self.sensor_drag.take() {
            self.show_drag(&drag);
            self.play_for(AFTER_TOUCH);
        }
    }

    /// Replaces the last action by a drag as far as it has come.
    fn show_drag(&mut self, drag: &SensorDrag) {
        self.edit("drag", |s| {
            s.plan.actions.pop();
            s.plan.actions.push(drag.action());
            s.plan.time = drag.end();
        });
    }

    /// Takes back all touches and drags.
    pub(crate) fn forget_touches(&mut self) {
        self.edit("forget touches", |s| {
            s.plan.actions.retain(|action| !action.depends_on_viewer());
        });
    }

    /// Lets the scene play for some seconds.
    pub(crate) fn play_for(&mut self, seconds: f64) {
        self.playing = Some(self.setup.plan.time + seconds);
        self.clock = self.now;
    }

    /// Continues to play, and returns whether the scene plays. Time passes when the picture of the
    /// last moment is there.
    pub(crate) fn continue_playing(&mut self) -> bool {
        let Some(until) = self.playing else {
            return false;
        };
        let passed = self.now - self.clock;
        if passed < FRAME || !self.shows_request() {
            return true;
        }
        self.clock = self.now;
        let time = rounded(self.setup.plan.time + passed.min(0.5)).min(until);
        // What began to play is one step for undo.
        self.setup.plan.time = time;
        if time >= until {
            self.playing = None;
        }
        true
    }
}

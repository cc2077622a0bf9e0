//! Each control against the state that it changes.

use egui::accesskit::Role;
use egui::{Key, Modifiers, PointerButton, vec2};
use egui_kittest::kittest::Queryable;
use ivcam_base::math::Mm;
use ivcam_optics::film::Response;
use ivcam_optics::lens::{FocusMethod, Iris};
use ivcam_render::shade::Shading;

use super::bench::{Bench, lens_of};
use crate::photo::{Headlight, Optics};
use crate::viewer::draft::Preview;
use crate::viewer::model::WindowModel;
use crate::viewer::navigate::Tool;

#[test]
fn every_lens_is_in_the_menu_and_a_click_selects_it() {
    let mut bench = Bench::open("lens");
    bench.click("biotar");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
    let shown = |m: &WindowModel| {
        m.frame
            .as_ref()
            .unwrap()
            .view
            .lens_camera()
            .is_some_and(|c| c.lens.name().contains("iotar"))
    };
    bench.until("the picture through it", shown);
    bench.click("Pinhole of the scene");
    assert_eq!(bench.setup().plan.optics, Optics::Pinhole);
    bench.click("Undo");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
    bench.click("Undo");
    assert_eq!(bench.setup().lens().unwrap().name, "double-gauss");
    bench.click("Redo");
    assert_eq!(bench.setup().lens().unwrap().name, "biotar");
}

#[test]
fn the_wheel_turns_by_drag_scroll_and_key_and_faster_at_a_distance() {
    let mut bench = Bench::open("wheel");
    let wheel = bench.harness.get_by_label("Focus wheel").rect().center();
    assert_eq!(bench.setup().focus(), 3.0);
    bench.drag(wheel, wheel + vec2(30.0, 0.0), PointerButton::Primary);
    let dragged = bench.setup().focus();
    assert!(dragged > 3.0, "{dragged}");
    bench.scroll(wheel, -200.0, Modifiers::NONE);
    let scrolled = bench.setup().focus();
    assert!(scrolled < dragged, "{scrolled}");
    let step = |bench: &mut Bench, from: f64| {
        bench.change(|m| m.edit("test", |s| s.set_focus(from)));
        bench.harness.key_press(Key::ArrowRight);
        bench.harness.run_steps(2);
        bench.setup().focus() - from
    };
    bench.click_at(wheel);
    let (near, far) = (step(&mut bench, 2.0), step(&mut bench, 20.0));
    assert!(
        near > 0.0 && (far / near - 10.0).abs() < 0.05,
        "{near} {far}"
    );
    bench.click("∞");
    assert_eq!(bench.setup().focus(), f64::INFINITY);
}

#[test]
fn a_click_focuses_on_what_is_there() {
    let mut bench = Bench::open("click");
    // The sphere's nearest point is 2.4 m away and is the first visible surface there.
    bench.click_at(bench.at(0.5, 0.5));
    bench.until("the focus", |m| m.focused.is_some());
    let found = bench.model().focused.unwrap();
    assert!((found.plain - 2.4).abs() < 0.01, "{found:?}");
    assert!((bench.setup().focus() / found.distance - 1.0).abs() < 1e-4);
    assert!((bench.setup().focus() - 2.4).abs() < 0.2, "{found:?}");
}

#[test]
fn the_result_of_autofocus_goes_when_the_focus_is_changed_otherwise() {
    let mut bench = Bench::open("stale");
    bench.click_at(bench.at(0.5, 0.5));
    bench.until("the focus", |m| m.focused.is_some());
    let shown = |bench: &Bench| {
        bench
            .harness
            .query_by_label_contains("autofocus ")
            .is_some()
    };
    bench.harness.run_steps(2);
    assert!(shown(&bench));
    bench.click("Undo");
    assert!(!shown(&bench));
}

#[test]
fn stops_and_blades_change_the_hole_and_the_depth_of_field() {
    let mut bench = Bench::open("stops");
    let open = bench.model().depth_of_field().unwrap();
    bench.click("f/8");
    assert_eq!(bench.setup().lens().unwrap().f_number, Some(8.0));
    bench.until("f/8", |m| {
        m.depth_of_field()
            .is_some_and(|d| d.far - d.near > 2.0 * (open.far - open.near))
    });
    bench.change(|m| {
        m.edit("aperture", |s| {
            lens_of(s).iris = Iris::Blades {
                count: 6,
                rotation: 0.0,
            }
        })
    });
    let hexagon = |m: &WindowModel| {
        m.frame
            .as_ref()
            .unwrap()
            .view
            .lens_camera()
            .is_some_and(|c| c.lens.prescription().iris != Iris::Round)
    };
    bench.until("blades", hexagon);
    bench.click("open");
    assert_eq!(bench.setup().lens().unwrap().f_number, None);
}

#[test]
fn the_focal_length_and_the_blades_are_those_of_the_fields() {
    let mut bench = Bench::open("fields");
    bench.put(Role::Slider, "Zoom", 0.5);
    assert_eq!(bench.setup().lens().unwrap().zoom, 0.5);
    bench
        .harness
        .get_by_role_and_label(Role::CheckBox, "Focal length")
        .click();
    bench.harness.run_steps(3);
    bench.put(Role::SpinButton, "Focal length", 35.0);
    assert_eq!(bench.setup().lens().unwrap().efl, Some(Mm(35.0)));
    let shown = |m: &WindowModel| {
        let lens = m.frame.as_ref().and_then(|f| f.view.lens_camera());
        // The value is half of 35 mm, because the zoom still scales it.
        lens.is_some_and(|c| (c.lens.first_order().efl() - 17.5).abs() < 1e-9)
    };
    bench.until("a lens of that length", shown);
    bench.put(Role::SpinButton, "Blades", 7.0);
    bench.put(Role::SpinButton, "turned", 15.0);
    let iris = bench.setup().lens().unwrap().iris.clone();
    let Iris::Blades { count, rotation } = iris else {
        panic!("{iris:?}");
    };
    assert!(count == 7 && (rotation.to_degrees() - 15.0).abs() < 1e-9);
    bench.put(Role::SpinButton, "Blades", 2.0);
    assert_eq!(bench.setup().lens().unwrap().iris, Iris::Round);
}

#[test]
fn the_focus_and_its_method_are_those_of_the_field_and_the_menu() {
    let mut bench = Bench::open("distance");
    bench.put(Role::SpinButton, "Focus 3.000 m", 1.75);
    assert_eq!(bench.setup().focus(), 1.75);
    bench.click("moves to focus");
    bench.click("lens");
    assert_eq!(bench.setup().lens().unwrap().method, FocusMethod::Lens);
    let shown = |m: &WindowModel| {
        let lens = m.frame.as_ref().and_then(|f| f.view.lens_camera());
        lens.is_some_and(|c| (c.focus.method, c.focus.distance) == (FocusMethod::Lens, 1750.0))
    };
    bench.until("a picture so focused", shown);
}

#[test]
fn the_movements_of_the_lens_are_those_of_the_sliders() {
    let mut bench = Bench::open("movements");
    bench.click("Movements");
    bench.harness.run_steps(8);
    for (name, value) in [
        ("tilt", 4.0),
        ("swing", -2.5),
        ("rise", 3.0),
        ("shift", -1.5),
    ] {
        bench.put(Role::Slider, name, value);
    }
    let moved = bench.setup().plan.movements;
    let angles = [moved.tilt, moved.swing].map(|a| (a.to_degrees() * 10.0).round() / 10.0);
    assert_eq!(angles, [4.0, -2.5]);
    assert_eq!((moved.rise, moved.shift), (3.0, -1.5));
    bench.click("Undo");
    assert_eq!(bench.setup().plan.movements.shift, 0.0);
}

#[test]
fn the_picture_to_save_has_the_size_and_samples_of_its_fields() {
    let mut bench = Bench::open("size");
    bench.put(Role::SpinButton, "Size", 120.0);
    let size = bench.setup().plan.resolution;
    assert_eq!((size.width, size.height), (120, 80));
    bench.click("Size as shown");
    let (size, view) = (
        bench.setup().plan.resolution,
        bench.model().view_size.unwrap(),
    );
    assert_eq!(size.width, view.width);
    assert!(size.width > 600 && size.height.abs_diff(view.height) <= 1);
    bench.put(Role::SpinButton, "Samples", 9.0);
    let plan = &bench.setup().plan;
    assert_eq!(plan.stop.samples, 9);
    bench.click("Refine");
    assert!(!bench.model().refine);
}

#[test]
fn light_and_shading_are_those_of_their_controls() {
    let mut bench = Bench::open("light");
    bench.click("Headlight");
    assert_eq!(bench.setup().plan.headlight, Headlight::Set(true));
    bench.click("Headlight");
    assert_eq!(bench.setup().plan.headlight, Headlight::Set(false));
    bench.click("sRGB");
    assert_eq!(bench.setup().plan.response, Response::Srgb);
    bench.click("Shading");
    bench.click("normal");
    assert_eq!(bench.setup().plan.shading, Shading::Normal);
    let slider = bench
        .harness
        .get_by_role_and_label(Role::Slider, "Exposure")
        .rect();
    bench.click_at(slider.left_center() + vec2(0.75 * slider.width(), 0.0));
    assert!(
        bench.setup().plan.exposure > 2.0,
        "{}",
        bench.setup().plan.exposure
    );
}

#[test]
fn overlays_tools_and_previews_are_chosen_by_click_and_key() {
    let mut bench = Bench::open("marks");
    for label in [
        "Focus plane",
        "curved",
        "Peaking",
        "Clipping",
        "Thirds",
        "Grid",
    ] {
        bench.click(label);
    }
    let marks = bench.model().marks;
    assert!(
        marks.plane
            && marks.curved
            && marks.peaking
            && marks.clipping
            && marks.thirds
            && marks.grid
    );
    bench.until("distances", |m| m.depths.is_some() && m.surface.is_some());
    for (tool, name, _) in Tool::ALL {
        bench.click(name);
        assert_eq!(bench.model().tool, tool);
    }
    bench.harness.key_press(Key::Num2);
    bench.harness.run_steps(2);
    assert_eq!(bench.model().tool, Tool::Orbit);
    for (preview, name, _) in Preview::ALL.into_iter().rev() {
        bench.click(name);
        assert_eq!(bench.model().preview, preview);
    }
}

#[test]
fn a_film_of_another_shape_keeps_pixels_square() {
    let mut bench = Bench::open("film");
    bench.click("Film");
    bench.click("6x6  56x56");
    let plan = &bench.setup().plan;
    assert_eq!((plan.film.width, plan.film.height), (56.0, 56.0));
    assert_eq!(plan.resolution.width, plan.resolution.height);
}

#[test]
fn a_lens_that_cannot_focus_there_offers_the_nearest_distance_that_it_can() {
    let mut bench = Bench::open("near");
    bench.change(|m| m.edit("focus", |s| s.set_focus(0.01)));
    bench.until("the refusal", |m| m.refusal.is_some());
    let nearest = bench.model().refusal.as_ref().unwrap().nearest.unwrap();
    assert!(nearest > 0.01 && bench.model().frame.is_some());
    bench.harness.get_by_label_contains("Focus at").click();
    bench.until("the picture there", |m| m.refusal.is_none());
    assert!((bench.setup().focus() / nearest - 1.0).abs() < 1e-3);
}

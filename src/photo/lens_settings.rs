//! Creates the camera of a plan, and lists the settings of its lens for the report.

use std::f64::consts::PI;

use glam::DVec2;
use indexmap::IndexMap;
use ivcam_base::diag::{Diagnostic, ErrorKind, Result, Sink};
use ivcam_base::math::Meters;
use ivcam_base::work::{Budget, Cut};
use ivcam_inventor::pose::{CameraPose, FilmPlane, Projection, ViewportMapping};
use ivcam_optics::lens::{FilmPlace, Focus, Iris, Lens};
use ivcam_render::camera::{Camera, FilmCamera, IdealLens, LensCamera, Pinhole, pixel_aspect};

use super::options::rear_element;
use super::plan::{Era, IdealChoice, LensChoice, Optics, Plan};
use super::pose::own_focus;

/// The ratio of the fields of the camera node and the lens, as tangents, above which they differ
/// far.
const FIELD_RATIO: f64 = 2.0;

/// The settings of a camera by name, in the order of the report.
type LensSettings = IndexMap<String, String>;

/// Returns the camera of a plan, and the settings of its lens.
pub(super) fn camera(
    plan: &Plan,
    pose: &CameraPose,
    sink: &mut Sink,
) -> Result<(Camera, LensSettings)> {
    if let Some(plane) = pose.film {
        return Ok(film_behind_solids(plan, plane, pose));
    }
    match &plan.optics {
        Optics::Pinhole => pinhole(plan, pose, sink),
        Optics::Ideal(choice) => ideal(choice, plan, pose),
        Optics::Lens(choice) => through_lens(choice, plan, pose, sink),
    }
}

/// Warns if a camera shows the scene otherwise than its node or the plan asks.
pub(super) fn warn_about_camera(plan: &Plan, pose: &CameraPose, camera: &Camera, sink: &mut Sink) {
    if let Camera::Pinhole(_) = camera {
        return;
    }
    warn_about_pixels(plan, sink);
    if let Camera::Film(_) = camera {
        return;
    }
    if pose.center != DVec2::ZERO {
        let warning = "the view of the scene's camera is off its axis, and the lens is on it";
        let help = "`--shift` and `--rise` move the lens against the film";
        sink.add(*Diagnostic::warning(warning).with_help(help));
    }
    if let Projection::Orthographic { .. } = pose.projection {
        sink.add(*parallel_view(pose));
    }
    if plan.focus.is_none() && pose.focal_distance < 0.0 {
        let text = format!(
            "the camera's `focalDistance` is {}, so the focus is at infinity",
            pose.focal_distance
        );
        let help = "give `--focus`, or a distance above 0";
        sink.add(*Diagnostic::warning(text).with_help(help));
    }
    if let (Camera::Lens(camera), Some(choice)) = (camera, plan.lens()) {
        warn_about_ghosts(plan, &camera.lens, sink);
        if let Some(warning) = other_field(choice, plan, pose, &camera.lens) {
            sink.add(*warning);
        }
    }
}

fn film_behind_solids(plan: &Plan, plane: FilmPlane, pose: &CameraPose) -> (Camera, LensSettings) {
    let film = FilmCamera::new(plane, plan.film, plan.aim, pose);
    let settings = [
        ("lens", "in the scene, as solids".into()),
        ("pupil", rear_element(film.disc_map())),
    ];
    (Camera::Film(film), to_map(settings))
}

/// Returns the warning that a lens cannot show the parallel view of a camera node.
fn parallel_view(pose: &CameraPose) -> Box<Diagnostic> {
    let warning = "the scene's camera is orthographic, and the lens makes a perspective";
    let help = match pose.near < 0.0 {
        true => {
            "`--lens none` shows the parallel view, and what is behind the camera's position too"
        }
        false => "`--lens none` shows the parallel view",
    };
    Diagnostic::warning(warning).with_help(help)
}

/// Returns a warning if the scene asks for a frame around the view, which is not drawn.
fn missing_frame(plan: &Plan, pose: &CameraPose) -> Option<Box<Diagnostic>> {
    let frame = match pose.viewport_mapping {
        ViewportMapping::CropViewportFillFrame => "FILL",
        ViewportMapping::CropViewportLineFrame => "LINE",
        _ => return None,
    };
    let [picture, own] = [plan.resolution.aspect(), pose.aspect_ratio];
    let is_beside = (picture / own - 1.0).abs() > 1e-3;
    is_beside.then(|| {
        let text = format!(
            "the frame of `CROP_VIEWPORT_{frame}_FRAME` is left out: beside the view nothing is drawn"
        );
        let help = "a picture of the shape that the camera's `aspectRatio` states has no frame";
        Diagnostic::warning(text).with_help(help)
    })
}

fn pinhole(plan: &Plan, pose: &CameraPose, sink: &mut Sink) -> Result<(Camera, LensSettings)> {
    if plan.metering.is_some() {
        return Err(
            Diagnostic::error("a pinhole has no aperture to expose a film through")
                .with_help("give a lens, or leave `--shutter` and `--iso` out"),
        );
    }
    let pinhole = Pinhole::new(pose, plan.resolution.aspect()).distorted(plan.distortion);
    if let Some(warning) = missing_frame(plan, pose) {
        sink.add(*warning);
    }
    let mut settings = to_map([("lens", "none (pinhole)".into())]);
    let is_distorted = plan.distortion != [0.0; 2];
    if is_distorted && matches!(pose.projection, Projection::Orthographic { .. }) {
        let warning = "an orthographic camera has no distortion: `--distortion` does nothing";
        sink.add(*Diagnostic::warning(warning));
    } else if is_distorted {
        let [k1, k2] = plan.distortion;
        settings.insert("distortion".into(), format!("{k1}, {k2}"));
    }
    Ok((Camera::Pinhole(pinhole), settings))
}

fn ideal(choice: &IdealChoice, plan: &Plan, pose: &CameraPose) -> Result<(Camera, LensSettings)> {
    let distance = plan.focus.unwrap_or_else(|| own_focus(pose));
    let lens = IdealLens::new(choice.efl, choice.f_number, distance, plan.film, pose);
    let lens = lens.ok_or_else(|| {
        Diagnostic::error(format!(
            "an ideal lens of {} mm can't focus at {} m",
            choice.efl.0, distance.0
        ))
        .with_help("focus farther away than the focal length")
        .of_kind(ErrorKind::CannotFocus)
    })?;
    let lens = lens.moved(&plan.movements, pose);
    let lens = lens.map_err(|fault| fault.diagnostic("ideal"))?;
    let mut settings = to_map([
        ("lens", "ideal".into()),
        ("efl", format!("{:.3} mm", choice.efl.0)),
        ("f-number", format!("f/{:.2}", choice.f_number)),
        ("focus", in_meters(distance)),
        ("film position", format!("{:.4} mm", lens.film_distance)),
    ]);
    settings.extend(movement_settings(plan));
    Ok((Camera::Ideal(lens), settings))
}

fn through_lens(
    choice: &LensChoice,
    plan: &Plan,
    pose: &CameraPose,
    sink: &mut Sink,
) -> Result<(Camera, LensSettings)> {
    let distance = plan.focus.unwrap_or_else(|| own_focus(pose));
    // The lens has an account of its own: it is the same for all scenes.
    let budget = Budget::current().renewed();
    let (lens, focus) = budget.during(|| choice.open_focused(distance, sink))?;
    let mut settings = lens_settings(choice, plan, &lens);
    let has_round_stop = lens.prescription().iris == Iris::Round;
    let loses = lens.reflects() || lens.is_obstructed() || !has_round_stop;
    let through = lens.axial_transmittance().filter(|_| loses);
    settings.extend(exposure_settings(plan, &lens));
    settings.extend(focus_settings(choice, plan, distance, &focus));
    let place = FilmPlace::new(&lens, &focus, &plan.movements, plan.film);
    let place = place.map_err(|fault| fault.diagnostic(lens.name()))?;
    let camera = budget.during(|| {
        let camera = LensCamera::with_film(lens, focus, place, plan.film, plan.aim, pose);
        match plan.dispersion {
            true => camera.dispersing(),
            false => camera,
        }
    });
    if let Some(cut) = budget.cut() {
        return Err(cut_search(&camera, &budget, cut));
    }
    if let Some(share) = through {
        // The f-number of a lens of round stop without losses that exposes alike.
        let t = (PI / (4.0 * camera.metered_irradiance() * share)).sqrt();
        settings.insert("t-number".into(), format!("T/{t:.2}"));
    }
    let state = if camera.is_dispersing() { "on" } else { "off" };
    settings.insert("dispersion".into(), state.into());
    Ok((Camera::Lens(Box::new(camera)), settings))
}

/// Returns the error that the search for a lens's pupil was cut.
fn cut_search(camera: &LensCamera, budget: &Budget, cut: Cut) -> Box<Diagnostic> {
    let Cut::Work = cut else {
        return budget.refusal(cut);
    };
    let (lens, work) = (&camera.lens, budget.work());
    let surfaces = lens.prescription().surfaces.len();
    let text = format!(
        "to find the pupil of `{}`, which has {surfaces} surfaces, takes more than {work} steps of \
         work",
        lens.name()
    );
    let help = "`--work N` raises the limit; `--pupil rear` needs no search";
    Diagnostic::beyond_limit(text).with_help(help)
}

/// Warns about pixels that are not square.
fn warn_about_pixels(plan: &Plan, sink: &mut Sink) {
    if (pixel_aspect(plan.film, plan.resolution) - 1.0).abs() > 1e-2 {
        sink.add(*Diagnostic::warning(format!(
            "pixels are not square: {}x{} mm of film on {}x{} pixels",
            plan.film.width, plan.film.height, plan.resolution.width, plan.resolution.height
        )));
    }
}

/// Warns about ghosts of a lens that does not reflect.
fn warn_about_ghosts(plan: &Plan, lens: &Lens, sink: &mut Sink) {
    if plan.ghosts && !lens.reflects() {
        let none = "there are no ghosts, because the lens's coating is ideal and reflects nothing";
        sink.add(*Diagnostic::warning(none).with_help("give `--coating mgf2` or none"));
    }
}

/// Returns a warning if the camera node sees far more or less than the lens, whose focal length was
/// not chosen. An orthographic camera sees its height at its focal distance. In 1999 the camera's
/// angle was ignored.
fn other_field(
    choice: &LensChoice,
    plan: &Plan,
    pose: &CameraPose,
    lens: &Lens,
) -> Option<Box<Diagnostic>> {
    let is_chosen = choice.efl.is_some() || choice.zoom != 1.0 || choice.zoom_position.is_some();
    let seen = match pose.projection {
        Projection::Perspective { height_angle } => libm::tan(0.5 * height_angle),
        Projection::Orthographic { .. } if pose.focal_distance <= 0.0 => return None,
        Projection::Orthographic { height } => 0.5 * height / pose.focal_distance,
    };
    if plan.era == Era::Vintage || is_chosen || pose.source.starts_with("viewAll") {
        return None;
    }
    let imaged = (0.5 * plan.film.height / lens.first_order().efl()).abs();
    let is_other = seen > FIELD_RATIO * imaged || imaged > FIELD_RATIO * seen;
    let degrees = |tangent: f64| 2.0 * libm::atan(tangent).to_degrees();
    is_other.then(|| {
        Diagnostic::warning(format!(
            "the scene's camera sees {:.0}° from bottom to top, and the lens {:.0}°",
            degrees(seen),
            degrees(imaged)
        ))
        .with_help(match 0.5 * plan.film.height / seen {
            efl if efl < 0.5 => {
                "no lens sees as much: `--lens none` shows what the camera sees".into()
            }
            efl if !efl.is_finite() => "the camera's `heightAngle` should be above 0".into(),
            efl => format!("`--efl {efl:.0}mm` shows what the camera sees"),
        })
    })
}

fn lens_settings(choice: &LensChoice, plan: &Plan, lens: &Lens) -> LensSettings {
    let mut settings = to_map([
        ("lens", choice.name.clone()),
        ("efl", format!("{:.3} mm", lens.first_order().efl())),
    ]);
    if let Some(n) = lens.real_f_number() {
        settings.insert("f-number".into(), format!("f/{n:.2}"));
    }
    if plan.ghosts {
        let pairs = lens.ghost_pairs().len();
        settings.insert("ghosts".into(), format!("{pairs} pairs of surfaces"));
    }
    settings
}

fn exposure_settings(plan: &Plan, lens: &Lens) -> LensSettings {
    let Some(metering) = &plan.metering else {
        return LensSettings::new();
    };
    let mut settings = to_map([
        ("shutter", metering.dial()),
        ("iso", metering.iso.to_string()),
        ("white", format!("{:.0} cd/m2", metering.white)),
    ]);
    if let Some(n) = lens.real_f_number() {
        let value = metering.exposure_value(n);
        settings.insert("ev".into(), format!("{value:.1}"));
    }
    settings
}

fn focus_settings(
    choice: &LensChoice,
    plan: &Plan,
    distance: Meters,
    focus: &Focus,
) -> LensSettings {
    let mut settings = to_map([
        ("focus", in_meters(distance)),
        ("focus method", choice.method.name().into()),
        ("film position", format!("{:.4} mm", focus.film_z)),
    ]);
    settings.extend(movement_settings(plan));
    if plan.diffraction {
        settings.insert("diffraction".into(), "on".into());
    }
    settings
}

/// The movements of the lens against the film.
fn movement_settings(plan: &Plan) -> impl Iterator<Item = (String, String)> {
    let moved = plan.movements.described();
    moved.map(|(name, value)| (name.to_owned(), value))
}

/// Formats a distance in meters, rounded to hundredths of a millimeter.
pub(super) fn in_meters(distance: Meters) -> String {
    format!("{} m", (distance.0 * 1e5).round() / 1e5)
}

fn to_map<const N: usize>(settings: [(&str, String); N]) -> LensSettings {
    settings.map(|(key, value)| (key.to_owned(), value)).into()
}

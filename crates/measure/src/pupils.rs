//! The pupils of the shipped lenses on a film of 36×24 mm: how many of the rays aimed at them get
//! through, and how many rays get through that are not aimed.

use std::process::ExitCode;

use ivcam_base::math::Meters;
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::{
    FilmPlace, FocusMethod, Iris, Lens, Movements, PupilTarget, shipped_names,
};

use super::optics::{cut_rays, pass_share};

/// The distance of the scene, in meters.
const SCENE: Meters = Meters(3.0);

/// A stop and a place of the film.
struct Case {
    name: &'static str,
    /// None is full aperture.
    f_number: Option<f64>,
    iris: Iris,
    moved: Movements,
}

pub(super) fn run(_: Vec<String>) -> ExitCode {
    let blades = |f_number: Option<f64>, name: &'static str| Case {
        name,
        f_number,
        iris: Iris::Blades {
            count: 6,
            rotation: 0.2,
        },
        moved: Movements::default(),
    };
    let moved = |f_number: Option<f64>, name: &'static str| Case {
        name,
        f_number,
        iris: Iris::Round,
        moved: Movements {
            tilt: 0.05,
            rise: 4.0,
            ..Movements::default()
        },
    };
    let round = Case {
        moved: Movements::default(),
        ..moved(None, "round stop, full aperture")
    };
    let cases = [
        round,
        blades(None, "six blades, full aperture"),
        blades(Some(5.6), "six blades, f/5.6"),
        blades(Some(22.0), "six blades, f/22"),
        moved(None, "tilt .05, rise 4 mm, full aperture"),
        moved(Some(22.0), "tilt .05, rise 4 mm, f/22"),
    ];
    println!("| case | lenses | median | below 95% | cut | of |\n|---|---|---|---|---|---|");
    for case in &cases {
        let mut shares: Vec<(f64, &str)> = Vec::new();
        let (mut cuts, mut all) = (Vec::new(), 0);
        for name in shipped_names() {
            let Some((lens, place)) = prepared(name, case) else {
                continue;
            };
            let radius = FilmFormat::STANDARD.half_diagonal();
            let target = PupilTarget::exit_pupil_of(&lens, &place, radius);
            shares.push((pass_share(&lens, &target, &place, radius), name));
            let (missed, passed) = cut_rays(&lens, &target, &place, radius);
            if missed > 0 {
                cuts.push(format!("{name} {missed}"));
            }
            all += passed;
        }
        shares.sort_by(|a, b| a.0.total_cmp(&b.0));
        let percent = |share: f64| format!("{:.1}%", 100.0 * share);
        let low = shares.iter().take_while(|(share, _)| *share < 0.95);
        let low: Vec<String> = low
            .map(|(s, name)| format!("{name} {}", percent(*s)))
            .collect();
        println!(
            "| {} | {} | {} | {} | {} | {all} |",
            case.name,
            shares.len(),
            percent(shares[shares.len() / 2].0),
            low.join(", "),
            cuts.join(", "),
        );
    }
    ExitCode::SUCCESS
}

/// A lens and the place of its film; none if the lens has no such stop, or its film no such place.
fn prepared(name: &str, case: &Case) -> Option<(Lens, FilmPlace)> {
    let lens = Lens::named(name).ok()?;
    let lens = match case.f_number {
        None => lens,
        Some(n) => lens.at_f_number(n).ok()?,
    };
    let lens = lens.with_iris(case.iris.clone());
    let focus = lens.focus(FocusMethod::Film, SCENE).ok()?;
    let place = FilmPlace::new(&lens, &focus, &case.moved, FilmFormat::STANDARD).ok()?;
    Some((lens, place))
}

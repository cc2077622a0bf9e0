//! Measures the numbers of docs/guide/paper.md and corrects the page.
//!
//! `cargo run --release -p measure -- paper-claims docs/guide/paper.md` corrects the page and
//! prints what was wrong; without a file it only prints what is wrong. Run it at the top of the
//! repository. Most of the numbers are rays through lenses (`paper_numbers`); those of renders are
//! here.

use std::fmt::Write as _;
use std::process::ExitCode;

use ivcam::photo::{CameraChoice, DiscMap, Era, LensChoice, Optics, Plan, Session};
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::film::Resolution;
use ivcam_render::camera::Aim;
use ivcam_render::render::Exposure;

use super::paper_numbers::{GIVEN, PAGE, RENDERED, quick};
use super::paper_page::{PageNumbers, corrected};

/// Returns the plan of the living room through a lens.
fn living_room(era: Era, camera: &str, lens: &str, efl: f64, focus: f64) -> Plan {
    let mut plan = Plan::of_era(era, "scenes/livroom/livroom.iv");
    plan.camera = Some(CameraChoice::File(camera.into()));
    plan.optics = Optics::Lens(LensChoice {
        efl: Some(Mm(efl)),
        ..LensChoice::named(lens)
    });
    plan.focus = Some(Meters(focus));
    plan
}

fn exposed(plan: Plan) -> (Session, Exposure) {
    let session = Session::open(plan).expect("the living room can be opened");
    let exposure = session.expose(&|_| ());
    (session, exposure)
}

/// Returns the levels of an exposure, from 0 to 1.
fn levels(exposure: &Exposure) -> impl Iterator<Item = f64> {
    let pixels = exposure.film.pixels.iter();
    pixels.flat_map(|p| p.mean.to_array().map(|v| v.clamp(0.0, 1.0)))
}

/// Returns the ratio of white to the root mean square difference of two exposures, in decibels.
fn psnr(a: &Exposure, b: &Exposure) -> f64 {
    let squares: Vec<f64> = levels(a)
        .zip(levels(b))
        .map(|(a, b)| (a - b).powi(2))
        .collect();
    -10.0 * (squares.iter().sum::<f64>() / squares.len() as f64).log10()
}

/// Adds the table of the paper's two approaches, and the sentences about it.
fn add_approaches(numbers: &mut PageNumbers) {
    let mut table = String::from(
        "| 180×120 pixels, 32 samples | seconds of one processor | estimated relative error, 95% interval |\n|---|---|---|\n",
    );
    let rear = Aim::RearElement(DiscMap::Concentric);
    let rows = [
        ("lens in the camera, exit pupil", Aim::ExitPupil, false),
        ("lens in the camera, rear element", rear, false),
        ("lens in the scene, rear element", rear, true),
    ];
    let made = rows.map(|(name, aim, solids)| {
        let mut plan = living_room(Era::Modern, "camera/cam-5.dat", "double-gauss", 60.0, 1.5);
        (plan.aim, plan.solids) = (aim, solids);
        plan.resolution = Resolution::new(180, 120).expect("it is not empty");
        plan.stop.samples = 32;
        let (session, exposure) = exposed(plan);
        let report = session.report(&exposure);
        let seconds = report.processor_seconds.unwrap_or(report.seconds.render);
        let percent = |share: Option<f64>| 100.0 * share.unwrap_or(f64::NAN);
        let error = percent(report.relative_rmse);
        let (low, high) = (
            percent(report.relative_rmse_low),
            percent(report.relative_rmse_high),
        );
        let _ = writeln!(
            table,
            "| {name} | {seconds:.1} | {error:.1}% ({low:.1} to {high:.1}%) |"
        );
        (seconds, error, exposure)
    });
    numbers.tables.push(("approaches", table));
    let [exit, camera, scene] = &made;
    numbers.phrase(RENDERED[0], [format!("{:.0}", scene.0 / camera.0)]);
    numbers.phrase(
        RENDERED[1],
        [format!("{:.0}%", 100.0 * (exit.1 / scene.1).powi(2))],
    );
    numbers.phrase(RENDERED[2], [format!("{:.0}", psnr(&camera.2, &scene.2))]);
}

/// Adds the share of rays that are lost on their way from the rear element of the telephoto.
fn add_lost_rays(numbers: &mut PageNumbers) {
    let mut plan = living_room(Era::Vintage, "camera/cam-6.dat", "telephoto", 180.0, 4.5);
    plan.stop.samples = 4;
    let (session, exposure) = exposed(plan);
    let lost = 1.0 - session.report(&exposure).passed_share;
    numbers.phrase(RENDERED[3], [format!("{:.0}%", 100.0 * lost)]);
}

pub(crate) fn run(arguments: Vec<String>) -> ExitCode {
    let file = arguments.first();
    match check(file.map_or(PAGE, |f| f), file.is_some()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Prints what is wrong on a page, and corrects it if it is to be written.
fn check(path: &str, is_written: bool) -> Result<(), Box<dyn std::error::Error>> {
    let page = std::fs::read_to_string(path)?;
    let mut numbers = quick();
    add_approaches(&mut numbers);
    add_lost_rays(&mut numbers);
    let corrections = numbers.corrections(&page)?;
    for correction in &corrections {
        println!("{}", correction.message);
    }
    let unexplained = numbers.unexplained(&page, &GIVEN);
    if !unexplained.is_empty() {
        return Err(format!("numbers that nothing measures: {}", unexplained.join(" ")).into());
    }
    match (corrections.len(), is_written) {
        (0, _) => println!("{path}: every number is right"),
        (count, true) => {
            std::fs::write(path, corrected(&page, corrections))?;
            println!("{path}: corrected {count} numbers and tables");
        }
        (count, false) => return Err(format!("{path}: {count} numbers or tables differ").into()),
    }
    Ok(())
}

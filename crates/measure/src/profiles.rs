//! Compares shipped lenses with measured profiles of the products that were made of the designs.
//!
//! `cargo run --release -p measure -- profiles PROFILES.json [--svg FOLDER]`
//!
//! PROFILES.json is written by `crates/measure/lensfun_profiles.py`. Tables go to stdout; `--svg`
//! writes a drawing for each lens, `photograph-NAME.svg`. Heights on the film are in millimeters,
//! lateral color is in micrometers, distortion in percent. The object is at infinity and the film
//! at the best focus of green.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use glam::DVec2;
use ivcam_base::diag::Result;
use ivcam_base::math::Mm;
use ivcam_optics::diagram::chart::{Chart, Series};
use ivcam_optics::diagram::drawing::{Anchor, Drawing};
use ivcam_optics::lens::{Lens, Meridian};
use serde::Deserialize;

/// The wavelengths of a sensor's colors in nanometers: about the means of its sensitivities.
const RED: f64 = 600.0;
const GREEN: f64 = 540.0;
const BLUE: f64 = 460.0;
/// The height in millimeters at which the tables state distortion and lateral color.
const HEIGHT: f64 = 18.0;

#[derive(Deserialize)]
struct Profiles {
    source: String,
    profiles: Vec<Profile>,
}

/// Heights on the film with a value at each.
type Curve = Vec<[f64; 2]>;

/// The measurement of a product at one focal length.
#[derive(Deserialize)]
struct Profile {
    /// The name of the shipped lens.
    lens: String,
    /// The tabulated position of a zoom, from 1.
    zoom_position: Option<usize>,
    /// The focal length to which the shipped lens is scaled, in millimeters.
    efl: Option<f64>,
    product: String,
    focal: f64,
    distortion: Curve,
    vignetting: Vec<Vignetting>,
    #[serde(default)]
    red: Curve,
    #[serde(default)]
    blue: Curve,
}

#[derive(Deserialize)]
struct Vignetting {
    f_number: f64,
    light: Curve,
}

/// The curves of a lens, computed by tracing rays through its prescription.
struct Traced {
    efl: f64,
    f_number: f64,
    distortion: Curve,
    /// The illumination relative to the axis at each f-number of the profile.
    vignetting: Vec<Curve>,
    red: Curve,
    blue: Curve,
}

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let folder = words.iter().position(|w| w == "--svg");
    let folder = folder.and_then(|at| words.get(at + 1));
    let Some(file) = words.first() else {
        return crate::usage("profiles");
    };
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{file}: {e}"));
    let all: Profiles = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{file}: {e}"));
    let traced = all.profiles.iter().map(trace).collect::<Result<Vec<_>>>();
    let traced = traced.unwrap_or_else(|error| panic!("{error}"));
    print!("{}", table(&all, &traced));
    let Some(folder) = folder else {
        return ExitCode::SUCCESS;
    };
    let pairs: Vec<_> = all.profiles.iter().zip(&traced).collect();
    for pairs in pairs.chunk_by(|a, b| a.0.lens == b.0.lens) {
        let file = Path::new(folder).join(format!("photograph-{}.svg", pairs[0].0.lens));
        if let Err(error) = std::fs::write(&file, drawing(pairs).to_svg()) {
            eprintln!("{}: {error}", file.display());
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// Traces the curves of a profile.
fn trace(profile: &Profile) -> Result<Traced> {
    let mut lens = Lens::named(&profile.lens)?;
    if let Some(position) = profile.zoom_position {
        lens = lens.at_zoom(position - 1)?;
    }
    if let Some(efl) = profile.efl {
        lens = lens.scaled_to(Mm(efl))?;
    }
    let [red, green, blue] = [RED, GREEN, BLUE].map(|nm| lens.at_wavelength(nm));
    let film_z = green.best_focus(f64::INFINITY).unwrap_or(f64::NAN);
    let heights: Vec<f64> = profile.distortion.iter().map(|p| p[0]).collect();
    let angle = |height: f64| Some(green.distortion(Meridian::Y, height, film_z)?.angle);
    // A fish-eye is measured against f θ.
    let is_fish_eye = angle(9.0).is_some_and(|a| a > 1.3);
    let projected = |a: f64| if is_fish_eye { a } else { libm::tan(a) };
    let center = 1e-3;
    let scale = center / angle(center).map_or(f64::NAN, projected);
    let over = |value: &dyn Fn(f64) -> Option<f64>| -> Curve {
        let all = heights.iter().filter_map(|h| Some([*h, value(*h)?]));
        all.collect()
    };
    let distortion = |h: f64| match h {
        0.0 => Some(0.0),
        _ => Some(100.0 * (h / (scale * projected(angle(h)?)) - 1.0)),
    };
    let lateral = |line: &Lens, h: f64| match h {
        0.0 => Some(0.0),
        _ => Some(1000.0 * (line.image_height(angle(h)?, h, film_z)? - h)),
    };
    let widest = green.real_f_number().unwrap_or(f64::NAN);
    let vignetting = profile.vignetting.iter().map(|measured| {
        let closed = green.at_f_number(measured.f_number.max(widest))?;
        let light = |h: f64| closed.irradiance(DVec2::new(0.0, h), film_z);
        let axis = light(0.0);
        Ok(over(&|h| Some(light(h) / axis)))
    });
    Ok(Traced {
        efl: lens.first_order().efl(),
        f_number: widest,
        vignetting: vignetting.collect::<Result<_>>()?,
        distortion: over(&distortion),
        red: over(&|h| lateral(&red, h)),
        blue: over(&|h| lateral(&blue, h)),
    })
}

/// The value of a curve at a height that it has; NaN elsewhere.
fn at(curve: &Curve, height: f64) -> f64 {
    let found = curve.iter().find(|p| (p[0] - height).abs() < 1e-9);
    found.map_or(f64::NAN, |p| p[1])
}

/// The largest difference of two curves.
fn largest(a: &Curve, b: &Curve) -> f64 {
    let off = a.iter().map(|p| (p[1] - at(b, p[0])).abs());
    off.filter(|v| v.is_finite()).fold(0.0, f64::max)
}

/// The table of the guide.
fn table(all: &Profiles, traced: &[Traced]) -> String {
    let mut text = format!(
        "Measured: {}. Each cell is by rays / measured, at {HEIGHT} mm; light at the corner, 21.5 mm.\n\n\
         | lens | product | distortion, % | greatest difference | red, µm | blue, µm | light |\n\
         |---|---|---|---|---|---|---|\n",
        all.source
    );
    for (measured, own) in all.profiles.iter().zip(traced) {
        let last = measured.distortion.last().map_or(0.0, |p| p[0]);
        let height = HEIGHT.min(last);
        let pair = |own: f64, measured: f64, places: usize| match measured.is_finite() {
            true => format!("{own:+.places$} / {measured:+.places$}"),
            false => "-".to_owned(),
        };
        let light = own.vignetting.iter().zip(&measured.vignetting);
        let light = light.map(|(curve, v)| {
            let (a, b) = (at(curve, last), at(&v.light, last));
            format!("f/{}: {a:.2} / {b:.2}", v.f_number)
        });
        let light: Vec<String> = light.collect();
        let _ = writeln!(
            text,
            "| {}, {:.1} mm f/{:.2} | {} at {} mm | {} | {:.2} | {} | {} | {} |",
            measured.lens,
            own.efl,
            own.f_number,
            measured.product,
            measured.focal,
            pair(
                at(&own.distortion, height),
                at(&measured.distortion, height),
                2
            ),
            largest(&measured.distortion, &own.distortion),
            pair(at(&own.red, height), at(&measured.red, height), 1),
            pair(at(&own.blue, height), at(&measured.blue, height), 1),
            light.join(", "),
        );
    }
    text
}

/// The charts of one lens: a row for each profile.
fn drawing(pairs: &[(&Profile, &Traced)]) -> Drawing {
    const WIDTH: f64 = 300.0;
    const HEIGHT: f64 = 190.0;
    const GUTTER: f64 = 24.0;
    let mut page = Drawing::new(3.0 * WIDTH + 4.0 * GUTTER, GUTTER);
    for (measured, own) in pairs {
        let title = format!(
            "{} at {} mm (dashed, measured) and {}, {:.1} mm (by rays)",
            measured.product, measured.focal, measured.lens, own.efl
        );
        page.text([GUTTER, page.height + 6.0], Anchor::Start, 13.0, title);
        for (i, chart) in charts(measured, own).into_iter().enumerate() {
            let x = GUTTER + i as f64 * (WIDTH + GUTTER);
            page.put(chart.draw(WIDTH, HEIGHT), [x, page.height + 22.0]);
        }
        page.height += HEIGHT + 22.0 + GUTTER;
    }
    page
}

/// Distortion, illumination and lateral color of one profile.
fn charts(measured: &Profile, own: &Traced) -> Vec<Chart> {
    let chart = |title: &str, unit: &str, series, y_span| Chart {
        title: title.into(),
        x_label: "height on the film, mm".into(),
        y_label: unit.into(),
        series,
        y_span,
        x_span: Some((0.0, measured.distortion.last().map_or(1.0, |p| p[0]))),
        upright: false,
    };
    let pair = |own: &Curve, other: &Curve, ink: u8, name: &str| {
        [
            Series::new(own.clone(), ink, name),
            Series::new(other.clone(), ink, "").dashed(),
        ]
    };
    let distortion = pair(&own.distortion, &measured.distortion, 0, "");
    let mut all = vec![chart("Distortion", "%", distortion.into(), (-0.5, 0.5))];
    if !measured.vignetting.is_empty() {
        let curves = own.vignetting.iter().zip(&measured.vignetting).enumerate();
        let series = curves.flat_map(|(i, (curve, v))| {
            pair(
                curve,
                &v.light,
                [0, 3][i.min(1)],
                &format!("f/{}", v.f_number),
            )
        });
        all.push(chart("Illumination", "", series.collect(), (0.0, 1.0)));
    }
    if !measured.red.is_empty() {
        let red = pair(&own.red, &measured.red, 2, "red");
        let blue = pair(&own.blue, &measured.blue, 1, "blue");
        let series = red.into_iter().chain(blue).collect();
        all.push(chart(
            "Lateral color against green",
            "µm",
            series,
            (-2.0, 2.0),
        ));
    }
    all
}

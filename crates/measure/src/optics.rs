//! Compares lenses with an oracle: `cargo run --release -p measure -- optics --
//! FOLDER`.
//!
//! FOLDER has `reference.json`, `extremes.json` and `lenses/*.json`. In them z = 0 is the last
//! vertex; here it is the first. A word that ends in `.json` is a reference of aberrations, made by
//! `crates/measure/optics_reference.py`. The program prints tables, with `--markdown` as in
//! docs/accuracy.md, and the exit code is 1 if a number is out of its bounds.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use glam::{DVec2, DVec3};
use ivcam_base::math::lanes::Width;
use ivcam_base::math::{Meters, Mm};
use ivcam_optics::lens::{
    Bundle, FilmPlace, Focus, FocusFault, FocusMethod, LANES, Lens, LensRay, LossKind, Meridian,
    PupilTarget, PupilWindow, RearElement, Toward, optics,
};
use ivcam_optics::prescription::{FirstOrder, formats, glass};
use ivcam_optics::sampling::{DiscMap, mix, unit};
use serde_json::{Value, json};

/// One of the tables.
type Part = fn(&Path, &mut Table);

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let is_reference = |word: &&String| word.ends_with(".json");
    let mut plain = words
        .iter()
        .filter(|w| !w.starts_with("--") && !is_reference(w));
    let references: Vec<&String> = words.iter().filter(is_reference).collect();
    let folder = plain.next().map(PathBuf::from);
    let parts: Vec<&String> = plain.collect();
    if folder.is_none() && references.is_empty() {
        return crate::usage("optics");
    }
    let all: [(&str, Part); 5] = [
        ("reference", reference),
        ("pictures", pictures),
        ("pupils", pupils),
        ("extremes", extremes),
        ("lanes", lanes),
    ];
    let names = all.map(|(name, _)| name);
    if let Some(unknown) = parts.iter().find(|part| !names.contains(&part.as_str())) {
        eprintln!(
            "there is no table `{unknown}`; the tables are {}",
            names.join(", ")
        );
        return ExitCode::from(2);
    }
    let wanted = |part: &str| parts.is_empty() || parts.iter().any(|p| *p == part);
    let mut table = Table {
        markdown: words.iter().any(|w| w == "--markdown"),
        ..Table::default()
    };
    for (_, part) in all.iter().filter(|(name, _)| wanted(name)) {
        if let Some(folder) = &folder {
            part(folder, &mut table);
        }
    }
    for file in references {
        super::optics_aberrations::run(Path::new(file), &mut table);
    }
    println!("\n{} of {} checks failed", table.failed, table.checks);
    if table.failed == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// A printed table, with the numbers of values in and out of bounds.
#[derive(Default)]
pub(super) struct Table {
    markdown: bool,
    checks: usize,
    failed: usize,
    /// The widths of the columns, without `--markdown`.
    widths: Vec<usize>,
}

impl Table {
    /// Starts a table with the names of its columns; the first is the lens or the case.
    pub(super) fn head(&mut self, columns: &[&str]) {
        let width = |(i, name): (usize, &&str)| name.len().max(if i == 0 { 24 } else { 10 });
        self.widths = columns.iter().enumerate().map(width).collect();
        println!();
        self.row(&columns.iter().map(|c| (*c).to_owned()).collect::<Vec<_>>());
        if self.markdown {
            println!("|{}", "---|".repeat(columns.len()));
        }
    }

    pub(super) fn row(&self, cells: &[String]) {
        if self.markdown {
            println!("| {} |", cells.join(" | "));
            return;
        }
        let padded = cells.iter().zip(&self.widths).enumerate();
        let line: Vec<String> = padded
            .map(|(i, (cell, w))| match i {
                0 => format!("{cell:<w$}"),
                _ => format!("{cell:>w$}"),
            })
            .collect();
        println!("{}", line.join(" ").trim_end());
    }

    pub(super) fn fail(&mut self, text: String) {
        self.failed += 1;
        println!("  FAIL {text}");
    }

    pub(super) fn check(&mut self, what: &str, ok: bool, text: impl Fn() -> String) {
        self.checks += 1;
        if !ok {
            self.fail(format!("{what}: {}", text()));
        }
    }
}

pub(super) fn read(path: &Path) -> Value {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    // The oracle writes NaN where its single-precision run had one.
    let text = String::from_utf8_lossy(&bytes)
        .replace("NaN", "null")
        .replace("Infinity", "1e300");
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

pub(super) fn num(value: &Value) -> f64 {
    match value {
        Value::String(digits) => digits.parse().unwrap_or(f64::NAN),
        other => other.as_f64().unwrap_or(f64::NAN),
    }
}

fn vector(value: &Value) -> DVec3 {
    DVec3::new(num(&value[0]), num(&value[1]), num(&value[2]))
}

fn relative(ours: f64, exact: f64) -> f64 {
    (ours - exact).abs() / exact.abs().max(1e-300)
}

// ---- reference.json ------------------------------------------------------------------------

fn reference(folder: &Path, table: &mut Table) {
    let root = read(&folder.join("reference.json"));
    table.head(&[
        "lens",
        "first order",
        "rays",
        "loose",
        "position",
        "direction",
        "focus",
    ]);
    for (name, entry) in root["lenses"].as_object().into_iter().flatten() {
        let lens = match Lens::open(folder.join(format!("lenses/{name}.json"))) {
            Ok(lens) => lens,
            Err(error) => {
                table.fail(error.render(false));
                continue;
            }
        };
        let first_order = first_order(&lens, entry, name, table);
        let rays = rays(&lens, entry, name, table);
        let focus = focus_cases(&lens, entry, name, table);
        table.row(&[
            name.clone(),
            format!("{first_order:.1e}"),
            rays.strict.to_string(),
            rays.loose.to_string(),
            format!("{:.1e}", rays.position),
            format!("{:.1e}", rays.direction),
            format!("{focus:.1e}"),
        ]);
    }
}

/// Returns the largest relative error of the first-order data. Positions are compared from the
/// front vertex, relative to the size of the lens if they are near 0.
fn first_order(lens: &Lens, entry: &Value, name: &str, table: &mut Table) -> f64 {
    let mut worst: f64 = 0.0;
    for (key, plane) in [
        ("first_order", Meridian::Y),
        ("first_order_x_plane", Meridian::X),
    ] {
        let exact = &entry[key];
        if exact.is_null() {
            continue;
        }
        let ours = lens.first_order_in(plane);
        let Some(focal) = ours.focal else {
            table.fail(format!("{name}: no focal length"));
            continue;
        };
        let length = num(&exact["length"]);
        let (enp, exp) = (ours.entrance_pupil, ours.exit_pupil);
        let at = |key: &str| num(&exact[key]) + length;
        let nan = f64::NAN;
        for (what, ours, exact) in [
            ("length", ours.length, length),
            ("efl", focal.efl, num(&exact["efl"])),
            ("bfl", focal.bfl, num(&exact["bfl"])),
            ("ffl", focal.ffl, num(&exact["ffl"])),
            ("power", ours.power, num(&exact["power"])),
            ("F_object", focal.front_focal_point, at("F_object")),
            ("F_image", focal.rear_focal_point, at("F_image")),
            ("P_object", focal.front_principal_plane, at("P_object")),
            ("P_image", focal.rear_principal_plane, at("P_image")),
            ("enp_z", enp.map_or(nan, |p| p.z), at("enp_z")),
            ("exp_z", exp.map_or(nan, |p| p.z), at("exp_z")),
            (
                "enp_r",
                enp.map_or(nan, |p| p.semi_diameter),
                num(&exact["enp_r"]),
            ),
            (
                "exp_r",
                exp.map_or(nan, |p| p.semi_diameter),
                num(&exact["exp_r"]),
            ),
            (
                "f-number",
                ours.f_number().unwrap_or(nan),
                num(&exact["fno_paraxial_stop"]),
            ),
        ] {
            let error = (ours - exact).abs() / exact.abs().max(1e-3 * length);
            worst = worst.max(error);
            table.check(name, error <= 1e-12, || {
                format!("{what} is {ours}, not {exact}")
            });
        }
    }
    worst
}

#[derive(Default)]
struct Rays {
    strict: usize,
    loose: usize,
    position: f64,
    direction: f64,
}

fn rays(lens: &Lens, entry: &Value, name: &str, table: &mut Table) -> Rays {
    let mut rays = Rays::default();
    for (i, ray) in entry["rays"].as_array().into_iter().flatten().enumerate() {
        let name = format!("{name} ray {i}");
        let (position, direction) = one_ray(lens, ray, &ray["o"], &ray["d"], ray, &name, table);
        rays.position = rays.position.max(position);
        rays.direction = rays.direction.max(direction);
        table.check(&name, position <= 1e-9, || {
            format!("position off by {position:.1e}")
        });
        table.check(&name, direction <= 1e-12, || {
            format!("direction off by {direction:.1e}")
        });
        match ray["strict"].as_bool() {
            Some(false) => rays.loose += 1,
            _ => rays.strict += 1,
        }
    }
    rays
}

/// Traces one ray and compares it with `exact`; returns the errors of position and direction.
fn one_ray(
    lens: &Lens,
    asked: &Value,
    o: &Value,
    d: &Value,
    exact: &Value,
    name: &str,
    table: &mut Table,
) -> (f64, f64) {
    let shift = lens.length() * DVec3::Z;
    let toward = if asked["dir"] == "forward" {
        Toward::Film
    } else {
        Toward::Scene
    };
    let apertures = asked["apertures"].as_bool().unwrap_or(true);
    let ray = LensRay::new(vector(o) + shift, vector(d));
    let path = lens.trace_path(&ray, toward, apertures);
    let status = exact["status"].as_str().unwrap_or("");
    let ours = match path.outcome {
        Ok(_) => "passed",
        Err(loss) => match loss.kind {
            LossKind::Missed => "missed",
            LossKind::Blocked => "blocked",
            LossKind::TotalReflection => "tir",
        },
    };
    let wanted = if status.starts_with("miss") {
        "missed"
    } else {
        status
    };
    if asked["strict"].as_bool() == Some(false) {
        table.check(name, ours != "passed", || format!("passed, not {wanted}"));
        return (0.0, 0.0);
    }
    table.check(name, ours == wanted, || format!("{ours}, not {wanted}"));
    if let (Err(loss), Some(surface)) = (&path.outcome, exact["surface"].as_u64()) {
        let ours = loss.surface as u64;
        table.check(name, ours == surface, || {
            format!("lost at {ours}, not at {surface}")
        });
    }
    let Ok(out) = path.outcome else {
        return (0.0, 0.0);
    };
    if wanted != "passed" {
        return (0.0, 0.0);
    }
    let mut position = (out.origin - shift - vector(&exact["exit_o"])).length();
    for (hit, exact) in path
        .hits
        .iter()
        .zip(exact["hits"].as_array().into_iter().flatten())
    {
        position = position.max((*hit - shift - vector(exact)).length());
    }
    (
        position,
        (out.direction - vector(&exact["exit_d"])).length(),
    )
}

fn focus_cases(lens: &Lens, entry: &Value, name: &str, table: &mut Table) -> f64 {
    let mut worst: f64 = 0.0;
    for case in entry["focus"]["cases"].as_array().into_iter().flatten() {
        let distance = case["distance_mm"].as_f64().unwrap_or(f64::INFINITY);
        let shift = lens.length();
        for (prefix, method) in [("A", FocusMethod::Film), ("B", FocusMethod::Lens)] {
            let key = |tail: &str| &case[format!("{prefix}_{tail}").as_str()];
            let focus = lens.focus(method, Meters(distance / 1000.0));
            let exact = num(key("film_z"));
            if key("film_z").is_null() && key("error").is_null() {
                continue; // The oracle has no case B for an image in a fluid.
            }
            match focus {
                Ok(Focus {
                    film_z,
                    magnification,
                    ..
                }) if exact.is_finite() => {
                    let mut error = relative(film_z, exact + shift);
                    if key("magnification").is_number() {
                        error = error.max(relative(magnification, num(key("magnification"))));
                    }
                    worst = worst.max(error);
                    table.check(name, error <= 1e-12, || {
                        format!("focus {prefix} at {distance}: film at {film_z}, {case}")
                    });
                }
                Err(fault) if !exact.is_finite() => {
                    let _ = fault;
                }
                other => table.fail(format!(
                    "{name}: focus {prefix} {distance}: {other:?} {case}"
                )),
            }
        }
    }
    worst
}

// ---- distortion, irradiance, spots, colour -------------------------------------------------

fn pictures(folder: &Path, table: &mut Table) {
    let root = read(&folder.join("reference.json"));
    table.head(&[
        "lens",
        "distortion %",
        "illumination",
        "spot",
        "best spot",
        "colour mm",
        "axial beam",
    ]);
    for (name, entry) in root["lenses"].as_object().into_iter().flatten() {
        let Ok(lens) = Lens::open(folder.join(format!("lenses/{name}.json"))) else {
            continue;
        };
        let distortion = distortion(&lens, entry, name, table);
        let light = illumination(&lens, entry, name, table);
        let (spot, best) = spots(&lens, entry, name, table);
        let colour = colour(&lens, entry, name, table);
        let beam = &entry["axial_beam"];
        let height = lens.axial_beam().height;
        let beam_error = relative(height, num(&beam["marginal_height"]));
        table.check(name, beam_error < 1e-9, || {
            format!("axial beam {height}, {beam}")
        });
        table.row(&[
            name.clone(),
            format!("{distortion:.1e}"),
            format!("{light:.2}"),
            format!("{:.2}%", 100.0 * spot),
            format!("{:.2}%", 100.0 * best),
            format!("{colour:.1e}"),
            format!("{beam_error:.1e}"),
        ]);
    }
}

fn distortion(lens: &Lens, entry: &Value, name: &str, table: &mut Table) -> f64 {
    let mut worst: f64 = 0.0;
    for (key, plane) in [("distortion", Meridian::Y), ("distortion_x", Meridian::X)] {
        let film_z = num(&entry[key]["film_z"]) + lens.length();
        for row in entry[key]["rows"].as_array().into_iter().flatten() {
            let Some(ours) = lens.distortion(plane, num(&row["h"]), film_z) else {
                table.fail(format!("{name}: no chief ray at {}", row["h"]));
                continue;
            };
            for (ours, exact) in [
                (100.0 * ours.f_tan, &row["dist_ftan_pct"]),
                (100.0 * ours.f_theta, &row["dist_ftheta_pct"]),
            ] {
                if exact.is_number() {
                    let error = (ours - num(exact)).abs();
                    worst = worst.max(error);
                    table.check(name, error < 1e-6, || format!("distortion {ours}, {row}"));
                }
            }
        }
    }
    worst
}

/// Returns the largest error of the relative illumination over the error that the oracle states for
/// the lens.
///
/// The oracle counts on a grid and takes the difference of two grids as its error, which is
/// accidentally small in some rows, 4e-8 in one. The bound is the largest error stated for the
/// lens. A row outside its own stated error is printed, with the results of two other integrations:
/// a count of 9 million rays, and [`by_rows`].
fn illumination(lens: &Lens, entry: &Value, name: &str, table: &mut Table) -> f64 {
    let part = &entry["relative_illumination"];
    let film_z = num(&part["film_z"]) + lens.length();
    let axis = lens.irradiance(DVec2::ZERO, film_z);
    let rows = part["rows"].as_array().cloned().unwrap_or_default();
    let stated = rows
        .iter()
        .map(|row| num(&row["err_est"]))
        .fold(0.0, f64::max);
    let mut worst: f64 = 0.0;
    for row in &rows {
        let film = DVec2::new(0.0, num(&row["h"]));
        let ours = lens.irradiance(film, film_z) / axis;
        let (exact, own) = (num(&row["E_rel"]), num(&row["err_est"]));
        let error = (ours - exact).abs() / (1.0 + exact);
        worst = worst.max(error / stated);
        table.check(name, error <= stated, || {
            format!("illumination {ours}, {row}")
        });
        if error <= own {
            continue;
        }
        let (on_axis, a) = count(lens, DVec2::ZERO, film_z);
        let (here, b) = count(lens, film, film_z);
        let counted = here / on_axis;
        let sigma = counted * (a / on_axis).hypot(b / here);
        let rows =
            |count| by_rows(lens, film, film_z, count) / by_rows(lens, DVec2::ZERO, film_z, count);
        let (fine, finer) = (rows(2000), rows(8000));
        println!(
            "  {name} at {} mm: {:.1} times the row's own statement, {:.2} of the lens's; its {exact:.8} \u{b1} \
             {own:.0e}; ivcam {:+.1e} from it; rows {:+.1e} (2000 rows {:+.1e}); 9 million rays {:+.1e} \u{b1} {sigma:.0e}",
            film.y,
            error / own,
            error / stated,
            ours - exact,
            finer - exact,
            fine - exact,
            counted - exact,
        );
    }
    worst
}

/// Returns the irradiance by rows across the rear vertex plane, for a film point on the y axis. The
/// ends of each row are found by bisection from whether rays pass; the integral along a row is
/// closed, and the rows are those of Gauss-Chebyshev quadrature. The figure must be symmetric in x
/// and convex.
fn by_rows(lens: &Lens, film: DVec2, film_z: f64, rows: u32) -> f64 {
    let z = film_z - lens.length();
    let passes = |aim: DVec2| {
        let origin = film.extend(film_z);
        let direction = aim.extend(lens.length()) - origin;
        lens.trace_from_film(&LensRay { origin, direction }).is_ok()
    };
    let reach = 1.5 * RearElement::new(lens, DiscMap::Concentric).radius;
    let end = |from: DVec2, way: DVec2| {
        let (mut inside, mut outside) = (0.0, 2.0 * reach);
        for _ in 0..56 {
            let middle = 0.5 * (inside + outside);
            *if passes(from + middle * way) {
                &mut inside
            } else {
                &mut outside
            } = middle;
        }
        inside
    };
    let start = (0..=4000)
        .map(|i| DVec2::new(0.0, reach * (f64::from(i) / 2000.0 - 1.0)))
        .find(|aim| passes(*aim));
    let Some(start) = start else { return 0.0 };
    let (low, high) = (
        start.y - end(start, -DVec2::Y),
        start.y + end(start, DVec2::Y),
    );
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let step = std::f64::consts::PI / f64::from(rows);
    let row = |i: u32| {
        let (sin, cos) = libm::sincos((f64::from(i) + 0.5) * step);
        let y = middle + half * cos;
        let x = end(DVec2::new(0.0, y), DVec2::X);
        let a2 = z * z + (y - film.y) * (y - film.y);
        let a = a2.sqrt();
        // This is 2 ∫ z² / (a² + x²)² dx from 0.
        let along = z * z * (x / (a2 * (a2 + x * x)) + libm::atan(x / a) / (a2 * a));
        along * half * sin * step
    };
    (0..rows).map(row).sum()
}

/// Returns the irradiance by counting rays over the rear element, and its standard error: nine
/// grids of a million cells, with one random ray per cell.
fn count(lens: &Lens, film: DVec2, film_z: f64) -> (f64, f64) {
    const SIDE: u64 = 1000;
    const GRIDS: u64 = 9;
    // A curved rear element has rays that cross the plane of its vertex beside it.
    let radius = 1.5 * RearElement::new(lens, DiscMap::Concentric).radius;
    let cell = 2.0 * radius / SIDE as f64;
    let random = |key: u64| unit(mix(key));
    let origin = film.extend(film_z);
    let mut bundle = Bundle::default();
    let mut weights = [0.0; LANES];
    let grid = |grid: u64| {
        let mut sum = 0.0;
        for first in (0..SIDE * SIDE).step_by(LANES) {
            for (lane, weight) in weights.iter_mut().enumerate() {
                let i = first + lane as u64;
                let key = (grid << 40) + (i << 1);
                let x = (i % SIDE) as f64 + random(key);
                let y = (i / SIDE) as f64 + random(key + 1);
                let across =
                    DVec3::new(x * cell - radius, y * cell - radius, lens.length()) - origin;
                let direction = across.normalize();
                bundle.set(lane, &LensRay { origin, direction });
                let square = across.length_squared();
                *weight = across.z * across.z / (square * square);
            }
            lens.trace_bundle_from_film(&mut bundle);
            let passed = (0..LANES).filter(|lane| bundle.passed(*lane));
            sum += passed.map(|lane| weights[lane]).sum::<f64>();
        }
        sum * cell * cell
    };
    let sums: Vec<f64> = (0..GRIDS).map(grid).collect();
    let n = GRIDS as f64;
    let mean = sums.iter().sum::<f64>() / n;
    let square = sums.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>();
    (mean, (square / (n * (n - 1.0))).sqrt())
}

fn spots(lens: &Lens, entry: &Value, name: &str, table: &mut Table) -> (f64, f64) {
    let Some(focal) = lens.first_order().focal else {
        return (f64::NAN, f64::NAN);
    };
    let film_z = focal.rear_focal_point;
    let (mut worst, mut worst_best): (f64, f64) = (0.0, 0.0);
    let h_max = num(&entry["h_max"]);
    for row in entry["spots_infinity_paraxial_film"]
        .as_array()
        .into_iter()
        .flatten()
    {
        let film = DVec2::new(0.0, h_max * num(&row["field"]));
        let Some(spot) = lens.spot(film, film_z, 400) else {
            table.fail(format!("{name}: no spot {row}"));
            continue;
        };
        let error = relative(spot.rms, num(&row["rms_mm"]));
        let best = relative(spot.best_rms, num(&row["rms_at_best_mm"]));
        (worst, worst_best) = (worst.max(error), worst_best.max(best));
        table.check(name, error < 0.01, || format!("spot {}, {row}", spot.rms));
        table.check(name, best < 0.01, || {
            format!("best spot {}, {row}", spot.best_rms)
        });
    }
    (worst, worst_best)
}

fn colour(lens: &Lens, entry: &Value, name: &str, table: &mut Table) -> f64 {
    let part = &entry["colour"];
    if part.is_null() {
        return 0.0;
    }
    let film_z = lens.first_order().focal.map_or(0.0, |f| f.rear_focal_point);
    let mut worst: f64 = 0.0;
    let mut check = |what: &str, ours: f64, exact: f64| {
        let error = (ours - exact).abs();
        worst = worst.max(error);
        table.check(name, error < 1e-6, || format!("{what} {ours}, not {exact}"));
    };
    for (line, nm) in [
        ("F", glass::medium::F_LINE),
        ("d", glass::D_LINE),
        ("C", glass::medium::C_LINE),
    ] {
        let there = lens.at_wavelength(nm);
        let Some(focal) = there.first_order().focal else {
            continue;
        };
        check("bfl", focal.bfl, num(&part[format!("bfl_{line}").as_str()]));
        check("efl", focal.efl, num(&part[format!("efl_{line}").as_str()]));
        for row in part["lateral"].as_array().into_iter().flatten() {
            let angle = num(&row["theta_deg"]).to_radians();
            let height = there.image_height(angle, num(&row["h_d"]), film_z);
            let exact = num(&row[format!("h_{line}").as_str()]);
            check("lateral", height.unwrap_or(f64::NAN), exact);
        }
    }
    worst
}

// ---- pupils --------------------------------------------------------------------------------

/// Compares the share of the rays aimed at the exit pupil that pass. Rays spread over more than the
/// rear element must find none outside the pupil.
fn pupils(folder: &Path, table: &mut Table) {
    let root = read(&folder.join("reference.json"));
    table.head(&[
        "lens",
        "full aperture",
        "f/8",
        "f/22",
        "cut",
        "of",
        "ms to measure",
    ]);
    for (name, entry) in root["lenses"].as_object().into_iter().flatten() {
        let Ok(open) = Lens::open(folder.join(format!("lenses/{name}.json"))) else {
            continue;
        };
        let film_radius = num(&entry["h_max"]);
        let film_z = open.first_order().focal.map_or(0.0, |f| f.rear_focal_point);
        let mut share = [f64::NAN; 3];
        let (mut cut, mut all) = (0, 0);
        let mut time = f64::NAN;
        for (i, f_number) in [None, Some(8.0), Some(22.0)].into_iter().enumerate() {
            let lens = match f_number {
                None => open.clone(),
                Some(n) => match open.at_f_number(n) {
                    Ok(lens) => lens,
                    Err(_) => continue,
                },
            };
            let clock = std::time::Instant::now();
            let target = PupilTarget::exit_pupil(&lens, film_z, film_radius);
            if i == 0 {
                time = clock.elapsed().as_secs_f64();
            }
            let place = FilmPlace::flat(film_z);
            share[i] = pass_share(&lens, &target, &place, film_radius);
            let (missed, passed) = cut_rays(&lens, &target, &place, film_radius);
            cut += missed;
            all += passed;
        }
        let percent = share.map(|s| match s.is_nan() {
            true => "wider than it opens".to_owned(),
            false => format!("{:.1}%", 100.0 * s),
        });
        let [open, f8, f22] = percent;
        table.row(&[
            name.clone(),
            open,
            f8,
            f22,
            cut.to_string(),
            all.to_string(),
            format!("{:.1}", 1e3 * time),
        ]);
        table.check(name, cut == 0, || {
            format!("the pupil cuts {cut} of {all} rays")
        });
        for share in share {
            let low = share < 0.95;
            table.check(name, !low, || format!("only {:.1}% pass", 100.0 * share));
        }
    }
}

/// Returns evenly distributed points of the unit cube in four dimensions (the generalized golden
/// ratios).
fn spread(i: usize) -> [f64; 4] {
    [
        0.856_674_883_854_502_9,
        0.733_891_856_627_126,
        0.628_706_721_037_808_6,
        0.538_597_257_223_601_1,
    ]
    .map(|step| (0.5 + step * (i + 1) as f64).fract())
}

fn through(lens: &Lens, film: DVec2, place: &FilmPlace, aim: DVec2) -> bool {
    let origin = place.point(film);
    let direction = aim.extend(lens.length()) - origin;
    lens.trace_from_film(&LensRay { origin, direction }).is_ok()
}

fn on_disc(radius: f64, u: f64, v: f64) -> DVec2 {
    let [x, y] = DiscMap::Concentric.point([u, v]);
    radius * DVec2::new(x, y)
}

/// Returns the share of the aimed rays that pass, over the area of the film that receives light.
/// The film is a disc, with a radius in millimeters.
pub(super) fn pass_share(
    lens: &Lens,
    target: &PupilTarget,
    place: &FilmPlace,
    film_radius: f64,
) -> f64 {
    let (mut aimed, mut passed) = (0usize, 0usize);
    for i in 0..40_000 {
        let [a, b, c, d] = spread(i);
        let film = on_disc(film_radius, a, b);
        let window = target.window(film);
        if !window.is_closed() {
            aimed += 1;
            passed += usize::from(through(lens, film, place, window.point(c, d)));
        }
    }
    passed as f64 / aimed as f64
}

/// Returns the number of rays that pass but are outside the window, and of all that pass.
pub(super) fn cut_rays(
    lens: &Lens,
    target: &PupilTarget,
    place: &FilmPlace,
    film_radius: f64,
) -> (usize, usize) {
    let rear = RearElement::new(lens, DiscMap::Concentric).radius;
    let (mut cut, mut passed) = (0, 0);
    for i in 0..400_000 {
        let [a, b, c, d] = spread(i);
        let film = on_disc(film_radius, a, b);
        let window = target.window(film);
        // Half of the rays are spread over everything, half over a box 20% wider than the window.
        let aim = match window {
            PupilWindow::Polygon(polygon) if i % 2 == 0 => {
                let reach = polygon.corners().map(|p| (p - polygon.center()).abs());
                let half = 1.2 * reach.fold(DVec2::ZERO, DVec2::max);
                polygon.center() + half * DVec2::new(2.0 * c - 1.0, 2.0 * d - 1.0)
            }
            _ => on_disc(1.3 * rear, c, d),
        };
        if through(lens, film, place, aim) {
            passed += 1;
            cut += usize::from(!window.contains(aim));
        }
    }
    (cut, passed)
}

// ---- lanes ---------------------------------------------------------------------------------

/// The tolerance between lanes and single rays: in millimeters, and in direction.
const APART: [f64; 2] = [1e-12, 1e-13];

/// Measures nanoseconds per ray, one by one and in lanes, and their difference.
fn lanes(folder: &Path, table: &mut Table) {
    let root = read(&folder.join("reference.json"));
    let widths = [Width::Plain, Width::detect()];
    table.head(&[
        "lens",
        "ns a ray",
        "in lanes",
        "at the widest",
        "apart, mm",
        "apart, direction",
    ]);
    for (name, entry) in root["lenses"].as_object().into_iter().flatten() {
        let Ok(lens) = Lens::open(folder.join(format!("lenses/{name}.json"))) else {
            continue;
        };
        let film_z = lens.first_order().focal.map_or(0.0, |f| f.rear_focal_point);
        let film_radius = num(&entry["h_max"]);
        let target = PupilTarget::exit_pupil(&lens, film_z, film_radius);
        let rays: Vec<LensRay> = (0..64 * LANES)
            .map(|i| {
                let [a, b, c, d] = spread(i);
                let film = on_disc(film_radius, a, b);
                let origin = film.extend(film_z);
                let aim = target.window(film).point(c, d).extend(lens.length());
                LensRay::new(origin, (aim - origin).normalize())
            })
            .collect();
        let time = |run: &mut dyn FnMut()| {
            let mut best = f64::INFINITY;
            for _ in 0..20 {
                let clock = std::time::Instant::now();
                run();
                best = best.min(clock.elapsed().as_secs_f64());
            }
            1e9 * best / rays.len() as f64
        };
        let one = time(&mut || {
            for ray in &rays {
                std::hint::black_box(lens.trace_from_film(ray)).ok();
            }
        });
        let bundles: Vec<Bundle> = rays
            .chunks(LANES)
            .map(|rays| {
                let mut bundle = Bundle::default();
                rays.iter()
                    .enumerate()
                    .for_each(|(lane, ray)| bundle.set(lane, ray));
                bundle
            })
            .collect();
        let [plain, widest] = widths.map(|width| {
            time(&mut || {
                for bundle in &bundles {
                    let mut bundle = bundle.clone();
                    lens.trace_bundle(&mut bundle, Toward::Scene, width);
                    std::hint::black_box(&bundle);
                }
            })
        });
        let mut apart = [0.0f64; 2];
        for width in widths {
            let mut lost = 0;
            for (rays, bundle) in rays.chunks(LANES).zip(&bundles) {
                let mut bundle = bundle.clone();
                lens.trace_bundle(&mut bundle, Toward::Scene, width);
                for (lane, ray) in rays.iter().enumerate() {
                    match (lens.trace_from_film(ray), bundle.loss(lane)) {
                        (Ok(out), None) => {
                            let own = bundle.ray(lane);
                            let off = [
                                (own.origin - out.origin).length(),
                                (own.direction - out.direction).length(),
                            ];
                            (0..2).for_each(|i| apart[i] = apart[i].max(off[i]));
                        }
                        (Err(loss), Some(other)) if loss == other => {}
                        _ => lost += 1,
                    }
                }
            }
            let good = lost == 0 && apart[0] <= APART[0] && apart[1] <= APART[1];
            table.check(name, good, || {
                format!("{lost} lanes lost otherwise, {apart:?} apart, {width:?}")
            });
        }
        table.row(&[
            name.clone(),
            format!("{one:.1}"),
            format!("{plain:.1}"),
            format!("{widest:.1}"),
            format!("{:.1e}", apart[0]),
            format!("{:.1e}", apart[1]),
        ]);
    }
}

// ---- extremes.json -------------------------------------------------------------------------

fn extremes(folder: &Path, table: &mut Table) {
    let root = read(&folder.join("extremes.json"));
    table.head(&["case", "quantity", "exact", "ivcam", "error", "bound"]);
    for case in root["cases"].as_array().into_iter().flatten() {
        let id = case["id"].as_str().unwrap_or("");
        match case["kind"].as_str().unwrap_or("") {
            "ray" => extreme_ray(folder, case, id, table),
            "first_order" => extreme_first_order(folder, case, id, table),
            "focus" => extreme_focus(folder, case, id, table),
            "focus_quadratic" => extreme_quadratic(case, id, table),
            _ => {
                let cells = [id, "messages", "an error each", "tests/extreme", "", ""];
                table.row(&cells.map(str::to_owned));
            }
        }
    }
}

fn case_lens(folder: &Path, case: &Value) -> Lens {
    if let Some(path) = case["lens"].as_str() {
        return Lens::open(folder.join(path)).unwrap_or_else(|e| panic!("{}", e.render(false)));
    }
    let n_object = case["input"]["n_object"].as_f64().unwrap_or(1.0);
    let text = json!({"surfaces": case["lens"], "n_object": n_object}).to_string();
    let source = ivcam_base::diag::Source::new("case", text.into_bytes());
    let lens = formats::read(&source.into(), &mut ivcam_base::diag::Sink::new());
    Lens::new(lens.unwrap_or_else(|e| panic!("{}: {}", case["id"], e.render(false))))
}

/// Returns the bounds of position and direction that the text of `expect` states.
fn bounds(id: &str) -> (f64, f64) {
    match id {
        _ if id.starts_with("flat_R") || id == "plane" => (1e-12, 4e-16),
        "hemi_rim_2^-20" => (1e-12, 1e-12),
        "hemi_rim_2^-40" => (1e-9, 1e-9),
        "hemi_rim_2^-50" => (1e-7, 1e-7),
        "index_1+2^-40" => (1e-12, 4e-16),
        "tir_below_1e-12" => (1e-12, 1e-9),
        "tir_below_4e-15" => (1e-12, 1e-7),
        "origin_1e9m" => (5e-4, 1e-5),
        "scale_2^20" => (1e-7, 1e-14),
        "scale_1e6" => (1e-6, 1e-14),
        "long_gap_1e6" => (1e-9, 1e-12),
        _ => (1e-12, 1e-14),
    }
}

/// Adds a row of a case: the quantity, the exact value, the computed one, and the tolerance.
fn case_row(table: &Table, id: &str, quantity: &str, exact: &str, ours: &str, off: [f64; 2]) {
    let short = |v: f64| {
        if v.is_nan() {
            String::new()
        } else {
            format!("{v:.1e}")
        }
    };
    // The table shows 20 of the 40 digits.
    let digits = |text: &str| match text.split_once('e') {
        Some((mantissa, power)) if text.parse::<f64>().is_ok() => {
            format!("{mantissa:.22}e{power}")
        }
        _ if text.parse::<f64>().is_ok() => format!("{text:.22}"),
        _ => text.to_owned(),
    };
    table.row(&[
        id.to_owned(),
        quantity.to_owned(),
        digits(exact),
        ours.to_owned(),
        short(off[0]),
        short(off[1]),
    ]);
}

fn extreme_ray(folder: &Path, case: &Value, id: &str, table: &mut Table) {
    let lens = case_lens(folder, case);
    let (input, exact) = (&case["input"], &case["exact"]);
    let allows_either = id.ends_with("4e-15") || id == "aperture_next";
    if allows_either {
        let path = lens.trace_path(
            &LensRay::new(vector(&input["o"]), vector(&input["d"])),
            Toward::Film,
            true,
        );
        let sound = path.outcome.is_err() || path.outcome.is_ok_and(|r| r.direction.is_finite());
        table.check(id, sound, || "not a number".into());
    }
    let mut own = Table::default();
    let (position, direction) =
        one_ray(&lens, input, &input["o"], &input["d"], exact, id, &mut own);
    if !allows_either {
        table.failed += own.failed;
        table.checks += own.checks;
    }
    let (near, straight) = bounds(id);
    table.check(id, position <= near, || {
        format!("position off by {position:.1e}")
    });
    table.check(id, direction <= straight, || {
        format!("direction off by {direction:.1e}")
    });
    let toward = match input["dir"] == "forward" {
        true => Toward::Film,
        false => Toward::Scene,
    };
    let shift = lens.length() * DVec3::Z;
    let ray = LensRay::new(vector(&input["o"]) + shift, vector(&input["d"]));
    let apertures = input["apertures"].as_bool().unwrap_or(true);
    let nan = [f64::NAN; 2];
    match lens.trace_path(&ray, toward, apertures).outcome {
        Err(loss) => {
            let place = |surface: &Value| {
                surface
                    .as_u64()
                    .map_or(String::new(), |i| format!(" at {i}"))
            };
            let exact =
                exact["status"].as_str().unwrap_or("").to_owned() + &place(&exact["surface"]);
            let ours = format!("{:?} at {}", loss.kind, loss.surface);
            case_row(table, id, "fate of the ray", &exact, &ours, nan);
        }
        Ok(out) => {
            let rows = [
                ("position", "exit_o", out.origin - shift, position, near),
                ("direction", "exit_d", out.direction, direction, straight),
            ];
            for (quantity, key, ours, off, bound) in rows {
                // The component with the largest error is shown.
                let exact = &exact[key];
                let error = |i: &usize| (ours[*i] - num(&exact[*i])).abs();
                let worst = (0..3)
                    .max_by(|a, b| error(a).total_cmp(&error(b)))
                    .unwrap_or(0);
                let name = format!("{quantity} {}", ["x", "y", "z"][worst]);
                let digits = exact[worst].as_str().unwrap_or("-");
                let ours = ours[worst].to_string();
                case_row(table, id, &name, digits, &ours, [off, bound]);
            }
        }
    }
}

fn extreme_first_order(folder: &Path, case: &Value, id: &str, table: &mut Table) {
    let mut lens = case_lens(folder, case);
    if id.starts_with("stop_f1024") {
        // The oracle closes the stop by its paraxial image.
        let optics = lens.first_order();
        let open = optics
            .stop
            .map(|i| lens.prescription().surfaces[i].semi_diameter);
        let radius = open.zip(optics.f_number()).map(|(r, n)| r * n / 1024.0);
        let Some(Ok(closed)) = radius.map(|r| lens.with_stop(Mm(r))) else {
            return table.fail(format!("{id}: it does not close"));
        };
        lens = closed;
    }
    let exact = &case["exact"];
    let ours = lens.first_order();
    let shift = lens.length();
    if exact["power"].as_str() == Some("0.0") {
        table.check(id, ours.focal.is_none(), || {
            format!("power is {}", ours.power)
        });
        let nan = [f64::NAN; 2];
        case_row(table, id, "power", "0", &ours.power.to_string(), nan);
        return;
    }
    let Some(focal) = ours.focal else {
        return table.fail(format!("{id}: no focal length"));
    };
    let bound = if id == "afocal_near" { 1e-7 } else { 1e-12 };
    let nan = f64::NAN;
    let (enp, exp) = (ours.entrance_pupil, ours.exit_pupil);
    let mut worst = (-1.0, "", f64::NAN);
    for (key, ours) in [
        ("efl", focal.efl),
        ("bfl", focal.bfl),
        ("ffl", focal.ffl),
        ("F_object", focal.front_focal_point - shift),
        ("F_image", focal.rear_focal_point - shift),
        ("P_object", focal.front_principal_plane - shift),
        ("P_image", focal.rear_principal_plane - shift),
        ("enp_z", enp.map_or(nan, |p| p.z - shift)),
        ("exp_z", exp.map_or(nan, |p| p.z - shift)),
        ("enp_r", enp.map_or(nan, |p| p.semi_diameter)),
        ("exp_r", exp.map_or(nan, |p| p.semi_diameter)),
    ] {
        if exact[key].is_null() {
            continue;
        }
        let exact = num(&exact[key]);
        let error = (ours - exact).abs() / exact.abs().max(1e-3 * focal.efl.abs());
        if !(error <= worst.0) {
            worst = (error, key, ours);
        }
        table.check(id, error <= bound, || {
            format!("{key} is {ours}, not {exact}")
        });
    }
    let (error, key, ours) = worst;
    let digits = exact[key].as_str().unwrap_or("-");
    case_row(table, id, key, digits, &ours.to_string(), [error, bound]);
}

fn extreme_focus(folder: &Path, case: &Value, id: &str, table: &mut Table) {
    let lens = case_lens(folder, case);
    let Some(focal) = lens.first_order().focal else {
        return table.fail(format!("{id}: afocal"));
    };
    let (input, exact) = (&case["input"], &case["exact"]);
    // Distances are given from the principal plane or as a position; they are converted to the
    // vertex.
    let distance = match input["object_z"].as_f64() {
        Some(z) => -(z + lens.length()),
        None => num(&input["object_to_P"]) - focal.front_principal_plane,
    };
    let focus = lens.focus(FocusMethod::Film, Meters(distance / 1000.0));
    let ok = match (id, &focus) {
        ("focus_near_F_outside", Ok(focus)) => {
            relative(focus.image_distance, num(&exact["image_from_P"])) < 1e-6
        }
        ("focus_at_front_focal_point", Err(FocusFault::ObjectAtFocalPoint { .. })) => true,
        ("focus_at_front_focal_point", Ok(focus)) => focus.film_z > 1e15,
        (_, Err(FocusFault::VirtualImage { nearest })) => lens
            .focus(FocusMethod::Film, Meters(nearest / 1000.0))
            .is_ok(),
        _ => false,
    };
    table.check(id, ok, || format!("{focus:?}"));
    let ours = match &focus {
        Ok(focus) => format!("film {} behind P", focus.image_distance),
        Err(fault) => format!("{} (nearest {:?} mm)", fault.kind(), fault.nearest()),
    };
    let exact = match exact["image_from_P"].as_str() {
        Some(digits) => format!("image {digits:.22} behind P"),
        None => format!("image at {}", exact["image"].as_str().unwrap_or("-")),
    };
    case_row(table, id, "focus", &exact, &ours, [f64::NAN; 2]);
}

fn extreme_quadratic(case: &Value, id: &str, table: &mut Table) {
    let (input, exact) = (&case["input"], &case["exact"]);
    let (z, f, t) = (num(&input["z"]), num(&input["f"]), num(&input["t"]));
    let lens = FirstOrder::in_air(f, t);
    let ours = optics::focus::focus(&lens, FocusMethod::Lens, z);
    let ours = ours.ok().map(|focus| focus.extension);
    let wanted = if exact["T"].is_null() {
        num(&exact["T_small"])
    } else {
        num(&exact["T"])
    };
    let error = match ours {
        Some(ours) if wanted.is_finite() => relative(ours, wanted),
        None if !wanted.is_finite() => 0.0,
        _ => f64::INFINITY,
    };
    let at_the_limit = id.starts_with("kolb_min");
    // Near its double root, a quadratic amplifies the rounding of z² by one over the root's slope.
    let b = z - t - 2.0 * f;
    let slope = ((b - 2.0 * f) * (b + 2.0 * f)).abs().sqrt();
    let bound = if at_the_limit {
        1e-6
    } else {
        2.0 * f64::EPSILON * (1.0 + z / slope)
    };
    // One rounding of z determines on which side of the limit a case is.
    let either = at_the_limit && ours.is_none_or(|ours| relative(ours, f) < 1e-6);
    table.check(id, error <= bound || either, || {
        format!("{ours:?}, not {wanted}")
    });
    let digits = [&exact["T"], &exact["T_small"]];
    let digits = digits.iter().find_map(|d| d.as_str()).unwrap_or("none");
    let ours = ours.map_or("none".into(), |t| t.to_string());
    case_row(table, id, "T of equation 5", digits, &ours, [error, bound]);
}

//! Compares fans, Zernike and Seidel coefficients, Strehl ratios and modulation with a reference
//! that `crates/measure/optics_reference.py` makes with other programs.

use std::path::Path;

use glam::DVec2;
use ivcam_base::math::Mm;
use ivcam_optics::lens::analysis::aberrations::fans::{FanRay, PointFans};
use ivcam_optics::lens::analysis::aberrations::seidel::SeidelSums;
use ivcam_optics::lens::analysis::diffraction::Openings;
use ivcam_optics::lens::{Beam, Conjugate, Lens, Wavefront};
use serde_json::Value;

use super::optics::{Table, num, read};

/// The number of plane waves along each side of the grid across a beam.
const GRID: usize = 128;
/// The bounds: fans in millimeters and in waves, coefficients in waves and relative to the largest
/// Seidel coefficient, and Strehl ratio and modulation.
const BOUNDS: [f64; 6] = [1e-9, 1e-6, 1e-6, 1e-6, 0.01, 0.01];

/// Prints a row for each lens of a reference.
pub(super) fn run(file: &Path, table: &mut Table) {
    let root = read(file);
    table.head(&[
        "lens",
        "ray fan mm",
        "OPD waves",
        "Zernike",
        "Seidel",
        "Strehl",
        "modulation",
    ]);
    let nm = num(&root["wavelength_nm"]);
    for (name, entry) in root["lenses"].as_object().into_iter().flatten() {
        let lens = Lens::named(name).map(|lens| lens.at_wavelength(nm));
        let closed = lens.and_then(|lens| lens.with_stop(Mm(num(&entry["stop"]))));
        let lens = match closed {
            Ok(lens) => lens,
            Err(error) => {
                table.fail(error.render(false));
                continue;
            }
        };
        let mut worst = [0.0; 6];
        worst[3] = seidel(&lens, entry);
        for point in entry["points"].as_array().into_iter().flatten() {
            let found = one_point(&lens, entry, point);
            for (worst, error) in worst.iter_mut().zip(found.unwrap_or([f64::INFINITY; 6])) {
                *worst = error.max(*worst);
            }
        }
        for (what, (error, bound)) in [
            "ray fan",
            "OPD",
            "Zernike",
            "Seidel",
            "Strehl",
            "modulation",
        ]
        .iter()
        .zip(worst.iter().zip(BOUNDS))
        {
            table.check(name, *error <= bound, || {
                format!("{what} off by {error:.1e}")
            });
        }
        let cells = worst.iter().enumerate().map(|(i, error)| match i {
            0..4 => format!("{error:.1e}"),
            _ => format!("{error:.4}"),
        });
        let row: Vec<String> = std::iter::once(name.clone()).chain(cells).collect();
        table.row(&row);
    }
}

/// The largest error of a Seidel coefficient of a surface over the largest one of its kind.
fn seidel(lens: &Lens, entry: &Value) -> f64 {
    let height = num(&entry["seidel"]["height"]);
    let Some(ours) = SeidelSums::of(lens, f64::INFINITY, num(&entry["marginal"]), height) else {
        return f64::INFINITY;
    };
    let theirs: Vec<&Value> = entry["seidel"]["surfaces"]
        .as_array()
        .into_iter()
        .flatten()
        .collect();
    if theirs.len() != ours.surfaces.len() {
        return f64::INFINITY;
    }
    let mut worst: f64 = 0.0;
    for kind in 0..5 {
        let largest = theirs
            .iter()
            .map(|row| num(&row[kind]).abs())
            .fold(0.0, f64::max);
        for (row, own) in theirs.iter().zip(&ours.surfaces) {
            worst = worst.max((own.values()[kind] - num(&row[kind])).abs() / largest.max(1e-300));
        }
    }
    worst
}

/// The errors at one point, in the order of [`BOUNDS`]; none if the point has no rays.
fn one_point(lens: &Lens, entry: &Value, point: &Value) -> Option<[f64; 6]> {
    let conjugate = Conjugate {
        distance: f64::INFINITY,
        film_z: num(&entry["film_z"]),
    };
    let height = num(&point["height"]);
    let line = lens.wavelength();
    let lines = [line; 3].map(|nm| lens.at_wavelength(nm));
    let found = PointFans::of(&lines, height, conjugate)?;
    let own = found.fans.iter().find(|fan| fan.wavelength_nm == line)?;
    let (mut places, mut waves): (f64, f64) = (0.0, 0.0);
    for (key, rays) in [("tangential", &own.tangential), ("sagittal", &own.sagittal)] {
        for row in point[key].as_array().into_iter().flatten() {
            let near = |ray: &&FanRay| (ray.pupil - num(&row[0])).abs() < 1e-9;
            let ray = rays.iter().find(near)?;
            let off = DVec2::new(ray.x - num(&row[1]), ray.y - num(&row[2]));
            places = places.max(off.length());
            waves = waves.max((ray.waves - num(&row[3])).abs());
        }
    }
    let fit = found.wavefront?;
    let theirs = point["zernike"].as_array()?;
    if theirs.len() != fit.zernike.len() {
        return None;
    }
    let zernike = fit
        .zernike
        .iter()
        .zip(theirs)
        .map(|(own, other)| (own - num(other)).abs());
    let beam = Beam::of(lens, height, conjugate.film_z, conjugate.distance)?;
    let openings = Openings::of(lens, &beam, GRID);
    let image = DVec2::new(0.0, height).extend(conjugate.film_z);
    let image = Wavefront::of(lens, &beam, &openings, image)?;
    let strehl = (image.strehl() - num(&point["strehl"])).abs();
    let frequencies = entry["frequencies"].as_array()?;
    let mut modulation: f64 = 0.0;
    for (axis, key) in ["sagittal", "tangential"].into_iter().enumerate() {
        for (f, theirs) in frequencies.iter().zip(point["mtf"][key].as_array()?) {
            let own = image.transfer(num(f), axis).length();
            modulation = modulation.max((own - num(theirs)).abs());
        }
    }
    let zernike = zernike.fold(0.0, f64::max);
    Some([places, waves, zernike, 0.0, strehl, modulation])
}

//! The part of the data sheet with the distortion of a grid and the footprints of beams.

use std::f64::consts::{SQRT_2, TAU};

use glam::DVec2;

use crate::lens::analysis::beam::Beam;
use crate::lens::{FieldRow, Lens, LensSheet};

use super::drawing::{Anchor, Drawing, Ink};
use super::measures::{GUTTER, MARGIN, WIDTH};
use super::numbers::tidy;

/// The number of lines of the grid in each direction.
const LINES: u32 = 9;
/// The number of footprints in a row.
const COLUMNS: usize = 8;
/// The largest number of surfaces whose footprints are drawn.
const MOST: usize = 32;

/// Draws both below `top` and returns the y of their end.
pub(super) fn draw(page: &mut Drawing, lens: &Lens, sheet: &LensSheet, top: f64) -> f64 {
    let width = (WIDTH - 2.0 * MARGIN - 2.0 * GUTTER) / 3.0;
    let left = match sheet.image_height {
        0.0 => top,
        _ => grid(page, sheet, [MARGIN, top], width),
    };
    let at = [MARGIN + width + GUTTER, top];
    left.max(footprints(page, lens, sheet, at, 2.0 * width + GUTTER))
}

/// Draws the image of a square grid whose corners are at the edge of the field, on the undistorted
/// grid. Distortions of a few percent are exaggerated. It is that of the diagonal at each height,
/// so a lens without rotational symmetry has none.
fn grid(page: &mut Drawing, sheet: &LensSheet, [x, y]: [f64; 2], width: f64) -> f64 {
    let largest = sheet.fields.iter().filter_map(|row| row.distortion_percent);
    let largest = largest.fold(0.0, |most: f64, percent| most.max(percent.abs()));
    let factors = [100.0, 50.0, 20.0, 10.0, 5.0, 2.0, 1.0];
    let factor = factors.into_iter().find(|f| f * largest <= 12.0);
    let factor = factor.unwrap_or(1.0);
    let note = format!("{} times the distortion", tidy(factor, 1.0));
    page.heading_with_note([x, y + 11.0], "Distortion grid", note);
    let half = sheet.image_height / SQRT_2;
    // The largest image fits.
    let scale = 0.42 * width / half;
    let center = [x + 0.5 * width, y + 26.0 + 0.5 * width];
    let place = |p: DVec2, exaggerated: f64| {
        let p = p * (1.0 + exaggerated * distortion(&sheet.fields, p.length()));
        [center[0] + scale * p.x, center[1] - scale * p.y]
    };
    for (exaggerated, ink) in [(0.0, Ink::Faint), (factor, Ink::Curve(0))] {
        for line in 0..LINES {
            let across = half * (2.0 * f64::from(line) / f64::from(LINES - 1) - 1.0);
            // Lines without distortion are straight.
            let steps = if exaggerated == 0.0 { 1 } else { 24 };
            let along = (0..=steps).map(|i| half * (2.0 * f64::from(i) / f64::from(steps) - 1.0));
            let along: Vec<f64> = along.collect();
            for is_row in [true, false] {
                let point = |along: &f64| match is_row {
                    true => DVec2::new(*along, across),
                    false => DVec2::new(across, *along),
                };
                let points = along.iter().map(|along| place(point(along), exaggerated));
                page.path(points.collect(), ink);
            }
        }
    }
    y + 34.0 + width
}

/// The distortion at a height as a share, between the rows.
fn distortion(rows: &[FieldRow], height: f64) -> f64 {
    let known = rows
        .iter()
        .filter_map(|row| Some((row.height, 0.01 * row.distortion_percent?)));
    let known: Vec<(f64, f64)> = known.collect();
    let next = known.partition_point(|(h, _)| *h < height);
    match (next.checked_sub(1).map(|i| known[i]), known.get(next)) {
        (Some((a, low)), Some((b, high))) if *b > a => low + (high - low) * (height - a) / (b - a),
        (Some((_, low)), None) => low,
        (_, Some((_, high))) => *high,
        _ => 0.0,
    }
}

/// Draws the outlines of the beams of all points on each surface, in its semi-diameter.
fn footprints(
    page: &mut Drawing,
    lens: &Lens,
    sheet: &LensSheet,
    [x, y]: [f64; 2],
    width: f64,
) -> f64 {
    let surfaces = &lens.prescription().surfaces;
    let distance = sheet.object_distance.unwrap_or(f64::INFINITY);
    let prints = sheet.points.iter().filter_map(|point| {
        Some(Beam::of(lens, point.height, sheet.film_z, distance)?.footprints())
    });
    let prints: Vec<Vec<Vec<DVec2>>> = prints.collect();
    let note = "the beams of the points on each surface, in its semi-diameter";
    page.heading_with_note([x, y + 11.0], "Footprints", note);
    let cell = width / COLUMNS as f64;
    let drawn = surfaces.len().min(MOST);
    for (i, surface) in surfaces.iter().take(drawn).enumerate() {
        let (column, row) = (i % COLUMNS, i / COLUMNS);
        let center = [
            x + cell * (column as f64 + 0.5),
            y + 26.0 + (cell + 14.0) * row as f64 + 0.5 * cell,
        ];
        let hits = prints.iter().flat_map(|print| &print[i]);
        let reach = hits.fold(0.0, |most: f64, hit| most.max(hit.length()));
        let rim = Some(surface.semi_diameter).filter(|r| r.is_finite());
        let size = rim.map_or(reach, |rim| rim.max(reach));
        let scale = 0.44 * cell / size.max(1e-9);
        let place = |p: DVec2| [center[0] + scale * p.x, center[1] - scale * p.y];
        for radius in rim.into_iter().chain([surface.obstruction]) {
            let circle = (0..32).map(|k| {
                let (sin, cos) = libm::sincos(TAU * f64::from(k) / 32.0);
                place(radius * DVec2::new(cos, sin))
            });
            if radius > 0.0 {
                page.shape(circle.collect(), Ink::Faint);
            }
        }
        for (k, print) in prints
            .iter()
            .enumerate()
            .filter(|(_, print)| print[i].len() > 2)
        {
            // An outline of a centimeter shows no more than 24 corners.
            let corners = print[i].iter().step_by(4);
            let mut outline: Vec<[f64; 2]> = corners.map(|p| place(*p)).collect();
            outline.extend(outline.first().copied());
            page.path(outline, Ink::Ray(k as u8));
        }
        let label = [center[0], center[1] + 0.5 * cell + 8.0];
        page.note(label, Anchor::Middle, 9.0, i.to_string());
    }
    let bottom = y + 26.0 + (cell + 14.0) * drawn.div_ceil(COLUMNS) as f64;
    if drawn < surfaces.len() {
        let text = format!("the first {drawn} of {} surfaces", surfaces.len());
        page.note([x, bottom + 10.0], Anchor::Start, 9.0, text);
        return bottom + 22.0;
    }
    bottom + 8.0
}

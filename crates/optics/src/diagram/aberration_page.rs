//! The part of the data sheet that shows aberrations: fans, through-focus images, the chief ray's
//! angle, Zernike coefficients and Seidel sums.

use crate::lens::analysis::aberrations::fans::{FanRay, STEPS, WavefrontFit};
use crate::lens::analysis::aberrations::report::{Aberrations, PointAberrations};
use crate::lens::analysis::aberrations::through_focus::SPOTS;
use crate::lens::{FieldRow, Lens, LensSheet};
use crate::prescription::glass::medium::line_name;

use super::chart::{Chart, Series};
use super::drawing::{Anchor, Drawing, DrawingItem, Ink};
use super::footprints;
use super::measures::{GUTTER, MARGIN, WIDTH};
use super::numbers::{round_number, tidy};

const FAN_HEIGHT: f64 = 140.0;
const CHART_HEIGHT: f64 = 190.0;
/// The largest number of points that have a column each.
const COLUMNS: usize = 4;

/// Draws all parts below `top` and returns the y of their end.
pub(super) fn draw(
    page: &mut Drawing,
    lens: &Lens,
    sheet: &LensSheet,
    all: &Aberrations,
    top: f64,
) -> f64 {
    let points: Vec<&PointAberrations> = all.points.iter().take(COLUMNS).collect();
    let mut y = field_charts(page, sheet, top);
    y = footprints::draw(page, lens, sheet, y) + 18.0;
    let rays = "\u{b5}m on the film";
    let nm = tidy(all.wavelength_nm, 0.1);
    let waves = "waves";
    y = fans(page, &points, ("Ray fans", rays), y, |ray| {
        (1000.0 * ray.y, 1000.0 * ray.x)
    });
    y = fans(page, &points, ("Wavefront (OPD) fans", waves), y, |ray| {
        (ray.waves, ray.waves)
    });
    y = through_focus(page, all, &points, y);
    y = focus_spots(page, &points, y);
    y = wavefronts(page, &points, &nm, y);
    seidel(page, all, y)
}

/// The angle at the film, and the field curvature at three wavelengths.
fn field_charts(page: &mut Drawing, sheet: &LensSheet, top: f64) -> f64 {
    if sheet.image_height == 0.0 {
        return top;
    }
    let width = (WIDTH - 2.0 * MARGIN - 2.0 * GUTTER) / 3.0;
    let over_height = |value: &dyn Fn(&FieldRow) -> Option<f64>| -> Vec<[f64; 2]> {
        let rows = sheet.fields.iter();
        rows.filter_map(|row| Some([row.height, value(row)?]))
            .collect()
    };
    let chart = |title: &str, unit: &str, series: Vec<Series>| Chart {
        title: title.into(),
        x_label: "image height, mm".into(),
        y_label: unit.into(),
        series,
        y_span: (0.0, 0.0),
        x_span: None,
        upright: false,
    };
    let angle = over_height(&|row| row.chief_ray_angle_degrees);
    let mut charts = vec![chart(
        "Chief ray's angle at the film",
        "degrees to the axis",
        vec![Series::new(angle, 0, "")],
    )];
    if sheet.dispersive {
        let [f, d, c] = sheet.line_names();
        charts.push(chart(
            "Tangential focus by wavelength",
            "mm from the film",
            vec![
                Series::new(sheet.focus_curve(|row| row.tangential_focus_f), 1, &f),
                Series::new(sheet.focus_curve(|row| row.tangential_focus), 3, &d),
                Series::new(sheet.focus_curve(|row| row.tangential_focus_c), 2, &c),
            ],
        ));
        charts.push(chart(
            "Sagittal focus by wavelength",
            "mm from the film",
            vec![
                Series::new(sheet.focus_curve(|row| row.sagittal_focus_f), 1, &f),
                Series::new(sheet.focus_curve(|row| row.sagittal_focus), 3, &d),
                Series::new(sheet.focus_curve(|row| row.sagittal_focus_c), 2, &c),
            ],
        ));
    }
    for (i, chart) in charts.into_iter().enumerate() {
        let x = MARGIN + i as f64 * (width + GUTTER);
        page.put(chart.draw(width, CHART_HEIGHT), [x, top]);
    }
    top + CHART_HEIGHT + 22.0
}

/// The color of a line by its place among the fans of a point.
fn line_curve(index: usize, count: usize) -> u8 {
    match (count, index) {
        (1, _) => 0,
        (_, 0) => 1,
        (_, 1) => 3,
        _ => 2,
    }
}

/// Two rows of fans, tangential above sagittal, both fans of a point at one scale. `value` is what
/// each of the two shows of a ray.
fn fans(
    page: &mut Drawing,
    points: &[&PointAberrations],
    (title, unit): (&str, &str),
    top: f64,
    value: fn(&FanRay) -> (f64, f64),
) -> f64 {
    let count = points.len().max(1) as f64;
    let gap = 0.6 * GUTTER;
    let width = ((WIDTH - 2.0 * MARGIN - (count - 1.0) * gap) / count).min(300.0);
    let size = |point: &PointAberrations| {
        let sizes = point.fans.iter().flat_map(|f| {
            let up = f.tangential.iter().map(move |ray| value(ray).0.abs());
            up.chain(f.sagittal.iter().map(move |ray| value(ray).1.abs()))
        });
        sizes.filter(|v| v.is_finite()).fold(1e-6, f64::max)
    };
    let note = format!(
        "{unit} over the pupil coordinate; each point at its own scale; ends where the beam is vignetted"
    );
    page.heading_with_note([MARGIN, top + 4.0], title, note);
    let mut y = top + 16.0;
    for tangential in [true, false] {
        for (i, point) in points.iter().enumerate() {
            let lines = point.fans.iter().enumerate().flat_map(|(k, fan)| {
                let rays = match tangential {
                    true => &fan.tangential,
                    false => &fan.sagittal,
                };
                let place = |ray: &FanRay| match tangential {
                    true => [ray.pupil, value(ray).0],
                    false => [ray.pupil, value(ray).1],
                };
                let count = point.fans.len();
                let is_named = i == 0 && count > 1;
                let line = is_named.then(|| line_name(fan.wavelength_nm));
                // An obstruction interrupts a line.
                let next = |a: &FanRay, b: &FanRay| b.pupil - a.pupil < 1.5 / STEPS as f64;
                let parts = rays.chunk_by(next).enumerate().map(move |(i, part)| {
                    let name = line.as_deref().filter(|_| i == 0);
                    let points = part.iter().map(place).collect();
                    Series::new(points, line_curve(k, count), name.unwrap_or(""))
                });
                parts.collect::<Vec<_>>()
            });
            let name = if tangential { "tangential" } else { "sagittal" };
            let chart = Chart {
                title: format!("{} mm, {name}", tidy(point.height, 0.1)),
                x_label: String::new(),
                y_label: unit.into(),
                series: lines.collect(),
                y_span: (-size(point), size(point)),
                x_span: Some((-1.0, 1.0)),
                upright: false,
            };
            let x = MARGIN + i as f64 * (width + gap);
            page.put(chart.draw(width, FAN_HEIGHT), [x, y]);
        }
        y += FAN_HEIGHT + 8.0;
    }
    y + 18.0
}

/// The spot's size and the modulation through focus.
fn through_focus(
    page: &mut Drawing,
    all: &Aberrations,
    points: &[&PointAberrations],
    top: f64,
) -> f64 {
    let width = (WIDTH - 2.0 * MARGIN - 2.0 * GUTTER) / 3.0;
    let name = |p: &PointAberrations| format!("{} mm", tidy(p.height, 0.1));
    let sizes = points.iter().enumerate().map(|(i, p)| Series {
        ink: Ink::Ray(i as u8),
        ..Series::new(
            p.through_focus
                .iter()
                .map(|r| [r.shift, 1000.0 * r.rms])
                .collect(),
            0,
            &name(p),
        )
    });
    let mut charts = vec![Chart {
        title: "Spot through focus, rms in \u{b5}m".into(),
        x_label: "shift of the film away from the lens, mm".into(),
        y_label: String::new(),
        series: sizes.collect(),
        y_span: (0.0, 0.0),
        x_span: None,
        upright: false,
    }];
    let shown = all.frequencies.len().saturating_sub(2);
    for (k, frequency) in all.frequencies.iter().enumerate().skip(shown) {
        let series = points.iter().enumerate().flat_map(|(i, p)| {
            let curve = |value: &dyn Fn(usize) -> f64| -> Vec<[f64; 2]> {
                let rows = p.through_focus.iter().enumerate();
                rows.map(|(j, row)| [row.shift, value(j)]).collect()
            };
            let solid = Series {
                ink: Ink::Ray(i as u8),
                ..Series::new(curve(&|j| p.through_focus[j].tangential[k]), 0, &name(p))
            };
            let dashed = Series {
                ink: Ink::Ray(i as u8),
                ..Series::new(curve(&|j| p.through_focus[j].sagittal[k]), 0, "")
            };
            [solid, dashed.dashed()]
        });
        charts.push(Chart {
            title: format!("Modulation through focus, {} lp/mm", tidy(*frequency, 0.1)),
            x_label: "shift of the film, mm; solid tangential, dashed sagittal".into(),
            y_label: String::new(),
            series: series.collect(),
            y_span: (0.0, 1.0),
            x_span: None,
            upright: false,
        });
    }
    for (i, chart) in charts.into_iter().enumerate() {
        let x = MARGIN + i as f64 * (width + GUTTER);
        page.put(chart.draw(width, CHART_HEIGHT), [x, top]);
    }
    top + CHART_HEIGHT + 26.0
}

/// Spots on five films for each point.
fn focus_spots(page: &mut Drawing, points: &[&PointAberrations], top: f64) -> f64 {
    let Some(first) = points.first() else {
        return top;
    };
    let range = first.through_focus.last().map_or(0.0, |row| row.shift);
    let rms = points
        .iter()
        .flat_map(|p| p.through_focus.iter().map(|row| row.rms));
    let half = round_number(2.0 * rms.fold(1e-6, f64::max));
    let side = 96.0;
    let wide = 2000.0 * half;
    let note = format!(
        "one wavelength; boxes are {} \u{b5}m wide; shift of the film away from the lens in mm",
        tidy(wide, wide)
    );
    page.heading_with_note([MARGIN, top], "Spots through focus", note);
    let left = MARGIN + 52.0;
    let step = (WIDTH - MARGIN - left - side) / (SPOTS.len() as f64 - 1.0);
    let step = step.min(side + 24.0);
    let mut y = top + 12.0;
    for point in points {
        let name = format!("{} mm", tidy(point.height, 0.1));
        page.note([MARGIN, y + 0.5 * side + 3.0], Anchor::Start, 9.0, name);
        for (i, spot) in point.spots.iter().enumerate() {
            let x = left + step * i as f64;
            let center = [x + 0.5 * side, y + 0.5 * side];
            let scale = 0.5 * side / half;
            let frame = vec![[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
            page.shape(frame, Ink::Faint);
            let every = (spot.len() / 300).max(1);
            let inside = spot
                .iter()
                .step_by(every)
                .filter(|p| p.abs().max_element() < half);
            let places = inside.map(|p| [center[0] + scale * p.x, center[1] - scale * p.y]);
            page.items.push(DrawingItem::Dots {
                places: places.collect(),
                radius: 0.5,
                ink: Ink::Curve(0),
            });
        }
        y += side + 6.0;
    }
    for (i, share) in SPOTS.iter().enumerate() {
        let x = left + step * i as f64 + 0.5 * side;
        page.note(
            [x, y + 8.0],
            Anchor::Middle,
            9.0,
            tidy(share * range, 0.1 * range),
        );
    }
    y + 36.0
}

/// Strehl ratios, wavefront errors and Zernike coefficients, a column for each point.
fn wavefronts(page: &mut Drawing, points: &[&PointAberrations], nm: &str, top: f64) -> f64 {
    let note = format!(
        "in waves of {nm} nm; fringe Zernike coefficients, 1 at the edge of the disc, angles from x; \
         the unit disc is the axial beam at the stop"
    );
    page.heading_with_note([MARGIN, top], "Wavefront", note);
    let head: Vec<String> = points
        .iter()
        .map(|p| format!("{} mm", tidy(p.height, 0.1)))
        .collect();
    let mut rows: Vec<(String, Vec<String>)> = vec![(String::new(), head)];
    let fit = |p: &PointAberrations, of: &dyn Fn(&WavefrontFit) -> Option<f64>| {
        let value = p.wavefront.as_ref().and_then(of);
        value.map_or("\u{2014}".into(), |v| tidy(v, 1e-3))
    };
    let cells = |of: &dyn Fn(&PointAberrations) -> String| -> Vec<String> {
        points.iter().map(|p| of(p)).collect()
    };
    rows.push((
        "Strehl ratio".into(),
        cells(&|p| p.strehl.map_or("\u{2014}".into(), |s| tidy(s, 1e-3))),
    ));
    rows.push(("rms".into(), cells(&|p| fit(p, &|w| Some(w.rms)))));
    rows.push((
        "peak to valley".into(),
        cells(&|p| fit(p, &|w| Some(w.peak_to_valley))),
    ));
    rows.push((
        "open share of the disc".into(),
        cells(&|p| fit(p, &|w| Some(w.open))),
    ));
    let names = [
        "piston",
        "tilt x",
        "tilt y",
        "focus",
        "astigmatism 0\u{b0}",
        "astigmatism 45\u{b0}",
        "coma x",
        "coma y",
        "spherical",
        "trefoil x",
        "trefoil y",
    ];
    for term in 1..=37 {
        let name = names
            .get(term - 1)
            .map_or(String::new(), |n| format!("  {n}"));
        let row = cells(&|p| fit(p, &|w| w.zernike.get(term - 1).copied()));
        rows.push((format!("Z{term}{name}"), row));
    }
    // Two blocks side by side.
    let half = rows.len().div_ceil(2);
    let width = (WIDTH - 2.0 * MARGIN - GUTTER) / 2.0;
    let head = rows[0].clone();
    let mut bottom = top;
    for (block, part) in [&rows[1..half], &rows[half..]].into_iter().enumerate() {
        let x = MARGIN + block as f64 * (width + GUTTER);
        let mut y = top + 18.0;
        for (i, (name, values)) in std::iter::once(&head).chain(part).enumerate() {
            page.note([x, y], Anchor::Start, 9.0, name.as_str());
            for (k, value) in values.iter().enumerate() {
                let edge = x + 130.0 + (k as f64 + 1.0) * (width - 130.0) / COLUMNS as f64;
                match i {
                    0 => page.note([edge, y], Anchor::End, 9.0, value.as_str()),
                    _ => page.text([edge, y], Anchor::End, 9.5, value.as_str()),
                }
            }
            y += 13.0;
        }
        bottom = bottom.max(y);
    }
    bottom + 26.0
}

/// The Seidel coefficients by surface, and their sums.
fn seidel(page: &mut Drawing, all: &Aberrations, top: f64) -> f64 {
    let title = "Seidel coefficients";
    let Some(sums) = &all.seidel else {
        page.heading([MARGIN, top], 11.5, title);
        let text = "None: a surface without rotational symmetry, or with a term of the first or third power.";
        page.note([MARGIN, top + 18.0], Anchor::Start, 10.0, text);
        return top + 40.0;
    };
    let note = format!(
        "in \u{b5}m; marginal ray {} mm high at the front vertex, paraxial image {} mm high; color from C to F",
        tidy(sums.marginal_height, 1e-3),
        tidy(sums.image_height, 1e-3)
    );
    page.heading_with_note([MARGIN, top], title, note);
    let heads = [
        "S I spherical",
        "S II coma",
        "S III astigmatism",
        "S IV Petzval",
        "S V distortion",
        "C I axial color",
        "C II lateral color",
    ];
    let step = (WIDTH - 2.0 * MARGIN - 60.0) / heads.len() as f64;
    let edge = |k: usize| MARGIN + 60.0 + step * (k as f64 + 1.0);
    let mut y = top + 18.0;
    for (k, head) in heads.iter().enumerate() {
        page.note([edge(k), y], Anchor::End, 9.0, *head);
    }
    let rows = sums
        .surfaces
        .iter()
        .enumerate()
        .map(|(i, s)| (i.to_string(), s));
    for (name, row) in rows.chain(std::iter::once(("sum".to_owned(), &sums.sum))) {
        y += 13.0;
        if name == "sum" {
            page.line([MARGIN, y - 9.0], [WIDTH - MARGIN, y - 9.0], Ink::Faint);
            y += 3.0;
        }
        page.note([MARGIN + 24.0, y], Anchor::End, 9.0, name);
        for (k, value) in row.values().into_iter().enumerate() {
            page.text([edge(k), y], Anchor::End, 9.5, tidy(1000.0 * value, 1e-3));
        }
    }
    y + 34.0
}

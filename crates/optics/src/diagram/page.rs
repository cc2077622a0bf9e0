//! The data sheet of a lens on one page.

use glam::DVec2;
use ivcam_base::files::escaped;

use super::aberration_page;
use super::chart::{Chart, Series};
use super::drawing::{Anchor, Drawing, DrawingItem, Ink};
use super::measures::{GUTTER, MARGIN, WIDTH};
use super::numbers::{round_number, tidy};
use super::section::{LensDiagram, SectionOptions};
use crate::lens::analysis::aberrations::report::Aberrations;
use crate::lens::{
    About, FieldRow, Lens, LensSheet, Meridian, Modulation, PointImage, Shape, Surface, Zone,
};

const CHART_HEIGHT: f64 = 190.0;

/// Returns the page as an SVG file.
pub fn svg_page(lens: &Lens, sheet: Option<&LensSheet>, all: Option<&Aberrations>) -> String {
    page(lens, sheet, all).to_svg()
}

/// Returns the page as an HTML file.
pub fn html_page(lens: &Lens, sheet: Option<&LensSheet>, all: Option<&Aberrations>) -> String {
    let about = About::of(lens.prescription());
    let title = about.title.unwrap_or_else(|| lens.name().to_owned());
    let title = escaped(&title);
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width\">\n<title>{title}</title>\n<style>body{{margin:0;\
         background:#fff}}svg{{display:block;margin:auto;max-width:100%;height:auto}}@media \
         (prefers-color-scheme:dark){{body{{background:#14181b}}}}</style>\n{}</html>\n",
        svg_page(lens, sheet, all)
    )
}

fn page(lens: &Lens, sheet: Option<&LensSheet>, all: Option<&Aberrations>) -> Drawing {
    let mut page = Drawing::new(WIDTH, 0.0);
    let mut y = header(&mut page, lens, sheet);
    y = section(&mut page, lens, sheet, y);
    y = tables(&mut page, lens, sheet, y);
    if let Some(sheet) = sheet {
        y = charts(&mut page, sheet, y);
        y = spots(&mut page, lens, sheet, y);
        if let Some(all) = all {
            y = aberration_page::draw(&mut page, lens, sheet, all, y);
        }
    }
    let foot = format!(
        "Lengths in millimeters; z from the front vertex, light to the right. Lines F 486.1, d 587.6, \
         C 656.3 nm. ivcam {}.",
        env!("CARGO_PKG_VERSION")
    );
    page.note([MARGIN, y + 10.0], Anchor::Start, 9.0, foot);
    page.height = y + 10.0 + MARGIN * 0.7;
    page
}

fn header(page: &mut Drawing, lens: &Lens, sheet: Option<&LensSheet>) -> f64 {
    let about = About::of(lens.prescription());
    let title = about
        .title
        .clone()
        .unwrap_or_else(|| lens.name().to_owned());
    page.heading([MARGIN, MARGIN + 14.0], 23.0, title);
    let facts = [
        Some(lens.name().to_owned()),
        about.kind,
        about.year,
        about.source,
    ];
    let line: Vec<String> = facts.into_iter().flatten().collect();
    page.note(
        [MARGIN, MARGIN + 34.0],
        Anchor::Start,
        11.5,
        line.join("  \u{b7}  "),
    );
    let mut y = MARGIN + 50.0;
    for note in about.notes.iter().flat_map(|note| wrapped(note, 150)) {
        page.note([MARGIN, y], Anchor::Start, 10.0, note);
        y += 14.0;
    }
    let optics = lens.first_order();
    let millimeters = |v: Option<f64>| v.map_or("\u{2014}".into(), |v| format!("{} mm", plain(v)));
    let figures = [
        ("focal length", millimeters(optics.focal.map(|f| f.efl))),
        (
            "f-number, real rays",
            lens.real_f_number()
                .map_or("\u{2014}".into(), |n| format!("f/{}", brief(n))),
        ),
        (
            "field",
            sheet.map_or("\u{2014}".into(), |s| {
                format!("{}\u{b0}", tidy(2.0 * s.half_field_degrees, 0.1))
            }),
        ),
        (
            "image circle",
            millimeters(sheet.map(|s| 2.0 * s.image_height)),
        ),
        ("back focus", millimeters(optics.focal.map(|f| f.bfl))),
        ("length", millimeters(Some(optics.length))),
    ];
    let step = (WIDTH - 2.0 * MARGIN) / figures.len() as f64;
    for (i, (name, value)) in figures.into_iter().enumerate() {
        let x = MARGIN + step * i as f64;
        page.text([x, y + 26.0], Anchor::Start, 18.0, value);
        page.note([x, y + 42.0], Anchor::Start, 10.0, name);
    }
    if let Some(sheet) = sheet {
        page.note([MARGIN, y + 62.0], Anchor::Start, 10.0, conditions(sheet));
        y += 20.0;
        if !lens.prescription().is_rotational() {
            let meridian = match lens.prescription().is_decentered() {
                true => {
                    "First-order data are those of the unfolded axis; curves, spots and fans of the film's y axis."
                }
                false => {
                    "The curves, spots and fans are those of points on the y axis of the film."
                }
            };
            page.note([MARGIN, y + 56.0], Anchor::Start, 10.0, meridian);
            y += 14.0;
        }
    }
    y + 56.0
}

/// Returns the object, the film and the reference of distortion in one line.
fn conditions(sheet: &LensSheet) -> String {
    let object = match sheet.object_distance {
        Some(mm) => format!("Object {} m from the front vertex", brief(mm / 1000.0)),
        None => "Object at infinity".into(),
    };
    let best = match sheet.best_film_z {
        Some(best) if (sheet.film_z - best).abs() < 1e-9 => ", the least spot on the axis".into(),
        Some(best) => format!(
            ", {} mm from the least spot on the axis",
            tidy(sheet.film_z - best, 1e-4)
        ),
        None => String::new(),
    };
    format!(
        "{object}; film at {} mm, {} mm from the paraxial image{best}; distortion in % of {}.",
        tidy(sheet.film_z, 1e-4),
        tidy(sheet.focus_shift, 1e-4),
        sheet.distortion_reference()
    )
}

fn section(page: &mut Drawing, lens: &Lens, sheet: Option<&LensSheet>, y: f64) -> f64 {
    let focal = lens.first_order().focal;
    let film_z = sheet
        .map(|s| s.film_z)
        .or(focal.map(|f| f.rear_focal_point));
    let film_z = film_z.unwrap_or(1.3 * lens.length());
    let height = sheet.map_or(0.0, |s| s.image_height);
    let mut options = SectionOptions::of(film_z, height);
    if let Some(distance) = sheet.and_then(|s| s.object_distance) {
        options.distance = distance;
    }
    options.width = WIDTH - 2.0 * MARGIN + 32.0;
    options.height = 380.0;
    if height == 0.0 {
        options.fields = vec![0.0];
    }
    let drawing = LensDiagram::of(lens, options).drawing();
    let bottom = y + drawing.height;
    page.put(drawing, [MARGIN - 16.0, y + 8.0]);
    bottom + 22.0
}

/// First-order data to the left, surfaces to the right.
fn tables(page: &mut Drawing, lens: &Lens, sheet: Option<&LensSheet>, top: f64) -> f64 {
    let optics = lens.first_order();
    page.heading([MARGIN, top], 11.5, "First order");
    let mut rows: Vec<(&str, Option<f64>)> = Vec::new();
    if let Some(f) = optics.focal {
        rows.extend([
            ("focal length", Some(f.efl)),
            ("back focal length", Some(f.bfl)),
            ("front focal length", Some(f.ffl)),
            ("front focal point F", Some(f.front_focal_point)),
            ("rear focal point F\u{2032}", Some(f.rear_focal_point)),
            ("front principal plane H", Some(f.front_principal_plane)),
            (
                "rear principal plane H\u{2032}",
                Some(f.rear_principal_plane),
            ),
        ]);
    } else {
        rows.push(("angular magnification", Some(optics.matrix[3])));
    }
    if !lens.prescription().is_rotational() {
        let across = lens.first_order_in(Meridian::X).focal;
        rows.push(("focal length across, in x", across.map(|f| f.efl)));
        rows.push(("rear focal point in x", across.map(|f| f.rear_focal_point)));
    }
    let (en, ex) = (optics.entrance_pupil, optics.exit_pupil);
    rows.extend([
        ("entrance pupil", en.map(|p| p.z)),
        ("its semi-diameter", en.map(|p| p.semi_diameter)),
        ("exit pupil", ex.map(|p| p.z)),
        ("its semi-diameter", ex.map(|p| p.semi_diameter)),
        ("f-number, real rays", lens.real_f_number()),
        ("f-number, paraxial", optics.f_number()),
        ("T-number, real rays", lens.t_number()),
        ("T-number, paraxial", lens.paraxial_t_number()),
        ("length", Some(optics.length)),
    ]);
    let edge = MARGIN + 232.0;
    let mut y = top + 8.0;
    for (name, value) in rows {
        y += 14.0;
        page.note([MARGIN, y], Anchor::Start, 10.0, name);
        let value = value.map_or("\u{221e}".into(), |v| tidy(v, 0.001));
        page.text([edge, y], Anchor::End, 10.0, value);
    }
    if let Some(sheet) = sheet.filter(|s| s.breathing.len() > 1) {
        y = breathing(page, sheet, edge, y + 30.0);
    }
    let bottom = surfaces(page, lens, edge + 48.0, top);
    y.max(bottom) + 34.0
}

/// Draws a table of field and magnification by focus distance.
fn breathing(page: &mut Drawing, sheet: &LensSheet, edge: f64, top: f64) -> f64 {
    page.heading([MARGIN, top], 11.5, "Focused nearer");
    let columns = [edge - 100.0, edge - 52.0, edge];
    let mut y = top + 16.0;
    for (x, head) in columns.iter().zip(["field", "change", "scale"]) {
        page.note([*x, y], Anchor::End, 9.0, head);
    }
    for row in &sheet.breathing {
        y += 14.0;
        let far = row
            .distance
            .map_or("\u{221e}".into(), |mm| match mm < 100.0 {
                true => format!("{} mm", tidy(mm, 0.1)),
                false => format!("{} m", brief(mm / 1000.0)),
            });
        page.note([MARGIN, y], Anchor::Start, 10.0, far);
        let degrees = |v: f64| format!("{}\u{b0}", tidy(v, 0.1));
        let cells = [
            row.field_degrees.map(degrees),
            row.field_change_percent
                .map(|v| format!("{} %", tidy(v, 0.1))),
            Some(tidy(row.magnification, 0.001)),
        ];
        for (x, cell) in columns.iter().zip(cells) {
            let cell = cell.unwrap_or_else(|| "\u{2014}".into());
            page.text([*x, y], Anchor::End, 10.0, cell);
        }
    }
    y
}

fn surfaces(page: &mut Drawing, lens: &Lens, left: f64, top: f64) -> f64 {
    page.heading([left, top], 11.5, "Surfaces");
    let all = &lens.prescription().folded().surfaces;
    let columns = if all.len() > 13 { 2 } else { 1 };
    let per_column = all.len().div_ceil(columns);
    let width = (WIDTH - MARGIN - left - (columns - 1) as f64 * GUTTER) / columns as f64;
    let width = width.min(420.0);
    let mut bottom = top;
    for (column, rows) in all.chunks(per_column).enumerate() {
        let x = left + column as f64 * (width + GUTTER);
        // The right edges of the columns, but the left edge of the medium's.
        let at = [0.05, 0.30, 0.49, 0.55, 1.0].map(|share| x + share * width);
        let mut y = top + 8.0 + 14.0;
        let heads = ["", "radius", "thickness", "medium", "semi-diam."];
        for (k, (head, x)) in heads.iter().zip(at).enumerate() {
            let anchor = if k == 3 { Anchor::Start } else { Anchor::End };
            page.note([x, y], anchor, 9.0, *head);
        }
        for (i, surface) in rows.iter().enumerate() {
            y += 13.0;
            let number = (column * per_column + i).to_string();
            let cells = [
                radius(surface),
                tidy(surface.thickness, 0.001),
                medium(surface),
                tidy(surface.semi_diameter, 0.01),
            ];
            page.note([at[0], y], Anchor::End, 9.0, number);
            for (k, cell) in cells.into_iter().enumerate() {
                let anchor = if k == 2 { Anchor::Start } else { Anchor::End };
                page.text([at[k + 1], y], anchor, 9.5, cell);
            }
        }
        bottom = bottom.max(y);
    }
    bottom
}

fn radius(surface: &Surface) -> String {
    let bend = surface.curvature;
    let plain = if bend.is_plane() {
        "\u{221e}".into()
    } else {
        tidy(bend.radius(), 0.001)
    };
    match &surface.shape {
        Shape::Sphere if surface.is_stop && bend.is_plane() => "stop".into(),
        Shape::Sphere => plain,
        Shape::CylinderX | Shape::CylinderY => format!("cyl {plain}"),
        Shape::Toroid { .. } => format!("tor {plain}"),
        Shape::ThinLens { focal_length } => format!("f {}", tidy(*focal_length, 0.001)),
        Shape::Conic { .. } | Shape::Asphere { .. } | Shape::NormalAsphere { .. } => {
            format!("a {plain}")
        }
    }
}

fn medium(surface: &Surface) -> String {
    let medium = &surface.medium;
    if surface.is_mirror {
        return "mirror".to_owned();
    }
    if medium.n_d == 1.0 {
        return String::new();
    }
    let n = tidy(medium.n_d, 1e-5);
    match (medium.name.as_str(), medium.abbe()) {
        ("", Some(v)) => format!("{n}  {}", tidy(v, 0.1)),
        ("", None) => n,
        (name, _) => format!("{n}  {name}"),
    }
}

fn charts(page: &mut Drawing, sheet: &LensSheet, top: f64) -> f64 {
    let width = (WIDTH - 2.0 * MARGIN - 2.0 * GUTTER) / 3.0;
    let mut rows = vec![
        vec![distortion(sheet), illumination(sheet), curvature(sheet)],
        vec![spherical(sheet), lateral(sheet), chromatic(sheet)],
    ];
    if !sheet.dispersive {
        rows[1].truncate(1);
    }
    if sheet.image_height == 0.0 {
        // On the axis alone there is nothing over the height.
        rows.remove(0);
        rows[0].retain(|chart| chart.title != "Lateral color");
    }
    let mut y = top;
    for row in rows {
        if row.len() == 1 {
            let x = MARGIN + width + GUTTER;
            page.heading([x, y + 11.0], 11.5, "Color");
            let text = "The source gives indices at the d line alone.";
            page.note([x, y + 30.0], Anchor::Start, 10.0, text);
        }
        for (i, chart) in row.into_iter().enumerate() {
            let x = MARGIN + i as f64 * (width + GUTTER);
            page.put(chart.draw(width, CHART_HEIGHT), [x, y]);
        }
        y += CHART_HEIGHT + 22.0;
    }
    let modulations = [
        modulation(
            sheet,
            &format!("Modulation, rays, {}", sheet.line_names()[1]),
            |p| &p.geometric,
        ),
        modulation(sheet, "Modulation, waves, white light", |p| &p.diffraction),
    ];
    for (i, chart) in modulations.into_iter().enumerate() {
        let x = MARGIN + i as f64 * (width + GUTTER);
        page.put(chart.draw(width, CHART_HEIGHT), [x, y]);
    }
    page.put(
        pupils(sheet, width, CHART_HEIGHT),
        [MARGIN + 2.0 * (width + GUTTER), y],
    );
    y + CHART_HEIGHT + 26.0
}

/// Returns the points of a curve over the height on the film.
fn over_height(sheet: &LensSheet, value: impl Fn(&FieldRow) -> Option<f64>) -> Vec<[f64; 2]> {
    let rows = sheet.fields.iter();
    rows.filter_map(|row| Some([row.height, value(row)?]))
        .collect()
}

fn field_chart(title: &str, unit: &str, series: Vec<Series>, span: (f64, f64)) -> Chart {
    Chart {
        title: title.into(),
        x_label: "image height, mm".into(),
        y_label: unit.into(),
        series,
        y_span: span,
        x_span: None,
        upright: false,
    }
}

fn distortion(sheet: &LensSheet) -> Chart {
    let curve = over_height(sheet, |row| row.distortion_percent);
    let unit = match sheet.projection {
        "m y" => format!("% of m y, m = {}", tidy(sheet.projection_scale, 1e-4)),
        name => format!("% of {name}, f = {} mm", tidy(sheet.projection_scale, 0.01)),
    };
    let series = vec![Series::new(curve, 0, "")];
    field_chart("Distortion", &unit, series, (-1.0, 1.0)).upright()
}

fn illumination(sheet: &LensSheet) -> Chart {
    let curve = over_height(sheet, |row| Some(row.relative_illumination));
    let cos4 = over_height(sheet, |row| {
        let cos = libm::cos(row.angle_degrees.to_radians());
        (cos > 0.0).then(|| libm::pow(cos, 4.0))
    });
    let series = vec![
        Series::new(curve, 0, "lens"),
        Series::new(cos4, 1, "cos\u{2074}").dashed(),
    ];
    field_chart("Relative illumination", "", series, (0.0, 1.0))
}

fn curvature(sheet: &LensSheet) -> Chart {
    let tangential = sheet.focus_curve(|row| row.tangential_focus);
    let sagittal = sheet.focus_curve(|row| row.sagittal_focus);
    let series = vec![
        Series::new(tangential, 2, "tangential"),
        Series::new(sagittal, 1, "sagittal").dashed(),
    ];
    field_chart("Field curvature", "mm", series, (0.0, 0.0)).upright()
}

fn lateral(sheet: &LensSheet) -> Chart {
    let micrometers = |v: Option<f64>| v.map(|v| 1000.0 * v);
    let [f, d, c] = sheet.line_names();
    let series = vec![
        Series::new(over_height(sheet, |row| micrometers(row.lateral_f)), 1, &f),
        Series::new(over_height(sheet, |row| micrometers(row.lateral_c)), 2, &c),
    ];
    let unit = format!("\u{b5}m from {d}");
    field_chart("Lateral color", &unit, series, (-1.0, 1.0))
}

fn spherical(sheet: &LensSheet) -> Chart {
    let curve = |value: fn(&Zone) -> Option<f64>| -> Vec<[f64; 2]> {
        let zones = sheet.spherical.iter();
        zones
            .filter_map(|zone| Some([zone.pupil, value(zone)?]))
            .collect()
    };
    let [f, d, c] = sheet.line_names();
    Chart {
        title: "Spherical aberration".into(),
        x_label: "height in the pupil".into(),
        y_label: "mm from the film".into(),
        series: if sheet.dispersive {
            vec![
                Series::new(curve(|z| z.focus_f), 1, &f),
                Series::new(curve(|z| z.focus_d), 3, &d),
                Series::new(curve(|z| z.focus_c), 2, &c),
            ]
        } else {
            vec![Series::new(curve(|z| z.focus_d), 0, "")]
        },
        y_span: (0.0, 0.0),
        x_span: Some((0.0, 1.0)),
        upright: true,
    }
}

fn chromatic(sheet: &LensSheet) -> Chart {
    let curve = sheet
        .color
        .iter()
        .map(|row| [row.wavelength_nm, row.focus])
        .collect();
    Chart {
        title: "Longitudinal color".into(),
        x_label: "wavelength, nm".into(),
        y_label: format!("mm from {}", sheet.line_names()[1]),
        series: vec![Series::new(curve, 0, "")],
        y_span: (-0.01, 0.01),
        x_span: sheet
            .color
            .first()
            .zip(sheet.color.last())
            .map(|(first, last)| (first.wavelength_nm, last.wavelength_nm)),
        upright: true,
    }
}

fn modulation(sheet: &LensSheet, title: &str, of: fn(&PointImage) -> &Modulation) -> Chart {
    let mut series = Vec::new();
    for (i, point) in sheet.points.iter().enumerate() {
        let curve = |values: &[f64]| -> Vec<[f64; 2]> {
            sheet
                .frequencies
                .iter()
                .zip(values)
                .map(|(f, m)| [*f, *m])
                .collect()
        };
        let modulation = of(point);
        let ink = Ink::Ray(i as u8);
        let name = format!("{} mm", tidy(point.height, 0.1));
        let solid = Series {
            ink,
            ..Series::new(curve(&modulation.tangential), 0, &name)
        };
        let dashed = Series {
            ink,
            ..Series::new(curve(&modulation.sagittal), 0, "")
        };
        series.push(solid);
        series.push(dashed.dashed());
    }
    Chart {
        title: title.into(),
        x_label: "line pairs per millimeter; solid tangential, dashed sagittal".into(),
        y_label: String::new(),
        series,
        y_span: (0.0, 1.0),
        x_span: None,
        upright: false,
    }
}

/// Draws the outlines of the beams that pass through the lens at each height, as seen along the
/// light.
fn pupils(sheet: &LensSheet, width: f64, height: f64) -> Drawing {
    let mut drawing = Drawing::new(width, height);
    drawing.heading([0.0, 11.0], 11.5, "Beam by height");
    let count = sheet.points.len().max(1) as f64;
    let cell = width / count;
    let size = sheet.points.iter().flat_map(|p| {
        let middle = middle(&p.pupil);
        p.pupil
            .iter()
            .map(move |[x, y]| (x - middle[0]).abs().max((y - middle[1]).abs()))
    });
    let scale = 0.44 * cell / size.fold(1e-9, f64::max);
    for (i, point) in sheet.points.iter().enumerate() {
        let center = [cell * (i as f64 + 0.5), 0.5 * height + 2.0];
        let middle = middle(&point.pupil);
        let place = |[x, y]: &[f64; 2]| {
            [
                center[0] + scale * (x - middle[0]),
                center[1] - scale * (y - middle[1]),
            ]
        };
        let circle = (0..64).map(|i| {
            let angle = std::f64::consts::TAU * f64::from(i) / 64.0;
            [
                center[0] + scale * libm::cos(angle),
                center[1] + scale * libm::sin(angle),
            ]
        });
        drawing.shape(circle.collect(), Ink::Faint);
        if point.pupil.len() > 2 {
            drawing.shape(point.pupil.iter().map(place).collect(), Ink::Curve(0));
        }
        let text = format!("{} mm", tidy(point.height, 0.1));
        drawing.note([center[0], height - 22.0], Anchor::Middle, 9.0, text);
        let share = format!("{} %", tidy(100.0 * point.pupil_area, 1.0));
        drawing.note([center[0], height - 9.0], Anchor::Middle, 9.0, share);
    }
    drawing
}

/// Returns the center of the bounding box of an outline.
fn middle(outline: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|k| {
        let values = outline.iter().map(|p| p[k]);
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        if high >= low { 0.5 * (low + high) } else { 0.0 }
    })
}

fn spots(page: &mut Drawing, lens: &Lens, sheet: &LensSheet, top: f64) -> f64 {
    let largest = sheet.points.iter().map(|p| p.rms).fold(1e-6, f64::max);
    let half = round_number(2.2 * largest);
    let box_text = spot_note(sheet, 2000.0 * half);
    page.heading_with_note([MARGIN, top], "Spots", box_text);
    let inks: &[(usize, u8)] = match sheet.dispersive {
        true => &[(0, 1), (1, 3), (2, 2)],
        false => &[(1, 0)],
    };
    let count = sheet.points.len().max(1) as f64;
    let size = ((WIDTH - 2.0 * MARGIN - (count - 1.0) * GUTTER) / count).min(210.0);
    let step = (WIDTH - 2.0 * MARGIN - size) / (count - 1.0).max(1.0);
    let airy = lens
        .real_f_number()
        .map(|n| 1.22 * lens.wavelength() * 1e-6 * n);
    let airy_text = airy.map_or(String::new(), |r| {
        format!(", Airy {}", tidy(1000.0 * r, 0.1))
    });
    for (i, point) in sheet.points.iter().enumerate() {
        let corner = [MARGIN + step * i as f64, top + 12.0];
        let center = corner.map(|c| c + 0.5 * size);
        let scale = 0.5 * size / half;
        let [x, y] = corner;
        let frame = vec![[x, y], [x + size, y], [x + size, y + size], [x, y + size]];
        page.shape(frame, Ink::Faint);
        if let Some(r) = airy.filter(|r| *r < half) {
            let circle = (0..64).map(|i| {
                let angle = std::f64::consts::TAU * f64::from(i) / 64.0;
                [
                    center[0] + scale * r * libm::cos(angle),
                    center[1] + scale * r * libm::sin(angle),
                ]
            });
            page.shape(circle.collect(), Ink::Label);
        }
        for (line, curve) in inks {
            let spot = &point.spots[*line];
            let every = (spot.len() / 350).max(1);
            let inside = spot
                .iter()
                .step_by(every)
                .filter(|p| p.abs().max_element() < half);
            let places = inside
                .map(|p| [center[0] + scale * p.x, center[1] - scale * p.y])
                .collect();
            page.items.push(DrawingItem::Dots {
                places,
                radius: 0.6,
                ink: Ink::Curve(*curve),
            });
        }
        let (height, angle) = (tidy(point.height, 0.1), tidy(point.angle_degrees, 0.1));
        let drawn = inks.iter().flat_map(|(line, _)| &point.spots[*line]);
        let text = format!(
            "{height} mm, {angle}\u{b0}   rms {} \u{b5}m{airy_text}{}",
            tidy(1000.0 * point.rms, 0.1),
            beyond_box(drawn, half)
        );
        page.note([x, y + size + 14.0], Anchor::Start, 9.0, text);
    }
    top + 12.0 + size + 34.0
}

/// The note beside the heading of spots, in boxes of a width in micrometers.
fn spot_note(sheet: &LensSheet, wide: f64) -> String {
    let [short, own, long] = sheet.line_names();
    let colors = match sheet.dispersive {
        true => format!("; {short} blue, {own} green, {long} red"),
        false => String::new(),
    };
    format!("boxes are {} \u{b5}m wide{colors}", tidy(wide, wide))
}

/// The share of a spot that is outside of a box, as words; empty if all is inside.
fn beyond_box<'a>(spot: impl Iterator<Item = &'a DVec2>, half: f64) -> String {
    let outside: Vec<bool> = spot.map(|p| p.abs().max_element() >= half).collect();
    let count = outside.iter().filter(|is_outside| **is_outside).count();
    match 100.0 * count as f64 / outside.len().max(1) as f64 {
        0.0 => String::new(),
        share if share < 1.0 => ", under 1% outside".to_owned(),
        share => format!(", {share:.0}% outside"),
    }
}

/// Formats a number with three or four digits.
fn plain(value: f64) -> String {
    match value.abs() {
        a if a >= 1000.0 => tidy(value, 1.0),
        a if a >= 100.0 => tidy(value, 0.1),
        _ => tidy(value, 0.01),
    }
}

fn brief(value: f64) -> String {
    tidy(value, if value < 10.0 { 0.01 } else { 0.1 })
}

/// Divides a text into lines of fewer than `most` letters.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].chars().count() + word.chars().count() >= most {
            lines.push(word.to_owned());
        } else {
            if !lines[last].is_empty() {
                lines[last].push(' ');
            }
            lines[last] += word;
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_all_its_parts() {
        let lens = Lens::named("double-gauss").unwrap();
        let setting = crate::lens::SheetSetting::default();
        let (sheet, all) = Aberrations::with_sheet(&lens, &setting).unwrap();
        let text = html_page(&lens, Some(&sheet), Some(&all));
        for part in [
            "Distortion",
            "Relative illumination",
            "Spots",
            "Modulation",
            "Surfaces",
            "Ray fans",
            "Strehl ratio",
            "Seidel coefficients",
        ] {
            assert!(text.contains(part), "{part}");
        }
        assert!(!text.contains("NaN") && text.ends_with("</html>\n"));
    }

    #[test]
    fn the_share_of_a_spot_outside_of_its_box_is_stated() {
        let spot: Vec<DVec2> = (0..400).map(|i| DVec2::new(0.1, f64::from(i))).collect();
        assert_eq!(beyond_box(spot.iter(), 400.0), "");
        assert_eq!(beyond_box(spot.iter(), 398.0), ", under 1% outside");
        assert_eq!(beyond_box(spot.iter(), 300.0), ", 25% outside");
    }

    #[test]
    fn field_curvature_far_from_the_film_is_drawn() {
        let lens = Lens::named("double-gauss").unwrap();
        let setting = crate::lens::SheetSetting {
            defocus: 30.0,
            ..Default::default()
        };
        let sheet = LensSheet::at(&lens, &setting).unwrap();
        let lines = curvature(&sheet).series;
        assert!(lines.iter().all(|line| line.points.len() > 20));
    }

    #[test]
    fn a_lens_without_focus_has_a_page_too() {
        let lens = Lens::named("achromat").unwrap();
        let mut afocal = lens.prescription().clone();
        afocal.surfaces.truncate(1);
        let text = svg_page(&Lens::new(afocal), None, None);
        assert!(text.contains("First order"));
    }
}

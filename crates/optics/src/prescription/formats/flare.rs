//! Reads the `.lens` tables of programs that compute lens flares: `name:` and `focal_length:`,
//! then under `surfaces:` the radius (or `stop`, or `inf`), the thickness, the index and Abbe
//! number behind the surface, the semi-diameter, the layers of the coating, and perhaps a kind:
//! `sph`, `cyl_x`, `cyl_y`, or `toric` with the radius in y.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};

use crate::prescription::formats::format::Format;
use crate::prescription::formats::origin::name_of;
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::{Column, Prescription, check, check_count};
use crate::prescription::surface::{Curvature, MAX_POWER, Shape, Surface};
use crate::prescription::text::{Word, lines, text, words};

/// The `.lens` tables, recognized by the line above their rows.
pub(crate) static FORMAT: Format = Format {
    name: "lens flare table",
    recognizes: |text| text.lines().any(|line| line.trim() == "surfaces:"),
    read: |source, _, sink| read(source, sink),
};

const HELP: &str = "a row is: radius, thickness, index, Abbe number, semi-diameter, coating";

fn read(source: &Arc<Source>, sink: &mut Sink) -> Result<Prescription> {
    let mut name = None;
    let mut notes = Vec::new();
    let mut rows: Vec<Vec<Word<'_>>> = Vec::new();
    let mut inside = false;
    for (start, line) in lines(text(source)) {
        let data = line.split('#').next().unwrap_or("");
        let words = words(data, start);
        if words.is_empty() {
            continue;
        }
        if inside {
            rows.push(words);
        } else if let Some(stated) = data.trim().strip_prefix("name:") {
            name = Some(stated.trim().to_owned()).filter(|name| !name.is_empty());
        } else if let Some(stated) = data.trim().strip_prefix("focal_length:") {
            notes.push(format!("focal length: {}", stated.trim()));
        } else {
            inside = data.trim() == "surfaces:";
        }
    }
    check_count(rows.len(), source)?;
    let mut surfaces = Vec::with_capacity(rows.len());
    let mut medium = Medium::air();
    for row in &rows {
        let surface = surface(source, row, &medium)?;
        medium = surface.medium.clone();
        surfaces.push(surface);
    }
    let name = name.unwrap_or_else(|| name_of(source));
    let mut lens = Prescription {
        notes,
        ..Prescription::new(name, surfaces)
    };
    check(&mut lens, source, sink, |surface, column| {
        let at = match column {
            Column::Radius => 0,
            Column::Thickness => 1,
            Column::Index => 2,
            Column::SemiDiameter => 4,
        };
        let row = rows.get(surface);
        row.and_then(|row| row.get(at))
            .map_or(Span::at(0), |word| word.span)
    })?;
    Ok(lens)
}

fn surface(source: &Arc<Source>, row: &[Word<'_>], before: &Medium) -> Result<Surface> {
    let fail = |span, message: String| Diagnostic::error(message).at(source, span);
    let [radius, thickness, index, abbe, semi_diameter, rest @ ..] = row else {
        let last = row.last().map_or(Span::at(0), |word| word.span);
        let message = format!("too few numbers in this row: {} instead of 5", row.len());
        return Err(fail(Span::at(last.end as usize), message).with_help(HELP));
    };
    let is_stop = radius.is("stop");
    let bend = match is_stop || radius.is("inf") || radius.is("flat") {
        true => 0.0,
        false => radius.number(source)?,
    };
    let (n_d, abbe) = (index.number(source)?, abbe.number(source)?);
    let medium = match (is_stop, abbe > 0.0) {
        (true, _) => before.clone(),
        (false, true) => Medium::from_abbe(n_d, abbe),
        (false, false) => Medium::constant(n_d),
    };
    let plain = Surface::sphere(
        bend,
        thickness.number(source)?,
        medium,
        semi_diameter.number(source)?,
    );
    let layers = match rest.first() {
        Some(word) => word.number(source)?,
        None => 0.0,
    };
    let shape = match rest.get(1).map(|word| (word.text, word.span)) {
        None | Some(("sph" | "spherical", _)) => Shape::Sphere,
        Some(("cyl_x" | "cylinder_x", _)) => Shape::CylinderX,
        Some(("cyl_y" | "cylinder_y", _)) => Shape::CylinderY,
        Some(("toric", span)) => {
            // The radius of the row is that in x.
            let Some(radius) = rest.get(2) else {
                return Err(fail(span, "a `toric` surface has no radius in y".into()));
            };
            return Ok(Surface {
                shape: Shape::Toroid {
                    across: Curvature::from_radius(bend),
                    k: 0.0,
                    terms: Box::new([0.0; MAX_POWER + 1]),
                },
                curvature: Curvature::from_radius(radius.number(source)?),
                span,
                ..plain
            });
        }
        Some((word, span)) => {
            return Err(fail(span, format!("`{word}` is not a kind of surface"))
                .with_help("the kinds are sph, cyl_x, cyl_y and toric"));
        }
    };
    Ok(Surface {
        shape,
        is_stop,
        coating: match layers > 0.0 {
            true => Coating::MagnesiumFluoride,
            false => Coating::default(),
        },
        span: radius.span,
        ..plain
    })
}

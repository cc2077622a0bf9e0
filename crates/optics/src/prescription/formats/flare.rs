//! Reads the `.lens` tables of programs that compute lens flares: `name:` and `focal_length:`,
//! then under `surfaces:` the radius (or `stop`, or `inf`), the thickness, the index and Abbe
//! number behind the surface, the semi-diameter, the layers of the coating, and perhaps a kind:
//! `sph`, `cyl_x`, `cyl_y`, or `toric` with the radius in y.

use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::formats::format::PrescriptionFormat;
use crate::prescription::formats::reader::{PrescriptionReader, SurfaceSpans};
use crate::prescription::glass::coating::Coating;
use crate::prescription::glass::medium::Medium;
use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Curvature, Shape, Surface};
use crate::prescription::text::{Word, lines, words};

/// The `.lens` tables, recognized by the line above their rows.
pub(crate) static FORMAT: PrescriptionFormat = PrescriptionFormat {
    name: "lens flare table",
    recognizes: |text| text.lines().any(|line| line.trim() == "surfaces:"),
    read,
};

const HELP: &str = "a row is: radius, thickness, index, Abbe number, semi-diameter, coating";

fn read(file: PrescriptionReader<'_>, sink: &mut Sink) -> Result<Prescription> {
    let mut draft = file.draft(None);
    let mut rows: Vec<Vec<Word<'_>>> = Vec::new();
    let mut inside = false;
    for (start, line) in lines(file.text()) {
        let data = line.split('#').next().unwrap_or("");
        let words = words(data, start);
        if words.is_empty() {
            continue;
        }
        if inside {
            rows.push(words);
        } else if let Some(stated) = data.trim().strip_prefix("name:") {
            draft.lens.name = file.name(Some(stated.trim()));
        } else if let Some(stated) = data.trim().strip_prefix("focal_length:") {
            let note = format!("focal length: {}", stated.trim());
            draft.lens.notes.push(note);
        } else {
            inside = data.trim() == "surfaces:";
        }
    }
    file.check_count(rows.len())?;
    for row in &rows {
        let (surface, places) = surface(file, row, draft.medium())?;
        draft.push(surface, places);
    }
    file.finish(draft, sink)
}

/// The surface of a row, and the places of its numbers.
fn surface(
    file: PrescriptionReader<'_>,
    row: &[Word<'_>],
    before: &Medium,
) -> Result<(Surface, SurfaceSpans)> {
    let [radius, thickness, index, abbe, semi_diameter, rest @ ..] = row else {
        let last = row.last().map_or(Span::at(0), |word| word.span);
        let message = format!("too few numbers in this row: {} instead of 5", row.len());
        return Err(file.refuse(Span::at(last.end as usize), message, HELP));
    };
    let is_stop = radius.is("stop");
    let bend = match is_stop || radius.is("inf") || radius.is("flat") {
        true => 0.0,
        false => file.number(*radius)?,
    };
    let (n_d, abbe) = (file.number(*index)?, file.number(*abbe)?);
    let medium = match is_stop {
        true => before.clone(),
        false => Medium::from_index(n_d, Some(abbe)),
    };
    let plain = Surface {
        is_stop,
        span: radius.span,
        ..Surface::sphere(
            bend,
            file.number(*thickness)?,
            medium,
            file.number(*semi_diameter)?,
        )
    };
    let layers = rest.first().map_or(Ok(0.0), |word| file.number(*word))?;
    let coating = match layers > 0.0 {
        true => Coating::MagnesiumFluoride,
        false => Coating::default(),
    };
    let surface = Surface {
        coating,
        ..with_kind(file, plain, &rest[rest.len().min(1)..])?
    };
    let places = [radius, thickness, index, semi_diameter].map(|word| word.span);
    Ok((surface, places))
}

/// A surface of the kind that the last words of its row name; a sphere without such words.
fn with_kind(file: PrescriptionReader<'_>, plain: Surface, words: &[Word<'_>]) -> Result<Surface> {
    let Some(kind) = words.first() else {
        return Ok(plain);
    };
    let (curvature, shape) = match kind.text {
        "sph" | "spherical" => (plain.curvature, Shape::Sphere),
        "cyl_x" | "cylinder_x" => (plain.curvature, Shape::CylinderX),
        "cyl_y" | "cylinder_y" => (plain.curvature, Shape::CylinderY),
        "toric" => {
            // The radius of the row is that in x.
            let Some(radius) = words.get(1) else {
                let message = "a `toric` surface has no radius in y";
                return Err(file.fail(kind.span, message));
            };
            let in_y = Curvature::from_radius(file.number(*radius)?);
            (in_y, Shape::toroid(plain.curvature, 0.0))
        }
        other => {
            let message = format!("`{other}` is not a kind of surface");
            let help = "the kinds are sph, cyl_x, cyl_y and toric";
            return Err(file.refuse(kind.span, message, help));
        }
    };
    Ok(Surface {
        curvature,
        shape,
        ..plain
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ivcam_base::diag::Source;

    use super::*;

    /// The radius of a row is that in x, whatever else the row says.
    #[test]
    fn a_toric_row_keeps_its_coating() {
        let text = "surfaces:\n50 5 1.5 60 9 1 toric 40\n-50 60 1 0 9 0\n";
        let source = Arc::new(Source::new("a.lens", text.into()));
        let lens = crate::prescription::formats::read(&source, &mut Sink::new()).unwrap();
        let front = &lens.surfaces[0];
        assert_eq!(front.coating, Coating::MagnesiumFluoride);
        assert_eq!(front.curvature.radius(), 40.0);
        let across = Curvature::from_radius(50.0);
        assert_eq!(front.shape, Shape::toroid(across, 0.0));
    }
}

//! The files that `ivcam lens` writes: prescriptions, drawings, pages, tables and pictures.

use std::path::Path;

use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::diagram::{LensDiagram, SectionOptions, html_page, point_spreads, svg_page};
use ivcam_optics::picture::PictureFormat;
use ivcam_optics::prescription::formats::write::{OutputFormat, write};
use ivcam_render::camera::{film_plane, lens_in_scene};

use super::lens_csv;
use super::lens_export;
use super::lens_request::{Content, LensRequest, no_image};
use super::trace_rays::Traced;

/// Returns the ending of a file's name in small letters, without the dot.
pub(super) fn ending(file: &str) -> String {
    let ending = Path::new(file).extension().and_then(|e| e.to_str());
    ending.unwrap_or("").to_ascii_lowercase()
}

/// Writes the prescription, and warns about data that the format cannot express.
pub(super) fn prescription(request: &LensRequest<'_>, file: &str) -> Result<Content> {
    let target = OutputFormat::of(Path::new(file))?;
    let lens = lens_export::restated(request, target);
    let (text, left_out) = write(&lens, target)?;
    for what in left_out {
        super::status!("warning: `{file}` leaves out {what}");
    }
    Ok(Content::Text(text))
}

/// Draws the section with the rays of `--trace`, or else with rays of its own.
pub(super) fn diagram(request: &LensRequest<'_>, file: &str) -> Result<Content> {
    let lens = &request.lens;
    let diagram = match &request.rays {
        Some(rays) => rays.diagram(lens, request.film_z(), file),
        None => LensDiagram::of(lens, SectionOptions::for_lens(lens, &request.setting())),
    };
    let drawing = diagram.drawing();
    Ok(Content::Text(match ending(file).as_str() {
        "fig" => drawing.to_fig(),
        _ => drawing.to_svg(),
    }))
}

/// Writes the data sheet as one page.
pub(super) fn page(request: &LensRequest<'_>, file: &str) -> Result<Content> {
    let write = match ending(file).as_str() {
        "svg" => svg_page,
        _ => html_page,
    };
    let (sheet, all) = request.sheet().map(|(sheet, all)| (sheet, all)).unzip();
    Ok(Content::Text(write(&request.lens, sheet, all)))
}

/// Writes the data sheet as CSV.
pub(super) fn csv(request: &LensRequest<'_>, _: &str) -> Result<Content> {
    let lens = &request.lens;
    let (sheet, all) = request.sheet().ok_or_else(|| no_image(lens))?;
    Ok(Content::Text(lens_csv::csv(sheet, all, lens.wavelength())))
}

/// Draws the images of points.
pub(super) fn points(request: &LensRequest<'_>, file: &str) -> Result<Content> {
    let path = Path::new(file);
    let picture = point_spreads(&request.lens, &request.setting(), PictureFormat::of(path)?)?;
    Ok(Content::Pictures(vec![(path.to_owned(), picture)]))
}

/// Writes the lens as solids of a scene, with the film in focus.
pub(super) fn scene(request: &LensRequest<'_>, _: &str) -> Result<Content> {
    let lens = &request.lens;
    let no_film =
        || Diagnostic::error(format!("`{}` has no focal point for the film", lens.name()));
    let film_z = request.film_z().ok_or_else(no_film)?;
    lens_in_scene(lens, &film_plane(lens, film_z), None).map(Content::Text)
}

/// Writes what became of the rays of `--trace`.
pub(super) fn rays(request: &LensRequest<'_>, _: &str) -> Result<Content> {
    let rays = request.rays.as_ref();
    let text = rays.map_or(Ok(String::new()), Traced::json)?;
    Ok(Content::Text(text))
}

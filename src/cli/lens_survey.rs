//! `ivcam lens FOLDER`: one line for each lens file of a folder, or for several lenses, as text,
//! JSON, CSV or a page.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result, Severity, Sink, counted};
use ivcam_base::files::escaped;
use ivcam_base::work::{Budget, WorkLimit};
use ivcam_optics::diagram::{LensDiagram, SectionOptions};
use ivcam_optics::lens::{Lens, Meridian, SheetSetting, open_prescription};
use ivcam_optics::prescription::Reading;
use rayon::prelude::*;

use super::lens_json::{Object, field, pretty};
use super::lens_request::Content;

/// The endings of lens files. A file of another ending is not listed.
const ENDINGS: [&str; 11] = [
    "dat", "zmx", "seq", "roa", "len", "lens", "osl", "json", "fx", "txt", "lhlt",
];
/// Endings that other files have too: one that is no lens is not listed.
const SHARED: [&str; 3] = ["dat", "json", "txt"];

/// What a survey says of a file.
struct SurveyRow {
    /// The path below the folder, or the name.
    file: String,
    /// The lens, with its data; or why it is not read.
    lens: Result<SurveyedLens>,
}

struct SurveyedLens {
    lens: Lens,
    efl: Option<f64>,
    f_number: Option<f64>,
    /// Half of the field, in degrees.
    half_field: Option<f64>,
    /// At the edge of the field: to f tan θ, or to f θ from a half field of 60 degrees on.
    distortion_percent: Option<f64>,
    warnings: Vec<String>,
}

/// The lens files of a folder and of those in it, each with its data.
pub(super) struct LensSurvey {
    rows: Vec<SurveyRow>,
    /// The files that are no lenses, of endings that other files have too.
    others: usize,
}

impl LensSurvey {
    /// Opens all lens files below a folder. `work` is the limit of each.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be read, or has no lens files.
    pub(super) fn of(folder: &Path, reading: &Reading, work: WorkLimit) -> Result<Self> {
        let mut files = Vec::new();
        collect(folder, &mut files)?;
        files.sort();
        let rows = files.into_par_iter().map(|path| SurveyRow {
            file: path
                .strip_prefix(folder)
                .unwrap_or(&path)
                .display()
                .to_string(),
            lens: opened(&path, reading, work),
        });
        let rows: Vec<SurveyRow> = rows.collect();
        let is_listed =
            |row: &SurveyRow| row.lens.is_ok() || !SHARED.contains(&&*ending(&row.file));
        let (rows, others): (Vec<SurveyRow>, Vec<SurveyRow>) =
            rows.into_iter().partition(is_listed);
        let others = others.len();
        match rows.is_empty() {
            false => Ok(Self { rows, others }),
            true => {
                let message = format!("`{}` has no lens files", folder.display());
                let help = format!("their names end in .{}", ENDINGS.join(", ."));
                Err(Diagnostic::not_found(message).with_help(help))
            }
        }
    }

    /// Opens lenses by their names or files, in this order. `work` is the limit of each.
    pub(super) fn of_names(names: &[&str], reading: &Reading, work: WorkLimit) -> Self {
        let rows = names.par_iter().map(|name| SurveyRow {
            file: (*name).to_owned(),
            lens: opened(Path::new(name), reading, work),
        });
        Self {
            rows: rows.collect(),
            others: 0,
        }
    }

    /// Says how many lenses are not read, if any.
    pub(super) fn unread(&self) -> Option<String> {
        let lost = self.rows.iter().filter(|row| row.lens.is_err()).count();
        (lost > 0).then(|| format!("{lost} of {} lenses not read", self.rows.len()))
    }

    /// Returns a line for each lens.
    pub(super) fn text(&self) -> Content {
        let widest = self.rows.iter().map(|row| row.file.chars().count()).max();
        let width = widest.unwrap_or(0).clamp(4, 48);
        let mut text = format!(
            "  {:width$}       EFL  f-number  half field  distortion    length\n",
            "file"
        );
        let number = |value: Option<f64>, unit: &str, places: usize| {
            value.map_or("-".to_owned(), |value| format!("{value:.places$}{unit}"))
        };
        for row in &self.rows {
            let _ = match &row.lens {
                Err(error) => writeln!(text, "  {:width$}  not read: {}", row.file, error.message),
                Ok(found) => writeln!(
                    text,
                    "  {:width$}  {:>8}  {:>8}  {:>10}  {:>10}  {:>8}{}",
                    row.file,
                    number(found.efl, "", 2),
                    number(found.f_number.map(|n| (n * 100.0).round() / 100.0), "", 2),
                    number(found.half_field, "\u{b0}", 1),
                    number(found.distortion_percent, "%", 2),
                    number(Some(found.lens.length()), "", 1),
                    match found.warnings.len() {
                        0 => String::new(),
                        1 => format!("  {}", found.warnings[0]),
                        n => format!("  {n} warnings: {}", found.warnings[0]),
                    }
                ),
            };
        }
        let lost = self.rows.iter().filter(|row| row.lens.is_err()).count();
        let read = match self.rows.len() - lost {
            1 => "1 lens".to_owned(),
            n => format!("{n} lenses"),
        };
        let _ = writeln!(
            text,
            "{read}, {} not read; lengths in mm; --json, --csv FILE and --sheet FILE.html have more",
            counted(lost, "file")
        );
        if self.others > 0 {
            let (files, endings) = (counted(self.others, "file"), SHARED.join(", ."));
            let _ = writeln!(
                text,
                "not listed, because it is no lens: {files} (.{endings})"
            );
        }
        Content::Text(text)
    }

    /// Returns the rows as JSON.
    pub(super) fn json(&self) -> Result<Content> {
        pretty(&self.rows.iter().map(SurveyRow::object).collect::<Vec<_>>())
    }

    /// Returns the rows as CSV.
    pub(super) fn csv(&self) -> Content {
        let mut text = String::from(
            "file,name,efl_mm,f_number,half_field_deg,distortion_percent,length_mm,surfaces,warnings,error\n",
        );
        let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        for row in &self.rows {
            let file = quoted(&row.file);
            let _ = match &row.lens {
                Err(error) => writeln!(text, "{file},,,,,,,,,{}", quoted(&error.message)),
                Ok(found) => writeln!(
                    text,
                    "{file},{},{},{},{},{},{},{},{},",
                    quoted(found.lens.name()),
                    number(found.efl),
                    number(found.f_number),
                    number(found.half_field),
                    number(found.distortion_percent),
                    found.lens.length(),
                    found.lens.prescription().surfaces.len(),
                    quoted(&found.warnings.join("; ")),
                ),
            };
        }
        Content::Text(text)
    }

    /// Returns a page with the section of each lens.
    pub(super) fn page(&self) -> Content {
        let mut page = String::from(HEAD);
        for row in &self.rows {
            let file = escaped(&row.file);
            let _ = match &row.lens {
                Err(error) => writeln!(
                    page,
                    "<figure><figcaption><b>{file}</b><br>not read: {}</figcaption></figure>",
                    escaped(&error.message)
                ),
                Ok(found) => {
                    let options = SectionOptions::for_lens(&found.lens, &SheetSetting::default());
                    let drawing = LensDiagram::of(&found.lens, options).drawing().to_svg();
                    let drawing = drawing.find("<svg").map_or("", |at| &drawing[at..]);
                    writeln!(
                        page,
                        "<figure>{drawing}<figcaption><b>{file}</b> {}<br>{}</figcaption></figure>",
                        escaped(found.lens.name()),
                        escaped(&found.caption())
                    )
                }
            };
        }
        page += "</main></html>\n";
        Content::Text(page)
    }
}

/// The beginning of the page, which is in the colors of the reader's system.
const HEAD: &str = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\">\
<meta name=\"viewport\" content=\"width=device-width\"><title>Lenses</title>\
<style>:root{color-scheme:light dark}body{font:14px sans-serif;margin:1em}\
main{display:grid;grid-template-columns:repeat(auto-fill,minmax(300px,1fr));gap:1em}\
figure{margin:0;padding:.5em;border:1px solid #8884;overflow-wrap:anywhere}\
svg{width:100%;height:auto;background:#fff}</style><main>\n";

impl SurveyRow {
    fn object(&self) -> Object {
        let mut row = Object::from([("file", field(self.file.clone()))]);
        match &self.lens {
            Err(error) => {
                row.insert("error", field(error.message.clone()));
            }
            Ok(found) => row.extend([
                ("name", field(found.lens.name())),
                ("efl", field(found.efl)),
                ("f_number", field(found.f_number)),
                ("half_field_degrees", field(found.half_field)),
                ("distortion_percent", field(found.distortion_percent)),
                ("length", field(found.lens.length())),
                ("surfaces", field(found.lens.prescription().surfaces.len())),
                ("warnings", field(found.warnings.clone())),
            ]),
        }
        row
    }
}

impl SurveyedLens {
    /// The data in one line.
    fn caption(&self) -> String {
        let mut parts = Vec::new();
        let mut add = |value: Option<f64>, before: &str, after: &str, places: usize| {
            parts.extend(value.map(|value| format!("{before}{value:.places$}{after}")));
        };
        add(self.efl, "", " mm", 2);
        add(self.f_number, "f/", "", 2);
        add(self.half_field, "\u{b1}", "\u{b0}", 1);
        add(self.distortion_percent, "distortion ", "%", 2);
        add(Some(self.lens.length()), "length ", " mm", 1);
        parts.join(" \u{b7} ")
    }
}

/// Adds the files with an ending of a lens below a folder. Links are not followed.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let failed = |error| Diagnostic::io(folder.display().to_string(), &error);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let (path, kind) = (entry.path(), entry.file_type().map_err(failed)?);
        if kind.is_dir() {
            collect(&path, files)?;
        } else if ENDINGS.contains(&&*ending(&path.display().to_string())) {
            files.push(path);
        }
    }
    Ok(())
}

fn ending(file: &str) -> String {
    super::lens_files::ending(file)
}

/// Opens a lens and computes its data, within a limit of work.
fn opened(path: &Path, reading: &Reading, work: WorkLimit) -> Result<SurveyedLens> {
    let budget = Budget::new(u64::MAX, work);
    let found = budget.during(|| {
        let mut sink = Sink::new();
        let lens = open_prescription(path, reading, &mut sink)?;
        let lens = Lens::new(lens).at_primary_wavelength();
        let warnings = sink
            .items()
            .iter()
            .filter(|d| d.severity == Severity::Warning);
        let warnings = warnings.map(|d| d.message.clone()).collect();
        let setting = SheetSetting::default();
        let edge = setting.conjugate(&lens).and_then(|conjugate| {
            let height = setting.full_height(&lens)?;
            let edge = lens.distortion(Meridian::Y, height, conjugate.film_z)?;
            Some((edge.angle, conjugate.distortion(&lens, height)))
        });
        let half_field = edge.map(|(angle, _)| angle.to_degrees());
        let distortion = edge.and_then(|(_, share)| Some(100.0 * share?));
        Ok(SurveyedLens {
            efl: lens.first_order().focal.map(|focal| focal.efl),
            f_number: lens.real_f_number(),
            half_field,
            distortion_percent: distortion.filter(|percent| percent.is_finite()),
            warnings,
            lens,
        })
    });
    match budget.cut() {
        Some(_) => {
            let message = format!("its data take more than {work} steps of work");
            Err(Diagnostic::beyond_limit(message))
        }
        None => found,
    }
}

/// A value of a CSV file.
fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    }
}

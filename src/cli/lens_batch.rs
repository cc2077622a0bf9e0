//! `ivcam lens LENS --batch` and `--tolerance`: figures of merit of many variations of a lens.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Sink, Source, Span};
use ivcam_base::files::{MAX_TEXT, read_file, read_stream};
use ivcam_base::work::Budget;
use ivcam_optics::lens::{
    Distribution, FieldPoint, Lens, Merit, MeritFilm, MeritSetting, Requirement, SheetSetting,
    Tolerance, Yield, yield_of,
};
use ivcam_optics::prescription::formats::read::read;
use ivcam_optics::prescription::{Change, Prescription, Quantity};
use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Map, Value};

use super::lens_request::{Content, LensRequest, no_image};
use super::{parsed, text};

/// The frequencies of the modulation without `--frequencies`, in line pairs per millimeter.
const FREQUENCIES: [f64; 2] = [10.0, 30.0];
/// The number of lenses of a tolerance analysis without `--trials`.
const TRIALS: usize = 1000;

/// The answer to a line.
#[derive(Serialize)]
struct BatchAnswer {
    #[serde(skip_serializing_if = "Value::is_null")]
    id: Value,
    #[serde(flatten)]
    merit: Option<Merit>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

/// Makes the figures of merit of the lenses of a file, one JSON object a line. A line has changes
/// of the lens, or a whole prescription. A line that is no lens has its error in place of the
/// figures.
pub(super) fn batch(request: &LensRequest<'_>, file: &str) -> Result<Content> {
    let setting = setting(request)?;
    let source = source(file)?;
    let lines: Vec<&str> = std::str::from_utf8(&source.bytes)
        .map_err(|_| Diagnostic::error(format!("`{file}` is not text")))?
        .lines()
        .filter(|line| !line.trim().is_empty())
        .collect();
    let base = BatchBase {
        lens: &request.lens,
        conditions: request.setting(),
        setting,
        states_wavelength: text(request.matches, "wavelength").is_some(),
    };
    let account = Budget::current();
    let answers: Vec<BatchAnswer> = lines
        .par_iter()
        .map(|line| account.during(|| answer(&base, line)))
        .collect();
    let mut text = String::new();
    for answer in &answers {
        let line = serde_json::to_string(answer)
            .map_err(|error| Diagnostic::error(format!("the figures can't be written: {error}")))?;
        text += &line;
        text.push('\n');
    }
    Ok(Content::Text(text))
}

fn source(file: &str) -> Result<Arc<Source>> {
    let bytes = match file {
        "-" => read_stream(std::io::stdin().lock(), "standard input", MAX_TEXT),
        _ => read_file(Path::new(file), MAX_TEXT),
    };
    Ok(Arc::new(Source::new(file, bytes?)))
}

/// The conditions: those of the data sheet, with the film at the best focus of each lens, or at the
/// distance of the focus.
fn setting(request: &LensRequest<'_>) -> Result<MeritSetting> {
    let conditions = request.setting();
    let lens = &request.lens;
    let (image_height, heights) = heights(&conditions, lens)?;
    let conjugate = conditions.conjugate(lens).ok_or_else(|| no_image(lens))?;
    let film = match text(request.matches, "film-at") {
        None | Some("best") => MeritFilm::Best,
        Some("paraxial") => MeritFilm::Paraxial,
        Some("fixed") => MeritFilm::At(conjugate.film_z),
        Some(word) => {
            let error = format!("`--film-at {word}` is not best, paraxial or fixed");
            return Err(Diagnostic::error(error));
        }
    };
    Ok(MeritSetting {
        distance: conjugate.distance,
        film,
        image_height,
        heights,
        frequencies: match conditions.frequencies.is_empty() {
            true => FREQUENCIES.to_vec(),
            false => conditions.frequencies,
        },
    })
}

/// Half of the film's diagonal, and the heights of the points of a lens on the film, in
/// millimeters.
fn heights(conditions: &SheetSetting<'_>, lens: &Lens) -> Result<(f64, Vec<f64>)> {
    let height = conditions.full_height(lens).ok_or_else(|| no_image(lens))?;
    let conjugate = conditions.conjugate(lens).ok_or_else(|| no_image(lens))?;
    let mut conditions = conditions.clone();
    // A field of 0 is one point.
    if conditions.fields.is_empty() && height > 0.0 {
        conditions.fields = [0.0, 0.7, 1.0].map(FieldPoint::Share).to_vec();
    }
    let heights = conditions.heights(lens, height, conjugate.film_z);
    Ok((height, heights))
}

/// What the lines of a batch are answered by.
struct BatchBase<'a> {
    /// The lens that lines change.
    lens: &'a Lens,
    conditions: SheetSetting<'a>,
    setting: MeritSetting,
    /// Whether an option states the wavelength of all lenses.
    states_wavelength: bool,
}

impl BatchBase<'_> {
    /// The figures of a changed lens, or of another one, which has its own wavelength and field.
    fn merit(&self, lens: Prescription, is_another: bool) -> Result<Merit> {
        let lens = match is_another && !self.states_wavelength {
            true => Lens::new(lens).at_primary_wavelength(),
            false => Lens::new(lens).at_wavelength(self.lens.wavelength()),
        };
        let mut setting = self.setting.clone();
        if is_another {
            let conditions = SheetSetting {
                unfocused: None,
                ..self.conditions.clone()
            };
            (setting.image_height, setting.heights) = heights(&conditions, &lens)?;
        }
        Merit::of(&lens, &setting).ok_or_else(|| no_image(&lens))
    }
}

/// The answer to a line.
fn answer(base: &BatchBase<'_>, line: &str) -> BatchAnswer {
    let mut id = Value::Null;
    let lens = varied(base.lens, line, &mut id);
    let merit = lens.and_then(|(lens, is_another)| base.merit(lens, is_another));
    let (merit, error) = match merit {
        Ok(merit) => (Some(merit), None),
        Err(error) => (None, Some(error.message.clone())),
    };
    BatchAnswer { id, merit, error }
}

/// The prescription of a line, and whether it is another lens than that of the command. The `id` is
/// returned beside them.
fn varied(base: &Lens, line: &str, id: &mut Value) -> Result<(Prescription, bool)> {
    let mut object: Map<String, Value> = serde_json::from_str(line)
        .map_err(|error| Diagnostic::error(format!("this is not a JSON object: {error}")))?;
    *id = object.remove("id").unwrap_or_default();
    if object.contains_key("surfaces") {
        if let Some((name, _)) = Quantity::ALL
            .iter()
            .find(|(name, _)| object.contains_key(*name))
        {
            let message = format!("`{name}` changes the lens, and `surfaces` is another lens");
            return Err(Diagnostic::error(message));
        }
        let source = Arc::new(Source::new("line", line.as_bytes().to_vec()));
        return Ok((read(&source, &mut Sink::new())?, true));
    }
    let mut changes = Vec::new();
    for (name, values) in &object {
        let quantity = quantity(name)?;
        let Some(values) = values.as_object() else {
            let message = format!("`{name}` is not an object of surface numbers and values");
            return Err(Diagnostic::error(message));
        };
        for (surface, value) in values {
            let numbers = surface.parse().ok().zip(value.as_f64());
            let Some((surface, value)) = numbers else {
                let message = format!("`{name}`: `{surface}` and {value} are not two numbers");
                return Err(Diagnostic::error(message));
            };
            changes.push(Change {
                surface,
                quantity,
                value,
            });
        }
    }
    refuse_two_bends(&changes)?;
    Ok((base.prescription().with_changes(&changes)?, false))
}

/// Refuses a radius and a curvature of one surface.
fn refuse_two_bends(changes: &[Change]) -> Result<()> {
    let of = |quantity| changes.iter().filter(move |c| c.quantity == quantity);
    let mut radii = of(Quantity::Radius);
    match radii.find(|radius| of(Quantity::Curvature).any(|c| c.surface == radius.surface)) {
        None => Ok(()),
        Some(Change { surface, .. }) => {
            let message = format!("surface {surface} has both `R` and `c`");
            Err(Diagnostic::error(message))
        }
    }
}

fn quantity(name: &str) -> Result<Quantity> {
    Quantity::named(name).ok_or_else(|| {
        let names: Vec<&str> = Quantity::ALL.iter().map(|(name, _)| *name).collect();
        let message = format!("there is no number `{name}` of a surface");
        Diagnostic::error(message).with_help(format!("the numbers are {}", names.join(", ")))
    })
}

/// Writes the yield of the lens within the tolerances of a table.
pub(super) fn tolerance(request: &LensRequest<'_>, file: &str) -> Result<Content> {
    let mut setting = setting(request)?;
    let source = source(file)?;
    let table = ToleranceTable::of(&source, request.lens.prescription(), &mut setting)?;
    let whole = |word: &str| word.parse().ok().filter(|n| (1..=10_000_000).contains(n));
    let trials = parsed(request.matches, "trials", "a number from 1 to 1e7", whole)?;
    let seed = parsed(request.matches, "seed", "a whole number", |w| {
        w.parse().ok()
    })?;
    let run = (trials.unwrap_or(TRIALS), seed.unwrap_or(0));
    let found = yield_of(
        &request.lens,
        &table.tolerances,
        &table.requirements,
        &setting,
        run,
    )?;
    Ok(Content::Text(report(&table, &found, &setting)))
}

/// The tolerances of a table, and what is required of a lens that is made within them.
struct ToleranceTable {
    tolerances: Vec<Tolerance>,
    /// The line of each tolerance, for the report.
    lines: Vec<String>,
    requirements: Vec<Requirement>,
    /// The words of each requirement, for the report.
    required: Vec<String>,
}

impl ToleranceTable {
    /// Reads a table. A line is `surface quantity tolerance [normal]`, where the tolerance may be a
    /// percentage of the value, or `require figure limit`.
    fn of(source: &Arc<Source>, lens: &Prescription, setting: &mut MeritSetting) -> Result<Self> {
        let text = String::from_utf8_lossy(&source.bytes);
        let mut table = Self {
            tolerances: Vec::new(),
            lines: Vec::new(),
            requirements: Vec::new(),
            required: Vec::new(),
        };
        let mut start = 0;
        for line in text.split_inclusive('\n') {
            let place = Span::new(start, start + line.trim_end().len());
            start += line.len();
            let plain = line.split('#').next().unwrap_or("").trim();
            let words: Vec<&str> = plain.split_whitespace().collect();
            let row = match &words[..] {
                [] => continue,
                ["require", rest @ ..] => requirement(rest, setting).map(|requirement| {
                    table.requirements.push(requirement);
                    table.required.push(rest.join(" "));
                }),
                _ => one_tolerance(&words, lens).and_then(|tolerance| {
                    table.refuse_second(&tolerance)?;
                    table.tolerances.push(tolerance);
                    table.lines.push(words.join(" "));
                    Ok(())
                }),
            };
            row.map_err(|error| error.at(source, place))?;
        }
        if table.tolerances.is_empty() || table.requirements.is_empty() {
            let message = "the table has no tolerance or no requirement";
            return Err(Diagnostic::error(message)
                .at(source, Span::at(0))
                .with_help("such as `0 R 0.1%`, `2 t 0.02 normal` and `require rms 0.01`"));
        }
        Ok(table)
    }

    /// Refuses a second tolerance of the same number. A radius and a curvature are one number.
    fn refuse_second(&self, tolerance: &Tolerance) -> Result<()> {
        let number = |t: &Tolerance| match t.quantity {
            Quantity::Curvature => (t.surface, Quantity::Radius),
            quantity => (t.surface, quantity),
        };
        let same = |known: &&Tolerance| number(known) == number(tolerance);
        match self.tolerances.iter().position(|known| same(&known)) {
            None => Ok(()),
            Some(first) => {
                let message = format!("`{}` is a tolerance of the same number", self.lines[first]);
                Err(Diagnostic::error(message).with_help("leave one of the two out"))
            }
        }
    }
}

/// The tolerance of a line.
fn one_tolerance(words: &[&str], lens: &Prescription) -> Result<Tolerance> {
    let [surface, name, amount, rest @ ..] = words else {
        return Err(Diagnostic::error(
            "a tolerance is: surface quantity tolerance",
        ));
    };
    let quantity = quantity(name)?;
    let number = |word: &str| {
        word.parse::<f64>()
            .ok()
            .filter(|v| *v >= 0.0 && v.is_finite())
    };
    let surface: usize = surface
        .parse()
        .map_err(|_| Diagnostic::error(format!("`{surface}` is not the number of a surface")))?;
    let value = lens.value_of(surface, quantity);
    if quantity == Quantity::Radius && value == Some(0.0) {
        let message = format!("surface {surface} is a plane, which has no radius");
        return Err(Diagnostic::error(message).with_help(format!(
            "give a tolerance of its curvature per millimeter: `{surface} c 1e-5`"
        )));
    }
    if amount.ends_with('%') && value == Some(0.0) {
        let message =
            format!("`{name}` of surface {surface} is 0, of which no share is a tolerance");
        return Err(Diagnostic::error(message).with_help("give the tolerance itself"));
    }
    let amount = match amount.strip_suffix('%') {
        Some(share) => number(share)
            .zip(value)
            .map(|(share, value)| 0.01 * share * value.abs()),
        None => number(amount),
    };
    let message = format!("`{}` is not a tolerance of the lens", words.join(" "));
    let distribution = match rest {
        [] | ["uniform"] => Distribution::Uniform,
        ["normal"] => Distribution::Normal,
        _ => return Err(Diagnostic::error(message).with_help("uniform or normal")),
    };
    let amount = amount.filter(|_| value.is_some());
    Ok(Tolerance {
        surface,
        quantity,
        amount: amount.ok_or_else(|| Diagnostic::error(message))?,
        distribution,
    })
}

/// The requirement of a line behind `require`. The frequency of a modulation is added to the
/// setting.
fn requirement(words: &[&str], setting: &mut MeritSetting) -> Result<Requirement> {
    let help = "rms MM, wavefront WAVES, distortion SHARE, illumination SHARE, efl LOW HIGH or \
                modulation@FREQUENCY SHARE";
    let fail = || {
        let message = format!("`require {}` is not read", words.join(" "));
        Diagnostic::error(message).with_help(help)
    };
    let [name, values @ ..] = words else {
        return Err(fail());
    };
    let values: Option<Vec<f64>> = values.iter().map(|word| word.parse().ok()).collect();
    match (*name, values.as_deref()) {
        ("rms", Some([most])) => Ok(Requirement::Rms(*most)),
        ("wavefront", Some([most])) => Ok(Requirement::Wavefront(*most)),
        ("distortion", Some([most])) => Ok(Requirement::Distortion(*most)),
        ("illumination", Some([least])) => Ok(Requirement::Illumination(*least)),
        ("efl", Some([low, high])) if low > high => {
            let message = format!("no focal length is from {low} to {high} mm");
            Err(Diagnostic::error(message).with_help("`require efl` has the lower limit first"))
        }
        ("efl", Some([low, high])) => Ok(Requirement::FocalLength(*low, *high)),
        (name, Some([least])) => {
            let frequency = name.strip_prefix("modulation@");
            let frequency: f64 = frequency.and_then(|f| f.parse().ok()).ok_or_else(fail)?;
            let known = setting.frequencies.iter().position(|f| *f == frequency);
            let number = known.unwrap_or_else(|| {
                setting.frequencies.push(frequency);
                setting.frequencies.len() - 1
            });
            Ok(Requirement::Modulation(number, *least))
        }
        _ => Err(fail()),
    }
}

/// Writes a line for each point without light, and for each requirement its figure: that of the
/// nominal lens with its point, the median, and what 90% of the lenses meet.
fn requirement_lines(table: &ToleranceTable, found: &Yield, setting: &MeritSetting) -> String {
    let mut text = String::new();
    let points = setting.heights.iter().zip(&found.nominal.points);
    for (height, _) in points.filter(|(_, point)| point.is_none()) {
        let _ = writeln!(
            text,
            "the point at {height:.2} mm has no light: give points with `--fields`, or state the \
             field of the lens"
        );
    }
    for (i, requirement) in table.requirements.iter().enumerate() {
        let name = &table.required[i];
        let nominal = match requirement.worst(&found.nominal) {
            None => {
                let _ = writeln!(text, "{name}: not met where there is no light");
                continue;
            }
            Some((value, None)) => format!("{value:.5}"),
            Some((value, Some(point))) => {
                format!("{value:.5} at {:.2} mm", setting.heights[point])
            }
        };
        let figure = |share: f64| match found.quantile(i, share) {
            value if !value.is_finite() => "no light".to_owned(),
            value => format!("{value:.5}"),
        };
        let median = figure(0.5);
        let most = match requirement {
            Requirement::FocalLength(..) => format!("{} to {}", figure(0.05), figure(0.95)),
            _ if requirement.is_least() => format!("{} or more", figure(0.1)),
            _ => format!("{} or less", figure(0.9)),
        };
        let met = if requirement.is_met(&found.nominal) {
            ""
        } else {
            ", not met"
        };
        let _ = writeln!(
            text,
            "{name}: nominal {nominal}{met}; median {median}; 90% of lenses {most}"
        );
    }
    text
}

fn report(table: &ToleranceTable, found: &Yield, setting: &MeritSetting) -> String {
    let mut text = String::new();
    let [low, high] = found.interval().map(|share| 100.0 * share);
    let _ = writeln!(
        text,
        "yield {:.1}% ({low:.1}% to {high:.1}%): {} of {} lenses meet all requirements",
        100.0 * found.share(),
        found.passed,
        found.trials
    );
    let met = table.requirements.iter().all(|r| r.is_met(&found.nominal));
    if !met {
        text += "the nominal lens does not meet them\n";
    }
    text += &requirement_lines(table, found, setting);
    let microns = |mm: f64| format!("{:.2}", 1e3 * mm);
    if let Some(nominal) = found.nominal.worst_rms() {
        let _ = writeln!(
            text,
            "largest rms spot in µm: nominal {}, median {}, 90% of lenses {}, 98% {}",
            microns(nominal),
            microns(found.rms_quantile(0.5)),
            microns(found.rms_quantile(0.9)),
            microns(found.rms_quantile(0.98))
        );
    }
    let failed = found.trials - found.passed;
    if failed > 0 {
        text += "lenses that fail with a number in the outer half of its tolerance:\n";
        let mut rows: Vec<(&String, usize)> = table
            .lines
            .iter()
            .zip(found.outer.iter().copied())
            .collect();
        rows.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        for (line, count) in rows {
            let share = 100.0 * count as f64 / failed as f64;
            let _ = writeln!(text, "  {share:5.1}%  {line}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use crate::cli::lens_output;

    fn run(words: &[&str], file: &str) -> String {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("ivcam-batch-{}-{count}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, file).unwrap();
        let mut words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        words.insert(2, path.display().to_string());
        let output = lens_output(&words);
        std::fs::remove_file(path).unwrap();
        output.unwrap().text
    }

    #[test]
    fn a_line_of_a_batch_is_answered_by_a_line() {
        let file = "{\"id\": 7}\n{\"R\": {\"0\": 60}, \"t\": {\"0\": 8.5}}\n{\"x\": {}}\n[1]\n\
            {\"n_d\": {\"99\": 1.5}}\n{\"n_d\": {\"0\": 0.5}}\n";
        let text = run(&["double-gauss", "--batch"], file);
        let answers: Vec<serde_json::Value> = text
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        assert_eq!(answers.len(), 6);
        assert_eq!(answers[0]["id"], 7);
        let efl = |i: usize| answers[i]["efl"].as_f64().unwrap();
        assert!((efl(0) - 100.7).abs() < 1.0 && (efl(1) - efl(0)).abs() > 0.1);
        assert_eq!(answers[0]["points"].as_array().unwrap().len(), 3);
        for (i, says) in [
            (2, "no number `x`"),
            (3, "not a JSON object"),
            (4, "no surface 99"),
            (5, "not possible for `n_d`"),
        ] {
            let error = answers[i]["error"].as_str().unwrap();
            assert!(error.contains(says), "{error}");
            assert!(answers[i]["efl"].is_null());
        }
    }

    /// A plano-convex lens of germanium at 10 µm with a field of its own, beside one in the
    /// visible: the focal length is 200/(n − 1) by the Sellmeier formula.
    #[test]
    fn a_whole_prescription_of_a_batch_has_its_own_wavelength_and_field() {
        let line = r#"{"schema": "ivlens-1", "h_max": 2.5, "wavelengths_nm": [10000.0], "surfaces": [{"stop": true, "R": 200.0, "t": 5.0, "glass": "GERMANIUM", "semi_diameter": 5.0}, {"R": 0, "t": 60.0, "n_d": 1.0, "semi_diameter": 8.0}]}"#;
        let figures = |words: &[&str]| {
            let text = run(words, line);
            serde_json::from_str::<serde_json::Value>(&text).unwrap()
        };
        // Heights are those of the points in the image.
        let are_near = |found: &[f64], known: [f64; 3]| {
            found.len() == 3 && found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-9)
        };
        let found = figures(&["tessar", "--batch"]);
        let efl = found["efl"].as_f64().unwrap();
        assert!((efl - 200.0 / 3.004_003).abs() < 1e-4, "{efl}");
        let heights = |found: &serde_json::Value| -> Vec<f64> {
            let points = found["points"].as_array().unwrap().iter();
            points.map(|p| p["height"].as_f64().unwrap()).collect()
        };
        assert!(are_near(&heights(&found), [0.0, 1.75, 2.5]), "{found}");
        let found = figures(&["tessar", "--batch", "--wavelength", "4000", "--film", "4"]);
        let efl = found["efl"].as_f64().unwrap();
        assert!((efl - 200.0 / 3.024_72).abs() < 1e-3, "{efl}");
        assert!(are_near(&heights(&found), [0.0, 1.4, 2.0]), "{found}");
    }

    #[test]
    fn a_report_has_a_line_for_each_requirement_and_names_points_without_light() {
        let table = "0 R 0.01%\nrequire rms 1\nrequire modulation@10 0.99999\nrequire efl 90 110\n";
        let run = |fields: &str| {
            let words = [
                "double-gauss",
                "--tolerance",
                "--trials",
                "20",
                "--fields",
                fields,
            ];
            run(&words, table)
        };
        let text = run("0,20");
        let line = |name: &str| text.lines().find(|line| line.starts_with(name)).unwrap();
        let rms = line("rms 1: nominal ");
        assert!(
            rms.contains(" at 20.00 mm; median ") && rms.ends_with(" or less"),
            "{rms}"
        );
        let modulation = line("modulation@10 0.99999: nominal ");
        assert!(modulation.contains(", not met; ") && modulation.ends_with(" or more"));
        assert!(
            line("efl 90 110: nominal 100.").contains("90% of lenses 100."),
            "{text}"
        );
        let dark = run("0,500");
        assert!(
            dark.contains("the point at 500.00 mm has no light: give points"),
            "{dark}"
        );
        assert!(
            dark.contains("\nrms 1: not met where there is no light\n"),
            "{dark}"
        );
        assert!(!dark.contains("inf"), "{dark}");
    }

    #[test]
    fn a_wider_tolerance_has_a_smaller_yield() {
        let yield_of = |tolerance: &str| {
            let table =
                format!("0 R {tolerance}\n3 t {tolerance} normal # a gap\nrequire efl 100 101.4\n");
            let text = run(&["double-gauss", "--tolerance", "--trials", "200"], &table);
            let share = text
                .strip_prefix("yield ")
                .unwrap()
                .split('%')
                .next()
                .unwrap();
            share.parse::<f64>().unwrap()
        };
        let [tight, wide] = ["0.001%", "8%"].map(yield_of);
        assert!(tight == 100.0 && wide < 80.0, "{tight} {wide}");
    }

    #[test]
    fn a_line_of_a_batch_that_contradicts_itself_has_an_error() {
        let file = "{\"R\": {\"0\": 20}, \"surfaces\": []}\n{\"c\": {\"0\": 0.02}, \"R\": {\"0\": 30}}\n\
            {\"c\": {\"0\": 0.02}, \"R\": {\"1\": 30}}\n";
        let text = run(&["double-gauss", "--batch"], file);
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines[0].contains("`R` changes the lens, and `surfaces` is another"),
            "{text}"
        );
        assert!(
            lines[1].contains("surface 0 has both `R` and `c`"),
            "{text}"
        );
        assert!(lines[2].contains("\"efl\""), "{text}");
    }

    #[test]
    fn a_table_that_makes_no_sense_is_refused() {
        let lens = std::env::temp_dir().join(format!("ivcam-plane-{}.dat", std::process::id()));
        std::fs::write(&lens, "25 3 1.5 6\n0 48 1 6\n").unwrap();
        let lens_name = lens.display().to_string();
        let table = std::env::temp_dir().join(format!("ivcam-table-{}.txt", std::process::id()));
        let error = |text: &str| {
            std::fs::write(&table, text).unwrap();
            let words = [&*lens_name, "--tolerance", &table.display().to_string()];
            let words = words.map(str::to_owned);
            lens_output(&words).unwrap_err().message.clone()
        };
        let require = "require efl 49 51\n";
        for (text, says) in [
            (
                format!("1 R 0.1\n{require}"),
                "surface 1 is a plane, which has no radius",
            ),
            (
                format!("1 R 1%\n{require}"),
                "surface 1 is a plane, which has no radius",
            ),
            (format!("1 c 1%\n{require}"), "`c` of surface 1 is 0"),
            (
                format!("0 R 0.1\n0 R 0.2\n{require}"),
                "`0 R 0.1` is a tolerance of the same number",
            ),
            (
                format!("0 R 0.1\n0 c 0.1\n{require}"),
                "`0 R 0.1` is a tolerance of the same number",
            ),
            (
                "0 R 0.1\nrequire efl 51 49\n".to_owned(),
                "no focal length is from 51 to 49 mm",
            ),
        ] {
            let found = error(&text);
            assert!(found.contains(says), "{text}: {found}");
        }
        std::fs::remove_file(lens).unwrap();
        std::fs::remove_file(table).unwrap();
    }
}

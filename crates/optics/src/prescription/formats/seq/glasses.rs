//! Reads glasses by name, by code, and from private tables.

use ivcam_base::diag::Result;

use crate::prescription::formats::commands::Command;
use crate::prescription::formats::index_table;
use crate::prescription::formats::reader::PrescriptionReader;
use crate::prescription::formats::reading::Reading;
use crate::prescription::glass::medium::{Formula, Medium, named_line};
use crate::prescription::text::Word;

/// Removes the commands from PRV to END, and returns them.
pub(super) fn take_private(commands: Vec<Command<'_>>) -> (Vec<Command<'_>>, Vec<Command<'_>>) {
    let (mut rest, mut private) = (Vec::new(), Vec::new());
    let mut inside = false;
    for command in commands {
        inside |= command[0].is("PRV");
        let ends = command[0].is("END");
        if inside {
            private.push(command)
        } else {
            rest.push(command)
        }
        inside &= !ends;
    }
    (rest, private)
}

/// The options of reading with the private glasses of the file: tables of index over wavelength, in
/// nanometers.
pub(super) fn with_private(
    file: PrescriptionReader<'_>,
    commands: &[Command<'_>],
) -> Result<Reading> {
    let mut options = file.options.clone();
    let mut wavelengths = Vec::new();
    for command in commands {
        let (name, words) = (command[0], &command[1..]);
        if name.is("PWL") {
            wavelengths = file.numbers(words)?;
        } else if let [kind, coefficients @ ..] = words
            && kind.is("LAU")
        {
            options.glasses.add([laurent(file, name, coefficients)?]);
        } else if !name.is("PRV") && !name.is("END") && !words.is_empty() {
            // 587.6 is the d line, so that a table of three lines reaches them all.
            let lines = wavelengths.iter().map(|nm| named_line(*nm));
            let table: Vec<(f64, f64)> = lines.zip(file.numbers(words)?).collect();
            let Some(glass) = index_table::medium(&table) else {
                let message = format!("the glass `{}` has no index at a wavelength", name.text);
                let help = "`PWL` lists the wavelengths, in nanometers";
                return Err(file.refuse(name.span, message, help));
            };
            options.glasses.add([glass.named(name.text)]);
        }
    }
    Ok(options)
}

/// A private glass by a Laurent series, which is Schott's older formula.
fn laurent(
    file: PrescriptionReader<'_>,
    name: Word<'_>,
    coefficients: &[Word<'_>],
) -> Result<Medium> {
    let listed = file.numbers(coefficients)?;
    let k = std::array::from_fn(|i| listed.get(i).copied().unwrap_or(0.0));
    let glass = Medium::from_formula(Formula::Schott, k).filter(|_| listed.len() <= 6);
    let Some(glass) = glass else {
        let message = format!("the glass `{}` has no index", name.text);
        let help = "`LAU` has the coefficients of n\u{b2} at the powers 0, 2, -2, -4, -6 and -8";
        return Err(file.refuse(name.span, message, help));
    };
    Ok(glass.named(name.text))
}

/// The medium that a word names; air without a word. `surface` is the number of the surface in
/// front of it, from 1.
pub(super) fn glass(
    file: PrescriptionReader<'_>,
    word: Option<&Word<'_>>,
    surface: usize,
) -> Result<Medium> {
    let Some(word) = word.filter(|word| !word.is("AIR")) else {
        return Ok(Medium::air());
    };
    if word.is("REFR_REFL") {
        return Err(file.mirror(word.span, format!("surface {surface}")));
    }
    match fictitious(word.text) {
        Some(glass) => Ok(glass),
        None => file.glass(word.text, word.span),
    }
}

/// `517642` is n = 1.517, V = 64.2; `500.700` the same with a dot: n = 1.500, V = 70.0; and
/// `1.5168:64.17` gives both in full.
fn fictitious(word: &str) -> Option<Medium> {
    if let Some((index, abbe)) = word.split_once(':') {
        let (n, v) = (index.parse::<f64>().ok()?, abbe.parse::<f64>().ok()?);
        let possible = (1.0..5.0).contains(&n) && (1.0..1000.0).contains(&v);
        return possible.then(|| Medium::from_abbe(n, v));
    }
    let (index, abbe) = match word.split_once('.') {
        Some(parts) => parts,
        None if word.len() == 6 => word.split_at(3),
        None => return None,
    };
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    if !digits(index) || !digits(abbe) || abbe.len() < 2 {
        return None;
    }
    let n = 1.0 + format!("0.{index}").parse::<f64>().ok()?;
    let (whole, rest) = abbe.split_at(2);
    let v = format!("{whole}.{rest}").parse::<f64>().ok()?;
    Some(Medium::from_index(n, Some(v)))
}

//! Reads glass catalogues in Zemax's format: an `NM` line has the name and the formula of a glass,
//! a `CD` line the coefficients, an `LD` line the range of wavelengths. Prices, transmission and
//! thermal data are skipped.

use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Source};

use crate::prescription::glass::medium::{Formula, Medium};
use crate::prescription::text::{Word, decoded, lines, text, words};

/// All glasses of a catalogue, in its order.
pub fn read(source: &Arc<Source>) -> Result<Vec<Medium>> {
    let source = &decoded(source);
    let mut glasses = Vec::new();
    let mut open: Option<(Word<'_>, Formula)> = None;
    for (start, line) in lines(text(source)) {
        let words = words(line, start);
        match words.first().map(|w| w.text) {
            Some("NM") => open = Some(heading(source, &words)?),
            Some("CD") => {
                if let Some((name, formula)) = open.take() {
                    glasses.push(glass(source, name, formula, &words[1..])?);
                }
            }
            Some("LD") => {
                // A range of zeros is not known. That of a glass without coefficients is skipped.
                if let (Some(glass), None, Some(range)) = (glasses.last_mut(), &open, range(&words))
                {
                    glass.measured_nm = Some(range);
                }
            }
            _ => {}
        }
    }
    if glasses.is_empty() {
        return Err(Diagnostic::error(
            "this is not a glass catalogue: it has no `NM` and `CD` lines",
        )
        .in_file(source.name.clone())
        .with_help("glass catalogues in Zemax's `.agf` format are read"));
    }
    Ok(glasses)
}

/// Returns the range of wavelengths in nanometers of an `LD` line, which has micrometers.
fn range(words: &[Word<'_>]) -> Option<[f64; 2]> {
    let number = |i: usize| words.get(i)?.text.parse::<f64>().ok();
    let (low, high) = (number(1)?, number(2)?);
    (0.0 < low && low < high && high.is_finite()).then_some([1e3 * low, 1e3 * high])
}

fn heading<'a>(source: &Arc<Source>, words: &[Word<'a>]) -> Result<(Word<'a>, Formula)> {
    let [_, name, number, ..] = words else {
        let span = words[0].span;
        return Err(Diagnostic::error("a glass without a name and a formula").at(source, span));
    };
    let formula = number.number(source)?;
    let formula = (1.0..=13.0).contains(&formula).then_some(formula as u32);
    match formula.and_then(Formula::from_number) {
        Some(formula) => Ok((*name, formula)),
        None => {
            let message = format!(
                "`{}` is not the number of a dispersion formula",
                number.text
            );
            Err(Diagnostic::error(message)
                .at(source, number.span)
                .with_help("formulas are numbered from 1 (Schott) to 13 (Extended 3)"))
        }
    }
}

fn glass(
    source: &Arc<Source>,
    name: Word<'_>,
    formula: Formula,
    words: &[Word<'_>],
) -> Result<Medium> {
    let mut k = [0.0; 10];
    for (slot, word) in k.iter_mut().zip(words) {
        *slot = word.number(source)?;
    }
    // A glass whose formula has no index anywhere is refused where a lens uses it.
    let medium = Medium::from_formula(formula, k).unwrap_or_else(|| Medium::constant(f64::NAN));
    Ok(medium.named(name.text))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Vec<Medium>> {
        read(&Arc::new(Source::new("a.agf", text.as_bytes().to_vec())))
    }

    /// The old data sheet of BK7 had Schott's formula with these, and 1.51680 at the d line.
    #[test]
    fn glasses_are_read_with_their_formulas() {
        let text = "CC a catalogue\nNM CROWN 1 517642.251 1.5168 64.17 0 1\nGC a comment\nCD \
                    2.2718929 -1.0108077e-2 1.0592509e-2 2.0816965e-4 -7.6472538e-6 \
                    4.9240991e-7 0 0\n\
                    NM OTHER 2.0 517642 1.5168 64.17\nCD 1.03961212 0.00600069867 0.231792344 \
                    0.0200179144 1.01046945 103.560653\nLD 0.3 2.5\n";
        let glasses = parse(text).unwrap();
        assert_eq!(glasses.len(), 2);
        assert_eq!(glasses[1].name, "OTHER");
        for glass in &glasses {
            assert!((glass.n_d - 1.5168).abs() < 1e-5, "{}", glass.n_d);
        }
    }

    #[test]
    fn a_wrong_line_is_named() {
        let place = |error: Box<Diagnostic>| error.location().1;
        assert_eq!(place(parse("NM A 99\n").unwrap_err()), Some((1, 6)));
        assert_eq!(place(parse("NM A 2\nCD 1 x\n").unwrap_err()), Some((2, 6)));
        assert_eq!(place(parse("NM A\n").unwrap_err()), Some((1, 1)));
        assert!(
            parse("hello")
                .unwrap_err()
                .message
                .contains("not a glass catalogue")
        );
    }

    #[test]
    fn the_index_of_a_glass_is_doubted_beyond_the_wavelengths_of_its_catalogue() {
        let text = "NM A 2 0 1.5168 64.17\nCD 1.03961212 0.00600069867 0.231792344 \
                    0.0200179144 1.01046945 103.560653\nLD 0.4 0.7\n";
        let glass = &parse(text).unwrap()[0];
        assert_eq!(glass.doubt_at(600.0), None);
        let doubt = glass.doubt_at(1500.0).unwrap();
        assert!(doubt.contains("those at 400 to 700 nm"), "{doubt}");
        for unknown in ["LD 0 0", "LD 2.5 0.3", "LD - -", "NM B 2\nLD 0.9 1.1"] {
            let glass = &parse(&text.replace("LD 0.4 0.7", unknown)).unwrap()[0];
            assert_eq!(glass.measured_nm, None, "{unknown}");
        }
    }
}

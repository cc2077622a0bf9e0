//! Reads glasses by name, by code, and from private tables.

use ivcam_base::diag::Result;

use crate::prescription::formats::index_table::interpolated;
use crate::prescription::formats::seq::commands::Command;
use crate::prescription::formats::seq::reader::Reader;
use crate::prescription::glass::medium::{C_LINE, D_LINE, F_LINE, Medium, named_line};
use crate::prescription::text::Word;

impl Reader<'_> {
    /// Tables of index over wavelength, in nanometers: what is between is interpolated.
    pub(super) fn private_glasses(&mut self, commands: &[Command<'_>]) -> Result<()> {
        let mut wavelengths = Vec::new();
        for command in commands {
            let numbers = || -> Result<Vec<f64>> {
                command[1..].iter().map(|w| w.number(self.source)).collect()
            };
            if command[0].is("PWL") {
                wavelengths = numbers()?;
            } else if !command[0].is("PRV") && !command[0].is("END") && command.len() > 1 {
                // 587.6 is the d line, so that a table of three lines reaches them all.
                let lines = wavelengths.iter().map(|nm| named_line(*nm));
                let table: Vec<(f64, f64)> = lines.zip(numbers()?).collect();
                let at = |nm| interpolated(&table, nm);
                let glass = match (at(F_LINE), at(D_LINE), at(C_LINE), &table[..]) {
                    (Some(f), Some(d), Some(c), _) => Medium::from_lines(f, d, c),
                    (_, Some(d), ..) => Medium::constant(d),
                    (.., [(_, n)]) => Medium::constant(*n),
                    _ => {
                        let message = format!(
                            "the glass `{}` has no index at the d line (587.56 nm)",
                            command[0].text
                        );
                        return Err(self
                            .fail(command[0].span, message)
                            .with_help("`PWL` lists the wavelengths, in nanometers"));
                    }
                };
                self.glasses.add([glass.named(command[0].text)]);
            }
        }
        Ok(())
    }

    /// The medium that a word names; air without a word.
    pub(super) fn glass(&self, word: Option<&Word<'_>>) -> Result<Medium> {
        let Some(word) = word else {
            return Ok(Medium::air());
        };
        if word.is("AIR") {
            return Ok(Medium::air());
        }
        if word.is("REFL") || word.is("REFR_REFL") {
            return Err(self.mirror(word.span, self.surfaces.len() + 1));
        }
        match fictitious(word.text) {
            Some(glass) => Ok(glass),
            None => self.glasses.get(word.text, self.source, word.span),
        }
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
    Some(if v > 0.0 {
        Medium::from_abbe(n, v)
    } else {
        Medium::constant(n)
    })
}

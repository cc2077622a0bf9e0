//! Reads configurations as zoom positions.

use ivcam_base::diag::{Result, Sink};

use crate::prescription::formats::zmx::reader::{Kept, ZemaxReader};
use crate::prescription::prescription::ZoomPosition;
use crate::prescription::text::{Word, Words};

/// Operands that change nothing: none, the title, a comment and the weight of a configuration.
const IDLE_OPERANDS: [&str; 4] = ["MOFF", "LTTL", "MCOM", "CWGT"];

/// The changes by the configurations of a file.
struct Changes {
    /// Surface of the file, configuration, thickness.
    thicknesses: Vec<(usize, usize, f64)>,
    /// The semi-diameter of the stop, by configuration.
    stops: Vec<Option<f64>>,
}

impl Changes {
    fn thickness(&self, number: usize, configuration: usize) -> Option<f64> {
        let mut latest = self.thicknesses.iter().rev();
        latest
            .find(|(n, c, _)| (*n, *c) == (number, configuration))
            .map(|(.., t)| *t)
    }

    fn position(&self, configuration: usize, kept: &[Kept]) -> ZoomPosition {
        let varies = |gap: &(usize, f64)| self.thicknesses.iter().any(|(n, ..)| *n == gap.0);
        let gaps = kept.iter().enumerate().filter_map(|(i, surface)| {
            let gap = |&(n, base): &(usize, f64)| self.thickness(n, configuration).unwrap_or(base);
            let any = surface.gaps.iter().any(varies);
            any.then(|| (i, surface.gaps.iter().map(gap).sum()))
        });
        ZoomPosition {
            name: format!("configuration {}", configuration + 1),
            gaps: gaps.collect(),
            stop_semi_diameter: self.stops[configuration],
        }
    }
}

impl ZemaxReader<'_> {
    /// Reads the configurations of `MNUM`, which are zoom positions.
    pub(super) fn zoom(
        &self,
        kept: &[Kept],
        stop: Option<usize>,
        sink: &mut Sink,
    ) -> Result<Vec<ZoomPosition>> {
        let Some(at) = self.header.iter().position(|l| l[0].is("MNUM")) else {
            return Ok(Vec::new());
        };
        let count = self.header[at].get(1);
        let count = count
            .and_then(|word| word.text.parse().ok())
            .unwrap_or(1_usize);
        if !(2..=1000).contains(&count) {
            return Ok(Vec::new());
        }
        let stop = stop.map(|s| kept[s].number);
        let changes = self.changes(&self.header[at + 1..], stop, count, sink)?;
        Ok((0..count).map(|c| changes.position(c, kept)).collect())
    }

    /// Reads the lines behind `MNUM`. `stop` is the number of the stop in the file.
    fn changes(
        &self,
        lines: &[Words<'_>],
        stop: Option<usize>,
        count: usize,
        sink: &mut Sink,
    ) -> Result<Changes> {
        let mut changes = Changes {
            thicknesses: Vec::new(),
            stops: vec![None; count],
        };
        let mut left_out: Vec<&str> = Vec::new();
        for line in lines {
            let [operand, surface, configuration, value, ..] = line[..] else {
                continue;
            };
            let number = surface.text.parse::<usize>().ok();
            let of_stop = operand.is("SDIA") && stop == number;
            let is_gap = operand.is("THIC");
            if !is_gap && !of_stop {
                let is_idle = IDLE_OPERANDS.iter().any(|name| operand.is(name));
                // Other lines of the file have no number of a configuration there.
                let changes = operand.text.len() == 4
                    && number.is_some()
                    && self.configuration(configuration, count).is_ok();
                if changes && !is_idle && !left_out.iter().any(|name| operand.is(name)) {
                    let what = format!("configurations that change `{}`", operand.text);
                    sink.warn(operand.span, format!("{what} are read without it"))
                        .help("save each configuration as a file of its own");
                    left_out.push(operand.text);
                }
                continue;
            }
            let Some(number) = number.filter(|n| self.blocks.iter().any(|b| b.number == *n)) else {
                let message = format!("there is no surface `{}` in the file", surface.text);
                return Err(self.file.fail(surface.span, message));
            };
            let configuration = self.configuration(configuration, count)?;
            let value = self.file.number(value)?;
            match is_gap {
                true => changes.thicknesses.push((number, configuration, value)),
                false => changes.stops[configuration] = Some(value),
            }
        }
        Ok(changes)
    }

    /// The configuration that a word names, from 0. The file counts them from 1.
    fn configuration(&self, word: Word<'_>, count: usize) -> Result<usize> {
        match word.text.parse::<usize>() {
            Ok(configuration) if (1..=count).contains(&configuration) => Ok(configuration - 1),
            _ => {
                let message = format!("there is no configuration `{}`", word.text);
                let help = format!("`MNUM` says that there are {count}");
                Err(self.file.refuse(word.span, message, help))
            }
        }
    }
}

//! Reads configurations as zoom positions.

use ivcam_base::diag::{Result, Sink};

use crate::prescription::formats::zmx::file::{Block, Line};
use crate::prescription::formats::zmx::reader::{Kept, Reader};
use crate::prescription::prescription::ZoomPosition;

/// Configurations that change a lens in a way that is not read.
const OTHER_OPERANDS: [&str; 14] = [
    "CRVT", "CONN", "GLSS", "MIND", "MABB", "STPS", "APER", "SDIA", "PAR1", "PAR2", "PAR3", "PAR4",
    "PRAM", "EDVA",
];

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

impl Reader<'_> {
    /// Reads the configurations of `MNUM`, which are zoom positions.
    pub(super) fn zoom(
        &self,
        header: &[Line<'_>],
        blocks: &[Block<'_>],
        kept: &[Kept],
        stop: Option<usize>,
        sink: &mut Sink,
    ) -> Result<Vec<ZoomPosition>> {
        let Some(at) = header.iter().position(|l| l[0].is("MNUM")) else {
            return Ok(Vec::new());
        };
        let count = header[at]
            .get(1)
            .and_then(|w| w.text.parse().ok())
            .unwrap_or(1_usize);
        if !(2..=1000).contains(&count) {
            return Ok(Vec::new());
        }
        let stop = stop.map(|s| kept[s].number);
        let changes = self.changes(&header[at + 1..], blocks, stop, count, sink)?;
        Ok((0..count).map(|c| changes.position(c, kept)).collect())
    }

    /// Reads the lines behind `MNUM`. `stop` is the number of the stop in the file.
    fn changes(
        &self,
        lines: &[Line<'_>],
        blocks: &[Block<'_>],
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
                let warned = left_out.iter().any(|name| operand.is(name));
                if !warned && OTHER_OPERANDS.iter().any(|name| operand.is(name)) {
                    let message = format!(
                        "configurations that change `{}` are read without it",
                        operand.text
                    );
                    sink.warn(operand.span, message);
                    left_out.push(operand.text);
                }
                continue;
            }
            let Some(number) = number.filter(|n| blocks.iter().any(|b| b.number == *n)) else {
                let message = format!("there is no surface `{}` in the file", surface.text);
                return Err(self.fail(surface.span, message));
            };
            let configuration = match configuration.text.parse::<usize>() {
                Ok(c) if (1..=count).contains(&c) => c - 1,
                _ => {
                    let message = format!("there is no configuration `{}`", configuration.text);
                    return Err(self
                        .fail(configuration.span, message)
                        .with_help(format!("`MNUM` says that there are {count}")));
                }
            };
            let value = value.number(self.source)?;
            match is_gap {
                true => changes.thicknesses.push((number, configuration, value)),
                false => changes.stops[configuration] = Some(value),
            }
        }
        Ok(changes)
    }
}

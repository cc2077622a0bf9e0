//! Zoom positions.

use ivcam_base::diag::{Result, Sink};

use crate::prescription::formats::seq::reader::SequenceReader;
use crate::prescription::prescription::ZoomPosition;
use crate::prescription::text::Word;

/// What may change by the zoom position without an effect on the lens: the title, and the weights
/// of positions, fields and wavelengths.
const IDLE: [&str; 5] = ["TIT", "TITLE", "WTZ", "WTF", "WTW"];

impl<'a> SequenceReader<'a> {
    /// `ZOO n`, then `ZOO THI S5 v1 v2 …`; here without the `ZOO`.
    pub(super) fn zoom(&mut self, command: &[Word<'a>], sink: &mut Sink) -> Result<()> {
        let count = command.first().and_then(|w| w.text.parse::<usize>().ok());
        if let Some(count) = count {
            self.draft.lens.zoom = (1..=count.min(1000))
                .map(|i| ZoomPosition {
                    name: format!("position {i}"),
                    ..Default::default()
                })
                .collect();
            return Ok(());
        }
        let [what, surface, values @ ..] = command else {
            return Ok(());
        };
        let is_gap = what.is("THI");
        let surfaces = match is_gap || what.is("CIR") {
            true => self.named_surfaces(*surface)?,
            false => None,
        };
        for &surface in surfaces.iter().flatten() {
            let of_stop = what.is("CIR") && self.draft.lens.surfaces[surface].is_stop;
            if !is_gap && !of_stop {
                continue;
            }
            for (position, value) in self.draft.lens.zoom.iter_mut().zip(values) {
                let value = self.file.number(*value)?;
                match is_gap {
                    true => position.gaps.push((surface, value)),
                    false => position.stop_semi_diameter = Some(value),
                }
            }
            return Ok(());
        }
        let is_idle = IDLE.iter().any(|name| what.is(name));
        if !is_gap && !is_idle && !self.left_out.iter().any(|name| what.is(name)) {
            let message = format!(
                "zoom positions that change `{}` are read without it",
                what.text
            );
            sink.warn(what.span, message)
                .help("save each position as a file of its own");
            self.left_out.push(what.text);
        }
        Ok(())
    }
}

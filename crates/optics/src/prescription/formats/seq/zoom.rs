//! Zoom positions.

use ivcam_base::diag::{Result, Sink};

use crate::prescription::formats::seq::reader::SequenceReader;
use crate::prescription::prescription::ZoomPosition;
use crate::prescription::text::Word;

impl SequenceReader<'_> {
    /// `ZOO n`, then `ZOO THI S5 v1 v2 …`; here without the `ZOO`.
    pub(super) fn zoom(&mut self, command: &[Word<'_>], sink: &mut Sink) -> Result<()> {
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
        let changes = ["THI", "CIR", "RDY", "CUY", "GLA", "K", "STO", "EPD", "FNO"];
        if !changes.iter().any(|name| what.is(name)) {
            return Ok(());
        }
        let surfaces = self.named_surfaces(*surface)?;
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
        if !is_gap {
            let message = format!(
                "zoom positions that change `{}` are read without it",
                what.text
            );
            sink.warn(what.span, message);
        }
        Ok(())
    }
}

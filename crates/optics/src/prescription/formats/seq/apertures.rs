//! Clear apertures that are not round, or not on the axis.

use glam::DVec2;
use ivcam_base::diag::{Result, Sink, Span};

use crate::prescription::clear_aperture::ClearAperture;
use crate::prescription::formats::seq::reader::SequenceReader;
use crate::prescription::text::Word;

/// The commands about the clear aperture of a surface, apart from `CIR`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StatedAperture {
    /// `REX` and `REY`: half of the widths of a rectangle.
    rectangle: [Option<f64>; 2],
    /// `ELX` and `ELY`: half of the widths of an ellipse.
    ellipse: [Option<f64>; 2],
    /// `ADX` and `ADY`, which move the aperture.
    center: DVec2,
    /// `ARO`, which turns it, in degrees.
    angle: f64,
    span: Span,
}

impl SequenceReader<'_> {
    /// Keeps a command about the clear aperture of a surface.
    pub(super) fn state_aperture(
        &mut self,
        current: usize,
        name: &str,
        command: &[Word<'_>],
        sink: &mut Sink,
    ) -> Result<()> {
        let is = |what: &str| command.iter().any(|word| word.is(what));
        if is("OBS") || is("EDG") || is("HOL") {
            let what = if is("EDG") { "edge" } else { "obstruction" };
            sink.warn(command[0].span, format!("`{name}`: an {what} is left out"));
            return Ok(());
        }
        let mut numbers = command[1..]
            .iter()
            .filter(|w| w.text.parse::<f64>().is_ok());
        let Some(word) = numbers.next_back() else {
            return Ok(());
        };
        let value = self.file.number(*word)?;
        let stated = self.apertures.entry(current).or_default();
        stated.span = command[0].span;
        match name {
            "REX" => stated.rectangle[0] = Some(value),
            "REY" => stated.rectangle[1] = Some(value),
            "ELX" => stated.ellipse[0] = Some(value),
            "ELY" => stated.ellipse[1] = Some(value),
            "ADX" => stated.center.x = value,
            "ADY" => stated.center.y = value,
            _ => stated.angle = value,
        }
        Ok(())
    }

    /// Gives surfaces the apertures that were stated. A circle around the axis limits them too.
    pub(super) fn apply_apertures(&mut self, sink: &mut Sink) {
        for (number, stated) in &self.apertures {
            let Some(surface) = self.draft.lens.surfaces.get_mut(*number) else {
                continue;
            };
            let circle = surface.semi_diameter;
            let is_moved = stated.center != DVec2::ZERO;
            let (half, is_ellipse) = match (stated.rectangle, stated.ellipse) {
                ([Some(x), Some(y)], _) => ([x, y], false),
                (_, [Some(x), Some(y)]) => ([x, y], true),
                ([None, None], [None, None]) if is_moved && circle.is_finite() => {
                    ([circle; 2], true)
                }
                ([None, None], [None, None]) => continue,
                _ => {
                    let message = "an aperture with a width in x or y alone is left out";
                    sink.warn(stated.span, message)
                        .help("REX and REY, or ELX and ELY, give it both");
                    continue;
                }
            };
            surface.set_aperture(&ClearAperture {
                is_ellipse,
                half: DVec2::from_array(half),
                center: stated.center,
                rotation: stated.angle.to_radians(),
            });
            if !is_moved && surface.outline.is_some() {
                surface.semi_diameter = surface.semi_diameter.min(circle);
            }
        }
    }
}

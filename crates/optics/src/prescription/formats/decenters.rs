//! Decenters as files state them: breaks of the axis between surfaces, and decenters that belong to
//! a surface.

use glam::DVec3;
use ivcam_base::diag::Span;

use crate::prescription::decenter::{Decenter, SurfaceFrame};
use crate::prescription::formats::reader::Draft;
use crate::prescription::surface::Surface;

/// What a decenter of a surface does to the axis behind it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum AxisBehind {
    /// The axis goes on as the surface has it.
    #[default]
    Follows,
    /// It goes on as if the surface were not decentered.
    Returns,
    /// The surface is not decentered, and the axis behind it is, in reverse.
    Reverses,
    /// It turns by the tilt once more, as light does at a mirror.
    Bends,
}

/// A decenter that belongs to a surface, with the signs of CODE V, OSLO and ray-optics: the turns
/// about x and y are clockwise as seen from the tip of the axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StatedDecenter {
    /// The shift in the unit of the file.
    pub shift: DVec3,
    /// The angles about x, y and z in degrees.
    pub tilt: DVec3,
    /// Whether the shift is along the tilted axes.
    pub is_tilted_first: bool,
    pub behind: AxisBehind,
}

impl StatedDecenter {
    /// The frame of the surface; none if it changes nothing.
    pub(super) fn frame(&self) -> Option<Box<SurfaceFrame>> {
        let tilt = DVec3::new(-self.tilt.x, -self.tilt.y, self.tilt.z);
        let stated = Decenter {
            // Without a sign, so that no decenter is none.
            shift: self.shift + DVec3::ZERO,
            tilt: tilt + DVec3::ZERO,
        };
        let stated = match self.is_tilted_first {
            true => Decenter {
                shift: stated.affine().matrix3 * stated.shift,
                ..stated
            },
            false => stated,
        };
        let after = match self.behind {
            AxisBehind::Follows => Decenter::NONE,
            AxisBehind::Returns | AxisBehind::Reverses => stated.inverse(),
            AxisBehind::Bends => Decenter {
                shift: DVec3::ZERO,
                ..stated
            },
        };
        let before = match self.behind {
            AxisBehind::Reverses => Decenter::NONE,
            _ => stated,
        };
        SurfaceFrame { before, after }.boxed()
    }
}

impl Draft {
    /// Breaks the axis behind the last surface: by a decenter, and then by a distance along the new
    /// axis. A decenter at either end of a gap belongs to the surface there; between, an idle plane
    /// has it. Returns whether the distance is now a part of the gap behind the last surface.
    pub(super) fn break_axis(&mut self, decenter: &Decenter, gap: f64, span: Span) -> bool {
        self.pending = self.pending.then(decenter);
        if gap == 0.0 {
            return false;
        }
        let pending = std::mem::take(&mut self.pending);
        let medium = self.medium().clone();
        match self.lens.surfaces.last_mut() {
            Some(last) if pending.is_none() => last.thickness += gap,
            Some(last) if last.thickness == 0.0 => {
                let frame = last
                    .frame
                    .take()
                    .map_or_else(SurfaceFrame::default, |frame| *frame);
                let after = frame.after.then(&pending);
                last.frame = SurfaceFrame { after, ..frame }.boxed();
                last.thickness = gap;
            }
            None if pending.is_none() => return false,
            None => {
                let along = Decenter {
                    shift: gap * DVec3::Z,
                    ..Decenter::NONE
                };
                self.pending = pending.then(&along);
                return false;
            }
            Some(_) => {
                let plane = Surface::sphere(0.0, gap, medium, f64::INFINITY);
                self.pending = pending;
                self.push(Surface { span, ..plane }, [span; 4]);
            }
        }
        true
    }
}

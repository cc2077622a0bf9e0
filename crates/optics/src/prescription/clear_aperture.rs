//! Clear apertures that are not round, as polygons.

use glam::DVec2;

use crate::prescription::surface::Surface;

/// The number of corners in place of an ellipse.
const CORNERS: u32 = 48;

/// A clear aperture as files state it. Lengths are in the unit of the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClearAperture {
    pub is_ellipse: bool,
    /// Half of the widths in x and y.
    pub half: DVec2,
    /// Its middle, from the axis.
    pub center: DVec2,
    /// The angle in radians from the axes to those of the aperture, counterclockwise.
    pub rotation: f64,
}

impl ClearAperture {
    /// The corners, counterclockwise. In place of an ellipse they are those of a polygon of its
    /// area.
    fn corners(&self) -> Box<[DVec2]> {
        let turn = |angle: f64| {
            let (sin, cos) = libm::sincos(angle);
            DVec2::new(cos, sin)
        };
        let turned = turn(self.rotation);
        let place = |corner: DVec2| self.center + turned.rotate(corner * self.half);
        if !self.is_ellipse {
            let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
            return signs.map(|sign| place(DVec2::from_array(sign))).into();
        }
        let step = std::f64::consts::TAU / f64::from(CORNERS);
        let size = (step / libm::sin(step)).sqrt();
        let all = (0..CORNERS).map(|i| place(size * turn(step * (f64::from(i) + 0.5))));
        all.collect()
    }
}

impl Surface {
    /// Gives the surface a clear aperture in place of a round one. It stays round if that is what
    /// the aperture is.
    pub(crate) fn set_aperture(&mut self, aperture: &ClearAperture) {
        let is_centered = aperture.center == DVec2::ZERO;
        if aperture.is_ellipse && is_centered && aperture.half.x == aperture.half.y {
            self.semi_diameter = aperture.half.x;
            return;
        }
        self.set_outline(aperture.corners());
    }

    /// Gives the surface a clear aperture with these corners in place of a round one.
    pub(crate) fn set_outline(&mut self, corners: Box<[DVec2]>) {
        self.outline = Some(corners);
        // A corner itself may round to either side.
        self.semi_diameter = self.reach() * (1.0 + 1e-12);
    }

    /// The distance from the axis to the farthest corner of the outline; 0 for a round aperture.
    pub(crate) fn reach(&self) -> f64 {
        let corners = self.outline.as_deref().unwrap_or(&[]);
        corners
            .iter()
            .map(|corner| corner.length())
            .fold(0.0, f64::max)
    }

    /// Half of the widths and the middle of an outline that is a rectangle along x and y.
    pub(crate) fn rectangle(&self) -> Option<[DVec2; 2]> {
        let corners = self
            .outline
            .as_deref()
            .filter(|corners| corners.len() == 4)?;
        let (low, high) = corners
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(a, b), c| {
                (a.min(*c), b.max(*c))
            });
        let (center, half) = (0.5 * (low + high), 0.5 * (high - low));
        let is_corner = |c: &DVec2| {
            ((*c - center).abs() - half).abs().max_element() < 1e-12 * half.max_element()
        };
        let opposite = (corners[0] + corners[2] - corners[1] - corners[3]).length();
        (corners.iter().all(is_corner) && opposite < 1e-9 * half.length()).then_some([half, center])
    }
}

//! The f-number by real rays, and stopping down to one.
//!
//! The paraxial f-number of [`FirstOrder`](crate::prescription::FirstOrder) is the focal length
//! over the diameter of the stop's paraxial image. The pupil's aberrations, and rims in front of
//! the stop or behind it, make the beam that gets through another size: up to 5% in the shipped
//! lenses, which is 10% of the light. A photographer measures the real beam (ISO 517).

use glam::{DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::math::Mm;

use crate::lens::lens::Lens;
use crate::lens::trace::ray::LensRay;
use crate::prescription::prescription::Iris;
use crate::prescription::surface::Meridian;

impl Lens {
    /// The f-number by real rays: the focal length over the diameter of the widest beam parallel to
    /// the axis that gets through; none if the lens is afocal or lets no such beam through.
    ///
    /// Blades are taken as the circle in which they are inscribed. For a lens that differs in x and
    /// y both lengths are the geometric means of the two planes, which preserves areas.
    pub fn real_f_number(&self) -> Option<f64> {
        let efl = self.first_order().focal?.efl.abs();
        let round;
        let lens = match self.iris_edges().is_empty() {
            true => self,
            false => {
                round = self.with_iris(Iris::Round);
                &round
            }
        };
        let height = lens.axial_beam().height;
        let n = if lens.is_rotational() {
            efl / (2.0 * height)
        } else {
            let other = lens.first_order_in(Meridian::X).focal;
            let across = lens.axial_reach(DVec2::X).0;
            match other {
                Some(focal) => (efl * focal.efl.abs()).sqrt() / (2.0 * (height * across).sqrt()),
                None => efl / (2.0 * height),
            }
        };
        (n.is_finite() && n > 0.0).then_some(n)
    }

    /// The lens stopped down to an f-number by real rays. The stop does not open wider than the
    /// prescription has it.
    ///
    /// The ray parallel to the axis at the height f/(2N) is traced to the stop, and the place where
    /// it arrives becomes the rim.
    ///
    /// # Errors
    ///
    /// Returns an error if the lens has no f-number, if it cannot open that wide, or if nothing is
    /// left of the beam because its middle is closed.
    pub fn at_f_number(&self, f_number: f64) -> Result<Self> {
        let lens = self.stopped_down(f_number)?;
        match lens.axial_open_share() {
            None if lens.is_obstructed() => {
                let message = format!("`{}` can't be stopped down to f/{f_number}", self.name());
                Err(Diagnostic::error(message)
                    .with_help("the middle of its beam is closed: leave it open"))
            }
            _ => Ok(lens),
        }
    }

    /// The lens at an f-number, whether anything is left of its beam or not.
    fn stopped_down(&self, f_number: f64) -> Result<Self> {
        let (Some(widest), Some(stop)) = (self.real_f_number(), self.first_order().stop) else {
            return Err(
                Diagnostic::error(format!("`{}` has no f-number", self.name()))
                    .with_help("an afocal lens, or one without apertures, has none"),
            );
        };
        if !(f_number.is_finite() && f_number >= widest * (1.0 - 1e-3)) {
            return Err(
                Diagnostic::error(format!("`{}` can't open to f/{f_number}", self.name()))
                    .with_help(format!("its widest is f/{widest:.2} by real rays")),
            );
        }
        if f_number <= widest {
            return Ok(self.clone());
        }
        if !self.with_iris(Iris::Round).is_rotational() {
            return self.with_f_number(f_number, stop);
        }
        let height = self.with_iris(Iris::Round).axial_beam().height * widest / f_number;
        let ray = LensRay::new(DVec3::new(0.0, height, -self.far()), DVec3::Z);
        let hits = self.hits_on_surfaces(&ray);
        let Some(hit) = hits.get(stop) else {
            return Err(Diagnostic::error(format!(
                "`{}` can't be stopped down to f/{f_number}: its beam misses the stop",
                self.name()
            )));
        };
        self.with_stop(Mm(hit.length()))
    }

    /// The lens with the stop at which it has an f-number, by bisection. A rim limits the beam in
    /// one plane and the stop in another, so a single ray is not enough.
    fn with_f_number(&self, f_number: f64, stop: usize) -> Result<Self> {
        let (mut low, mut high) = (0.0, self.prescription().surfaces[stop].semi_diameter);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match self.with_stop(Mm(middle))?.real_f_number() {
                Some(n) if n < f_number => high = middle,
                _ => low = middle,
            }
        }
        self.with_stop(Mm(high))
    }

    /// A distance in front of the lens, in millimeters, at which rays parallel to the axis start.
    pub(in crate::lens) fn far(&self) -> f64 {
        let surfaces = &self.prescription().surfaces;
        let first = surfaces.first().map_or(0.0, |s| s.thickness.abs());
        10.0 * (1.0 + first + self.length().abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::{Medium, Prescription, Surface};

    /// A plano-convex lens, flat side first, with the stop on the flat side: parallel light fills
    /// the stop, so the beam is as wide as the stop, by real rays and by paraxial ones.
    #[test]
    fn a_stop_in_front_of_all_glass_is_the_beam() {
        let surfaces = vec![
            Surface::stop(1.0, Medium::air(), 5.0),
            Surface::sphere(0.0, 4.0, Medium::constant(1.5), 20.0),
            Surface::sphere(-25.0, 0.0, Medium::air(), 20.0),
        ];
        let lens = Lens::new(Prescription::new("plano-convex", surfaces));
        assert!((lens.real_f_number().unwrap() - 5.0).abs() < 1e-12);
        assert!((lens.first_order().f_number().unwrap() - 5.0).abs() < 1e-12);
        let closed = lens.at_f_number(10.0).unwrap();
        let stop = closed.prescription().surfaces[0].semi_diameter;
        assert!((stop - 2.5).abs() < 1e-12, "{stop}");
    }

    #[test]
    fn every_shipped_lens_has_the_f_number_it_is_stopped_down_to() {
        for name in crate::lens::shipped_names() {
            let lens = Lens::named(name).unwrap();
            if lens.is_obstructed() {
                assert!(lens.at_f_number(32.0).is_err(), "{name}");
                continue;
            }
            let Some(widest) = lens.real_f_number() else {
                continue;
            };
            for n in [1.05 * widest, 2.0 * widest] {
                let closed = lens.at_f_number(n).unwrap().real_f_number().unwrap();
                assert!((closed / n - 1.0).abs() < 1e-9, "{name}: {closed} for {n}");
            }
        }
    }
}

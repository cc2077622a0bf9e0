//! The transmittance of a lens, and its T-number.
//!
//! Glass is assumed to absorb nothing: a surface transmits what it does not reflect.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::lens::lens::Lens;
use crate::lens::trace::ray::{LensRay, Toward};
use crate::lens::trace::tracer::Tracer;
use crate::prescription::prescription::Iris;

impl Lens {
    /// The share of a ray's light that reaches the other side, at the lens's wavelength; 0 for a
    /// ray that is lost.
    pub fn transmittance(&self, ray: &LensRay, toward: Toward) -> f64 {
        self.transmittance_at(ray, toward, self.wavelength())
    }

    /// The share of a ray's light that reaches the other side, at a wavelength for the coatings
    /// alone; 0 for a ray that is lost.
    pub fn transmittance_at(&self, ray: &LensRay, toward: Toward, wavelength_nm: f64) -> f64 {
        transmittance(&self.tracer(toward, true), ray, wavelength_nm)
    }

    /// The mean transmittance of the rays of the widest axial beam that get through; none if no ray
    /// does.
    pub fn axial_transmittance(&self) -> Option<f64> {
        const RINGS: u32 = 32;
        const SPOKES: u32 = 16;
        if !self.reflects() {
            return Some(1.0);
        }
        let spokes = if self.prescription().is_rotational() {
            1
        } else {
            SPOKES
        };
        let beam = DVec2::splat(self.axial_beam().height);
        let (mut sum, mut count) = (0.0, 0.0);
        for ray in self.axial_rays(beam, RINGS, spokes) {
            let share = self.transmittance(&ray, Toward::Film);
            sum += share;
            count += f64::from(u8::from(share > 0.0));
        }
        (count > 0.0).then(|| sum / count)
    }

    /// The share of the widest axial beam that is not closed in its middle, by rings of equal area;
    /// none if no ray gets through.
    pub fn axial_open_share(&self) -> Option<f64> {
        const RINGS: u32 = 4096;
        if !self.is_obstructed() {
            return Some(1.0);
        }
        let beam = DVec2::splat(self.axial_beam().height);
        let open = self.passing(self.axial_rays(beam, RINGS, 1)) / f64::from(RINGS);
        (open > 0.0).then_some(open)
    }

    /// Rays along the axis at the middles of rings of equal area within an ellipse of half axes
    /// `reach` in millimeters, on evenly spaced spokes; a single one is along y.
    fn axial_rays(
        &self,
        reach: DVec2,
        rings: u32,
        spokes: u32,
    ) -> impl Iterator<Item = LensRay> + use<> {
        let z = -self.far();
        (0..rings * spokes).map(move |i| {
            let r = ((f64::from(i % rings) + 0.5) / f64::from(rings)).sqrt();
            let turn = (f64::from(i / rings) + 0.5) / f64::from(spokes) - 0.25;
            let (sin, cos) = libm::sincos(TAU * turn);
            LensRay::new((r * reach * DVec2::new(cos, sin)).extend(z), DVec3::Z)
        })
    }

    /// The number of rays that get through.
    fn passing(&self, rays: impl Iterator<Item = LensRay>) -> f64 {
        rays.filter(|ray| self.trace_from_scene(ray).is_ok())
            .count() as f64
    }

    /// The share of the axial beam of a round stop that the blades of the stop leave open, by rays
    /// on rings of equal area, with an error of about 1e-3; none if no ray gets through.
    fn axial_blade_share(&self) -> Option<f64> {
        const RINGS: u32 = 128;
        const SPOKES: u32 = 256;
        if self.iris_edges().is_empty() {
            return Some(1.0);
        }
        let round = self.with_iris(Iris::Round);
        let height = round.axial_beam().height;
        let across = match round.is_rotational() {
            true => height,
            false => round.axial_reach(DVec2::X).0,
        };
        let rays = || self.axial_rays(DVec2::new(across, height), RINGS, SPOKES);
        Some(self.passing(rays()) / round.passing(rays())).filter(|share| *share > 0.0)
    }

    /// The share of the light of a round stop's axial beam that gets through the glass, the blades
    /// of the stop and what is not closed in the middle; none if no ray gets through.
    fn axial_throughput(&self) -> Option<f64> {
        let open = self.axial_open_share()? * self.axial_blade_share()?;
        Some(self.axial_transmittance()? * open)
    }

    /// The T-number N/√τ, with the f-number by real rays: the f-number of a lens without losses
    /// that makes an equally bright picture. Returns none if the lens has no f-number or no ray
    /// gets through.
    pub fn t_number(&self) -> Option<f64> {
        Some(self.real_f_number()? / self.axial_throughput()?.sqrt())
    }

    /// The T-number with the paraxial f-number.
    pub fn paraxial_t_number(&self) -> Option<f64> {
        let f_number = self.first_order().f_number()?;
        Some(f_number / self.axial_throughput()?.sqrt())
    }
}

/// The share of a ray's light that gets through; 0 for a lost ray.
fn transmittance(tracer: &Tracer<'_>, ray: &LensRay, wavelength_nm: f64) -> f64 {
    let mut share = 1.0;
    let outcome = tracer.walk(*ray, |surface, _, hit| {
        let element = &tracer.elements[surface];
        share *= 1.0 - element.reflectance(tracer.toward, hit.cos, wavelength_nm);
    });
    if outcome.is_ok() { share } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lens::{Prescription, Surface};
    use crate::prescription::glass::coating::Coating;
    use crate::prescription::glass::medium::Medium;

    fn window(coating: Coating) -> Lens {
        let glass = Medium::constant(1.5168);
        let surfaces = vec![
            Surface::sphere(0.0, 5.0, glass, 10.0),
            Surface::sphere(0.0, 1.0, Medium::air(), 10.0),
        ];
        Lens::new(Prescription::new("window", surfaces).with_coating(coating))
    }

    #[test]
    fn a_bare_window_transmits_the_square_of_what_one_surface_transmits() {
        let ray = LensRay::new(DVec3::new(1.0, 2.0, -5.0), DVec3::Z);
        let through = window(Coating::Bare).transmittance(&ray, Toward::Film);
        let one = 1.0 - (0.5168f64 / 2.5168).powi(2);
        assert!((through - one * one).abs() < 1e-15);
        assert_eq!(
            window(Coating::Ideal).transmittance(&ray, Toward::Film),
            1.0
        );
    }

    /// The area of a regular polygon over that of the circle through its corners.
    #[test]
    fn blades_open_the_share_of_their_polygon() {
        let lens = Lens::named("double-gauss").unwrap();
        for count in [3, 5, 8] {
            let blades = Iris::Blades {
                count,
                rotation: 0.2,
            };
            let bladed = lens.with_iris(blades).at_f_number(8.0).unwrap();
            let open = bladed.axial_throughput().unwrap();
            let angle = TAU / f64::from(count);
            let known = libm::sin(angle) / angle;
            // The stop is seen through glass, whose aberrations are small at f/8.
            assert!((open / known - 1.0).abs() < 0.01, "{count}: {open} {known}");
        }
    }

    #[test]
    fn a_ray_loses_the_same_share_both_ways() {
        let lens = Lens::named("double-gauss").unwrap();
        for (_, coating) in Coating::ALL {
            let lens = lens.with_coating(coating);
            let ray = LensRay::new(DVec3::new(3.0, 8.0, -50.0), DVec3::new(0.0, 0.05, 1.0));
            let out = lens.trace_from_scene(&ray).unwrap();
            let back = LensRay::new(out.origin + 10.0 * out.direction, -out.direction);
            let there = lens.transmittance(&ray, Toward::Film);
            let again = lens.transmittance(&back, Toward::Scene);
            assert!((there / again - 1.0).abs() < 1e-12, "{there} {again}");
        }
    }

    /// Six surfaces between glass and air.
    #[test]
    fn the_t_number_is_the_f_number_over_the_root_of_what_gets_through() {
        let lens = Lens::named("cooke-triplet").unwrap();
        let f = lens.real_f_number().unwrap();
        assert_eq!(lens.t_number(), Some(f));
        let bare = lens.with_coating(Coating::Bare);
        let share = bare.axial_transmittance().unwrap();
        // On the axis the transmittance is the product over the surfaces.
        let indices = lens.prescription().indices(lens.wavelength());
        let product: f64 = indices
            .windows(2)
            .map(|n| 1.0 - ((n[0] - n[1]) / (n[0] + n[1])).powi(2))
            .product();
        assert!((share / product - 1.0).abs() < 0.01, "{share} {product}");
        assert!((bare.t_number().unwrap() - f / share.sqrt()).abs() < 1e-12);
        let coated = lens.with_coating(Coating::MagnesiumFluoride);
        assert!(coated.axial_transmittance().unwrap() > 0.9);
    }
}

//! First-order (paraxial) optics: focal lengths, focal points, principal planes and pupils.
//!
//! Heights and slopes are traced linearly through the vertex curvatures, so no ray of finite height
//! is involved, and a stop closed to f/1024 changes nothing. The matrix is computed in pairs of
//! doubles: a telescope that is out of adjustment by a nanometer has a power of 1e-10, which is the
//! difference of two numbers near 1, and a double keeps seven digits of it.
//!
//! Nothing assumes an order of planes and focal points along the axis: in a fish-eye the rear
//! principal plane is behind the lens, in a telephoto lens in front of it, and in a double Gauss
//! the rear plane is in front of the front one. A lens without power (a telescope) is not an error.

use ivcam_base::math::Double;

use crate::prescription::prescription::Prescription;
use crate::prescription::surface::{Meridian, Shape, Surface};

/// The first-order data of a lens in one plane. Positions are in millimeters from the front vertex,
/// with +z toward the film. Behind an odd number of mirrors, z is counted from the last vertex
/// along the light.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstOrder {
    /// The distance from the first vertex to the last along z.
    pub length: f64,
    /// The index in front of the lens.
    pub n_object: f64,
    /// The index behind the lens.
    pub n_image: f64,
    /// The matrix, row by row, from (y, n u) at the front vertex to (y, n u) at the rear vertex.
    pub matrix: [f64; 4],
    /// The optical power, per millimeter; 0 for an afocal lens.
    pub power: f64,
    /// The focal lengths; none for an afocal lens.
    pub focal: Option<Focal>,
    /// The surface that acts as the stop: the one marked, or the first to limit an axial beam.
    pub stop: Option<usize>,
    /// The image of the stop in scene space; none if it is at infinity or nothing limits a beam.
    pub entrance_pupil: Option<Pupil>,
    /// The image of the stop in film space; none if it is at infinity or nothing limits a beam.
    pub exit_pupil: Option<Pupil>,
}

/// The focal lengths, focal points and principal planes of a lens. Lengths are in millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Focal {
    /// The distance from the rear principal plane to the rear focal point. It is negative for a
    /// diverging lens.
    pub efl: f64,
    /// The distance from the front focal point to the front principal plane. It differs from `efl`
    /// if the media in front of and behind the lens differ.
    pub front_efl: f64,
    /// The distance from the rear vertex to the rear focal point.
    pub bfl: f64,
    /// The distance from the front vertex to the front focal point. It is negative if the focal
    /// point is in front of the vertex.
    pub ffl: f64,
    /// The z of the front focal point.
    pub front_focal_point: f64,
    /// The z of the rear focal point.
    pub rear_focal_point: f64,
    /// The z of the front principal plane.
    pub front_principal_plane: f64,
    /// The z of the rear principal plane.
    pub rear_principal_plane: f64,
}

/// An image of the stop, in object or in image space. Lengths are in millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pupil {
    /// The z of the pupil, from the front vertex.
    pub z: f64,
    /// The radius of the pupil.
    pub semi_diameter: f64,
    /// The size of the pupil over that of the stop; negative if the image is upside down.
    pub magnification: f64,
}

impl FirstOrder {
    /// A lens in air with its front principal plane at the origin, its rear one at `t`, and no
    /// stop. Lengths are in millimeters.
    pub fn in_air(f: f64, t: f64) -> Self {
        Self {
            length: 0.0,
            n_object: 1.0,
            n_image: 1.0,
            matrix: [1.0, 0.0, -1.0 / f, 1.0],
            power: 1.0 / f,
            focal: Some(Focal {
                efl: f,
                front_efl: f,
                bfl: t + f,
                ffl: -f,
                front_focal_point: -f,
                rear_focal_point: t + f,
                front_principal_plane: 0.0,
                rear_principal_plane: t,
            }),
            stop: None,
            entrance_pupil: None,
            exit_pupil: None,
        }
    }

    /// The focal length, infinite for an afocal lens.
    pub fn efl(&self) -> f64 {
        self.focal.map_or(f64::INFINITY, |f| f.efl)
    }

    /// The focal length over the diameter of the entrance pupil; none if the lens is afocal or has
    /// no entrance pupil.
    pub fn f_number(&self) -> Option<f64> {
        let pupil = self.entrance_pupil?;
        let n = self.focal?.efl.abs() / (2.0 * pupil.semi_diameter);
        n.is_finite().then_some(n)
    }

    /// Computes the data of a prescription, with the index in front of every surface and, last, the
    /// one behind the lens.
    pub(crate) fn of(prescription: &Prescription, indices: &[f64], plane: Meridian) -> Self {
        let surfaces = &prescription.surfaces;
        let facings = prescription.facings();
        let gaps = surfaces.iter().zip(&facings[1..]);
        let length = sum(gaps.rev().skip(1).rev().map(|(s, sign)| sign * s.thickness));
        let n_object = indices[0];
        let n_image = indices[surfaces.len()];
        let whole = Matrix::through(surfaces, indices, plane, 0, surfaces.len());
        let power = -whole.c.rounded();
        let bend = surfaces
            .iter()
            .map(|s| match s.shape {
                Shape::ThinLens { focal_length } => 1.0 / focal_length.abs(),
                _ => s.vertex_curvature(plane).abs(),
            })
            .fold(0.0, f64::max);
        let mut this = Self {
            length,
            n_object,
            n_image,
            matrix: [
                whole.a.rounded(),
                whole.b.rounded(),
                whole.c.rounded(),
                whole.d.rounded(),
            ],
            power,
            focal: None,
            stop: stop_of(surfaces, indices, plane),
            entrance_pupil: None,
            exit_pupil: None,
        };
        if power.abs() > 1e-15 * bend {
            this.focal = Some(whole.focal(length, n_object, n_image));
        } else {
            this.power = 0.0;
        }
        if let Some(stop) = this.stop {
            let radius = surfaces[stop].semi_diameter;
            let front = Matrix::through(surfaces, indices, plane, 0, stop);
            // The gap in front of the stop belongs to the front part.
            let rear = Matrix::through(surfaces, indices, plane, stop, surfaces.len());
            this.entrance_pupil = pupil(
                (front.b * n_object.into() / front.a).rounded(),
                front.a.rounded(),
                radius,
            );
            this.exit_pupil = pupil(
                (Double::from(length) - rear.b * n_image.into() / rear.d).rounded(),
                rear.d.rounded(),
                radius,
            );
        }
        this
    }
}

fn pupil(z: f64, scale: f64, radius: f64) -> Option<Pupil> {
    let magnification = 1.0 / scale;
    let semi_diameter = radius * magnification.abs();
    (z.is_finite() && semi_diameter.is_finite()).then_some(Pupil {
        z,
        semi_diameter,
        magnification,
    })
}

/// The surface marked as the stop, or the one that an axial beam from infinity fills first.
fn stop_of(surfaces: &[Surface], indices: &[f64], plane: Meridian) -> Option<usize> {
    if let Some(marked) = surfaces.iter().position(|s| s.is_stop) {
        return Some(marked);
    }
    let mut best = None;
    let mut fill = 0.0;
    let mut ray = [(Double::ONE, Double::default())];
    for (i, surface) in surfaces.iter().enumerate() {
        let y = ray[0].0.rounded();
        if y.abs() / surface.semi_diameter > fill {
            fill = y.abs() / surface.semi_diameter;
            best = Some(i);
        }
        cross(surfaces, indices, plane, i, &mut ray);
    }
    best
}

fn sum(terms: impl Iterator<Item = f64>) -> f64 {
    terms.fold(Double::default(), |s, t| s + t.into()).rounded()
}

/// Traces (y, n u) of paraxial rays from the vertex of a surface, in front of it, to that of the
/// next one, or behind the last surface.
fn cross(
    surfaces: &[Surface],
    indices: &[f64],
    plane: Meridian,
    i: usize,
    rays: &mut [(Double, Double)],
) {
    let surface = &surfaces[i];
    let step = match surface.is_mirror {
        true => surface.index_step([indices[i]; 2]).into(),
        false => Double::from(indices[i + 1]) - indices[i].into(),
    };
    let power = match surface.shape {
        Shape::ThinLens { focal_length } => Double::ONE / focal_length.into(),
        _ => step * curvature(surface, plane),
    };
    let gap = if i + 1 < surfaces.len() {
        surface.thickness
    } else {
        0.0
    };
    let reduced = Double::from(gap) / indices[i + 1].into();
    for (y, nu) in rays {
        *nu = *nu - *y * power;
        *y = *y + *nu * reduced;
    }
}

/// The transfer of (y, n u) between two planes.
struct Matrix {
    a: Double,
    b: Double,
    c: Double,
    d: Double,
}

impl Matrix {
    /// The transfer from the vertex of surface `from`, in front of it, to the vertex of surface
    /// `to`, in front of it, or behind the last surface if `to` is the number of surfaces.
    /// `indices[i]` is the index in front of surface i.
    fn through(
        surfaces: &[Surface],
        indices: &[f64],
        plane: Meridian,
        from: usize,
        to: usize,
    ) -> Self {
        let (one, zero) = (Double::ONE, Double::default());
        let mut rays = [(one, zero), (zero, one)];
        for i in from..to {
            cross(surfaces, indices, plane, i, &mut rays);
        }
        Self {
            a: rays[0].0,
            c: rays[0].1,
            b: rays[1].0,
            d: rays[1].1,
        }
    }

    fn focal(&self, length: f64, n_object: f64, n_image: f64) -> Focal {
        let efl = Double::from(-n_image) / self.c;
        let front_efl = Double::from(-n_object) / self.c;
        let bfl = efl * self.a;
        let ffl = Double::default() - front_efl * self.d;
        let rear = Double::from(length) + bfl;
        Focal {
            efl: efl.rounded(),
            front_efl: front_efl.rounded(),
            bfl: bfl.rounded(),
            ffl: ffl.rounded(),
            front_focal_point: ffl.rounded(),
            rear_focal_point: rear.rounded(),
            front_principal_plane: (ffl + front_efl).rounded(),
            rear_principal_plane: (rear - efl).rounded(),
        }
    }
}

/// The curvature at the vertex, computed from the radius as it was written in the file.
fn curvature(surface: &Surface, plane: Meridian) -> Double {
    let plain = surface.vertex_curvature(plane);
    let inverse = |radius: f64| Double::ONE / radius.into();
    match &surface.shape {
        _ if plain == 0.0 => Double::default(),
        Shape::Toroid { across, .. } if plane == Meridian::X => inverse(across.radius()),
        Shape::Asphere { terms, .. }
        | Shape::NormalAsphere { terms, .. }
        | Shape::Toroid { terms, .. }
            if terms[2] != 0.0 =>
        {
            plain.into()
        }
        _ => inverse(surface.curvature.radius()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prescription::glass::medium::Medium;

    fn lens(rows: &[(f64, f64, f64)]) -> FirstOrder {
        let surfaces = rows
            .iter()
            .map(|&(r, t, n)| Surface::sphere(r, t, Medium::constant(n), 12.0))
            .collect();
        let prescription = Prescription::new("test", surfaces);
        let indices = prescription.indices(587.6);
        FirstOrder::of(&prescription, &indices, Meridian::Y)
    }

    /// EFL = n D / (4 (n − 1)), BFL = EFL − D/2 (any textbook).
    #[test]
    fn a_ball_lens_has_the_textbook_focal_length() {
        for (n, efl, bfl) in [
            (1.5, 7.5, 2.5),
            (2.0, 5.0, 0.0),
            (4.0, 10.0 / 3.0, -5.0 / 3.0),
        ] {
            let focal = lens(&[(5.0, 10.0, n), (-5.0, 0.0, 1.0)]).focal.unwrap();
            assert!((focal.efl - efl).abs() < 1e-15);
            assert!((focal.bfl - bfl).abs() < 1e-15, "{}", focal.bfl);
            assert!((focal.rear_principal_plane - 5.0).abs() < 1e-14);
        }
    }

    /// Two plano-convex lenses with f = 100 and 50 that are 150 apart invert and double angles.
    #[test]
    fn a_telescope_has_no_focal_length_and_is_not_an_error() {
        let gap = |extra: f64| {
            lens(&[
                (50.0, 3.0, 1.5),
                (0.0, 146.0 + extra, 1.0),
                (0.0, 3.0, 1.5),
                (-25.0, 0.0, 1.0),
            ])
        };
        let telescope = gap(0.0);
        assert_eq!((telescope.focal, telescope.power), (None, 0.0));
        assert!((telescope.matrix[3] + 2.0).abs() < 1e-15);
        // Out by δ the power is −δ/(100·50): here −2e-10 for δ = 1e-6.
        let near = gap(1e-6).focal.unwrap();
        assert!((near.efl / -5e9 - 1.0).abs() < 1e-7, "{}", near.efl);
    }

    /// A concentric shell refracts paraxial rays as a thin lens at its center does.
    #[test]
    fn both_principal_planes_of_a_concentric_shell_are_its_center() {
        let focal = lens(&[(50.0, 10.0, 1.5), (40.0, 0.0, 1.0)]).focal.unwrap();
        assert!((focal.efl + 600.0).abs() < 1e-10);
        assert!((focal.front_principal_plane - 50.0).abs() < 1e-10);
        assert!((focal.rear_principal_plane - 50.0).abs() < 1e-10);
    }
}

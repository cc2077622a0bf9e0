//! The optical paths through ideal thin lenses.

use glam::{DVec2, DVec3};

use crate::lens::lens::Lens;
use crate::lens::trace::element::Form;
use crate::lens::trace::ray::{LensRay, Toward};
use crate::prescription::surface::Meridian;

/// The ideal lenses of a system, each with the place of the object that it sees.
///
/// The optical path through an ideal lens is what makes that image sharp: between the object point
/// and its image, all paths are as long as that through the vertex. The object is that of paraxial
/// rays, as in Zemax's mode 3 of the path difference.
pub(crate) struct ObjectsOfIdealLenses {
    /// Numbers of surfaces, and one over the z of the object from the vertex in millimeters, 0 for
    /// one at infinity.
    objects: Vec<(usize, f64)>,
}

impl ObjectsOfIdealLenses {
    /// The ideal lenses of a lens, for an object at a distance in front of its first vertex in
    /// millimeters, which may be infinite.
    pub(crate) fn new(lens: &Lens, distance: f64) -> Self {
        let mut objects = Vec::new();
        let is_ideal = |i: usize| matches!(lens.elements()[i].form, Form::ThinLens { .. });
        if !(0..lens.elements().len()).any(is_ideal) {
            return Self { objects };
        }
        let (mut y, mut u) = (1.0, 1.0 / distance);
        for (i, surface) in lens.prescription().surfaces.iter().enumerate() {
            let n = lens.elements()[i].indices;
            if is_ideal(i) {
                objects.push((i, -u / y));
            }
            u = (n[0] * u - y * surface.power(n, Meridian::Y)) / n[1];
            y += surface.thickness * u;
        }
        Self { objects }
    }

    /// What the ideal lenses add to the optical path of a ray toward the film, in millimeters.
    pub(crate) fn path(&self, lens: &Lens, ray: &LensRay) -> f64 {
        let mut sum = 0.0;
        if self.objects.is_empty() {
            return sum;
        }
        let tracer = lens.tracer(Toward::Film, false);
        let _ = tracer.walk(*ray, |surface, d, hit| {
            let element = &lens.elements()[surface];
            let found = self.objects.iter().find(|(i, _)| *i == surface);
            if let (Some((_, object)), Form::ThinLens { focal_length }) = (found, &element.form) {
                sum += step(
                    d,
                    hit.point.truncate(),
                    element.indices,
                    *focal_length,
                    *object,
                );
            }
        });
        sum
    }
}

/// The optical path that an ideal lens adds at a point of its plane to a ray of the direction `d`,
/// whose object is at the z of 1/`object`.
fn step(d: DVec3, point: DVec2, [n, behind]: [f64; 2], focal_length: f64, object: f64) -> f64 {
    let slopes = d.truncate() / d.z;
    let bent = (n * slopes - point / focal_length) / behind;
    let image = (n * object + 1.0 / focal_length) / behind;
    // How much farther it is from the point of an object or image at the z of 1/q to `point` than
    // to the vertex, on the way of light; without the difference of two long distances.
    let farther = |slopes: DVec2, q: f64| {
        let at_vertex = slopes + q * point;
        (2.0 * slopes.dot(point) + q * point.length_squared())
            / ((1.0 + slopes.length_squared()).sqrt() + (1.0 + at_vertex.length_squared()).sqrt())
    };
    let added = behind * farther(bent, image) - n * farther(slopes, object);
    // At an image itself all rays of a point meet the lens at one place.
    if added.is_finite() { added } else { 0.0 }
}

//! Lenses of spheres and planes in numbers of 32 digits, written without the code of `lens`.

use ivcam_base::math::Double;
use ivcam_optics::lens::{Lens, LensRay};

/// The inputs of a ray through a lens, which can be rounded one by one: for each surface its
/// curvature, its thickness and the index behind it; the index in front; the ray.
#[derive(Clone, Debug)]
pub(super) struct ReferenceInputs {
    surfaces: Vec<[f64; 3]>,
    object_index: f64,
    ray: [f64; 6],
}

/// The answer: the point on the last surface and the direction behind it.
pub(super) type ReferenceRay = [Double; 6];

impl ReferenceInputs {
    /// Returns the inputs of a ray through a lens at the lens's wavelength.
    pub(super) fn of(lens: &Lens, ray: &LensRay) -> Self {
        let prescription = lens.prescription();
        let surface = |s: &ivcam_optics::lens::Surface| {
            let index = s.medium.index(lens.wavelength());
            [s.curvature.per_mm(), s.thickness, index]
        };
        let (o, d) = (ray.origin, ray.direction);
        Self {
            surfaces: prescription.surfaces.iter().map(surface).collect(),
            object_index: prescription.object_medium.index(lens.wavelength()),
            ray: [o.x, o.y, o.z, d.x, d.y, d.z],
        }
    }

    /// Traces the ray; `None` if it misses a surface or is totally reflected.
    pub(super) fn trace(&self) -> Option<ReferenceRay> {
        self.trace_rounding(None)
    }

    /// Traces the ray, whose coordinates are rounded after one of the surfaces.
    fn trace_rounding(&self, rounded: Option<usize>) -> Option<ReferenceRay> {
        let mut p: [Double; 3] = std::array::from_fn(|i| self.ray[i].into());
        let mut d: [Double; 3] = std::array::from_fn(|i| self.ray[i + 3].into());
        let length = dot(d, d).sqrt();
        d = d.map(|x| x / length);
        let mut before = Double::from(self.object_index);
        let mut vertex = Double::default();
        for (i, [curvature, thickness, index]) in self.surfaces.iter().enumerate() {
            let [c, n] = [*curvature, *index].map(Double::from);
            p[2] = p[2] - vertex;
            // The ray p + t d meets the sphere where c t² − 2 g t + f = 0.
            let f = c * dot(p, p) - (p[2] + p[2]);
            let g = d[2] - c * dot(p, d);
            let root = (g * g - c * f).sqrt();
            // The hit on the side of the vertex, where the ray goes with the normal. Each form has
            // no cancellation where the other one has.
            let t = match g.rounded() < 0.0 {
                true => (g - root) / c,
                false => f / (g + root),
            };
            p = std::array::from_fn(|axis| p[axis] + t * d[axis]);
            let normal = [-(c * p[0]), -(c * p[1]), Double::ONE - c * p[2]];
            let cos = dot(d, normal);
            let mu = before / n;
            let square = Double::ONE - mu * mu * (Double::ONE - cos * cos);
            let beyond = if cos.rounded() < 0.0 {
                -square.sqrt()
            } else {
                square.sqrt()
            };
            let turn = beyond - mu * cos;
            d = std::array::from_fn(|axis| mu * d[axis] + turn * normal[axis]);
            before = n;
            if rounded == Some(i) {
                let factor = Double::from(1.0 + f64::EPSILON);
                (p, d) = (p.map(|x| x * factor), d.map(|x| x * factor));
            }
            p[2] = p[2] + vertex;
            if i + 1 < self.surfaces.len() {
                vertex = vertex + Double::from(*thickness);
            }
        }
        let answer: ReferenceRay = std::array::from_fn(|i| [p, d][i / 3][i % 3]);
        answer
            .iter()
            .all(|x| x.rounded().is_finite())
            .then_some(answer)
    }

    /// Returns how far rounding one number moves the answer, summed over the inputs and over the
    /// rays behind the surfaces, by the measure of [`distance`].
    pub(super) fn rounding(&self, exact: &ReferenceRay) -> f64 {
        let mut moved = self.clone();
        let mut sum = 0.0;
        let mut vary = |moved: &mut Self, place: fn(&mut Self, usize) -> &mut f64, i: usize| {
            let value = *place(moved, i);
            *place(moved, i) = value * (1.0 + f64::EPSILON);
            // A neighbor that is lost is as far as the answer is large.
            sum += moved.trace().map_or(1.0, |answer| distance(exact, &answer));
            *place(moved, i) = value;
        };
        for i in 0..3 * self.surfaces.len() {
            vary(
                &mut moved,
                |inputs, i| &mut inputs.surfaces[i / 3][i % 3],
                i,
            );
        }
        for i in 0..6 {
            vary(&mut moved, |inputs, i| &mut inputs.ray[i], i);
        }
        vary(&mut moved, |inputs, _| &mut inputs.object_index, 0);
        let behind = |i: usize| self.trace_rounding(Some(i));
        let rays = (0..self.surfaces.len()).map(behind);
        sum + rays
            .map(|ray| ray.map_or(1.0, |ray| distance(exact, &ray)))
            .sum::<f64>()
    }

    /// Returns the paraxial image of an axial point before the lens, in millimeters behind the last
    /// vertex.
    pub(super) fn paraxial_image(&self, distance: f64) -> f64 {
        let (mut y, mut nu) = (Double::from(distance), Double::from(self.object_index));
        let mut before = nu;
        for (i, [curvature, thickness, index]) in self.surfaces.iter().enumerate() {
            let n = Double::from(*index);
            nu = nu - y * (n - before) * Double::from(*curvature);
            before = n;
            if i + 1 < self.surfaces.len() {
                y = y + nu / n * Double::from(*thickness);
            }
        }
        (-(y * before) / nu).rounded()
    }
}

fn dot(a: [Double; 3], b: [Double; 3]) -> Double {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the largest difference of two answers: of the points over the farthest coordinate, or of
/// the directions.
pub(super) fn distance(a: &ReferenceRay, b: &ReferenceRay) -> f64 {
    let sizes = a[..3].iter().map(|x| x.rounded().abs());
    let size = sizes.fold(f64::MIN_POSITIVE, f64::max);
    let off = |range: std::ops::Range<usize>| {
        let off = range.map(|i| (a[i] - b[i]).rounded().abs());
        off.fold(0.0, f64::max)
    };
    (off(0..3) / size).max(off(3..6))
}

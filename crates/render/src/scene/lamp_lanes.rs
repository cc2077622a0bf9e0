//! How much light each of a few luminous primitives brings to a face, about.
//!
//! It is the estimate of [`LitFace::light_of`], times the cosine under which a flat primitive is
//! seen. Where that one sees a node as a sphere, this one knows which side of a face is meant. The
//! primitives of a group are computed in lanes, and the numbers have the same bits at any width.

use std::ops::Range;

use glam::Vec3;
use ivcam_base::math::lanes::{SimdKernel, dispatch};

use super::emitter_tree::TreeItem;
use super::lit_face::LitFace;

/// The largest number of primitives of a group.
pub(crate) const GROUP: usize = 16;
/// The cosine under which a round primitive is seen: a closed surface shows a quarter of its area.
const ROUND: f32 = 0.25;
/// The share of the light of a closed surface's inner side in the estimate. It is only seen from
/// inside, where all faces have it.
const INSIDE: f32 = 1.0 / 64.0;

/// The places and powers of luminous primitives, by their leaf.
#[derive(Debug, Default)]
pub(crate) struct LampLanes {
    center: [Vec<f32>; 3],
    /// The normals; 0 for round primitives.
    normal: [Vec<f32>; 3],
    /// The square of the radius around each.
    square: Vec<f32>,
    power: Vec<f32>,
    /// The share of the light of the other side.
    behind: Vec<f32>,
    /// The least cosine under which each is seen.
    least: Vec<f32>,
}

impl LampLanes {
    /// The primitives in the order of their leaves, with the normal of each that is flat, and
    /// whether it belongs to a closed surface.
    pub(super) fn of(items: &[TreeItem], flat: impl Fn(&TreeItem) -> Option<(Vec3, bool)>) -> Self {
        let mut this = Self::default();
        let count = items.len() + GROUP;
        let vectors = this.center.iter_mut().chain(&mut this.normal);
        let numbers = [&mut this.square, &mut this.power, &mut this.behind];
        for all in vectors.chain(numbers).chain([&mut this.least]) {
            // A group may extend beyond the last leaf, to primitives without power.
            all.resize(count, 0.0);
        }
        for (leaf, item) in items.iter().enumerate() {
            let half = 0.5 * (item.high - item.low);
            let center = item.low + half;
            let flat = flat(item);
            let normal = flat.map_or(Vec3::ZERO, |(normal, _)| normal);
            for axis in 0..3 {
                this.center[axis][leaf] = center[axis];
                this.normal[axis][leaf] = normal[axis];
            }
            this.square[leaf] = half.length_squared().max(f32::MIN_POSITIVE);
            this.power[leaf] = item.power;
            let is_closed = flat.is_some_and(|(_, is_closed)| is_closed);
            this.behind[leaf] = if is_closed { INSIDE } else { 1.0 };
            this.least[leaf] = if flat.is_none() { ROUND } else { 0.0 };
        }
        this
    }

    /// About the light that the primitives of a range of at most [`GROUP`] leaves bring to a face,
    /// and its sum.
    #[inline]
    pub(crate) fn light(&self, range: Range<u32>, face: &LitFace) -> ([f32; GROUP], f32) {
        let count = range.len();
        let mut light = dispatch(LightOfLamps {
            lamps: self,
            first: range.start as usize,
            face,
        });
        light[count..].fill(0.0);
        let total = light[..count].iter().sum();
        (light, total)
    }
}

/// The kernel of [`LampLanes::light`].
struct LightOfLamps<'a> {
    lamps: &'a LampLanes,
    first: usize,
    face: &'a LitFace,
}

impl SimdKernel for LightOfLamps<'_> {
    type Output = [f32; GROUP];

    #[inline(always)]
    fn run<const FUSED: bool>(self) -> [f32; GROUP] {
        let (lamps, face) = (self.lamps, self.face);
        let (position, normal) = (face.position, face.normal);
        let row = |all: &Vec<f32>| -> [f32; GROUP] {
            let some = all[self.first..].first_chunk();
            some.copied().unwrap_or([0.0; GROUP])
        };
        let [x, y, z] = lamps.center.each_ref().map(row);
        let [nx, ny, nz] = lamps.normal.each_ref().map(row);
        let [square, power] = [&lamps.square, &lamps.power].map(row);
        let [behind, least] = [&lamps.behind, &lamps.least].map(row);
        let mut light = [0.0; GROUP];
        for i in 0..GROUP {
            let (dx, dy, dz) = (x[i] - position.x, y[i] - position.y, z[i] - position.z);
            let far = dx * dx + dy * dy + dz * dz;
            let up = normal.x * dx + normal.y * dy + normal.z * dz;
            let own = square[i];
            // The greatest cosine of a direction to the sphere, times the square of the distance.
            let across = at_least_0(far - own).sqrt();
            let sine = at_least_0(far - up * up).sqrt();
            let tilted = up * across + own.sqrt() * sine;
            let greatest = if up < across { at_least_0(tilted) } else { far };
            let over = -(nx[i] * dx + ny[i] * dy + nz[i] * dz);
            let shown = if over < 0.0 { -over * behind[i] } else { over };
            let shown = shown / far.sqrt();
            let shown = if shown < least[i] { least[i] } else { shown };
            // What is around the face is seen in all directions.
            let is_around = !(far > own);
            let share = match &face.highlight {
                None if is_around => 1.0,
                None => greatest / far,
                Some(highlight) if is_around => highlight.share_around(),
                Some(highlight) => {
                    let distance = far.sqrt();
                    let toward = [dx / distance, dy / distance, dz / distance];
                    let share = highlight.share(toward, own / far, greatest / far);
                    if greatest > 0.0 { share } else { 0.0 }
                }
            };
            let by_place = if is_around { 1.0 / own } else { shown / far };
            light[i] = power[i] * share * by_place;
        }
        light
    }
}

#[inline(always)]
fn at_least_0(x: f32) -> f32 {
    if x > 0.0 { x } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of 0.2 m with the power 8 at a place, and the light on a floor at the origin.
    fn on_floor(at: Vec3, flat: Option<(Vec3, bool)>) -> f32 {
        let item = TreeItem {
            primitive: (0, 0),
            face: 0,
            low: at - Vec3::new(0.1, 0.0, 0.1),
            high: at + Vec3::new(0.1, 0.0, 0.1),
            area: 0.04,
            power: 8.0,
        };
        let lamps = LampLanes::of(&[item], |_| flat);
        let face = LitFace {
            position: Vec3::ZERO,
            normal: Vec3::Y,
            highlight: None,
        };
        lamps.light(0..1, &face).1
    }

    #[test]
    fn a_lamp_brings_light_by_its_distance_its_sides_and_its_tilt() {
        let above = Vec3::new(0.0, 10.0, 0.0);
        let near = |a: f32, b: f32| assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
        near(on_floor(above, Some((Vec3::NEG_Y, true))), 0.08);
        near(on_floor(above, Some((Vec3::Y, false))), 0.08);
        near(on_floor(above, Some((Vec3::Y, true))), 0.08 / 64.0);
        near(on_floor(above, None), 0.02);
        assert_eq!(on_floor(above, Some((Vec3::X, false))), 0.0);
        assert_eq!(on_floor(-above, Some((Vec3::Y, false))), 0.0);
        near(on_floor(Vec3::ZERO, None), 8.0 / 0.02);
    }
}

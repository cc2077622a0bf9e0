//! What a ray that meets nothing sees: VRML 97's `Background`, or nothing.
//!
//! Sky and ground are colors by the angle from the zenith and the nadir (6.5); the six pictures of
//! a panorama, on the sides of a cube without end, lie over them.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DQuat, Quat, Vec2, Vec3};

use super::texture::{self, Filter, Texture};
use crate::diag::Diagnostic;
use crate::grammar::{Field, vrml97_background};
use crate::iv::NodeRef;
use crate::pose::rotation_of;
use crate::traversal::state::State;

#[derive(Clone, Debug, Default)]
pub struct Background {
    /// Angle from straight up, and the color there.
    sky: Vec<(f32, Vec3)>,
    /// Angle from straight down.
    ground: Vec<(f32, Vec3)>,
    /// Back, bottom, front, left, right and top.
    pictures: [Option<Arc<Texture>>; 6],
    /// The background's own axes from the world's.
    turn: Quat,
    /// Drawn as Coin does, by [`on_rings`].
    on_rings: bool,
}

/// The directions to the middle, the right and the top of each picture, as [`texture::PANORAMA`] has
/// them.
const SIDES: [[Vec3; 3]; 6] = [
    [Vec3::Z, Vec3::NEG_X, Vec3::Y],
    [Vec3::NEG_Y, Vec3::X, Vec3::NEG_Z],
    [Vec3::NEG_Z, Vec3::X, Vec3::Y],
    [Vec3::NEG_X, Vec3::NEG_Z, Vec3::Y],
    [Vec3::X, Vec3::Z, Vec3::Y],
    [Vec3::Y, Vec3::X, Vec3::Z],
];

impl Background {
    /// The background of a node met in a state, its pictures looked for beside the scene and in
    /// folders; without folders none is read. And what was wrong with the pictures.
    pub fn of(
        node: NodeRef<'_>,
        state: &State<'_>,
        folders: Option<&[PathBuf]>,
    ) -> (Self, Vec<Box<Diagnostic>>) {
        let band = |colors: Field<[Vec3]>, angles: Field<[f32]>| -> Vec<(f32, Vec3)> {
            let at = std::iter::once(0.0).chain(node.get(angles).iter().copied());
            at.zip(node.get(colors).iter().copied()).collect()
        };
        let mut troubles = Vec::new();
        let turn: DQuat = rotation_of(state.world_from_object);
        let mut background = Self {
            sky: band(vrml97_background::SKY_COLOR, vrml97_background::SKY_ANGLE),
            ground: band(
                vrml97_background::GROUND_COLOR,
                vrml97_background::GROUND_ANGLE,
            ),
            turn: turn.conjugate().as_quat(),
            ..Self::default()
        };
        for (side, field) in texture::PANORAMA.into_iter().enumerate() {
            let decoded = folders.map(|f| texture::decode_named(node, &[field], f));
            match decoded {
                Some(Ok(picture)) => background.pictures[side] = picture.map(Arc::new),
                Some(Err(trouble)) => troubles.push(trouble),
                None => {}
            }
        }
        (background, troubles)
    }

    /// The color in a direction; black without a background.
    pub fn color(&self, direction: Vec3) -> Vec3 {
        if self.on_rings {
            let direction = direction.normalize_or(Vec3::NEG_Z);
            let ground = on_rings(&self.ground, direction, -0.9, false);
            let plain = ground.or_else(|| on_rings(&self.sky, direction, 1.0, true));
            return self.pictured(self.turn * direction, plain.unwrap_or(Vec3::ZERO));
        }
        let direction = self.turn * direction.normalize_or(Vec3::NEG_Z);
        let up = direction.y.clamp(-1.0, 1.0);
        let from_below = libm::acosf(-up);
        let plain = match self.ground.last() {
            Some((reach, _)) if from_below <= *reach => along(&self.ground, from_below),
            _ => along(&self.sky, libm::acosf(up)),
        };
        self.pictured(direction, plain)
    }

    /// Draws sky and ground as Coin does.
    pub fn set_on_rings(&mut self, on_rings: bool) {
        self.on_rings = on_rings;
    }

    /// The picture in a direction over a color.
    fn pictured(&self, direction: Vec3, plain: Vec3) -> Vec3 {
        for (picture, [middle, right, top]) in self.pictures.iter().zip(SIDES) {
            let depth = direction.dot(middle);
            if depth < direction.abs().max_element() {
                continue;
            }
            if let Some(picture) = picture {
                let across = Vec2::new(direction.dot(right), direction.dot(top)) / depth;
                let texel = picture.sample(0.5 * across + 0.5, Filter::Linear, false, false);
                return plain.lerp(texel.truncate(), texel.w);
            }
        }
        plain
    }

    pub fn is_nothing(&self) -> bool {
        self.sky.is_empty() && self.pictures.iter().all(Option::is_none)
    }
}

/// The color at an angle: straight between its neighbors, the last one beyond.
fn along(band: &[(f32, Vec3)], angle: f32) -> Vec3 {
    let above = band.partition_point(|(a, _)| *a <= angle);
    match (
        above.checked_sub(1).and_then(|i| band.get(i)),
        band.get(above),
    ) {
        (Some((a, low)), Some((b, high))) => low.lerp(*high, (angle - a) / (b - a)),
        (Some((_, color)), None) | (None, Some((_, color))) => *color,
        (None, None) => Vec3::ZERO,
    }
}

/// Where Coin's camera stands in the sphere that it draws the background on: not in the middle.
const COIN_EYE: Vec3 = Vec3::new(0.0, 0.0, 2.0 / 3.0);

/// The color in a direction on cones between rings of corners at the band's angles, on a sphere
/// of this radius, negative upside down, seen from [`COIN_EYE`]. `closed` goes on to the other
/// pole in the last color. `None` beyond the last ring.
fn on_rings(band: &[(f32, Vec3)], d: Vec3, radius: f32, closed: bool) -> Option<Vec3> {
    if let [(_, only)] = band {
        return closed.then_some(*only);
    }
    let end = band
        .last()
        .filter(|_| closed)
        .map(|l| (std::f32::consts::PI, l.1));
    let rings: Vec<(f32, Vec3)> = band.iter().copied().chain(end).collect();
    rings.windows(2).find_map(|pair| {
        let place =
            |angle: f32| Vec2::new(radius.abs() * libm::sinf(angle), radius * libm::cosf(angle));
        let share = across_cone(place(pair[0].0), place(pair[1].0), d)?;
        Some(pair[0].1.lerp(pair[1].1, share))
    })
}

/// How far between two circles, each by its radius and height, a ray from [`COIN_EYE`] meets the
/// cone between them.
fn across_cone(a: Vec2, b: Vec2, d: Vec3) -> Option<f32> {
    let (eye, slope) = (COIN_EYE, (b.x - a.x) / (b.y - a.y));
    if !slope.is_finite() {
        return None;
    }
    // The radius at a height y is `base` + `slope` y.
    let base = a.x - slope * a.y;
    let (k, m) = (base + slope * eye.y, slope * d.y);
    let (qa, qb) = (
        d.x * d.x + d.z * d.z - m * m,
        eye.x * d.x + eye.z * d.z - k * m,
    );
    let root = (qb * qb - qa * (eye.x * eye.x + eye.z * eye.z - k * k)).sqrt();
    [(-qb - root) / qa, (-qb + root) / qa]
        .into_iter()
        .filter(|&t| t > 0.0 && k + m * t >= 0.0)
        .map(|t| (eye.y + t * d.y - a.y) / (b.y - a.y))
        .find(|share| (0.0..=1.0).contains(share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Result;
    use crate::iv::{Document, Limits, Loader};

    #[test]
    fn the_sky_turns_from_one_color_to_the_next() {
        let quarter = std::f32::consts::FRAC_PI_2;
        let sky = Background {
            sky: vec![(0.0, Vec3::ZERO), (quarter, Vec3::ONE)],
            ..Background::default()
        };
        assert_eq!(sky.color(Vec3::Y), Vec3::ZERO);
        let half = sky.color(Vec3::new(1.0, 1.0, 0.0));
        assert!((half.x - 0.5).abs() < 1e-5);
        assert_eq!(sky.color(Vec3::NEG_Y), Vec3::ONE);
    }

    #[test]
    fn from_coin_s_eye_the_horizon_is_level_and_the_sky_ahead_is_lower() {
        let (quarter, half) = (std::f32::consts::FRAC_PI_2, std::f32::consts::PI);
        let sky = [(0.0, Vec3::ZERO), (quarter, Vec3::ONE), (half, Vec3::ZERO)];
        let at = |d: Vec3| on_rings(&sky, d.normalize(), 1.0, false).map(|c| c.x);
        assert!(at(Vec3::NEG_Z).is_some_and(|x| (x - 1.0).abs() < 1e-3));
        // Straight up from the eye the cone x + y = 1 is met where y is a third.
        assert!(at(Vec3::Y).is_some_and(|x| (x - 2.0 / 3.0).abs() < 1e-5));
    }

    /// A picture of one row, red on the left and of a blue that its name says on the right.
    #[derive(Debug)]
    struct Painter;

    impl Loader for Painter {
        fn load(&self, _: &str, name: &str) -> Result<(String, Vec<u8>)> {
            let picture = format!("P3 2 1 255 255 0 0 0 0 {name}");
            Ok((name.to_owned(), picture.into_bytes()))
        }
    }

    #[test]
    fn the_six_pictures_are_the_right_way_round_seen_from_inside() {
        let text = "#VRML V2.0 utf8\nBackground { frontUrl \"1\" backUrl \"2\" leftUrl \"3\"
            rightUrl \"4\" topUrl \"5\" bottomUrl \"6\" }";
        let document = Document::read("a.wrl", text.into(), Arc::new(Painter), &Limits::default())
            .expect("reads");
        let node = document.roots().next().expect("a root");
        let (all, troubles) = Background::of(node, &State::new(false, true), Some(&[]));
        assert!(troubles.is_empty());
        // Turning the head from the front to the right, to the back and to the left, the right
        // half of each picture comes first from the left; up and down keep right where it is.
        let rights = [
            (Vec3::new(0.9, 0.0, -1.0), 1),
            (Vec3::new(1.0, 0.0, 0.9), 4),
            (Vec3::new(-0.9, 0.0, 1.0), 2),
            (Vec3::new(-1.0, 0.0, -0.9), 3),
            (Vec3::new(0.9, 1.0, 0.0), 5),
            (Vec3::new(0.9, -1.0, 0.0), 6),
        ];
        for (direction, blue) in rights {
            let color = all.color(direction) * 255.0;
            assert!(
                (color - Vec3::new(0.0, 0.0, blue as f32)).length() < 1e-3,
                "{direction}"
            );
        }
        assert_eq!(all.color(Vec3::new(-0.9, 0.0, -1.0)), Vec3::X);
    }
}

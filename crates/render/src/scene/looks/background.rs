//! The background, which rays without a hit see: VRML 97's `Background`, or black.
//!
//! The colors of sky and ground depend on the angle from the zenith and the nadir (6.5). The six
//! pictures of a panorama cover them, on the sides of an infinitely large cube.

use std::sync::Arc;

use glam::{DQuat, Quat, Vec2, Vec3};
use ivcam_base::diag::Diagnostic;
use ivcam_base::memory::MemoryBudget;
use ivcam_inventor::grammar::{Field, vrml97_background};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::pose::orientation_in;
use ivcam_inventor::traversal::state::State;

use super::texture::{Repeat, Texture};
use super::texture_files::{PANORAMA, TextureFiles};
use crate::scene::options::{ColorCoding, TextureFilter};

/// The background of a scene. Without a `Background` node it is black.
#[derive(Clone, Debug, Default)]
pub struct Background {
    /// Angles from the zenith in radians, with their colors.
    sky: Vec<(f32, Vec3)>,
    /// Angles from the nadir in radians, with their colors.
    ground: Vec<(f32, Vec3)>,
    /// The pictures in the order of [`PANORAMA`].
    pictures: [Option<Arc<Texture>>; 6],
    /// The rotation from world space to the background's space.
    turn: Quat,
}

/// The directions to the center, the right and the top of each picture, in the order of
/// [`PANORAMA`].
const SIDES: [[Vec3; 3]; 6] = [
    [Vec3::Z, Vec3::NEG_X, Vec3::Y],
    [Vec3::NEG_Y, Vec3::X, Vec3::NEG_Z],
    [Vec3::NEG_Z, Vec3::X, Vec3::Y],
    [Vec3::NEG_X, Vec3::NEG_Z, Vec3::Y],
    [Vec3::X, Vec3::Z, Vec3::Y],
    [Vec3::Y, Vec3::X, Vec3::Z],
];

impl Background {
    /// Returns the background of a node in light, and the diagnostics of its pictures. Pictures are
    /// searched as those of textures; if `files` is `None` no picture is read.
    pub(crate) fn of(
        node: NodeRef<'_>,
        state: &State<'_>,
        colors: ColorCoding,
        mut files: Option<(&mut TextureFiles, &mut MemoryBudget)>,
    ) -> (Self, Vec<Box<Diagnostic>>) {
        let band = |colors: Field<[Vec3]>, angles: Field<[f32]>| -> Vec<(f32, Vec3)> {
            let at = std::iter::once(0.0).chain(node.get(angles).iter().copied());
            at.zip(node.get(colors).iter().copied()).collect()
        };
        let mut diagnostics = Vec::new();
        let turn = orientation_in(state.world_from_object, DQuat::IDENTITY);
        let mut background = Self {
            sky: band(vrml97_background::SKY_COLOR, vrml97_background::SKY_ANGLE),
            ground: band(
                vrml97_background::GROUND_COLOR,
                vrml97_background::GROUND_ANGLE,
            ),
            turn: turn.conjugate().as_quat(),
            ..Self::default()
        };
        for (side, field) in PANORAMA.into_iter().enumerate() {
            let decoded = files
                .as_mut()
                .map(|(files, memory)| files.of_fields(node, &[field], colors, memory));
            match decoded {
                Some(Ok(picture)) => background.pictures[side] = picture,
                Some(Err(diagnostic)) => diagnostics.push(diagnostic),
                None => {}
            }
        }
        (background.into_light(colors), diagnostics)
    }

    /// Returns a background of one color.
    pub(crate) fn plain(color: Vec3) -> Self {
        Self {
            sky: vec![(0.0, color)],
            ..Self::default()
        }
    }

    /// Returns the background with the colors of its bands decoded to light, if `colors` says that
    /// they are levels of a display. Its pictures are decoded as they are read.
    pub(in crate::scene) fn into_light(mut self, colors: ColorCoding) -> Self {
        let bands = self.sky.iter_mut().chain(&mut self.ground);
        bands.for_each(|(_, color)| *color = colors.light(*color));
        self
    }

    /// Returns whether the scene or the options have a background, be it black.
    pub(crate) fn is_stated(&self) -> bool {
        let is_plain = self.sky.is_empty() && self.ground.is_empty();
        !is_plain || self.pictures.iter().any(Option::is_some)
    }

    /// Returns whether the color is black in every direction.
    pub fn is_black(&self) -> bool {
        let mut colors = self.sky.iter().chain(&self.ground);
        colors.all(|(_, color)| *color == Vec3::ZERO) && self.pictures.iter().all(Option::is_none)
    }

    /// Returns the color of every direction, or `None` if the color depends on the direction.
    fn uniform(&self) -> Option<Vec3> {
        let has_picture = self.pictures.iter().any(Option::is_some);
        match self.sky[..] {
            _ if has_picture || !self.ground.is_empty() => None,
            [] => Some(Vec3::ZERO),
            [(_, color)] => Some(color),
            _ => None,
        }
    }

    /// The color in a direction.
    pub(crate) fn color(&self, direction: Vec3) -> Vec3 {
        if let Some(color) = self.uniform() {
            return color;
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

    /// The color of the picture in a direction, composited over a color.
    fn pictured(&self, direction: Vec3, plain: Vec3) -> Vec3 {
        for (picture, [middle, right, top]) in self.pictures.iter().zip(SIDES) {
            let depth = direction.dot(middle);
            if depth < direction.abs().max_element() {
                continue;
            }
            if let Some(picture) = picture {
                let across = Vec2::new(direction.dot(right), direction.dot(top)) / depth;
                let texel = picture.sample(0.5 * across + 0.5, TextureFilter::Linear, Repeat::NONE);
                return plain.lerp(texel.truncate(), texel.w);
            }
        }
        plain
    }
}

/// The color at an angle, interpolated between its neighbors. Beyond the last angle it is the last
/// color.
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

#[cfg(test)]
mod tests {
    use super::*;
    use ivcam_base::diag::Result;
    use ivcam_inventor::iv::{Document, Limits, Loader};
    use ivcam_inventor::traversal::state::Language;

    #[test]
    fn the_sky_is_interpolated_between_its_colors() {
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

    /// Loads pictures of one row: red on the left, and on the right the blue level in the file
    /// name.
    #[derive(Debug)]
    struct Painter;

    impl Loader for Painter {
        fn load(&self, _: &str, name: &str) -> Result<(String, Vec<u8>)> {
            let picture = format!("P3 2 1 255 255 0 0 0 0 {name}");
            Ok((name.to_owned(), picture.into_bytes()))
        }
    }

    #[test]
    fn the_six_pictures_are_upright_and_not_mirrored_from_inside() {
        let text = "#VRML V2.0 utf8\nBackground { frontUrl \"1\" backUrl \"2\" leftUrl \"3\"
            rightUrl \"4\" topUrl \"5\" bottomUrl \"6\" }";
        let document = Document::read("a.wrl", text.into(), Arc::new(Painter), &Limits::default())
            .expect("reads");
        let node = document.roots().next().expect("a root");
        let (all, diagnostics) = Background::of(
            node,
            &State::new(Language::Vrml97),
            ColorCoding::Levels,
            Some((
                &mut TextureFiles::default(),
                &mut MemoryBudget::of_machine(),
            )),
        );
        assert!(diagnostics.is_empty());
        // Each direction is toward the right half of a side picture, or of the top and bottom ones.
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

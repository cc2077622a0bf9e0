//! The side from which a photograph shows a whole scene, and the color behind it.

use glam::{DVec3, Vec3};
use ivcam_inventor::pose::{CameraPose, UpAxis, ViewDirection};
use ivcam_render::bvh::Ray;
use ivcam_render::camera::Camera;
use ivcam_render::scene::RenderScene;

/// The rays across and down that tell how much of a scene a camera sees.
const GRID: (u32, u32) = (72, 48);
/// The share of the picture below which it shows next to nothing: 17 of 3,456 rays. A line of one
/// pixel across the picture of 1999 covers as much.
const NEXT_TO_NOTHING: f64 = 0.005;

/// A choice that a plan makes against what the scene states, or only for what it does not state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Override<T> {
    /// The choice replaces what the scene states.
    Always(T),
    /// The scene goes first.
    IfUnstated(T),
}

impl<T> Override<T> {
    /// Parses the word of an option: a value, or `else:` and a value.
    pub(super) fn parse(word: &str, value: impl Fn(&str) -> Option<T>) -> Option<Self> {
        match word.strip_prefix("else:") {
            Some(rest) => value(rest).map(Self::IfUnstated),
            None => value(word).map(Self::Always),
        }
    }

    /// Returns the word that [`Override::parse`] reads.
    pub(super) fn word(self, value: impl Fn(T) -> String) -> String {
        match self {
            Self::Always(own) => value(own),
            Self::IfUnstated(own) => format!("else:{}", value(own)),
        }
    }
}

/// A view of a whole scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WholeView {
    /// From a side, from which all of it is in the picture.
    Side(ViewDirection),
    /// What a viewer of the 1990s shows of a scene without a camera: VRML97's default `Viewpoint`,
    /// or else all of it from the front.
    Standard,
}

impl WholeView {
    /// Returns the view of a name.
    pub(super) fn named(text: &str) -> Option<Self> {
        match text {
            "standard" => Some(Self::Standard),
            side => ViewDirection::named(side).map(Self::Side),
        }
    }

    /// Returns the name of the view.
    pub(super) fn name(self) -> String {
        match self {
            Self::Side(side) => side.name(),
            Self::Standard => "standard".into(),
        }
    }
}

/// The background of pictures of folders, where the scene has none: white and black lines and the
/// gray of the default material stand out from it.
pub(crate) const NEUTRAL: Vec3 = Vec3::splat(0.4);

/// The names of colors that `--background` accepts.
const COLORS: [(&str, Vec3); 4] = [
    ("black", Vec3::ZERO),
    ("white", Vec3::ONE),
    ("gray", Vec3::splat(0.5)),
    ("neutral", NEUTRAL),
];

/// Parses a color: a name, `#rrggbb`, or three numbers from 0 to 1 with commas between them.
pub(super) fn parse_color(word: &str) -> Option<Vec3> {
    if let Some((_, color)) = COLORS.into_iter().find(|(name, _)| *name == word) {
        return Some(color);
    }
    if let Some(digits) = word.strip_prefix('#') {
        let is_hex = digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit());
        let number = u32::from_str_radix(digits, 16).ok().filter(|_| is_hex)?;
        let [_, r, g, b] = number.to_be_bytes().map(|level| f32::from(level) / 255.0);
        return Some(Vec3::new(r, g, b));
    }
    let parts: Option<Vec<f32>> = word
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect();
    match parts?[..] {
        [r, g, b] if [r, g, b].iter().all(|x| (0.0..=1.0).contains(x)) => Some(Vec3::new(r, g, b)),
        _ => None,
    }
}

/// Returns the word that [`parse_color`] reads as a color.
pub(super) fn color_word(color: Vec3) -> String {
    let named = COLORS.into_iter().find(|(_, known)| *known == color);
    named.map_or_else(
        || format!("{},{},{}", color.x, color.y, color.z),
        |(name, _)| name.to_owned(),
    )
}

/// Returns the side that shows most of a scene, if the camera, which looks at the whole scene from
/// the front, shows next to nothing of it.
pub(super) fn better_side(
    scene: &RenderScene,
    camera: &Camera,
    pose: &CameraPose,
) -> Option<ViewDirection> {
    let (low, high) = scene.bounds()?;
    let middle = scene.origin + (0.5 * (low + high)).as_dvec3();
    let front = share_seen(scene, camera);
    if front >= NEXT_TO_NOTHING {
        return None;
    }
    let shares = ViewDirection::NAMED[1..].iter().map(|(_, side)| {
        let side = *side;
        let there = pose.clone().turned_around(middle, side);
        let share = share_seen(scene, &camera.clone().posed(&there, scene.origin));
        (side, share)
    });
    let (side, share) = shares.reduce(|best, next| if next.1 > best.1 { next } else { best })?;
    (share >= NEXT_TO_NOTHING && share > 4.0 * front).then_some(side)
}

/// The share of what a camera sees that has to be a photograph seen from behind, and the share of
/// it that may be after the camera has gone to the other side. A panorama of 388 patches and a
/// wedge have all and nothing.
const BEHIND: [f32; 2] = [0.95, 0.05];

/// Returns the side from which the photographs on a scene's surfaces are not mirrored, if the
/// camera, which looks at the whole scene from the front, sees them from behind: with z down, as in
/// the frames of rovers' sites, the front is below the ground.
///
/// The camera stands where those of the photographs stood: what is up in them is away from it.
pub(super) fn photographed_side(
    scene: &RenderScene,
    camera: &Camera,
    pose: &CameraPose,
) -> Option<ViewDirection> {
    let (low, high) = scene.bounds()?;
    let seen = photographs(scene, camera)?;
    let facing = seen.facing.as_dvec3().normalize_or_zero();
    if seen.mirrored < BEHIND[0] || facing.z > -0.7 {
        return None;
    }
    let upward = seen.upward.as_dvec3();
    let level = DVec3::new(upward.x, upward.y, 0.0);
    let up = UpAxis::MinusZ;
    let away = up.rotation().inverse() * level;
    let azimuth = match level.length() > 0.2 {
        true => libm::atan2(-away.x, -away.z).to_degrees().round(),
        false => ViewDirection::THREE_QUARTER.azimuth,
    };
    let side = ViewDirection {
        up,
        ..ViewDirection::new(azimuth + 0.0, ViewDirection::THREE_QUARTER.elevation)
    };
    let middle = scene.origin + (0.5 * (low + high)).as_dvec3();
    let there = pose.clone().turned_around(middle, side);
    let again = photographs(scene, &camera.clone().posed(&there, scene.origin))?;
    (again.mirrored <= BEHIND[1]).then_some(side)
}

/// What a camera sees of the photographs on surfaces.
struct SeenPhotographs {
    /// The share of the surfaces that it sees whose photograph is mirrored.
    mirrored: f32,
    /// The mean direction toward which photographs face, of length 1 if all have the same.
    facing: Vec3,
    /// The mean direction along surfaces that is up in photographs.
    upward: Vec3,
}

/// Looks at the photographs on surfaces. Returns `None` if there are none.
fn photographs(scene: &RenderScene, camera: &Camera) -> Option<SeenPhotographs> {
    let (mut seen, mut count, mut mirrored) = (0.0_f32, 0.0_f32, 0.0_f32);
    let (mut facing, mut upward) = (Vec3::ZERO, Vec3::ZERO);
    for ray in rays_over(camera, GRID, &[[0.5; 2]]) {
        let Some(hit) = scene.hit(&ray) else { continue };
        seen += 1.0;
        if let Some([outward, up]) = scene.photograph_at(&hit) {
            count += 1.0;
            mirrored += f32::from(u8::from(outward.dot(ray.direction) > 0.0));
            facing += outward;
            upward += up;
        }
    }
    (count > 0.0).then(|| SeenPhotographs {
        mirrored: mirrored / seen,
        facing: facing / count,
        upward: upward / count,
    })
}

/// Returns the share of the picture in which a camera sees a surface.
fn share_seen(scene: &RenderScene, camera: &Camera) -> f64 {
    let rays = rays_over(camera, GRID, &[[0.5; 2]]);
    let seen = rays.filter(|ray| scene.hit(ray).is_some());
    seen.count() as f64 / f64::from(GRID.0 * GRID.1)
}

/// Returns rays from the middles of the cells of a grid over the picture. Each passes the first of
/// some points of the lens that lets it through; places without such a point have no ray.
pub(super) fn rays_over(
    camera: &Camera,
    (columns, rows): (u32, u32),
    pupil: &[[f64; 2]],
) -> impl Iterator<Item = Ray> {
    let places = (0..rows).flat_map(move |row| (0..columns).map(move |column| (row, column)));
    places.filter_map(move |(row, column)| {
        let x = (f64::from(column) + 0.5) / f64::from(columns);
        let y = (f64::from(row) + 0.5) / f64::from(rows);
        let at = camera.at(x, y);
        let ray = pupil.iter().find_map(|point| at.ray(*point))?;
        Some(Ray::new(ray.origin.as_vec3(), ray.direction.as_vec3()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_color_is_read_by_name_by_digits_and_by_numbers() {
        let orange = Vec3::new(1.0, 128.0 / 255.0, 0.0);
        for (word, color) in [
            ("white", Some(Vec3::ONE)),
            ("#ff8000", Some(orange)),
            ("1, 0.25,0", Some(Vec3::new(1.0, 0.25, 0.0))),
            ("1,2,0", None),
            ("#ff80", None),
            ("#+f8000", None),
            ("puce", None),
            ("0,0", None),
        ] {
            assert_eq!(parse_color(word), color, "{word}");
            if let Some(color) = color {
                assert_eq!(parse_color(&color_word(color)), Some(color));
            }
        }
    }
}

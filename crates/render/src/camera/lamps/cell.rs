//! The lamps that a part of the film may see out of focus.
//!
//! The rays from a film point through the pupil make a cone, or a double cone where they cross in
//! the plane in focus. Across the direction to a lamp it is the pupil's image by a linear map,
//! which a few rays of the cell's middle show. Where the cone is much wider than a lamp, plain
//! samples hit it seldom, so it is listed. What the linear map says wrongly costs noise, and no
//! light.

use glam::{DMat2, DVec2, DVec3};
use ivcam_optics::lens::{Bundle, Lens, LensRay, PupilTarget, PupilWindow};

use super::meeting::FacingPlane;
use crate::camera::lens_camera::LensCamera;
use crate::scene::{Emitters, LampNode, LampRange};

/// The radius of a listed node's sphere over that of the cone, at most.
const SMALL: f64 = 0.5;
/// The margin of the pupil's radius, because the cone is not quite linear.
const MARGIN: f64 = 1.15;
/// A cell lists its lamps only if their mean square brightness in the cone is more than this times
/// the square of the mean: if fewer than a quarter of plain samples would hit an even lamp.
const WORTHWHILE: f64 = 4.0;
/// The largest number of nodes that a cell lists. Of more, the brightest are.
const MOST_LISTED: usize = 256;
/// The largest number of nodes that are examined for a cell. What is left is found by chance.
const MOST_EXAMINED: usize = 1 << 14;
/// The number of points of a pupil, along each side of the unit square, that tell its size.
const GRID: u32 = 8;

/// The lamps that a cell of the film may see out of focus, by the order of their leaves.
#[derive(Clone, Debug, Default)]
pub(super) struct LampCell {
    /// The middle of the cell, in millimeters from the film's middle.
    film: DVec2,
    /// The middle of the pupil as seen from there, on the rear vertex plane.
    middle: DVec2,
    /// The pupil's radius in millimeters.
    pub radius: f64,
    listed: Vec<Listed>,
}

/// Some lamps that are close together.
#[derive(Clone, Copy, Debug)]
struct Listed {
    range: LampRange,
    /// The center of their sphere, in lens space.
    center: DVec3,
    /// The aim from the cell's middle whose ray meets the center.
    aim: DVec2,
    /// Its derivative by the film point.
    by_film: DMat2,
    /// Its derivative by the point that is met: the rows.
    by_point: [DVec3; 2],
    /// The square of the distance of the aim from the pupil's middle, up to which the lamps may be
    /// seen.
    reach: f64,
    /// Their expected light.
    weight: f64,
}

/// Lamps that were chosen for a film point.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChosenLamps {
    pub range: LampRange,
    /// The probability of the choice.
    pub probability: f64,
    number: usize,
}

impl LampCell {
    /// Lists the lamps for the film points within `half` of a point, in millimeters.
    pub(super) fn around(
        film: DVec2,
        half: DVec2,
        camera: &LensCamera,
        (lens, target): (&Lens, &PupilTarget),
        emitters: &Emitters,
    ) -> Self {
        let Some(cone) = Cone::of(film, half, camera, (lens, target)) else {
            return Self::default();
        };
        let mut this = Self {
            film,
            middle: cone.middle,
            radius: cone.radius,
            listed: Vec::new(),
        };
        this.list(&cone, camera, emitters);
        this
    }

    /// Whether no lamp is listed.
    pub(super) fn is_empty(&self) -> bool {
        self.listed.is_empty()
    }

    fn list(&mut self, cone: &Cone, camera: &LensCamera, emitters: &Emitters) {
        let tree = emitters.tree();
        let mut open: Vec<LampRange> = tree.root().into_iter().collect();
        let mut examined = 0;
        let [mut mean, mut square] = [0.0; 2];
        while let Some(range) = open.pop() {
            examined += 1;
            if examined > MOST_EXAMINED {
                break;
            }
            match cone.look(range, tree.node(range), camera) {
                Look::Outside => {}
                Look::Large => open.extend(range.halves().into_iter().flatten()),
                Look::Small(listed, wide) => {
                    let node = tree.node(range);
                    let [area, power] = [node.area, node.power].map(f64::from);
                    // A closed surface shows a quarter of its area.
                    let share = 0.25 * area * 1e6 / (std::f64::consts::PI * wide * wide);
                    mean += share * power / area;
                    square += share * (power / area).powi(2);
                    self.listed.push(listed);
                }
            }
        }
        if !(square > WORTHWHILE * mean * mean) {
            self.listed.clear();
        }
        if self.listed.len() > MOST_LISTED {
            self.listed.sort_by(|a, b| b.weight.total_cmp(&a.weight));
            self.listed.truncate(MOST_LISTED);
        }
        self.listed
            .sort_by_key(|listed| listed.range.leaves().start);
    }

    /// The listed lamps that a film point may see, and the sum of their weights up to each.
    fn seen(&self, film: DVec2) -> impl Iterator<Item = (usize, f64)> + '_ {
        let mut sum = 0.0;
        let listed = self.listed.iter().enumerate();
        listed.filter_map(move |(number, listed)| {
            let aim = listed.aim + listed.by_film * (film - self.film);
            let is_seen = aim.distance_squared(self.middle) <= listed.reach;
            sum += if is_seen { listed.weight } else { 0.0 };
            is_seen.then_some((number, sum))
        })
    }

    fn chosen(&self, number: usize, total: f64) -> ChosenLamps {
        let Listed { range, weight, .. } = self.listed[number];
        ChosenLamps {
            range,
            probability: weight / total,
            number,
        }
    }

    /// Chooses among the lamps that a film point may see, by a number from 0 to 1. Returns the
    /// choice and a number from 0 to 1 that does not depend on it.
    pub(super) fn choose(&self, film: DVec2, u: f64) -> Option<(ChosenLamps, f64)> {
        let (_, total) = self.seen(film).last()?;
        let (number, end) = self.seen(film).find(|(_, end)| u * total < *end)?;
        let chosen = self.chosen(number, total);
        let rest = 1.0 - (end - u * total) / self.listed[number].weight;
        Some((chosen, rest.clamp(0.0, 1.0)))
    }

    /// The choice that leads to a leaf, for a film point that may see it.
    pub(super) fn choice_of(&self, film: DVec2, leaf: u32) -> Option<ChosenLamps> {
        let after = self
            .listed
            .partition_point(|listed| listed.range.leaves().start <= leaf);
        let number = after.checked_sub(1)?;
        if !self.listed[number].range.leaves().contains(&leaf) {
            return None;
        }
        let (_, total) = self.seen(film).last()?;
        self.seen(film).find(|(seen, _)| *seen == number)?;
        Some(self.chosen(number, total))
    }

    /// About the aim of the ray that meets a point of chosen lamps, in lens space.
    pub(super) fn start(&self, film: DVec2, chosen: &ChosenLamps, point: DVec3) -> DVec2 {
        let listed = &self.listed[chosen.number];
        let off = point - listed.center;
        let by_point = listed.by_point.map(|row| row.dot(off));
        let aim = listed.aim + listed.by_film * (film - self.film) + DVec2::from(by_point);
        self.middle + (aim - self.middle).clamp_length_max(self.radius)
    }
}

/// What a cone is to a node.
enum Look {
    Outside,
    /// The node is not small beside the cone.
    Large,
    /// The node is small, and the cone has a radius there, in millimeters.
    Small(Listed, f64),
}

/// The rays of a film cell, in lens space.
struct Cone {
    /// Half the size of the cell, in millimeters.
    half: DVec2,
    middle: DVec2,
    radius: f64,
    /// The ray of the middle, pairs of rays whose aims differ by the pupil's radius in x and y, and
    /// pairs whose film points differ by the cell's size.
    rays: [LensRay; 9],
}

impl Cone {
    /// The cone of a cell; `None` if no light reaches the cell's middle.
    fn of(
        film: DVec2,
        half: DVec2,
        camera: &LensCamera,
        (lens, target): (&Lens, &PupilTarget),
    ) -> Option<Self> {
        let (middle, radius) = size_of(&target.window(film))?;
        let [x, y] = [DVec2::X, DVec2::Y];
        let aside = |by: DVec2| camera.ray_to(film, middle + 0.5 * radius * by);
        let beside = |by: DVec2| camera.ray_to(film + half * by, middle);
        let rays = [
            aside(DVec2::ZERO),
            aside(x),
            aside(-x),
            aside(y),
            aside(-y),
            beside(x),
            beside(-x),
            beside(y),
            beside(-y),
        ];
        let mut bundle = Bundle::default();
        for (lane, ray) in rays.iter().enumerate() {
            bundle.set(lane, ray);
        }
        lens.trace_bundle_unblocked(&mut bundle);
        let all = (1 << rays.len()) - 1;
        let cone = Self {
            half,
            middle,
            radius,
            rays: std::array::from_fn(|lane| bundle.ray(lane)),
        };
        let is_whole = bundle.through() & all == all;
        is_whole.then_some(cone)
    }

    fn look(&self, range: LampRange, node: &LampNode, camera: &LensCamera) -> Look {
        let (center, radius) = node.sphere();
        let center = camera.lens_point(center.as_dvec3());
        let radius = f64::from(radius) * 1e3;
        if center.length() < 2.0 * radius {
            // The directions toward it differ too much for one plane.
            return Look::Large;
        }
        let Some(plane) = FacingPlane::through(center) else {
            return Look::Large;
        };
        let crossings = self.rays.each_ref().map(|ray| plane.crossing(ray));
        let [
            Some(at),
            Some(right),
            Some(left),
            Some(up),
            Some(down),
            Some(east),
            Some(west),
            Some(north),
            Some(south),
        ] = crossings
        else {
            return Look::Outside;
        };
        let by_aim = DMat2::from_cols(right - left, up - down) * (1.0 / self.radius);
        let by_cell = DMat2::from_cols(east - west, north - south) * 0.5;
        let size = |m: DMat2| (m.x_axis.length_squared() + m.y_axis.length_squared()).sqrt();
        // A ray at up to 30° to the normal crosses the plane at most 1.2 times as far from the
        // center as it passes by it.
        let near = MARGIN * self.radius * size(by_aim) + 1.2 * radius + size(by_cell);
        if at.length() > near {
            return Look::Outside;
        }
        let wide = self.radius * by_aim.determinant().abs().sqrt();
        if !(radius <= SMALL * wide) {
            return Look::Large;
        }
        let inverse = by_aim.inverse();
        let by_film = DMat2::from_diagonal(self.half.recip());
        let reach = MARGIN * self.radius + radius * size(inverse);
        let [x, y] = plane.axes;
        let row = |k: usize| inverse.row(k).x * x + inverse.row(k).y * y;
        let listed = Listed {
            range,
            center,
            aim: self.middle - inverse * at,
            by_film: inverse * by_cell * by_film * -1.0,
            by_point: [row(0), row(1)],
            reach: reach * reach,
            weight: f64::from(node.power) / by_aim.determinant().abs(),
        };
        Look::Small(listed, wide)
    }
}

/// The middle of a window on the rear vertex plane and its radius, in millimeters; `None` if it is
/// closed.
fn size_of(window: &PupilWindow<'_>) -> Option<(DVec2, f64)> {
    if window.is_closed() {
        return None;
    }
    let side = |i: u32| (f64::from(i) + 0.5) / f64::from(GRID);
    let places = (0..GRID * GRID).map(|i| window.point(side(i % GRID), side(i / GRID)));
    let points: Vec<DVec2> = places.collect();
    let middle = points.iter().sum::<DVec2>() / points.len() as f64;
    let far = points
        .iter()
        .map(|p| p.distance(middle))
        .fold(0.0, f64::max);
    Some((middle, far)).filter(|(_, far)| *far > 0.0)
}

//! Divides round shapes into polygons: as Inventor programs do, for drawing their edges or
//! vertices, or to a given error, for files of triangles.
//!
//! Inventor's numbers of polygons are Coin's: a sphere at complexity 1 has 30 slices and 29 stacks,
//! and cylinders and cones have 40 sides. At complexity 0 there are 4 slices, 2 stacks and 4 sides.
//! A mesh begins at the back (−z) and continues toward the left (−x).

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec2};

use super::corner::Corner;
use super::quadric::QuadricKind;

/// A circle about the y axis.
struct Ring {
    radius: f64,
    y: f64,
    /// The components of the normal away from the axis and along it.
    normal: [f64; 2],
    /// The texture coordinate t.
    t: f64,
}

/// The numbers of polygons of round surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fineness {
    /// The sides of a cylinder, a cone, a zone and a disc.
    pub sides: usize,
    /// The sides of a sphere's rings.
    pub slices: usize,
    /// The number of bands between the poles of a sphere.
    pub stacks: usize,
    /// The number of bands between the rims of a zone.
    pub bands: usize,
}

impl Fineness {
    /// Coin's numbers at a complexity.
    pub(crate) fn of_complexity(complexity: f32) -> Self {
        let steps =
            |most: f32, least: usize| ((most * complexity.clamp(0.0, 1.0)) as usize).max(least);
        Self {
            sides: steps(40.0, 4),
            slices: steps(30.0, 4),
            stacks: steps(30.0, 3) - 1,
            bands: 8,
        }
    }

    /// The numbers for which no triangle is farther from the surface than `error` times its radius.
    ///
    /// A chord of a circle with n sides is 1 − cos(π/n) inside it. On a sphere the distances along
    /// the two directions add up, so each may be half of the error. The numbers are multiples of 4,
    /// so that corners touch the bounding box of the surface.
    pub(crate) fn within(error: f64) -> Self {
        let around = |error: f64| {
            let sides = PI / libm::acos(1.0 - error.clamp(1e-7, 0.3));
            4 * (sides / 4.0).ceil() as usize
        };
        let (sides, slices) = (around(error), around(0.5 * error));
        Self {
            sides,
            slices,
            stacks: slices / 2,
            bands: sides,
        }
    }
}

/// Returns the polygons of a surface, each counterclockwise as seen from outside.
pub(crate) fn facets(kind: QuadricKind, fineness: Fineness, material: u32) -> Vec<Vec<Corner>> {
    let sides = fineness.sides;
    let corner = |ring: &Ring, i: f64, sides: usize| corner(ring, i / sides as f64, material);
    match kind {
        QuadricKind::Sphere { radius } => {
            let (slices, stacks) = (fineness.slices, fineness.stacks);
            let ring = |j: usize| {
                let angle = PI * j as f64 / stacks as f64;
                let (sin, cos) = (libm::sin(angle), libm::cos(angle));
                Ring {
                    radius: if j == stacks { 0.0 } else { radius * sin },
                    y: radius * cos,
                    normal: [sin, cos],
                    t: 1.0 - j as f64 / stacks as f64,
                }
            };
            let rings: Vec<Ring> = (0..=stacks).map(ring).collect();
            between(&rings, slices, &corner)
        }
        QuadricKind::CylinderSide {
            radius,
            half_height,
        } => {
            let ring = |t: f64| Ring {
                radius,
                y: half_height * (2.0 * t - 1.0),
                normal: [1.0, 0.0],
                t,
            };
            between(&[ring(1.0), ring(0.0)], sides, &corner)
        }
        QuadricKind::ConeSide {
            radius,
            half_height,
        } => {
            let normal = [2.0 * half_height, radius];
            let ring = |radius: f64, t: f64| Ring {
                radius,
                y: half_height * (2.0 * t - 1.0),
                normal,
                t,
            };
            between(&[ring(0.0, 1.0), ring(radius, 0.0)], sides, &corner)
        }
        QuadricKind::Zone {
            curvature,
            inner,
            outer,
        } => {
            let bands = fineness.bands;
            let off = |j: usize| inner + (outer - inner) * j as f64 / bands as f64;
            let rings: Vec<Ring> = (0..=bands).map(|j| zone_ring(curvature, off(j))).collect();
            between(&rings, sides, &corner)
        }
        QuadricKind::Disc { radius, y, up } => disc(radius, y, up, sides, material),
    }
}

/// Returns the ring of a zone at a distance from the axis.
fn zone_ring(curvature: f64, off: f64) -> Ring {
    let square = (1.0 - (curvature * off) * (curvature * off)).max(0.0);
    Ring {
        radius: off,
        y: curvature * off * off / (1.0 + square.sqrt()),
        normal: [-curvature * off, square.sqrt()],
        t: 0.5,
    }
}

/// Returns a disc as a fan about its first corner. The texture is upright as seen from outside.
fn disc(radius: f64, y: f64, up: bool, sides: usize, material: u32) -> Vec<Vec<Corner>> {
    let ring = Ring {
        radius,
        y,
        normal: [0.0, if up { 1.0 } else { -1.0 }],
        t: 0.0,
    };
    let rim = |i: usize| {
        let i = if up { i } else { sides - 1 - i };
        let mut corner = corner(&ring, i as f64 / sides as f64, material);
        let p = corner.position / radius as f32;
        corner.coordinates = 0.5 + 0.5 * Vec2::new(p.x, if up { -p.z } else { p.z });
        corner
    };
    (2..sides)
        .map(|i| vec![rim(0), rim(i - 1), rim(i)])
        .collect()
}

/// Returns the corner of a ring at a fraction of the full turn.
fn corner(ring: &Ring, turn: f64, material: u32) -> Corner {
    let out = DVec3::new(-libm::sin(TAU * turn), 0.0, -libm::cos(TAU * turn));
    let normal = out * ring.normal[0] + DVec3::Y * ring.normal[1];
    Corner {
        position: (out * ring.radius + DVec3::Y * ring.y).as_vec3(),
        normal: normal.normalize_or_zero().as_vec3(),
        material,
        coordinates: Vec2::new(turn as f32, ring.t as f32),
        third: 0.0,
    }
}

/// Returns the quadrilaterals between rings, which are listed from top to bottom. At a ring of
/// radius 0 they are triangles.
fn between(
    rings: &[Ring],
    sides: usize,
    corner: &impl Fn(&Ring, f64, usize) -> Corner,
) -> Vec<Vec<Corner>> {
    let mut out = Vec::with_capacity((rings.len() - 1) * sides);
    for pair in rings.windows(2) {
        for i in 0..sides {
            let at = |ring: usize, turn: f64| corner(&pair[ring], i as f64 + turn, sides);
            out.push(if pair[0].radius == 0.0 {
                vec![at(0, 0.5), at(1, 0.0), at(1, 1.0)]
            } else if pair[1].radius == 0.0 {
                vec![at(0, 0.0), at(1, 0.5), at(0, 1.0)]
            } else {
                vec![at(0, 0.0), at(1, 0.0), at(1, 1.0), at(0, 1.0)]
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {

    use super::*;

    /// Six times the volume between the origin and the polygons, with each polygon as a fan.
    fn volume(polygons: &[Vec<Corner>]) -> f32 {
        let fan = |p: &Vec<Corner>| -> f32 {
            (2..p.len())
                .map(|i| {
                    let (a, b, c) = (p[0].position, p[i - 1].position, p[i].position);
                    a.dot(b.cross(c))
                })
                .sum()
        };
        polygons.iter().map(fan).sum()
    }

    #[test]
    fn a_sphere_has_coins_triangles_and_less_than_its_volume() {
        for (complexity, triangles) in [(0.5, 390), (1.0, 1680), (0.3, 126), (0.0, 8)] {
            let fineness = Fineness::of_complexity(complexity);
            let mesh = facets(QuadricKind::Sphere { radius: 1.0 }, fineness, 0);
            let count: usize = mesh.iter().map(|p| p.len() - 2).sum();
            assert_eq!(count, triangles);
            let full = 8.0 * std::f32::consts::PI;
            assert!(volume(&mesh) > 0.0 && volume(&mesh) < full);
        }
    }

    #[test]
    fn no_facet_is_farther_from_a_sphere_than_the_error() {
        for error in [0.1, 0.02, 0.005, 0.001] {
            let kind = QuadricKind::Sphere { radius: 1.0 };
            let polygons = facets(kind, Fineness::within(error), 0);
            let mut deepest = 0.0f64;
            for polygon in &polygons {
                for pair in polygon[1..].windows(2) {
                    let corners = [polygon[0], pair[0], pair[1]].map(|c| c.position.as_dvec3());
                    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
                    let plane = corners[0].dot(normal.normalize()).abs();
                    deepest = deepest.max(1.0 - plane);
                }
            }
            assert!(deepest <= error, "{deepest} for {error}");
            assert!(deepest > 0.3 * error, "{deepest} for {error} is too fine");
        }
    }

    #[test]
    fn a_cylinder_closes_with_its_two_discs() {
        let (radius, half_height) = (1.0, 1.0);
        let side = QuadricKind::CylinderSide {
            radius,
            half_height,
        };
        let disc = |y: f64| QuadricKind::Disc {
            radius,
            y,
            up: y > 0.0,
        };
        let volume: f32 = [side, disc(1.0), disc(-1.0)]
            .map(|kind| volume(&facets(kind, Fineness::of_complexity(0.5), 0)))
            .iter()
            .sum();
        // A prism over a regular polygon of 20 sides.
        let prism = 20.0 * (TAU / 20.0).sin() as f32;
        assert!((volume / 6.0 - prism).abs() < 1e-4);
    }
}

//! A surface made ready for tracing at one wavelength.

use glam::{DVec2, DVec3};

use crate::lens::trace::meet::{Hit, meet_profile, meet_quadric, meet_sphere, toroid};
use crate::lens::trace::profile::Profile;
use crate::lens::trace::ray::Toward;
use crate::lens::trace::refraction::Bend;
use crate::prescription::glass::coating::Coating;
use crate::prescription::surface::{Shape, Surface};

/// A surface made ready for tracing at one wavelength.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub curvature: f64,
    pub form: Form,
    /// The vertex, from the front vertex.
    pub vertex_z: f64,
    /// The distance to the next vertex, as given: a sum of gaps taken apart again would not be.
    pub gap: f64,
    /// The square of the semi-diameter.
    pub clear: f64,
    pub to_film: Bend,
    pub to_scene: Bend,
    /// The index in front and the one behind.
    pub indices: [f64; 2],
    pub coating: Coating,
    /// The corners of a hole that is not round; it is inside the semi-diameter.
    pub hole: Option<Box<[DVec2]>>,
    /// The edges of the convex hull of that hole: the vector from the axis to each, over the square of
    /// its length, so that the dot product with a point inside is less than 1 for all. Empty if the
    /// hull does not contain the axis.
    pub edges: Box<[DVec2]>,
}

/// The shapes as the tracer meets them. The first three are quadrics, met in closed form.
#[derive(Clone, Debug)]
pub(crate) enum Form {
    Sphere,
    Conic {
        k: f64,
    },
    /// Weights of x and y in the sum of squares: 0 along the cylinder's axis.
    Cylinder {
        x: f64,
        y: f64,
    },
    Asphere(Profile),
    Toroid {
        profile: Profile,
        across: f64,
    },
}

impl Element {
    pub(crate) fn new(surface: &Surface, vertex_z: f64, before: f64, behind: f64) -> Self {
        let curvature = surface.curvature.per_mm();
        let form = match &surface.shape {
            Shape::Sphere => Form::Sphere,
            Shape::Conic { k } if *k == 0.0 => Form::Sphere,
            Shape::Conic { k } => Form::Conic { k: *k },
            Shape::CylinderX => Form::Cylinder { x: 0.0, y: 1.0 },
            Shape::CylinderY => Form::Cylinder { x: 1.0, y: 0.0 },
            Shape::Asphere { k, terms } => {
                let profile = Profile::new(curvature, *k, &terms[..]);
                match profile.terms.is_empty() {
                    true if *k == 0.0 => Form::Sphere,
                    true => Form::Conic { k: *k },
                    false => Form::Asphere(profile),
                }
            }
            Shape::Toroid { across, k, terms } => Form::Toroid {
                profile: Profile::new(curvature, *k, &terms[..]),
                across: across.per_mm(),
            },
        };
        Self {
            curvature,
            form,
            vertex_z,
            gap: surface.thickness,
            clear: surface.semi_diameter * surface.semi_diameter,
            to_film: Bend::new(before, behind),
            to_scene: Bend::new(behind, before),
            indices: [before, behind],
            coating: surface.coating,
            hole: None,
            edges: Box::default(),
        }
    }

    /// Gives the surface a hole with these corners.
    pub(crate) fn set_hole(&mut self, corners: Option<Box<[DVec2]>>) {
        self.edges = corners.as_deref().map(edges_around).unwrap_or_default();
        self.hole = corners;
    }

    /// Whether a hit is inside the hole of the iris; always, if that is round.
    pub(crate) fn is_open_at(&self, hit: DVec3) -> bool {
        self.hole
            .as_deref()
            .is_none_or(|corners| is_inside(corners, hit.truncate()))
    }

    pub(crate) fn bend(&self, toward: Toward) -> Bend {
        match toward {
            Toward::Film => self.to_film,
            Toward::Scene => self.to_scene,
        }
    }

    /// The share of light that is reflected where a ray meets the surface.
    pub(crate) fn reflectance(&self, toward: Toward, cos: f64, wavelength_nm: f64) -> f64 {
        let [front, behind] = self.indices;
        let (from, into) = match toward {
            Toward::Film => (front, behind),
            Toward::Scene => (behind, front),
        };
        self.coating.reflectance(from, into, cos, wavelength_nm)
    }

    /// The point where a ray meets the surface, relative to the vertex, and the normal toward the film.
    /// `sign` is +1 toward the film and −1 toward the scene. None if the ray misses.
    pub(crate) fn meet(&self, p: DVec3, d: DVec3, sign: f64) -> Option<Hit> {
        match &self.form {
            Form::Sphere => meet_sphere(self.curvature, p, d, sign),
            Form::Conic { k } => {
                meet_quadric(self.curvature, DVec3::new(1.0, 1.0, 1.0 + k), p, d, sign)
            }
            Form::Cylinder { x, y } => {
                meet_quadric(self.curvature, DVec3::new(*x, *y, 1.0), p, d, sign)
            }
            Form::Asphere(profile) => {
                let start =
                    meet_quadric(profile.c, DVec3::new(1.0, 1.0, 1.0 + profile.k), p, d, sign);
                meet_profile(start, p, d, sign, |q| {
                    let (sag, slope) = profile.sag(q.x * q.x + q.y * q.y)?;
                    Some((q.z - sag, DVec3::new(-slope * q.x, -slope * q.y, 1.0)))
                })
            }
            Form::Toroid { profile, across } => {
                let start = meet_sphere(self.curvature, p, d, sign);
                meet_profile(start, p, d, sign, |q| toroid(profile, *across, q))
            }
        }
    }
}

/// The edges of the convex hull of a few corners, each as the foot of its perpendicular from the axis
/// over the square of its length.
fn edges_around(corners: &[DVec2]) -> Box<[DVec2]> {
    let size = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
    let is_edge = |a: DVec2, b: DVec2| {
        let side = |c: &DVec2| (b - a).perp_dot(*c - a) >= -1e-9 * size * (b - a).length();
        (b - a).length() > 1e-9 * size && corners.iter().all(side)
    };
    let pairs = corners
        .iter()
        .flat_map(|a| corners.iter().map(|b| (*a, *b)));
    let hull = pairs.filter(|(a, b)| is_edge(*a, *b));
    let edges: Vec<(DVec2, f64)> = hull
        .map(|(a, b)| {
            let outward = -(b - a).perp().normalize();
            (outward, outward.dot(a))
        })
        .collect();
    if edges.iter().any(|(_, distance)| *distance <= 1e-3 * size) {
        return Box::default();
    }
    edges
        .iter()
        .map(|(way, distance)| *way / *distance)
        .collect()
}

/// Whether a point is inside a polygon, by counting the edges to its right.
fn is_inside(corners: &[DVec2], p: DVec2) -> bool {
    let mut inside = false;
    let mut a = corners[corners.len() - 1];
    for &b in corners {
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
        a = b;
    }
    inside
}

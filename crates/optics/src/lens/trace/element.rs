//! A surface made ready for tracing at one wavelength.

use glam::{DAffine3, DVec2, DVec3};

use crate::lens::trace::intersect::{
    SurfaceHit, intersect_profile, intersect_quadric, intersect_sphere, toroid,
};
use crate::lens::trace::profile::Profile;
use crate::lens::trace::ray::Toward;
use crate::lens::trace::refraction::{Refraction, refract};
use crate::lens::trace::thin_lens;
use crate::prescription::decenter::{SurfaceFrame, inverse};
use crate::prescription::glass::coating::Coating;
use crate::prescription::surface::{Shape, Surface};

/// A surface made ready for tracing at one wavelength.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    /// The curvature at the vertex, per millimeter.
    pub curvature: f64,
    pub form: Form,
    /// The z of the vertex in millimeters, from the front vertex.
    pub vertex_z: f64,
    /// The distance to the next vertex in millimeters, as given. The difference of two `vertex_z`
    /// would have the rounding errors of both.
    pub gap: f64,
    /// The square of the semi-diameter, in square millimeters.
    pub clear: f64,
    /// The square of the radius within which rays are blocked, in square millimeters.
    pub obstruction: f64,
    /// Whether the surface reflects.
    pub is_mirror: bool,
    /// The sign of lens space in front of the surface: −1 behind an odd number of mirrors, where
    /// the tracer's z grows against that of lens space.
    pub facing: f64,
    /// The maps to and from the surface, if it is decentered.
    pub frame: Option<Box<ElementFrame>>,
    /// The map from the surface to lens space, if this or an earlier surface is decentered.
    pub place: Option<Box<DAffine3>>,
    /// The refraction of a ray that travels toward the film.
    pub to_film: Refraction,
    /// The refraction of a ray that travels toward the scene.
    pub to_scene: Refraction,
    /// The refractive indices in front of and behind the surface.
    pub indices: [f64; 2],
    pub coating: Coating,
    /// The corners of a hole that is not round, in millimeters. It lies inside the semi-diameter.
    pub hole: Option<Box<[DVec2]>>,
    /// The edges of the convex hull of that hole. Each is given as the perpendicular from the axis
    /// to the edge over the square of its length, so that the dot product with a point inside is
    /// less than 1 for all edges. The list is empty if the hull does not contain the axis.
    pub edges: Box<[DVec2]>,
}

/// The maps between the coordinates of a decentered surface and those of the axis in front of it
/// and behind it, each with its inverse.
#[derive(Clone, Debug)]
pub(crate) struct ElementFrame {
    /// From the surface to the axis in front of it, and back.
    before: [DAffine3; 2],
    /// From the axis behind the surface to the surface, and back.
    after: [DAffine3; 2],
}

impl ElementFrame {
    fn new(frame: &SurfaceFrame) -> Self {
        let both = |map: DAffine3| [map, inverse(&map)];
        Self {
            before: both(frame.before.affine()),
            after: both(frame.after.affine()),
        }
    }

    /// The map from the axis that a ray comes along to the surface.
    pub(crate) fn entering(&self, toward: Toward) -> &DAffine3 {
        match toward {
            Toward::Film => &self.before[1],
            Toward::Scene => &self.after[0],
        }
    }

    /// The map from the surface to the axis that a ray leaves along.
    pub(crate) fn leaving(&self, toward: Toward) -> &DAffine3 {
        match toward {
            Toward::Film => &self.after[1],
            Toward::Scene => &self.before[0],
        }
    }
}

/// The shape of a surface, by the method that intersects it. The first three are quadrics, which
/// are intersected in closed form.
#[derive(Clone, Debug)]
pub(crate) enum Form {
    /// A sphere or a plane.
    Sphere,
    /// The quadric c (w.x x² + w.y y² + w.z z²) = 2 z with these weights w, where c is the
    /// curvature: (1, 1, 1 + k) for a conic; for a cylinder 1, and 0 along its axis.
    Quadric(DVec3),
    Asphere(Profile),
    Toroid {
        /// The profile in the plane of y and z.
        profile: Profile,
        /// The curvature at the vertex in the plane of x and z, per millimeter.
        across: f64,
    },
    /// An ideal lens of a focal length in air, in millimeters.
    ThinLens {
        focal_length: f64,
    },
}

/// The weights of a conic of a conic constant: see [`Form::Quadric`].
fn conic(k: f64) -> DVec3 {
    DVec3::new(1.0, 1.0, 1.0 + k)
}

impl Element {
    /// The element of a surface with its vertex at `vertex_z`, between media of the given indices.
    /// It is the first of a lens; see [`Element::facing`].
    pub(crate) fn new(surface: &Surface, vertex_z: f64, before: f64, behind: f64) -> Self {
        let curvature = surface.curvature.per_mm();
        let form = match &surface.shape {
            Shape::Sphere => Form::Sphere,
            Shape::Conic { k } if *k == 0.0 => Form::Sphere,
            Shape::Conic { k } => Form::Quadric(conic(*k)),
            Shape::CylinderX => Form::Quadric(DVec3::new(0.0, 1.0, 1.0)),
            Shape::CylinderY => Form::Quadric(DVec3::new(1.0, 0.0, 1.0)),
            Shape::Asphere { k, terms } => {
                let profile = Profile::new(curvature, *k, &terms[..]);
                match profile.terms.is_empty() {
                    true if *k == 0.0 => Form::Sphere,
                    true => Form::Quadric(conic(*k)),
                    false => Form::Asphere(profile),
                }
            }
            Shape::NormalAsphere { k, terms } => Form::Asphere(Profile {
                along_normal: true,
                ..Profile::new(curvature, *k, &terms[..])
            }),
            Shape::Toroid { across, k, terms } => Form::Toroid {
                profile: Profile::new(curvature, *k, &terms[..]),
                across: across.per_mm(),
            },
            Shape::ThinLens { focal_length } => Form::ThinLens {
                focal_length: *focal_length,
            },
        };
        // Nothing is known of the reflections of an ideal lens, and mirrors reflect all light.
        let is_ideal = surface.is_mirror || matches!(form, Form::ThinLens { .. });
        Self {
            curvature,
            form,
            vertex_z,
            gap: surface.thickness,
            clear: surface.semi_diameter * surface.semi_diameter,
            obstruction: surface.obstruction * surface.obstruction,
            is_mirror: surface.is_mirror,
            facing: 1.0,
            frame: surface
                .frame
                .as_deref()
                .map(|f| Box::new(ElementFrame::new(f))),
            place: None,
            to_film: Refraction::new(before, behind),
            to_scene: Refraction::new(behind, before),
            indices: [before, behind],
            coating: match is_ideal {
                true => Coating::Ideal,
                false => surface.coating,
            },
            hole: None,
            edges: Box::default(),
        }
    }

    /// Gives the surface a hole with these corners.
    pub(crate) fn set_hole(&mut self, corners: Option<Box<[DVec2]>>) {
        self.edges = corners.as_deref().map(edges_around).unwrap_or_default();
        self.hole = corners;
    }

    /// Whether the apertures of the surface let a ray pass that hits it at this point.
    pub(crate) fn is_open_at(&self, hit: DVec3) -> bool {
        let r2 = hit.x * hit.x + hit.y * hit.y;
        let corners = self.hole.as_deref();
        r2 <= self.clear
            && r2 >= self.obstruction
            && corners.is_none_or(|corners| is_inside(corners, hit.truncate()))
    }

    /// Moves a ray from the axis that it comes along to the coordinates of the surface. Those of
    /// a surface that is not decentered are the same.
    #[inline(always)]
    pub(crate) fn enter(&self, toward: Toward, p: &mut DVec3, d: &mut DVec3) {
        if let Some(frame) = &self.frame {
            let map = frame.entering(toward);
            (*p, *d) = (map.transform_point3(*p), map.transform_vector3(*d));
        }
    }

    /// Moves a ray from the coordinates of the surface to those of the axis that it leaves along.
    #[inline(always)]
    pub(crate) fn leave(&self, toward: Toward, p: &mut DVec3, d: &mut DVec3) {
        if let Some(frame) = &self.frame {
            let map = frame.leaving(toward);
            (*p, *d) = (map.transform_point3(*p), map.transform_vector3(*d));
        }
    }

    /// The place in lens space of a point relative to the vertex.
    pub(crate) fn placed(&self, point: DVec3) -> DVec3 {
        if let Some(place) = &self.place {
            return place.transform_point3(point);
        }
        let DVec3 { x, y, z } = point;
        DVec3::new(x, y, self.facing * z) + self.vertex_z * DVec3::Z
    }

    /// The component of a vector of lens space along the light that reaches the surface.
    pub(crate) fn along(&self, v: DVec3) -> f64 {
        match &self.place {
            Some(place) => v.dot(place.matrix3.z_axis),
            None => self.facing * v.z,
        }
    }

    /// The sign of z along a ray that reaches the surface, in the space in front of it. A mirror is
    /// always met from its front.
    pub(crate) fn sign(&self, toward: Toward) -> f64 {
        if self.is_mirror { 1.0 } else { toward.sign() }
    }

    /// A position or a direction of a ray that reaches the surface, in the space in front of it.
    /// Only a mirror that is met from behind has another space there, of opposite z.
    pub(crate) fn arriving(&self, toward: Toward, v: DVec3) -> DVec3 {
        match self.is_mirror && toward == Toward::Scene {
            true => DVec3::new(v.x, v.y, -v.z),
            false => v,
        }
    }

    /// A position or a direction in the space in front of the surface, in that of a ray that leaves
    /// it.
    pub(crate) fn leaving(&self, toward: Toward, v: DVec3) -> DVec3 {
        match self.is_mirror && toward == Toward::Film {
            true => DVec3::new(v.x, v.y, -v.z),
            false => v,
        }
    }

    /// The direction in which a ray leaves its hit, in the space in front of the surface; none at
    /// total reflection.
    pub(crate) fn bend(&self, d: DVec3, hit: &SurfaceHit, toward: Toward) -> Option<DVec3> {
        match self.form {
            _ if self.is_mirror => Some(d - 2.0 * d.dot(hit.normal) * hit.normal),
            Form::ThinLens { focal_length } => {
                thin_lens::bend(d, hit.point, self.indices, focal_length, toward)
            }
            _ => refract(d, hit, self.refraction(toward), toward.sign()),
        }
    }

    /// The refraction of a ray that travels in a direction.
    pub(crate) fn refraction(&self, toward: Toward) -> Refraction {
        match toward {
            Toward::Film => self.to_film,
            Toward::Scene => self.to_scene,
        }
    }

    /// The share of the light that the surface reflects, at a cosine of the angle of incidence.
    pub(crate) fn reflectance(&self, toward: Toward, cos: f64, wavelength_nm: f64) -> f64 {
        let [front, behind] = self.indices;
        let (from, into) = match toward {
            Toward::Film => (front, behind),
            Toward::Scene => (behind, front),
        };
        self.coating.reflectance(from, into, cos, wavelength_nm)
    }

    /// Intersects the surface with a ray from `p`, relative to the vertex, in the direction `d`.
    /// `sign` is +1 toward the film and −1 toward the scene. Returns none if the ray misses.
    pub(crate) fn intersect(&self, p: DVec3, d: DVec3, sign: f64) -> Option<SurfaceHit> {
        match &self.form {
            Form::Sphere => intersect_sphere(self.curvature, p, d, sign),
            Form::ThinLens { .. } => intersect_sphere(0.0, p, d, sign),
            Form::Quadric(weights) => intersect_quadric(self.curvature, *weights, p, d, sign),
            Form::Asphere(profile) => {
                let start = intersect_quadric(profile.c, conic(profile.k), p, d, sign);
                intersect_profile(start, p, d, sign, |q| {
                    let (sag, slope) = profile.sag(q.x * q.x + q.y * q.y)?;
                    Some((q.z - sag, DVec3::new(-slope * q.x, -slope * q.y, 1.0)))
                })
            }
            Form::Toroid { profile, across } => {
                let start = intersect_sphere(self.curvature, p, d, sign);
                intersect_profile(start, p, d, sign, |q| toroid(profile, *across, q))
            }
        }
    }
}

/// The edges of the convex hull of a few corners, in the form of [`Element::edges`]. An edge counts
/// as passing through the axis if it is nearer than a thousandth of the hole's radius.
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
        .map(|(normal, distance)| *normal / *distance)
        .collect()
}

/// Whether a point is inside a polygon, by counting the edges to its right.
fn is_inside(corners: &[DVec2], p: DVec2) -> bool {
    edges_of(corners).fold(false, |inside, edge| inside != is_left_of(edge, [p.x, p.y]))
}

/// The edges of a polygon, from corner to corner.
pub(crate) fn edges_of(corners: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> {
    let starts = corners.iter().cycle().skip(corners.len().saturating_sub(1));
    std::iter::zip(starts, corners).map(|(a, b)| [*a, *b])
}

/// Whether a point is to the left of an edge of a polygon, at a height that the edge crosses.
#[inline(always)]
pub(crate) fn is_left_of([a, b]: [DVec2; 2], [x, y]: [f64; 2]) -> bool {
    ((a.y > y) != (b.y > y)) & (x < a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x))
}

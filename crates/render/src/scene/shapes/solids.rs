//! Draws cubes, spheres, cylinders, cones and lens surfaces, with Inventor's parts.
//!
//! The shape hints determine which sides are lit and visible, as for every other shape (Coin).

use glam::{Vec2, Vec3};
use ivcam_inventor::grammar::{Field, cone, cube, cylinder, lens_surface, sphere};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{Binding, State};

use super::quad;
use crate::geometry::{Corner, QuadricKind};
use crate::scene::canvas::{Canvas, Sides};
use crate::scene::looks::Texture;

/// Returns the material of a part: its own if materials are bound to parts, else the first.
fn part(state: &State<'_>, index: u32) -> u32 {
    match state.material_binding {
        Binding::PerPart | Binding::PerPartIndexed => index,
        _ => 0,
    }
}

/// Returns the absolute value of a size, or its default if it is not finite.
pub(super) fn size(node: NodeRef<'_>, field: Field<f32>) -> f32 {
    let stated = node.get(field);
    let size = if stated.is_finite() {
        stated
    } else {
        field.default()
    };
    size.abs()
}

/// Draws a `Cube`. Its parts are in Inventor's order: front, back, left, right, top, bottom.
/// `PER_FACE` is the same as `PER_PART`.
pub(super) fn cube<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let half = 0.5
        * Vec3::new(
            size(node, cube::WIDTH),
            size(node, cube::HEIGHT),
            size(node, cube::DEPTH),
        );
    let by_part = matches!(
        state.material_binding,
        Binding::PerPart | Binding::PerPartIndexed | Binding::PerFace | Binding::PerFaceIndexed
    );
    block(half, by_part, out);
}

/// Draws the six sides of a box around the origin, each with the whole texture.
pub(super) fn block(half: Vec3, by_part: bool, out: &mut dyn Canvas) {
    // The outward normal of each side, and the direction of the texture's s.
    const SIDES: [(Vec3, Vec3); 6] = [
        (Vec3::Z, Vec3::X),
        (Vec3::NEG_Z, Vec3::NEG_X),
        (Vec3::NEG_X, Vec3::Z),
        (Vec3::X, Vec3::NEG_Z),
        (Vec3::Y, Vec3::X),
        (Vec3::NEG_Y, Vec3::X),
    ];
    let volume = out.texture().is_some_and(Texture::is_deep);
    for (index, (normal, right)) in SIDES.into_iter().enumerate() {
        let up = normal.cross(right);
        let place =
            |s: f32, t: f32| (normal + right * (2.0 * s - 1.0) + up * (2.0 * t - 1.0)) * half;
        let inside =
            |s: f32, t: f32| place(s, t) / (2.0 * half).max(Vec3::splat(f32::MIN_POSITIVE)) + 0.5;
        let corner = |s: f32, t: f32| Corner {
            position: place(s, t),
            normal,
            material: if by_part { index as u32 } else { 0 },
            coordinates: if volume {
                inside(s, t).truncate()
            } else {
                Vec2::new(s, t)
            },
            third: inside(s, t).z,
        };
        // The top right corner is first, because Coin cuts a side from there.
        quad(
            [
                corner(1.0, 1.0),
                corner(0.0, 1.0),
                corner(0.0, 0.0),
                corner(1.0, 0.0),
            ],
            out,
        );
    }
}

/// Draws a `Sphere`.
pub(super) fn sphere<'a>(node: NodeRef<'a>, out: &mut dyn Canvas) {
    let radius = f64::from(size(node, sphere::RADIUS));
    out.quadric(QuadricKind::Sphere { radius }, 0);
}

/// Draws a `LensSurface`: the part of a sphere around its vertex, or of a plane if the radius is 0.
/// Both sides are visible. For the index of refraction the outside is the side of larger y.
pub(super) fn lens_surface<'a>(node: NodeRef<'a>, out: &mut dyn Canvas) {
    let radius = f64::from(node.get(lens_surface::RADIUS));
    let curvature = if radius == 0.0 { 0.0 } else { 1.0 / radius };
    let inner = f64::from(node.get(lens_surface::INNER)).abs();
    let mut outer = f64::from(node.get(lens_surface::OUTER)).abs();
    if curvature != 0.0 {
        outer = outer.min(radius.abs());
    }
    out.set_sides(Sides::BOTH);
    out.set_refraction(node.get(lens_surface::REFRACTION_INDEX));
    if curvature.is_finite() && outer.is_finite() && outer > inner {
        out.quadric(
            QuadricKind::Zone {
                curvature,
                inner,
                outer,
            },
            0,
        );
    }
}

/// Draws a `Cylinder`.
pub(super) fn cylinder<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let parts = node.get(cylinder::PARTS);
    let radius = f64::from(size(node, cylinder::RADIUS));
    let half_height = 0.5 * f64::from(size(node, cylinder::HEIGHT));
    cylinder_of(
        radius,
        half_height,
        [
            cylinder::PARTS_SIDES,
            cylinder::PARTS_TOP,
            cylinder::PARTS_BOTTOM,
        ]
        .map(|part| parts & part != 0),
        [0, 1, 2].map(|i| part(state, i)),
        out,
    );
}

/// Draws the sides, the top and the bottom of a cylinder with their materials.
pub(super) fn cylinder_of(
    radius: f64,
    half_height: f64,
    parts: [bool; 3],
    materials: [u32; 3],
    out: &mut dyn Canvas,
) {
    // Drawn as lines, a cylinder of height 0 is a ring. Some draggers have such cylinders.
    if parts[0] && radius != 0.0 && (half_height != 0.0 || out.wants().outlines) {
        out.quadric(
            QuadricKind::CylinderSide {
                radius,
                half_height,
            },
            materials[0],
        );
    }
    for (i, up) in [(1, true), (2, false)] {
        if parts[i] && radius != 0.0 {
            let y = if up { half_height } else { -half_height };
            out.quadric(QuadricKind::Disc { radius, y, up }, materials[i]);
        }
    }
}

/// Draws a `Cone`.
pub(super) fn cone<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let parts = node.get(cone::PARTS);
    let radius = f64::from(size(node, cone::BOTTOM_RADIUS));
    let half_height = 0.5 * f64::from(size(node, cone::HEIGHT));
    cone_of(
        radius,
        half_height,
        [cone::PARTS_SIDES, cone::PARTS_BOTTOM].map(|part| parts & part != 0),
        [0, 1].map(|i| part(state, i)),
        out,
    );
}

/// Draws the sides and the bottom of a cone with their materials.
pub(super) fn cone_of(
    radius: f64,
    half_height: f64,
    parts: [bool; 2],
    materials: [u32; 2],
    out: &mut dyn Canvas,
) {
    if parts[0] && half_height != 0.0 {
        out.quadric(
            QuadricKind::ConeSide {
                radius,
                half_height,
            },
            materials[0],
        );
    }
    if parts[1] && radius != 0.0 {
        out.quadric(
            QuadricKind::Disc {
                radius,
                y: -half_height,
                up: false,
            },
            materials[1],
        );
    }
}

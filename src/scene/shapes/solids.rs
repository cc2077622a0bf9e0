//! Cube, sphere, cylinder and cone: exact, in their own space, with Inventor's parts.
//!
//! Which sides are lit and seen is the shape hints' business, as for every other shape (Coin).

use glam::{Vec2, Vec3};

use super::quad;
use crate::geometry::Corner;
use crate::geometry::QuadricKind;
use crate::grammar::value::Choice;
use crate::iv::NodeRef;
use crate::scene::Builder;
use crate::traversal::state::{Binding, State};

/// The material of a part: its own where the binding deals them out by part.
fn part(state: &State<'_>, index: u32) -> u32 {
    match state.material_binding {
        Binding::PerPart | Binding::PerPartIndexed => index,
        _ => 0,
    }
}

/// Sizes are taken without their sign; Coin turns a part over and leaves its normals.
pub(super) fn size(node: NodeRef<'_>, name: &str, default: f32, out: &Builder<'_>) -> f32 {
    let size = node.read::<f32>(name).filter(|v| v.is_finite());
    let size = size.unwrap_or(default);
    if out.as_coin() { size } else { size.abs() }
}

/// Parts in Inventor's order: front, back, left, right, top, bottom. `PER_FACE` is by part too.
pub fn cube<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let half = 0.5
        * Vec3::new(
            size(node, "width", 2.0, out),
            size(node, "height", 2.0, out),
            size(node, "depth", 2.0, out),
        );
    let by_part = matches!(
        state.material_binding,
        Binding::PerPart | Binding::PerPartIndexed | Binding::PerFace | Binding::PerFaceIndexed
    );
    block(half, by_part, out);
}

/// The six sides of a box, each with the texture once.
pub fn block(half: Vec3, by_part: bool, out: &mut Builder<'_>) {
    // Outward normal, and the direction in which the texture's s grows.
    const SIDES: [(Vec3, Vec3); 6] = [
        (Vec3::Z, Vec3::X),
        (Vec3::NEG_Z, Vec3::NEG_X),
        (Vec3::NEG_X, Vec3::Z),
        (Vec3::X, Vec3::NEG_Z),
        (Vec3::Y, Vec3::X),
        (Vec3::NEG_Y, Vec3::X),
    ];
    let volume = out.has_volume_texture();
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
        // The top right corner first: that is where Coin cuts a side in two.
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

pub fn sphere<'a>(node: NodeRef<'a>, out: &mut Builder<'a>) {
    let radius = f64::from(size(node, "radius", 1.0, out));
    out.quadric(QuadricKind::Sphere { radius }, 0);
}

/// A part of a sphere about its vertex, or of a plane where the radius is 0, as lenses have them.
/// Seen from both sides; the outside, for indices of refraction, is where y is larger.
pub fn lens_surface<'a>(node: NodeRef<'a>, out: &mut Builder<'a>) {
    let read = |name: &str, or: f32| f64::from(node.read::<f32>(name).unwrap_or(or));
    let radius = read("radius", 0.0);
    let curvature = if radius == 0.0 { 0.0 } else { 1.0 / radius };
    let inner = read("inner", 0.0).abs();
    let mut outer = read("outer", 1.0).abs();
    if curvature != 0.0 {
        outer = outer.min(radius.abs());
    }
    out.set_sides(true, true, false);
    out.set_refraction(read("refractionIndex", 1.0) as f32);
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

/// Parts: sides 1, top 2, bottom 4.
pub fn cylinder<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let parts = node.read::<Choice>("parts").unwrap_or(7);
    let radius = f64::from(size(node, "radius", 1.0, out));
    let half_height = 0.5 * f64::from(size(node, "height", 2.0, out));
    cylinder_of(
        radius,
        half_height,
        [parts & 1 != 0, parts & 2 != 0, parts & 4 != 0],
        [0, 1, 2].map(|i| part(state, i)),
        out,
    );
}

/// Sides, top and bottom with their materials.
pub fn cylinder_of(
    radius: f64,
    half_height: f64,
    parts: [bool; 3],
    materials: [u32; 3],
    out: &mut Builder<'_>,
) {
    // A cylinder without height is a ring where it is drawn as lines (draggers have such).
    if parts[0] && radius != 0.0 && (half_height != 0.0 || out.outlines()) {
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

/// Parts: sides 1, bottom 2.
pub fn cone<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut Builder<'a>) {
    let parts = node.read::<Choice>("parts").unwrap_or(3);
    let radius = f64::from(size(node, "bottomRadius", 1.0, out));
    let half_height = 0.5 * f64::from(size(node, "height", 2.0, out));
    cone_of(
        radius,
        half_height,
        [parts & 1 != 0, parts & 2 != 0],
        [0, 1].map(|i| part(state, i)),
        out,
    );
}

/// Sides and bottom with their materials.
pub fn cone_of(
    radius: f64,
    half_height: f64,
    parts: [bool; 2],
    materials: [u32; 2],
    out: &mut Builder<'_>,
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

//! Properties of the surroundings: ambient light, fog, clip planes and shadows.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::grammar::{clip_plane, environment, fog, local_fog, shadow_style, x3d_clip_plane};
use crate::iv::NodeRef;
use crate::traversal::state::{EnvironmentElement, FogKind, State};

/// Applies an `Environment`.
pub(super) fn environment<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let color = node.acting_or_default(environment::AMBIENT_COLOR);
    state.environment_node = Some(node);
    state.environment = EnvironmentElement {
        ambient: color * node.acting_or_default(environment::AMBIENT_INTENSITY),
        attenuation: node.acting_or_default(environment::ATTENUATION),
        fog: match node.acting_or_default(environment::FOG_TYPE) {
            environment::FOG_TYPE_HAZE => FogKind::Haze,
            environment::FOG_TYPE_FOG => FogKind::Fog,
            environment::FOG_TYPE_SMOKE => FogKind::Smoke,
            _ => FogKind::None,
        },
        fog_color: finite(node.acting_or_default(environment::FOG_COLOR)),
        visibility: node.acting_or_default(environment::FOG_VISIBILITY),
    };
}

/// Returns a color with 0 for each component that is NaN or infinite, of which the reader warns.
fn finite(color: Vec3) -> Vec3 {
    color.map(|level| if level.is_finite() { level } else { 0.0 })
}

/// Applies a `LocalFog` that is enabled.
pub(super) fn local_fog<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if node.get(local_fog::ENABLED) {
        state.environment = fog97(node, state).unwrap_or(state.environment);
    }
}

/// Returns the environment with the fog of a VRML97 `Fog` or `LocalFog`, or `None` if the
/// visibility range is 0, which means no fog. The range is in units of the node's object space.
pub fn fog97(node: NodeRef<'_>, state: &State<'_>) -> Option<EnvironmentElement> {
    let range = node.get(fog::VISIBILITY_RANGE);
    let scale = libm::cbrt(state.world_from_object.determinant().abs());
    let visibility = range * scale as f32;
    (visibility > 0.0 && visibility.is_finite()).then(|| EnvironmentElement {
        fog: match node.get(fog::FOG_TYPE) {
            "EXPONENTIAL" => FogKind::Exponential,
            _ => FogKind::Linear,
        },
        fog_color: finite(node.get(fog::COLOR)),
        visibility,
        ..state.environment
    })
}

/// Adds a `ClipPlane` of Inventor that is on. Its distance is along the normal, whatever the length
/// of the normal is.
pub(super) fn clip_plane<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if node.acting(clip_plane::ON) == Some(false) {
        return;
    }
    if let Some(plane) = node.acting(clip_plane::PLANE) {
        let normal = plane.normal.as_dvec3().normalize_or_zero();
        add_clip_plane(state, normal, f64::from(plane.distance));
    }
}

/// Adds a `ClipPlane` of X3D that is enabled. What lies where `a x + b y + c z + d` is greater than
/// 0 is drawn (ISO/IEC 19775-1, 11.4.1).
pub(super) fn x3d_clip_plane<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if node.get(x3d_clip_plane::ENABLED) {
        let plane = node.get(x3d_clip_plane::PLANE).as_dvec4();
        add_clip_plane(state, plane.truncate(), -plane.w);
    }
}

/// Adds the plane of the points of object space whose product with a vector is `distance`. What
/// lies toward the vector is drawn.
fn add_clip_plane(state: &mut State<'_>, normal: DVec3, distance: f64) {
    let world = state.world_from_object;
    let inverse = world.inverse();
    if !inverse.is_finite() {
        return;
    }
    let turned = inverse.transpose().transform_vector3(normal);
    let on_plane =
        world.transform_point3(normal * distance / normal.length_squared().max(f64::MIN_POSITIVE));
    if let Some(n) = turned.try_normalize() {
        Arc::make_mut(&mut state.clip_planes).push((n, n.dot(on_plane)));
    }
}

/// Applies a `ShadowStyle`.
pub(super) fn shadow_style<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let style = node.acting_or_default(shadow_style::STYLE);
    state.casts_shadow = style & shadow_style::STYLE_CASTS_SHADOW != 0;
}

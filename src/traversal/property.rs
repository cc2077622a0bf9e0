//! What each property node does to the state: one short function a kind.

use std::sync::Arc;

use glam::{DMat4, DVec3, Mat4, Quat, Vec2, Vec3, Vec4};

use super::state::{
    Binding, Complexity, Coordinates, Diffuse, DrawStyle, EnvironmentElement, FogKind, FontElement,
    Highlight, LightElement, LightKind, List, Profile, ProfileCoordinates, State,
    TextureCoordinates, TextureElement, TextureModel, VertexOrdering, Wrapping,
};
use crate::grammar::value::{Choice, Plane, Rotation, Text};
use crate::iv::NodeRef;
use crate::pose::{quat, rotation_of};

/// Changes the state as the node says. `time` is in seconds, for what moves by itself.
/// Whether it had anything to do.
pub fn apply<'a>(state: &mut State<'a>, node: NodeRef<'a>, time: f64) -> bool {
    let Some(mut class) = node.known_class() else {
        return false;
    };
    // A class that is not listed below does what the first listed class above it does.
    loop {
        if apply_as(state, node, class.name, time) {
            return true;
        }
        let above = crate::grammar::by_name(class.family, class.dialects)
            .or_else(|| crate::grammar::any(class.family));
        match above {
            Some(parent) if parent.id != class.id => class = parent,
            _ => return false,
        }
    }
}

fn apply_as<'a>(state: &mut State<'a>, node: NodeRef<'a>, class: &str, time: f64) -> bool {
    if state.texture_unit != 0 && class.starts_with("Texture") && class != "TextureUnit" {
        return true;
    }
    match class {
        "Material" => material(state, node),
        "BaseColor" => base_color(state, node),
        "PackedColor" => packed_color(state, node),
        "MaterialBinding" => material_binding(state, node),
        "NormalBinding" => normal_binding(state, node),
        "Normal" => normal(state, node),
        "Coordinate3" => coordinate3(state, node),
        "Coordinate4" => coordinate4(state, node),
        "VertexProperty" => vertex_property(state, node),
        "ShapeHints" => shape_hints(state, node),
        "LightModel" => light_model(state, node),
        "Complexity" => complexity(state, node),
        "DrawStyle" => draw_style(state, node),
        "PolygonOffset" => polygon_offset(state, node),
        "Environment" => environment(state, node),
        "LocalFog" => {
            if node.read::<bool>("enabled").unwrap_or(true) {
                state.environment = fog97(node, state).unwrap_or(state.environment);
            }
        }
        "ClipPlane" => clip_plane(state, node),
        "FontStyle" => font_style(state, node),
        "Font" => font(state, node),
        "ProfileCoordinate2" => {
            if let Some(points) = node.acting::<[Vec2]>("point") {
                state.profile_coordinates = ProfileCoordinates::Two(points);
            }
        }
        "ProfileCoordinate3" => {
            if let Some(points) = node.acting::<[Vec3]>("point") {
                state.profile_coordinates = ProfileCoordinates::Three(points);
            }
        }
        "Profile" => profile(state, node),
        "ShadowStyle" => {
            let style = node.acting::<Choice>("style").unwrap_or(3);
            state.casts_shadow = style & 1 != 0;
        }
        "Texture2" | "Texture3" => texture2(state, node),
        "Texture2Transform" => texture2_transform(state, node),
        "Texture3Transform" => {
            state.texture_matrix *= transform(node, "scaleFactor").as_mat4();
        }
        "TextureMatrixTransform" => {
            let m = node.acting::<Mat4>("matrix").unwrap_or(Mat4::IDENTITY);
            state.texture_matrix *= m;
        }
        "TextureCoordinate2" => {
            if let Some(p) = node.acting::<[Vec2]>("point").filter(|p| !p.is_empty()) {
                state.texture_coordinates = TextureCoordinates::Two(p);
            }
        }
        "TextureCoordinate3" => {
            if let Some(p) = node.acting::<[Vec3]>("point").filter(|p| !p.is_empty()) {
                state.texture_coordinates = TextureCoordinates::Three(p);
            }
        }
        "TextureCoordinateBinding" => {
            state.texture_indexed = node.acting::<Choice>("value") != Some(2);
        }
        "TextureUnit" => state.texture_unit = node.acting::<i32>("unit").unwrap_or(0),
        "TextureCoordinateDefault" => state.texture_coordinates = TextureCoordinates::Default,
        "TextureCoordinateEnvironment" => {
            state.texture_coordinates = TextureCoordinates::Environment;
        }
        "TextureCoordinateObject" => {
            let factor = |name: &str, silent| node.acting::<Vec4>(name).unwrap_or(silent);
            state.texture_coordinates = TextureCoordinates::Object {
                s: factor("factorS", Vec4::X),
                t: factor("factorT", Vec4::Y),
            };
        }
        "TextureCoordinateSphere" => {
            state.texture_coordinates = TextureCoordinates::Wrapped(Wrapping::Sphere);
        }
        "TextureCoordinateCylinder" => {
            state.texture_coordinates = TextureCoordinates::Wrapped(Wrapping::Cylinder);
        }
        "TextureCoordinateCube" => {
            state.texture_coordinates = TextureCoordinates::Wrapped(Wrapping::Cube);
        }
        "TextureCoordinatePlane" => {
            state.texture_coordinates = TextureCoordinates::Plane {
                s: node.acting::<Vec3>("directionS").unwrap_or(Vec3::X),
                t: node.acting::<Vec3>("directionT").unwrap_or(Vec3::Y),
            };
        }
        "ResetTransform" => {
            if node.acting::<Choice>("whatToReset").unwrap_or(0) & 1 != 0 {
                state.world_from_object = DMat4::from_scale(DVec3::splat(1.0));
            }
        }
        "AntiSquish" => anti_squish(state, node),
        "SurroundScale" => {} // scales a dragger's handles, which are not drawn
        "Units" => units(state, node),
        _ => match local_matrix(node, class, time) {
            Some(matrix) => state.world_from_object *= matrix,
            None => return false,
        },
    }
    true
}

/// The matrix that a transformation node puts in front of what follows it.
pub fn local_matrix(node: NodeRef<'_>, class: &str, time: f64) -> Option<DMat4> {
    let vector = |name: &str, default: f32| {
        node.acting::<Vec3>(name)
            .unwrap_or(Vec3::splat(default))
            .as_dvec3()
    };
    let turn = |name: &str| node.acting::<Rotation>(name).unwrap_or(Rotation::IDENTITY);
    let speed = || f64::from(node.read::<f32>("speed").unwrap_or(1.0));
    let on = || node.read::<bool>("on").unwrap_or(true);
    Some(match class {
        "Transform" => transform(node, "scaleFactor"),
        "MatrixTransform" => node
            .acting::<Mat4>("matrix")
            .filter(|m| m.is_finite())
            .unwrap_or(Mat4::IDENTITY)
            .as_dmat4(),
        "Translation" => DMat4::from_translation(vector("translation", 0.0)),
        "Scale" => DMat4::from_scale(vector("scaleFactor", 1.0)),
        "Rotation" => DMat4::from_quat(quat(turn("rotation"))),
        "RotationXYZ" => {
            let axis = match node.acting::<Choice>("axis") {
                Some(1) => Vec3::Y,
                Some(2) => Vec3::Z,
                _ => Vec3::X,
            };
            let angle = node.acting::<f32>("angle").unwrap_or(0.0);
            DMat4::from_quat(quat(Rotation { axis, angle }))
        }
        // A turn every 1/speed seconds, on top of the angle in the file.
        "Rotor" => {
            let start = turn("rotation");
            let turned = if on() {
                std::f64::consts::TAU * speed() * time
            } else {
                0.0
            };
            let angle = start.angle + turned as f32;
            DMat4::from_quat(quat(Rotation { angle, ..start }))
        }
        // Back and forth every 1/speed seconds, slow at the ends.
        "Pendulum" => {
            let share = if on() { swing(speed() * time) } else { 0.0 };
            // Inputs of an engine: an ignore flag on them changes nothing.
            let end = |name: &str| quat(node.read::<Rotation>(name).unwrap_or(Rotation::IDENTITY));
            let (a, b) = (end("rotation0"), end("rotation1"));
            DMat4::from_quat(a.slerp(b, share))
        }
        "Shuttle" => {
            let share = if on() { swing(speed() * time) } else { 0.0 };
            let end = |name: &str| node.read::<Vec3>(name).unwrap_or_default().as_dvec3();
            let (a, b) = (end("translation0"), end("translation1"));
            DMat4::from_translation(a.lerp(b, share))
        }
        _ => return None,
    })
}

fn swing(cycles: f64) -> f64 {
    0.5 - 0.5 * libm::cos(std::f64::consts::TAU * cycles)
}

/// `Transform` of Inventor (`scaleFactor`) and of VRML 97 (`scale`): move, about the center turn,
/// and scale along the axes that `scaleOrientation` turns.
pub fn transform(node: NodeRef<'_>, scale: &str) -> DMat4 {
    let vector = |name: &str, default: f32| {
        node.acting::<Vec3>(name)
            .unwrap_or(Vec3::splat(default))
            .as_dvec3()
    };
    let turn = |name: &str| quat(node.acting::<Rotation>(name).unwrap_or(Rotation::IDENTITY));
    let center = vector("center", 0.0);
    let along = turn("scaleOrientation");
    DMat4::from_translation(vector("translation", 0.0) + center)
        * DMat4::from_quat(turn("rotation"))
        * DMat4::from_quat(along)
        * DMat4::from_scale(vector(scale, 1.0))
        * DMat4::from_quat(along.conjugate())
        * DMat4::from_translation(-center)
}

fn material<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let colors = |name: &str| node.acting::<[Vec3]>(name).filter(|c| !c.is_empty());
    let numbers = |name: &str| node.acting::<[f32]>(name).filter(|c| !c.is_empty());
    let m = &mut state.material;
    if let Some(c) = colors("ambientColor") {
        m.ambient = c[0];
    }
    if let Some(c) = colors("diffuseColor") {
        if let Diffuse::Packed(_) = m.diffuse {
            m.transparency = List::One(0.0); // packed colors carried it
        }
        m.diffuse = Diffuse::Colors(List::Many(c));
    }
    if let Some(c) = colors("specularColor") {
        m.specular = c[0];
    }
    if let Some(c) = colors("emissiveColor") {
        m.emissive = c[0];
    }
    if let Some(c) = numbers("shininess") {
        m.shininess = c[0];
    }
    if let Some(c) = numbers("transparency") {
        m.transparency = List::Many(c);
    }
    m.refraction = node
        .read::<f32>("refractionIndex")
        .or_else(|| node.read::<[f32]>("refractionIndex")?.first().copied())
        .filter(|n| n.is_finite() && *n > 0.0)
        .unwrap_or(1.0);
}

fn base_color<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let Some(c) = node.acting::<[Vec3]>("rgb").and_then(List::of) else {
        return;
    };
    state.material.diffuse = Diffuse::Colors(c);
}

fn packed_color<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let Some(c) = node
        .acting::<[u32]>("orderedRGBA")
        .filter(|c| !c.is_empty())
    else {
        return;
    };
    state.material.diffuse = Diffuse::Packed(c);
}

/// The binding by the name its class gives the value; two classes number them differently.
fn binding(node: NodeRef<'_>, field: &str, default: Binding) -> Option<Binding> {
    Some(Binding::from_value(node.acting::<Choice>(field)?, default))
}

fn material_binding<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(b) = binding(node, "value", Binding::Overall) {
        state.material_binding = b;
    }
}

fn normal_binding<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(b) = binding(node, "value", Binding::PerVertexIndexed) {
        state.normal_binding = b;
    }
}

fn normal<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(v) = node.acting::<[Vec3]>("vector") {
        state.normals = v;
    }
}

fn coordinate3<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(p) = node.acting::<[Vec3]>("point") {
        state.coordinates = Coordinates::Three(p);
    }
}

fn coordinate4<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(p) = node.acting::<[Vec4]>("point") {
        state.coordinates = Coordinates::Four(p);
    }
}

/// A `VertexProperty` as a node of the scene or in a shape's field: what it has wins.
pub fn vertex_property<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(p) = node.acting::<[Vec3]>("vertex").filter(|p| !p.is_empty()) {
        state.coordinates = Coordinates::Three(p);
    }
    if let Some(v) = node.acting::<[Vec3]>("normal").filter(|v| !v.is_empty()) {
        state.normals = v;
        if let Some(b) = binding(node, "normalBinding", Binding::PerVertexIndexed) {
            state.normal_binding = b;
        }
    }
    let colors = node
        .acting::<[u32]>("orderedRGBA")
        .filter(|c| !c.is_empty());
    if let Some(c) = colors {
        state.material.diffuse = Diffuse::Packed(c);
        if let Some(b) = binding(node, "materialBinding", Binding::Overall) {
            state.material_binding = b;
        }
    }
    if let Some(t) = node.acting::<[Vec3]>("texCoord3").filter(|t| !t.is_empty()) {
        state.texture_coordinates = TextureCoordinates::Three(t);
    } else if let Some(t) = node.acting::<[Vec2]>("texCoord").filter(|t| !t.is_empty()) {
        state.texture_coordinates = TextureCoordinates::Two(t);
    }
}

fn shape_hints<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(v) = node.acting::<Choice>("vertexOrdering") {
        state.hints.ordering = match v {
            1 => VertexOrdering::Clockwise,
            2 => VertexOrdering::Counterclockwise,
            _ => VertexOrdering::Unknown,
        };
    }
    if let Some(v) = node.acting::<Choice>("shapeType") {
        state.hints.solid = v == 1;
    }
    if let Some(v) = node.acting::<Choice>("faceType") {
        state.hints.convex = v == 1;
    }
    if let Some(v) = node.acting::<f32>("creaseAngle") {
        let silent = node
            .known_class()
            .and_then(|c| c.field("creaseAngle"))
            .is_some_and(|(i, _)| node.entry(i as u16).is_none());
        // VRML 1.0's default is 0.5, Inventor 2.1's 0.
        state.hints.crease_angle = if silent && state.vrml1 { 0.5 } else { v };
    }
}

fn light_model<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(v) = node.acting::<Choice>("model") {
        state.base_color = v == 0;
    }
}

fn complexity<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let old = state.complexity;
    state.complexity = Complexity {
        value: node.acting::<f32>("value").unwrap_or(old.value),
        kind: node.acting::<Choice>("type").unwrap_or(old.kind),
        texture_quality: node
            .acting::<f32>("textureQuality")
            .unwrap_or(old.texture_quality),
    };
}

fn draw_style<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if let Some(v) = node.acting::<Choice>("style") {
        state.drawing.style = match v {
            1 => DrawStyle::Lines,
            2 => DrawStyle::Points,
            3 => DrawStyle::Invisible,
            _ => DrawStyle::Filled,
        };
    }
    if let Some(v) = node.acting::<f32>("lineWidth") {
        state.drawing.line_width = v;
    }
    if let Some(v) = node.acting::<f32>("pointSize") {
        state.drawing.point_size = v;
    }
    if let Some(v) = node.acting::<u16>("linePattern") {
        state.drawing.line_pattern = v;
    }
}

/// OpenGL moves faces in depth by the factor times their slope and by units of the depth buffer's
/// resolution; of both only the sign is kept, which settles who wins in a plane.
fn polygon_offset<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let number = |name: &str| node.acting::<f32>(name).unwrap_or(1.0);
    let (factor, units) = (number("factor"), number("units"));
    let farther = if factor == 0.0 { units } else { factor };
    let on = node.acting::<bool>("on").unwrap_or(true);
    state.drawing.offset = match farther {
        _ if !on => 0,
        f if f > 0.0 => 1,
        f if f < 0.0 => -1,
        _ => 0,
    };
    state.drawing.offset_styles = node.acting::<Choice>("styles").unwrap_or(1);
}

fn environment<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let old = EnvironmentElement::DEFAULT;
    let color = node.acting::<Vec3>("ambientColor").unwrap_or(Vec3::ONE);
    let share = node.acting::<f32>("ambientIntensity").unwrap_or(0.2);
    state.environment = EnvironmentElement {
        ambient: color * share,
        attenuation: node
            .acting::<Vec3>("attenuation")
            .unwrap_or(old.attenuation),
        fog: match node.acting::<Choice>("fogType") {
            Some(1) => FogKind::Haze,
            Some(2) => FogKind::Fog,
            Some(3) => FogKind::Smoke,
            _ => FogKind::None,
        },
        fog_color: node.acting::<Vec3>("fogColor").unwrap_or(old.fog_color),
        visibility: node.acting::<f32>("fogVisibility").unwrap_or(0.0),
    };
}

/// The environment with the fog that a VRML 97 `Fog` or a `LocalFog` makes; `None` where it asks
/// for none. Its range is in the units of where it stands.
pub fn fog97(node: NodeRef<'_>, state: &State<'_>) -> Option<EnvironmentElement> {
    let range = node.read::<f32>("visibilityRange").unwrap_or(0.0);
    let scale = libm::cbrt(state.world_from_object.determinant().abs());
    let visibility = range * scale as f32;
    let kind = match node.read::<Text>("fogType") {
        Some("EXPONENTIAL") => FogKind::Exponential,
        _ => FogKind::Linear,
    };
    (visibility > 0.0 && visibility.is_finite()).then(|| EnvironmentElement {
        fog: kind,
        fog_color: node.read::<Vec3>("color").unwrap_or(Vec3::ONE),
        visibility,
        ..state.environment
    })
}

fn clip_plane<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    if node.acting::<bool>("on") == Some(false) {
        return;
    }
    let Some(plane) = node.acting::<Plane>("plane") else {
        return;
    };
    let world = state.world_from_object;
    let inverse = world.inverse();
    if !inverse.is_finite() {
        return;
    }
    let normal = plane.normal.as_dvec3();
    let turned = inverse.transpose().transform_vector3(normal);
    let on_plane = world.transform_point3(
        normal * f64::from(plane.distance) / normal.length_squared().max(f64::MIN_POSITIVE),
    );
    if let Some(n) = turned.try_normalize() {
        Arc::make_mut(&mut state.clip_planes).push((n, n.dot(on_plane)));
    }
}

/// The highlight of a `LocateHighlight` whose mode is `ON`: others wait for a cursor.
pub fn highlight(node: NodeRef<'_>) -> Option<Highlight> {
    let class = node.known_class()?;
    (class.is_a("LocateHighlight") && node.read::<Choice>("mode") == Some(1)).then(|| Highlight {
        color: node.read::<Vec3>("color").unwrap_or(Vec3::splat(0.3)),
        diffuse_too: node.read::<Choice>("style") == Some(1),
    })
}

fn font<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let old = state.font;
    state.font = FontElement {
        name: node.acting::<Text>("name").unwrap_or(old.name),
        size: node.acting::<f32>("size").unwrap_or(old.size),
        is_style: false,
        ..old
    };
}

fn font_style<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let family = node.acting::<Choice>("family").unwrap_or(0);
    state.font = FontElement {
        name: match family {
            1 => "Helvetica",
            2 => "Courier",
            _ => "Times",
        },
        size: node.acting::<f32>("size").unwrap_or(10.0),
        is_style: true,
        family,
        style: node.acting::<Choice>("style").unwrap_or(0),
    };
}

fn profile<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let entry = Profile {
        node,
        coordinates: state.profile_coordinates,
    };
    let profiles = Arc::make_mut(&mut state.profiles);
    if node.acting::<Choice>("linkage").unwrap_or(0) == 0 {
        profiles.clear();
    }
    profiles.push(entry);
}

fn texture2<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let repeats = |name: &str| node.acting::<Choice>(name) != Some(0x2900);
    state.texture = Some(TextureElement {
        node,
        model: match node.acting::<Choice>("model") {
            Some(0x2101) => TextureModel::Decal,
            Some(0xbe2) => TextureModel::Blend,
            Some(0x1e01) => TextureModel::Replace,
            _ => TextureModel::Modulate,
        },
        blend_color: node.acting::<Vec3>("blendColor").unwrap_or(Vec3::ZERO),
        repeat_s: repeats("wrapS"),
        repeat_t: repeats("wrapT"),
        repeat_r: repeats("wrapR"),
        quality: state.complexity.texture_quality,
    });
}

/// Inventor's texture transform: p' = p · (−c) S R c t, row vectors.
fn texture2_transform<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let pair = |name: &str, default: f32| {
        node.acting::<Vec2>(name)
            .unwrap_or(Vec2::splat(default))
            .extend(0.0)
    };
    let center = pair("center", 0.0);
    let scale = node.acting::<Vec2>("scaleFactor").unwrap_or(Vec2::ONE);
    let angle = node.acting::<f32>("rotation").unwrap_or(0.0);
    let turn = crate::grammar::value::Rotation {
        axis: Vec3::Z,
        angle,
    }
    .to_quat();
    state.texture_matrix *= Mat4::from_translation(pair("translation", 0.0) + center)
        * Mat4::from_quat(turn)
        * Mat4::from_scale(scale.extend(1.0))
        * Mat4::from_translation(-center);
}

/// Meters in each of Inventor's units, by the enumeration's value.
const UNITS: [f64; 14] = [
    1.0,
    0.01,
    0.001,
    1e-6,
    1e-6,
    1e-9,
    1e-10,
    1000.0,
    0.3048,
    0.0254,
    0.0254 / 72.0,
    0.9144,
    1609.344,
    1852.0,
];

fn units<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let index = node.acting::<Choice>("units").unwrap_or(0);
    let Some(&unit) = usize::try_from(index).ok().and_then(|i| UNITS.get(i)) else {
        return;
    };
    state.world_from_object *= DMat4::from_scale(DVec3::splat(unit / state.unit));
    state.unit = unit;
}

/// Makes the scale in force the same along every axis, so that handles keep their shape.
fn anti_squish<'a>(state: &mut State<'a>, node: NodeRef<'a>) {
    let matrix = state.world_from_object;
    let turn = rotation_of(matrix);
    let stretch = DMat4::from_quat(turn.conjugate()) * matrix;
    let scales = DVec3::new(
        stretch.x_axis.truncate().length(),
        stretch.y_axis.truncate().length(),
        stretch.z_axis.truncate().length(),
    );
    let principal = principal_stretches(stretch);
    let scale = match node.acting::<Choice>("sizing").unwrap_or(3) {
        0 => scales.x,
        1 => scales.y,
        2 => scales.z,
        4 => principal[0],
        5 => principal[2],
        6 => longest_diagonal(stretch),
        _ => principal.iter().sum::<f64>() / 3.0,
    };
    let origin = matrix.transform_point3(DVec3::ZERO);
    state.world_from_object = DMat4::from_translation(origin)
        * DMat4::from_quat(turn)
        * DMat4::from_scale(DVec3::splat(scale));
}

/// How much a symmetric matrix stretches along its own three axes, the most first: its
/// eigenvalues by the cosine formula for the cubic (Smith 1961).
fn principal_stretches(stretch: DMat4) -> [f64; 3] {
    let m = glam::DMat3::from_mat4(stretch);
    let mean = (m.x_axis.x + m.y_axis.y + m.z_axis.z) / 3.0;
    let rest = m - glam::DMat3::from_diagonal(DVec3::splat(mean));
    let square =
        rest.x_axis.length_squared() + rest.y_axis.length_squared() + rest.z_axis.length_squared();
    let spread = (square / 6.0).sqrt();
    if spread <= 1e-12 * mean.abs() {
        return [mean; 3];
    }
    let half = (rest.determinant() / (2.0 * spread.powi(3))).clamp(-1.0, 1.0);
    let angle = libm::acos(half) / 3.0;
    let third = std::f64::consts::TAU / 3.0;
    let most = mean + 2.0 * spread * libm::cos(angle);
    let least = mean + 2.0 * spread * libm::cos(angle + third);
    [most, 3.0 * mean - most - least, least]
}

/// The length that the longest of the four diagonals (±1, ±1, ±1) is stretched to, as Coin
/// measures it: from the center, and not against the diagonal's own √3.
fn longest_diagonal(stretch: DMat4) -> f64 {
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let lengths = corners.map(|(y, z)| stretch.transform_vector3(DVec3::new(1.0, y, z)).length());
    lengths.into_iter().fold(0.0, f64::max)
}

/// The light as it stands in the world; `None` where it is switched off.
pub fn light<'a>(state: &State<'a>, node: NodeRef<'a>) -> Option<LightElement> {
    let class = node.known_class()?;
    if node.read::<bool>("on") == Some(false) {
        return None;
    }
    let vrml97 = super::role::is_vrml97(class);
    let number = |name: &str, default: f32| node.read::<f32>(name).unwrap_or(default);
    let world = state.world_from_object;
    let name = class.name;
    let kind = if name.ends_with("DirectionalLight") || class.is_a("DirectionalLight") {
        LightKind::Directional
    } else if name.ends_with("SpotLight") || class.is_a("SpotLight") {
        if vrml97 {
            LightKind::Beam {
                beam_width: number("beamWidth", std::f32::consts::FRAC_PI_2),
                cut_off: number("cutOffAngle", std::f32::consts::FRAC_PI_4),
            }
        } else {
            LightKind::Spot {
                drop_off: number("dropOffRate", 0.0),
                cut_off: number("cutOffAngle", std::f32::consts::FRAC_PI_4),
            }
        }
    } else {
        LightKind::Point
    };
    let location = node.read::<Vec3>("location").unwrap_or(Vec3::Z).as_dvec3();
    let direction = node
        .read::<Vec3>("direction")
        .unwrap_or(Vec3::NEG_Z)
        .as_dvec3();
    // VRML 97 writes constant, linear, quadratic in each light; Inventor has it the other way
    // round in the Environment.
    let attenuation = if vrml97 {
        let a = node.read::<Vec3>("attenuation").unwrap_or(Vec3::X);
        Vec3::new(a.z, a.y, a.x)
    } else {
        state.environment.attenuation
    };
    Some(LightElement {
        kind,
        color: node.read::<Vec3>("color").unwrap_or(Vec3::ONE),
        intensity: number("intensity", 1.0),
        ambient: if vrml97 {
            number("ambientIntensity", 0.0)
        } else {
            0.0
        },
        position: world.transform_point3(location),
        direction: world
            .transform_vector3(direction)
            .try_normalize()
            .unwrap_or(DVec3::NEG_Z),
        attenuation,
        radius: if vrml97 {
            number("radius", 100.0)
        } else {
            f32::INFINITY
        },
        node: node.id,
    })
}

/// Texture rotation, for callers that build a matrix by hand.
pub fn turn_z(angle: f32) -> Quat {
    crate::grammar::value::Rotation {
        axis: Vec3::Z,
        angle,
    }
    .to_quat()
}

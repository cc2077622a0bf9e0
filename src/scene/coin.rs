//! What a file says as Coin takes it, where that is not what the file formats' own documents say.
//!
//! Only for holding pictures against Coin's: [`as_coin_reads`] rewrites a document so that the
//! rest of the program draws what Coin draws. What differs, each seen in Coin 4 with a scene of one
//! node (`docs/accuracy.md`): `~` after the fields of transformations, clip planes and texture
//! transforms changes nothing; a VRML 97 shape without a material is gray, not white; diffuse colors
//! above 1 wrap around in a byte; `TextureCoordinatePlane` multiplies by its directions' lengths,
//! not divides; the style in the name of a `Font` counts after a colon only. Of VRML 97, text has one
//! typeface, pictures in files come too late to be drawn, lines and points have the sum of the
//! diffuse and the emissive color, a `TextureTransform` scales before it turns and moves, and
//! lights reach without end and have no soft edge.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use crate::grammar::{self, Dialect};
use crate::iv::document::ClassRef;
use crate::iv::{Document, FieldEntry, Node, NodeId, NodeRef, Value};

/// Classes of which Coin takes every field, marked to be ignored or not; but for the `on` of a
/// `ClipPlane`.
const HEEDLESS: [&str; 9] = [
    "AntiSquish",
    "ClipPlane",
    "RotationXYZ",
    "Scale",
    "Texture3Transform",
    "TextureCoordinatePlane",
    "TextureMatrixTransform",
    "Transform",
    "Translation",
];

/// The document as Coin takes it.
pub fn as_coin_reads(document: &Document) -> Document {
    let mut out = document.clone();
    let plain = plain_appearance(&mut out);
    let mut lines = HashMap::new();
    for index in 0..document.nodes.len() {
        let id = NodeId(index as u32);
        let Some(class) = document.node(id).known_class() else {
            continue;
        };
        let node = &mut out.nodes[index];
        if HEEDLESS.contains(&class.name) {
            let heeds = |f: &FieldEntry| class.fields[usize::from(f.index)].name == "on";
            node.fields.iter_mut().for_each(|f| f.ignored &= heeds(f));
        }
        match class.name {
            "Material" | "BaseColor" => wrap_colors(node, class),
            "TextureCoordinatePlane" => invert_lengths(node),
            "Font" => plain_name(node, class),
            "ImageTexture" | "MovieTexture" => drop_fields(node, class, &["url"]),
            "PointLight" | "SpotLight" if class.dialects & Dialect::VRML97 != 0 => {
                set(node, class, "radius", Value::Float(f32::MAX));
                if class.name == "SpotLight" {
                    set(node, class, "beamWidth", Value::Float(std::f32::consts::PI));
                }
            }
            "TextureTransform" if class.dialects & Dialect::VRML97 != 0 => {
                reorder(document.node(id), node, class);
            }
            "FontStyle" if class.dialects & Dialect::VRML97 != 0 => {
                drop_fields(node, class, &["family", "style"]);
            }
            "Shape" if class.dialects & Dialect::VRML97 != 0 => {
                color_lines(document.node(id), &mut out, &mut lines);
                if let Some(plain) = plain {
                    clothe(&mut out, id, plain);
                }
            }
            _ => {}
        }
    }
    out
}

fn drop_fields(node: &mut Node, class: &grammar::Class, names: &[&str]) {
    node.fields
        .retain(|f| !names.contains(&class.fields[usize::from(f.index)].name));
}

fn set(node: &mut Node, class: &grammar::Class, name: &str, value: Value) {
    if let Some(entry) = entry_of(class.name, name, value) {
        node.fields.retain(|f| f.index != entry.index);
        node.fields.push(entry);
    }
}

/// Of `Times-Italic` the family alone; a style counts after a colon only.
fn plain_name(node: &mut Node, class: &grammar::Class) {
    for entry in &mut node.fields {
        if class.fields[usize::from(entry.index)].name == "name"
            && let Value::String(name) = &mut entry.value
            && let Some(dash) = name.find('-').filter(|_| !name.contains(':'))
        {
            *name = name[..dash].into();
        }
    }
}

/// The same picture from fields that are taken in the standard's order, where there are such: for a
/// scale that is even or is not turned.
fn reorder(from: NodeRef<'_>, node: &mut Node, class: &grammar::Class) {
    let pair = |name: &str, silent: f32| from.read::<Vec2>(name).unwrap_or(Vec2::splat(silent));
    let angle = from.read::<f32>("rotation").unwrap_or(0.0);
    let (scale, center) = (pair("scale", 1.0), pair("center", 0.0));
    if scale.x * scale.y == 0.0 || (angle != 0.0 && scale.x != scale.y) {
        return;
    }
    // R S (p - c) + c + t is R S (p + u).
    let turned = Vec2::from_angle(-angle).rotate(center + pair("translation", 0.0));
    set(node, class, "center", Value::Vec2(Vec2::ZERO));
    set(
        node,
        class,
        "translation",
        Value::Vec2(turned / scale - center),
    );
}

/// Gives a shape of lines or points without colors its material's two colors in one.
fn color_lines(
    shape: NodeRef<'_>,
    out: &mut Document,
    known: &mut HashMap<NodeId, Option<NodeId>>,
) {
    let geometry = shape.node_in("geometry");
    let is_line = |g: &NodeRef<'_>| {
        let class = g.known_class().map_or("", |c| c.name);
        ["IndexedLineSet", "PointSet"].contains(&class) && g.node_in("color").is_none()
    };
    let appearance = shape
        .node_in("appearance")
        .filter(|_| geometry.is_some_and(|g| is_line(&g)));
    let Some(material) = appearance.and_then(|a| a.node_in("material")) else {
        return;
    };
    let colored = *known.entry(material.id).or_insert_with(|| {
        let color =
            |name: &str, silent: f32| material.read::<Vec3>(name).unwrap_or(Vec3::splat(silent));
        let sum = color("diffuseColor", 0.8) + color("emissiveColor", 0.0);
        let entry = entry_of("Material", "emissiveColor", Value::Vec3(wrapped(sum)))?;
        let material = out.add(node_of("Material", vec![entry])?);
        let entry = entry_of("Appearance", "material", Value::Node(Some(material)))?;
        Some(out.add(node_of("Appearance", vec![entry])?))
    });
    let class = shape.known_class();
    if let (Some(colored), Some(class)) = (colored, class) {
        let value = Value::Node(Some(colored));
        set(
            &mut out.nodes[shape.id.0 as usize],
            class,
            "appearance",
            value,
        );
    }
}

fn node_of(class: &str, fields: Vec<FieldEntry>) -> Option<Node> {
    let class = grammar::by_name(class, Dialect::VRML97)?;
    Some(Node::made(class, fields, Vec::new()))
}

/// An `Appearance` with a `Material` that is gray whatever the light, where the document has
/// shapes that may need it.
fn plain_appearance(document: &mut Document) -> Option<(NodeId, NodeId)> {
    let class = |name| grammar::by_name(name, Dialect::VRML97).map(|c| ClassRef::Known(c.id));
    if !document
        .nodes
        .iter()
        .any(|n| Some(n.class) == class("Shape"))
    {
        return None;
    }
    let gray = vec![
        entry_of("Material", "diffuseColor", Value::Vec3(Vec3::ZERO))?,
        entry_of("Material", "emissiveColor", Value::Vec3(Vec3::splat(0.8)))?,
    ];
    let material = document.add(node_of("Material", gray)?);
    let entry = entry_of("Appearance", "material", Value::Node(Some(material)))?;
    let appearance = document.add(node_of("Appearance", vec![entry])?);
    Some((appearance, material))
}

fn entry_of(class: &str, field: &str, value: Value) -> Option<FieldEntry> {
    FieldEntry::made(grammar::by_name(class, Dialect::VRML97)?, field, value)
}

/// Gives a shape an appearance, and its appearance a material, unless it has colors of its own.
fn clothe(document: &mut Document, shape: NodeId, plain: (NodeId, NodeId)) {
    let geometry = document.node(shape).node_in("geometry");
    if geometry.is_some_and(|g| g.node_in("color").is_some()) {
        return;
    }
    let value = |id| Value::Node(Some(id));
    let appearance = document.node(shape).node_in("appearance").map(|n| n.id);
    let (id, entry) = match appearance {
        None => (shape, entry_of("Shape", "appearance", value(plain.0))),
        Some(id) if document.node(id).node_in("material").is_none() => {
            (id, entry_of("Appearance", "material", value(plain.1)))
        }
        Some(_) => return,
    };
    if let Some(entry) = entry {
        let fields = &mut document.nodes[id.0 as usize].fields;
        fields.retain(|f| f.index != entry.index);
        fields.push(entry);
    }
}

/// Colors as the bytes of a word that they are packed into: too large ones spill over.
fn wrap_colors(node: &mut Node, class: &grammar::Class) {
    for entry in &mut node.fields {
        let name = class.fields[usize::from(entry.index)].name;
        if let Value::Vec3s(colors) = &mut entry.value
            && ["diffuseColor", "rgb"].contains(&name)
        {
            colors.iter_mut().for_each(|c| *c = wrapped(*c));
        }
    }
}

fn wrapped(color: Vec3) -> Vec3 {
    if color.max_element() <= 1.0 {
        return color;
    }
    let [r, g, b] = color.to_array().map(|v| (v * 255.0 + 0.5) as u32);
    let packed = r.wrapping_shl(24) | g.wrapping_shl(16) | b.wrapping_shl(8);
    Vec3::from_array([24, 16, 8].map(|bits| f32::from((packed >> bits) as u8) / 255.0))
}

fn invert_lengths(node: &mut Node) {
    for entry in &mut node.fields {
        if let Value::Vec3(v) = &mut entry.value {
            *v /= v.length_squared().max(f32::MIN_POSITIVE);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::iv::Limits;
    use crate::scene::handles::NoFiles;
    use crate::scene::{CompileOptions, RenderScene};

    fn document(text: &str) -> Document {
        let text = text.as_bytes().to_vec();
        Document::read("a", text, Arc::new(NoFiles), &Limits::default()).expect("reads")
    }

    fn compiled(text: &str, as_coin: bool) -> RenderScene {
        let options = CompileOptions {
            as_coin,
            ..CompileOptions::default()
        };
        RenderScene::compile(&document(text), &options).expect("compiles")
    }

    #[test]
    fn a_shape_without_a_material_is_white_and_gray_in_coin() {
        let text = "#VRML V2.0 utf8\nShape { geometry Box { } } Shape { appearance Appearance { } geometry Box { } }";
        for (as_coin, color) in [(false, Vec3::ONE), (true, Vec3::splat(0.8))] {
            let scene = compiled(text, as_coin);
            let hit = scene.hit_any_side(&crate::bvh::Ray::new(Vec3::ZERO, Vec3::NEG_Z));
            let surface = scene.surface(&hit.expect("inside the box"));
            let seen = if surface.base_color {
                surface.diffuse[0]
            } else {
                surface.diffuse[0] + surface.emissive
            };
            assert_eq!(seen, color);
        }
    }

    #[test]
    fn lines_have_both_colors_of_their_material_in_coin() {
        let text = "#VRML V2.0 utf8\nShape { appearance Appearance { material Material { diffuseColor 0 .2 0 emissiveColor .5 .2 0 } }\n  geometry IndexedLineSet { coord Coordinate { point [0 -1 -1, 0 1 -1] } coordIndex [0 1] } }";
        for (as_coin, color) in [
            (false, Vec3::new(0.5, 0.2, 0.0)),
            (true, Vec3::new(0.5, 0.4, 0.0)),
        ] {
            let scene = compiled(text, as_coin);
            let hit = scene.hit(&crate::bvh::Ray::new(Vec3::ZERO, Vec3::NEG_Z));
            let surface = scene.surface(&hit.expect("the line"));
            assert!((surface.diffuse[0] - color).length() < 1e-6);
        }
    }

    #[test]
    fn a_texture_transform_is_taken_in_inventor_s_order_in_coin() {
        let text = "#VRML V2.0 utf8\nShape { appearance Appearance { material Material { } texture PixelTexture { image 1 1 1 0xff }\n  textureTransform TextureTransform { scale 2 2 center .5 0 translation .25 0 rotation 1.5707963 } } geometry Box { } }";
        // (1, 0): by the standard moved to 1.25, turned about the center, doubled from 0 and moved back.
        for (as_coin, at) in [(false, Vec2::new(-0.5, 3.5)), (true, Vec2::new(0.75, 1.0))] {
            let scene = compiled(text, as_coin);
            let hit = scene.hit_any_side(&crate::bvh::Ray::new(Vec3::ZERO, Vec3::NEG_Z));
            let surface = scene.surface(&hit.expect("inside the box"));
            let matrix = surface.texture.as_ref().expect("a texture").matrix;
            let seen = matrix.transform_point3(Vec3::X).truncate();
            assert!((seen - at).length() < 1e-5, "{seen} for {at}");
        }
    }

    /// Measured: the sides of a billboard seen by a camera that is turned by 0.3.
    #[test]
    fn a_billboard_faces_the_eye_and_in_coin_the_picture() {
        let text = "#VRML V2.0 utf8\nViewpoint { position 6 3 0 orientation 0 1 0 .3 }\nBillboard { children Shape { geometry IndexedFaceSet { coord Coordinate { point [-1 -1 0, 1 -1 0, 1 1 0, -1 1 0] } coordIndex [0 1 2 3] } } }";
        let document = document(text);
        let survey = RenderScene::survey(&document, &CompileOptions::default());
        for (as_coin, right) in [(false, 0.0), (true, 0.9553)] {
            let options = CompileOptions {
                camera: survey.cameras.first().cloned(),
                as_coin,
                ..CompileOptions::default()
            };
            let scene = RenderScene::compile(&document, &options).expect("compiles");
            let (_, max) = scene.bounds().expect("something");
            assert!((max.x - right).abs() < 1e-3, "{max} as Coin: {as_coin}");
        }
    }

    #[test]
    fn an_ignored_translation_moves_nothing_but_in_coin() {
        let text = "#Inventor V2.1 ascii\nTranslation { translation 4 0 0 ~ } Cube { }";
        let right = |as_coin| compiled(text, as_coin).bounds().map(|b| b.1.x);
        assert_eq!((right(false), right(true)), (Some(1.0), Some(5.0)));
    }

    #[test]
    fn a_color_above_one_wraps_in_its_byte_and_spills_into_the_next() {
        assert_eq!(wrapped(Vec3::ONE), Vec3::ONE);
        let red = wrapped(Vec3::new(1.2, 0.0, 0.0));
        assert_eq!(red, Vec3::new(50.0 / 255.0, 0.0, 0.0));
        let green = wrapped(Vec3::new(0.0, 1.2, 0.0));
        assert_eq!(green, Vec3::new(1.0 / 255.0, 50.0 / 255.0, 0.0));
    }
}

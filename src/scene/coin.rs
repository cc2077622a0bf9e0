//! What a file says as Coin takes it, where that is not what the file formats' own documents say.
//!
//! Only for holding pictures against Coin's: [`as_coin_reads`] rewrites a document so that the
//! rest of the program draws what Coin draws. What differs, each seen in Coin 4 with a scene of one
//! node (`docs/accuracy.md`): `~` after the fields of transformations, clip planes and texture
//! transforms changes nothing; a VRML 97 shape without a material is gray, not white; diffuse colors
//! above 1 wrap around in a byte; `TextureCoordinatePlane` multiplies by its directions' lengths,
//! not divides; VRML 97 text has one typeface.

use glam::Vec3;

use crate::diag::Span;
use crate::grammar::{self, Dialect};
use crate::graph::read::Fields;
use crate::iv::document::ClassRef;
use crate::iv::{Document, FieldEntry, Node, NodeId, Value};

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
            "FontStyle" if class.dialects & Dialect::VRML97 != 0 => {
                let kept = |f: &FieldEntry| {
                    !["family", "style"].contains(&class.fields[usize::from(f.index)].name)
                };
                node.fields.retain(kept);
            }
            "Shape" if class.dialects & Dialect::VRML97 != 0 => {
                if let Some(plain) = plain {
                    clothe(&mut out, id, plain);
                }
            }
            _ => {}
        }
    }
    out
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
    let node = |class, fields| Node {
        class,
        name: None,
        fields,
        children: Vec::new(),
        span: Span::default(),
        source: 0,
    };
    let gray = vec![
        entry_of("Material", "diffuseColor", Value::Vec3(Vec3::ZERO))?,
        entry_of("Material", "emissiveColor", Value::Vec3(Vec3::splat(0.8)))?,
    ];
    let material = document.add(node(class("Material")?, gray));
    let entry = entry_of("Appearance", "material", Value::Node(Some(material)))?;
    let appearance = document.add(node(class("Appearance")?, vec![entry]));
    Some((appearance, material))
}

fn entry_of(class: &str, field: &str, value: Value) -> Option<FieldEntry> {
    let (index, _) = grammar::by_name(class, Dialect::VRML97)?.field(field)?;
    Some(FieldEntry {
        index: index as u16,
        value,
        ignored: false,
        connection: None,
        span: Span::default(),
    })
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

    fn compiled(text: &str, as_coin: bool) -> RenderScene {
        let text = text.as_bytes().to_vec();
        let document = Document::read("a", text, Arc::new(NoFiles), &Limits::default());
        let options = CompileOptions {
            as_coin,
            ..CompileOptions::default()
        };
        RenderScene::compile(&document.expect("reads"), &options).expect("compiles")
    }

    #[test]
    fn a_shape_without_a_material_is_white_and_gray_in_coin() {
        let text = "#VRML V2.0 utf8\nShape { geometry Box { } } Shape { appearance Appearance { } geometry Box { } }";
        for (as_coin, color) in [(false, Vec3::ONE), (true, Vec3::splat(0.8))] {
            let scene = compiled(text, as_coin);
            let hit = scene.hit_any_side(&crate::scene::Ray::new(Vec3::ZERO, Vec3::NEG_Z));
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

//! States in Inventor's terms what a file of VRML means otherwise.
//!
//! Files of VRML 1.0 are written as Inventor V2.1, with the same nodes. The languages differ in
//! defaults, in `PER_VERTEX`, which uses indices in VRML 1.0, and in materials of emissive colors
//! alone, which are not lit there. VRML97 has a binary form only in Inventor's files. It has no
//! ambient light by default, and a headlight beside other lights.

use std::borrow::Cow;
use std::collections::HashSet;

use glam::Vec3;
use ivcam_base::diag::Span;

use super::document::{ClassRef, Document, Node, NodeRef};
use super::write::Format;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    ClassId, Field, class, environment, indexed_face_set, light_model, material, material_binding,
    shape_hints, vrml97_navigation_info as navigation_info97,
};

/// The crease angle of VRML 1.0 where a file states none; Inventor's is 0.
pub(crate) const CREASE_ANGLE: f32 = 0.5;

impl Document {
    /// Returns the document in Inventor's terms, which is another one only for VRML. A format that
    /// keeps VRML97 needs no other terms for it.
    pub fn in_inventor(&self, format: Format) -> Cow<'_, Self> {
        if self.format.starts_with("VRML V1") {
            Cow::Owned(self.vrml1_in_inventor())
        } else if format == Format::Binary && (self.is_vrml97() || self.is_x3d()) {
            Cow::Owned(self.vrml97_in_inventor())
        } else {
            Cow::Borrowed(self)
        }
    }

    fn vrml97_in_inventor(&self) -> Self {
        let mut document = self.clone();
        let classes = [class::NAVIGATION_INFO, class::VRML97_NAVIGATION_INFO];
        let classes = classes.map(ClassRef::Known);
        if !document.nodes.iter().any(|n| classes.contains(&n.class)) {
            let info = added(&mut document, class::VRML97_NAVIGATION_INFO);
            let headlight = navigation_info97::HEADLIGHT.index;
            document.store(info, headlight, Value::Bool(true));
            document.roots.insert(0, info);
        }
        let dark = added(&mut document, class::ENVIRONMENT);
        let ambient = environment::AMBIENT_INTENSITY.index;
        document.store(dark, ambient, Value::Float(0.0));
        document.roots.insert(0, dark);
        document
    }

    fn vrml1_in_inventor(&self) -> Self {
        let mut document = self.clone();
        for id in document.ids() {
            state_differences(&mut document, id);
        }
        light_by_materials(&mut document);
        if document.ids().any(|id| has_creases(document.node(id))) {
            let hints = added(&mut document, class::SHAPE_HINTS);
            state_crease_angle(&mut document, hints);
            match document.roots[..] {
                [root] if document.node(root).class_id() == Some(class::SEPARATOR) => {
                    let children = &mut document.nodes[root.0 as usize].children;
                    children.insert(0, hints);
                }
                _ => document.roots.insert(0, hints),
            }
        }
        document
    }
}

impl<'a> NodeRef<'a> {
    /// Returns the colors of a material of VRML 1.0 that is not lit: the fields `ambientColor`,
    /// `diffuseColor` and `specularColor` are stated and empty, as those of computed light.
    pub(crate) fn computed_colors(self) -> Option<&'a [Vec3]> {
        let lit = [
            material::AMBIENT_COLOR,
            material::DIFFUSE_COLOR,
            material::SPECULAR_COLOR,
        ];
        let is_empty = |field: Field<[Vec3]>| self.acting(field).is_some_and(<[Vec3]>::is_empty);
        let emissive = self.acting(material::EMISSIVE_COLOR)?;
        (!emissive.is_empty() && lit.into_iter().all(is_empty)).then_some(emissive)
    }
}

/// States the default of a `ShapeHints`, and the indices of a binding.
fn state_differences(document: &mut Document, id: NodeId) {
    let node = document.node(id);
    match node.class_id() {
        Some(class::SHAPE_HINTS) if !node.states(shape_hints::CREASE_ANGLE) => {
            state_crease_angle(document, id);
        }
        // Both classes have the same fields and values.
        Some(class::MATERIAL_BINDING | class::NORMAL_BINDING)
            if node.get(material_binding::VALUE) == material_binding::VALUE_PER_VERTEX =>
        {
            let value = Value::Int(material_binding::VALUE_PER_VERTEX_INDEXED);
            document.store(id, material_binding::VALUE.index, value);
        }
        _ => {}
    }
}

fn state_crease_angle(document: &mut Document, hints: NodeId) {
    let value = Value::Float(CREASE_ANGLE);
    document.store(hints, shape_hints::CREASE_ANGLE.index, value);
}

/// Whether the crease angle may act on a node: a shape with an index of one face has no edges
/// between faces.
fn has_creases(node: NodeRef<'_>) -> bool {
    let is_one_face = || {
        let index = node.get(indexed_face_set::COORD_INDEX);
        let faces = index.split(|&i| i < 0).filter(|face| !face.is_empty());
        faces.count() < 2
    };
    node.class_id().is_some_and(|class| {
        class.get().descends_from(class::VERTEX_SHAPE)
            && !(class == class::INDEXED_FACE_SET && is_one_face())
    })
}

/// Follows each material by the `LightModel` that it has in VRML 1.0, if one of them is not lit.
fn light_by_materials(document: &mut Document) {
    let is_material = |id: &NodeId| document.node(*id).class_id() == Some(class::MATERIAL);
    let materials: Vec<NodeId> = document.ids().filter(is_material).collect();
    let computed = |id: &&NodeId| document.node(**id).computed_colors().is_some();
    let computed: HashSet<NodeId> = materials.iter().filter(computed).copied().collect();
    if computed.is_empty() {
        return;
    }
    let models = [light_model::MODEL_PHONG, light_model::MODEL_BASE_COLOR].map(|model| {
        let id = added(document, class::LIGHT_MODEL);
        document.store(id, light_model::MODEL.index, Value::Int(model));
        id
    });
    for id in &computed {
        let colors = document.node(*id).computed_colors().map(<[_]>::to_vec);
        let colors = Value::Vec3s(colors.unwrap_or_default());
        document.store(*id, material::DIFFUSE_COLOR.index, colors);
    }
    let materials: HashSet<NodeId> = materials.into_iter().collect();
    let with_model = |list: &mut Vec<NodeId>| {
        if list.iter().any(|id| materials.contains(id)) {
            let model = |id| models[usize::from(computed.contains(&id))];
            let after = |id| materials.contains(&id).then(|| model(id));
            let list_of = |id| std::iter::once(id).chain(after(id));
            *list = list.iter().copied().flat_map(list_of).collect();
        }
    };
    document
        .nodes
        .iter_mut()
        .map(|node| &mut node.children)
        .chain([&mut document.roots])
        .for_each(with_model);
}

/// Adds a node of the main file.
fn added(document: &mut Document, class: ClassId) -> NodeId {
    document.add(Node {
        class: ClassRef::Known(class),
        name: None,
        fields: Vec::new(),
        children: Vec::new(),
        span: Span::default(),
        source: 0,
    })
}

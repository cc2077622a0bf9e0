//! Writes a document in VRML97 or X3D as X3D in its XML encoding, node by node. Where a texture
//! replaces the colors below it, the version is 3.3, and where it multiplies them, 4.0.
//!
//! The tasks that remain are on an explicit stack, because files may nest deeper than recursion
//! allows. Names after `DEF` are unique in the whole file, as identifiers of XML have to be.

use std::collections::{HashMap, HashSet};
use std::mem;

use glam::{Vec3, Vec4};
use ivcam_inventor::grammar::value::{NodeId, Value};
use ivcam_inventor::grammar::{FieldType, class, vrml97_spot_light as spot97};
use ivcam_inventor::iv::declarations::{Access, Interface, Proto, Route};
use ivcam_inventor::iv::document::{ClassRef, Document, FieldEntry};
use ivcam_render::scene::model::Feature;

use super::values::{attribute, escaped};
use crate::export::indent::indent;
use crate::export::losses::Losses;
use crate::export::names::Names;

/// How the textures of the document meet the colors below them, which is a version of X3D.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(in crate::export) enum Textures {
    /// A texture multiplies the diffuse color, as in X3D 4.
    Multiply,
    /// A texture with color replaces the diffuse color and those of vertices, and one with alpha
    /// the transparency, as in VRML97 and X3D 3.3.
    Replace,
}

/// The class of a node, as X3D writes it.
#[derive(Clone, Copy)]
enum XmlElement<'d> {
    /// A node of VRML97 that X3D has too, also a `Script` without declared fields.
    Known(&'static str),
    /// A `Script` with declared fields.
    Script(&'d [Interface]),
    /// An instance of the prototype of an extension.
    Instance(u32),
}

/// Something that remains to be written. The next task is last on the stack.
enum XmlTask<'d> {
    /// A node, in a field of the node around it.
    Node { id: NodeId, field: &'d str },
    /// The end of an element.
    End(&'static str),
    /// A whole line.
    Line(String),
    /// A line that begins an element.
    Begin(String),
}

/// The state of the writer.
struct XmlWriter<'d, 'l> {
    document: &'d Document,
    textures: Textures,
    losses: &'l mut Losses,
    out: String,
    indent: usize,
    names: Names,
    /// The names after `DEF`.
    tokens: HashMap<NodeId, String>,
    /// The nodes that are written.
    written: HashSet<NodeId>,
    /// The nodes that are used several times or by routes, so that they need a name.
    shared: HashSet<NodeId>,
    /// The `IS` links of the prototype that is being written.
    links: HashMap<NodeId, Vec<(&'d str, &'d str)>>,
    /// The names of prototypes by their extensions.
    proto_names: HashMap<u32, String>,
    /// The prototypes that remain to be written, by the one whose body declares them.
    within: HashMap<Option<usize>, Vec<usize>>,
}

/// Writes a document in VRML97 as X3D. What X3D does not have is added to `losses`.
pub(in crate::export) fn write_xml(
    document: &Document,
    textures: Textures,
    losses: &mut Losses,
) -> Vec<u8> {
    let within = document.protos_by_body();
    let mut writer = XmlWriter {
        shared: shared(document, &within),
        document,
        textures,
        losses,
        out: String::new(),
        indent: 0,
        names: Names::default(),
        tokens: HashMap::new(),
        written: HashSet::new(),
        links: HashMap::new(),
        proto_names: HashMap::new(),
        within,
    };
    writer.name_protos();
    writer.document();
    writer.out.into_bytes()
}

/// Returns the nodes that are used several times in what is written, or by a route.
fn shared(document: &Document, within: &HashMap<Option<usize>, Vec<usize>>) -> HashSet<NodeId> {
    let mut shared: HashSet<NodeId> = HashSet::new();
    let mut stack = document.roots.clone();
    let mut routes: Vec<&Route> = document.stated_routes.iter().collect();
    for &place in within.values().flatten() {
        let proto = &document.protos.list[place];
        stack.push(proto.defaults);
        stack.extend(&proto.body);
        routes.extend(&proto.routes);
    }
    let mut seen = HashSet::new();
    while let Some(id) = stack.pop() {
        if !seen.insert(id) {
            shared.insert(id);
            continue;
        }
        let node = &document.nodes[id.0 as usize];
        stack.extend(&node.children);
        stack.extend(node.fields.iter().flat_map(|field| nodes_of(&field.value)));
    }
    shared.extend(routes.iter().flat_map(|route| [route.from, route.to]));
    shared
}

/// Returns the nodes in a value.
fn nodes_of(value: &Value) -> &[NodeId] {
    match value {
        Value::Node(Some(id)) => std::slice::from_ref(id),
        Value::Nodes(list) => list,
        _ => &[],
    }
}

/// Returns the name in X3D of a field or event of a class of VRML97.
fn field_name<'n>(class: &str, name: &'n str) -> &'n str {
    match (class, name) {
        ("LOD", "level") | ("Switch", "choice") => "children",
        ("LOD", "set_level") | ("Switch", "set_choice") => "set_children",
        ("LOD", "level_changed") | ("Switch", "choice_changed") => "children_changed",
        ("Collision", "collide") => "enabled",
        ("Collision", "set_collide") => "set_enabled",
        ("Collision", "collide_changed") => "enabled_changed",
        _ => name,
    }
}

/// Returns the field that X3D assumes for a node of a class.
fn default_field(class: &str) -> &'static str {
    match class {
        "Appearance" => "appearance",
        "Material" => "material",
        "ImageTexture" | "MovieTexture" | "PixelTexture" => "texture",
        "TextureTransform" => "textureTransform",
        "Box" | "Cone" | "Cylinder" | "Sphere" | "ElevationGrid" | "Extrusion"
        | "IndexedFaceSet" | "IndexedLineSet" | "PointSet" | "Text" => "geometry",
        "FontStyle" => "fontStyle",
        "Color" | "ColorRGBA" => "color",
        "Coordinate" => "coord",
        "Normal" => "normal",
        "TextureCoordinate" => "texCoord",
        "AudioClip" => "source",
        _ => "children",
    }
}

/// Returns whether X3D has a class of VRML97 with the same fields. The NURBS and the geospatial
/// nodes of Amendment 1 became nodes with other fields.
fn is_in_x3d(class: &str) -> bool {
    let changed = [
        "CoordinateDeformer",
        "TrimmedSurface",
        "Contour2D",
        "Polyline2D",
        "KeySensor",
    ];
    let is_changed = class.contains("Nurbs") || class.starts_with("Geo");
    !is_changed && !changed.contains(&class)
}

/// Returns X3D's word for the access to a field.
fn access_type(access: Access) -> &'static str {
    match access {
        Access::Field => "initializeOnly",
        Access::ExposedField => "inputOutput",
        Access::EventIn => "inputOnly",
        Access::EventOut => "outputOnly",
    }
}

impl<'d> XmlWriter<'d, '_> {
    fn document(&mut self) {
        self.line("<?xml version='1.0' encoding='UTF-8'?>");
        let version = match self.textures {
            Textures::Multiply => "4.0",
            Textures::Replace => "3.3",
        };
        self.line(&format!(
            "<!DOCTYPE X3D PUBLIC 'ISO//Web3D//DTD X3D {version}//EN' \
             'https://www.web3d.org/specifications/x3d-{version}.dtd'>",
        ));
        self.begin(&format!(
            "<X3D profile='Immersive' version='{version}' \
             xmlns:xsd='http://www.w3.org/2001/XMLSchema-instance' \
             xsd:noNamespaceSchemaLocation='https://www.web3d.org/specifications/x3d-{version}.xsd'>",
        ));
        self.begin("<head>");
        let parallel = ClassRef::Known(class::ORTHO_VIEWPOINT);
        if self.document.nodes.iter().any(|n| n.class == parallel) {
            // The profile has level 2 (ISO 19775-1, annex E).
            self.line("<component level='3' name='Navigation'/>");
        }
        let version = env!("CARGO_PKG_VERSION");
        self.line(&format!(
            "<meta content='ivcam {version}' name='generator'/>"
        ));
        self.end("head");
        self.begin("<Scene>");
        self.protos_within(None);
        let document = self.document;
        self.scope(&document.roots, &document.stated_routes);
        self.end("Scene");
        self.end("X3D");
    }

    fn line(&mut self, text: &str) {
        indent(&mut self.out, "  ", self.indent);
        self.out += text;
        self.out.push('\n');
    }

    fn begin(&mut self, text: &str) {
        self.line(text);
        self.indent += 1;
    }

    fn end(&mut self, element: &str) {
        self.indent -= 1;
        self.line(&format!("</{element}>"));
    }

    /// Gives every prototype a name of its own, in the order in which they are declared.
    fn name_protos(&mut self) {
        let mut names = Names::default();
        for proto in &self.document.protos.list {
            let wanted = &self.document.extensions[proto.extension as usize].name;
            let name = names.identifier(wanted);
            self.proto_names.insert(proto.extension, name);
        }
    }

    /// Writes the prototypes that are declared in the body of another, or at the top level.
    ///
    /// This recurses as deep as declarations nest, which the reader limits to the depth of nodes;
    /// beyond 100 levels they are left out.
    fn protos_within(&mut self, around: Option<usize>) {
        for place in self.within.remove(&around).unwrap_or_default() {
            let document = self.document;
            let proto = &document.protos.list[place];
            if self.indent > 2 * 100 {
                self.lose(
                    proto.defaults,
                    "nested-proto",
                    "the deeply nested PROTO is left out",
                );
                continue;
            }
            self.proto(place, proto);
        }
    }

    fn proto(&mut self, place: usize, proto: &'d Proto) {
        let name = self.proto_names[&proto.extension].clone();
        if proto.external {
            let urls = attribute(&Value::Strings(proto.urls.clone()), FieldType::MFString);
            self.begin(&format!("<ExternProtoDeclare name='{name}' url='{urls}'>"));
            for item in &proto.interface {
                self.line(&format!("<field {}/>", declared(item)));
            }
            self.end("ExternProtoDeclare");
            return;
        }
        self.begin(&format!("<ProtoDeclare name='{name}'>"));
        if !proto.interface.is_empty() {
            self.begin("<ProtoInterface>");
            let items = proto.interface.iter();
            let mut tasks: Vec<XmlTask<'d>> = items
                .flat_map(|item| self.declared_field(proto.defaults, item))
                .collect();
            tasks.reverse();
            self.apart(|this| this.run(tasks));
            self.end("ProtoInterface");
        }
        self.begin("<ProtoBody>");
        self.protos_within(Some(place));
        let outer = mem::take(&mut self.links);
        for link in &proto.links {
            let of_node = self.links.entry(link.node).or_default();
            of_node.push((&link.name, &link.interface));
        }
        self.apart(|this| this.scope(&proto.body, &proto.routes));
        self.links = outer;
        self.end("ProtoBody");
        self.end("ProtoDeclare");
    }

    /// Writes something in a scope of its own, from which no node outside can be used, and no node
    /// in it from outside.
    fn apart(&mut self, write: impl FnOnce(&mut Self)) {
        let outside = (mem::take(&mut self.written), mem::take(&mut self.tokens));
        write(self);
        (self.written, self.tokens) = outside;
    }

    /// Writes nodes and the routes between them.
    fn scope(&mut self, nodes: &'d [NodeId], routes: &'d [Route]) {
        let tasks = nodes.iter().rev().map(|&id| node(id, "children"));
        self.run(tasks.collect());
        for route in routes {
            let name = |id| self.tokens.get(id).filter(|_| self.written.contains(id));
            let (Some(from), Some(to)) = (name(&route.from), name(&route.to)) else {
                continue; // One of the nodes is not written, which is a loss of its own.
            };
            let [output, input] = [(route.from, &route.output), (route.to, &route.input)]
                .map(|(id, name)| escaped(field_name(self.class_name(id), name)));
            self.line(&format!(
                "<ROUTE fromField='{output}' fromNode='{from}' toField='{input}' toNode='{to}'/>"
            ));
        }
    }

    /// Carries out tasks and those that they create.
    fn run(&mut self, mut tasks: Vec<XmlTask<'d>>) {
        while let Some(task) = tasks.pop() {
            match task {
                XmlTask::Line(text) => self.line(&text),
                XmlTask::Begin(text) => self.begin(&text),
                XmlTask::End(element) => self.end(element),
                XmlTask::Node { id, field } => self.node(id, field, &mut tasks),
            }
        }
    }

    /// Returns the name of the class of VRML97.
    fn class_name(&self, id: NodeId) -> &'d str {
        match self.document.nodes[id.0 as usize].class {
            ClassRef::Known(class) => class.get().name,
            ClassRef::Extension(i) => &self.document.extensions[i as usize].name,
        }
    }

    /// Returns how X3D writes a node, or `None` if it does not have the class.
    fn element(&self, id: NodeId) -> Option<XmlElement<'d>> {
        match self.document.nodes[id.0 as usize].class {
            ClassRef::Known(class) => {
                let class = class.get();
                let known = class.is_vrml97() && is_in_x3d(class.name);
                known.then_some(XmlElement::Known(class.name))
            }
            ClassRef::Extension(i) if self.document.protos.of_extension(i).is_some() => {
                Some(XmlElement::Instance(i))
            }
            ClassRef::Extension(i) => {
                let extension = &self.document.extensions[i as usize];
                let is_script = extension.is_a.iter().any(|name| **name == *"Script");
                is_script.then_some(XmlElement::Script(&extension.interface))
            }
        }
    }

    fn lose(&mut self, id: NodeId, code: &str, text: &str) {
        let node = ivcam_inventor::iv::NodeRef {
            document: self.document,
            id,
        };
        self.losses.add_node(code, text, node);
    }

    /// Writes a node, or its use if it is written already. Its children become tasks.
    fn node(&mut self, id: NodeId, field: &'d str, tasks: &mut Vec<XmlTask<'d>>) {
        let Some(element) = self.element(id) else {
            let (code, text) = match self.document.nodes[id.0 as usize].class {
                ClassRef::Known(_) => ("x3d-class", "X3D has no such node with these fields"),
                ClassRef::Extension(_) => {
                    (Feature::UnknownNode.code(), Feature::UnknownNode.text())
                }
            };
            self.lose(id, code, text);
            return;
        };
        let (tag, usual) = match element {
            XmlElement::Known(class) => (class, default_field(class)),
            XmlElement::Script(_) => ("Script", "children"),
            XmlElement::Instance(_) => ("ProtoInstance", "children"),
        };
        let mut head = format!("<{tag}");
        if let XmlElement::Instance(extension) = element {
            head += &format!(" name='{}'", self.proto_names[&extension]);
        }
        let container = match field == usual {
            true => String::new(),
            false => format!(" containerField='{field}'"),
        };
        if !self.written.insert(id) {
            let token = self.tokens.get(&id).map_or("_", String::as_str);
            self.line(&format!("{head} USE='{token}'{container}/>"));
            return;
        }
        if let Some(token) = self.token(id) {
            head += &format!(" DEF='{token}'");
        }
        head += &container;
        self.lose_bright_colors(id);
        head += &self.attributes(id, element);
        let inner = self.inner(id, element);
        if inner.is_empty() {
            self.line(&format!("{head}/>"));
        } else {
            self.begin(&format!("{head}>"));
            tasks.push(XmlTask::End(tag));
            tasks.extend(inner.into_iter().rev());
        }
    }

    /// Reports colors outside the range of X3D, in which they are written.
    fn lose_bright_colors(&mut self, id: NodeId) {
        let is_outside = |entry: &FieldEntry| {
            let (_, kind) = self.described(id, entry);
            self.is_color(id, kind) && limited(&entry.value) != entry.value
        };
        let mut fields = self.document.nodes[id.0 as usize].fields.iter();
        if fields.any(is_outside) {
            let text = "colors are limited to the range from 0 to 1";
            self.lose(id, "color-range", text);
        }
    }

    /// Whether a field of a node has colors.
    fn is_color(&self, id: NodeId, kind: FieldType) -> bool {
        let is_color = matches!(kind, FieldType::SFColor | FieldType::MFColor);
        is_color || self.class_name(id) == "ColorRGBA"
    }

    /// Returns the name after `DEF` of a node that needs one.
    fn token(&mut self, id: NodeId) -> Option<String> {
        let own = self.document.nodes[id.0 as usize].name.as_deref();
        let wanted = match own {
            Some(name) => name,
            None if self.shared.contains(&id) => self.class_name(id),
            None => return None,
        };
        let token = self.names.identifier(wanted);
        self.tokens.insert(id, token.clone());
        Some(token)
    }

    /// Returns the name and type of a field of a node.
    fn described(&self, id: NodeId, entry: &FieldEntry) -> (&'d str, FieldType) {
        let index = usize::from(entry.index);
        match self.document.nodes[id.0 as usize].class {
            ClassRef::Known(class) => {
                let decl = &class.get().fields[index];
                (decl.name, decl.kind)
            }
            ClassRef::Extension(i) => {
                let (name, kind) = &self.document.extensions[i as usize].fields[index];
                (name, *kind)
            }
        }
    }

    /// Returns the attributes of a node for the fields that hold no nodes.
    fn attributes(&self, id: NodeId, element: XmlElement<'d>) -> String {
        let interface = match element {
            XmlElement::Known(_) => &[],
            XmlElement::Script(interface) => interface,
            XmlElement::Instance(_) => return String::new(),
        };
        let mut out = String::new();
        for entry in &self.document.nodes[id.0 as usize].fields {
            let (name, kind) = self.described(id, entry);
            let is_node = matches!(entry.value, Value::Node(_) | Value::Nodes(_));
            let is_declared = interface.iter().any(|item| *item.name == *name);
            if is_node || is_declared {
                continue;
            }
            let name = field_name(self.class_name(id), name);
            let value = match self.is_color(id, kind) {
                true => limited(&entry.value),
                false => script_url(name, &entry.value),
            };
            out += &format!(" {name}='{}'", attribute(&value, kind));
        }
        if self.class_name(id) == "SpotLight" {
            // X3D 3.3 exchanged the default angles of VRML97.
            for (name, angle) in [
                ("beamWidth", spot97::BEAM_WIDTH),
                ("cutOffAngle", spot97::CUT_OFF_ANGLE),
            ] {
                if !self.document.node(id).states(angle) {
                    out += &format!(" {name}='{}'", angle.default());
                }
            }
        }
        out
    }

    /// Returns what is between the tags of a node: links, declared fields, and the nodes of its
    /// fields, in the order in which they are written.
    fn inner(&self, id: NodeId, element: XmlElement<'d>) -> Vec<XmlTask<'d>> {
        let node_data = &self.document.nodes[id.0 as usize];
        let mut inner = Vec::new();
        let mut held = Vec::new();
        match element {
            XmlElement::Known(_) => {}
            XmlElement::Script(interface) => {
                for item in interface {
                    inner.extend(self.declared_field(id, item));
                }
            }
            XmlElement::Instance(_) => {
                for entry in &node_data.fields {
                    inner.extend(self.instance_field(id, entry));
                }
            }
        }
        if !matches!(element, XmlElement::Instance(_)) {
            let interface = match element {
                XmlElement::Script(interface) => interface,
                _ => &[],
            };
            for entry in &node_data.fields {
                let (name, _) = self.described(id, entry);
                if interface.iter().any(|item| *item.name == *name) {
                    continue;
                }
                let field = field_name(self.class_name(id), name);
                held.extend(nodes_of(&entry.value).iter().map(|&id| node(id, field)));
            }
            held.extend(node_data.children.iter().map(|&id| node(id, "children")));
        }
        if let Some(links) = self.links.get(&id) {
            inner.push(XmlTask::Begin("<IS>".to_owned()));
            for (name, interface) in links {
                let name = escaped(field_name(self.class_name(id), name));
                let of = escaped(interface);
                inner.push(XmlTask::Line(format!(
                    "<connect nodeField='{name}' protoField='{of}'/>"
                )));
            }
            inner.push(XmlTask::End("IS"));
        }
        inner.extend(held);
        inner
    }

    /// Returns the declaration of a field of a script or prototype, with its value.
    fn declared_field(&self, id: NodeId, item: &Interface) -> Vec<XmlTask<'d>> {
        let links = self.links.get(&id).into_iter().flatten();
        let is_linked = links.into_iter().any(|(name, _)| **name == *item.name);
        let fields = self.document.nodes[id.0 as usize].fields.iter();
        let mut entries = fields.filter(|entry| *self.described(id, entry).0 == *item.name);
        let entry = entries
            .next()
            .filter(|_| item.access.has_value() && !is_linked);
        let head = format!("<field {}", declared(item));
        match entry.map(|entry| &entry.value) {
            Some(value) if !nodes_of(value).is_empty() => {
                held_by(head + ">", nodes_of(value), "field")
            }
            Some(Value::Node(_) | Value::Nodes(_)) | None => vec![XmlTask::Line(head + "/>")],
            Some(value) => {
                let text = attribute(value, item.kind);
                vec![XmlTask::Line(format!("{head} value='{text}'/>"))]
            }
        }
    }

    /// Returns the value of a field of an instance of a prototype.
    fn instance_field(&self, id: NodeId, entry: &'d FieldEntry) -> Vec<XmlTask<'d>> {
        let (name, kind) = self.described(id, entry);
        let head = format!("<fieldValue name='{}'", escaped(name));
        match &entry.value {
            value if !nodes_of(value).is_empty() => {
                held_by(head + ">", nodes_of(value), "fieldValue")
            }
            Value::Node(_) | Value::Nodes(_) => vec![XmlTask::Line(head + "/>")],
            value => {
                let text = attribute(value, kind);
                vec![XmlTask::Line(format!("{head} value='{text}'/>"))]
            }
        }
    }
}

/// Returns the task for a node in a field.
fn node(id: NodeId, field: &str) -> XmlTask<'_> {
    XmlTask::Node { id, field }
}

/// Returns an element with nodes. The nodes of declared fields have no field of their own.
fn held_by<'d>(head: String, nodes: &[NodeId], element: &'static str) -> Vec<XmlTask<'d>> {
    let mut tasks = vec![XmlTask::Begin(head)];
    tasks.extend(nodes.iter().map(|&id| node(id, "children")));
    tasks.push(XmlTask::End(element));
    tasks
}

/// Returns the attributes of a declaration.
fn declared(item: &Interface) -> String {
    format!(
        "accessType='{}' name='{}' type='{}'",
        access_type(item.access),
        escaped(&item.name),
        item.kind.name()
    )
}

/// Returns a value with X3D's name for the language of scripts.
fn script_url(name: &str, value: &Value) -> Value {
    let rename = |url: &String| {
        let old = ["javascript:", "vrmlscript:"];
        let code = old
            .iter()
            .find_map(|start| url.trim_start().strip_prefix(start));
        code.map_or_else(|| url.clone(), |code| format!("ecmascript:{code}"))
    };
    match value {
        Value::Strings(urls) if name == "url" => Value::Strings(urls.iter().map(rename).collect()),
        other => other.clone(),
    }
}

/// Returns colors limited to the range of X3D.
fn limited(value: &Value) -> Value {
    let limit = |color: &Vec3| color.clamp(Vec3::ZERO, Vec3::ONE);
    match value {
        Value::Vec3(color) => Value::Vec3(limit(color)),
        Value::Vec3s(colors) => Value::Vec3s(colors.iter().map(limit).collect()),
        Value::Vec4s(colors) => {
            let limit = |color: &Vec4| color.clamp(Vec4::ZERO, Vec4::ONE);
            Value::Vec4s(colors.iter().map(limit).collect())
        }
        other => other.clone(),
    }
}

//! Converts a scene from the XML encoding of X3D to VRML97.
//!
//! The standard's test suite was written in VRML97 and is kept in X3D. The conversion covers what
//! its scenes have: nodes and prototypes of VRML97, scripts and routes. Fields and nodes that
//! VRML97 lacks are left out.

use std::collections::HashMap;
use std::fmt::Write as _;

use ivcam_inventor::grammar::{Dialect, by_name};

use super::xml::{XmlElement, parse};

/// The names and types of the fields of a prototype.
type Interface = HashMap<String, String>;

/// Returns a scene as VRML97.
///
/// # Errors
/// The text is not well-formed XML or has no `Scene`.
pub(super) fn to_vrml97(text: &str) -> Result<String, String> {
    let document = parse(text)?;
    let root = document.named("X3D").next().unwrap_or(&document);
    let scene = root.named("Scene").next().ok_or("there is no Scene")?;
    let mut writer = Writer {
        out: "#VRML V2.0 utf8\n".to_string(),
        scopes: vec![HashMap::new()],
    };
    for child in &scene.children {
        writer.statement(child);
    }
    Ok(writer.out)
}

struct Writer {
    out: String,
    /// The prototypes that are declared, by their names, innermost scope last.
    scopes: Vec<HashMap<String, Interface>>,
}

impl Writer {
    /// Writes a node, a prototype or a route.
    fn statement(&mut self, element: &XmlElement) {
        match element.name.as_str() {
            "ROUTE" => self.route(element),
            "ProtoDeclare" => self.proto(element),
            "ExternProtoDeclare" => self.extern_proto(element),
            _ => self.node(element),
        }
    }

    fn line(&mut self, text: &str) {
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn route(&mut self, route: &XmlElement) {
        let [from, output, to, input] = ["fromNode", "fromField", "toNode", "toField"]
            .map(|name| route.get(name).unwrap_or_default());
        self.line(&format!("ROUTE {from}.{output} TO {to}.{input}"));
    }

    fn proto(&mut self, element: &XmlElement) {
        let name = element.get("name").unwrap_or_default().to_string();
        self.line(&format!("PROTO {name} ["));
        let mut interface = Interface::new();
        for field in element
            .named("ProtoInterface")
            .flat_map(|i| i.named("field"))
        {
            self.declaration(field, &mut interface, None);
        }
        self.line("] {");
        self.declare(name, interface);
        self.scopes.push(HashMap::new());
        for child in element.named("ProtoBody").flat_map(|b| &b.children) {
            self.statement(child);
        }
        self.scopes.pop();
        self.line("}");
    }

    fn extern_proto(&mut self, element: &XmlElement) {
        let name = element.get("name").unwrap_or_default().to_string();
        self.line(&format!("EXTERNPROTO {name} ["));
        let mut interface = Interface::new();
        for field in element.named("field") {
            let (kind, field_name) = declared(field);
            self.line(&format!("{} {kind} {field_name}", access(field)));
            interface.insert(field_name, kind);
        }
        let urls = strings(element.get("url").unwrap_or_default());
        self.line(&format!("] {}", list(&urls, true)));
        self.declare(name, interface);
    }

    fn declare(&mut self, name: String, interface: Interface) {
        if let Some(scope) = self.scopes.last_mut() {
            scope.insert(name, interface);
        }
    }

    /// Writes a field of a prototype's or a script's interface. `connected` is the field of the
    /// prototype that a script's field stands for.
    fn declaration(
        &mut self,
        field: &XmlElement,
        interface: &mut Interface,
        connected: Option<&str>,
    ) {
        let (kind, name) = declared(field);
        let head = format!("{} {kind} {name}", access(field));
        interface.insert(name, kind.clone());
        match (connected, access(field)) {
            (Some(outer), _) => self.line(&format!("{head} IS {outer}")),
            (None, "eventIn" | "eventOut") => self.line(&head),
            (None, _) => self.value(&head, &kind, field),
        }
    }

    /// Writes a value that an element states by its attribute or by its children.
    fn value(&mut self, head: &str, kind: &str, element: &XmlElement) {
        match kind {
            "SFNode" => {
                let node = element.children.iter().find(|c| is_node(c));
                let _ = write!(self.out, "{head} ");
                match node {
                    Some(node) => self.node(node),
                    None => self.line("NULL"),
                }
            }
            "MFNode" => {
                self.line(&format!("{head} ["));
                for node in element.children.iter().filter(|c| is_node(c)) {
                    self.node(node);
                }
                self.line("]");
            }
            _ => {
                let stated = element.get("value").unwrap_or_default();
                self.line(&format!("{head} {}", written(kind, stated, false)));
            }
        }
    }

    fn node(&mut self, element: &XmlElement) {
        if let Some(name) = element.get("USE") {
            return self.line(&format!("USE {name}"));
        }
        let name = element.get("DEF").map(|d| format!("DEF {d} "));
        let name = name.unwrap_or_default();
        if element.name == "ProtoInstance" {
            return self.instance(element, &name);
        }
        if by_name(&element.name, Dialect::VRML97).is_none() {
            return;
        }
        self.line(&format!("{name}{} {{", element.name));
        let connected = connections(element);
        if element.name == "Script" {
            self.script(element, &connected);
        }
        self.fields(element, &connected);
        self.children(element);
        self.line("}");
    }

    fn instance(&mut self, element: &XmlElement, name: &str) {
        let class = element.get("name").unwrap_or_default();
        let known = self.scopes.iter().rev().find_map(|s| s.get(class)).cloned();
        let interface = known.unwrap_or_default();
        self.line(&format!("{name}{class} {{"));
        for field in element.named("fieldValue") {
            let field_name = field.get("name").unwrap_or_default();
            if let Some(kind) = interface.get(field_name) {
                self.value(field_name, kind, field);
            }
        }
        for (inner, outer) in connections(element) {
            self.line(&format!("{inner} IS {outer}"));
        }
        self.line("}");
    }

    /// Writes a script's interface, and its program if it is in the scene.
    fn script(&mut self, element: &XmlElement, connected: &[(String, String)]) {
        let mut interface = Interface::new();
        for field in element.named("field") {
            let outer = connected
                .iter()
                .find(|(inner, _)| Some(inner.as_str()) == field.get("name"));
            self.declaration(field, &mut interface, outer.map(|(_, o)| o.as_str()));
        }
        let program = element.text.trim();
        if !program.is_empty() {
            let program = program.replacen("ecmascript:", "javascript:", 1);
            self.line(&format!("url [ {} ]", quoted(&program)));
        }
    }

    /// Writes the fields that attributes state, and those that stand for fields of a prototype.
    fn fields(&mut self, element: &XmlElement, connected: &[(String, String)]) {
        for (attribute, value) in &element.attributes {
            let name = renamed(&element.name, attribute);
            let Some(kind) = field_type(&element.name, name) else {
                continue;
            };
            let is_scene = matches!(element.name.as_str(), "Inline" | "Anchor") && name == "url";
            self.line(&format!("{name} {}", written(&kind, value, is_scene)));
        }
        let own = element.named("field").filter_map(|f| f.get("name"));
        let own: Vec<&str> = own.collect();
        for (inner, outer) in connected {
            if !own.contains(&inner.as_str()) {
                self.line(&format!("{} IS {outer}", renamed(&element.name, inner)));
            }
        }
    }

    /// Writes the nodes inside a node, by the fields that contain them. Prototypes go first and
    /// routes last: VRML97 allows both only between fields.
    fn children(&mut self, element: &XmlElement) {
        let of = |name: &'static str| element.named(name);
        for child in of("ProtoDeclare").chain(of("ExternProtoDeclare")) {
            self.statement(child);
        }
        let mut fields: Vec<(String, Vec<&XmlElement>)> = Vec::new();
        for child in element.children.iter().filter(|c| is_node(c)) {
            let field = container(child, &element.name);
            match fields.iter_mut().find(|(name, _)| *name == field) {
                Some((_, nodes)) => nodes.push(child),
                None => fields.push((field, vec![child])),
            }
        }
        for (field, nodes) in fields {
            let many = match field_type(&element.name, &field) {
                Some(kind) => kind == "MFNode",
                None => continue,
            };
            let _ = writeln!(self.out, "{field}{}", if many { " [" } else { "" });
            for node in nodes {
                self.node(node);
            }
            if many {
                self.line("]");
            }
        }
        for child in of("ROUTE") {
            self.route(child);
        }
    }
}

/// Returns the type and name of an interface's field.
fn declared(field: &XmlElement) -> (String, String) {
    let [kind, name] = ["type", "name"].map(|a| field.get(a).unwrap_or_default().to_string());
    (kind, name)
}

/// Returns VRML97's word for how a field of an interface is used.
fn access(field: &XmlElement) -> &'static str {
    match field.get("accessType") {
        Some("inputOnly") => "eventIn",
        Some("outputOnly") => "eventOut",
        Some("initializeOnly") => "field",
        _ => "exposedField",
    }
}

/// Returns the pairs of a node's field and the prototype's field that it stands for.
fn connections(element: &XmlElement) -> Vec<(String, String)> {
    let connects = element.named("IS").flat_map(|is| is.named("connect"));
    let pair = |c: &XmlElement| {
        let [inner, outer] =
            ["nodeField", "protoField"].map(|a| c.get(a).unwrap_or_default().to_string());
        (inner, outer)
    };
    connects.map(pair).collect()
}

fn is_node(element: &XmlElement) -> bool {
    element.name == "ProtoInstance" || by_name(&element.name, Dialect::VRML97).is_some()
}

/// Returns VRML97's name of a field that X3D has renamed.
fn renamed<'a>(class: &str, field: &'a str) -> &'a str {
    match (class, field) {
        ("Collision", "enabled") => "collide",
        ("Switch", "children") => "choice",
        ("LOD", "children") => "level",
        _ => field,
    }
}

/// Returns the field of a node that contains a node inside it: the one stated, or X3D's default for
/// the inner node's class.
fn container(child: &XmlElement, parent: &str) -> String {
    let usual = match child.name.as_str() {
        "Appearance" => "appearance",
        "Material" => "material",
        "MovieTexture" if parent == "Sound" => "source",
        "ImageTexture" | "MovieTexture" | "PixelTexture" => "texture",
        "TextureTransform" => "textureTransform",
        "Color" => "color",
        "Coordinate" => "coord",
        "Normal" => "normal",
        "TextureCoordinate" => "texCoord",
        "FontStyle" => "fontStyle",
        "AudioClip" => "source",
        "Box" | "Cone" | "Cylinder" | "ElevationGrid" | "Extrusion" | "IndexedFaceSet"
        | "IndexedLineSet" | "PointSet" | "Sphere" | "Text" => "geometry",
        "ProtoInstance" if parent == "Shape" => "appearance",
        _ => "children",
    };
    renamed(parent, child.get("containerField").unwrap_or(usual)).to_string()
}

/// Returns the name of the type of a class's field.
fn field_type(class: &str, field: &str) -> Option<String> {
    let class = by_name(class, Dialect::VRML97)?;
    let (_, declaration) = class.field(field)?;
    Some(declaration.kind.name().to_string())
}

/// Returns a value as VRML97 writes it. Scenes that `is_scene` names are converted too, and their
/// names with them.
fn written(kind: &str, value: &str, is_scene: bool) -> String {
    match kind {
        "SFBool" => value.trim().to_uppercase(),
        "SFString" | "SFEnum" => quoted(value),
        "MFString" => list(&strings(value), is_scene),
        "SFNode" => "NULL".to_string(),
        _ if kind.starts_with("MF") => format!("[ {value} ]"),
        _ if value.trim().is_empty() => match kind {
            "SFVec2f" => "0 0",
            "SFVec3f" | "SFColor" | "SFImage" => "0 0 0",
            "SFRotation" => "0 0 1 0",
            _ => "0",
        }
        .to_string(),
        _ => value.to_string(),
    }
}

fn list(strings: &[String], is_scene: bool) -> String {
    let scene = |s: &String| match s.split_once(".x3d") {
        Some((stem, rest)) if is_scene && (rest.is_empty() || rest.starts_with('#')) => {
            quoted(&format!("{stem}.wrl{rest}"))
        }
        _ => quoted(s),
    };
    format!(
        "[ {} ]",
        strings.iter().map(scene).collect::<Vec<_>>().join(" ")
    )
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// Returns the strings of an `MFString`: those in quotation marks, or the whole text without any.
fn strings(value: &str) -> Vec<String> {
    if !value.contains('"') {
        let text = value.trim();
        return if text.is_empty() {
            Vec::new()
        } else {
            vec![text.to_string()]
        };
    }
    let mut all = Vec::new();
    let mut inside: Option<String> = None;
    let mut letters = value.chars();
    while let Some(letter) = letters.next() {
        match (&mut inside, letter) {
            (Some(text), '\\') => text.extend(letters.next()),
            (Some(_), '"') => all.extend(inside.take()),
            (Some(text), other) => text.push(other),
            (None, '"') => inside = Some(String::new()),
            (None, _) => {}
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::to_vrml97;

    /// Returns the words of the scene that a text of X3D becomes.
    fn words(inside: &str) -> String {
        let text = format!("<X3D><Scene>{inside}</Scene></X3D>");
        let scene = to_vrml97(&text).expect("it is well-formed");
        let (_, body) = scene.split_once('\n').expect("it has a header");
        body.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn a_shape_gets_its_nodes_by_the_fields_that_contain_them() {
        assert_eq!(
            words("<Shape><Box size='1 2 3'/><Appearance><Material DEF='M'/></Appearance></Shape>"),
            "Shape { geometry Box { size 1 2 3 } appearance Appearance { material DEF M Material { \
             } } }"
        );
    }

    #[test]
    fn a_switch_has_its_old_field_and_routes_follow_the_nodes() {
        let route = "<ROUTE fromNode='A' fromField='isBound' toNode='B' toField='set_bind'/>";
        let group = format!("<Switch whichChoice='0'>{route}<Fog DEF='A'/></Switch>");
        assert_eq!(
            words(&group),
            "Switch { whichChoice 0 choice [ DEF A Fog { } ] ROUTE A.isBound TO B.set_bind }"
        );
    }

    #[test]
    fn strings_are_quoted_and_inlined_scenes_are_converted_too() {
        assert_eq!(
            words("<Inline url='\"a.x3d\" \"b.x3d#P\"'/><Text string='say \"a\\\"b\" \"c\"'/>"),
            "Inline { url [ \"a.wrl\" \"b.wrl#P\" ] } Text { string [ \"a\\\"b\" \"c\" ] }"
        );
    }

    #[test]
    fn a_prototype_keeps_its_interface_and_what_stands_for_it() {
        assert_eq!(
            words(
                "<ProtoDeclare name='P'><ProtoInterface><field name='c' type='SFColor' \
                 accessType='initializeOnly' value='1 0 0'/></ProtoInterface><ProtoBody><Material>\
                 <IS><connect nodeField='diffuseColor' protoField='c'/></IS></Material></ProtoBody>\
                 </ProtoDeclare><ProtoInstance name='P'><fieldValue name='c' value='0 1 0'/>\
                 </ProtoInstance>"
            ),
            "PROTO P [ field SFColor c 1 0 0 ] { Material { diffuseColor IS c } } P { c 0 1 0 }"
        );
    }

    #[test]
    fn a_script_keeps_its_program() {
        assert_eq!(
            words(
                "<Script><field name='x' type='SFBool' accessType='inputOnly'/><![CDATA[ecmascript:\
                 function x(v) { a = \"b\"; }]]></Script>"
            ),
            "Script { eventIn SFBool x url [ \"javascript:function x(v) { a = \\\"b\\\"; }\" ] }"
        );
    }
}

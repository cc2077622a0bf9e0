//! Translates X3D from XML to its classic encoding.
//!
//! Open elements are on a stack, and what an element states is written at once. A node writes the
//! name of the field of the node around it that it belongs to; a field of several nodes is
//! therefore stated once for each.

use std::borrow::Cow;
use std::collections::HashMap;

use ivcam_base::diag::{Span, excerpt};
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::entities::Entities;
use super::places::Places;
use super::written::{empty, name, put, put_string};
use crate::grammar::{Class, Dialect, FieldType, by_name};
use crate::iv::x3d_names::in_vrml97;

/// A text in the classic encoding that states what a document in XML states.
pub(super) struct Translation {
    pub(super) text: Vec<u8>,
    pub(super) places: Places,
    pub(super) problems: Vec<TranslationProblem>,
}

/// A problem of the XML.
pub(super) struct TranslationProblem {
    pub(super) span: Span,
    pub(super) message: String,
    pub(super) help: Option<String>,
    /// Whether the XML is not well-formed.
    pub(super) is_damage: bool,
}

/// The types of the fields of a prototype.
#[derive(Default)]
struct ProtoFields {
    types: HashMap<Box<str>, FieldType>,
    /// The field that its instances belong to, by the first node of its body.
    container: Option<&'static str>,
}

/// An open element.
enum OpenElement {
    /// An element whose children are statements: `X3D`, `head`, `Scene`.
    Statements,
    /// An element whose children state nothing.
    Nothing,
    /// A node of a class of the catalogue, or of an unknown class.
    Node(Option<&'static Class>),
    /// An instance of a prototype, by its name.
    Instance(Box<str>),
    /// A declaration of a prototype, by its name, and whether it has its body.
    Proto(Box<str>, bool),
    Interface,
    /// The body of a prototype.
    Body,
    /// A declaration of a prototype of another file: its URLs.
    Extern(Vec<u8>),
    /// A field with nodes in an interface or a script.
    Declared {
        is_list: bool,
        is_empty: bool,
    },
    /// A field with nodes of an instance.
    Valued(Box<str>),
    /// The links of a node.
    Links,
}

/// The attributes of an element, with the offsets of their values.
struct XmlAttributes<'x> {
    list: Vec<(&'x str, Cow<'x, str>, usize)>,
}

impl<'x> XmlAttributes<'x> {
    fn get(&self, name: &str) -> Option<&str> {
        self.placed(name).map(|(value, _)| &**value)
    }

    /// The value of an attribute, with its offset.
    fn placed(&self, name: &str) -> Option<(&Cow<'x, str>, usize)> {
        let found = self.list.iter().find(|attribute| attribute.0 == name);
        found.map(|(_, value, place)| (value, *place))
    }
}

/// The state of the translation.
struct Translator<'x> {
    xml: &'x str,
    out: Translation,
    open: Vec<OpenElement>,
    /// The prototypes by name, in each open scope.
    protos: Vec<HashMap<Box<str>, ProtoFields>>,
    entities: Entities,
    /// The text of the open `Script`, and where it begins.
    script: (usize, String),
}

/// The number of attributes of an element with which the next one's name is compared.
const COMPARED: usize = 64;

/// Translates a document. What follows a mistake that makes it not well-formed is left out.
pub(super) fn translate(xml: &str) -> Translation {
    let mut translator = Translator {
        xml,
        out: Translation {
            text: Vec::with_capacity(xml.len()),
            places: Places::default(),
            problems: Vec::new(),
        },
        open: Vec::new(),
        protos: vec![HashMap::new()],
        entities: Entities::default(),
        script: (0, String::new()),
    };
    let mut reader = Reader::from_str(xml);
    reader.config_mut().expand_empty_elements = true;
    loop {
        let at = reader.buffer_position() as usize;
        match reader.read_event() {
            Ok(Event::Start(start)) => translator.start(&start, at),
            Ok(Event::End(_)) => translator.end(),
            Ok(Event::CData(text)) => translator.text(&text.into_inner(), at),
            Ok(Event::Text(text)) => translator.text(&text.into_inner(), at),
            Ok(Event::DocType(text)) => {
                translator.entities = Entities::read(&text.into_inner());
            }
            Ok(Event::GeneralRef(name)) => translator.reference(&name.into_inner(), at),
            Ok(Event::Eof) => break,
            Ok(_) => {}
            Err(error) => {
                let at = reader.error_position() as usize;
                translator.damage(at, format!("the XML is not well-formed: {error}"));
                break;
            }
        }
    }
    if !translator.open.is_empty() && translator.out.problems.iter().all(|p| !p.is_damage) {
        translator.damage(xml.len(), "the file ends inside an element".into());
    }
    while !translator.open.is_empty() {
        translator.end();
    }
    translator.out
}

impl<'x> Translator<'x> {
    fn damage(&mut self, at: usize, message: String) {
        self.out.problems.push(TranslationProblem {
            span: Span::at(at),
            message,
            help: Some("what comes before it is kept".into()),
            is_damage: true,
        });
    }

    fn warn(&mut self, at: usize, message: String) {
        let end = self.xml[at..].find(['>', ' ', '\n']).map_or(at, |n| at + n);
        self.out.problems.push(TranslationProblem {
            span: Span::new(at, end),
            message,
            help: None,
            is_damage: false,
        });
    }

    /// Appends text that was made from the XML at an offset.
    fn put(&mut self, text: &str, at: usize) {
        self.out.places.add(self.out.text.len(), at, 0);
        self.out.text.extend_from_slice(text.as_bytes());
    }

    /// Appends a value from the XML at an offset.
    #[expect(
        clippy::ptr_arg,
        reason = "a borrowed text is that of the file, which places need"
    )]
    fn value(&mut self, kind: FieldType, value: &Cow<'_, str>, at: usize) {
        let start = self.out.text.len();
        put(&mut self.out.text, kind, value);
        let copied = match value {
            Cow::Borrowed(value) => value.len(),
            Cow::Owned(_) => 0,
        };
        let first = usize::from(self.out.text.get(start) != value.as_bytes().first());
        self.out.places.add(start, at, 0);
        self.out.places.add(start + first, at, copied);
        self.out.text.push(b'\n');
        self.out.places.add(self.out.text.len(), at + copied, 0);
    }

    /// Returns the offset in the XML of a part of it.
    fn offset(&self, part: &str) -> usize {
        let offset = (part.as_ptr() as usize).wrapping_sub(self.xml.as_ptr() as usize);
        offset.min(self.xml.len())
    }

    /// Returns the attributes of an element. Of attributes with one name the first counts.
    fn attributes<'e>(&mut self, start: &'e BytesStart<'_>, at: usize) -> XmlAttributes<'e> {
        let mut list: Vec<(&str, Cow<'_, str>, usize)> = Vec::new();
        for attribute in start.attributes().with_checks(false) {
            let attribute = match attribute {
                Ok(attribute) => attribute,
                Err(error) => {
                    self.damage(at, format!("the attributes are not well-formed: {error}"));
                    break;
                }
            };
            let key = attribute.key.into_inner();
            let Cow::Borrowed(raw) = attribute.value else {
                continue;
            };
            let place = self.offset(raw);
            if list
                .iter()
                .take(COMPARED)
                .any(|(before, ..)| *before == key)
            {
                let key = excerpt(key);
                self.warn(
                    at,
                    format!("the attribute `{key}` is stated twice; the first counts"),
                );
                continue;
            }
            let value = self.entities.expanded(raw).unwrap_or_else(|error| {
                self.warn(at, format!("an entity is not known: {error}"));
                Cow::Borrowed(raw)
            });
            list.push((key, value, place));
        }
        XmlAttributes { list }
    }

    /// Begins an element.
    fn start(&mut self, start: &BytesStart<'x>, at: usize) {
        if matches!(self.open.last(), Some(OpenElement::Nothing)) {
            self.open.push(OpenElement::Nothing);
            return;
        }
        let attributes = self.attributes(start, at);
        let tag = start.name().into_inner();
        let get = |name: &str| attributes.get(name).unwrap_or_default();
        let element = match tag {
            "X3D" | "Scene" | "head" => match self.open.last() {
                None | Some(OpenElement::Statements) => OpenElement::Statements,
                _ => OpenElement::Nothing,
            },
            _ if !self.belongs(tag) => {
                let tag = excerpt(tag);
                self.warn(at, format!("`{tag}` is not expected here, and is left out"));
                OpenElement::Nothing
            }
            "meta" => {
                self.put("META ", at);
                put_string(&mut self.out.text, get("name"));
                put_string(&mut self.out.text, get("content"));
                self.out.text.push(b'\n');
                OpenElement::Nothing
            }
            "component" => OpenElement::Nothing,
            "unit" => {
                let text = format!("UNIT {} {} ", name(get("category")), name(get("name")));
                self.put(&(text + &name(get("conversionFactor")) + "\n"), at);
                OpenElement::Nothing
            }
            "IMPORT" => {
                let (inline, node) = (name(get("inlineDEF")), name(get("importedDEF")));
                self.put(&format!("IMPORT {inline}.{node}\n"), at);
                OpenElement::Nothing
            }
            "EXPORT" => OpenElement::Nothing,
            "ROUTE" => {
                let [from, output, to, input] =
                    ["fromNode", "fromField", "toNode", "toField"].map(|key| name(get(key)));
                self.put(&format!("\nROUTE {from}.{output} TO {to}.{input}\n"), at);
                OpenElement::Nothing
            }
            "ProtoDeclare" | "ExternProtoDeclare" => self.proto(tag, &attributes, at),
            "ProtoInterface" => OpenElement::Interface,
            "ProtoBody" => {
                self.put("] {\n", at);
                if let Some(OpenElement::Proto(_, has_body)) = self.open.last_mut() {
                    *has_body = true;
                }
                self.protos.push(HashMap::new());
                OpenElement::Body
            }
            "IS" => OpenElement::Links,
            "connect" => {
                let [field, of] = ["nodeField", "protoField"].map(|key| name(get(key)));
                self.put(&format!("{field} IS {of}\n"), at);
                OpenElement::Nothing
            }
            "field" => self.declared(&attributes, at),
            "fieldValue" => self.valued(&attributes, at),
            _ => self.node(tag, &attributes, at),
        };
        self.open.push(element);
    }

    /// Returns whether a statement that is not a node may be inside the innermost element.
    fn belongs(&self, tag: &str) -> bool {
        let around = self.open.last();
        let is_scope = matches!(
            around,
            None | Some(OpenElement::Statements | OpenElement::Body)
        );
        match tag {
            "meta" | "component" | "unit" | "IMPORT" | "EXPORT" => {
                matches!(around, None | Some(OpenElement::Statements))
            }
            "ROUTE" | "ProtoDeclare" | "ExternProtoDeclare" => {
                is_scope || matches!(around, Some(OpenElement::Node(_)))
            }
            "ProtoInterface" | "ProtoBody" => matches!(around, Some(OpenElement::Proto(_, false))),
            "IS" => matches!(
                around,
                Some(OpenElement::Node(_) | OpenElement::Instance(_))
            ),
            "connect" => matches!(around, Some(OpenElement::Links)),
            _ => true,
        }
    }

    /// Begins the declaration of a prototype.
    fn proto(&mut self, tag: &str, attributes: &XmlAttributes<'_>, at: usize) -> OpenElement {
        let own: Box<str> = name(attributes.get("name").unwrap_or_default()).into();
        let is_external = tag == "ExternProtoDeclare";
        let keyword = if is_external { "EXTERNPROTO" } else { "PROTO" };
        self.put(&format!("\n{keyword} {own} [\n"), at);
        let scope = self.protos.last_mut().expect("the file's own scope");
        scope.insert(own.clone(), ProtoFields::default());
        if !is_external {
            return OpenElement::Proto(own, false);
        }
        let mut urls = Vec::new();
        let value = attributes.get("url").unwrap_or_default();
        put(&mut urls, FieldType::MFString, value);
        self.open.push(OpenElement::Proto(own, true));
        OpenElement::Extern(urls)
    }

    /// Declares a field of a prototype or a script.
    fn declared(&mut self, attributes: &XmlAttributes<'_>, at: usize) -> OpenElement {
        let get = |key: &str| attributes.get(key).unwrap_or_default();
        let own = name(get("name"));
        let access = match get("accessType") {
            "" => "inputOutput".to_owned(),
            access => name(access),
        };
        let kind = FieldType::named(get("type"));
        let (mut is_external, mut of_proto) = (false, None);
        match self.open.as_slice() {
            [.., OpenElement::Proto(proto, _), OpenElement::Extern(_)] => {
                is_external = true;
                of_proto = Some(proto.clone());
            }
            [.., OpenElement::Proto(proto, _), OpenElement::Interface] => {
                of_proto = Some(proto.clone())
            }
            [.., OpenElement::Node(_)] => {}
            _ => {
                self.warn(at, "`field` is expected in an interface or a script".into());
                return OpenElement::Nothing;
            }
        }
        if let (Some(proto), Some(kind)) = (of_proto, kind)
            && let Some(fields) = self.proto_named(&proto)
        {
            fields.types.insert(own.as_str().into(), kind);
        }
        self.put(&format!("{access} {} {own} ", name(get("type"))), at);
        let has_value = matches!(access.as_str(), "inputOutput" | "initializeOnly");
        let Some(kind) = kind.filter(|_| has_value && !is_external) else {
            self.out.text.push(b'\n');
            return OpenElement::Nothing;
        };
        if matches!(kind, FieldType::SFNode | FieldType::MFNode) {
            let is_list = kind == FieldType::MFNode;
            self.put(if is_list { "[\n" } else { "" }, at);
            return OpenElement::Declared {
                is_list,
                is_empty: true,
            };
        }
        let value = attributes.placed("value");
        match value.filter(|(value, _)| !value.is_empty() || kind == FieldType::SFString) {
            Some((value, place)) => self.value(kind, value, place),
            None => self.put(&format!("{}\n", empty(kind)), at),
        }
        OpenElement::Nothing
    }

    /// States the value of a field of an instance.
    fn valued(&mut self, attributes: &XmlAttributes<'_>, at: usize) -> OpenElement {
        let own = name(attributes.get("name").unwrap_or_default());
        let Some(OpenElement::Instance(proto)) = self.open.last() else {
            self.warn(at, "`fieldValue` is expected in a `ProtoInstance`".into());
            return OpenElement::Nothing;
        };
        let proto = proto.clone();
        let kind = self
            .proto_named(&proto)
            .and_then(|fields| fields.types.get(&*own))
            .copied();
        if let Some((value, place)) = attributes.placed("value") {
            self.put(&format!("{own} "), at);
            self.value(kind.unwrap_or(FieldType::SFString), value, place);
        }
        OpenElement::Valued(own.into())
    }

    /// Finds a prototype in the scopes that are open.
    fn proto_named(&mut self, name: &str) -> Option<&mut ProtoFields> {
        self.protos
            .iter_mut()
            .rev()
            .find_map(|scope| scope.get_mut(name))
    }

    /// Begins a node, or uses one.
    fn node(&mut self, tag: &str, attributes: &XmlAttributes<'_>, at: usize) -> OpenElement {
        let class = by_name(tag, Dialect::VRML97 | Dialect::X3D);
        let is_instance = tag == "ProtoInstance";
        let own = match is_instance {
            true => name(attributes.get("name").unwrap_or_default()),
            false => name(tag),
        };
        let usual = match is_instance {
            true => self.proto_named(&own).and_then(|fields| fields.container),
            false => Some(match self.open.last() {
                // A shape that is not known, such as one of 2D, is not a child.
                Some(OpenElement::Node(Some(around)))
                    if class.is_none() && around.name == "Shape" =>
                {
                    "geometry"
                }
                _ => container(tag, class),
            }),
        };
        let usual = usual.unwrap_or("children");
        let field = attributes
            .get("containerField")
            .filter(|field| !field.is_empty());
        if !self.place(field.unwrap_or(usual), usual, at) {
            let tag = excerpt(tag);
            self.warn(at, format!("`{tag}` is not expected here, and is left out"));
            return OpenElement::Nothing;
        }
        if let Some(used) = attributes.get("USE").filter(|used| !used.is_empty()) {
            self.put(&format!("USE {}\n", name(used)), at);
            return OpenElement::Nothing;
        }
        if let Some(defined) = attributes.get("DEF").filter(|defined| !defined.is_empty()) {
            self.put(&format!("DEF {} ", name(defined)), at);
        }
        self.put(&format!("{own} {{\n"), at);
        if is_instance {
            return OpenElement::Instance(own.into());
        }
        for (key, value, place) in &attributes.list {
            self.attribute(class, key, value, *place);
        }
        OpenElement::Node(class)
    }

    /// Writes the field that a node belongs to. Returns `false` if no node belongs here.
    fn place(&mut self, field: &str, usual: &'static str, at: usize) -> bool {
        let field = match self.open.last_mut() {
            None | Some(OpenElement::Statements) => return true,
            Some(OpenElement::Body) => {
                let [.., OpenElement::Proto(proto, _), _] = self.open.as_slice() else {
                    return true;
                };
                let proto = proto.clone();
                if let Some(fields) = self.proto_named(&proto) {
                    fields.container.get_or_insert(usual);
                }
                return true;
            }
            Some(OpenElement::Declared { is_empty, .. }) => {
                *is_empty = false;
                return true;
            }
            Some(OpenElement::Valued(field)) => format!("{field} "),
            Some(OpenElement::Node(class)) => {
                // A node belongs to its usual field if the stated one does not exist.
                let has = |name: &str| {
                    let own = class.map(|c| (c, in_vrml97(c.name, name)));
                    own.is_none_or(|(c, own)| c.field(own.as_deref().unwrap_or(name)).is_some())
                };
                match has(field) || !has(usual) {
                    true => format!("{} ", name(field)),
                    false => format!("{usual} "),
                }
            }
            Some(_) => return false,
        };
        self.put(&field, at);
        true
    }

    /// Writes the field of an attribute.
    #[expect(
        clippy::ptr_arg,
        reason = "a borrowed text is that of the file, which places need"
    )]
    fn attribute(
        &mut self,
        class: Option<&'static Class>,
        key: &str,
        value: &Cow<'_, str>,
        at: usize,
    ) {
        let own = class.and_then(|class| in_vrml97(class.name, key));
        let decl = class.and_then(|class| class.field(own.as_deref().unwrap_or(key)));
        // A `FontStyle` has a field `style`, and every element of X3D 4 an attribute.
        let is_of_xml = match key {
            "DEF" | "USE" | "containerField" => true,
            "class" | "id" | "style" => decl.is_none(),
            key => key.starts_with("xmlns") || key.contains(':'),
        };
        if is_of_xml {
            return;
        }
        let kind = decl.map_or(FieldType::SFString, |(_, decl)| decl.kind);
        // The name is before the value, the equals sign and the quote.
        let place = at.saturating_sub(key.len() + 2);
        self.out.places.add(self.out.text.len(), place, key.len());
        self.out.text.extend_from_slice(name(key).as_bytes());
        self.out.text.push(b' ');
        match kind {
            _ if value.is_empty() && !kind.is_multiple() && kind != FieldType::SFString => {
                self.put(&format!("{}\n", empty(kind)), at);
            }
            kind => self.value(kind, value, at),
        }
    }

    /// Adds a reference to an entity to the text of a `Script`, and reports one between elements to
    /// an entity of the file.
    fn reference(&mut self, name: &str, at: usize) {
        let raw = format!("&{name};");
        if self.is_in_script()
            && let Ok(text) = self.entities.expanded(&raw)
        {
            self.text(&text, at);
        } else if self.entities.declares(name) {
            let name = excerpt(name);
            let message = format!("the entity `{name}` is expanded in attributes only");
            self.warn(at, message);
        }
    }

    /// Returns whether the innermost element is a `Script`.
    fn is_in_script(&self) -> bool {
        matches!(self.open.last(), Some(OpenElement::Node(Some(class))) if class.name == "Script")
    }

    /// Adds a part of the text of a `Script`. Text elsewhere has no meaning.
    fn text(&mut self, text: &str, at: usize) {
        if self.is_in_script() {
            if self.script.1.trim_ascii().is_empty() {
                self.script = (at, String::new());
            }
            self.script.1 += text;
        }
    }

    /// States the program in the text of a `Script`.
    fn program(&mut self) {
        let (at, text) = std::mem::take(&mut self.script);
        let text = text.trim_ascii();
        if !text.is_empty() {
            self.put("url [ ", at);
            put_string(&mut self.out.text, text);
            self.put(" ]\n", at);
        }
    }

    /// Ends the innermost element.
    fn end(&mut self) {
        let at = self.xml.len();
        if self.is_in_script() {
            self.program();
        }
        match self.open.pop() {
            Some(OpenElement::Node(_) | OpenElement::Instance(_)) => self.out.text.extend(b"}\n"),
            Some(OpenElement::Proto(_, false)) => self.out.text.extend(b"] { }\n"),
            Some(OpenElement::Body) => {
                self.protos.pop();
                self.out.text.extend(b"}\n");
            }
            Some(OpenElement::Extern(urls)) => {
                self.open.pop();
                self.out.text.extend(b"] ");
                self.out.text.extend(urls);
                self.out.text.push(b'\n');
            }
            Some(OpenElement::Declared { is_list, is_empty }) => match (is_list, is_empty) {
                (true, _) => self.out.text.extend(b"]\n"),
                (false, true) => self.put("NULL\n", at),
                (false, false) => {}
            },
            _ => {}
        }
    }
}

/// Returns the field that X3D assumes for a node of a class.
fn container(tag: &str, class: Option<&'static Class>) -> &'static str {
    match tag {
        "Appearance" => "appearance",
        "Material" | "PhysicalMaterial" | "UnlitMaterial" | "TwoSidedMaterial" => "material",
        "TextureTransform" | "MultiTextureTransform" => "textureTransform",
        "FontStyle" => "fontStyle",
        "Color" | "ColorRGBA" => "color",
        "Coordinate" | "CoordinateDouble" | "GeoCoordinate" => "coord",
        "FogCoordinate" => "fogCoord",
        "Normal" => "normal",
        "TextureCoordinate" | "MultiTextureCoordinate" | "TextureCoordinateGenerator" => "texCoord",
        "TextureProperties" => "textureProperties",
        "LineProperties" => "lineProperties",
        "PointProperties" => "pointProperties",
        "FillProperties" => "fillProperties",
        "AudioClip" => "source",
        "GeoOrigin" => "geoOrigin",
        "SpecularMaterialExtension" | "IORMaterialExtension" => "extensions",
        _ if tag.starts_with("Metadata") => "metadata",
        _ => match class {
            Some(class) if class.is_a("VRMLGeometry") => "geometry",
            Some(class) if class.is_a("VRMLTexture") => "texture",
            _ => "children",
        },
    }
}

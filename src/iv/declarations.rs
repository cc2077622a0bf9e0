//! What a file declares: node classes of its own (`fields [ … ]`, `PROTO`, `Script`) and routes.
//!
//! These are data only. `read` fills them in and `write` writes them.

use std::collections::HashMap;
use std::ops::Range;

use crate::grammar::FieldType;
use crate::grammar::value::NodeId;

/// A route, written `ROUTE from.output TO to.input`. Expanding a proto adds the routes of its body.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    pub from: NodeId,
    pub output: Box<str>,
    pub to: NodeId,
    pub input: Box<str>,
    /// Whether the file states it outside of the body of a proto.
    pub stated: bool,
}

/// A class that the catalogue lacks: the file declares it (`fields [ … ] isA [ … ]`), or only uses
/// it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Extension {
    pub name: Box<str>,
    /// The name and type of each field, in the order of declaration.
    pub fields: Vec<(Box<str>, FieldType)>,
    /// The known classes as which it may be treated, nearest first.
    pub is_a: Vec<Box<str>>,
    /// The fields and events that a `Script` declares, in their order.
    pub interface: Vec<Interface>,
}

/// How a field or event of an interface may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Field,
    ExposedField,
    EventIn,
    EventOut,
}

impl Access {
    /// The access that a keyword of VRML97 or X3D means.
    pub(crate) fn named(word: &[u8]) -> Option<Self> {
        match word {
            b"field" | b"initializeOnly" => Some(Self::Field),
            b"exposedField" | b"inputOutput" => Some(Self::ExposedField),
            b"eventIn" | b"inputOnly" => Some(Self::EventIn),
            b"eventOut" | b"outputOnly" => Some(Self::EventOut),
            _ => None,
        }
    }

    /// The keyword of VRML97.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Field => "field",
            Self::ExposedField => "exposedField",
            Self::EventIn => "eventIn",
            Self::EventOut => "eventOut",
        }
    }

    /// Whether it has a value, as events have not.
    pub(crate) fn has_value(self) -> bool {
        matches!(self, Self::Field | Self::ExposedField)
    }
}

/// A field or event of a `PROTO` or `Script`, such as `eventIn SFBool set_on`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Interface {
    pub access: Access,
    pub kind: FieldType,
    pub name: Box<str>,
}

/// A field of a node in a proto's body that is one of the interface: `name IS interface`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Link {
    pub node: NodeId,
    pub name: Box<str>,
    pub interface: Box<str>,
}

/// A class that a file defines by nodes, with `PROTO` or `EXTERNPROTO`.
#[derive(Clone, Debug)]
pub(crate) struct Proto {
    /// Its class, in `Document::extensions`; the fields there are those of the interface.
    pub extension: u32,
    pub interface: Vec<Interface>,
    /// A node of the class whose fields are the defaults.
    pub defaults: NodeId,
    pub body: Vec<NodeId>,
    pub links: Vec<Link>,
    pub routes: Vec<Route>,
    /// The files in which an `EXTERNPROTO` may be defined.
    pub urls: Vec<String>,
    /// Whether it is an `EXTERNPROTO`.
    pub external: bool,
    /// The proto in whose body it is declared, by its place in [`Protos::list`]. It is known only
    /// there.
    pub within: Option<usize>,
}

/// An event of an instance, the node of the body that has it, and its name there.
pub(crate) type Passage = (Box<str>, NodeId, Box<str>);

/// The protos of a document, and what is known of their instances.
#[derive(Clone, Debug, Default)]
pub(crate) struct Protos {
    /// The protos in the order of their declaration.
    pub list: Vec<Proto>,
    /// The places in `list` of the protos whose classes extensions are.
    places: HashMap<u32, usize>,
    /// Nodes that are not part of the scene, by their places in the arena: the bodies of protos.
    pub templates: Vec<Range<u32>>,
    /// Where the events of an instance lead.
    pub passages: HashMap<NodeId, Vec<Passage>>,
    /// The protos of each file that an `EXTERNPROTO` names, by name.
    pub libraries: HashMap<String, HashMap<Box<str>, u32>>,
    /// The number of nodes that are copies of protos' bodies.
    pub copies: usize,
}

impl Protos {
    /// Adds a proto and returns its place in the list.
    pub(crate) fn add(&mut self, proto: Proto) -> usize {
        self.places.insert(proto.extension, self.list.len());
        self.list.push(proto);
        self.list.len() - 1
    }

    /// The place in the list of the proto whose class an extension is.
    pub(crate) fn of_extension(&self, extension: u32) -> Option<usize> {
        self.places.get(&extension).copied()
    }

    /// Whether a node is part of a proto's body, and not of the scene.
    pub(crate) fn is_template(&self, id: NodeId) -> bool {
        let after = self.templates.partition_point(|r| r.end <= id.0);
        self.templates.get(after).is_some_and(|r| r.contains(&id.0))
    }
}

//! The declarations of a file: its own node classes (`fields [ … ]`, `PROTO`, `Script`) and routes.
//!
//! The types here only hold data. `read` creates them and `write` writes them.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::declared_fields::DeclaredFields;
use crate::grammar::FieldType;
use crate::grammar::value::NodeId;

/// A route: `ROUTE from.output TO to.input`. Expanding a proto adds the routes of its body.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// The node that sends the event.
    pub from: NodeId,
    /// The name of the sender's `eventOut` or `exposedField`.
    pub output: Box<str>,
    /// The node that receives the event.
    pub to: NodeId,
    /// The name of the receiver's `eventIn` or `exposedField`.
    pub input: Box<str>,
    /// Whether the file states the route outside the body of a proto.
    pub stated: bool,
}

/// A class that the catalogue does not have. The file declares it (`fields [ … ] isA [ … ]`), or
/// only uses it.
#[derive(Clone, Debug, PartialEq)]
pub struct Extension {
    /// The name of the class.
    pub name: Box<str>,
    /// The name and type of each field, in the order of declaration.
    pub fields: DeclaredFields,
    /// The names of the classes that the file gives as its base classes, nearest first.
    pub is_a: Vec<Box<str>>,
    /// The fields and events that a `Script` declares, in the order of declaration.
    pub interface: Vec<Interface>,
}

/// The kind of an entry of an interface, which determines how it may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// A value that routes cannot reach: `field`.
    Field,
    /// A value that sends and receives events: `exposedField`.
    ExposedField,
    /// An event that the node receives: `eventIn`.
    EventIn,
    /// An event that the node sends: `eventOut`.
    EventOut,
}

impl Access {
    /// Returns the access that a keyword of VRML97 or X3D means.
    pub(crate) fn named(word: &[u8]) -> Option<Self> {
        match word {
            b"field" | b"initializeOnly" => Some(Self::Field),
            b"exposedField" | b"inputOutput" => Some(Self::ExposedField),
            b"eventIn" | b"inputOnly" => Some(Self::EventIn),
            b"eventOut" | b"outputOnly" => Some(Self::EventOut),
            _ => None,
        }
    }

    /// Returns the keyword of VRML97.
    pub fn name(self) -> &'static str {
        match self {
            Self::Field => "field",
            Self::ExposedField => "exposedField",
            Self::EventIn => "eventIn",
            Self::EventOut => "eventOut",
        }
    }

    /// Returns the keyword of X3D.
    pub fn x3d_name(self) -> &'static str {
        match self {
            Self::Field => "initializeOnly",
            Self::ExposedField => "inputOutput",
            Self::EventIn => "inputOnly",
            Self::EventOut => "outputOnly",
        }
    }

    /// Returns whether the entry has a value. Events have none.
    pub fn has_value(self) -> bool {
        matches!(self, Self::Field | Self::ExposedField)
    }
}

/// A field or event of a `PROTO` or `Script`, such as `eventIn SFBool set_on`.
#[derive(Clone, Debug, PartialEq)]
pub struct Interface {
    /// Whether it is a field or an event.
    pub access: Access,
    /// The type of its values.
    pub kind: FieldType,
    /// Its name.
    pub name: Box<str>,
}

/// A link from a field or event of a node in a proto's body to the interface: `name IS interface`.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// The node in the body.
    pub node: NodeId,
    /// The name of the node's field or event.
    pub name: Box<str>,
    /// The name in the proto's interface.
    pub interface: Box<str>,
}

/// A class that a file defines by nodes, with `PROTO` or `EXTERNPROTO`.
#[derive(Clone, Debug)]
pub struct Proto {
    /// The index of the class in `Document::extensions`. Its fields are those of the interface.
    pub extension: u32,
    /// The fields and events of the proto.
    pub interface: Vec<Interface>,
    /// A node of the class whose fields are the defaults.
    pub defaults: NodeId,
    /// The top-level nodes of the body.
    pub body: Vec<NodeId>,
    /// The `IS` links of the body.
    pub links: Vec<Link>,
    /// The routes between nodes of the body.
    pub routes: Vec<Route>,
    /// The files that may define an `EXTERNPROTO`, in the order in which they are tried.
    pub urls: Vec<String>,
    /// Whether this is an `EXTERNPROTO`.
    pub external: bool,
    /// The index in [`Protos::list`] of the proto whose body declares this one, if there is one.
    /// The name is known only in that body.
    pub within: Option<usize>,
}

/// An event of an instance: its name in the interface, the node of the body that has it, and its
/// name in that node.
pub(crate) type EventBinding = (Box<str>, NodeId, Box<str>);

/// The protos of a document and the data about their instances.
#[derive(Clone, Debug, Default)]
pub struct Protos {
    /// The protos in the order of their declaration.
    pub list: Vec<Proto>,
    /// The index in `list` of the proto of each extension that is the class of a proto.
    places: HashMap<u32, usize>,
    /// The ranges of the arena with the bodies of protos, which are not part of the scene.
    pub templates: Vec<Range<u32>>,
    /// The events of each instance, with the nodes of its body that they belong to.
    pub event_bindings: HashMap<NodeId, Vec<EventBinding>>,
    /// The protos of each file that an `EXTERNPROTO` refers to: the file's name, then the proto's
    /// name and the index of its extension.
    pub libraries: HashMap<String, Arc<HashMap<Box<str>, u32>>>,
    /// The number of nodes that are copies of nodes in bodies of protos.
    pub copies: usize,
    /// The memory of the lists in these copies, in bytes.
    pub copied_bytes: usize,
}

impl Protos {
    /// Adds a proto and returns its index in the list.
    pub(crate) fn add(&mut self, proto: Proto) -> usize {
        self.places.insert(proto.extension, self.list.len());
        self.list.push(proto);
        self.list.len() - 1
    }

    /// Returns the index in the list of the proto whose class is this extension.
    pub fn of_extension(&self, extension: u32) -> Option<usize> {
        self.places.get(&extension).copied()
    }

    /// Returns whether a node is part of the body of a proto and not of the scene.
    pub(crate) fn is_template(&self, id: NodeId) -> bool {
        let after = self.templates.partition_point(|r| r.end <= id.0);
        self.templates.get(after).is_some_and(|r| r.contains(&id.0))
    }
}

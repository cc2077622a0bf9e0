//! Node classes: what the catalogue knows about each, and how to find one.

use std::collections::HashMap;
use std::sync::OnceLock;

use super::catalogue::CLASSES;
use super::class_id::ClassId;
use super::field::{FieldDecl, FieldType};

/// Which languages know a class, as a set of bits.
pub struct Dialect;

impl Dialect {
    pub const IV1: u8 = 1;
    pub const IV2: u8 = 2;
    pub const VRML1: u8 = 4;
    pub const VRML97: u8 = 8;
    /// Classes that only Coin and its relatives know.
    pub const COIN: u8 = 16;
}

/// How a class takes part in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Treatment {
    /// It is drawn.
    Rendered,
    /// It changes the traversal state.
    State,
    /// Its children are walked.
    Group,
    /// It is read and written back, and not drawn.
    Kept,
    /// It is a family, of which no node is.
    Abstract,
}

/// What happens when a walk meets a node of a class: the last word of a class line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Nothing: sensors, engines, information, hints to a graphics library.
    Kept,
    /// Nothing: the node that has it in a field reads it, as a VRML97 `Shape` does its `Material`.
    Held,
    /// Changes the traversal state.
    Property,
    Light,
    Camera,
    /// VRML97 `Background` and `Fog`, of which a scene has one in force.
    Bindable,
    Shape,
    /// VRML97's `Shape`, which holds an appearance and the geometry to draw with it.
    AppearanceAndGeometry,
    Group,
    Separator,
    TransformSeparator,
    /// A separator that moves its children: VRML97's `Transform`.
    TransformGroup,
    Billboard,
    Switch,
    Blinker,
    PathSwitch,
    Array,
    MultipleCopy,
    Lod,
    LevelOfDetail,
    /// Names files, whose roots are its children.
    File,
    Kit,
    /// A kit's list of children, in a container of its own.
    ListPart,
}

impl ClassId {
    pub(crate) fn get(self) -> &'static Class {
        &CLASSES[usize::from(self.0)]
    }
}

#[derive(Debug)]
pub struct Class {
    pub id: ClassId,
    pub name: &'static str,
    pub family: &'static str,
    /// The family's entry, if the catalogue has one.
    pub parent: Option<ClassId>,
    /// A set of [`Dialect`] bits.
    pub dialects: u8,
    pub treatment: Treatment,
    pub role: Role,
    pub fields: &'static [FieldDecl],
    /// VRML97's `eventIn`s that are not fields.
    pub inputs: &'static [(&'static str, FieldType)],
    /// The outputs of an engine; VRML97's `eventOut`s that are not fields.
    pub outputs: &'static [(&'static str, FieldType)],
    /// A node kit's parts, those of one parent in the order in which they are walked.
    pub parts: &'static [Part],
    /// Where the catalogue declares it.
    pub place: &'static str,
}

impl Class {
    pub fn field(&self, name: &str) -> Option<(usize, &'static FieldDecl)> {
        self.fields.iter().enumerate().find(|(_, f)| f.name == name)
    }

    /// Whether the class is, or descends from, the family of that name.
    pub fn is_a(&self, family: &str) -> bool {
        self.lineage()
            .any(|c| c.name == family || c.family == family)
    }

    /// Whether the class is, or descends from, another.
    pub(crate) fn descends_from(&self, ancestor: ClassId) -> bool {
        self.lineage().any(|c| c.id == ancestor)
    }

    /// The class itself, its family, that one's family, and so on.
    pub(crate) fn lineage(&self) -> impl Iterator<Item = &Self> {
        std::iter::successors(Some(self), |c| c.parent.map(ClassId::get))
    }

    /// Whether the class is VRML97's alone.
    pub(crate) fn is_vrml97(&self) -> bool {
        self.dialects & Dialect::VRML97 != 0
            && self.dialects & (Dialect::IV1 | Dialect::IV2 | Dialect::VRML1) == 0
    }
}

/// A part of a node kit. Each is also a field, an `SFNode` of the same name.
#[derive(Debug)]
pub struct Part {
    pub name: &'static str,
    /// The part it is a child of; `this` is the kit itself.
    pub parent: &'static str,
    /// The class that the kit makes where a file does not say.
    pub class: &'static str,
    /// Holds a `NodeKitListPart`.
    pub list: bool,
    /// Made by the kit itself; others come when a file states them (or a part below them).
    pub made: bool,
}

/// Finds a class by its name and dialects (a set of bits); the first declared wins.
pub fn by_name(name: &str, dialects: u8) -> Option<&'static Class> {
    index()
        .get(name)?
        .iter()
        .map(|id| id.get())
        .find(|c| c.dialects & dialects != 0)
}

/// Finds a class by its name in any dialect, since files mix them.
pub fn any(name: &str) -> Option<&'static Class> {
    index().get(name)?.first().map(|id| id.get())
}

fn index() -> &'static HashMap<&'static str, Vec<ClassId>> {
    static INDEX: OnceLock<HashMap<&'static str, Vec<ClassId>>> = OnceLock::new();
    INDEX.get_or_init(|| {
        let mut map: HashMap<&'static str, Vec<ClassId>> = HashMap::new();
        for class in CLASSES {
            map.entry(class.name).or_default().push(class.id);
        }
        map
    })
}

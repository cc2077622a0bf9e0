//! The catalogue's entries for node classes, and functions that find a class by name.

use std::collections::HashMap;
use std::sync::OnceLock;

use super::catalogue::CLASSES;
use super::class_id::ClassId;
use super::field::{FieldDecl, FieldType};

/// The file formats that have a class, as a set of bits.
pub struct Dialect;

impl Dialect {
    /// Inventor V1.0.
    pub const IV1: u8 = 1;
    /// Inventor V2.0 and V2.1.
    pub const IV2: u8 = 2;
    /// VRML 1.0.
    pub const VRML1: u8 = 4;
    /// VRML97.
    pub const VRML97: u8 = 8;
    /// Inventor files of Coin and later libraries.
    pub const COIN: u8 = 16;
    /// X3D, which has the classes of VRML97 too.
    pub const X3D: u8 = 32;
}

/// How a class takes part in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Treatment {
    /// The node is drawn.
    Rendered,
    /// The node changes the traversal state.
    State,
    /// The node's children are traversed.
    Group,
    /// The node is read and written back, but not drawn.
    Kept,
    /// The class is a family without nodes of its own.
    Abstract,
}

/// The effect of a node of a class on traversal: the last word of a class line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Role {
    /// No effect. Clocks, engines, information and hints to a graphics library have this role.
    Kept,
    /// No effect by itself. The node that has it in a field reads it, as a VRML97 `Shape` reads its
    /// `Material`.
    Held,
    /// A property, which changes the traversal state.
    Property,
    /// A light source.
    Light,
    /// A camera.
    Camera,
    /// VRML97's `Background` and `Fog`, of which only one is active.
    Bindable,
    /// A sensor whose events depend on where it is and where the viewer or the pointer is.
    Sensor,
    /// A shape.
    Shape,
    /// VRML97's `Shape`, which contains an appearance and the geometry to draw with it.
    AppearanceAndGeometry,
    /// A group that does not restore the state: Inventor's `Group`.
    Group,
    /// A group that restores the state after its children.
    Separator,
    /// A group that restores only the transform after its children.
    TransformSeparator,
    /// A separator that transforms its children: VRML97's `Transform`.
    TransformGroup,
    /// A group that turns toward the viewer: VRML97's `Billboard`.
    Billboard,
    /// A group of which the selected children are traversed.
    Switch,
    /// A switch that changes its child with time.
    Blinker,
    /// A group that is traversed only along a given path.
    PathSwitch,
    /// A group that is repeated on a regular grid.
    Array,
    /// A group that is repeated with a list of transforms.
    MultipleCopy,
    /// A level of detail that is selected by distance: `LOD`.
    Lod,
    /// A level of detail that is selected by size on the screen: `LevelOfDetail`.
    LevelOfDetail,
    /// A node that includes files, whose roots are its children.
    File,
    /// A node kit.
    Kit,
    /// A node kit's list of children, which has its own container.
    ListPart,
}

impl ClassId {
    /// Returns the class's entry.
    pub fn get(self) -> &'static Class {
        &CLASSES[usize::from(self.0)]
    }
}

/// The catalogue's entry for a node class.
#[derive(Debug)]
pub struct Class {
    /// The identifier of the class.
    pub id: ClassId,
    /// The name of the class in files.
    pub name: &'static str,
    /// The name of the base class.
    pub family: &'static str,
    /// The base class, if the catalogue has an entry for it.
    pub parent: Option<ClassId>,
    /// The file formats that have the class, as [`Dialect`] bits.
    pub dialects: u8,
    /// How the class takes part in a picture.
    pub treatment: Treatment,
    /// The effect of a node on traversal.
    pub role: Role,
    /// The fields, with those of the base classes first.
    pub fields: &'static [FieldDecl],
    /// The name and type of each `eventIn` of VRML97 that is not a field.
    pub inputs: &'static [(&'static str, FieldType)],
    /// The name and type of each output of an engine, or `eventOut` of VRML97 that is not a field.
    pub outputs: &'static [(&'static str, FieldType)],
    /// The parts of a node kit. Parts with the same parent are in the order of traversal.
    pub parts: &'static [KitPart],
    /// The file and line of the catalogue that declare the class.
    pub place: &'static str,
}

impl Class {
    /// Finds a field by name, and returns it with its index.
    pub fn field(&self, name: &str) -> Option<(usize, &'static FieldDecl)> {
        self.fields.iter().enumerate().find(|(_, f)| f.name == name)
    }

    /// Returns whether the class is, or descends from, the family with this name.
    pub fn is_a(&self, family: &str) -> bool {
        self.lineage()
            .any(|c| c.name == family || c.family == family)
    }

    /// Returns whether the class is, or descends from, another class.
    pub fn descends_from(&self, ancestor: ClassId) -> bool {
        self.lineage().any(|c| c.id == ancestor)
    }

    /// Returns the class, its family, the family's family, and so on.
    pub fn lineage(&self) -> impl Iterator<Item = &Self> {
        std::iter::successors(Some(self), |c| c.parent.map(ClassId::get))
    }

    /// Returns whether VRML97 or X3D has the class, and neither Inventor nor VRML 1.0 has it.
    pub fn is_vrml97(&self) -> bool {
        self.dialects & (Dialect::VRML97 | Dialect::X3D) != 0
            && self.dialects & (Dialect::IV1 | Dialect::IV2 | Dialect::VRML1) == 0
    }
}

/// A part of a node kit. Each part is also an `SFNode` field of the same name.
#[derive(Debug)]
pub struct KitPart {
    /// The name of the part.
    pub name: &'static str,
    /// The name of the part that this part is a child of. `this` is the kit itself.
    pub parent: &'static str,
    /// The class of the node that the kit creates if a file does not state the part.
    pub class: &'static str,
    /// Whether the part contains a `NodeKitListPart`.
    pub list: bool,
    /// Whether the kit always creates the part. Other parts exist only if a file states them or a
    /// part below them.
    pub made: bool,
}

/// Finds a class by name and dialects, which are [`Dialect`] bits. Of several classes it returns
/// the one that the catalogue declares first.
pub fn by_name(name: &str, dialects: u8) -> Option<&'static Class> {
    index()
        .get(name)?
        .iter()
        .map(|id| id.get())
        .find(|c| c.dialects & dialects != 0)
}

/// Finds a class by name in any dialect, because files mix them.
pub fn any(name: &str) -> Option<&'static Class> {
    index().get(name)?.first().map(|id| id.get())
}

/// Returns the classes by name.
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

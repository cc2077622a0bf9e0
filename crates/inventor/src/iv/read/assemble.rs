//! Assembles nodes while a file is read: finds classes and fields by name, and records the names
//! after `DEF`. The ASCII and the binary reader share it.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use ivcam_base::diag::{Result, Span, nearest};
use ivcam_base::files::FileBytes;
use ivcam_base::work;

use super::enum_names::EnumNames;
use super::header::Header;
use super::numbers::float;
use super::stated::StatedPlaces;
use super::tokens::legal_name;
use super::upgrade;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{self, Class, ClassId, Dialect, FieldDecl, FieldType, Treatment, class};
use crate::iv::declarations::Extension;
use crate::iv::declared_fields::DeclaredFields;
use crate::iv::document::{ClassRef, Document, FieldEntry, Node};
use crate::iv::encoding::text;
use crate::iv::limits::{Limits, beyond, cut_at};
use crate::iv::x3d_names::in_vrml97;

/// A field of a node's class, as it was found by name.
#[derive(Clone, Copy)]
pub(super) enum FieldSlot {
    /// A field of the class, by its index.
    Field { index: u16, kind: FieldType },
    /// A field that later versions of the format do not have. [`upgrade`] replaces it.
    Old(&'static upgrade::OldField),
}

impl FieldSlot {
    /// Returns the type of the field's values.
    pub(super) fn kind(self) -> FieldType {
        match self {
            Self::Field { kind, .. } => kind,
            Self::Old(old) => old.kind,
        }
    }
}

/// The largest number of fields that a file may declare for a class. A node finds its stated fields
/// by linear search, so without a limit a hostile file takes quadratic time. No search is recorded:
/// with this number the search takes 12.5 million comparisons.
pub(super) const MAX_FIELDS: usize = 5_000;

/// The steps of work that a node takes: its lists are allocated, and it is visited several times
/// before the scene is compiled.
const NODE_STEPS: u64 = 100;

/// The number of bytes after which the memory of what has been read is given back.
const RELEASED: usize = 4 << 20;

/// The top-level nodes and classes that a file adds to a document.
pub(super) struct FileRead {
    /// The top-level nodes of the file.
    pub roots: Vec<NodeId>,
    /// The classes that the file declares: their names and indices in [`Document::extensions`].
    pub declared: HashMap<Box<str>, u32>,
}

/// The type of `file::read_into`. It is passed as a pointer because an `EXTERNPROTO` needs another
/// file while the file that refers to it is being read.
pub(super) type ReadFile =
    fn(&mut Document, &str, FileBytes, &Limits, Option<Header>) -> Result<FileRead>;

/// The names of the fields and events of a proto.
pub(super) type InterfaceNames = HashSet<Box<str>>;

/// The document that is being read, and the state of reading one file.
pub(super) struct Assembler<'d> {
    pub document: &'d mut Document,
    pub header: Header,
    pub limits: Limits,
    pub read_file: ReadFile,
    /// The index of the file in [`Document::sources`].
    pub source: u16,
    /// The nodes by the whole token after `DEF`, including its reference number.
    pub names: HashMap<Box<[u8]>, NodeId>,
    /// For each open node whose name was defined before: the last node of that name that is
    /// complete.
    redefined: HashMap<NodeId, NodeId>,
    /// The classes that this file declares: their names and indices in [`Document::extensions`].
    pub declared: HashMap<Box<str>, u32>,
    /// The previous class of each declared name, which is restored at the end of the proto.
    pub shadowed: Vec<(Box<str>, Option<u32>)>,
    /// The number of further hints (`did you mean`) to search for. Each search compares all names.
    hints: usize,
    /// The node whose field was set last, with the places of its fields.
    stated: (NodeId, StatedPlaces),
    /// The names in the interface of each open proto, by its index.
    pub interfaces: HashMap<usize, InterfaceNames>,
    /// The number of open bodies of protos.
    pub in_protos: usize,
    /// Whether the text that is read was made from the source, which has other offsets. A field of
    /// nodes may then be stated repeatedly, each time with more nodes.
    pub is_translated: bool,
    /// The values of fields that later versions do not have, for [`upgrade`].
    pub old: Vec<(NodeId, &'static upgrade::OldField, Value)>,
    /// The file, if its memory can be given back while it is read.
    pub file: Option<&'d FileBytes>,
}

impl<'d> Assembler<'d> {
    /// Creates the state for reading the document's last source.
    pub(super) fn new(
        document: &'d mut Document,
        header: Header,
        limits: &Limits,
        read_file: ReadFile,
    ) -> Self {
        let source = u16::try_from(document.sources.len() - 1).unwrap_or(u16::MAX);
        Self {
            document,
            header,
            limits: limits.clone(),
            read_file,
            source,
            names: HashMap::new(),
            redefined: HashMap::new(),
            declared: HashMap::new(),
            shadowed: Vec::new(),
            hints: 200,
            stated: (NodeId(u32::MAX), StatedPlaces::default()),
            interfaces: HashMap::new(),
            in_protos: 0,
            is_translated: false,
            old: Vec::new(),
            file: None,
        }
    }

    /// Makes a function that gives back the memory of a file of `len` bytes up to those that are
    /// left to be read.
    pub(super) fn releases(&self, len: usize) -> impl Fn(usize) + use<'d> {
        let file = self.file;
        move |left| {
            if let Some(file) = file {
                file.release_before(len - left);
            }
        }
    }

    /// Finds a class by the name that a file uses. Classes that the file declares come first, then
    /// those of its dialect, then those of any dialect. The prefix `So` of Inventor's C++ classes,
    /// Coin's prefix `VRML` for VRML97 classes and `X3D` for those of X3D are accepted.
    pub(super) fn class_named(&self, name: &str) -> Option<ClassRef> {
        if let Some(&extension) = self.declared.get(name) {
            return Some(ClassRef::Extension(extension));
        }
        self.known_class(name).map(ClassRef::Known)
    }

    /// Finds a class of the catalogue by name, as [`Self::class_named`] does.
    pub(super) fn known_class(&self, name: &str) -> Option<ClassId> {
        let find = |name: &str| {
            let class =
                grammar::by_name(name, self.header.dialect).or_else(|| grammar::any(name))?;
            (class.treatment != Treatment::Abstract).then_some(class.id)
        };
        let prefixed = |name: &str, prefix: &str, dialect: u8| {
            let class = grammar::by_name(name.strip_prefix(prefix)?, dialect)?;
            (class.treatment != Treatment::Abstract).then_some(class.id)
        };
        let vrml97 = |name: &str| {
            let of_x3d = || prefixed(name, "X3D", Dialect::X3D);
            prefixed(name, "VRML", Dialect::VRML97).or_else(of_x3d)
        };
        let bare = name
            .strip_prefix("So")
            .filter(|n| n.starts_with(|c: char| c.is_ascii_uppercase()));
        let renamed = (self.header.dialect == Dialect::IV1)
            .then(|| upgrade::renamed_class(name))
            .flatten();
        find(name)
            .or_else(|| find(renamed?))
            .or_else(|| vrml97(name))
            .or_else(|| bare.and_then(|b| find(b).or_else(|| vrml97(b))))
    }

    /// Adds a node.
    ///
    /// # Errors
    /// Returns an error if the document already has as many nodes as the limit allows.
    pub(super) fn add(
        &mut self,
        class: ClassRef,
        name: Option<Arc<str>>,
        span: Span,
    ) -> Result<NodeId> {
        if self.document.nodes.len() >= self.limits.nodes {
            let message = format!("more than {} nodes", self.limits.nodes);
            return Err(beyond(&self.document.sink, span, message, "nodes"));
        }
        self.spend(NODE_STEPS, span)?;
        Ok(self.document.add(Node {
            class,
            name,
            fields: Vec::new(),
            children: Vec::new(),
            span,
            source: self.source,
        }))
    }

    /// Counts steps of work for a place in the file.
    ///
    /// # Errors
    /// Returns an error if the scene's account is used up, or if reading has to end.
    pub(super) fn spend(&self, steps: u64, span: Span) -> Result<()> {
        work::spend(steps).map_err(|cut| cut_at(&self.document.sink, span, cut))
    }

    /// Counts the work of a step of a reader, which has read some bytes up to a place in the file.
    /// A number of four bytes takes a step of work.
    ///
    /// # Errors
    /// Returns the errors of [`Self::spend`].
    pub(super) fn spend_read(&self, bytes: usize, at: usize) -> Result<()> {
        if let Some(file) = self.file
            && at / RELEASED > at.saturating_sub(bytes) / RELEASED
        {
            file.release_before(at);
        }
        self.spend(bytes as u64 / 4 + 2, Span::at(at))
    }

    /// Returns a node's entry in the arena.
    pub(super) fn data(&mut self, node: NodeId) -> &mut Node {
        &mut self.document.nodes[node.0 as usize]
    }

    /// Records a node under the token after `DEF`, and sets its name. `name+3` is a node with the
    /// name `name` and the reference number 3; `+3` is a node without a name.
    pub(super) fn define(&mut self, token: &[u8], node: NodeId) {
        if let Some(before) = self.names.insert(token.into(), node) {
            // A node that is open stays so until this one is complete.
            let complete = self.redefined.get(&before).copied().unwrap_or(before);
            self.redefined.insert(node, complete);
        }
        let name = base_name(token);
        if name.is_empty() {
            return;
        }
        let name: Arc<str> = text(&legal_name(name)).into();
        self.data(node).name = Some(name.clone());
        if self.source == 0 && self.in_protos == 0 {
            self.document.names.insert(name, node);
        }
    }

    /// Records that a node is complete.
    pub(super) fn complete(&mut self, node: NodeId) {
        self.redefined.remove(&node);
    }

    /// Finds the node that a token after `USE` refers to: the latest one with the name that is
    /// complete. Inside `DEF a Group { }` that is an earlier `DEF a`, because a node cannot be used
    /// inside itself.
    pub(super) fn used(&self, token: &[u8]) -> Option<NodeId> {
        let base = || self.names.get(base_name(token));
        let node = self.names.get(token).or_else(base).copied()?;
        Some(self.redefined.get(&node).copied().unwrap_or(node))
    }

    /// Declares that a name means a class of the file until the scope ends, or with `None` that it
    /// means no class of the file.
    pub(super) fn declare_class(&mut self, name: Box<str>, class: Option<u32>) {
        let before = match class {
            Some(class) => self.declared.insert(name.clone(), class),
            None => self.declared.remove(&name),
        };
        self.shadowed.push((name, before));
    }

    /// Finds the extension of a proto that has a body, by name.
    pub(super) fn proto_named(&self, name: &str) -> Option<u32> {
        let &class = self.declared.get(name)?;
        let proto = &self.document.protos.list[self.document.protos.of_extension(class)?];
        (!proto.external || !proto.body.is_empty()).then_some(class)
    }

    /// Undoes all declarations except the first `shadowed` ones.
    pub(super) fn end_scope(&mut self, shadowed: usize) {
        for (name, before) in self
            .shadowed
            .drain(shadowed.min(self.shadowed.len())..)
            .rev()
        {
            match before {
                Some(class) => self.declared.insert(name, class),
                None => self.declared.remove(&name),
            };
        }
    }

    /// Returns whether another hint may be searched for, and counts the search.
    pub(super) fn may_hint(&mut self) -> bool {
        self.hints = self.hints.saturating_sub(1);
        self.hints > 0
    }

    /// Finds the `DEF` name that is nearest in spelling. The names are sorted, so that every run
    /// returns the same one of several.
    pub(super) fn nearest_name(&mut self, name: &str) -> Option<String> {
        if self.names.len() > 10_000 || !self.may_hint() {
            return None;
        }
        let keys = self.names.keys();
        let mut names: Vec<&str> = keys.filter_map(|k| std::str::from_utf8(k).ok()).collect();
        names.sort_unstable();
        nearest(name, names).map(str::to_owned)
    }

    /// Finds a field of a node by name.
    pub(super) fn slot(&self, node: NodeId, name: &str) -> Option<FieldSlot> {
        let found = match self.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) => match self.field_of(id.get(), name) {
                Some((i, decl)) => (i, decl.kind),
                None => return upgrade::old_field(id, name).map(FieldSlot::Old),
            },
            ClassRef::Extension(i) => {
                let fields = &self.document.extensions[i as usize].fields;
                let i = fields.place(name)?;
                (i, fields[i].1)
            }
        };
        Some(FieldSlot::Field {
            index: found.0 as u16,
            kind: found.1,
        })
    }

    /// Finds a field of a class of the catalogue by the name in the file's dialect.
    fn field_of(&self, class: &Class, name: &str) -> Option<(usize, &'static FieldDecl)> {
        let own = match self.header.is_x3d() && class.is_vrml97() {
            true => in_vrml97(class.name, name),
            false => None,
        };
        let found = class.field(own.as_deref().unwrap_or(name));
        found.filter(|(_, decl)| !(decl.x3d && self.header.is_vrml97()))
    }

    /// Returns the name in the catalogue of a field or event of a node.
    pub(super) fn event_name(&self, node: NodeId, name: &str) -> Box<str> {
        match self.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) if self.header.is_x3d() => in_vrml97(id.get().name, name),
            _ => None,
        }
        .unwrap_or_else(|| name.into())
    }

    /// Returns the place of the entry of a field that the node states.
    pub(super) fn entry_of(&self, node: NodeId, index: u16) -> Option<usize> {
        let fields = &self.document.nodes[node.0 as usize].fields;
        fields.iter().position(|field| field.index == index)
    }

    /// Returns the names of the values of an enumeration field.
    pub(super) fn names_of(&self, node: NodeId, slot: FieldSlot) -> EnumNames {
        let none = |_: &str| None;
        match (slot, self.document.nodes[node.0 as usize].class) {
            (FieldSlot::Old(old), _) => EnumNames {
                names: old.names,
                old: none,
            },
            (FieldSlot::Field { index, .. }, ClassRef::Known(id)) => EnumNames {
                names: id.get().fields[usize::from(index)].names,
                old: upgrade::old_names(id, index),
            },
            (FieldSlot::Field { index, .. }, ClassRef::Extension(i)) => {
                let extension = &self.document.extensions[i as usize];
                let name = &*extension.fields[usize::from(index)].0;
                let of = |is_a: &str| Some(grammar::any(is_a)?.field(name)?.1.names);
                let names = extension.is_a.iter().find_map(|is_a| of(is_a));
                EnumNames {
                    names: names.unwrap_or(&[]),
                    old: none,
                }
            }
        }
    }

    /// Returns the type to parse a value as. For an enumeration that the file declares the names of
    /// the values are unknown, so its values are kept as text.
    pub(super) fn written_as(&self, node: NodeId, slot: FieldSlot) -> FieldType {
        let own = matches!(
            self.document.nodes[node.0 as usize].class,
            ClassRef::Extension(_)
        );
        match slot.kind() {
            kind if !own || !self.names_of(node, slot).names.is_empty() => kind,
            FieldType::SFEnum => FieldType::SFName,
            FieldType::MFEnum => FieldType::MFName,
            kind => kind,
        }
    }

    /// Returns the names of the fields of a node's class.
    pub(super) fn field_names(&self, node: NodeId) -> Vec<&str> {
        match self.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) => id.get().fields.iter().map(|f| f.name).collect(),
            ClassRef::Extension(i) => self.document.extensions[i as usize]
                .fields
                .iter()
                .map(|(n, _)| &**n)
                .collect(),
        }
    }

    /// Sets a field and replaces an earlier value. Returns its index among the node's stated
    /// fields.
    pub(super) fn set(&mut self, node: NodeId, index: u16, value: Value, span: Span) -> usize {
        if !value.is_finite() {
            let message = "has a number that is NaN or infinite";
            let place = self.first_not_finite(span).unwrap_or(span);
            self.warn_about_numbers(node, index, place, message);
        }
        if self.is_beyond_16_bits(node, index, &value) {
            let message = "has a number beyond 16 bits; the nearest that fits is used";
            self.warn_about_numbers(node, index, span, message);
        }
        if let ClassRef::Known(class) = self.document.nodes[node.0 as usize].class
            && let Some(range) = self.range_beside(class.get(), index, &value)
        {
            let message = format!("has a number outside of its range, {range}");
            self.warn_about_numbers(node, index, span, &message);
        }
        let entry = FieldEntry::new(index, value, span);
        let fields = &mut self.document.nodes[node.0 as usize].fields;
        if self.stated.0 != node {
            self.stated = (node, StatedPlaces::default());
        }
        if let Some(place) = self.stated.1.place(fields, index) {
            fields[place] = entry;
            return place;
        }
        fields.push(entry);
        fields.len() - 1
    }

    /// Returns the place of the first number in the text of a value that is NaN or infinite.
    fn first_not_finite(&self, value: Span) -> Option<Span> {
        if self.is_translated {
            return None;
        }
        let bytes = self.document.sources[usize::from(self.source)].text();
        let text = bytes.get(value.start as usize..value.end as usize)?;
        let ends = |b: &u8| b.is_ascii_whitespace() || b",[]{}".contains(b);
        let mut start = value.start as usize;
        for word in text.split(ends) {
            if float(word).is_ok_and(|(_, number)| !number.is_finite()) {
                return Some(Span::new(start, start + word.len()));
            }
            start += word.len() + 1;
        }
        None
    }

    /// Returns whether a value is too large for its field, which has 16 bits.
    fn is_beyond_16_bits(&self, node: NodeId, index: u16, value: &Value) -> bool {
        let Some(class) = self.document.node(node).class() else {
            return false;
        };
        let kind = class.fields.get(usize::from(index)).map(|f| f.kind);
        match (kind, value) {
            (Some(FieldType::SFShort), Value::Int(n)) => i16::try_from(*n).is_err(),
            (Some(FieldType::SFUShort), Value::UInt(n)) => u16::try_from(*n).is_err(),
            _ => false,
        }
    }

    /// Warns about the numbers of a field. The field keeps them.
    fn warn_about_numbers(&mut self, node: NodeId, index: u16, span: Span, message: &str) {
        let node = self.document.node(node);
        let class = node.class_name();
        let field = match node.class() {
            Some(class) => class.fields.get(usize::from(index)).map(|f| f.name),
            None => None,
        };
        let message = format!("`{class}.{}` {message}", field.unwrap_or("a field"));
        self.document.sink.warn(span, message);
    }

    /// Returns the index of an extension equal to this one, which is added if there is none.
    pub(super) fn extension(&mut self, extension: Extension) -> u32 {
        // A hostile file may declare very many classes with one name, so only the last 64 are
        // compared. If an equal one is missed, the file only takes more memory.
        let alike = self
            .document
            .extension_names
            .entry(extension.name.clone())
            .or_default();
        let (extensions, protos) = (&self.document.extensions, &self.document.protos);
        let same =
            |i: &&u32| extensions[**i as usize] == extension && protos.of_extension(**i).is_none();
        if let Some(&known) = alike.iter().rev().take(64).find(same) {
            return known;
        }
        let index = self.document.extensions.len() as u32;
        alike.push(index);
        self.document.extensions.push(extension);
        index
    }

    /// Sets a node's class to the one that the file declares with `fields [ … ]` and `isA [ … ]`. A
    /// class of the catalogue is kept, unless it draws nothing itself and the file adds fields.
    pub(super) fn declare(
        &mut self,
        node: NodeId,
        fields: Vec<(Box<str>, FieldType)>,
        is_a: Vec<Box<str>>,
    ) {
        let extension = match self.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) => {
                let class = id.get();
                let known = class.fields.iter().map(|f| (f.name.into(), f.kind));
                let mut all: DeclaredFields = known.collect();
                let known = all.len();
                add_all(&mut all, fields);
                if all.len() == known
                    || !matches!(class.treatment, Treatment::Kept | Treatment::State)
                {
                    return;
                }
                Extension {
                    name: class.name.into(),
                    fields: all,
                    is_a: vec![class.name.into()],
                    interface: Vec::new(),
                }
            }
            ClassRef::Extension(i) => {
                let old = &self.document.extensions[i as usize];
                let mut all = old.fields.clone();
                add_all(&mut all, fields);
                let is_a = if is_a.is_empty() {
                    old.is_a.clone()
                } else {
                    is_a
                };
                Extension {
                    name: old.name.clone(),
                    fields: all,
                    is_a,
                    interface: Vec::new(),
                }
            }
        };
        let name = extension.name.clone();
        let index = self.extension(extension);
        if self.known_class(&name).is_none() {
            self.declare_class(name, Some(index));
        }
        self.data(node).class = ClassRef::Extension(index);
    }

    /// Returns the class of a node before its own declaration of fields is read. Declarations of
    /// other nodes of that name do not count, but a proto does.
    pub(super) fn blank(&mut self, name: &str, known: Option<ClassRef>) -> ClassRef {
        match known {
            Some(ClassRef::Extension(i)) if self.document.protos.of_extension(i).is_none() => {
                self.unknown(name)
            }
            Some(class) => class,
            None => self.unknown(name),
        }
    }

    /// Returns a class without fields for an undeclared name.
    pub(super) fn unknown(&mut self, name: &str) -> ClassRef {
        let extension = Extension {
            name: name.into(),
            fields: DeclaredFields::default(),
            is_a: Vec::new(),
            interface: Vec::new(),
        };
        ClassRef::Extension(self.extension(extension))
    }

    /// Adds the fields that depend on the `type` of an engine or `GlobalField`. Returns `None` if
    /// the node is of another class. `field` is the name of a `GlobalField`'s field.
    pub(super) fn specialize(
        &mut self,
        node: NodeId,
        type_name: &str,
        field: Option<&str>,
    ) -> Option<()> {
        let ClassRef::Known(id) = self.document.nodes[node.0 as usize].class else {
            return None;
        };
        let kind = FieldType::named(type_name.strip_prefix("So").unwrap_or(type_name))?;
        let many = if kind.is_multiple() {
            kind
        } else {
            FieldType::named(&format!("MF{}", &kind.name()[2..])).unwrap_or(kind)
        };
        let known = id.get().fields.iter();
        let mut fields: DeclaredFields = known.map(|f| (f.name.into(), f.kind)).collect();
        match id {
            class::GATE | class::SELECT_ONE => fields.add("input".into(), many),
            class::CONCATENATE => {
                (0..10).for_each(|i| fields.add(format!("input{i}").into(), many));
            }
            class::GLOBAL_FIELD => fields.add(field?.into(), kind),
            _ => return None,
        }
        let name: Box<str> = id.get().name.into();
        let extension = Extension {
            name: name.clone(),
            fields,
            is_a: vec![name],
            interface: Vec::new(),
        };
        let index = self.extension(extension);
        self.data(node).class = ClassRef::Extension(index);
        Some(())
    }
}

/// Adds declared fields up to [`MAX_FIELDS`].
fn add_all(all: &mut DeclaredFields, fields: Vec<(Box<str>, FieldType)>) {
    for (name, kind) in fields {
        if all.len() >= MAX_FIELDS {
            return;
        }
        all.add(name, kind);
    }
}

/// Returns the part of a token before its reference numbers, such as `name` in `name+3`.
fn base_name(mut token: &[u8]) -> &[u8] {
    while let Some(i) = token.iter().rposition(|&b| b == b'+')
        && token[i + 1..].iter().all(u8::is_ascii_digit)
    {
        token = &token[..i];
    }
    token
}

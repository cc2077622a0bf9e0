//! Reads the statements that only VRML97 has: `PROTO`, `EXTERNPROTO`, `IS`, `ROUTE`, and the
//! interface of a `Script`.

use std::collections::HashMap;
use std::sync::Arc;

use ivcam_base::diag::{Diagnostic, Result, Span, excerpt};
use ivcam_base::files::FileBytes;
use ivcam_base::work::{self, Budget};

use super::reader::{AsciiLevel, AsciiReader, Scope};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{FieldType, class};
use crate::iv::declarations::{Access, Extension, Interface, Link, Proto, Route};
use crate::iv::declared_fields::DeclaredFields;
use crate::iv::document::ClassRef;
use crate::iv::encoding::text;
use crate::iv::limits::Limits;
use crate::iv::read::assemble::{FieldSlot, InterfaceNames, MAX_FIELDS};
use crate::iv::read::enum_names::EnumNames;
use crate::iv::read::expand::{self, proto_of};
use crate::iv::read::tokens::{skip, word};
use crate::iv::read::values;

/// The largest number of names that the help of a message lists.
const MOST_NAMES: usize = 100;

impl<'s> AsciiReader<'_, '_, 's> {
    /// Returns whether a node is a `Script`.
    pub(super) fn is_script(&self, node: NodeId) -> bool {
        match self.asm.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) => id == class::SCRIPT,
            ClassRef::Extension(i) => {
                let extension = &self.asm.document.extensions[i as usize];
                extension.is_a.first().is_some_and(|n| **n == *"Script")
            }
        }
    }

    /// Reads `field SFFloat x 1` or `eventIn SFTime now` in a `Script`. The node gets its own class
    /// with that field or event.
    pub(super) fn script_interface(&mut self, node: NodeId, access: Access) -> Result<()> {
        let Some(interface) = self.interface_item(access) else {
            return Ok(());
        };
        if let ClassRef::Known(id) = self.asm.document.nodes[node.0 as usize].class {
            let name: Box<str> = id.get().name.into();
            let fields = id
                .get()
                .fields
                .iter()
                .map(|f| (f.name.into(), f.kind))
                .collect();
            let is_a = vec![name.clone()];
            let extensions = &mut self.asm.document.extensions;
            extensions.push(Extension {
                name,
                fields,
                is_a,
                interface: Vec::new(),
            });
            let index = extensions.len() as u32 - 1;
            self.asm.data(node).class = ClassRef::Extension(index);
        }
        let ClassRef::Extension(index) = self.asm.document.nodes[node.0 as usize].class else {
            return Ok(());
        };
        self.add_field(index, &interface);
        self.asm.document.extensions[index as usize]
            .interface
            .push(interface.clone());
        self.set_empty(node, &interface);
        if word(skip(self.rest)).is_ok_and(|(_, w)| w == b"IS") {
            return self.is_link(node, &interface.name);
        }
        self.interface_value(node, &interface)
    }

    /// Sets a field that a node declares to an empty value, in case no value can be read.
    fn set_empty(&mut self, node: NodeId, interface: &Interface) {
        if interface.access.has_value()
            && let Some(FieldSlot::Field { index, kind }) = self.asm.slot(node, &interface.name)
        {
            let span = self.here();
            self.asm.set(node, index, Value::empty(kind), span);
        }
    }

    /// Adds a field of an interface to its class's fields.
    fn add_field(&mut self, extension: u32, interface: &Interface) {
        let fields = &mut self.asm.document.extensions[extension as usize].fields;
        if interface.access.has_value() && fields.len() < MAX_FIELDS {
            fields.add(interface.name.clone(), interface.kind);
        }
    }

    /// Reads the value after the name of an interface's field. Events have none.
    fn interface_value(&mut self, node: NodeId, interface: &Interface) -> Result<()> {
        if !interface.access.has_value() {
            return Ok(());
        }
        match self.asm.slot(node, &interface.name) {
            Some(slot) => self.field(node, slot, self.here()),
            None => Ok(()),
        }
    }

    /// Reads a type and a name after a keyword such as `field`.
    fn interface_item(&mut self, access: Access) -> Option<Interface> {
        let at = skip(self.rest);
        let (rest, kind_name) = word(at).ok()?;
        let (rest, name) = word(skip(rest)).ok()?;
        self.rest = rest;
        let kind_text = text(kind_name);
        let Some(kind) = FieldType::named(&kind_text) else {
            let span = self.span(at, &at[kind_name.len()..]);
            self.warn(
                span,
                format!("`{}` is not a field type", excerpt(&kind_text)),
            );
            return None;
        };
        Some(Interface {
            access,
            kind,
            name: text(name).into(),
        })
    }

    /// Reads `IS interface` after the name of a field.
    pub(super) fn is_link(&mut self, node: NodeId, name: &str) -> Result<()> {
        let (rest, _) = word(skip(self.rest)).unwrap_or((self.rest, &[]));
        let at = skip(rest);
        let Ok((rest, interface)) = word(at) else {
            let span = self.here();
            self.warn(span, "`IS` needs the name of a field or event of the proto");
            self.rest = rest;
            return Ok(());
        };
        self.rest = rest;
        let interface = text(interface);
        let Some(proto) = self.proto_around() else {
            return Ok(());
        };
        let is_known = |names: &InterfaceNames| names.contains(&*interface);
        if !self.asm.interfaces.get(&proto).is_some_and(is_known) {
            let proto = &self.asm.document.protos.list[proto];
            let names = proto.interface.iter().take(MOST_NAMES).map(|i| &*i.name);
            let help = format!("the proto has {}", names.collect::<Vec<_>>().join(", "));
            let span = self.span(at, rest);
            self.warn(
                span,
                format!("`{}` is not in the proto's interface", excerpt(&interface)),
            )
            .help(help);
            return Ok(());
        }
        let name = self.asm.event_name(node, name);
        let proto = &mut self.asm.document.protos.list[proto];
        proto.links.push(Link {
            node,
            name,
            interface: interface.into(),
        });
        Ok(())
    }

    /// Returns the index of the innermost proto whose body is being read.
    fn proto_around(&self) -> Option<usize> {
        self.stack.iter().rev().find_map(|level| match level {
            AsciiLevel::Proto { proto, .. } => Some(*proto),
            _ => None,
        })
    }

    /// Reads `Name [` after `PROTO` or `EXTERNPROTO`.
    pub(super) fn proto(&mut self, external: bool) -> Result<()> {
        let Ok((rest, name)) = word(self.rest) else {
            return self.stray();
        };
        let name: Box<str> = text(name).into();
        self.rest = rest;
        if !self.take(b'[') {
            let span = self.here();
            self.warn(span, format!("expected `[` after `PROTO {name}`"));
            return Ok(());
        }
        let within = self.proto_around();
        let document = &mut *self.asm.document;
        let first = document.nodes.len() as u32;
        document.extensions.push(Extension {
            name: name.clone(),
            fields: DeclaredFields::default(),
            is_a: Vec::new(),
            interface: Vec::new(),
        });
        let extension = document.extensions.len() as u32 - 1;
        let span = self.here();
        let defaults = self.asm.add(ClassRef::Extension(extension), None, span)?;
        let proto = self.asm.document.protos.add(Proto {
            extension,
            interface: Vec::new(),
            defaults,
            body: Vec::new(),
            links: Vec::new(),
            routes: Vec::new(),
            urls: Vec::new(),
            external,
            within,
        });
        let scope = Scope {
            names: HashMap::new(),
            shadowed: self.asm.shadowed.len(),
            routes: std::mem::take(&mut self.asm.document.routes),
            name,
            first,
        };
        self.asm.in_protos += 1;
        self.stack.push(AsciiLevel::Interface { proto, scope });
        Ok(())
    }

    /// Reads one line of a proto's interface.
    pub(super) fn interface(&mut self, proto: usize) -> Result<()> {
        let start = self.rest;
        let Ok((rest, token)) = word(start) else {
            return self.stray();
        };
        self.rest = rest;
        let Some(access) = Access::named(token) else {
            let span = self.span(start, rest);
            let message = format!(
                "expected field, exposedField, eventIn or eventOut, not `{}`",
                excerpt(&text(token))
            );
            self.warn(span, message);
            return Ok(());
        };
        let Some(interface) = self.interface_item(access) else {
            return Ok(());
        };
        let data = &mut self.asm.document.protos.list[proto];
        let (extension, defaults, external) = (data.extension, data.defaults, data.external);
        data.interface.push(interface.clone());
        let names = self.asm.interfaces.entry(proto).or_default();
        names.insert(interface.name.clone());
        self.add_field(extension, &interface);
        if external {
            return Ok(());
        }
        self.set_empty(defaults, &interface);
        self.interface_value(defaults, &interface)
    }

    /// Ends the interface at `]`. Begins the body of a `PROTO`, or reads the file names of an
    /// `EXTERNPROTO`.
    pub(super) fn interface_done(&mut self) -> Result<()> {
        let Some(AsciiLevel::Interface { proto, mut scope }) = self.stack.pop() else {
            return Ok(());
        };
        // Defaults may use names from outside the proto; the body may not.
        scope.names = std::mem::take(&mut self.asm.names);
        if self.asm.document.protos.list[proto].external {
            self.rest = skip(self.rest);
            let start = self.rest;
            let escapes = self.asm.header.escapes();
            let (kind, names) = (FieldType::MFString, EnumNames::NONE);
            let urls = values::value(self.rest, kind, names, escapes, &|_| {});
            if let Ok((rest, read)) = urls {
                if let Value::Strings(urls) = read.value {
                    self.asm.document.protos.list[proto].urls = urls;
                }
                self.rest = rest;
            }
            let span = self.span(start, self.rest);
            self.stack.push(AsciiLevel::Proto { proto, scope });
            self.proto_done();
            return self.external(proto, span);
        }
        if !self.take(b'{') {
            let span = self.here();
            self.warn(
                span,
                format!(
                    "expected `{{` after the interface of `{}`",
                    excerpt(&scope.name)
                ),
            );
        }
        self.stack.push(AsciiLevel::Proto { proto, scope });
        Ok(())
    }

    /// Ends the body of a proto. Restores the names of the scope around it and declares its class.
    pub(super) fn proto_done(&mut self) {
        let popped = self.stack.pop();
        let Some(AsciiLevel::Proto { proto, scope } | AsciiLevel::Interface { proto, scope }) =
            popped
        else {
            return;
        };
        self.asm.in_protos -= 1;
        let document = &mut *self.asm.document;
        let data = &mut document.protos.list[proto];
        data.routes = std::mem::replace(&mut document.routes, scope.routes);
        let extension = data.extension;
        self.asm.interfaces.remove(&proto);
        if self.asm.in_protos == 0 {
            document
                .protos
                .templates
                .push(scope.first..document.nodes.len() as u32);
        }
        self.asm.names = scope.names;
        self.asm.end_scope(scope.shadowed);
        if !self.asm.document.protos.list[proto].external {
            self.asm.declare_class(scope.name, Some(extension));
        }
    }

    /// Finds the definition of an `EXTERNPROTO` in the first of its files that has one. Without a
    /// definition the name keeps its earlier meaning, which is a `PROTO` of the file or a class of
    /// the catalogue. Without such a meaning the nodes are not drawn (VRML97, 4.9.1).
    fn external(&mut self, proto: usize, span: Span) -> Result<()> {
        let data = &self.asm.document.protos.list[proto];
        let (urls, extension) = (data.urls.clone(), data.extension);
        let name = self.asm.document.extensions[extension as usize]
            .name
            .clone();
        let before = self.asm.proto_named(&name);
        self.asm.declare_class(name.clone(), Some(extension));
        let mut reason = None;
        for url in &urls {
            match self.library(url) {
                Ok(library) => {
                    let wanted = url.rsplit_once('#').map_or(&*name, |(_, n)| n);
                    let only = || library.values().min().filter(|_| !url.contains('#'));
                    if let Some(&found) = library.get(wanted).or_else(only) {
                        self.adopt(proto, found);
                        return Ok(());
                    }
                }
                Err(error) => reason = reason.or(Some(error)),
            }
        }
        // A class of the catalogue needs no definition.
        let known = self.asm.known_class(&name).is_some();
        let instead = match before {
            Some(_) => "the earlier `PROTO` is used",
            None if known => {
                self.asm.declare_class(name, None);
                return Ok(());
            }
            None => "its nodes are not drawn",
        };
        if before.is_some() {
            self.asm.declare_class(name.clone(), before);
        }
        let message = format!(
            "the definition of `{}` was not found; {instead}",
            excerpt(&name)
        );
        let warning = self.warn(span, message);
        if let Some(error) = reason {
            warning.help(error.message.clone());
        }
        Ok(())
    }

    /// Sets the interface and body of an `EXTERNPROTO` to those of another file's proto.
    fn adopt(&mut self, proto: usize, found: u32) {
        let document = &mut *self.asm.document;
        let Some(from) = document.protos.of_extension(found) else {
            return;
        };
        let other = document.protos.list[from].clone();
        let fields = document.extensions[found as usize].fields.clone();
        let own = &mut document.protos.list[proto];
        let (extension, urls) = (own.extension, std::mem::take(&mut own.urls));
        *own = Proto {
            extension,
            urls,
            external: true,
            within: own.within,
            ..other
        };
        document.extensions[extension as usize].fields = fields;
    }

    /// Returns the extensions of another file's protos by name. Each file is read once.
    fn library(&mut self, url: &str) -> Result<Arc<HashMap<Box<str>, u32>>> {
        let read_file = self.asm.read_file;
        let document = &mut *self.asm.document;
        let from = document.sources[usize::from(self.asm.source)].name.clone();
        let Some(loader) = document.loader.clone() else {
            return Err(Diagnostic::error("the document has no loader"));
        };
        let (name, bytes) = loader.load(&from, url)?;
        work::spend(bytes.len() as u64 / 64).map_err(|cut| Budget::current().refusal(cut))?;
        if let Some(known) = document.protos.libraries.get(&name) {
            return Ok(known.clone());
        }
        let own = &self.asm.limits;
        if own.include_depth == 0 {
            return Err(Diagnostic::beyond_limit(format!(
                "`{name}` is left out: included files are nested too deep"
            )));
        }
        // While the file is read it counts as a file without protos, so that files that refer to
        // each other do not cause endless recursion.
        document
            .protos
            .libraries
            .insert(name.clone(), Arc::default());
        let limits = Limits {
            include_depth: own.include_depth - 1,
            ..own.clone()
        };
        let routes = std::mem::take(&mut document.routes);
        let first = document.nodes.len() as u32;
        let read = read_file(document, &name, FileBytes::Read(bytes), &limits, None);
        document.routes = routes;
        document.protos.templates.retain(|r| r.start < first);
        if self.asm.in_protos == 0 {
            document
                .protos
                .templates
                .push(first..document.nodes.len() as u32);
        }
        let declared = Arc::new(read?.declared);
        document.protos.libraries.insert(name, declared.clone());
        Ok(declared)
    }

    /// Expands a node if it is an instance of a proto and not part of a proto's body.
    pub(super) fn expand(&mut self, node: NodeId) -> Result<()> {
        if self.asm.in_protos > 0 || proto_of(self.asm.document, node).is_none() {
            return Ok(());
        }
        expand::expand(self.asm.document, node, &self.asm.limits)
    }

    /// Reads `node.event TO node.event` after `ROUTE`.
    pub(super) fn route(&mut self) {
        let start = skip(self.rest);
        let from = self.route_end();
        let (rest, to) = word(skip(self.rest)).unwrap_or((self.rest, &[]));
        if to == b"TO" {
            self.rest = rest;
        } else {
            let span = self.here();
            self.warn(span, "expected `TO` in a ROUTE");
        }
        let to = self.route_end();
        if let (Some((from, output)), Some((to, input))) = (from, to) {
            let route = Route {
                from,
                output,
                to,
                input,
                stated: self.asm.in_protos == 0,
            };
            let span = self.span(start, self.rest);
            self.asm.check_route(&route, span);
            self.asm.document.routes.push(route);
        }
    }

    /// Reads `node.event`.
    fn route_end(&mut self) -> Option<(NodeId, Box<str>)> {
        let at = skip(self.rest);
        let (rest, name) = word(at).ok()?;
        self.rest = rest;
        if !self.take(b'.') {
            let span = self.here();
            self.warn(span, "expected `node.event` in a ROUTE");
            return None;
        }
        let (rest_after, event) = word(skip(self.rest)).ok()?;
        self.rest = rest_after;
        let Some(node) = self.asm.used(name) else {
            let message = format!("no earlier node is named `{}`", excerpt(&text(name)));
            let span = self.span(at, rest);
            self.warn(span, message);
            return None;
        };
        Some((node, self.asm.event_name(node, &text(event))))
    }
}

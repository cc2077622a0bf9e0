//! Mistakes that can be read, and change what a node means: wrong connections, wrong children, and
//! sizes that are out of their range. They are reported here because no later step meets them.

use ivcam_base::diag::{Span, excerpt, nearest};

use super::assemble::Assembler;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{Class, FieldType, Role};
use crate::iv::declarations::{Interface, Route};
use crate::iv::document::ClassRef;

/// The fields of VRML97 and X3D that hold children.
const CHILDREN: [&str; 3] = ["children", "level", "choice"];

impl Assembler<'_> {
    /// Warns about a connection from a field or an output that its source does not have.
    pub(super) fn check_connection(&mut self, from: NodeId, output: &str, span: Span) {
        let node = self.document.node(from);
        let Some(class) = node.known_class() else {
            return; // The file declares the class, and need not declare its outputs.
        };
        if class.is_a("Engine") && class.outputs.is_empty() {
            return; // The type of its `output` is stated by the node.
        }
        let short = output.strip_suffix("_changed").unwrap_or(output);
        let fields = self.field_names(node.id);
        let outputs = class.outputs.iter().map(|(name, _)| *name);
        let names = fields.iter().copied().chain(outputs);
        if names.clone().any(|name| name == output || name == short) {
            return;
        }
        let near = nearest(output, names).map(str::to_owned);
        let message = format!(
            "`{}` has no field or output `{}` to connect",
            class.name,
            excerpt(output)
        );
        let warning = self.document.sink.warn(span, message);
        if let Some(near) = near {
            warning.help(format!("did you mean `{near}`?"));
        }
    }

    /// Warns about a route between fields of different types (ISO 14772-1, 4.10.2).
    pub(super) fn check_route(&mut self, route: &Route, span: Span) {
        let from = self.event_type(route.from, &route.output, "", "_changed");
        let to = self.event_type(route.to, &route.input, "set_", "");
        let (Some(from), Some(to)) = (from, to) else {
            return;
        };
        if from == to {
            return;
        }
        let (output, input) = (excerpt(&route.output), excerpt(&route.input));
        let (from, to) = (from.name(), to.name());
        let message =
            format!("this `ROUTE` leads from `{output}`, which is a {from}, to `{input}`, a {to}");
        let help = "both ends of a route have the same type";
        self.document.sink.warn(span, message).help(help);
    }

    /// Returns the type of an event of a node, if it is one of VRML97. An `exposedField` has an
    /// event with a prefix or a suffix.
    fn event_type(
        &self,
        node: NodeId,
        name: &str,
        prefix: &str,
        suffix: &str,
    ) -> Option<FieldType> {
        let short = name.strip_prefix(prefix).unwrap_or(name);
        let short = short.strip_suffix(suffix).unwrap_or(short);
        let kind = match self.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) => {
                let class = id.get();
                let events = class.inputs.iter().chain(class.outputs);
                let event = |wanted: &str| events.clone().find(|(n, _)| *n == wanted).map(|e| e.1);
                let field = |wanted: &str| class.field(wanted).map(|(_, decl)| decl.kind);
                let of = |name: &str| event(name).or_else(|| field(name));
                of(name).or_else(|| of(short))?
            }
            ClassRef::Extension(i) => {
                let proto = self.document.protos.of_extension(i);
                let interface: &[Interface] = match proto {
                    Some(proto) => &self.document.protos.list[proto].interface,
                    None => &self.document.extensions[i as usize].interface,
                };
                let of = |name: &str| interface.iter().find(|i| *i.name == *name);
                of(name).or_else(|| of(short))?.kind
            }
        };
        let names = ["Enum", "BitMask", "Name", "Path", "Engine", "Trigger"];
        (!names.contains(&&kind.name()[2..])).then_some(kind)
    }

    /// Warns about a child that is a geometry, or a node that only acts in a field of its own (ISO
    /// 14772-1, 4.6.5).
    pub(super) fn check_child(&mut self, holder: NodeId, entry: usize, child: NodeId) {
        let class_of = |id: NodeId| match self.document.nodes[id.0 as usize].class {
            ClassRef::Known(id) => Some(id.get()),
            ClassRef::Extension(_) => None,
        };
        let Some(class) = class_of(child).filter(|class| class.is_vrml97()) else {
            return;
        };
        let belongs = match class.role {
            Role::Shape => "a geometry belongs in the field `geometry` of a `Shape`",
            Role::Held => "it belongs in a field of the node that uses it, and does nothing here",
            _ => return,
        };
        // The parts of a contour of VRML97's NURBS are its children.
        let Some(group) = class_of(holder).filter(|group| group.role != Role::Held) else {
            return;
        };
        let node = &self.document.nodes[holder.0 as usize];
        let field = usize::from(node.fields[entry].index);
        if CHILDREN.contains(&group.fields[field].name) {
            let span = self.document.nodes[child.0 as usize].span;
            let message = format!("a `{}` is no child of a `{}`", class.name, group.name);
            self.document.sink.warn(span, message).help(belongs);
        }
    }

    /// Returns the range of a field of VRML97 if a value is below it. The range is that of the
    /// standard, as text.
    pub(super) fn range_above(
        &self,
        class: &Class,
        index: u16,
        value: &Value,
    ) -> Option<&'static str> {
        let decl = class.fields.get(usize::from(index))?;
        let range = decl.range.filter(|_| class.is_vrml97())?;
        let least: f64 = range[1..].split(',').next()?.trim().parse().ok()?;
        let number = match value {
            Value::Float(number) => f64::from(*number),
            Value::Double(number) => *number,
            Value::Vec3(vector) => f64::from(vector.min_element()),
            _ => return None,
        };
        let is_below = number < least || number == least && range.starts_with('(');
        is_below.then_some(range)
    }
}

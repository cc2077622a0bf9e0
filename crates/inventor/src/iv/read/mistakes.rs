//! Mistakes that can be read, and change what a node means: wrong connections, wrong children, and
//! sizes that are out of their range. They are reported here because no later step meets them.

use glam::Vec3;
use ivcam_base::diag::{Span, excerpt, nearest};

use super::assemble::Assembler;
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{Class, FieldType, Role, class};
use crate::iv::declarations::{Access, Route};
use crate::iv::document::{ClassRef, NodeRef};

/// The fields of VRML97 and X3D that hold children.
const CHILDREN: [&str; 3] = ["children", "level", "choice"];

/// What the ends of a route are.
const BOTH_ENDS: &str =
    "a route leads from an `eventOut` to an `eventIn`; an `exposedField` is both";

/// An end of a route.
#[derive(Clone, Copy)]
enum RouteEnd {
    From,
    To,
}

impl RouteEnd {
    /// Returns an event's name without the prefix or suffix that an `exposedField` may have here.
    fn short(self, name: &str) -> &str {
        match self {
            Self::From => name.strip_suffix("_changed"),
            Self::To => name.strip_prefix("set_"),
        }
        .unwrap_or(name)
    }

    /// Returns whether an entry of an interface can be here.
    fn fits(self, access: Access) -> bool {
        match access {
            Access::ExposedField => true,
            Access::EventOut => matches!(self, Self::From),
            Access::EventIn => matches!(self, Self::To),
            Access::Field => false,
        }
    }

    /// Returns what a route does here.
    fn does(self) -> &'static str {
        match self {
            Self::From => "begin at",
            Self::To => "end at",
        }
    }
}

/// Returns the fields and events of a class. The catalogue does not distinguish a `field` from an
/// `exposedField`.
fn events_of<'a>(class: &'static Class) -> Vec<(Access, FieldType, &'a str)> {
    let fields = class.fields.iter();
    let fields = fields.map(|field| (Access::ExposedField, field.kind, field.name));
    let inputs = class
        .inputs
        .iter()
        .map(|(name, kind)| (Access::EventIn, *kind, *name));
    let outputs = class
        .outputs
        .iter()
        .map(|(name, kind)| (Access::EventOut, *kind, *name));
    fields.chain(inputs).chain(outputs).collect()
}

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

    /// Warns about a route from or to an event that its node does not have, and about one between
    /// events of different types (ISO 14772-1, 4.10.2).
    pub(super) fn check_route(&mut self, route: &Route, span: Span) {
        let from = self.route_end(RouteEnd::From, (route.from, &route.output), span);
        let to = self.route_end(RouteEnd::To, (route.to, &route.input), span);
        let (Some(from), Some(to)) = (from, to) else {
            return;
        };
        let names = ["Enum", "BitMask", "Name", "Path", "Engine", "Trigger"];
        let is_of_vrml97 = |kind: FieldType| !names.contains(&&kind.name()[2..]);
        if from == to || !is_of_vrml97(from) || !is_of_vrml97(to) {
            return;
        }
        let (output, input) = (excerpt(&route.output), excerpt(&route.input));
        let (from, to) = (from.name(), to.name());
        let message =
            format!("this `ROUTE` leads from `{output}`, which is a {from}, to `{input}`, a {to}");
        let help = "both ends of a route have the same type";
        self.document.sink.warn(span, message).help(help);
    }

    /// Returns the type of the event at an end of a route, or warns that its node has none. All
    /// events of a node are known if the catalogue or the file defines its class.
    fn route_end(
        &mut self,
        end: RouteEnd,
        (node, name): (NodeId, &str),
        span: Span,
    ) -> Option<FieldType> {
        let (events, is_whole) = self.events(node);
        let short = end.short(name);
        let named = |wanted: &str| events.iter().find(|(_, _, n)| *n == wanted);
        let has = |wanted: &str| named(wanted).filter(|(access, ..)| end.fits(*access));
        if let Some((_, kind, _)) = has(name).or_else(|| has(short)) {
            return Some(*kind);
        }
        if !is_whole {
            return None;
        }
        let class = self.stated(node).class_name();
        let event = excerpt(name);
        let (message, help) = match named(name) {
            Some((access, ..)) => {
                let (it, does) = (access.name(), end.does());
                (
                    format!("this `ROUTE` can't {does} `{event}`, which `{class}` has as `{it}`"),
                    Some(BOTH_ENDS.to_owned()),
                )
            }
            None => {
                let fitting = events.iter().filter(|(access, ..)| end.fits(*access));
                let near = nearest(name, fitting.map(|(_, _, name)| *name));
                (
                    format!("`{class}` has no event `{event}` for this `ROUTE`"),
                    near.map(|near| format!("did you mean `{near}`?")),
                )
            }
        };
        let warning = self.document.sink.warn(span, message);
        if let Some(help) = help {
            warning.help(help);
        }
        None
    }

    /// Returns a node as the file states it: an instance of a proto, and not a node of its body.
    fn stated(&self, id: NodeId) -> NodeRef<'_> {
        let document = &*self.document;
        NodeRef { document, id }
    }

    /// Returns the fields and events of a node, and whether these are all.
    fn events(&self, node: NodeId) -> (Vec<(Access, FieldType, &str)>, bool) {
        let i = match self.document.nodes[node.0 as usize].class {
            ClassRef::Known(id) => {
                let class = id.get();
                // The type of the `output` of some engines is stated by the node.
                let is_whole = !class.is_a("Engine") || !class.outputs.is_empty();
                return (events_of(class), is_whole);
            }
            ClassRef::Extension(i) => i,
        };
        let proto = self.document.protos.of_extension(i);
        let proto = proto.map(|proto| &self.document.protos.list[proto]);
        let script = self.stated(node).known_class();
        let script = script.filter(|class| class.id == class::SCRIPT);
        let interface = match proto {
            Some(proto) => &proto.interface,
            None => &self.document.extensions[i as usize].interface,
        };
        let declared = interface.iter().map(|i| (i.access, i.kind, &*i.name));
        let events = declared.chain(script.into_iter().flat_map(events_of));
        let is_whole = proto.map_or(script.is_some(), |proto| !proto.external);
        (events.collect(), is_whole)
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

    /// Returns the range of a field of VRML97 if a finite value is outside of it. The range is that
    /// of the standard, as text.
    pub(super) fn range_beside(
        &self,
        class: &Class,
        index: u16,
        value: &Value,
    ) -> Option<&'static str> {
        let decl = class.fields.get(usize::from(index))?;
        let range = decl.range.filter(|_| class.is_vrml97())?;
        let (least, most) = range[1..range.len() - 1].split_once(',')?;
        let end = |text: &str| text.trim().parse::<f64>().ok();
        let (least, most) = (end(least)?, end(most)?);
        let [low, high] = match value {
            Value::Float(number) => [f64::from(*number); 2],
            Value::Double(number) => [*number; 2],
            Value::Vec3(vector) => [vector.min_element(), vector.max_element()].map(f64::from),
            Value::Floats(numbers) => [
                numbers.iter().copied().reduce(f32::min)?,
                numbers.iter().copied().reduce(f32::max)?,
            ]
            .map(f64::from),
            Value::Vec3s(vectors) => [
                vectors.iter().copied().reduce(Vec3::min)?.min_element(),
                vectors.iter().copied().reduce(Vec3::max)?.max_element(),
            ]
            .map(f64::from),
            _ => return None,
        };
        let is_below = low < least || low == least && range.starts_with('(');
        let is_above = high > most || high == most && range.ends_with(')');
        (value.is_finite() && (is_below || is_above)).then_some(range)
    }
}

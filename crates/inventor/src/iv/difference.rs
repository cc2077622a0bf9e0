//! Compares two documents and describes the first difference.

use std::collections::HashMap;

use super::declarations::{Proto, Route};
use super::document::{ClassRef, Document, FieldEntry};
use crate::grammar::value::{NodeId, Value};

impl Document {
    /// Describes the first difference from another document, or returns `None` if there is none.
    ///
    /// The order of the nodes in the arena, the spans and the messages are not compared. Which uses
    /// refer to the same node is compared.
    pub fn difference(&self, other: &Self) -> Option<String> {
        DocumentComparison {
            a: self,
            b: other,
            pairs: HashMap::new(),
            work: Vec::new(),
        }
        .run()
        .err()
    }
}

impl Document {
    /// Returns the proto with number `rank`, counted from 0, of all protos with a name.
    fn nth_proto_named(&self, name: &str, rank: usize) -> Option<&Proto> {
        let named = |p: &&Proto| !p.external && self.proto_name(p) == name;
        self.protos.list.iter().filter(named).nth(rank)
    }

    fn proto_name(&self, proto: &Proto) -> &str {
        &self.extensions[proto.extension as usize].name
    }
}

/// The state of a comparison.
struct DocumentComparison<'d> {
    a: &'d Document,
    b: &'d Document,
    /// The node of `b` that corresponds to each visited node of `a`.
    pairs: HashMap<NodeId, NodeId>,
    /// The pairs whose contents are still to be compared.
    work: Vec<(NodeId, NodeId)>,
}

/// The result of a comparison. The error describes the difference.
type Check = Result<(), String>;

impl DocumentComparison<'_> {
    fn run(mut self) -> Check {
        self.lists(&self.a.roots, &self.b.roots, "roots")?;
        self.drain()?;
        self.routes(&self.a.stated_routes, &self.b.stated_routes)?;
        let mut ranks = HashMap::new();
        for proto in &self.a.protos.list {
            if proto.external {
                self.declared(proto)?;
            } else if self.a.nodes[proto.defaults.0 as usize].source == 0 {
                let rank = ranks.entry(self.a.proto_name(proto)).or_insert(0);
                self.defined(proto, *rank)?;
                *rank += 1;
            }
        }
        Ok(())
    }

    /// Checks that the other document has an equal `EXTERNPROTO`. Several equal ones need only one
    /// counterpart, because they are written once.
    fn declared(&self, proto: &Proto) -> Check {
        if self.b.protos.list.iter().any(|o| self.declares(proto, o)) {
            return Ok(());
        }
        let name = self.a.proto_name(proto);
        Err(format!("no `EXTERNPROTO` like that of `{name}`"))
    }

    /// Compares a `PROTO` with the one of the same name and rank in the other document.
    fn defined(&mut self, proto: &Proto, rank: usize) -> Check {
        let name = self.a.proto_name(proto);
        let Some(other) = self.b.nth_proto_named(name, rank) else {
            return Err(format!("no proto `{name}`"));
        };
        if proto.interface != other.interface {
            return Err(format!("the interface of `{name}`"));
        }
        // A name is not visible across the boundary of a proto, so a node that is used on both
        // sides is written twice.
        let outside = std::mem::take(&mut self.pairs);
        self.pair(proto.defaults, other.defaults)?;
        self.lists(&proto.body, &other.body, "a proto's body")?;
        self.drain()?;
        self.routes(&proto.routes, &other.routes)?;
        self.pairs = outside;
        let (links, found) = (proto.links.len(), other.links.len());
        if links != found {
            return Err(format!("{found} links, not {links}"));
        }
        Ok(())
    }

    /// Returns whether two `EXTERNPROTO`s are equal.
    fn declares(&self, x: &Proto, y: &Proto) -> bool {
        let names = self.a.proto_name(x) == self.b.proto_name(y);
        names && x.external == y.external && x.interface == y.interface && x.urls == y.urls
    }

    /// Compares the contents of all pairs in the work list.
    fn drain(&mut self) -> Check {
        while let Some((a, b)) = self.work.pop() {
            self.nodes(a, b)?;
        }
        Ok(())
    }

    fn routes(&mut self, a: &[Route], b: &[Route]) -> Check {
        let known = |r: &&Route| self.pairs.contains_key(&r.from) && self.pairs.contains_key(&r.to);
        let a: Vec<&Route> = a.iter().filter(known).collect();
        if a.len() != b.len() {
            return Err(format!("{} routes, not {}", b.len(), a.len()));
        }
        for (a, b) in a.into_iter().zip(b) {
            let ends = self.pairs[&a.from] == b.from && self.pairs[&a.to] == b.to;
            if !ends || a.output != b.output || a.input != b.input {
                return Err(format!("the route from `{}` to `{}`", a.output, a.input));
            }
        }
        Ok(())
    }

    fn lists(&mut self, a: &[NodeId], b: &[NodeId], what: &str) -> Check {
        if a.len() != b.len() {
            return Err(format!("{what}: {} nodes, not {}", b.len(), a.len()));
        }
        a.iter().zip(b).try_for_each(|(&a, &b)| self.pair(a, b))
    }

    fn pair(&mut self, a: NodeId, b: NodeId) -> Check {
        match self.pairs.insert(a, b) {
            None => {
                self.work.push((a, b));
                Ok(())
            }
            Some(known) if known == b => Ok(()),
            Some(_) => Err(format!(
                "a `{}` is used again as another node",
                self.a.node(a).class_name()
            )),
        }
    }

    fn nodes(&mut self, a: NodeId, b: NodeId) -> Check {
        let (x, y) = (&self.a.nodes[a.0 as usize], &self.b.nodes[b.0 as usize]);
        let place = |what: &str| {
            format!(
                "{what} of a `{}` ({:?})",
                self.a.node(a).class_name(),
                x.name
            )
        };
        let classes = match (x.class, y.class) {
            (ClassRef::Known(x), ClassRef::Known(y)) => x == y,
            (ClassRef::Extension(x), ClassRef::Extension(y)) => {
                self.a.extensions[x as usize] == self.b.extensions[y as usize]
            }
            _ => false,
        };
        if !classes {
            return Err(place("the class"));
        }
        if x.name != y.name {
            return Err(place("the name"));
        }
        if x.fields.len() != y.fields.len() {
            return Err(place("the number of fields"));
        }
        for (f, g) in x.fields.iter().zip(&y.fields) {
            self.fields(f, g)
                .map_err(|what| place(&format!("field {}, {what},", f.index)))?;
        }
        self.lists(&x.children, &y.children, &place("children"))
    }

    fn fields(&mut self, f: &FieldEntry, g: &FieldEntry) -> Check {
        if f.index != g.index || f.ignored != g.ignored {
            return Err("the field or its `~`".into());
        }
        match (&f.connection, &g.connection) {
            (None, None) => {}
            (Some(f), Some(g)) if f.output == g.output => self.pair(f.from, g.from)?,
            _ => return Err("the connection".into()),
        }
        match (&f.value, &g.value) {
            (Value::Node(Some(x)), Value::Node(Some(y))) => self.pair(*x, *y),
            (Value::Nodes(x), Value::Nodes(y)) => self.lists(x, y, "nodes"),
            (x, y) if x == y || debug_text(x) == debug_text(y) => Ok(()),
            (x, y) => Err(format!("{y:.200?}, not {x:.200?}")),
        }
    }
}

/// Formats a value as text, in which all NaNs are equal.
fn debug_text(value: &Value) -> String {
    format!("{value:?}")
}

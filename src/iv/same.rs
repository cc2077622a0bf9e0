//! Compares two documents.

use std::collections::HashMap;

use super::declarations::{Proto, Route};
use super::document::{ClassRef, Document, FieldEntry};
use crate::grammar::value::{NodeId, Value};

impl Document {
    /// Describes the first difference from another document, or returns `None` if there is none.
    ///
    /// The order of the nodes in the arena, spans and messages do not count. It does count which
    /// uses of a node mean the same node.
    pub fn difference(&self, other: &Self) -> Option<String> {
        Comparison {
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
    /// Returns the proto that is number `rank`, from 0, of those with a name.
    fn proto_called(&self, name: &str, rank: usize) -> Option<&Proto> {
        let named = |p: &&Proto| !p.external && self.proto_name(p) == name;
        self.protos.list.iter().filter(named).nth(rank)
    }

    fn proto_name(&self, proto: &Proto) -> &str {
        &self.extensions[proto.extension as usize].name
    }
}

struct Comparison<'d> {
    a: &'d Document,
    b: &'d Document,
    pairs: HashMap<NodeId, NodeId>,
    work: Vec<(NodeId, NodeId)>,
}

type Same = Result<(), String>;

impl Comparison<'_> {
    fn run(mut self) -> Same {
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

    /// Looks for an `EXTERNPROTO` in the other document, once for all equal ones: they are written
    /// once.
    fn declared(&self, proto: &Proto) -> Same {
        if self.b.protos.list.iter().any(|o| self.declares(proto, o)) {
            return Ok(());
        }
        let name = self.a.proto_name(proto);
        Err(format!("no `EXTERNPROTO` like that of `{name}`"))
    }

    fn defined(&mut self, proto: &Proto, rank: usize) -> Same {
        let name = self.a.proto_name(proto);
        let Some(other) = self.b.proto_called(name, rank) else {
            return Err(format!("no proto `{name}`"));
        };
        if proto.interface != other.interface {
            return Err(format!("the interface of `{name}`"));
        }
        // A name means nothing on the other side of a proto's border, so a node that is used on
        // both sides is written twice.
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

    /// Whether two `EXTERNPROTO`s are equal.
    fn declares(&self, x: &Proto, y: &Proto) -> bool {
        let names = self.a.proto_name(x) == self.b.proto_name(y);
        names && x.external == y.external && x.interface == y.interface && x.urls == y.urls
    }

    fn drain(&mut self) -> Same {
        while let Some((a, b)) = self.work.pop() {
            self.nodes(a, b)?;
        }
        Ok(())
    }

    fn routes(&mut self, a: &[Route], b: &[Route]) -> Same {
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

    fn lists(&mut self, a: &[NodeId], b: &[NodeId], what: &str) -> Same {
        if a.len() != b.len() {
            return Err(format!("{what}: {} nodes, not {}", b.len(), a.len()));
        }
        a.iter().zip(b).try_for_each(|(&a, &b)| self.pair(a, b))
    }

    fn pair(&mut self, a: NodeId, b: NodeId) -> Same {
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

    fn nodes(&mut self, a: NodeId, b: NodeId) -> Same {
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

    fn fields(&mut self, f: &FieldEntry, g: &FieldEntry) -> Same {
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
            (x, y) if x == y || bits(x) == bits(y) => Ok(()),
            (x, y) => Err(format!("{y:.200?}, not {x:.200?}")),
        }
    }
}

/// Writes a value as text, in which every NaN is the same.
fn bits(value: &Value) -> String {
    format!("{value:?}")
}

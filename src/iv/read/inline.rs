//! Reads in the files that `File`, `WWWInline` and `Inline` nodes name.

use std::collections::HashMap;

use super::file::read_into;
use crate::diag::{Diagnostic, Result};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{class, file, inline, www_inline};
use crate::iv::document::{ClassRef, Document};
use crate::iv::limits::Limits;
use crate::iv::loader::is_absolute;

/// What a node names, in the order to try.
fn references(document: &Document, id: NodeId) -> Vec<String> {
    let node = document.nodes[id.0 as usize].class;
    let index = match node {
        ClassRef::Known(class::FILE) => file::NAME.index,
        ClassRef::Known(class::WWW_INLINE) => www_inline::NAME.index,
        ClassRef::Known(class::INLINE) => inline::URL.index,
        _ => return Vec::new(),
    };
    let fields = &document.nodes[id.0 as usize].fields;
    match fields
        .iter()
        .find(|f| f.index == index && !f.ignored)
        .map(|f| &f.value)
    {
        Some(Value::String(name)) if !name.is_empty() && !name.starts_with('<') => {
            vec![name.to_string()]
        }
        Some(Value::Strings(urls)) => urls.clone(),
        _ => Vec::new(),
    }
}

/// Reads in the files that nodes name, and those that they name.
pub fn include(document: &mut Document, limits: &Limits) -> Result<()> {
    let Some(loader) = document.loader.clone() else {
        return Ok(());
    };
    let mut read: HashMap<String, (u16, Vec<NodeId>)> = HashMap::new();
    // For each source, the sources it includes: a loop among them is a file inside itself.
    let mut inside: HashMap<u16, Vec<u16>> = HashMap::new();
    let mut depth = vec![0usize; document.sources.len()];
    let mut next = 0;
    while next < document.nodes.len() {
        let id = NodeId(next as u32);
        next += 1;
        if document.is_template(id) {
            continue;
        }
        let names = references(document, id);
        if names.is_empty() {
            continue;
        }
        let from = document.nodes[id.0 as usize].source;
        let span = document.nodes[id.0 as usize].span;
        let source = document.sources[usize::from(from)].clone();
        let before = document.sink.set_source(Some(source.clone()));
        let outcome = names
            .iter()
            .map(|n| loader.load(&source.name, n).map(|found| (n, found)))
            .reduce(|best, next| if best.is_ok() { best } else { next });
        match outcome {
            Some(Ok((reference, (name, bytes)))) => {
                if is_absolute(reference) {
                    let message = format!(
                        "`{reference}` is a path of another machine; `{name}` is taken instead"
                    );
                    document.sink.warn(span, message);
                }
                let known = read.get(&name).cloned();
                let own_depth = depth[usize::from(from)] + 1;
                let loops = *name == *source.name
                    || known
                        .as_ref()
                        .is_some_and(|(target, _)| reaches(&inside, *target, from));
                if loops {
                    document.sink.warn(
                        span,
                        format!("`{name}` includes itself; the inner one is left out"),
                    );
                } else if own_depth > limits.include_depth || read.len() >= limits.files {
                    let message = format!("`{name}` is left out: too many files in files");
                    document.sink.warn(span, message).help(
                        "`--scene-limit files=N` and `--scene-limit include-depth=N` raise this",
                    );
                } else {
                    let (target, roots) = match known {
                        Some(found) => found,
                        None => {
                            let target = document.sources.len() as u16;
                            let roots = match read_into(document, &name, bytes, limits, None) {
                                Ok(file) => file.roots,
                                Err(error) => {
                                    document.sink.add(Diagnostic {
                                        severity: crate::diag::Severity::Warning,
                                        ..*error
                                    });
                                    Vec::new()
                                }
                            };
                            if document.sources.len() > usize::from(target) {
                                depth.resize(document.sources.len(), own_depth);
                                read.insert(name.clone(), (target, roots.clone()));
                            }
                            (target, roots)
                        }
                    };
                    inside.entry(from).or_default().push(target);
                    document.included.insert(id, roots);
                }
            }
            Some(Err(error)) => {
                let help = error.help.clone();
                let warning = document.sink.warn(span, error.message.clone());
                if let Some(help) = help {
                    warning.help(help);
                }
            }
            None => {}
        }
        document.sink.set_source(before);
    }
    Ok(())
}

/// Whether one source includes the other, at any remove.
fn reaches(inside: &HashMap<u16, Vec<u16>>, from: u16, to: u16) -> bool {
    let mut stack = vec![from];
    let mut seen = Vec::new();
    while let Some(source) = stack.pop() {
        if source == to {
            return true;
        }
        if !seen.contains(&source) {
            seen.push(source);
            stack.extend(inside.get(&source).into_iter().flatten());
        }
    }
    false
}

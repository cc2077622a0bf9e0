//! Finds the program of a `Script` among the entries of its `url`.

use ivcam_base::diag::Diagnostic;

use super::cascade::is_script;
use crate::iv::{Document, NodeId, NodeRef, Value};

/// The largest program, in bytes.
const MAX_BYTES: usize = 1 << 20;

/// The program of a script.
#[derive(Debug, PartialEq)]
pub enum ProgramSource {
    /// ECMAScript, or vrmlscript, which is a part of it.
    Program(String),
    /// No program: the script has no `url`.
    Nothing,
    /// A program that cannot run, with the reason.
    Unsupported(String),
}

/// Returns the scripts among the nodes of the arena from an index on, without those in the bodies
/// of protos.
pub fn scripts(document: &Document, first: usize) -> Vec<NodeId> {
    let ids = (first..document.nodes.len()).map(|i| NodeId(i as u32));
    let scripts = ids.filter(|&id| is_script(NodeRef { document, id }));
    scripts.filter(|&id| !document.is_template(id)).collect()
}

/// Returns the program of a script: the first entry of its `url` in a language that runs here.
pub fn source(document: &Document, id: NodeId) -> ProgramSource {
    let node = NodeRef { document, id };
    let Some(Value::Strings(urls)) = node.value("url") else {
        return ProgramSource::Nothing;
    };
    let mut reason = None;
    for url in urls.iter().filter(|u| !u.trim().is_empty()) {
        match program(document, id, url) {
            Ok(text) if text.len() > MAX_BYTES => {
                let message = format!("it is larger than {MAX_BYTES} bytes");
                reason = reason.or(Some(message));
            }
            Ok(text) => return ProgramSource::Program(text),
            Err(message) => reason = reason.or(Some(message)),
        }
    }
    reason.map_or(ProgramSource::Nothing, ProgramSource::Unsupported)
}

/// Returns the program that one entry holds or names, or why there is none.
fn program(document: &Document, id: NodeId, url: &str) -> Result<String, String> {
    let text = url.trim_start();
    let scheme = text
        .split_once(':')
        .map(|(s, _)| s.trim().to_ascii_lowercase());
    match scheme.as_deref() {
        Some("javascript" | "vrmlscript" | "ecmascript") => {
            let start = text.find(':').map_or(0, |at| at + 1);
            return Ok(text[start..].to_owned());
        }
        Some("java" | "javabc") => return Err("it is written in Java".into()),
        _ => {}
    }
    let path = text.split(['#', '?']).next().unwrap_or(text).trim();
    let ending = path.rsplit_once('.').map(|(_, e)| e.to_ascii_lowercase());
    match ending.as_deref() {
        Some("class" | "java" | "jar") => Err("it is written in Java".into()),
        Some("js" | "vs" | "es") => {
            let loaded = document.load_beside(id, path);
            let (_, bytes) = loaded.map_err(|e: Box<Diagnostic>| e.message)?;
            Ok(String::from_utf8_lossy(&bytes).into_owned())
        }
        _ => {
            let line = text.trim_start().lines().next().unwrap_or_default();
            let start: String = line.chars().take(20).collect();
            Err(format!(
                "`{}` is not a language that runs here",
                start.trim()
            ))
        }
    }
}

//! Reading prescriptions, by what a file says rather than by what it is called.

pub mod dat;
pub mod json;

use std::sync::Arc;

use crate::diag::{Result, Sink, Source};

use super::prescription::Prescription;

/// Reads a prescription in any format known here.
pub fn read(source: &Arc<Source>, sink: &mut Sink) -> Result<Prescription> {
    let before = sink.set_source(Some(source.clone()));
    let first = source.bytes.iter().find(|b| !b.is_ascii_whitespace());
    let result = match first {
        Some(b'{') => json::read(source, sink),
        _ => dat::read(source, sink),
    };
    sink.set_source(before);
    result
}

/// `wide-angle` of `some/folder/wide-angle.dat`.
fn name_of(source: &Source) -> String {
    let name = source
        .name
        .rsplit(['/', '\\'])
        .next()
        .unwrap_or(&source.name);
    name.rsplit_once('.')
        .map_or(name, |(stem, _)| stem)
        .to_owned()
}

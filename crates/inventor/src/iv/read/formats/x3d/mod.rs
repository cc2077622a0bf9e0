//! Reads X3D in its XML encoding (ISO/IEC 19776-1).
//!
//! The elements state what the classic encoding states, so `translate` writes them in it, and the
//! reader of that text does the rest: prototypes, scripts, routes and links are read by one code.
//! `places` leads from the text back to the XML, so that messages and nodes have places in the
//! file.

mod entities;
mod places;
mod translate;
mod written;

use ivcam_base::diag::Result;

use crate::grammar::value::NodeId;
use crate::iv::encoding::text;
use crate::iv::read::ascii;
use crate::iv::read::assemble::Assembler;

/// Reads the nodes of a file and returns the top-level ones.
///
/// # Errors
/// Returns an error if a limit is exceeded.
pub(in crate::iv::read) fn read(asm: &mut Assembler<'_>, bytes: &[u8]) -> Result<Vec<NodeId>> {
    let decoded;
    let xml = match std::str::from_utf8(bytes) {
        Ok(xml) => xml,
        Err(_) => {
            decoded = text(bytes);
            &decoded
        }
    };
    asm.spend_read(xml.len(), 0)?;
    let translation = translate::translate(xml);
    for problem in translation.problems {
        let sink = &mut asm.document.sink;
        let warning = match problem.is_damage {
            true => sink.damage(problem.span, problem.message),
            false => sink.warn(problem.span, problem.message),
        };
        if let Some(help) = problem.help {
            warning.help(help);
        }
    }
    let first_node = asm.document.nodes.len();
    let first_message = asm.document.sink.items().len();
    asm.is_translated = true;
    let roots = ascii::read(asm, &translation.text);
    asm.is_translated = false;
    let places = translation.places;
    let source = asm.source;
    for node in &mut asm.document.nodes[first_node..] {
        if node.source == source {
            node.span = places.in_xml(node.span);
            for field in &mut node.fields {
                field.span = places.in_xml(field.span);
            }
        }
    }
    let own = asm.document.sources[usize::from(source)].clone();
    let of_own = |span| places.in_xml(span);
    asm.document.sink.move_places(first_message, &own, of_own);
    roots.map_err(|mut error| {
        if let Some((at, span)) = &mut error.place
            && std::sync::Arc::ptr_eq(at, &own)
        {
            *span = of_own(*span);
        }
        error
    })
}

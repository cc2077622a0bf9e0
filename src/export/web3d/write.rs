//! Chooses how a scene becomes X3D or VRML97: node by node, or from a model.

use ivcam_inventor::iv::{Document, Format};
use ivcam_render::scene::model::Model;

use super::graph::{GraphOptions, Pictures, graph};
use super::xml::{Textures, write_xml};
use crate::export::conversion::Conversion;
use crate::export::losses::Losses;
use crate::export::target::Target;

/// Converts a document in VRML97 to X3D or VRML97 node by node, and one in X3D to X3D. Returns
/// `None` for other documents and targets.
pub(in crate::export) fn rewritten(document: &Document, target: Target) -> Option<Conversion> {
    let is_x3d = document.is_x3d();
    if !document.is_vrml97() && !is_x3d {
        return None;
    }
    let mut losses = Losses::default();
    let bytes = match target {
        Target::Vrml97 if !is_x3d => document.write(Format::Ascii),
        Target::X3d => {
            let textures = match document.multiplies_textures() {
                true => Textures::Multiply,
                false => Textures::Replace,
            };
            write_xml(document, textures, &mut losses)
        }
        _ => return None,
    };
    Some(Conversion {
        bytes,
        losses,
        keeps_addresses: true,
        ..Conversion::default()
    })
}

/// Writes a model as X3D. The pictures of textures are inside the file.
pub(in crate::export) fn x3d(model: &Model, losses: &mut Losses) -> Vec<u8> {
    let options = GraphOptions {
        pictures: Pictures::Inside,
        target: Target::X3d,
    };
    let made = graph(model, options, losses);
    write_xml(&made.document, Textures::Multiply, losses)
}

/// Writes a model as VRML97, with pictures beside it that begin with `stem`, or as pixels in the
/// file if it is empty.
pub(in crate::export) fn vrml97(
    model: &Model,
    stem: &str,
    losses: &mut Losses,
) -> (Vec<u8>, Vec<(String, Vec<u8>)>) {
    let options = GraphOptions {
        pictures: match stem {
            "" => Pictures::Pixels,
            stem => Pictures::Beside(stem),
        },
        target: Target::Vrml97,
    };
    let made = graph(model, options, losses);
    (made.document.write(Format::Ascii), made.beside)
}

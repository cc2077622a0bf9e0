//! Begins a file of Inventor V2.1.

use ivcam_inventor::grammar::Dialect;
use ivcam_inventor::iv::Format;
use ivcam_render::scene::model::Model;

use super::camera::Viewing;
use super::head::head;
use super::tree::tree;
use crate::export::losses::Losses;
use crate::export::nodes::NodeBuilder;

/// Writes a model as Inventor V2.1, with pictures beside it that begin with `stem`, or as pixels in
/// the file if it is empty. What Inventor cannot express is added to `losses`.
pub(in crate::export) fn write(
    model: &Model,
    viewing: &Viewing,
    stem: &str,
    losses: &mut Losses,
) -> (Vec<u8>, Vec<(String, Vec<u8>)>) {
    let mut nodes = NodeBuilder::new("Inventor V2.1 ascii", Dialect::IV2);
    let mut children = head(model, viewing, &mut nodes, losses);
    let (shapes, beside) = tree(model, stem, &mut nodes);
    children.extend(shapes);
    let root = nodes.group("Separator", Vec::new(), children);
    (nodes.finish(vec![root]).write(Format::Ascii), beside)
}

//! Lists the nodes of a scene, by line, with the fields that they state:
//! `cargo run --example list_nodes -- SCENE [CLASS]`.
//!
//! Nodes that fields hold are listed too, such as the `Material` of a VRML97 `Appearance`.

use ivcam::Document;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().ok_or("usage: list_nodes SCENE [CLASS]")?;
    let class = arguments.next();

    let document = Document::open(scene)?;
    for message in document.sink.items() {
        eprintln!("{message}");
    }
    let wanted = |name: &str| class.as_ref().is_none_or(|c| c == name);
    for node in document.descendants().filter(|n| wanted(n.class_name())) {
        let line = node.source().map(|s| s.line_column(node.span().start).0);
        let names: Vec<&str> = node.stated_fields().map(|(name, _)| name).collect();
        let (line, children) = (line.unwrap_or_default(), node.children().len());
        println!(
            "{line:6} {} {children} children, states [{}]",
            node.class_name(),
            names.join(" ")
        );
    }
    Ok(())
}

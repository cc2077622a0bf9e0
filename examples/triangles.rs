//! Lists the triangles of a scene as a tree of groups: `cargo run --example triangles -- SCENE`.
//!
//! Each line has the name of a node, its place, and for a shape the number of its triangles and its
//! color. Shapes that share a mesh show the same number behind `mesh`.

use ivcam::Document;
use ivcam::scene::model::{Model, ModelOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = std::env::args().nth(1).ok_or("usage: triangles SCENE")?;
    let document = Document::open(scene)?;
    let model = Model::at(&document, 0.0, &ModelOptions::default());
    for message in document.sink.items().iter().chain(&model.diagnostics) {
        eprintln!("{message}");
    }
    let mut depths = vec![0usize; model.nodes.len()];
    for (i, node) in model.nodes.iter().enumerate() {
        depths[i] = node.parent.map_or(0, |parent| depths[parent] + 1);
        println!("{:width$}{}", "", node.name(), width = 2 * depths[i]);
        for part in &node.parts {
            let mesh = &model.meshes[part.mesh];
            let color = model.materials[part.material].diffuse;
            let (number, count) = (part.mesh, mesh.triangles().len());
            println!(
                "{:width$}mesh {number}: {count} triangles, diffuse {color}, at {}",
                "",
                node.world.translation,
                width = 2 * depths[i] + 2
            );
        }
    }
    println!(
        "{} triangles in {:?}",
        model.triangle_count(),
        model.bounds()
    );
    Ok(())
}

//! Compares the lengths of the lists of a shape with what its bindings take from them.

use ivcam_inventor::traversal::state::Binding;

use super::drawing::Canvas;
use super::mistake::Mistake;
use super::runs::ShapeSize;
use super::vertices::Vertices;

/// Notes lists of materials and of normals that are shorter than their bindings need.
pub(crate) fn check_lists(vertices: &Vertices<'_, '_>, size: ShapeSize, out: &mut dyn Canvas) {
    let state = vertices.state;
    let needed = |binding, index| needed(vertices, binding, index, size);
    let materials = needed(vertices.material_binding, vertices.material_index);
    if materials > state.material.diffuse_count() {
        out.note(Mistake::FewMaterials);
    }
    let normals = state.normals;
    if !normals.is_empty() && needed(vertices.normal_binding, vertices.normal_index) > normals.len()
    {
        out.note(Mistake::FewNormals);
    }
}

/// Returns the number of entries that a binding takes from a list, 1 for the whole shape.
fn needed(
    vertices: &Vertices<'_, '_>,
    binding: Binding,
    index: Option<&[i32]>,
    size: ShapeSize,
) -> usize {
    let beyond = |list: Option<&[i32]>, without: usize| match list {
        Some(list) => list
            .iter()
            .max()
            .map_or(0, |&most| usize::try_from(most).unwrap_or(0) + 1),
        None => without,
    };
    match binding {
        Binding::Overall => 1,
        Binding::PerVertex => size.corners,
        Binding::PerFace => size.faces,
        Binding::PerPart => size.parts,
        Binding::PerFaceIndexed => beyond(index, size.faces),
        Binding::PerPartIndexed => beyond(index, size.parts),
        // An index without a coordinate is reported by itself.
        Binding::PerVertexIndexed if index.is_none() && vertices.coord_index.is_some() => {
            beyond(vertices.coord_index, 0).min(vertices.coordinates.len())
        }
        Binding::PerVertexIndexed => beyond(index, size.corners),
    }
}

#[cfg(test)]
mod tests {
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;

    use crate::scene::{CompileOptions, RenderScene};

    /// Two triangles with six points, by count and by index.
    const POINTS: &str = "Coordinate3 { point [ 0 0 0, 1 0 0, 0 1 0, 1 1 0, 2 1 0, 1 2 0 ] }";

    fn reported(nodes: &str) -> [Vec<(String, usize)>; 2] {
        let text = format!("#Inventor V2.1 ascii\n{POINTS} {nodes}").into_bytes();
        let document = Document::read_headerless("a.iv", text).expect("reads");
        let snapshot = Snapshot::at(&document, 0.0);
        let options = CompileOptions::default();
        let scene = RenderScene::compile(&snapshot, &options).expect("compiles");
        let surveyed = RenderScene::survey(&snapshot, &options);
        let reported = |all: &[ivcam_base::diag::Diagnostic]| {
            all.iter().map(|d| (d.message.clone(), d.count)).collect()
        };
        [
            reported(&scene.census().diagnostics),
            reported(&surveyed.diagnostics),
        ]
    }

    #[test]
    fn a_list_that_is_too_short_is_reported_once_with_the_number_of_shapes() {
        let set = "FaceSet { numVertices [ 3, 3 ] }";
        let indexed = "IndexedFaceSet { coordIndex [ 0 1 2 -1 3 4 5 -1 ] }";
        let by = |kind: &str, value: &str| format!("{kind}Binding {{ value {value} }}");
        let normal = "Normal { vector [ 0 0 1, 0 0 1 ] }";
        for (nodes, words, count) in [
            (
                format!("{} {set} {set}", by("Material", "PER_FACE")),
                "fewer colors",
                2,
            ),
            (
                format!("{} {indexed}", by("Material", "PER_VERTEX_INDEXED")),
                "fewer colors",
                1,
            ),
            (
                format!("{normal} {} {set}", by("Normal", "PER_VERTEX")),
                "fewer normals",
                1,
            ),
            (format!("{normal} {indexed}"), "fewer normals", 1),
            (
                "FaceSet { numVertices [ -5, 3 ] }".into(),
                "negative number of corners",
                1,
            ),
            (
                "FaceSet { numVertices [ 3, 4 ] }".into(),
                "more corners than",
                1,
            ),
            (
                "LineSet { numVertices [ 3, 4 ] }".into(),
                "more corners than",
                1,
            ),
            (
                "IndexedFaceSet { coordIndex [ 0 1 2 -2 3 4 5 ] }".into(),
                "negative index",
                1,
            ),
            (
                "IndexedLineSet { coordIndex [ 0 1 2 -2 3 4 5 ] }".into(),
                "negative index",
                1,
            ),
        ] {
            for reported in reported(&nodes) {
                assert_eq!(reported.len(), 1, "{nodes}: {reported:?}");
                assert!(reported[0].0.contains(words), "{nodes}: {reported:?}");
                assert_eq!(reported[0].1, count, "{nodes}");
            }
        }
    }

    #[test]
    fn lists_that_are_long_enough_are_not_reported() {
        let colors = "BaseColor { rgb [ 1 0 0, 0 1 0 ] } MaterialBinding { value PER_FACE }";
        let normals = "Normal { vector [ 0 0 1, 0 0 1 ] } NormalBinding { value PER_FACE }";
        for shape in [
            "FaceSet { numVertices [ 3, 3 ] }",
            "FaceSet { numVertices [ 3, -1 ] }",
            "FaceSet { }",
            "TriangleStripSet { numVertices 4 }",
            "IndexedFaceSet { coordIndex [ 0 1 2 -1 3 4 5 -1 ] materialIndex [ 1 0 ] }",
            "IndexedFaceSet { coordIndex [ 0 1 2 -1 3 4 5 ] }",
        ] {
            let reported = reported(&format!("{colors} {normals} {shape}"));
            assert!(reported.iter().all(Vec::is_empty), "{shape}: {reported:?}");
        }
    }
}

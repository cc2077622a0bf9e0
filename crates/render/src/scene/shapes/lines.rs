//! Draws line sets, point sets and marker sets, which have sizes in pixels.

use ivcam_base::work::until_stopped;
use ivcam_inventor::grammar::{
    indexed_line_set, indexed_marker_set, indexed_point_set, line_set, marker_set, point_set,
};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::state::{Binding, DrawStyle, Language, State};

use super::markers;
use crate::geometry::BoxCoordinates;
use crate::scene::canvas::{
    Canvas, Mistake, Normals, ShapeSize, VertexPlace, Vertices, check_counts, check_lists, count,
    counted, indices, without_index,
};

/// Returns the lists of a line set or point set.
fn vertices<'a, 's>(
    state: &'s State<'a>,
    material_binding: Binding,
    material_index: Option<&'a [i32]>,
    coord_index: Option<&'a [i32]>,
    out: &dyn Canvas,
) -> Vertices<'a, 's> {
    let all = 0..state.coordinates.len();
    let points = all.filter_map(|c| state.coordinates.get(c));
    Vertices {
        normals: if state.normals.is_empty() {
            Normals::Zero
        } else {
            Normals::Given(state.normals)
        },
        normal_binding: match segments_and_lines(state.normal_binding) {
            indexed if coord_index.is_some() => indexed,
            other => without_index(other),
        },
        material_binding,
        material_index,
        coord_index,
        boxed: out.wants().coordinates.then(|| BoxCoordinates::of(points)),
        ..Vertices::unindexed(state)
    }
}

/// Converts a binding of a line set. Inventor's parts are segments and its faces are whole lines,
/// but in [`VertexPlace`] a segment is a face and a line is a part.
fn segments_and_lines(binding: Binding) -> Binding {
    match binding {
        Binding::PerPart => Binding::PerFace,
        Binding::PerPartIndexed => Binding::PerFaceIndexed,
        Binding::PerFace => Binding::PerPart,
        Binding::PerFaceIndexed => Binding::PerPartIndexed,
        other => other,
    }
}

/// Draws a `LineSet`.
pub(super) fn line_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    unlit_without_normals(state, out);
    let counts = node.get(line_set::NUM_VERTICES);
    let start = count(node, line_set::START_INDEX);
    let binding = without_index(segments_and_lines(state.material_binding));
    let vertices = vertices(state, binding, None, None, out);
    check_counts(counts, start, state.coordinates.len(), out);
    let (mut count, mut segment, mut lines) = (0, 0, 0);
    let lines_of = counted(counts, start, state.coordinates.len());
    for (part, (first, n)) in until_stopped(lines_of.into_iter().enumerate()) {
        let line: Vec<(usize, usize)> = (first..first + n).map(|c| (c, c - start)).collect();
        // A line of one point draws nothing, but its point extends the box.
        for p in (first..first + n).filter_map(|c| state.coordinates.get(c)) {
            out.bound(p);
        }
        polyline(&line, &vertices, (count, segment, part), out);
        count += n;
        segment += n.saturating_sub(1);
        lines = part + 1;
    }
    let size = ShapeSize {
        corners: count,
        faces: segment,
        parts: lines,
    };
    check_lists(&vertices, size, out);
}

/// Draws an `IndexedLineSet` of Inventor.
pub(super) fn indexed_line_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    unlit_without_normals(state, out);
    let index = node.get(indexed_line_set::COORD_INDEX);
    let others = [
        indices(node, indexed_line_set::MATERIAL_INDEX),
        indices(node, indexed_line_set::NORMAL_INDEX),
    ];
    indexed_lines(index, others, state, out);
}

/// Turns lighting off for lines and points without normals, as Coin and SGI do.
fn unlit_without_normals(state: &State<'_>, out: &mut dyn Canvas) {
    if state.normals.is_empty() {
        out.set_unlit();
    }
}

/// Draws the lines of an index, for the shapes of Inventor and VRML 97, with the indices of
/// materials and of normals.
pub(super) fn indexed_lines<'a>(
    index: &'a [i32],
    [materials, normals]: [Option<&'a [i32]>; 2],
    state: &State<'a>,
    out: &mut dyn Canvas,
) {
    let mut binding = segments_and_lines(state.material_binding);
    if state.language == Language::Vrml1 && binding == Binding::PerVertex {
        binding = Binding::PerVertexIndexed;
    }
    let mut vertices = vertices(state, binding, materials, Some(index), out);
    vertices.normal_index = normals;
    let (mut count, mut segment, mut part, mut start) = (0, 0, 0, 0);
    let mut turns = until_stopped(0..index.len());
    while start < index.len() && turns.next().is_some() {
        let end = index[start..]
            .iter()
            .position(|&i| i < 0)
            .map_or(index.len(), |n| start + n);
        let line: Vec<(usize, usize)> = (start..end).map(|p| (index[p] as usize, p)).collect();
        for (c, _) in &line {
            if let Some(p) = state.coordinates.get(*c) {
                out.bound(p);
            }
        }
        polyline(&line, &vertices, (count, segment, part), out);
        count += line.len();
        segment += line.len().saturating_sub(1);
        part += 1;
        if index.get(end).is_some_and(|&end| end < -1) {
            out.note(Mistake::NegativeIndex);
        }
        start = end + 1;
    }
    let size = ShapeSize {
        corners: count,
        faces: segment,
        parts: part,
    };
    check_lists(&vertices, size, out);
}

/// Draws one line. `line` has the coordinate and the position of each point. `before` has the
/// numbers of corners, segments and lines before this one.
fn polyline(
    line: &[(usize, usize)],
    vertices: &Vertices<'_, '_>,
    before: (usize, usize, usize),
    out: &mut dyn Canvas,
) {
    let drawing = &vertices.state.drawing;
    let corner = |i: usize, k: usize| {
        vertices.corner(VertexPlace {
            coordinate: line[i + k].0,
            position: line[i + k].1,
            count: before.0 + i + k,
            face: before.1 + i,
            part: before.2,
        })
    };
    if out.wants().outlines && drawing.style == DrawStyle::Points {
        let corners = until_stopped(0..line.len()).filter_map(|i| corner(i, 0));
        corners.for_each(|c| out.dot(c, drawing.point_size));
        return;
    }
    out.begin_line();
    for i in until_stopped(0..line.len().saturating_sub(1)) {
        if let (Some(a), Some(b)) = (corner(i, 0), corner(i, 1)) {
            out.line([a, b], drawing.line_width);
        }
    }
}

/// Returns the lists of a point set, its first coordinate and its number of points.
fn points<'a, 's>(
    node: NodeRef<'a>,
    state: &'s State<'a>,
    out: &dyn Canvas,
) -> (Vertices<'a, 's>, usize, usize) {
    let start = count(node, point_set::START_INDEX);
    let stated = node.get(point_set::NUM_POINTS);
    let binding = match without_index(state.material_binding) {
        Binding::Overall => Binding::Overall,
        _ => Binding::PerVertex,
    };
    let vertices = vertices(state, binding, None, None, out);
    let left = state.coordinates.len().saturating_sub(start);
    let count = usize::try_from(stated).unwrap_or(left).min(left);
    (vertices, start, count)
}

/// Draws a `PointSet`.
pub(super) fn point_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    unlit_without_normals(state, out);
    let (vertices, start, count) = points(node, state, out);
    for i in until_stopped(0..count) {
        dot(&vertices, start + i, i, state.drawing.point_size, out);
    }
}

/// Draws a `MarkerSet`.
pub(super) fn marker_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    out.set_unlit();
    let (vertices, start, count) = points(node, state, out);
    for i in until_stopped(0..count) {
        marker(&vertices, start + i, i, node, out);
    }
}

/// Draws an `IndexedMarkerSet`.
pub(super) fn indexed_marker_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    out.set_unlit();
    let index = node.get(indexed_marker_set::COORD_INDEX);
    let materials = indices(node, indexed_marker_set::MATERIAL_INDEX);
    let vertices = vertices(state, state.material_binding, materials, Some(index), out);
    for (i, &c) in until_stopped(index.iter().enumerate()) {
        if let Ok(c) = usize::try_from(c) {
            marker(&vertices, c, i, node, out);
        }
    }
}

/// Draws the marker with the number `i`.
fn marker<'a>(
    vertices: &Vertices<'a, '_>,
    coordinate: usize,
    i: usize,
    node: NodeRef<'a>,
    out: &mut dyn Canvas,
) {
    let markers = node.get(marker_set::MARKER_INDEX);
    let index = markers.get(i).or(markers.last()).copied().unwrap_or(0);
    if let Some(corner) = vertices.corner(place_of(coordinate, i)) {
        markers::marker(corner, index, vertices.state.world_from_object, out);
    }
}

/// Draws an `IndexedPointSet`.
pub(super) fn indexed_point_set<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    unlit_without_normals(state, out);
    let index = node.get(indexed_point_set::COORD_INDEX);
    let vertices = vertices(
        state,
        state.material_binding,
        indices(node, indexed_point_set::MATERIAL_INDEX),
        Some(index),
        out,
    );
    for (i, &c) in until_stopped(index.iter().enumerate()) {
        if let Ok(c) = usize::try_from(c) {
            dot(&vertices, c, i, state.drawing.point_size, out);
        }
    }
}

/// Draws the point with the number `i`.
fn dot(vertices: &Vertices<'_, '_>, coordinate: usize, i: usize, size: f32, out: &mut dyn Canvas) {
    if let Some(corner) = vertices.corner(place_of(coordinate, i)) {
        out.dot(corner, size);
    }
}

/// Returns the numbers of a point that has the number `i` by every count.
fn place_of(coordinate: usize, i: usize) -> VertexPlace {
    VertexPlace {
        coordinate,
        position: i,
        count: i,
        face: i,
        part: i,
    }
}

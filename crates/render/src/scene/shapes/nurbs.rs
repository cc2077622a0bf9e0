//! Draws NURBS shapes, which `geometry::nurbs` tessellates. Control points and profiles are in the
//! state.

use glam::{DVec2, DVec3, DVec4, Vec2, Vec3};
use ivcam_inventor::grammar::{
    Field, Treatment, complexity, contour2_d, indexed_nurbs_curve, indexed_nurbs_surface,
    linear_profile, nurbs_curve, nurbs_curve2_d, nurbs_profile, nurbs_surface, polyline2_d,
    trimmed_surface, vrml97_indexed_face_set as faces97, vrml97_nurbs_curve, vrml97_nurbs_surface,
};
use ivcam_inventor::iv::{NodeId, NodeRef};
use ivcam_inventor::traversal::State;
use ivcam_inventor::traversal::state::{Coordinates, ProfileCoordinates, TextureCoordinates};

use crate::geometry::nurbs::{
    ChordalTolerance, Curve, Detail, NurbsSurface, tolerance_in_pixels, trim_curve,
};
use crate::geometry::{Corner, TriangleMesh};
use crate::scene::canvas::{Canvas, Mistake, PictureView, count, indices};

/// Draws a `NurbsSurface` of Inventor.
pub(super) fn nurbs_surface<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let points: Vec<DVec4> = (0..state.coordinates.len())
        .filter_map(|i| control_point(state, i))
        .collect();
    surface(node, state, points, None, out);
}

/// Draws an `IndexedNurbsSurface`.
pub(super) fn indexed_nurbs_surface<'a>(
    node: NodeRef<'a>,
    state: &State<'a>,
    out: &mut dyn Canvas,
) {
    let index = node.get(indexed_nurbs_surface::COORD_INDEX);
    let texture = indices(node, indexed_nurbs_surface::TEXTURE_COORD_INDEX);
    surface(node, state, picked(state, index), texture, out);
}

/// Draws a `NurbsCurve` of Inventor.
pub(super) fn nurbs_curve<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let points: Vec<DVec4> = (0..state.coordinates.len())
        .filter_map(|i| control_point(state, i))
        .collect();
    curve(node, state, points, out);
}

/// Draws an `IndexedNurbsCurve`.
pub(super) fn indexed_nurbs_curve<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let index = node.get(indexed_nurbs_curve::COORD_INDEX);
    curve(node, state, picked(state, index), out);
}

/// Returns the control points of an index, without those that do not exist.
fn picked(state: &State<'_>, index: &[i32]) -> Vec<DVec4> {
    index
        .iter()
        .filter_map(|&i| control_point(state, usize::try_from(i).ok()?))
        .collect()
}

/// Returns a control point with its weight.
fn control_point(state: &State<'_>, index: usize) -> Option<DVec4> {
    match state.coordinates {
        Coordinates::Three(p) => p.get(index).map(|p| p.as_dvec3().extend(1.0)),
        Coordinates::Four(p) => p.get(index).map(|p| p.as_dvec4()),
        all @ Coordinates::Geo(_) => all.get(index).map(|p| p.as_dvec3().extend(1.0)),
    }
}

/// Calls a function with how finely a shape is cut.
///
/// The tolerance is a part of a pixel of the picture, if the canvas has one. The file may ask for
/// the same mesh in every picture by a `Complexity` of type `OBJECT_SPACE`.
fn with_detail<T>(
    state: &State<'_>,
    out: &mut dyn Canvas,
    make: impl FnOnce(&Detail<'_>, &mut dyn Canvas) -> T,
) -> T {
    let value = state.complexity.value;
    let in_object_space = state.complexity.kind == Some(complexity::TYPE_OBJECT_SPACE);
    let picture = out.resolved_picture().filter(|_| !in_object_space).cloned();
    let screen = picture.as_ref().and_then(PictureView::screen);
    let mut world_from_object = out.placement().scene_from_object;
    world_from_object.translation += out.placement().origin;
    let pixels = tolerance_in_pixels(value);
    let distance = screen.map(|screen| move |corners| pixels * screen.finest_pixel(corners));
    let detail = Detail {
        complexity: value,
        tolerance: distance.as_ref().map(|distance| ChordalTolerance {
            world_from_object,
            distance,
        }),
    };
    make(&detail, out)
}

/// Draws a surface, cut as finely as the picture needs, or reports why it cannot be drawn.
///
/// `make` makes the surface, and `tessellate` cuts it.
fn draw_surface<'a>(
    node: NodeRef<'a>,
    state: &State<'a>,
    made: Result<NurbsSurface, String>,
    out: &mut dyn Canvas,
    tessellate: impl FnOnce(&NurbsSurface, &Detail<'_>, &mut dyn Canvas) -> Result<TriangleMesh, String>,
) {
    let mesh = made.and_then(|surface| {
        with_detail(state, out, |detail, out| {
            // The edges of triangles are what is drawn.
            let tolerance = detail.tolerance.filter(|_| !out.wants().outlines);
            let detail = Detail {
                tolerance,
                ..*detail
            };
            tessellate(&surface, &detail, out)
        })
    });
    match mesh {
        Ok(mesh) => out.curved_mesh(&mesh),
        Err(why) => out.report(node, &why),
    }
}

/// Draws a surface with its trimming loops and its texture coordinates.
fn surface<'a>(
    node: NodeRef<'a>,
    state: &State<'a>,
    points: Vec<DVec4>,
    texture_index: Option<&[i32]>,
    out: &mut dyn Canvas,
) {
    for p in &points {
        out.bound((p.truncate() / if p.w == 0.0 { 1.0 } else { p.w }).as_vec3());
    }
    let made = NurbsSurface::new(
        count(node, nurbs_surface::NUM_U_CONTROL_POINTS),
        count(node, nurbs_surface::NUM_V_CONTROL_POINTS),
        node.get(nurbs_surface::U_KNOT_VECTOR),
        node.get(nurbs_surface::V_KNOT_VECTOR),
        points,
    );
    draw_surface(node, state, made, out, |surface, detail, out| {
        let trims = trims(state, &surface.detail_of_trims(detail), out, node);
        note_open(&trims, out);
        let texture = texture_surface(node, state, texture_index);
        surface.tessellate(detail, &trims, texture.as_ref())
    });
}

/// Returns the surface of the texture coordinates, if the file has one.
fn texture_surface(
    node: NodeRef<'_>,
    state: &State<'_>,
    index: Option<&[i32]>,
) -> Option<NurbsSurface> {
    let s = count(node, nurbs_surface::NUM_S_CONTROL_POINTS);
    let t = count(node, nurbs_surface::NUM_T_CONTROL_POINTS);
    if s == 0 || t == 0 {
        return None;
    }
    let TextureCoordinates::Two(list) = state.texture_coordinates else {
        return None;
    };
    let at = |i: usize| {
        list.get(i)
            .map(|c| DVec4::new(f64::from(c.x), f64::from(c.y), 0.0, 1.0))
    };
    let points: Vec<DVec4> = match index {
        Some(index) => index
            .iter()
            .filter_map(|&i| at(usize::try_from(i).ok()?))
            .collect(),
        None => (0..list.len()).filter_map(at).collect(),
    };
    let s_knots = node.get(nurbs_surface::S_KNOT_VECTOR);
    let t_knots = node.get(nurbs_surface::T_KNOT_VECTOR);
    NurbsSurface::new(s, t, s_knots, t_knots, points).ok()
}

/// Returns the trimming loops. Linked profiles form one loop.
fn trims<'a>(
    state: &State<'a>,
    detail: &Detail<'_>,
    out: &mut dyn Canvas,
    shape: NodeRef<'a>,
) -> Vec<Vec<DVec2>> {
    let mut loops: Vec<Vec<DVec2>> = Vec::new();
    for profile in state.profiles.iter() {
        let node = profile.node;
        let point = |i: i32| {
            let i = usize::try_from(i).ok()?;
            match profile.coordinates {
                ProfileCoordinates::Two(p) => p.get(i).map(|p| p.as_dvec2().extend(1.0)),
                ProfileCoordinates::Three(p) => p.get(i).map(|p| p.as_dvec3()),
            }
        };
        let index = node.get(linear_profile::INDEX);
        let points: Vec<DVec3> = index.iter().filter_map(|&i| point(i)).collect();
        let line = match node.find(nurbs_profile::KNOT_VECTOR) {
            Some(knots) => match trim_curve(&points, knots, detail) {
                Ok(line) => line,
                Err(why) => {
                    out.report(shape, &format!("in a trimming curve, {why}"));
                    continue;
                }
            },
            None => points.iter().map(|p| p.truncate() / p.z).collect(),
        };
        let adds = node.get(linear_profile::LINKAGE) == linear_profile::LINKAGE_ADD_TO_CURRENT;
        match loops.last_mut() {
            Some(last) if adds => last.extend(line),
            _ => loops.push(line),
        }
    }
    loops
}

/// Draws a curve of Inventor.
fn curve<'a>(node: NodeRef<'a>, state: &State<'a>, points: Vec<DVec4>, out: &mut dyn Canvas) {
    for p in &points {
        out.bound((p.truncate() / if p.w == 0.0 { 1.0 } else { p.w }).as_vec3());
    }
    let count = count(node, nurbs_curve::NUM_CONTROL_POINTS).min(points.len());
    let knots = node.get(nurbs_curve::KNOT_VECTOR);
    curve_through(node, state, points[..count].to_vec(), knots, out);
}

/// Draws a curve as a polyline.
fn curve_through<'a>(
    node: NodeRef<'a>,
    state: &State<'a>,
    points: Vec<DVec4>,
    knots: &[f32],
    out: &mut dyn Canvas,
) {
    out.set_unlit();
    let made = with_detail(state, out, |detail, _| {
        Curve::new(points, knots).and_then(|c| c.polyline(detail))
    });
    match made {
        Ok(line) => {
            let corner = |p: &DVec3| Corner {
                position: p.as_vec3(),
                normal: Vec3::Z,
                material: 0,
                coordinates: glam::Vec2::ZERO,
                third: 0.0,
            };
            for pair in line.windows(2) {
                out.line(
                    [corner(&pair[0]), corner(&pair[1])],
                    state.drawing.line_width,
                );
            }
        }
        Err(why) => out.report(node, &why),
    }
}

/// Returns the control points of a shape of VRML 97's Amendment 1 or of X3D, where a `Coordinate`
/// has them, multiplied by their weights.
fn weighted(node: NodeRef<'_>, state: &State<'_>) -> Vec<DVec4> {
    let points = match state.coordinates {
        Coordinates::Three(points) if !points.is_empty() => points,
        _ => node.get(vrml97_nurbs_surface::CONTROL_POINT),
    };
    let weights = node.get(vrml97_nurbs_surface::WEIGHT);
    let weight = |i: usize| f64::from(weights.get(i).copied().unwrap_or(1.0));
    let place = |(i, p): (usize, &Vec3)| (p.as_dvec3() * weight(i)).extend(weight(i));
    points.iter().enumerate().map(place).collect()
}

/// Returns the knots of a node. If their number does not fit its order, they are evenly spaced.
fn knots97(node: NodeRef<'_>, knots: Field<[f32]>, order: Field<i32>, points: usize) -> Vec<f32> {
    let order = usize::try_from(node.get(order)).unwrap_or(3);
    let order = order.clamp(2, points.max(2));
    let stated = node.get(knots);
    if stated.len() == points + order {
        return stated.to_vec();
    }
    let inner = points.saturating_sub(order) + 1;
    let even = |i: usize| (i + 1).saturating_sub(order).min(inner) as f32;
    (0..points + order).map(even).collect()
}

/// Draws a `NurbsSurface` of VRML 97, with the contours of a `TrimmedSurface` if there is one.
pub(super) fn surface97<'a>(
    node: NodeRef<'a>,
    trimmed: Option<NodeRef<'a>>,
    state: &State<'a>,
    out: &mut dyn Canvas,
) {
    let points = weighted(node, state);
    for p in &points {
        out.bound((p.truncate() / if p.w == 0.0 { 1.0 } else { p.w }).as_vec3());
    }
    let u = count(node, vrml97_nurbs_surface::U_DIMENSION);
    let v = count(node, vrml97_nurbs_surface::V_DIMENSION);
    let unread = node.get_node(faces97::COORD).and_then(|c| c.known_class());
    if points.is_empty() && unread.is_some_and(|class| class.treatment == Treatment::Kept) {
        return; // The walk reports a node with points that is not applied.
    }
    if u.saturating_mul(v) > points.len() {
        return out.report(node, "it has fewer control points than its dimensions need");
    }
    let made = NurbsSurface::new(
        u,
        v,
        &knots97(
            node,
            vrml97_nurbs_surface::U_KNOT,
            vrml97_nurbs_surface::U_ORDER,
            u,
        ),
        &knots97(
            node,
            vrml97_nurbs_surface::V_KNOT,
            vrml97_nurbs_surface::V_ORDER,
            v,
        ),
        points,
    );
    draw_surface(node, state, made, out, |surface, detail, out| {
        let detail_of_trims = surface.detail_of_trims(detail);
        let trims = trimmed.map(|trimmed| contours97(trimmed, &detail_of_trims));
        let trims = trims.unwrap_or_default();
        note_open(&trims, out);
        surface.tessellate(detail, &trims, None)
    });
}

/// Notes trimming loops whose ends are farther apart than a thousandth of their size.
fn note_open(trims: &[Vec<DVec2>], out: &mut dyn Canvas) {
    let is_open = |line: &Vec<DVec2>| {
        let [Some(first), Some(last)] = [line.first(), line.last()] else {
            return false;
        };
        let size = line.iter().map(|p| p.distance(*first)).fold(0.0, f64::max);
        first.distance(*last) > 1e-3 * size
    };
    if trims.iter().any(is_open) {
        out.note(Mistake::OpenTrim);
    }
}

/// Returns the loops of a `TrimmedSurface`. Each `Contour2D` is one loop.
fn contours97(node: NodeRef<'_>, detail: &Detail<'_>) -> Vec<Vec<DVec2>> {
    let contours = node.get_nodes(trimmed_surface::TRIMMING_CONTOUR);
    let contour = |&id: &NodeId| {
        let parts = node.document.node(id).get_nodes(contour2_d::CHILDREN);
        let line = |&id: &NodeId| contour_part(node.document.node(id), detail);
        parts.iter().flat_map(line).collect()
    };
    contours.iter().map(contour).collect()
}

/// Returns the points of a part of a contour.
fn contour_part(node: NodeRef<'_>, detail: &Detail<'_>) -> Vec<DVec2> {
    if let Some(line) = node.find(polyline2_d::POINT) {
        return line.iter().map(|p| p.as_dvec2()).collect();
    }
    let points = node.get(nurbs_curve2_d::CONTROL_POINT);
    let weights = node.get(nurbs_curve2_d::WEIGHT);
    let weight = |i: usize| f64::from(weights.get(i).copied().unwrap_or(1.0));
    let place = |(i, p): (usize, &Vec2)| (p.as_dvec2() * weight(i)).extend(weight(i));
    let points: Vec<DVec3> = points.iter().enumerate().map(place).collect();
    let knots = knots97(
        node,
        nurbs_curve2_d::KNOT,
        nurbs_curve2_d::ORDER,
        points.len(),
    );
    trim_curve(&points, &knots, detail).unwrap_or_default()
}

/// Draws a `NurbsCurve` of VRML 97.
pub(super) fn curve97<'a>(node: NodeRef<'a>, state: &State<'a>, out: &mut dyn Canvas) {
    let points = weighted(node, state);
    let knots = knots97(
        node,
        vrml97_nurbs_curve::KNOT,
        vrml97_nurbs_curve::ORDER,
        points.len(),
    );
    curve_through(node, state, points, &knots, out);
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::scene::{CompileOptions, Instancing, Needs, RenderScene};
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::pose::CameraPose;
    use ivcam_inventor::snapshot::Snapshot;

    const ARCH: &str = "Coordinate3 { point [ -1 -1 0, 0 -1 1, 1 -1 0,  -1 0 1, 0 0 2, 1 0 1,
            -1 1 0, 0 1 1, 1 1 0 ] }
        NurbsSurface { numUControlPoints 3 numVControlPoints 3
            uKnotVector [ 0, 0, 0, 1, 1, 1 ] vKnotVector [ 0, 0, 0, 1, 1, 1 ] }";

    /// The number of triangles of the arch at complexity 0.5: 23 by 23 cells.
    const BY_COMPLEXITY: u64 = 1058;

    /// Options of a picture of 240 rows, with a camera at a distance in front of the arch.
    fn seen_from(distance: f64) -> CompileOptions {
        let box_of_arch = (DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 2.0));
        CompileOptions {
            camera: Some(CameraPose {
                position: DVec3::new(0.0, 0.0, distance),
                ..CameraPose::view_all(box_of_arch, 1.0)
            }),
            ..CompileOptions::default()
        }
    }

    fn triangles(scene: &str, options: &CompileOptions) -> u64 {
        let text = format!("#Inventor V2.1 ascii\n{scene}").into_bytes();
        let document = Document::read_headerless("a.iv", text).expect("reads");
        let scene = RenderScene::compile(&Snapshot::at(&document, 0.0), options);
        scene.expect("compiles").census().triangles
    }

    #[test]
    fn a_surface_is_as_fine_as_the_picture_needs() {
        let counts = [3.0, 6.0, 30.0, 300.0, 3000.0].map(|z| triangles(ARCH, &seen_from(z)));
        assert!(counts.is_sorted_by(|a, b| a > b), "{counts:?}");
        assert_eq!(counts[4], 2);
        let mut large = seen_from(6.0);
        large.pixel_rows = 960;
        let ratio = triangles(ARCH, &large) as f64 / counts[1] as f64;
        assert!((3.0..5.0).contains(&ratio), "{ratio}");
        let with = |value: f32| format!("Complexity {{ value {value} }} {ARCH}");
        let [fine, coarse] = [1.0, 0.0].map(|value| triangles(&with(value), &seen_from(6.0)));
        assert!(fine > counts[1] && counts[1] > coarse, "{fine} {coarse}");
    }

    #[test]
    fn what_the_picture_does_not_show_is_coarser() {
        let seen = triangles(ARCH, &seen_from(6.0));
        let behind = triangles(ARCH, &seen_from(-4.0));
        assert!(behind > 8 && behind < seen, "{behind} {seen}");
    }

    #[test]
    fn without_a_picture_the_complexity_decides() {
        assert_eq!(triangles(ARCH, &CompileOptions::default()), BY_COMPLEXITY);
    }

    #[test]
    fn a_file_may_ask_for_the_same_mesh_in_every_picture() {
        let same = format!("Complexity {{ type OBJECT_SPACE }} {ARCH}");
        assert_eq!(triangles(&same, &seen_from(30.0)), BY_COMPLEXITY);
        let by_screen = format!("Complexity {{ type SCREEN_SPACE }} {ARCH}");
        let options = seen_from(30.0);
        assert_eq!(triangles(&by_screen, &options), triangles(ARCH, &options));
    }

    #[test]
    fn lit_corners_and_shared_parts_do_not_depend_on_the_picture() {
        let mut gl = seen_from(30.0);
        gl.needs = Needs {
            facets: true,
            ..Needs::ALL
        };
        assert_eq!(triangles(ARCH, &gl), BY_COMPLEXITY);
        let mut shared = seen_from(30.0);
        shared.instancing = Instancing::Everywhere;
        let twice = format!("DEF a Separator {{ {ARCH} }} Separator {{ USE a }}");
        assert_eq!(triangles(&twice, &shared), BY_COMPLEXITY); // stored once
    }
}

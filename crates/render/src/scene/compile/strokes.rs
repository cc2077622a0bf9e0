//! Compiles lines and points, including the edges and vertices of faces.

use glam::{DVec3, Vec3};
use ivcam_inventor::pose::{CameraPose, Projection};
use ivcam_inventor::traversal::state::DrawStyle;

use super::scene_builder::SceneBuilder;
use crate::geometry::{Corner, Stroke, StrokeView};
use crate::scene::options::CompileOptions;
use crate::scene::precision::in_reach;

/// The largest width of a line in pixels. A wider line fills the picture anyway, and the limit
/// keeps its box finite.
const WIDEST: f32 = 1e5;

impl SceneBuilder {
    /// Draws the edges or the vertices of a face, depending on the draw style.
    pub(super) fn edges(&mut self, corners: &[Corner]) {
        if corners.is_empty() {
            return; // the face has an index without a coordinate
        }
        self.shape.pattern_at = 0.0;
        self.shape.face_normal = self.outward(corners);
        let drawing = self.shape.drawing;
        // OpenGL begins the pattern of three or four edges with the last one (Mesa).
        let n = corners.len();
        let first = if n <= 4 { n.saturating_sub(1) } else { 0 };
        for i in first..first + n {
            let (corner, next) = (corners[i % n], corners[(i + 1) % n]);
            if drawing.style == DrawStyle::Points {
                self.stroke([corner; 2], drawing.point_size);
            } else {
                self.stroke([corner, next], drawing.line_width);
            }
        }
        self.shape.face_normal = Vec3::ZERO;
    }

    /// Returns the outward normal of a face in the scene by Newell's sum. Its length is twice the
    /// area.
    fn outward(&self, corners: &[Corner]) -> Vec3 {
        let at = |i: usize| {
            let p = corners[i % corners.len()].position.as_dvec3();
            self.placement.scene_from_object.transform_point3(p)
        };
        let from = at(0);
        (1..corners.len())
            .fold(DVec3::ZERO, |sum, i| {
                sum + (at(i) - from).cross(at(i + 1) - from)
            })
            .as_vec3()
    }

    /// Draws a line between two points, or a square if they are equal. `width` is in pixels.
    pub(super) fn stroke(&mut self, ends: [Corner; 2], width: f32) {
        if self.is_recording {
            self.spoiled = true; // its width is in pixels
            return;
        }
        let positions = ends.map(|e| e.position);
        if !positions.iter().all(|p| p.is_finite()) {
            self.scene.census.bad_corners += 1;
            return;
        }
        if self.is_at_limit(size_of::<Stroke>()) {
            return;
        }
        let placed = positions.map(|p| self.placement.point(p));
        if !placed.iter().all(|p| in_reach(*p)) {
            self.scene.census.bad_corners += 1;
            return;
        }
        let width = if width > 0.0 { width } else { 1.0 }.min(WIDEST);
        let view = self.scene.view;
        let drawing = &self.shape.drawing;
        let mut stroke = Stroke::new(placed, width, &view).with_pattern(
            drawing.line_pattern,
            drawing.line_pattern_scale,
            self.shape.pattern_at,
        );
        if stroke.has_gaps() {
            self.shape.pattern_at = stroke.pattern_end(&view);
        }
        stroke.face = self.shape.face_normal;
        stroke.materials = ends.map(|e| e.material);
        stroke.normals = ends.map(|e| match e.normal {
            Vec3::ZERO => Vec3::ZERO,
            normal => self.placement.normal(normal),
        });
        stroke.coordinates = ends.map(|e| e.coordinates);
        if drawing.style == DrawStyle::Filled
            && let Some(surface) = self.scene.surfaces.last_mut()
        {
            surface.layer = 1; // a polygon offset does not move lines that are shapes
        }
        self.scene.census.strokes += 1;
        self.scene.strokes.push(stroke);
        self.owners.strokes.push(self.last_surface());
    }
}

/// Returns the camera's directions and the size of its pixels. Without a camera they are those of a
/// camera that looks along −z with a height angle of 45 degrees.
pub(super) fn view(options: &CompileOptions) -> StrokeView {
    let (camera, pixel_rows) = (options.camera.as_ref(), options.pixel_rows);
    let rows = f64::from(pixel_rows.max(1));
    let turn = camera.map_or(glam::DQuat::IDENTITY, |c| c.orientation);
    let (fixed, per_depth) = match camera.map(|c| c.projection) {
        Some(Projection::Orthographic { height }) => (height / rows, 0.0),
        Some(Projection::Perspective { height_angle }) => {
            (0.0, 2.0 * libm::tan(0.5 * height_angle) / rows)
        }
        None => (0.0, 2.0 * libm::tan(std::f64::consts::PI / 8.0) / rows),
    };
    StrokeView {
        right: (turn * DVec3::X).as_vec3(),
        up: (turn * DVec3::Y).as_vec3(),
        forward: camera.map_or(DVec3::NEG_Z, CameraPose::direction).as_vec3(),
        fixed: fixed as f32,
        per_depth: per_depth as f32,
    }
}

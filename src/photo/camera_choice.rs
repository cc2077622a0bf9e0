//! The camera of a plan: a file with a camera node, or the text of a camera node.

use std::ffi::OsStr;
use std::path::PathBuf;

use glam::{DQuat, DVec2, DVec3};
use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::{MAX_TEXT, read_file};
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::grammar::value::Rotation;
use ivcam_inventor::grammar::{Role, camera};
use ivcam_inventor::iv::{Document, NodeRef};
use ivcam_inventor::pose::{CameraPose, Projection, ViewportMapping, quat};
use ivcam_inventor::traversal::{WalkOptions, first_camera};
use ivcam_render::scene::{CompileOptions, snapshot};

/// The camera of a plan.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum CameraChoice {
    /// The first camera in a file.
    File(PathBuf),
    /// A camera node.
    Node(CameraNode),
}

/// The text of a camera node, and the pose that it describes.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraNode {
    text: String,
    pose: CameraPose,
}

/// What messages call the text of a camera node.
const NODE: &str = "the camera";

impl CameraChoice {
    /// Parses an argument of the command line. An argument with a brace is a node; any other is the
    /// name of a file.
    ///
    /// # Errors
    /// Returns an error if the text of a node has no camera.
    pub fn parse(word: &OsStr) -> Result<Self> {
        match word.to_str().filter(|text| text.contains('{')) {
            Some(text) => CameraNode::read(text).map(Self::Node),
            None => Ok(Self::File(word.into())),
        }
    }

    /// Returns the argument that [`Self::parse`] reads as this camera.
    pub(crate) fn word(&self) -> String {
        match self {
            Self::File(path) => path.display().to_string(),
            Self::Node(node) => node.text.clone(),
        }
    }

    /// Returns the camera's pose. `sink` receives what is wrong with the file or the text.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read or has no camera.
    pub(crate) fn pose(&self, sink: &mut Sink) -> Result<CameraPose> {
        match self {
            Self::Node(node) => {
                read(NODE, node.text.clone().into(), sink)?;
                Ok(node.pose.clone())
            }
            Self::File(path) => {
                let bytes = read_file(path, MAX_TEXT)?;
                read(&path.display().to_string(), bytes, sink)
            }
        }
    }
}

impl CameraNode {
    /// Reads a camera node from text.
    ///
    /// # Errors
    /// Returns an error if the text has no camera.
    pub fn read(text: &str) -> Result<Self> {
        Ok(Self {
            text: text.to_owned(),
            pose: read(NODE, text.into(), &mut Sink::new())?,
        })
    }

    /// Creates the node for a pose. The stored pose is rounded, because a node has numbers in
    /// single precision and a rotation as axis and angle.
    pub fn from_pose(pose: &CameraPose) -> Self {
        let (text, pose) = node_text(&pose.clone().fitted(1.0));
        Self { text, pose }
    }

    /// Returns the text of the node.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the pose that the node describes.
    pub fn pose(&self) -> &CameraPose {
        &self.pose
    }
}

/// Returns a camera file, one field per line, with the pose and the distance in focus as the
/// camera's own. At infinity the pose's own distance remains, since a file holds no infinity; the
/// file then states the option that focuses there.
pub(crate) fn camera_file(pose: &CameraPose, distance: f64) -> String {
    let mut pose = pose.clone();
    let option = match is_beyond_a_file(&pose, distance) {
        true => "; render with --focus inf",
        false => "",
    };
    if distance.is_finite() {
        pose.focal_distance = distance;
    }
    let node = CameraNode::from_pose(&pose);
    format!(
        "#Inventor V2.1 ascii\n# Written by ivcam{option}.\n{}\n",
        one_field_per_line(node.text())
    )
}

/// Returns whether a file with this pose is not focused at this distance: at infinity, unless the
/// pose itself is, by a distance that is not positive.
pub(super) fn is_beyond_a_file(pose: &CameraPose, distance: f64) -> bool {
    distance.is_infinite() && pose.focal_distance > 0.0
}

/// Formats a node with one field per line.
fn one_field_per_line(node: &str) -> String {
    let fields = [
        "position",
        "orientation",
        "nearDistance",
        "farDistance",
        "focalDistance",
        "aspectRatio",
        "heightAngle",
        "height ",
        "left",
        "right",
        "bottom",
        "top",
        "viewportMapping",
    ];
    let mut text = node.to_owned();
    for field in fields {
        text = text.replace(&format!(" {field}"), &format!("\n  {field}"));
    }
    text.strip_suffix(" }")
        .map_or(text.clone(), |t| format!("{t}\n}}"))
}

/// Returns the pose of the first camera in a file, which may have no header. `sink` receives what
/// reading finds.
fn read(name: &str, bytes: Vec<u8>, sink: &mut Sink) -> Result<CameraPose> {
    let document = Document::read_headerless(name, bytes)?;
    sink.extend_from(&document.sink);
    if let Some(warning) = further_cameras(&document) {
        sink.add(*warning);
    }
    let options = CompileOptions::default();
    let snapshot = snapshot(&document, &SnapshotOptions::default(), &options);
    first_camera(&snapshot, &WalkOptions::default()).ok_or_else(|| {
        let example = "`PerspectiveCamera { position 0 0 5 }`";
        Diagnostic::error("there is no camera in the file")
            .in_file(name)
            .with_help(format!(
                "a camera file contains a camera node, such as {example}"
            ))
    })
}

/// Returns a warning at the second camera of an Inventor file.
fn further_cameras(document: &Document) -> Option<Box<Diagnostic>> {
    let nodes = document.ids().map(|id| document.node(id));
    let is_camera = |node: &NodeRef<'_>| {
        let class = node.known_class();
        class.is_some_and(|class| class.role == Role::Camera && !class.is_vrml97())
    };
    let camera = nodes.filter(is_camera).nth(1)?;
    let warning = Diagnostic::warning("the file has several cameras: the first one is taken");
    let warning = warning.with_help("the text of a node can be given in place of the file");
    Some(match camera.source() {
        Some(source) => warning.at(source, camera.span()),
        None => warning,
    })
}

/// Returns the axis and angle of a rotation. The identity has the z axis.
fn axis_and_angle(orientation: DQuat) -> (glam::Vec3, f32) {
    let q = if orientation.w < 0.0 {
        -orientation
    } else {
        orientation
    };
    let v = DVec3::new(q.x, q.y, q.z);
    match v.try_normalize() {
        Some(axis) => (axis.as_vec3(), 2.0 * libm::atan2(v.length(), q.w) as f32),
        None => (glam::Vec3::Z, 0.0),
    }
}

/// Returns the text of a camera node for a pose, and the pose that this text describes.
fn node_text(pose: &CameraPose) -> (String, CameraPose) {
    let float = |x: f64| f64::from(x as f32);
    let p = pose.position.as_vec3();
    let (axis, angle) = axis_and_angle(pose.orientation);
    let (class, size, projection) = match pose.projection {
        Projection::Perspective { .. } if pose.center != DVec2::ZERO => {
            ("FrustumCamera", frustum_sides(pose), pose.projection)
        }
        Projection::Perspective { height_angle } => (
            "PerspectiveCamera",
            format!("heightAngle {}", height_angle as f32),
            Projection::Perspective {
                height_angle: float(height_angle),
            },
        ),
        Projection::Orthographic { height } => (
            "OrthographicCamera",
            format!("height {}", height as f32),
            Projection::Orthographic {
                height: float(height),
            },
        ),
    };
    // A far plane that the scene does not state is behind everything, and a default is not.
    let far = match pose.has_far {
        true => format!("farDistance {} ", pose.far as f32),
        false => String::new(),
    };
    let text = format!(
        "{class} {{ position {} {} {} orientation {} {} {} {angle} nearDistance {} {far}\
         focalDistance {} aspectRatio {} {size}{} }}",
        p.x,
        p.y,
        p.z,
        axis.x,
        axis.y,
        axis.z,
        pose.near as f32,
        pose.focal_distance as f32,
        pose.aspect_ratio as f32,
        mapping(pose.viewport_mapping),
    );
    let written = CameraPose {
        position: p.as_dvec3(),
        orientation: quat(Rotation { axis, angle }).normalize(),
        projection,
        center: pose.center,
        near: float(pose.near),
        far: match pose.has_far {
            true => float(pose.far),
            false => camera::FAR_DISTANCE.default().into(),
        },
        has_far: pose.has_far,
        focal_distance: float(pose.focal_distance),
        aspect_ratio: float(pose.aspect_ratio),
        viewport_mapping: pose.viewport_mapping,
        film: None,
        source: class.into(),
    };
    // The sides of a frustum are rounded, so its angle is that of the text.
    match pose.center == DVec2::ZERO {
        true => (text, written),
        false => {
            let again = read(NODE, text.clone().into(), &mut Sink::new());
            (text, again.unwrap_or(written))
        }
    }
}

/// Returns the sides of a view off the camera's axis, on the near plane.
fn frustum_sides(pose: &CameraPose) -> String {
    let Projection::Perspective { height_angle } = pose.projection else {
        return String::new();
    };
    let half = libm::tan(0.5 * height_angle) * DVec2::new(pose.aspect_ratio, 1.0);
    let [low, high] = [pose.center - half, pose.center + half];
    let [low, high] = [low, high].map(|corner| (corner * pose.near).as_vec2());
    let (left, bottom, right, top) = (low.x, low.y, high.x, high.y);
    format!("left {left} right {right} bottom {bottom} top {top}")
}

/// Returns the text of the field `viewportMapping`, which is empty for the default.
fn mapping(mapping: ViewportMapping) -> &'static str {
    match mapping {
        ViewportMapping::CropViewportFillFrame => " viewportMapping CROP_VIEWPORT_FILL_FRAME",
        ViewportMapping::CropViewportLineFrame => " viewportMapping CROP_VIEWPORT_LINE_FRAME",
        ViewportMapping::CropViewportNoFrame => " viewportMapping CROP_VIEWPORT_NO_FRAME",
        ViewportMapping::AdjustCamera | ViewportMapping::ExtendView => "",
        ViewportMapping::LeaveAlone => " viewportMapping LEAVE_ALONE",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_may_be_given_as_the_node_itself() {
        let word = "PerspectiveCamera { position 1 2 3.5 }";
        let choice = CameraChoice::parse(OsStr::new(word)).unwrap();
        let mut sink = Sink::new();
        let pose = choice.pose(&mut sink).unwrap();
        assert_eq!(pose.position, DVec3::new(1.0, 2.0, 3.5));
        assert!(sink.items().is_empty());
        assert_eq!(choice.word(), word);
        assert!(CameraChoice::parse(OsStr::new("Cube { }")).is_err());
    }

    #[test]
    fn what_is_wrong_with_a_camera_is_said() {
        let text = "PerspectiveCamera { positio 1 2 3.5 }";
        let choice = CameraChoice::parse(OsStr::new(text)).unwrap();
        let mut sink = Sink::new();
        choice.pose(&mut sink).unwrap();
        assert!(sink.items()[0].message.contains("`positio`"));
    }

    #[test]
    fn a_file_may_begin_with_a_byte_order_mark_and_a_second_camera_is_named() {
        let node = "\u{feff}PerspectiveCamera { position 1 2 3.5 }";
        let mut sink = Sink::new();
        let pose = read("a.dat", node.into(), &mut sink).unwrap();
        assert_eq!(pose.position, DVec3::new(1.0, 2.0, 3.5));
        assert!(sink.items().is_empty(), "{:?}", sink.items());
        let two = format!("{node}\nOrthographicCamera {{ }}");
        read("a.dat", two.into(), &mut sink).unwrap();
        let said = sink.items()[0].to_string();
        assert!(
            said.contains("a.dat:2:1") && said.contains("several cameras"),
            "{said}"
        );
    }

    #[test]
    fn a_node_reads_back_as_the_pose_that_it_was_written_for() {
        for i in 0..40 {
            let t = f64::from(i);
            let mut pose = CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.5);
            pose.position = DVec3::new(t / 7.0, -t / 3.0, 1e-3 * t * t);
            pose.orientation = DQuat::from_euler(glam::EulerRot::XYZ, t, t / 3.0, t / 17.0);
            pose.center = DVec2::new(f64::from(i % 2), -0.1 * f64::from(i % 4));
            let node = CameraNode::from_pose(&pose);
            assert_eq!(CameraNode::read(node.text()).unwrap(), node);
            assert!(node.pose().center.distance(pose.center) < 1e-6);
        }
    }
}

//! What is in a scene, without compiling it: bounds, cameras, lights, counts.

use glam::{DMat4, DVec3};
use indexmap::IndexMap;

use super::{Builder, Census, CompileOptions};
use crate::diag::Diagnostic;
use crate::graph::read::Fields;
use crate::graph::role::Role;
use crate::graph::state::{LightElement, State};
use crate::graph::{self, Visitor, WalkOptions};
use crate::iv::{Document, NodeRef};
use crate::pose::CameraPose;

#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// The exact box around everything drawn, in the world.
    pub bounds: Option<(DVec3, DVec3)>,
    /// The box that Inventor would give: of boxes around boxes.
    pub inventor_bounds: Option<(DVec3, DVec3)>,
    /// Cameras and viewpoints in order of traversal.
    pub cameras: Vec<CameraPose>,
    pub lights: Vec<LightElement>,
    /// As Inventor triangulates: a cube is 12; spheres, cones and cylinders are left out.
    pub triangles: u64,
    /// Shapes met, by class.
    pub shapes: IndexMap<&'static str, u64>,
    pub census: Census,
    pub troubles: Vec<Box<Diagnostic>>,
}

struct Surveyor<'a> {
    builder: Builder<'a>,
    survey: Survey,
}

pub fn survey(document: &Document, options: &CompileOptions) -> Survey {
    let patched = graph::engines::at_time(document, options.time);
    let document = patched.as_ref().unwrap_or(document);
    let walk_options = WalkOptions {
        time: options.time,
        camera: options.camera.clone(),
        ..WalkOptions::default()
    };
    let mut surveyor = Surveyor {
        builder: Builder::surveyor(document, options),
        survey: Survey::default(),
    };
    graph::walk(document, &walk_options, &mut surveyor);
    let Surveyor {
        builder,
        mut survey,
    } = surveyor;
    survey.triangles = builder.triangle_count;
    survey.census = builder.census().clone();
    survey.troubles = builder.troubles;
    survey
}

impl<'a> Visitor<'a> for Surveyor<'a> {
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        if let Some(class) = node.known_class() {
            *self.survey.shapes.entry(class.name).or_default() += 1;
        }
        self.builder.shape(node, state);
        if let Some((min, max)) = self.builder.bounds {
            super::builder::grow(&mut self.survey.bounds, min, max);
        }
        if let Some(object) = self.builder.object_bounds {
            let (min, max) = boxed(state.world_from_object, object);
            super::builder::grow(&mut self.survey.inventor_bounds, min, max);
        }
        self.builder.bounds = None;
        self.builder.object_bounds = None;
    }

    fn light(&mut self, light: &LightElement, _state: &State<'a>) {
        self.survey.lights.push(*light);
    }

    fn camera(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        self.survey
            .cameras
            .extend(CameraPose::from_node(node, state.world_from_object));
    }

    fn node(&mut self, node: NodeRef<'a>, role: Role) {
        self.builder.node(node, role);
    }

    fn trouble(&mut self, trouble: Box<Diagnostic>) {
        self.builder.trouble(trouble);
    }
}

/// The box around a box's corners under a matrix.
fn boxed(matrix: DMat4, (min, max): (DVec3, DVec3)) -> (DVec3, DVec3) {
    let corners = (0..8).map(|i| {
        matrix.project_point3(DVec3::new(
            if i & 1 == 0 { min.x } else { max.x },
            if i & 2 == 0 { min.y } else { max.y },
            if i & 4 == 0 { min.z } else { max.z },
        ))
    });
    let mut out = None;
    for p in corners {
        super::builder::grow(&mut out, p, p);
    }
    out.unwrap_or((min, max))
}

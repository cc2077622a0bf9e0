//! The options of a walk, and the trait of those who follow it.

use crate::diag::Diagnostic;
use crate::iv::NodeRef;
use crate::pose::CameraPose;

use super::role::Role;
use super::state::{LightElement, State};

/// How a walk chooses among levels of detail, and where it stops.
#[derive(Clone, Debug)]
pub(crate) struct WalkOptions {
    /// The camera that levels of detail and billboards depend on. Default: none, the finest level.
    pub camera: Option<CameraPose>,
    /// The most nodes to visit. Default: 300,000, or twice the document's nodes if that is more.
    pub max_visits: u64,
    /// Walks every child of an LOD or a Blinker, as Inventor's bounding boxes do. Default: no.
    pub all_levels: bool,
}

impl Default for WalkOptions {
    fn default() -> Self {
        Self {
            camera: None,
            max_visits: 300_000,
            all_levels: false,
        }
    }
}

/// Is called for what a walk meets, with the state that holds at the node.
pub(crate) trait Visitor<'a> {
    /// Draws a shape.
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>);
    fn light(&mut self, _light: &LightElement, _state: &State<'a>) {}
    fn camera(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Is called for every node, before anything else.
    fn node(&mut self, _node: NodeRef<'a>, _role: Role) {}
    /// Is called at the beginning of a separator; [`Self::close`] at its end.
    fn open(&mut self, _state: &State<'a>) {}
    fn close(&mut self) {}
    /// Is called for a VRML97 `Background` or `Fog`, of which a scene uses the first.
    fn bindable(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Returns how many pixels the box around a node's children covers; `None` without a camera.
    fn screen_area(&mut self, _node: NodeRef<'a>, _state: &State<'a>) -> Option<f64> {
        None
    }
    /// Whether the visitor can take no more; the walk then ends.
    fn is_full(&self) -> bool {
        false
    }
    /// Is called for what walking finds wrong with the scene.
    #[allow(clippy::boxed_local)] // boxed as every diagnostic that is handed on
    fn trouble(&mut self, _trouble: Box<Diagnostic>) {}
}

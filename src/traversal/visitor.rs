//! What a walk is told, and whom it tells.

use crate::diag::Diagnostic;
use crate::iv::NodeRef;
use crate::pose::CameraPose;

use super::role::Role;
use super::state::{LightElement, State};

/// What a walk may take for granted, and where it stops.
#[derive(Clone, Debug)]
pub struct WalkOptions {
    /// The camera that levels of detail and billboards go by. Default: none, the finest level.
    pub camera: Option<CameraPose>,
    /// Nodes met before the walk gives up. Default: 300,000, or twice the
    /// document's nodes if that is more.
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

/// What a walk tells. Every call has the state as the node finds it.
pub trait Visitor<'a> {
    /// A shape: drawn with this state.
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>);
    fn light(&mut self, _light: &LightElement, _state: &State<'a>) {}
    fn camera(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Any node, before anything else.
    fn node(&mut self, _node: NodeRef<'a>, _role: Role) {}
    /// A separator begins, in this state; [`Self::close`] ends it.
    fn open(&mut self, _state: &State<'a>) {}
    fn close(&mut self) {}
    /// A VRML 97 `Background` or `Fog`, of which a scene has one in force: the first.
    fn bindable(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Pixels that the box around a node's children takes up; `None` where nobody looks.
    fn screen_area(&mut self, _node: NodeRef<'a>, _state: &State<'a>) -> Option<f64> {
        None
    }
    /// Whether the visitor has no room for more; the walk ends then.
    fn is_full(&self) -> bool {
        false
    }
    /// Something wrong with the scene that walking found.
    #[allow(clippy::boxed_local)] // boxed as every diagnostic that is handed on
    fn trouble(&mut self, _trouble: Box<Diagnostic>) {}
}

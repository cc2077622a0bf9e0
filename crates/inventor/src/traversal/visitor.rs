//! The options of a walk, and the trait of its visitors.

use ivcam_base::diag::Diagnostic;

use super::copies::Grid;
use super::role::Role;
use super::state::{LightElement, State};
use crate::iv::{Document, Limits, NodeRef};
use crate::pose::CameraPose;

/// The options of a walk: how it chooses among levels of detail, and how far it goes.
#[derive(Clone, Debug)]
pub struct WalkOptions {
    /// The camera that levels of detail and billboards depend on. Default: none, which selects the
    /// finest level and turns no billboard.
    pub camera: Option<CameraPose>,
    /// The largest number of nodes to visit. Default: that of [`Limits`]. It is raised to twice the
    /// document's number of nodes.
    pub max_visits: u64,
    /// Whether to walk every child of an LOD or a Blinker, as Inventor's bounding boxes do.
    /// Default: no.
    pub all_levels: bool,
    /// Whether levels of detail that depend on the distance show the finest one, whatever the
    /// camera. Default: no.
    pub finest_level: bool,
}

impl Default for WalkOptions {
    fn default() -> Self {
        Self {
            camera: None,
            max_visits: Limits::default().visits as u64,
            all_levels: false,
            finest_level: false,
        }
    }
}

impl WalkOptions {
    /// Returns the default options with the limits of a scene.
    pub fn within(limits: &Limits) -> Self {
        Self {
            max_visits: limits.visits as u64,
            ..Self::default()
        }
    }

    /// The largest number of nodes to visit in a document.
    pub fn most_visits(&self, document: &Document) -> u64 {
        self.max_visits.max(2 * document.nodes.len() as u64)
    }
}

/// An instance of a part of a scene that leaves the state as it was, so that a visitor that knows
/// the part can draw it without a walk.
#[derive(Clone, Copy)]
pub enum Instance<'a> {
    /// A node that restores the state.
    Node(NodeRef<'a>),
    /// The children of a `MultipleCopy` or an `Array`, once.
    Copy(NodeRef<'a>),
    /// The children of an `Array` at every place of a grid. All begin with the same state but for
    /// the matrix and the choice of the last `Switch`.
    Grid(NodeRef<'a>, Grid),
}

impl<'a> Instance<'a> {
    /// The node that is drawn, or whose children are.
    pub fn node(self) -> NodeRef<'a> {
        let (Self::Node(node) | Self::Copy(node) | Self::Grid(node, _)) = self;
        node
    }

    /// The grid on which the part is drawn, if it is drawn on one.
    pub fn grid(self) -> Option<Grid> {
        match self {
            Self::Grid(_, grid) => Some(grid),
            _ => None,
        }
    }
}

/// Receives the nodes of a walk, each with the state at the node.
pub trait Visitor<'a> {
    /// Draws a shape.
    fn shape(&mut self, node: NodeRef<'a>, state: &State<'a>);
    /// Receives a light that is on. Its node may be one that a node kit makes, which is not in the
    /// document of the walk.
    fn light(&mut self, _node: NodeRef<'a>, _light: &LightElement, _state: &State<'a>) {}
    /// Receives a camera. [`first_pose`](super::first_pose) tells whether it may be the first.
    fn camera(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Receives every node, before the other methods.
    fn node(&mut self, _node: NodeRef<'a>, _role: Role) {}
    /// Begins the part of the walk below a node with children. The state may still change before
    /// the first child.
    fn enter(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Ends the part of the walk below the node that was entered last.
    fn leave(&mut self) {}
    /// Draws an instance of a part that the visitor knows, so that the walk skips it. Returns
    /// `false` if the visitor does not know the part; the walk then enters it.
    fn instance(&mut self, _part: Instance<'a>, _state: &State<'a>) -> bool {
        false
    }
    /// Begins a separator.
    fn open(&mut self, _state: &State<'a>) {}
    /// Ends the separator that began last.
    fn close(&mut self) {}
    /// Receives a `Background`, a `Fog` or a `NavigationInfo` that may be bound. A scene uses the
    /// first of each.
    fn bindable(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Receives a sensor that depends on where it is.
    fn sensor(&mut self, _node: NodeRef<'a>, _state: &State<'a>) {}
    /// Returns the area of the box around a node's children in pixels, or `None` without a camera.
    fn screen_area(&mut self, _node: NodeRef<'a>, _state: &State<'a>) -> Option<f64> {
        None
    }
    /// Whether the visitor's limits are reached, so that the walk ends.
    fn is_full(&self) -> bool {
        false
    }
    /// Receives a diagnostic about the scene.
    #[allow(clippy::boxed_local)] // diagnostics are always passed in boxes
    fn report(&mut self, _diagnostic: Box<Diagnostic>) {}
}

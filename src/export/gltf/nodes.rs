//! The nodes of a file, and what they stand for.

use super::schema::{Index, Node};

/// The nodes of a file, with those of the model, of its lights and of its cameras.
pub(super) struct NodeList {
    pub list: Vec<Node>,
    /// The node of each node of the model.
    pub of_model: Vec<Index>,
    /// The node of each light.
    pub of_lights: Vec<Index>,
    /// The node of each camera.
    pub of_cameras: Vec<Index>,
}

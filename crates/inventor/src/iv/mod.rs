//! Reads Inventor and VRML files into a [`Document`], and writes documents as such files.
//!
//! `document` defines the nodes of a file, and `declarations` the classes and routes that a
//! file declares. `read` makes a document from bytes and `write` makes bytes from a document;
//! neither imports the other.

mod data_uri;
pub mod declarations;
mod declared_fields;
mod descendants;
mod difference;
mod display;
pub mod document;
mod edit;
mod encoding;
mod in_inventor;
mod limits;
mod loader;
mod node_fields;
mod read;
mod write;
mod x3d_names;

pub use crate::grammar::value::{NodeId, Value};
pub use declarations::Route;
pub use descendants::Descendants;
pub(crate) use display::display_color;
pub use display::{LINEAR_LIGHT, display_of_linear, linear_of_display};
pub use document::{ClassRef, Connection, Document, FieldEntry, Node, NodeRef};
pub(crate) use in_inventor::CREASE_ANGLE;
pub use limits::Limits;
pub use loader::{FolderLoader, Loader, NoFiles};
pub(crate) use write::value_text;
pub use write::{Format, FormatLoss};

//! A scene as a tree of groups with triangles, materials and pictures, for other programs.
//!
//! A [`Model`] is what the formats of other programs can hold: Inventor's state, which leaks from
//! node to node, is resolved, so that every shape has its own matrix and material. The nodes, their
//! names and their matrices are kept as a tree, and shapes that are used several times share their
//! meshes. Colors and materials keep Inventor's terms and values; a format converts them.
//!
//! Shapes draw here through the same functions as for a picture. The third canvas, beside those of
//! compiling and of surveys, welds their corners to meshes in object space. Round shapes become
//! triangles within a given error.
//!
//! ```
//! use ivcam_inventor::iv::Document;
//! use ivcam_render::scene::model::{Model, ModelOptions};
//!
//! let document = Document::open("../../scenes/livroom/livroom.iv")?;
//! let model = Model::at(&document, 0.0, &ModelOptions::default());
//! let triangles: usize = model.placed_meshes().map(|(mesh, ..)| mesh.triangles().len()).sum();
//! assert!(triangles > 1000);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod canvas;
mod construct;
mod feature;
mod image;
mod lights;
mod material;
mod mesh;
mod motion;
mod options;
mod recenter;
mod scene_model;
mod surface;
mod tree;
mod weld;

pub use feature::{Feature, NotApplied, Occurrence, Place};
pub use image::Image;
pub use lights::{LightShape, Pose, SceneCamera, SceneLight};
pub use material::{Material, Physical, Texture, TextureModel};
pub use mesh::{Mesh, Primitives};
pub use motion::{Motion, Sampling};
pub use options::ModelOptions;
pub use scene_model::{Model, Part, SceneNode};

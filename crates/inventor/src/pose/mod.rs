//! The pose of a camera: from a camera node of the scene or of a `-camread` file, or a view of
//! everything.
//!
//! A pose is in world space, in meters. The camera looks down its own −z with +y up, as in
//! Inventor. Nothing here knows about lenses.

mod camera_pose;
mod projection;
mod rotation;
mod view_direction;
mod view_ray;

pub use camera_pose::{CameraPose, FilmPlane};
pub use projection::{Projection, ViewportMapping};
pub(crate) use rotation::diagonal;
pub use rotation::{axis_angle, orientation_in, quat, rotation_of, rotation_value};
pub use view_direction::{UpAxis, ViewDirection};
pub use view_ray::{ViewExtent, ViewRay};

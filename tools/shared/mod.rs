//! What several measuring programs use.

pub(super) mod files;
pub(super) mod mesh;
pub(super) mod room;
pub(super) mod scenes;

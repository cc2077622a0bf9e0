//! Code that several measuring programs share.

pub(super) mod contact;
pub(super) mod embree;
pub(super) mod lights;
pub(super) mod mesh;
pub(super) mod pictures;
pub(super) mod rays;
pub(super) mod room;
pub(super) mod room_scene;
pub(super) mod scenes;
pub(super) mod sheets;
pub(super) mod slow;
pub(super) mod tinybvh;
pub(super) mod variants;
pub(super) mod words;

//! The handles of draggers and manipulators, for whoever asks to see them.
//!
//! The document is rewritten: beside each dragger comes a separator with the dragger's own motion
//! and its handles, and after each manipulator one that is scaled to surround what the manipulator
//! moves, as a `SurroundScale` does. Parts that the file gives the dragger (`translator`,
//! `rotator`, …) are drawn; a dragger without any gets those of `handles.iv`, which are ivcam's
//! own. What shows only while something is dragged is left out.

mod place;

pub(super) use place::with_handles;

//! Adds the handles of draggers and manipulators to a document.
//!
//! Each dragger gets a separator after it with the dragger's motion and its handles. Each
//! manipulator gets one whose scale surrounds the shapes that the manipulator transforms, as a
//! `SurroundScale` does. Parts that the file states (`translator`, `rotator`, …) are drawn. A
//! dragger without any gets ivcam's own handles from `handles.iv`. Parts that are visible only
//! during dragging are left out.

mod place;

pub(crate) use place::with_handles;

//! Compiles a snapshot into a scene, with the canvas that keeps triangles and materials.

mod appearance;
mod numbers;
mod repeats;
mod scene_builder;
mod strokes;
mod triangles;
mod walk;

//! Compiles a snapshot into a scene, with the canvas that keeps triangles and materials.

mod appearance;
mod deferred_text;
mod glyphs;
mod instances;
mod numbers;
mod scene_builder;
mod strokes;
mod studio;
mod surface_namer;
mod triangles;
mod walk;

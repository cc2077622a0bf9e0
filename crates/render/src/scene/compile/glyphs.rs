//! Makes each glyph of a text a prototype, in scenes with instances.
//!
//! It has the surface of the text. Texts with equal glyphs and equal surfaces
//! share them.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use glam::Vec2;
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::{State, Step};

use super::deferred_text::{DeferredText, glyph_offset};
use super::instances::Recording;
use super::walk::Compiler;
use crate::geometry::TriangleMesh;
use crate::scene::canvas::{Canvas, MaterialsBy};
use crate::scene::census::Census;

/// A glyph that is stored.
struct Glyph {
    mesh: TriangleMesh,
    materials: MaterialsBy,
    /// The number of its surface.
    surface: u32,
    /// The number of its prototype.
    prototype: u32,
}

/// The glyphs that are stored, by the hash of their positions.
#[derive(Default)]
pub(super) struct StoredGlyphs(HashMap<u64, Vec<Glyph>>);

impl<'a> Compiler<'a> {
    /// Draws the glyphs of the text that was just drawn, if they were deferred.
    pub(super) fn end_text(&mut self, node: NodeRef<'a>, state: &State<'a>) {
        let Some(deferred) = &mut self.builder.deferred else {
            return;
        };
        if deferred.placed.is_empty() {
            return;
        }
        let text = std::mem::replace(deferred, DeferredText::new());
        let surface = self.builder.last_surface();
        let prototypes: Vec<Option<u32>> = text
            .glyphs
            .iter()
            .map(|glyph| self.prototype_of(glyph, text.materials, surface))
            .collect();
        for (i, (glyph, at)) in text.placed.iter().enumerate() {
            let is_empty = text.glyphs[*glyph as usize].triangles.is_empty();
            if is_empty || self.builder.over_limit {
                continue;
            }
            let prototype = prototypes[*glyph as usize];
            if !prototype.is_some_and(|number| self.draw_glyph(number, *at, state)) {
                return self.expand_text(&text, i, surface, (node, state));
            }
        }
    }

    /// Draws a glyph with its origin at a place. Returns `false` if it is to be expanded.
    fn draw_glyph(&mut self, prototype: u32, at: Vec2, state: &State<'a>) -> bool {
        let offset = glyph_offset(at);
        let Some(mut matrices) = self.matrices(state) else {
            return false;
        };
        match self.builder.is_recording {
            true => matrices.push(offset),
            false => matrices[0] *= offset,
        }
        self.draw(prototype, None, &matrices)
    }

    /// Draws the glyphs of a text from one on where they are, because they cannot be placed later.
    fn expand_text(
        &mut self,
        text: &DeferredText,
        from: usize,
        surface: u32,
        (node, state): (NodeRef<'a>, &State<'a>),
    ) {
        let builder = &mut self.builder;
        if builder.is_recording {
            builder.spoiled = true;
            return;
        }
        let bad = builder.scene.census.bad_corners;
        builder.assign_surface();
        let before = builder.lengths();
        builder.copy_surface(surface);
        for (glyph, at) in &text.placed[from..] {
            builder.keep_glyph(&text.glyphs[*glyph as usize], *at, text.materials);
        }
        if builder.scene.census.bad_corners > bad {
            builder.report_bad_parts(node);
        }
        self.end_shape(before, state);
    }

    /// Returns the number of a glyph's prototype, which is made at its first use, or `None` if the
    /// glyph has none because it is empty or not finite.
    fn prototype_of(
        &mut self,
        mesh: &TriangleMesh,
        materials: MaterialsBy,
        surface: u32,
    ) -> Option<u32> {
        if mesh.triangles.is_empty() || !mesh.is_sound() {
            return None;
        }
        let hash = hash(mesh);
        let surfaces = &self.builder.scene.surfaces;
        let is_it = |known: &&Glyph| {
            let look = &surfaces[known.surface as usize];
            let is_equal = known.materials == materials && known.mesh == *mesh;
            is_equal && look.has_look_of(&surfaces[surface as usize])
        };
        let stored = &mut self.instances.glyphs.0;
        if let Some(known) = stored.get(&hash).and_then(|all| all.iter().find(is_it)) {
            return Some(known.prototype);
        }
        let (own, prototype) = self.record_glyph(mesh, materials, surface);
        self.builder.memory.count(mesh.bytes());
        let stored = &mut self.instances.glyphs.0;
        stored.entry(hash).or_default().push(Glyph {
            mesh: mesh.clone(),
            materials,
            surface: own,
            prototype,
        });
        Some(prototype)
    }

    /// Stores a glyph as a prototype. Returns the numbers of its surface and of the prototype.
    fn record_glyph(
        &mut self,
        mesh: &TriangleMesh,
        materials: MaterialsBy,
        surface: u32,
    ) -> (u32, u32) {
        let builder = &mut self.builder;
        builder.assign_surface();
        let is_inside = std::mem::replace(&mut builder.is_recording, true);
        let placement = builder.placement;
        builder.placement = placement.deferred();
        let before = builder.lengths();
        builder.copy_surface(surface);
        let own = builder.last_surface();
        builder.keep_mesh(mesh, materials);
        builder.assign_surface();
        builder.placement = placement;
        let recording = Recording::new(Step::start());
        let outside = std::mem::replace(&mut self.instances.recording, recording);
        self.keep_shape(before, Some(Vec::new()));
        self.builder.is_recording = is_inside;
        let recording = std::mem::replace(&mut self.instances.recording, outside);
        let mut glyph = recording.contents;
        glyph.is_glyph = true;
        (own, self.instances.keep(glyph, Census::default()))
    }
}

/// Returns a hash of the positions of a mesh.
fn hash(mesh: &TriangleMesh) -> u64 {
    let mut hasher = DefaultHasher::new();
    mesh.triangles.len().hash(&mut hasher);
    for p in &mesh.positions {
        p.to_array().map(f32::to_bits).hash(&mut hasher);
    }
    hasher.finish()
}

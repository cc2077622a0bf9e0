//! Counts of what a scene contains, what was drawn, and what was left out and why.

use indexmap::IndexMap;

use crate::diag::Diagnostic;
use crate::iv::NodeRef;

/// Counts of nodes and primitives. Classes are in the order of their first node.
#[derive(Clone, Debug, Default)]
pub struct Census {
    /// The number of nodes of each class.
    pub seen: IndexMap<&'static str, u64>,
    /// The number of drawn shapes of each class.
    pub drawn: IndexMap<&'static str, u64>,
    /// The number of ignored shapes and properties of each class, with the reason.
    pub ignored: IndexMap<&'static str, (u64, &'static str)>,
    /// The number of triangles kept.
    pub triangles: u64,
    /// The number of exact round surfaces kept.
    pub quadrics: u64,
    /// The number of lines and points kept.
    pub strokes: u64,
    /// The number of lights that light a shape.
    pub lights: u64,
    /// The number of lights that are on, whether they light a shape or not.
    pub lights_seen: u64,
    /// The number of shape nodes that the walk does not reach, such as those of a `Switch` that is
    /// off.
    pub shapes_unreached: u64,
    /// The number of textures decoded.
    pub textures: u64,
    /// The number of shapes whose texture this picture does not need.
    pub textures_left_out: u64,
    /// Whether any surface is transparent.
    pub transparent: bool,
    /// The number of corners that were not finite and of indices out of range.
    pub bad_corners: u64,
    /// The diagnostics of compiling.
    pub diagnostics: Vec<Diagnostic>,
}

impl Census {
    /// Counts a node of a walk.
    pub(super) fn see_node(&mut self, node: NodeRef<'_>, handles_are_drawn: bool) {
        if let Some(class) = node.known_class() {
            self.see(class.name);
            let dragged = class.name.ends_with("Dragger") || class.name.ends_with("Manip");
            if dragged && !handles_are_drawn {
                self.ignore(class.name, "handles are not drawn without `--handles`");
            }
        }
    }

    /// Counts a node of a class.
    pub(crate) fn see(&mut self, class: &'static str) {
        *self.seen.entry(class).or_default() += 1;
    }

    /// Counts a drawn shape of a class.
    pub(crate) fn draw(&mut self, class: &'static str) {
        *self.drawn.entry(class).or_default() += 1;
    }

    /// Counts an ignored node of a class, with the reason.
    pub(crate) fn ignore(&mut self, class: &'static str, why: &'static str) {
        self.ignored.entry(class).or_insert((0, why)).0 += 1;
    }

    /// Returns what was left out, one text for each kind: `3 textures (not read by this shading)`,
    /// `14 TimeSensor (never drawn)`.
    pub fn left_out(&self) -> Vec<String> {
        let mut parts = Vec::new();
        if self.textures_left_out > 0 {
            parts.push(format!(
                "{} textures (not read by this shading)",
                self.textures_left_out
            ));
        }
        for (class, (count, why)) in &self.ignored {
            parts.push(format!("{count} {class} ({why})"));
        }
        parts
    }
}

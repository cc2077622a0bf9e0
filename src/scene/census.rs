//! What a scene holds, what was drawn of it, and what was left out and why.

use indexmap::IndexMap;

use crate::diag::Diagnostic;
use crate::iv::NodeRef;

/// Counts by class, in the order in which classes were first met.
#[derive(Clone, Debug, Default)]
pub struct Census {
    /// Nodes met, by class.
    pub seen: IndexMap<&'static str, u64>,
    /// Shapes drawn, by class.
    pub drawn: IndexMap<&'static str, u64>,
    /// Shapes and properties that were not, by class, with the reason.
    pub ignored: IndexMap<&'static str, (u64, &'static str)>,
    pub triangles: u64,
    pub quadrics: u64,
    pub strokes: u64,
    pub lights: u64,
    pub textures: u64,
    /// Textures that this picture does not read.
    pub textures_left_out: u64,
    /// Whether anything lets light through.
    pub transparent: bool,
    /// Corners that were not numbers, and indices out of range.
    pub bad_corners: u64,
    /// What compiling had to say.
    pub diagnostics: Vec<Diagnostic>,
}

impl Census {
    /// Counts a node that a walk meets.
    pub(super) fn see_node(&mut self, node: NodeRef<'_>, handles_are_drawn: bool) {
        if let Some(class) = node.known_class() {
            self.see(class.name);
            let dragged = class.name.ends_with("Dragger") || class.name.ends_with("Manip");
            if dragged && !handles_are_drawn {
                self.ignore(class.name, "handles are not drawn without `--handles`");
            }
        }
    }

    pub(crate) fn see(&mut self, class: &'static str) {
        *self.seen.entry(class).or_default() += 1;
    }

    pub(crate) fn draw(&mut self, class: &'static str) {
        *self.drawn.entry(class).or_default() += 1;
    }

    pub(crate) fn ignore(&mut self, class: &'static str, why: &'static str) {
        self.ignored.entry(class).or_insert((0, why)).0 += 1;
    }

    /// `left out: 3 textures (not read by this shading), 14 TimeSensor (never drawn)`.
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

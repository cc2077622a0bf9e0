//! Counts of what a scene contains, what was drawn, and what was left out and why.

use indexmap::IndexMap;
use ivcam_base::diag::Diagnostic;
use ivcam_inventor::iv::NodeRef;

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
    /// The numbers of prototypes, of instances, and of the primitives of all instances. All are 0
    /// if the scene is expanded.
    pub instances: InstanceCounts,
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

/// How much of a scene is stored once and drawn many times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InstanceCounts {
    /// The number of prototypes.
    pub prototypes: u64,
    /// The number of instances, inside others too.
    pub placed: u64,
    /// The number of primitives of the scene, each as often as it is drawn.
    pub primitives: u64,
}

/// Adds 1 to a sum, which a part that is drawn very often may have brought to its end.
fn add_one(sum: &mut u64) {
    *sum = sum.saturating_add(1);
}

impl Census {
    /// Adds what a part keeps, which counts once however often the part is drawn.
    pub(super) fn add_kept(&mut self, part: &Self) {
        self.triangles += part.triangles;
        self.quadrics += part.quadrics;
        self.strokes += part.strokes;
        self.textures += part.textures;
        self.transparent |= part.transparent;
    }

    /// Adds what a part draws, a number of times.
    pub(super) fn add_drawn(&mut self, part: &Self, times: u64) {
        let add = |sum: &mut u64, n: u64| *sum = sum.saturating_add(n.saturating_mul(times));
        for (class, n) in &part.seen {
            add(self.seen.entry(class).or_default(), *n);
        }
        for (class, n) in &part.drawn {
            add(self.drawn.entry(class).or_default(), *n);
        }
        for (class, (n, why)) in &part.ignored {
            add(&mut self.ignored.entry(class).or_insert((0, why)).0, *n);
        }
        add(&mut self.textures_left_out, part.textures_left_out);
        add(&mut self.bad_corners, part.bad_corners);
    }

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
        add_one(self.seen.entry(class).or_default());
    }

    /// Counts a drawn shape of a class.
    pub(crate) fn draw(&mut self, class: &'static str) {
        add_one(self.drawn.entry(class).or_default());
    }

    /// Counts an ignored node of a class, with the reason.
    pub(crate) fn ignore(&mut self, class: &'static str, why: &'static str) {
        add_one(&mut self.ignored.entry(class).or_insert((0, why)).0);
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

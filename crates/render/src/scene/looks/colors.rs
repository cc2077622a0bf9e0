//! The colors of a shape's materials, from the traversal state.

use glam::Vec3;
use ivcam_inventor::traversal::state::{AlphaMode, Binding, Diffuse, State};

/// The colors of a shape that may vary between its parts, and those that a highlight changes.
#[derive(Clone, Debug)]
pub(crate) struct MaterialColors {
    /// The diffuse colors, at least one.
    pub diffuse: Vec<Vec3>,
    /// The transparencies from 0 to 1, at least one.
    pub transparency: Vec<f32>,
    /// The emissive color.
    pub emissive: Vec3,
}

impl MaterialColors {
    /// Returns the colors of a shape with a state.
    pub(crate) fn of(state: &State<'_>) -> Self {
        let m = &state.material;
        let (mut diffuse, mut transparency) = match m.diffuse {
            Diffuse::Packed(_) | Diffuse::Rgba(_) => {
                let n = m.diffuse_count();
                (
                    (0..n).map(|i| m.diffuse_at(i)).collect::<Vec<_>>(),
                    (0..n).map(|i| m.transparency_at(i)).collect::<Vec<_>>(),
                )
            }
            Diffuse::Colors(c) => (
                (0..c.len()).map(|i| c.at(i)).collect(),
                (0..m.transparency.len())
                    .map(|i| m.transparency.at(i))
                    .collect(),
            ),
        };
        if state.material_binding == Binding::Overall {
            diffuse.truncate(1);
            transparency.truncate(1);
        }
        for color in &mut diffuse {
            *color = m.shown(*color);
        }
        for t in &mut transparency {
            *t = if t.is_finite() {
                t.clamp(0.0, 1.0)
            } else {
                0.0
            };
        }
        let mut emissive = m.emissive;
        if let Some(highlight) = state.highlight {
            emissive = highlight.color;
            if highlight.diffuse_too {
                diffuse = vec![highlight.color];
            }
        }
        Self {
            diffuse,
            transparency,
            emissive,
        }
    }

    /// Whether parts have different opacities.
    pub(crate) fn has_opacities(&self) -> bool {
        self.transparency.iter().any(|t| *t != self.transparency[0])
    }

    /// Returns the colors with transparencies as the meaning of the opacity has them.
    pub(crate) fn into_seen(mut self, alpha: AlphaMode) -> Self {
        for t in &mut self.transparency {
            *t = alpha.seen_transparency(*t);
        }
        self
    }
}

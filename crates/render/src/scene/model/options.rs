//! The options of making a model.

use crate::scene::options::CompileOptions;

/// The options of making a model.
#[derive(Clone, Debug)]
pub struct ModelOptions {
    /// The largest distance of a triangle from a round surface as a fraction of its radius, of a
    /// letter's edge as a fraction of its size, and of a NURBS surface as a fraction of its control
    /// net. Default: 0.005. It is limited to 0.0001 to 0.1. Text and NURBS keep the scene's
    /// `Complexity` where that is finer.
    pub tolerance: f64,
    /// Whether a scene whose distance from the origin is more than 1000 times its size is moved to
    /// the origin. Default: yes.
    pub recenter: bool,
    /// The options that pictures have too: limits, folders of textures, and typefaces. Shapes with
    /// a size in pixels are made for its camera, or for the scene's first one.
    pub compile: CompileOptions,
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.005,
            recenter: true,
            compile: CompileOptions::default(),
        }
    }
}

impl ModelOptions {
    /// The tolerance within its limits.
    pub(crate) fn error(&self) -> f64 {
        if self.tolerance.is_finite() {
            self.tolerance.clamp(1e-4, 0.1)
        } else {
            0.005
        }
    }

    /// The complexity at which text and NURBS are within the tolerance: text is off by at most
    /// 0.01 · 0.005^c of its size, NURBS by at most 0.004 · 0.02^c of the size of their net.
    pub(crate) fn complexity(&self) -> f32 {
        let error = self.error();
        let text = libm::log(error / 0.01) / libm::log(0.005);
        let nurbs = libm::log(error / 0.004) / libm::log(0.02);
        text.max(nurbs).clamp(0.0, 1.0) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_tolerance_needs_a_larger_complexity() {
        let at = |tolerance| {
            let options = ModelOptions {
                tolerance,
                ..ModelOptions::default()
            };
            options.complexity()
        };
        let c = at(0.001);
        assert!((f64::from(c) - 0.4346).abs() < 1e-3, "{c}");
        assert!(at(0.0005) > c && at(0.005) < c);
        assert_eq!(at(f64::NAN), at(0.005));
    }
}

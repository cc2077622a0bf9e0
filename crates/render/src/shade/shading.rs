//! The shading models, with their names and Ivray's letters.

use crate::scene::Needs;

/// A shading model: how the color of a visible point is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Shading {
    /// Letter `f`: the diffuse color without lighting.
    Flat,
    /// Letter `n`: the normal, shown as a color.
    Normal,
    /// Letter `a`: emissive and ambient light only.
    Ambient,
    /// Letter `d`: emissive, ambient and diffuse light.
    Diffuse,
    /// Letter `p`: emissive, ambient, diffuse and specular light, without shadows.
    #[default]
    Phong,
    /// Letter `g`: the light of `p` as an OpenGL program computes it. The corners of the triangles
    /// are lit, and their colors are interpolated.
    Gl,
    /// Letter `r`: the light of `p` with shadows, reflection and refraction.
    Recursive,
    /// Letter `i`: light on all its ways, also from surface to surface, by path tracing.
    Path,
}

impl Shading {
    /// All models, in the order of the help text.
    pub const ALL: [Self; 8] = [
        Self::Flat,
        Self::Normal,
        Self::Ambient,
        Self::Diffuse,
        Self::Phong,
        Self::Gl,
        Self::Recursive,
        Self::Path,
    ];

    /// The letter that Ivray gives to the model.
    pub fn letter(self) -> char {
        match self {
            Self::Flat => 'f',
            Self::Normal => 'n',
            Self::Ambient => 'a',
            Self::Diffuse => 'd',
            Self::Phong => 'p',
            Self::Gl => 'g',
            Self::Recursive => 'r',
            Self::Path => 'i',
        }
    }

    /// The model's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Normal => "normal",
            Self::Ambient => "ambient",
            Self::Diffuse => "diffuse",
            Self::Phong => "phong",
            Self::Gl => "gl",
            Self::Recursive => "recursive",
            Self::Path => "path",
        }
    }

    /// Returns the model with a letter or a name.
    pub fn named(text: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|s| s.name() == text || text.chars().eq([s.letter()]))
    }

    /// The parts of a scene that the model uses.
    pub fn needs(self) -> Needs {
        let lit = match self {
            Self::Flat | Self::Normal | Self::Ambient => false,
            Self::Diffuse | Self::Phong | Self::Gl | Self::Recursive | Self::Path => true,
        };
        Needs {
            normals: lit || self == Self::Normal,
            materials: self != Self::Normal,
            lights: lit,
            textures: self != Self::Normal,
            secondary: matches!(self, Self::Recursive | Self::Path),
            facets: self == Self::Gl,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_is_known_by_its_letter_and_its_name() {
        for model in Shading::ALL {
            assert_eq!(Shading::named(&model.letter().to_string()), Some(model));
            assert_eq!(Shading::named(model.name()), Some(model));
        }
    }
}

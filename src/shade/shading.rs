//! The shading models, by name and by Ivray's letters.

use crate::scene::Needs;

/// What a picture shows of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Shading {
    /// `f`: the diffuse color, unlit.
    Flat,
    /// `n`: the normal as a color.
    Normal,
    /// `a`: emissive and ambient light only.
    Ambient,
    /// `d`: emissive, ambient and diffuse light.
    Diffuse,
    /// `p`: with specular light too; no shadows.
    #[default]
    Phong,
    /// `g`: as `p`, drawn as an OpenGL program draws: the corners of the triangles are lit, and
    /// their colors are interpolated between them.
    Gl,
    /// `r`: with shadows, reflection and refraction.
    Recursive,
}

impl Shading {
    pub const ALL: [Self; 7] = [
        Self::Flat,
        Self::Normal,
        Self::Ambient,
        Self::Diffuse,
        Self::Phong,
        Self::Gl,
        Self::Recursive,
    ];

    pub fn letter(self) -> char {
        match self {
            Self::Flat => 'f',
            Self::Normal => 'n',
            Self::Ambient => 'a',
            Self::Diffuse => 'd',
            Self::Phong => 'p',
            Self::Gl => 'g',
            Self::Recursive => 'r',
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Normal => "normal",
            Self::Ambient => "ambient",
            Self::Diffuse => "diffuse",
            Self::Phong => "phong",
            Self::Gl => "gl",
            Self::Recursive => "recursive",
        }
    }

    /// By letter or by name.
    pub fn named(text: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|s| s.name() == text || text.chars().eq([s.letter()]))
    }

    pub fn needs(self) -> Needs {
        let lit = matches!(
            self,
            Self::Diffuse | Self::Phong | Self::Gl | Self::Recursive
        );
        Needs {
            normals: lit || self == Self::Normal,
            materials: self != Self::Normal,
            lights: lit,
            textures: self != Self::Normal,
            secondary: self == Self::Recursive,
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

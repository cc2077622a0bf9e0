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
    /// `r`: with shadows, reflection and refraction.
    Recursive,
}

impl Shading {
    pub const ALL: [Self; 6] = [
        Self::Flat,
        Self::Normal,
        Self::Ambient,
        Self::Diffuse,
        Self::Phong,
        Self::Recursive,
    ];

    pub fn letter(self) -> char {
        match self {
            Self::Flat => 'f',
            Self::Normal => 'n',
            Self::Ambient => 'a',
            Self::Diffuse => 'd',
            Self::Phong => 'p',
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
        let lit = matches!(self, Self::Diffuse | Self::Phong | Self::Recursive);
        Needs {
            normals: lit || self == Self::Normal,
            materials: self != Self::Normal,
            lights: lit,
            textures: self != Self::Normal,
            secondary: self == Self::Recursive,
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

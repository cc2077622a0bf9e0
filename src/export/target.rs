//! The formats that scenes can be written in, and the features that they can hold.

use std::path::Path;

use ivcam_render::scene::model::Feature;

/// A format of other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Target {
    /// glTF 2.0 in binary.
    Glb,
    /// glTF 2.0 as JSON, with everything in one file.
    Gltf,
    /// Wavefront OBJ, with a library of materials beside it.
    Obj,
    /// PLY in binary, with colors of vertices.
    Ply,
    /// X3D 3.3 or 4.0 in its XML encoding.
    X3d,
    /// VRML97.
    Vrml97,
    /// Inventor V2.1 as text.
    Inventor,
    /// USD as text, with pictures beside it.
    Usda,
}

impl Target {
    /// All targets, in the order of the help.
    pub const ALL: &[Self] = &[
        Self::Glb,
        Self::Gltf,
        Self::X3d,
        Self::Vrml97,
        Self::Inventor,
        Self::Obj,
        Self::Ply,
        Self::Usda,
    ];

    /// The target's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Glb => "glb",
            Self::Gltf => "gltf",
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::X3d => "x3d",
            Self::Vrml97 => "vrml97",
            Self::Inventor => "inventor",
            Self::Usda => "usda",
        }
    }

    /// The endings of the names of files, of which the first is the usual one.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Glb => &["glb"],
            Self::Gltf => &["gltf"],
            Self::Obj => &["obj"],
            Self::Ply => &["ply"],
            Self::X3d => &["x3d"],
            Self::Vrml97 => &["wrl", "vrml"],
            Self::Inventor => &["iv"],
            Self::Usda => &["usda"],
        }
    }

    /// Returns the target with a name.
    pub fn named(name: &str) -> Option<Self> {
        let mut all = Self::ALL.iter().copied();
        all.find(|target| target.name().eq_ignore_ascii_case(name))
    }

    /// Returns the target of a file, by the ending of its name.
    pub fn of_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?;
        let mut all = Self::ALL.iter().copied();
        all.find(|target| {
            let mut endings = target.endings().iter();
            endings.any(|e| e.eq_ignore_ascii_case(ending))
        })
    }

    /// The format's name in sentences.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Glb | Self::Gltf => "glTF",
            Self::Obj => "OBJ",
            Self::Ply => "PLY",
            Self::X3d => "X3D",
            Self::Vrml97 => "VRML97",
            Self::Inventor => "Inventor",
            Self::Usda => "USD",
        }
    }

    /// Whether files of the format need others beside them, so that they cannot be written to a
    /// pipe.
    pub fn has_files_beside(self) -> bool {
        matches!(self, Self::Obj | Self::Usda)
    }

    /// Whether the format's highlights depend on the place of the viewer. OBJ leaves it open.
    pub(crate) fn has_near_viewer(self) -> bool {
        !matches!(self, Self::Inventor | Self::Obj | Self::Ply)
    }

    /// Whether the format can hold a feature.
    pub fn holds(self, feature: Feature) -> bool {
        let surfaces = matches!(
            feature,
            Feature::Texture
                | Feature::TextureRepeat
                | Feature::VertexColors
                | Feature::Shading
                | Feature::LinesAndPoints
        );
        let scenes = matches!(
            feature,
            Feature::Light | Feature::Camera | Feature::Hierarchy | Feature::Offset
        );
        let leaves_light = matches!(self, Self::Obj | Self::Ply | Self::Inventor);
        match self {
            _ if feature == Feature::OneSidedLight => leaves_light,
            Self::Glb | Self::Gltf => {
                let others = matches!(
                    feature,
                    Feature::Motion
                        | Feature::OneSided
                        | Feature::TextureFilter
                        | Feature::LitLines
                );
                surfaces || scenes || others
            }
            Self::Usda => {
                let others = matches!(
                    feature,
                    Feature::Motion | Feature::OneSided | Feature::ColorRange | Feature::LitLines
                );
                surfaces || scenes || others
            }
            Self::Obj => {
                let others = matches!(feature, Feature::AmbientColor | Feature::ColorRange);
                surfaces && feature != Feature::TextureRepeat || others
            }
            Self::Ply => feature == Feature::VertexColors,
            Self::X3d | Self::Vrml97 | Self::Inventor => {
                let is_lighting = matches!(
                    feature,
                    Feature::LightFalloff | Feature::AmbientColor | Feature::AmbientLight
                );
                // The writer of X3D reports the colors that it limits.
                let keeps_colors = feature == Feature::ColorRange && self != Self::Vrml97;
                let in_inventor = matches!(feature, Feature::TextureFilter | Feature::LitLines);
                let is_kept = keeps_colors || in_inventor && self == Self::Inventor;
                surfaces || scenes || is_lighting || is_kept || feature == Feature::OneSided
            }
        }
    }
}

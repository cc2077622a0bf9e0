//! What a scene uses that a model, or a format, cannot hold.

use std::sync::Arc;

use ivcam_base::diag::{Source, Span};
use ivcam_inventor::iv::NodeRef;

/// A node in a file, for reports.
#[derive(Clone, Debug, Default)]
pub struct Place {
    /// The name of the node's class.
    pub class: String,
    /// The name after `DEF`.
    pub name: Option<String>,
    /// The file and the range of bytes, if the node is in a file.
    pub at: Option<(Arc<Source>, Span)>,
}

impl PartialEq for Place {
    fn eq(&self, other: &Self) -> bool {
        let span = |place: &Self| place.at.as_ref().map(|(_, span)| *span);
        self.class == other.class && self.name == other.name && span(self) == span(other)
    }
}

impl Place {
    /// The place of a node.
    pub fn of(node: NodeRef<'_>) -> Self {
        Self {
            class: node.class_name().to_owned(),
            name: node.data().name.as_deref().map(str::to_owned),
            at: node.source().map(|source| (source.clone(), node.span())),
        }
    }

    /// The file's name.
    pub fn file(&self) -> Option<&str> {
        self.at.as_ref().map(|(source, _)| source.name.as_str())
    }

    /// The line, counted from 1, or `None` in a binary file.
    pub fn line(&self) -> Option<u32> {
        let (source, span) = self.at.as_ref().filter(|(source, _)| !source.binary)?;
        Some(source.line_column(span.start).0)
    }
}

/// A feature of a node, with the number of its uses.
#[derive(Clone, Debug, PartialEq)]
pub struct Occurrence {
    /// The feature.
    pub feature: Feature,
    /// The node.
    pub place: Place,
    /// The number of uses of the node.
    pub count: u64,
    /// Whether the file states the feature. Otherwise it is a default of the file's language.
    pub stated: bool,
}

/// A node, or a field of it, that the program does not apply, neither in pictures nor in models.
#[derive(Clone, Debug, PartialEq)]
pub struct NotApplied {
    /// The node.
    pub place: Place,
    /// What the model lacks, in lower case.
    pub text: String,
    /// The number of uses of the node.
    pub count: u64,
}

/// Declares the features with their names in reports and their sentences.
macro_rules! features {
    ($($(#[$doc:meta])* $variant:ident, $code:literal, $text:literal;)*) => {
        /// What a scene uses and not every format can hold.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum Feature {
            $($(#[$doc])* $variant,)*
        }

        impl Feature {
            /// Every feature.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// The feature's name in reports for programs.
            pub fn code(self) -> &'static str {
                match self { $(Self::$variant => $code,)* }
            }

            /// What the other format gets instead of the feature, in lower case.
            pub fn text(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }
        }
    };
}

features! {
    /// A `Fog`, or the fog of an `Environment`.
    Fog, "fog", "fog is left out";
    /// A `Background`.
    Background, "background", "the background is left out";
    /// The ambient color of a material.
    AmbientColor, "ambient-color", "the ambient color is left out";
    /// Ambient light of the scene.
    AmbientLight, "ambient-light",
        "the ambient light is left out; add a weak light from all sides where it is shown";
    /// Diffuse colors above 1.
    ColorRange, "color-range", "colors are limited to the range from 0 to 1";
    /// Faces that are seen from one side only, although their backs could be seen.
    OneSided, "one-sided", "both sides of the faces are seen; leave out backs where it is shown";
    /// Faces that Inventor lights by their normals alone, although their backs could be seen.
    OneSidedLight, "one-sided-light",
        "both sides of faces are lit; without a `vertexOrdering` Inventor lights the one of the normal";
    /// Lines wider than a pixel.
    LineWidth, "line-width", "the width of lines is left out";
    /// Dashed lines.
    LinePattern, "line-pattern", "dashed lines are written whole";
    /// Points larger than a pixel.
    PointSize, "point-size", "the size of points is left out";
    /// Lines and points with normals, which Inventor lights.
    LitLines, "lit-lines", "lines and points are shown without lighting";
    /// Lines and points.
    LinesAndPoints, "lines-and-points", "lines and points are left out";
    /// A light.
    Light, "light", "the light is left out";
    /// A light that does not shine on every shape.
    LightScope, "light-scope", "the light shines on every shape, and not only on some";
    /// A light that falls off with distance otherwise than by the inverse square.
    LightFalloff, "light-falloff", "the light falls off by the inverse square of the distance";
    /// A spot light with a falloff that the format cannot express.
    SpotFalloff, "spot-falloff", "the falloff inside the spot light's cone is approximated";
    /// A camera.
    Camera, "camera", "the camera is left out";
    /// A texture.
    Texture, "texture", "the texture is left out";
    /// A texture that is repeated in one direction only.
    TextureRepeat, "texture-repeat", "the texture is repeated in both directions";
    /// A texture whose texels are shown as squares.
    TextureFilter, "texture-filter", "the texture is interpolated between its texels";
    /// A texture that shows the surroundings.
    EnvironmentTexture, "environment-texture", "the reflection texture is left out";
    /// A texture with a depth.
    DeepTexture, "deep-texture", "the 3D texture is left out";
    /// A texture of a `TextureUnit` other than the first.
    FurtherTexture, "further-texture", "only the texture of the first unit is written";
    /// A texture that is combined with colors in a way that the format cannot express.
    TextureBlend, "texture-blend", "the texture's model is approximated";
    /// Colors by vertex or by face.
    VertexColors, "vertex-colors", "the colors of vertices are left out";
    /// A material's specular, emissive or transparent part.
    Shading, "shading", "the material is reduced to a color";
    /// Levels of detail.
    Levels, "levels", "only the finest level of detail is written";
    /// Children that a switch hides.
    HiddenChildren, "hidden-children", "the children that are not shown are left out";
    /// The children of a `Blinker`.
    BlinkingChildren, "hidden-children",
        "only the child that is shown at the beginning is written, and stays shown";
    /// A shape with the draw style `INVISIBLE`.
    InvisibleShape, "invisible-shape", "the invisible shape is left out";
    /// A billboard.
    Billboard, "billboard", "the billboard is turned once, toward the first camera";
    /// A shape with a size in pixels.
    ScreenAligned, "screen-aligned", "the size in pixels is that from the first camera";
    /// A clip plane.
    ClipPlane, "clip-plane", "the clip plane is left out";
    /// Shapes that are drawn over everything else.
    OnTop, "on-top", "the shape is not drawn over the others";
    /// A polygon offset.
    PolygonOffset, "polygon-offset", "the polygon offset is left out";
    /// Geometry, materials or other values that change with time.
    ChangingValue, "changing-value", "the values that change with time are written once";
    /// A node, a camera or a light that moves.
    Motion, "motion", "the motion is left out";
    /// A node that reacts to the user: a sensor, an anchor, a dragger.
    Interaction, "interaction", "the reaction to the user is left out";
    /// A script.
    Script, "script", "the script is left out";
    /// A sound.
    Sound, "sound", "the sound is left out";
    /// A node of a class that is not known.
    UnknownNode, "unknown-node", "the node of an unknown class is left out";
    /// The tree of groups.
    Hierarchy, "hierarchy", "the tree of groups is reduced to a list";
    /// The distance by which a scene was moved to the origin.
    Offset, "offset", "the scene is moved to the origin; the offset is kept in a comment where the format has comments";
}

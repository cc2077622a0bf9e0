//! The traversal state: what the nodes above and to the left say about a shape.
//!
//! Elements are small and `Copy`, or slices that borrow from the document, so a `Separator` keeps
//! the state by copying it. Names and rules are Inventor's; where SGI's and Coin's libraries
//! differ the comment says whom we follow.

use std::sync::Arc;

use glam::{DMat4, DVec3, Vec2, Vec3, Vec4};

use crate::grammar::material_binding;
use crate::grammar::value::NodeId;
use crate::iv::{Document, NodeRef};

/// One value for a whole shape, or a list with one value for each part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum List<'a, T> {
    One(T),
    Many(&'a [T]),
}

impl<'a, T: Copy> List<'a, T> {
    /// Wraps a slice, unless it is empty, which Inventor takes as no change.
    pub(crate) fn of(values: &'a [T]) -> Option<Self> {
        (!values.is_empty()).then_some(Self::Many(values))
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::One(_) => 1,
            Self::Many(v) => v.len(),
        }
    }

    /// Returns the value at an index, or the last one past the end, as Coin does.
    pub(crate) fn at(&self, index: usize) -> T {
        match self {
            Self::One(v) => *v,
            Self::Many(v) => v[index.min(v.len() - 1)],
        }
    }
}

/// Diffuse colors, either plain or packed as `0xrrggbbaa`, which holds the transparency too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Diffuse<'a> {
    Colors(List<'a, Vec3>),
    Packed(&'a [u32]),
}

/// The material element. Only diffuse color and transparency vary inside a shape; of the others
/// the first value counts, in SGI's 2.1 and in Coin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MaterialElement<'a> {
    pub ambient: Vec3,
    pub diffuse: Diffuse<'a>,
    pub specular: Vec3,
    pub emissive: Vec3,
    pub shininess: f32,
    pub transparency: List<'a, f32>,
    /// The index of refraction, from a field that files declare themselves. Default: 1.
    pub refraction: f32,
}

impl MaterialElement<'_> {
    pub(crate) const DEFAULT: Self = Self {
        ambient: Vec3::splat(0.2),
        diffuse: Diffuse::Colors(List::One(Vec3::splat(0.8))),
        specular: Vec3::ZERO,
        emissive: Vec3::ZERO,
        shininess: 0.2,
        transparency: List::One(0.0),
        refraction: 1.0,
    };

    pub(crate) fn diffuse_count(&self) -> usize {
        match self.diffuse {
            Diffuse::Colors(c) => c.len(),
            Diffuse::Packed(p) => p.len(),
        }
    }

    pub(crate) fn diffuse_at(&self, index: usize) -> Vec3 {
        match self.diffuse {
            Diffuse::Colors(c) => c.at(index),
            Diffuse::Packed(p) => unpack(p[index.min(p.len() - 1)]).0,
        }
    }

    pub(crate) fn transparency_at(&self, index: usize) -> f32 {
        match self.diffuse {
            Diffuse::Colors(_) => self.transparency.at(index),
            Diffuse::Packed(p) => unpack(p[index.min(p.len() - 1)]).1,
        }
    }
}

/// Returns the color and the transparency in `0xrrggbbaa`.
pub(crate) fn unpack(rgba: u32) -> (Vec3, f32) {
    let [r, g, b, a] = rgba.to_be_bytes().map(|byte| f32::from(byte) / 255.0);
    (Vec3::new(r, g, b), 1.0 - a)
}

/// How a list of materials or normals is distributed over a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Binding {
    Overall,
    PerPart,
    PerPartIndexed,
    PerFace,
    PerFaceIndexed,
    PerVertex,
    PerVertexIndexed,
}

impl Binding {
    /// Converts the enumeration's value in files, which materials and normals number alike.
    pub(crate) fn from_value(value: i32, default: Self) -> Self {
        match value {
            material_binding::VALUE_OVERALL => Self::Overall,
            material_binding::VALUE_PER_PART => Self::PerPart,
            material_binding::VALUE_PER_PART_INDEXED => Self::PerPartIndexed,
            material_binding::VALUE_PER_FACE => Self::PerFace,
            material_binding::VALUE_PER_FACE_INDEXED => Self::PerFaceIndexed,
            material_binding::VALUE_PER_VERTEX => Self::PerVertex,
            material_binding::VALUE_PER_VERTEX_INDEXED => Self::PerVertexIndexed,
            _ => default,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Coordinates<'a> {
    Three(&'a [Vec3]),
    Four(&'a [Vec4]),
}

impl Coordinates<'_> {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Three(c) => c.len(),
            Self::Four(c) => c.len(),
        }
    }

    /// Returns a point, divided by its weight if it has one.
    pub(crate) fn get(&self, index: usize) -> Option<Vec3> {
        match self {
            Self::Three(c) => c.get(index).copied(),
            Self::Four(c) => c.get(index).map(|p| {
                let w = if p.w == 0.0 { 1.0 } else { p.w };
                p.truncate() / w
            }),
        }
    }
}

/// Where texture coordinates come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TextureCoordinates<'a> {
    /// No node gives any, and each shape makes its own.
    Default,
    Two(&'a [Vec2]),
    Three(&'a [Vec3]),
    /// `TextureCoordinatePlane`, directions in object space.
    Plane {
        s: Vec3,
        t: Vec3,
    },
    /// `TextureCoordinateEnvironment`: a sphere map seen by the camera.
    Environment,
    /// `TextureCoordinateObject`: products with the point (x, y, z, 1) of object space.
    Object {
        s: Vec4,
        t: Vec4,
    },
    /// Wrapped around the box of a shape made of vertices; other shapes have coordinates of their own.
    Wrapped(Wrapping),
}

/// The solid that a texture is wrapped around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wrapping {
    /// `TextureCoordinateSphere`: by the angles about the origin.
    Sphere,
    /// `TextureCoordinateCylinder`: by the angle about y and the height, flat where a face looks
    /// up or down.
    Cylinder,
    /// `TextureCoordinateCube`: flat on the side that a face looks to.
    Cube,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VertexOrdering {
    Unknown,
    Clockwise,
    Counterclockwise,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShapeHints {
    pub ordering: VertexOrdering,
    /// The shape is closed (`SOLID`), so the backs of its faces are never seen.
    pub solid: bool,
    /// Every face is convex (`CONVEX`).
    pub convex: bool,
    pub crease_angle: f32,
}

impl ShapeHints {
    pub(crate) const DEFAULT: Self = Self {
        ordering: VertexOrdering::Unknown,
        solid: false,
        convex: true,
        crease_angle: 0.0,
    };

    /// Whether both sides of a face are lit: the order is known, and the shape is not closed.
    pub(crate) fn two_sided(&self) -> bool {
        self.ordering != VertexOrdering::Unknown && !self.solid
    }

    /// Whether faces seen from behind are left out: the order is known, and the shape is closed.
    pub(crate) fn culls(&self) -> bool {
        self.ordering != VertexOrdering::Unknown && self.solid
    }

    pub(crate) fn counterclockwise(&self) -> bool {
        self.ordering != VertexOrdering::Clockwise
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DrawStyle {
    Filled,
    Lines,
    Points,
    Invisible,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drawing {
    pub style: DrawStyle,
    /// Width of lines in pixels; 0 means 1.
    pub line_width: f32,
    /// Size of points in pixels; 0 means 1.
    pub point_size: f32,
    pub line_pattern: u16,
    /// `PolygonOffset`: 1 moves faces behind what lies in the same plane, −1 in front of it.
    pub offset: i8,
    /// The draw styles that the offset applies to, bits of `polygon_offset::STYLES_…`.
    pub offset_styles: i32,
}

impl Drawing {
    pub(crate) const DEFAULT: Self = Self {
        style: DrawStyle::Filled,
        line_width: 0.0,
        point_size: 0.0,
        line_pattern: 0xffff,
        offset: 0,
        offset_styles: 1,
    };
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FogKind {
    None,
    Haze,
    Fog,
    Smoke,
    /// VRML97: grows with the distance from the eye, and hides everything at the visibility range.
    Linear,
    Exponential,
}

/// Ambient light, the attenuation of lights with distance, and fog.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EnvironmentElement {
    pub ambient: Vec3,
    /// Quadratic, linear, constant: 1 / (a₀d² + a₁d + a₂).
    pub attenuation: Vec3,
    pub fog: FogKind,
    pub fog_color: Vec3,
    pub visibility: f32,
}

impl EnvironmentElement {
    pub(crate) const DEFAULT: Self = Self {
        ambient: Vec3::splat(0.2),
        attenuation: Vec3::new(0.0, 0.0, 1.0),
        fog: FogKind::None,
        fog_color: Vec3::ONE,
        visibility: 0.0,
    };
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    Directional,
    Point,
    Spot {
        /// Exponent over 128, as Inventor's `dropOffRate` is.
        drop_off: f32,
        cut_off: f32,
    },
    /// VRML97: the intensity falls from 1 inside `beam_width` to 0 at `cut_off`.
    Beam {
        beam_width: f32,
        cut_off: f32,
    },
}

/// A light in world space, in meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightElement {
    pub kind: LightKind,
    pub color: Vec3,
    pub intensity: f32,
    /// VRML97: the share of the light that is ambient.
    pub ambient: f32,
    pub position: DVec3,
    pub direction: DVec3,
    pub attenuation: Vec3,
    /// VRML97: the light reaches no farther than this.
    pub radius: f32,
    pub node: NodeId,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TextureModel {
    Modulate,
    Decal,
    Blend,
    Replace,
}

/// The current texture: the node that holds it. It is decoded only if a picture needs it.
#[derive(Clone, Copy)]
pub(crate) struct TextureElement<'a> {
    /// `Complexity`'s `textureQuality` as it was at the texture, not at the shape.
    pub quality: f32,
    /// Whether a `Texture3` repeats along its depth.
    pub repeat_r: bool,
    pub node: NodeRef<'a>,
    pub model: TextureModel,
    pub blend_color: Vec3,
    pub repeat_s: bool,
    pub repeat_t: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FontElement<'a> {
    pub name: &'a str,
    pub size: f32,
    /// Set by a `FontStyle`: family and style count, the name does not.
    pub is_style: bool,
    /// One of `font_style::FAMILY_…`.
    pub family: i32,
    /// Bits of `font_style::STYLE_…`.
    pub style: i32,
}

/// One profile of a `Text3` or NURBS shape: the node and the coordinates that it indexes.
#[derive(Clone, Copy)]
pub(crate) struct Profile<'a> {
    pub node: NodeRef<'a>,
    pub coordinates: ProfileCoordinates<'a>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ProfileCoordinates<'a> {
    Two(&'a [Vec2]),
    Three(&'a [Vec3]),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Complexity {
    pub value: f32,
    /// One of `complexity::TYPE_…`.
    pub kind: i32,
    pub texture_quality: f32,
}

/// How a `LocateHighlight` changes the materials below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Highlight {
    /// The emissive color that replaces the materials'.
    pub color: Vec3,
    /// Whether the color replaces the diffuse color too.
    pub diffuse_too: bool,
}

/// The language of a scene, whose rules differ in places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Language {
    Inventor,
    Vrml1,
    Vrml97,
}

impl Language {
    /// Returns the language that the document's header names.
    pub(crate) fn of(document: &Document) -> Self {
        match &document.format {
            f if f.starts_with("VRML V1") => Self::Vrml1,
            f if f.starts_with("VRML V2") => Self::Vrml97,
            _ => Self::Inventor,
        }
    }
}

/// Everything a shape inherits.
#[derive(Clone)]
pub(crate) struct State<'a> {
    /// Converts from the shape's own space to world space, in meters.
    pub world_from_object: DMat4,
    pub coordinates: Coordinates<'a>,
    pub normals: &'a [Vec3],
    pub normal_binding: Binding,
    pub material: MaterialElement<'a>,
    pub material_binding: Binding,
    pub texture: Option<TextureElement<'a>>,
    pub texture_matrix: glam::Mat4,
    pub texture_coordinates: TextureCoordinates<'a>,
    /// Whether texture coordinates are indexed by `coordIndex` or `textureCoordIndex`, not counted.
    pub texture_indexed: bool,
    pub hints: ShapeHints,
    /// Whether shapes show their diffuse color unlit (`LightModel` `BASE_COLOR`).
    pub base_color: bool,
    pub drawing: Drawing,
    /// Whether shapes cast shadows (`ShadowStyle`).
    pub casts_shadow: bool,
    /// Whether shapes are drawn over everything else (`Annotation`).
    pub on_top: bool,
    /// The highlight of the nearest `LocateHighlight` above that is on.
    pub highlight: Option<Highlight>,
    /// The current `TextureUnit`. Textures of units other than 0 are not drawn.
    pub texture_unit: i32,
    pub complexity: Complexity,
    pub font: FontElement<'a>,
    pub environment: EnvironmentElement,
    pub lights: Arc<Vec<LightElement>>,
    /// Half spaces of the world that shapes are cut by: p·normal ≥ distance is kept.
    pub clip_planes: Arc<Vec<(DVec3, f64)>>,
    pub profile_coordinates: ProfileCoordinates<'a>,
    pub profiles: Arc<Vec<Profile<'a>>>,
    /// The last `Switch`'s choice, for `SWITCH_INHERIT`.
    pub switch: i32,
    /// Meters in one unit of length.
    pub unit: f64,
    /// The language whose rules hold for shapes here.
    pub language: Language,
}

/// One point at the origin: what Inventor's coordinate element holds before any node sets it.
static NO_COORDINATES: [Vec3; 1] = [Vec3::ZERO];

impl State<'_> {
    pub(crate) fn new(language: Language) -> Self {
        Self {
            world_from_object: DMat4::IDENTITY,
            coordinates: Coordinates::Three(&NO_COORDINATES),
            normals: &[],
            normal_binding: Binding::PerVertexIndexed,
            material: MaterialElement::DEFAULT,
            material_binding: Binding::Overall,
            texture: None,
            texture_matrix: glam::Mat4::IDENTITY,
            texture_coordinates: TextureCoordinates::Default,
            texture_indexed: true,
            hints: ShapeHints {
                crease_angle: if language == Language::Vrml1 {
                    0.5
                } else {
                    0.0
                },
                ..ShapeHints::DEFAULT
            },
            base_color: false,
            drawing: Drawing::DEFAULT,
            casts_shadow: true,
            on_top: false,
            highlight: None,
            texture_unit: 0,
            complexity: Complexity {
                value: 0.5,
                kind: 0,
                texture_quality: 0.5,
            },
            font: FontElement {
                name: "defaultFont",
                // Coin's size before any node sets one. A `Font` that states no size has 10.
                size: 12.0,
                is_style: false,
                family: 0,
                style: 0,
            },
            environment: EnvironmentElement::DEFAULT,
            lights: Arc::default(),
            clip_planes: Arc::default(),
            profile_coordinates: ProfileCoordinates::Two(&[]),
            profiles: Arc::default(),
            switch: -1,
            unit: 1.0,
            language,
        }
    }
}

//! The traversal state: the elements that a shape inherits from the nodes before and above it.
//!
//! Elements are small and `Copy`, or slices that borrow from the document, so a `Separator` saves
//! the state by copying it. Names and rules are Inventor's. Where SGI's and Coin's libraries
//! differ, a comment names the one that is followed.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{DMat4, DVec3, Vec2, Vec3, Vec4};

use super::geo::{GeoOrigin, GeoPoints};
use super::light_list::LightList;
use super::steps::Step;
use crate::grammar::material_binding;
use crate::grammar::value::NodeId;
use crate::iv::{CREASE_ANGLE, Document, NodeRef, display_color};
use crate::snapshot::BoundNodes;

/// One value for a whole shape, or a list of values for its parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum List<'a, T> {
    /// One value for all parts.
    One(T),
    /// At least one value.
    Many(&'a [T]),
}

impl<'a, T: Copy> List<'a, T> {
    /// Wraps a slice; returns `None` for an empty one, which changes nothing in Inventor.
    pub(crate) fn of(values: &'a [T]) -> Option<Self> {
        (!values.is_empty()).then_some(Self::Many(values))
    }

    /// The number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::One(_) => 1,
            Self::Many(v) => v.len(),
        }
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the value at an index. An index past the end gives the last value, as in Coin.
    pub fn at(&self, index: usize) -> T {
        match self {
            Self::One(v) => *v,
            Self::Many(v) => v[index.min(v.len() - 1)],
        }
    }
}

/// Diffuse colors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Diffuse<'a> {
    /// RGB colors, with transparencies stored separately.
    Colors(List<'a, Vec3>),
    /// At least one color `0xrrggbbaa`, which includes the transparency.
    Packed(&'a [u32]),
    /// At least one color of X3D's `ColorRGBA`, whose fourth number is the opacity.
    Rgba(&'a [Vec4]),
}

/// How a surface reflects light by X3D's `PhysicalMaterial`, which is glTF's model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhysicalElement {
    /// How much of a metal the surface is, from 0 to 1.
    pub metallic: f32,
    /// The roughness from 0 to 1, whose square is the α of GGX.
    pub roughness: f32,
    /// The reflectance at normal incidence of the part that is no metal.
    pub dielectric: Vec3,
    /// The largest reflectance of that part at grazing angles, from 0 to 1: `specularStrength`.
    pub grazing: f32,
    /// The texture with factors of both numbers: the roughness in green, the metal in blue.
    pub factors: Option<NodeId>,
}

impl PhysicalElement {
    /// The share of a metal's color that Phong's model shows as diffuse color. A metal has none,
    /// and would be black in a scene without surroundings to mirror.
    pub const METAL_IN_PHONG: f32 = 0.5;

    /// The factor of the base color in Phong's diffuse color.
    pub fn diffuse_share(metallic: f32) -> f32 {
        1.0 - metallic * (1.0 - Self::METAL_IN_PHONG)
    }

    /// Returns Phong's specular color, in linear light, and exponent divided by 128, of the
    /// highlight with the height and width of the lobe: n = 2/α² − 2 and kₛ = F₀/(4α²).
    pub fn highlight(roughness: f32, reflectance: Vec3) -> (Vec3, f32) {
        let alpha = (roughness * roughness).clamp(1e-3, 1.0);
        let squared = alpha * alpha;
        let exponent = 2.0 / squared - 2.0;
        let specular = (reflectance / (4.0 * squared)).min(Vec3::ONE);
        (specular, (exponent / 128.0).clamp(0.0, 1.0))
    }
}

/// The material element. Only diffuse color and transparency vary within a shape. Of the other
/// fields only the first value is used, as in SGI's Inventor 2.1 and in Coin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialElement<'a> {
    /// The ambient color, unless `ambient_intensity` is set.
    pub ambient: Vec3,
    /// VRML97's `ambientIntensity`: the ambient color is this fraction of the diffuse color of each
    /// point, which colors and textures may replace.
    pub ambient_intensity: Option<f32>,
    /// The diffuse colors.
    pub diffuse: Diffuse<'a>,
    /// The specular color.
    pub specular: Vec3,
    /// The emissive color.
    pub emissive: Vec3,
    /// The specular exponent divided by 128.
    pub shininess: f32,
    /// The transparencies from 0 to 1, unused with packed colors.
    pub transparency: List<'a, f32>,
    /// The index of refraction, from an extension field that files declare. Default: 1.
    pub refraction: f32,
    /// X3D's physical material. The diffuse colors are then its base colors.
    pub physical: Option<PhysicalElement>,
    /// Whether the diffuse colors are linear light, and not the values of a screen.
    pub is_linear: bool,
    /// What the opacity means.
    pub alpha: AlphaMode,
    /// Whether the diffuse colors are those of computed light, which is not lit (VRML 1.0).
    pub is_unlit: bool,
}

impl MaterialElement<'_> {
    /// Inventor's default material.
    pub(crate) const DEFAULT: Self = Self {
        ambient: Vec3::splat(0.2),
        ambient_intensity: None,
        diffuse: Diffuse::Colors(List::One(Vec3::splat(0.8))),
        specular: Vec3::ZERO,
        emissive: Vec3::ZERO,
        shininess: 0.2,
        transparency: List::One(0.0),
        refraction: 1.0,
        physical: None,
        is_linear: false,
        alpha: AlphaMode::Blend,
        is_unlit: false,
    };

    /// Returns Phong's diffuse color for a color of the material, as a screen shows it.
    pub fn shown(&self, color: Vec3) -> Vec3 {
        let share = self
            .physical
            .map_or(1.0, |own| PhysicalElement::diffuse_share(own.metallic));
        match self.is_linear {
            true => display_color(share * color),
            false => color,
        }
    }

    /// Returns a physical material whose roughness and metal have factors, with Phong's values of
    /// its highlight.
    #[must_use]
    pub fn with_factors(mut self, roughness: f32, metallic: f32) -> Self {
        let Some(mut own) = self.physical else {
            return self;
        };
        own.roughness *= roughness;
        own.metallic *= metallic;
        let base = self.diffuse_at(0);
        let reflectance = own.dielectric.lerp(base, own.metallic);
        let (specular, shininess) = PhysicalElement::highlight(own.roughness, reflectance);
        self.specular = display_color(specular);
        self.shininess = shininess;
        self.physical = Some(own);
        self
    }

    /// The number of diffuse colors.
    pub fn diffuse_count(&self) -> usize {
        match self.diffuse {
            Diffuse::Colors(c) => c.len(),
            Diffuse::Packed(p) => p.len(),
            Diffuse::Rgba(c) => c.len(),
        }
    }

    /// The diffuse color at an index: see [`List::at`].
    pub fn diffuse_at(&self, index: usize) -> Vec3 {
        match self.diffuse {
            Diffuse::Colors(c) => c.at(index),
            Diffuse::Packed(p) => unpack(p[index.min(p.len() - 1)]).0,
            Diffuse::Rgba(c) => c[index.min(c.len() - 1)].truncate(),
        }
    }

    /// The transparency at an index: see [`List::at`].
    pub fn transparency_at(&self, index: usize) -> f32 {
        match self.diffuse {
            Diffuse::Colors(_) => self.transparency.at(index),
            Diffuse::Packed(p) => unpack(p[index.min(p.len() - 1)]).1,
            Diffuse::Rgba(c) => 1.0 - c[index.min(c.len() - 1)].w,
        }
    }
}

/// Returns the color and the transparency in `0xrrggbbaa`.
pub(crate) fn unpack(rgba: u32) -> (Vec3, f32) {
    let [r, g, b, a] = rgba.to_be_bytes().map(|byte| f32::from(byte) / 255.0);
    (Vec3::new(r, g, b), 1.0 - a)
}

/// How a list of materials or normals is distributed over a shape. The `Indexed` variants use an
/// index field of the shape; the others use the values in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binding {
    /// The first value is used for the whole shape.
    Overall,
    /// Each part of the shape has a value.
    PerPart,
    /// Each part of the shape has an index of a value.
    PerPartIndexed,
    /// Each face has a value.
    PerFace,
    /// Each face has an index of a value.
    PerFaceIndexed,
    /// Each vertex has a value.
    PerVertex,
    /// Each vertex has an index of a value.
    PerVertexIndexed,
}

impl Binding {
    /// Converts the number of an enumerator. Materials and normals use the same numbers.
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

/// The coordinate element: the points that vertex-based shapes index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coordinates<'a> {
    /// Points.
    Three(&'a [Vec3]),
    /// Homogeneous points, with their weight last.
    Four(&'a [Vec4]),
    /// Places on the globe.
    Geo(GeoPoints<'a>),
}

impl Coordinates<'_> {
    /// The number of points.
    pub fn len(&self) -> usize {
        match self {
            Self::Three(c) => c.len(),
            Self::Four(c) => c.len(),
            Self::Geo(c) => c.len(),
        }
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns a point, divided by its weight if that is not 0.
    pub fn get(&self, index: usize) -> Option<Vec3> {
        match self {
            Self::Three(c) => c.get(index).copied(),
            Self::Four(c) => c.get(index).map(|p| {
                let w = if p.w == 0.0 { 1.0 } else { p.w };
                p.truncate() / w
            }),
            Self::Geo(c) => c.get(index).map(|p| p.as_vec3()),
        }
    }
}

/// The source of texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureCoordinates<'a> {
    /// Each shape generates its own coordinates.
    Default,
    /// Coordinates (s, t) that shapes index.
    Two(&'a [Vec2]),
    /// Coordinates (s, t, r) that shapes index.
    Three(&'a [Vec3]),
    /// The node `TextureCoordinatePlane`: dot products of the point with directions in object
    /// space. A longer direction repeats the texture more often, as in SGI's library.
    Plane {
        /// The direction whose dot product with the point is the coordinate s.
        s: Vec3,
        /// The direction whose dot product with the point is the coordinate t.
        t: Vec3,
    },
    /// The node `TextureCoordinateEnvironment`: a sphere map, which depends on the camera.
    Environment,
    /// The node `TextureCoordinateObject`: dot products with the point (x, y, z, 1) of object
    /// space.
    Object {
        /// The vector whose dot product with (x, y, z, 1) is the coordinate s.
        s: Vec4,
        /// The vector whose dot product with (x, y, z, 1) is the coordinate t.
        t: Vec4,
    },
    /// The texture is wrapped around the bounding box of a vertex-based shape. Other shapes
    /// generate their own coordinates.
    Wrapped(Wrapping),
}

/// The solid that a texture is wrapped around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrapping {
    /// The node `TextureCoordinateSphere`, which uses the angles about the origin.
    Sphere,
    /// The node `TextureCoordinateCylinder`, which uses the angle about y and the height. On a face
    /// that faces up or down it uses x and z.
    Cylinder,
    /// The node `TextureCoordinateCube`, which projects onto the side that a face is turned to.
    Cube,
}

/// The order of a face's vertices, seen from its front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexOrdering {
    /// The order is unknown, so both sides of faces are drawn.
    Unknown,
    /// The vertices run clockwise.
    Clockwise,
    /// The vertices run counterclockwise.
    Counterclockwise,
}

/// The shape hints element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeHints {
    /// The order of the vertices of every face.
    pub ordering: VertexOrdering,
    /// Whether the shape is closed (`SOLID`), so that the backs of its faces are invisible.
    pub solid: bool,
    /// Whether every face is convex (`CONVEX`).
    pub convex: bool,
    /// The largest angle between two faces whose common edge is smooth, in radians.
    pub crease_angle: f32,
}

impl ShapeHints {
    /// Inventor's default hints.
    pub(crate) const DEFAULT: Self = Self {
        ordering: VertexOrdering::Unknown,
        solid: false,
        convex: true,
        crease_angle: 0.0,
    };

    /// Whether both sides of a face are lit: the order is known and the shape is not closed.
    pub fn two_sided(&self) -> bool {
        self.ordering != VertexOrdering::Unknown && !self.solid
    }

    /// Whether back faces are culled: the order is known and the shape is closed.
    pub fn culls(&self) -> bool {
        self.ordering != VertexOrdering::Unknown && self.solid
    }

    /// Whether vertices run counterclockwise, which is assumed if the order is unknown.
    pub fn counterclockwise(&self) -> bool {
        self.ordering != VertexOrdering::Clockwise
    }
}

/// How shapes are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawStyle {
    /// Faces are filled.
    Filled,
    /// Only edges are drawn.
    Lines,
    /// Only vertices are drawn.
    Points,
    /// Nothing is drawn.
    Invisible,
}

/// The elements that `DrawStyle` and `PolygonOffset` set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawStyleElement {
    /// How shapes are drawn.
    pub style: DrawStyle,
    /// The width of lines in pixels; 0 means 1.
    pub line_width: f32,
    /// The size of points in pixels; 0 means 1.
    pub point_size: f32,
    /// The stipple of lines, one bit for each pixel, as in OpenGL.
    pub line_pattern: u16,
    /// The number of pixels for each bit of the stipple, at least 1.
    pub line_pattern_scale: u16,
    /// The sign of `PolygonOffset`: 1 moves faces behind others in the same plane, −1 in front of
    /// them.
    pub offset: i8,
    /// The draw styles that the offset applies to: bits of `polygon_offset::STYLES_…`.
    pub offset_styles: i32,
}

impl DrawStyleElement {
    /// Inventor's default values.
    pub const DEFAULT: Self = Self {
        style: DrawStyle::Filled,
        line_width: 0.0,
        point_size: 0.0,
        line_pattern: 0xffff,
        line_pattern_scale: 1,
        offset: 0,
        offset_styles: 1,
    };
}

/// The law by which fog grows with distance. `shade` has the formulas.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FogKind {
    /// There is no fog.
    None,
    /// Inventor's `HAZE`, which grows linearly.
    Haze,
    /// Inventor's `FOG`, which grows exponentially.
    Fog,
    /// Inventor's `SMOKE`, which grows exponentially with the square.
    Smoke,
    /// `LINEAR` of VRML97, which hides everything at the visibility range.
    Linear,
    /// `EXPONENTIAL` of VRML97, which hides everything at the visibility range.
    Exponential,
}

/// Ambient light, the attenuation of lights with distance, and fog.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentElement {
    /// The ambient color times its intensity.
    pub ambient: Vec3,
    /// The quadratic, linear and constant coefficient of 1 / (a₀d² + a₁d + a₂).
    pub attenuation: Vec3,
    /// The law of the fog.
    pub fog: FogKind,
    /// The color of the fog.
    pub fog_color: Vec3,
    /// The distance at which fog hides everything, in meters; for Inventor's fog 0 means the far
    /// side of the scene.
    pub visibility: f32,
}

impl EnvironmentElement {
    /// Inventor's default environment.
    pub(crate) const DEFAULT: Self = Self {
        ambient: Vec3::splat(0.2),
        attenuation: Vec3::new(0.0, 0.0, 1.0),
        fog: FogKind::None,
        fog_color: Vec3::ONE,
        visibility: 0.0,
    };
}

/// The kind of a light, with its cone. Angles are in radians from the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// All rays are parallel.
    Directional,
    /// The light shines from a point in all directions.
    Point,
    /// Inventor's spot light.
    Spot {
        /// The exponent of the cosine divided by 128, as in Inventor's `dropOffRate`.
        drop_off: f32,
        /// The angle at the cone's edge.
        cut_off: f32,
    },
    /// VRML97's spot light. Its intensity falls from 1 at `beam_width` to 0 at `cut_off`.
    Beam {
        /// The angle up to which the intensity is full.
        beam_width: f32,
        /// The angle at the cone's edge.
        cut_off: f32,
    },
    /// The spot light of glTF. Its intensity falls from 1 to 0 by the square of what the cosine has
    /// left to the cone's edge (`KHR_lights_punctual`).
    Cone {
        /// The angle up to which the intensity is full.
        inner: f32,
        /// The angle at the cone's edge.
        outer: f32,
    },
}

/// A light in world space, in meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightElement {
    /// The kind of the light.
    pub kind: LightKind,
    /// The color, which is multiplied by the intensity.
    pub color: Vec3,
    /// The intensity; 1 is full.
    pub intensity: f32,
    /// The ambient intensity of a VRML97 light; 0 for Inventor's lights.
    pub ambient: f32,
    /// The position; unused for a directional light.
    pub position: DVec3,
    /// The direction of the light or of its axis, of length 1.
    pub direction: DVec3,
    /// The quadratic, linear and constant coefficient of 1 / (a₀d² + a₁d + a₂).
    pub attenuation: Vec3,
    /// The least value of that divisor: 1 for VRML97 lights, 0 for Inventor's.
    pub least_divisor: f32,
    /// The distance in meters at which a VRML97 light ends; infinite for Inventor's lights.
    pub radius: f32,
    /// Whether intensity and attenuation are of light, as glTF's, and not of a screen's levels.
    pub linear: bool,
    /// The light's node.
    pub node: NodeId,
}

/// How a texture changes the color of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureModel {
    /// The texture multiplies the color.
    Modulate,
    /// The texture covers the color where it is opaque.
    Decal,
    /// The texture blends the color with the blend color.
    Blend,
    /// The texture replaces the color.
    Replace,
    /// The texture is part of the material, as in VRML97 (4.14.4, tables 4.5 and 4.6). Colors
    /// replace the diffuse color before lighting, gray levels multiply it, and alpha replaces the
    /// transparency.
    Diffuse,
    /// The texture multiplies the color of the material before lighting, and its opacity, as in X3D
    /// 4 and glTF.
    Material,
}

/// What the opacity of a surface means: X3D 4's field `alphaMode`, which is glTF's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// What is not opaque lets light through.
    #[default]
    Blend,
    /// Everything is opaque.
    Opaque,
    /// What has less opacity than this is not there, and the rest is opaque.
    Mask(f32),
}

impl AlphaMode {
    /// Returns the transparency of a place as the meaning of the opacity has it.
    pub fn seen_transparency(self, transparency: f32) -> f32 {
        match self {
            Self::Blend => transparency,
            Self::Opaque => 0.0,
            Self::Mask(cutoff) if 1.0 - transparency < cutoff => 1.0,
            Self::Mask(_) => 0.0,
        }
    }

    /// Returns the meaning of an opacity that is multiplied by another one before it is compared.
    #[must_use]
    pub fn under(self, opacity: f32) -> Self {
        match self {
            Self::Mask(cutoff) => Self::Mask(cutoff / opacity),
            other => other,
        }
    }

    /// The opacity below which a surface is not there: infinite for one that is opaque.
    pub fn least_opacity(self) -> f32 {
        match self {
            Self::Blend => f32::NEG_INFINITY,
            Self::Mask(cutoff) => cutoff,
            Self::Opaque => f32::INFINITY,
        }
    }
}

/// The current texture. Its image is decoded only if a picture needs it.
#[derive(Clone, Copy)]
pub struct TextureElement<'a> {
    /// The `textureQuality` of `Complexity` at the texture, not at the shape.
    pub quality: f32,
    /// Whether a `Texture3` repeats along its depth.
    pub repeat_r: bool,
    /// The texture's node.
    pub node: NodeRef<'a>,
    /// How the texture changes the color.
    pub model: TextureModel,
    /// The color for [`TextureModel::Blend`].
    pub blend_color: Vec3,
    /// Whether the texture repeats along its width.
    pub repeat_s: bool,
    /// Whether the texture repeats along its height.
    pub repeat_t: bool,
    /// What its opacity means.
    pub alpha: AlphaMode,
}

/// The texture elements of a `TextureUnit` other than the first (Coin).
#[derive(Clone, Copy)]
pub struct UnitTexture<'a> {
    /// The number of the unit, from 1 to [`UnitTexture::LAST`].
    pub unit: i32,
    /// The texture, if any.
    pub texture: Option<TextureElement<'a>>,
    /// The matrix that is applied to its texture coordinates.
    pub matrix: glam::Mat4,
    /// The source of its texture coordinates.
    pub coordinates: TextureCoordinates<'a>,
}

impl UnitTexture<'_> {
    /// The last unit whose texture is drawn: the number of units that OpenGL names, less one.
    pub const LAST: i32 = 31;
}

/// The font element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FontElement<'a> {
    /// The font's name, as in a `Font` node.
    pub name: &'a str,
    /// The size: in units of length for 3D text, in pixels for 2D text.
    pub size: f32,
    /// Whether a `FontStyle` set the font, so that `family` and `style` apply instead of `name`.
    pub is_style: bool,
    /// One of `font_style::FAMILY_…`.
    pub family: i32,
    /// Bits of `font_style::STYLE_…`.
    pub style: i32,
}

/// A profile of a `Text3` or NURBS shape.
#[derive(Clone, Copy)]
pub struct ProfileElement<'a> {
    /// The profile's node.
    pub node: NodeRef<'a>,
    /// The coordinates that it indexes.
    pub coordinates: ProfileCoordinates<'a>,
}

/// The points that profiles index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProfileCoordinates<'a> {
    /// Points of the plane.
    Two(&'a [Vec2]),
    /// Homogeneous points of the plane, with their weight last.
    Three(&'a [Vec3]),
}

/// The complexity element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Complexity {
    /// The complexity from 0 to 1.
    pub value: f32,
    /// One of `complexity::TYPE_…`, or `None` if no node states it.
    pub kind: Option<i32>,
    /// The texture quality from 0 to 1; 0 turns textures off.
    pub texture_quality: f32,
}

/// How a `LocateHighlight` changes the materials below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Highlight {
    /// The emissive color that replaces the materials'.
    pub color: Vec3,
    /// Whether the color replaces the diffuse color too.
    pub diffuse_too: bool,
}

/// The language of a scene. Some rules differ between languages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// Open Inventor.
    Inventor,
    /// VRML 1.0.
    Vrml1,
    /// VRML97, also called VRML 2.0.
    Vrml97,
}

impl Language {
    /// Returns the language that the document's header names. X3D, and the formats that are read as
    /// its nodes, have the rules of VRML97.
    pub fn of(document: &Document) -> Self {
        match &document.format {
            _ if document.is_x3d() => Self::Vrml97,
            f if f.starts_with("VRML V1") => Self::Vrml1,
            f if f.starts_with("VRML V2") => Self::Vrml97,
            _ => Self::Inventor,
        }
    }
}

/// Everything that a shape inherits.
#[derive(Clone)]
pub struct State<'a> {
    /// The matrix from the shape's object space to world space, which is in meters.
    pub world_from_object: DMat4,
    /// The matrices of which it is the product, if the walk records them.
    pub steps: Option<Arc<Step>>,
    /// The points that vertex-based shapes index.
    pub coordinates: Coordinates<'a>,
    /// The place on the globe that is the scene's origin, if a node states one.
    pub geo_origin: Option<GeoOrigin>,
    /// The normals that vertex-based shapes index.
    pub normals: &'a [Vec3],
    /// How normals are distributed.
    pub normal_binding: Binding,
    /// The materials.
    pub material: MaterialElement<'a>,
    /// The node that set the material last, or the `Appearance` that names it.
    pub material_node: Option<NodeRef<'a>>,
    /// How materials are distributed.
    pub material_binding: Binding,
    /// The texture of unit 0, if any.
    pub texture: Option<TextureElement<'a>>,
    /// The textures of the other units, in the order of their units. Each is applied to the color
    /// that those before it leave.
    pub further_textures: Arc<Vec<UnitTexture<'a>>>,
    /// The matrix that is applied to texture coordinates.
    pub texture_matrix: glam::Mat4,
    /// The source of texture coordinates.
    pub texture_coordinates: TextureCoordinates<'a>,
    /// Whether texture coordinates are indexed by `coordIndex` or `textureCoordIndex`. Otherwise
    /// they are used in order.
    pub texture_indexed: bool,
    /// The shape hints.
    pub hints: ShapeHints,
    /// Whether shapes show their diffuse color unlit (`LightModel` `BASE_COLOR`).
    pub base_color: bool,
    /// How shapes are drawn.
    pub drawing: DrawStyleElement,
    /// Whether shapes cast shadows (`ShadowStyle`).
    pub casts_shadow: bool,
    /// Whether shapes are drawn over everything else (`Annotation`).
    pub on_top: bool,
    /// Which bindable nodes may be bound here.
    pub bindables: Bindables<'a>,
    /// The highlight of the nearest enclosing `LocateHighlight` that is on.
    pub highlight: Option<Highlight>,
    /// The current `TextureUnit`, which texture nodes set.
    pub texture_unit: i32,
    /// The complexity.
    pub complexity: Complexity,
    /// The font.
    pub font: FontElement<'a>,
    /// Ambient light, attenuation and fog.
    pub environment: EnvironmentElement,
    /// The last `Environment`.
    pub environment_node: Option<NodeRef<'a>>,
    /// The last camera or viewpoint. By a camera, SGI's library and Coin show the shape.
    pub camera: Option<NodeRef<'a>>,
    /// The lights that light the shape.
    pub lights: LightList,
    /// The clip planes in world space, as normal and distance. Points with p·normal ≥ distance are
    /// visible.
    pub clip_planes: Arc<Vec<(DVec3, f64)>>,
    /// The points that profiles index.
    pub profile_coordinates: ProfileCoordinates<'a>,
    /// The current profiles.
    pub profiles: Arc<Vec<ProfileElement<'a>>>,
    /// The choice of the last `Switch`, for `SWITCH_INHERIT`.
    pub switch: i32,
    /// The length of the current unit of `Units`, in meters.
    pub unit: f64,
    /// The language whose rules apply to shapes here.
    pub language: Language,
}

/// Which bindable nodes may be bound (ISO 14772-1, 4.6.10).
#[derive(Clone, Copy, Debug)]
pub enum Bindables<'a> {
    /// The first of each kind.
    First,
    /// None: the nodes of a file that an `Inline` names are no candidates for the first.
    Inlined,
    /// Those that events have bound.
    Bound(&'a BoundNodes),
}

impl Bindables<'_> {
    /// Returns whether a bindable node may be bound.
    pub fn include(self, node: NodeId) -> bool {
        match self {
            Self::First => true,
            Self::Inlined => false,
            Self::Bound(nodes) => nodes.has(node),
        }
    }
}

/// The default of Inventor's coordinate element: one point at the origin.
static NO_COORDINATES: [Vec3; 1] = [Vec3::ZERO];

impl<'a> State<'a> {
    /// Returns the state with factors of roughness and metal, if a texture states them.
    pub fn with_factors(&self, factors: Option<[f32; 2]>) -> Cow<'_, Self> {
        factors.map_or(Cow::Borrowed(self), |[roughness, metallic]| {
            Cow::Owned(Self {
                material: self.material.with_factors(roughness, metallic),
                ..self.clone()
            })
        })
    }

    /// Multiplies the matrix by one of the nodes that follow.
    pub(super) fn multiply(&mut self, matrix: DMat4) {
        self.world_from_object *= matrix;
        if let Some(steps) = &self.steps {
            self.steps = Some(steps.then(matrix));
        }
    }

    /// Changes the texture elements of the current unit. Those of a unit that does not exist are
    /// left alone.
    pub(super) fn in_unit(&mut self, change: impl FnOnce(&mut Self)) {
        let unit = self.texture_unit;
        if unit == 0 {
            return change(self);
        }
        if !(1..=UnitTexture::LAST).contains(&unit) {
            return;
        }
        let mut units = std::mem::take(&mut self.further_textures);
        let list = Arc::make_mut(&mut units);
        let at = list.partition_point(|other| other.unit < unit);
        if list.get(at).is_none_or(|other| other.unit != unit) {
            let (matrix, coordinates) = (glam::Mat4::IDENTITY, TextureCoordinates::Default);
            list.insert(
                at,
                UnitTexture {
                    unit,
                    texture: None,
                    matrix,
                    coordinates,
                },
            );
        }
        self.exchange(&mut list[at]);
        change(self);
        self.exchange(&mut list[at]);
        self.further_textures = units;
    }

    /// Exchanges the texture elements of unit 0 and those of another.
    fn exchange(&mut self, other: &mut UnitTexture<'a>) {
        std::mem::swap(&mut self.texture, &mut other.texture);
        std::mem::swap(&mut self.texture_matrix, &mut other.matrix);
        std::mem::swap(&mut self.texture_coordinates, &mut other.coordinates);
    }

    /// Whether shapes show their diffuse color without lighting, by the light model or by their
    /// material.
    pub fn is_unlit(&self) -> bool {
        self.base_color || self.material.is_unlit
    }

    /// The state at the root of a scene.
    pub fn new(language: Language) -> Self {
        Self {
            world_from_object: DMat4::IDENTITY,
            steps: None,
            coordinates: Coordinates::Three(&NO_COORDINATES),
            geo_origin: None,
            normals: &[],
            normal_binding: Binding::PerVertexIndexed,
            material: MaterialElement::DEFAULT,
            material_node: None,
            camera: None,
            material_binding: Binding::Overall,
            texture: None,
            further_textures: Arc::default(),
            texture_matrix: glam::Mat4::IDENTITY,
            texture_coordinates: TextureCoordinates::Default,
            texture_indexed: true,
            hints: ShapeHints {
                crease_angle: if language == Language::Vrml1 {
                    CREASE_ANGLE
                } else {
                    0.0
                },
                ..ShapeHints::DEFAULT
            },
            base_color: false,
            drawing: DrawStyleElement::DEFAULT,
            casts_shadow: true,
            on_top: false,
            bindables: Bindables::First,
            highlight: None,
            texture_unit: 0,
            complexity: Complexity {
                value: 0.5,
                kind: None,
                texture_quality: 0.5,
            },
            font: FontElement {
                name: "defaultFont",
                // This is Coin's size before any node sets one. The default of a `Font` node is 10.
                size: 12.0,
                is_style: false,
                family: 0,
                style: 0,
            },
            environment: match language {
                // VRML97 has no ambient light other than that of its lights (4.14.4).
                Language::Vrml97 => EnvironmentElement {
                    ambient: Vec3::ZERO,
                    ..EnvironmentElement::DEFAULT
                },
                _ => EnvironmentElement::DEFAULT,
            },
            environment_node: None,
            lights: LightList::default(),
            clip_planes: Arc::default(),
            profile_coordinates: ProfileCoordinates::Two(&[]),
            profiles: Arc::default(),
            switch: -1,
            unit: 1.0,
            language,
        }
    }
}

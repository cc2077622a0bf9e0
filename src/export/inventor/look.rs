//! The looks of shapes: light model, hints, material and texture, in groups that shapes share.
//!
//! A `Group` does not restore the state, so its properties act on the shape that follows it in the
//! same `Separator`.

use std::collections::HashMap;

use glam::{Affine2, DAffine3, DQuat, DVec3, Vec3};
use ivcam_inventor::grammar::value::{NodeId, Value};
use ivcam_inventor::grammar::{light_model, material_binding, shape_hints, texture, texture2};
use ivcam_render::scene::model::{
    Image, Material, Mesh, Model, Part, Primitives, Texture, TextureModel,
};

use crate::export::appearance::Appearance;
use crate::export::names::picture_name;
use crate::export::nodes::{NodeBuilder, pixels};
use crate::export::target::Target;
use crate::export::trs::split;

/// A quality at which textures are not interpolated.
const NEAREST: f32 = 0.1;

/// What a look depends on: the material, the mesh if its vertices have colors, and whether its
/// matrix mirrors it.
type LookKey = (usize, Option<usize>, bool);

/// The looks that were written, and the pictures of their textures.
pub(super) struct Looks<'m> {
    model: &'m Model,
    /// The beginning of the names of pictures; empty if they are in the file.
    stem: &'m str,
    known: HashMap<LookKey, NodeId>,
    /// The textures by material.
    textures: HashMap<TextureKey, NodeId>,
    /// The names of pictures beside the file, by their index in the model.
    names: HashMap<usize, String>,
    /// The pictures beside the file.
    pub beside: Vec<(String, Vec<u8>)>,
}

/// What a `Texture2` depends on: picture, wrapping, model and the bits of the blend color.
type TextureKey = (usize, [bool; 2], i32, [u32; 3]);

/// The colors of a material as Inventor has them.
struct Colors<'m> {
    look: Appearance<'m>,
    ambient: Vec3,
    /// Whether the opacities of vertices are kept.
    keeps_opacity: bool,
}

impl<'m> Looks<'m> {
    /// Creates an empty list.
    pub(super) fn new(model: &'m Model, stem: &'m str) -> Self {
        Self {
            model,
            stem,
            known: HashMap::new(),
            textures: HashMap::new(),
            names: HashMap::new(),
            beside: Vec::new(),
        }
    }

    /// Returns the group with the look of a part.
    pub(super) fn look(
        &mut self,
        part: Part,
        is_mirrored: bool,
        nodes: &mut NodeBuilder,
    ) -> NodeId {
        let model = self.model;
        let (mesh, material) = (&model.meshes[part.mesh], &model.materials[part.material]);
        let colors = Colors::of(material, model, mesh);
        let is_colorful = colors.look.keeps_colors && !mesh.colors.is_empty();
        let key = (part.material, is_colorful.then_some(part.mesh), is_mirrored);
        if let Some(&known) = self.known.get(&key) {
            return nodes.share(known, "look");
        }
        let mut members = vec![hints(material.double_sided, is_mirrored, nodes)];
        if colors.look.unlit {
            let model = Value::Int(light_model::MODEL_BASE_COLOR);
            members.push(nodes.node("LightModel", vec![("model", model)]));
        }
        members.push(colors.material(material, is_colorful.then_some(mesh), nodes));
        if is_colorful {
            members.push(binding(mesh, nodes));
        }
        if let Some(texture) = &material.texture {
            members.extend(self.texture(texture, nodes));
        }
        let look = nodes.group("Group", Vec::new(), members);
        self.known.insert(key, look);
        look
    }

    /// Returns the nodes of a texture and its matrix.
    fn texture(&mut self, texture: &Texture, nodes: &mut NodeBuilder) -> Vec<NodeId> {
        let mut made = Vec::new();
        if !texture.smooth {
            let quality = Value::Float(NEAREST);
            made.push(nodes.node("Complexity", vec![("textureQuality", quality)]));
        }
        let mode = texture_model(texture.model);
        let bits = texture.blend_color.to_array().map(f32::to_bits);
        let key = (texture.image, texture.repeat, mode, bits);
        made.push(match self.textures.get(&key) {
            Some(&known) => nodes.share(known, "texture"),
            None => {
                let node = self.texture_node(texture, mode, nodes);
                self.textures.insert(key, node);
                node
            }
        });
        if texture.matrix != Affine2::IDENTITY && texture.matrix.is_finite() {
            made.extend(texture_transforms(&texture.matrix, nodes));
        }
        made
    }

    /// Returns a new `Texture2`.
    fn texture_node(&mut self, texture: &Texture, mode: i32, nodes: &mut NodeBuilder) -> NodeId {
        let wrap = |repeats| match repeats {
            true => texture::WRAP_S_REPEAT,
            false => texture::WRAP_S_CLAMP,
        };
        let [s, t] = texture.repeat.map(wrap).map(Value::Int);
        let image = &self.model.images[texture.image];
        let picture = match self.stem {
            "" => ("image", Value::Image(Box::new(pixels(image)))),
            _ => ("filename", Value::String(self.file(texture.image).into())),
        };
        let fields = vec![
            picture,
            ("wrapS", s),
            ("wrapT", t),
            ("model", Value::Int(mode)),
            ("blendColor", Value::Vec3(texture.blend_color)),
        ];
        nodes.node("Texture2", fields)
    }

    /// Returns the name of the file beside the scene with a picture.
    fn file(&mut self, image: usize) -> String {
        if let Some(known) = self.names.get(&image) {
            return known.clone();
        }
        let name = picture_name(self.stem, Target::Inventor, self.beside.len());
        let bytes = self.model.images[image].png();
        self.beside.push((name.clone(), bytes));
        self.names.insert(image, name.clone());
        name
    }
}

impl<'m> Colors<'m> {
    /// Returns the colors of a material on a mesh. A texture of VRML97 replaces the diffuse color,
    /// and its alpha the transparency; those of Inventor are kept.
    fn of(material: &Material, model: &'m Model, mesh: &Mesh) -> Self {
        let texture = material.texture.as_ref();
        let image = texture.map(|t| &model.images[t.image]);
        let is_replaced = texture.is_some_and(|t| t.model == TextureModel::Diffuse);
        let look = match is_replaced {
            true => Appearance::of(material, image, !mesh.colors.is_empty()),
            false => Appearance::plain(material, image),
        };
        let ambient = match look.color == material.diffuse {
            true => material.ambient,
            false => Vec3::splat(ambient_share(material)),
        };
        Self {
            look,
            ambient,
            keeps_opacity: !(is_replaced && image.is_some_and(Image::has_alpha)),
        }
    }

    /// Returns the `Material`. A mesh with colors gives it one color for each vertex.
    fn material(
        &self,
        material: &Material,
        mesh: Option<&Mesh>,
        nodes: &mut NodeBuilder,
    ) -> NodeId {
        let one = |color: Vec3| Value::Vec3s(vec![color]);
        let transparency = |opacity: f32| (1.0 - opacity).clamp(0.0, 1.0);
        let mut diffuse = one(self.look.color);
        let mut through = vec![transparency(self.look.opacity)];
        if let Some(mesh) = mesh {
            let colors = mesh.colors.iter().map(|c| Vec3::new(c[0], c[1], c[2]));
            diffuse = Value::Vec3s(colors.collect());
            if self.keeps_opacity {
                through = mesh.colors.iter().map(|c| transparency(c[3])).collect();
            }
        }
        if through.iter().all(|t| *t == through[0]) {
            through.truncate(1);
        }
        let mut fields = vec![("diffuseColor", diffuse)];
        if !self.look.unlit {
            fields.extend([
                ("ambientColor", one(self.ambient)),
                ("specularColor", one(material.specular)),
                ("emissiveColor", one(material.emissive)),
                ("shininess", Value::Floats(vec![material.shininess])),
            ]);
        }
        fields.push(("transparency", Value::Floats(through)));
        nodes.node("Material", fields)
    }
}

/// Whether a material only approximates VRML97's texture. There the texture is the diffuse color
/// alone, and in Inventor it multiplies the highlight and the emissive color too.
pub(in crate::export) fn approximates_texture(material: &Material) -> bool {
    let is_diffuse = |model| matches!(model, TextureModel::Diffuse | TextureModel::Material);
    let is_textured = material
        .texture
        .as_ref()
        .is_some_and(|t| is_diffuse(t.model));
    is_textured && !material.unlit && material.specular + material.emissive != Vec3::ZERO
}

/// The ambient color as a share of the diffuse color. Its default is that of VRML97.
fn ambient_share(material: &Material) -> f32 {
    let [ambient, diffuse] = [material.ambient, material.diffuse].map(Vec3::element_sum);
    if diffuse > 0.0 {
        ambient / diffuse
    } else {
        0.2
    }
}

/// Returns the hints about a shape. A matrix that mirrors exchanges the sides in Inventor, and not
/// in a model.
fn hints(double_sided: bool, is_mirrored: bool, nodes: &mut NodeBuilder) -> NodeId {
    let ordering = match is_mirrored {
        true => shape_hints::VERTEX_ORDERING_CLOCKWISE,
        false => shape_hints::VERTEX_ORDERING_COUNTERCLOCKWISE,
    };
    let kind = match double_sided {
        true => shape_hints::SHAPE_TYPE_UNKNOWN_SHAPE_TYPE,
        false => shape_hints::SHAPE_TYPE_SOLID,
    };
    let fields = vec![
        ("vertexOrdering", Value::Int(ordering)),
        ("shapeType", Value::Int(kind)),
    ];
    nodes.node("ShapeHints", fields)
}

/// Returns the binding of one color to each vertex of a mesh.
fn binding(mesh: &Mesh, nodes: &mut NodeBuilder) -> NodeId {
    let value = match mesh.primitives {
        Primitives::Points => material_binding::VALUE_PER_VERTEX,
        _ => material_binding::VALUE_PER_VERTEX_INDEXED,
    };
    nodes.node("MaterialBinding", vec![("value", Value::Int(value))])
}

/// The value of a `Texture2`'s field `model`. A texture of VRML97 multiplies the material, whose
/// color is white if the texture replaces it.
fn texture_model(model: TextureModel) -> i32 {
    match model {
        TextureModel::Modulate | TextureModel::Diffuse | TextureModel::Material => {
            texture2::MODEL_MODULATE
        }
        TextureModel::Decal => texture2::MODEL_DECAL,
        TextureModel::Blend => texture2::MODEL_BLEND,
        TextureModel::Replace => texture2::MODEL_REPLACE,
    }
}

/// Returns the transforms whose product is a matrix. One has the matrix T · R · S, which is all
/// matrices whose columns are orthogonal; any other needs a rotation before it.
fn texture_transforms(matrix: &Affine2, nodes: &mut NodeBuilder) -> Vec<NodeId> {
    let matrix = matrix.as_daffine2();
    let column = |v: glam::DVec2| v.extend(0.0);
    let parts = split(&DAffine3::from_cols(
        column(matrix.matrix2.x_axis),
        column(matrix.matrix2.y_axis),
        DVec3::Z,
        column(matrix.translation),
    ));
    let turn = |turn: DQuat| Value::Float((2.0 * libm::atan2(turn.z, turn.w)) as f32);
    let outer = parts.outer;
    let fields = vec![
        (
            "translation",
            Value::Vec2(outer.translation.truncate().as_vec2()),
        ),
        ("rotation", turn(outer.rotation)),
        ("scaleFactor", Value::Vec2(outer.scale.truncate().as_vec2())),
    ];
    let mut made = vec![nodes.node("Texture2Transform", fields)];
    if let Some(inner) = parts.inner {
        made.push(nodes.node("Texture2Transform", vec![("rotation", turn(inner))]));
    }
    made
}

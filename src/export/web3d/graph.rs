//! Makes a document in VRML97 from a model, in which Inventor's state is resolved.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::{Affine2, DAffine3, DVec3, Vec2, Vec3, Vec4};
use indexmap::IndexMap;
use ivcam_inventor::grammar::Dialect;
use ivcam_inventor::grammar::value::{NodeId, Value};
use ivcam_inventor::iv::Document;
use ivcam_inventor::pose::Projection;
use ivcam_render::scene::model::{
    Feature, Image, LightShape, Material, Mesh, Model, Part, Place, Primitives, SceneCamera,
    SceneLight, SceneNode,
};

use super::levels::LightLevels;
use crate::export::appearance::Appearance;
use crate::export::base64::base64;
use crate::export::clipping::SceneSphere;
use crate::export::losses::Losses;
use crate::export::names::picture_name;
use crate::export::nodes::{
    NodeBuilder, indices, needs_group, pixels, rotation, transform_fields, tree_of, vec3,
};
use crate::export::target::Target;

/// The radius of lights that shine to any distance, in meters.
const FAR: f32 = 1e9;
/// The largest angle of a spot light: a right angle, as the six digits of the standards have it.
const WIDEST: f32 = std::f32::consts::FRAC_PI_2 - 1e-6;

/// Where the pictures of textures are.
#[derive(Clone, Copy, Debug)]
pub(in crate::export) enum Pictures<'o> {
    /// In their addresses, as `data:`.
    Inside,
    /// In files beside the file, whose names begin with its name without the ending.
    Beside(&'o str),
    /// As pixels in the scene, for VRML97 that is written to a pipe.
    Pixels,
}

/// How a graph is written.
#[derive(Clone, Copy, Debug)]
pub(in crate::export) struct GraphOptions<'o> {
    /// Where the pictures of textures are.
    pub pictures: Pictures<'o>,
    /// The format, VRML97 or X3D.
    pub target: Target,
}

/// A document in VRML97, and the pictures beside it.
pub(in crate::export) struct Graph {
    pub document: Document,
    pub beside: Vec<(String, Vec<u8>)>,
}

/// The state of the conversion.
struct GraphBuilder<'m> {
    model: &'m Model,
    options: GraphOptions<'m>,
    losses: &'m mut Losses,
    nodes: NodeBuilder,
    /// The ambient light of all shapes, color times intensity.
    ambient: Vec3,
    /// The pictures beside the document.
    beside: Vec<(String, Vec<u8>)>,
    /// The shapes of parts that were used, with whether their matrix mirrors them.
    shapes: HashMap<(Part, bool), NodeId>,
    /// The appearances of materials, by material and kind of geometry.
    appearances: HashMap<(usize, GraphKind), NodeId>,
    /// The geometry of meshes.
    geometry: HashMap<(usize, GeometryKind), NodeId>,
    /// The addresses of pictures, which are empty if the pixels are in the scene.
    pictures: IndexMap<Vec<u8>, String>,
    /// The textures by the number of their picture and whether they repeat.
    textures: HashMap<(usize, [bool; 2]), NodeId>,
}

/// What an appearance depends on beside the material.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct GraphKind {
    /// What the colors of the mesh make of the material.
    colors: Option<[u32; 4]>,
    /// Whether the colors of the mesh are kept.
    is_colored: bool,
    /// Whether the mesh is lines or points, which are not lit.
    is_thin: bool,
}

/// What a geometry depends on beside the mesh.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct GeometryKind {
    /// Whether it is seen from both sides.
    double_sided: bool,
    /// Whether the colors of the mesh are kept.
    keeps_colors: bool,
    /// Whether the matrix mirrors it, which exchanges front and back (decision 16), and not those
    /// of a model.
    is_mirrored: bool,
}

/// Makes a document in VRML97 from a model. What VRML97 cannot express is added to `losses`.
pub(in crate::export) fn graph(
    model: &Model,
    options: GraphOptions<'_>,
    losses: &mut Losses,
) -> Graph {
    let dialects = match options.target {
        Target::X3d => Dialect::VRML97 | Dialect::X3D,
        _ => Dialect::VRML97,
    };
    let mut builder = GraphBuilder {
        model,
        options,
        losses,
        nodes: NodeBuilder::new("VRML V2.0 utf8", dialects),
        ambient: ambient_of(model),
        beside: Vec::new(),
        shapes: HashMap::new(),
        appearances: HashMap::new(),
        geometry: HashMap::new(),
        pictures: IndexMap::new(),
        textures: HashMap::new(),
    };
    let mut roots = builder.head();
    roots.extend(builder.tree());
    Graph {
        document: builder.nodes.finish(roots),
        beside: builder.beside,
    }
}

impl GraphBuilder<'_> {
    /// Adds a node with some fields of a class of VRML97. Fields with their defaults are left out.
    fn node(&mut self, class: &str, fields: Vec<(&str, Value)>) -> NodeId {
        self.nodes.node(class, fields)
    }

    /// Gives a node a name.
    fn name(&mut self, id: NodeId, wanted: &str) {
        self.nodes.name(id, wanted);
    }

    /// Names a node that is used again.
    fn share(&mut self, id: NodeId, wanted: &str) -> NodeId {
        self.nodes.share(id, wanted)
    }

    /// Returns the nodes before the scene: its origin, the headlight, viewpoints and lights.
    fn head(&mut self) -> Vec<NodeId> {
        let model = self.model;
        let mut head = Vec::new();
        if model.offset != DVec3::ZERO {
            let DVec3 { x, y, z } = model.offset;
            let info = format!("the origin of this file is at {x} {y} {z} of the original scene");
            head.push(self.node("WorldInfo", vec![("info", Value::Strings(vec![info]))]));
        }
        let kinds = ["EXAMINE", "ANY"].map(str::to_owned).to_vec();
        let headlight = Value::Bool(model.lights.is_empty());
        let fields = vec![("type", Value::Strings(kinds)), ("headlight", headlight)];
        head.push(self.node("NavigationInfo", fields));
        for camera in &model.cameras {
            head.push(self.viewpoint(camera));
        }
        let around = SceneSphere::of(model.bounds());
        for light in &model.lights {
            head.push(self.light(light, around.radius));
        }
        head.extend(self.ambient_light());
        head
    }

    /// Returns a light that adds the ambient light of Inventor's environment, if there is any. In
    /// VRML97 and X3D only lights have ambient light (VRML97, 4.14.4).
    fn ambient_light(&mut self) -> Option<NodeId> {
        let level = self.ambient.max_element();
        let fields = vec![
            ("color", Value::Vec3(self.ambient / level)),
            ("intensity", Value::Float(0.0)),
            ("ambientIntensity", Value::Float(level)),
        ];
        (level > 0.0).then(|| self.node("DirectionalLight", fields))
    }

    fn viewpoint(&mut self, camera: &SceneCamera) -> NodeId {
        let pose = &camera.pose;
        let number = |value: f64| Value::Float(value as f32);
        let (class, view) = match pose.projection {
            Projection::Perspective { height_angle } => ("Viewpoint", number(height_angle)),
            Projection::Orthographic { height } if self.options.target == Target::X3d => {
                let [right, top] = [height * pose.view_aspect(), height].map(|s| 0.5 * s as f32);
                let sides = vec![-right, -top, right, top];
                ("OrthoViewpoint", Value::Floats(sides))
            }
            Projection::Orthographic { height } => {
                let text = "the parallel projection is written as a perspective one";
                self.losses
                    .add("parallel-projection", text, camera.place.clone(), 1);
                let distance = f64::max(pose.focal_distance, 1e-6);
                let angle = 2.0 * libm::atan2(0.5 * height, distance);
                ("Viewpoint", number(angle))
            }
        };
        let id = self.node(
            class,
            vec![
                ("position", vec3(pose.position)),
                ("orientation", rotation(pose.orientation)),
                ("fieldOfView", view),
                ("description", Value::String(camera.name.as_str().into())),
            ],
        );
        self.name(id, &camera.name);
        id
    }

    /// Returns a light of a scene of a radius.
    fn light(&mut self, light: &SceneLight, scene: f64) -> NodeId {
        let radius = match light.radius.is_finite() {
            true => light.radius,
            false => FAR,
        };
        let levels = LightLevels::of(light, scene, self.options.target, self.losses);
        let mut fields = vec![
            ("color", Value::Vec3(levels.color)),
            ("intensity", Value::Float(levels.intensity)),
            (
                "ambientIntensity",
                Value::Float(light.ambient.clamp(0.0, 1.0)),
            ),
        ];
        if light.shape != LightShape::Point {
            fields.push(("direction", vec3(light.direction)));
        }
        if light.shape != LightShape::Directional {
            fields.push(("location", vec3(light.position)));
            fields.push(("radius", Value::Float(radius)));
            fields.push(("attenuation", Value::Vec3(levels.attenuation)));
        }
        let class = match light.shape {
            LightShape::Directional => "DirectionalLight",
            LightShape::Point => "PointLight",
            LightShape::Spot {
                inner,
                outer,
                exponent,
            } => {
                if exponent.is_some_and(|exponent| exponent > 0.0) {
                    self.losses.feature(Feature::SpotFalloff, &light.place, 1);
                }
                fields.push(("beamWidth", Value::Float(inner.clamp(1e-3, WIDEST))));
                fields.push(("cutOffAngle", Value::Float(outer.clamp(1e-3, WIDEST))));
                "SpotLight"
            }
        };
        let id = self.node(class, fields);
        self.name(id, &light.name);
        id
    }

    /// Returns the nodes of the model's root.
    fn tree(&mut self) -> Vec<NodeId> {
        tree_of(self.model, |node, children| {
            let shapes = node.parts.iter().map(|p| self.shape(*p, node));
            let own: Vec<NodeId> = shapes.chain(children).collect();
            let moves = node.local != DAffine3::IDENTITY;
            if !needs_group(node, moves, own.len()) {
                return own;
            }
            let group = match moves {
                true => self.transform(&node.local, own),
                false => self.node("Group", vec![("children", Value::Nodes(own))]),
            };
            if let Some(name) = &node.place.name {
                self.name(group, name);
            }
            vec![group]
        })
    }

    /// Returns a `Transform` with a matrix and some children.
    fn transform(&mut self, matrix: &DAffine3, children: Vec<NodeId>) -> NodeId {
        let mut fields = transform_fields(matrix, "scale");
        fields.push(("children", Value::Nodes(children)));
        self.node("Transform", fields)
    }

    /// Returns the shape of a part of a node, which several nodes may share.
    fn shape(&mut self, part: Part, node: &SceneNode) -> NodeId {
        let model = self.model;
        let (mesh, material) = (&model.meshes[part.mesh], &model.materials[part.material]);
        let place = &node.place;
        let is_mirrored = !mesh.triangles().is_empty() && node.world.matrix3.determinant() < 0.0;
        if let Some(&known) = self.shapes.get(&(part, is_mirrored)) {
            return self.share(known, "shape");
        }
        let image = material.texture.as_ref().map(|t| &model.images[t.image]);
        let target = self.options.target;
        let is_colorful = !mesh.colors.is_empty();
        let look = Appearance::of(material, image, is_colorful).on_mesh(mesh, target);
        let kind = GraphKind {
            colors: Appearance::key(material, image, mesh, target),
            is_colored: is_colorful && look.keeps_colors,
            is_thin: !matches!(mesh.primitives, Primitives::Triangles(_)),
        };
        let appearance = match self.appearances.get(&(part.material, kind)) {
            Some(&known) => self.share(known, "appearance"),
            None => {
                let made = self.appearance(material, &look, kind, place);
                self.appearances.insert((part.material, kind), made);
                made
            }
        };
        let kind = GeometryKind {
            double_sided: material.double_sided,
            keeps_colors: look.keeps_colors,
            is_mirrored,
        };
        let geometry = match self.geometry.get(&(part.mesh, kind)) {
            Some(&known) => self.share(known, "geometry"),
            None => {
                let made = self.geometry(mesh, kind);
                self.geometry.insert((part.mesh, kind), made);
                made
            }
        };
        let held = |id| Value::Node(Some(id));
        let fields = vec![
            ("appearance", held(appearance)),
            ("geometry", held(geometry)),
        ];
        let shape = self.node("Shape", fields);
        self.shapes.insert((part, is_mirrored), shape);
        shape
    }

    fn appearance(
        &mut self,
        material: &Material,
        look: &Appearance<'_>,
        kind: GraphKind,
        place: &Place,
    ) -> NodeId {
        let mut fields = Vec::new();
        let is_unlit = look.unlit || kind.is_thin;
        // Without a material, a texture and the colors of faces are shown as they are.
        let is_bare = is_unlit && (look.image.is_some() || kind.is_colored && !kind.is_thin);
        let mut opacity = look.opacity;
        if let (Some(image), Some(texture)) = (&look.image, &material.texture) {
            // In VRML97 a texture in color replaces the color, and one with alpha the transparency.
            let replaces = self.options.target == Target::Vrml97;
            let takes_color = !kind.is_colored && (is_bare || replaces && image.has_color());
            let takes_opacity = match replaces {
                true => is_bare || image.has_alpha(),
                // The colors of vertices of X3D have opacities.
                false => is_bare && !kind.is_colored,
            };
            let tint = if takes_color { look.color } else { Vec3::ONE };
            let factors = tint.extend(if takes_opacity { opacity } else { 1.0 });
            opacity = if takes_opacity { 1.0 } else { opacity };
            let made = self.texture(&tinted(image, factors), texture.repeat);
            fields.push(("texture", Value::Node(Some(made))));
            if texture.matrix != Affine2::IDENTITY {
                let made = self.texture_transform(&texture.matrix, place);
                fields.push(("textureTransform", Value::Node(Some(made))));
            }
        }
        if !is_bare {
            let made = self.material(material, (look.color, opacity), is_unlit, place);
            fields.insert(0, ("material", Value::Node(Some(made))));
        }
        self.node("Appearance", fields)
    }

    fn material(
        &mut self,
        material: &Material,
        (color, opacity): (Vec3, f32),
        is_unlit: bool,
        place: &Place,
    ) -> NodeId {
        let transparency = Value::Float((1.0 - opacity).clamp(0.0, 1.0));
        if is_unlit {
            let fields = vec![
                ("diffuseColor", Value::Vec3(Vec3::ZERO)),
                ("emissiveColor", Value::Vec3(color)),
                ("ambientIntensity", Value::Float(0.0)),
                ("transparency", transparency),
            ];
            return self.node("Material", fields);
        }
        let ambient = self.ambient_intensity(material, place);
        self.node(
            "Material",
            vec![
                ("diffuseColor", Value::Vec3(color)),
                ("specularColor", Value::Vec3(material.specular)),
                ("emissiveColor", Value::Vec3(material.emissive)),
                ("shininess", Value::Float(material.shininess)),
                ("ambientIntensity", Value::Float(ambient)),
                ("transparency", transparency),
            ],
        )
    }

    /// Returns the ambient color as a share of the diffuse color, which is all that VRML97 has.
    fn ambient_intensity(&mut self, material: &Material, place: &Place) -> f32 {
        // The nearest share, by the sum of squares.
        let share = |part: Vec3, whole: Vec3| {
            let share = part.dot(whole) / whole.length_squared().max(1e-12);
            share.clamp(0.0, 1.0)
        };
        if material.ambient_light == Vec3::ZERO {
            return share(material.ambient, material.diffuse);
        }
        let (part, whole) = (material.ambient_part(), self.ambient * material.diffuse);
        let share = share(part, whole);
        if (part - share * whole).abs().max_element() > Material::USUAL_AMBIENT {
            let text = "the ambient color becomes a share of the diffuse color";
            self.losses.add("ambient-color", text, place.clone(), 1);
        }
        share
    }

    /// Returns the texture of a picture, which several appearances may share.
    fn texture(&mut self, image: &Image, repeat: [bool; 2]) -> NodeId {
        let bytes = image.png();
        let number = self.pictures.get_index_of(&bytes).unwrap_or_else(|| {
            let address = self.address(&bytes);
            self.pictures.insert_full(bytes, address).0
        });
        if let Some(&known) = self.textures.get(&(number, repeat)) {
            return self.share(known, "texture");
        }
        let mut fields = vec![
            ("repeatS", Value::Bool(repeat[0])),
            ("repeatT", Value::Bool(repeat[1])),
        ];
        let made = if let Pictures::Pixels = self.options.pictures {
            fields.push(("image", Value::Image(Box::new(pixels(image)))));
            self.node("PixelTexture", fields)
        } else {
            let url = self.pictures[number].clone();
            fields.push(("url", Value::Strings(vec![url])));
            self.node("ImageTexture", fields)
        };
        self.textures.insert((number, repeat), made);
        made
    }

    /// Returns the address of a new picture in PNG, which is added to the files beside the document
    /// if it belongs there.
    fn address(&mut self, bytes: &[u8]) -> String {
        match self.options.pictures {
            Pictures::Pixels => String::new(),
            Pictures::Inside => format!("data:image/png;base64,{}", base64(bytes)),
            Pictures::Beside(stem) => {
                let name = picture_name(stem, Target::Vrml97, self.beside.len());
                self.beside.push((name.clone(), bytes.to_vec()));
                name
            }
        }
    }

    /// Returns a texture transform for a matrix: VRML97's is `S · R · T` about a center. A shear is
    /// lost, and so is the translation of a singular matrix.
    fn texture_transform(&mut self, matrix: &Affine2, place: &Place) -> NodeId {
        if !is_expressible(matrix) {
            let text = "the texture's matrix shears or is singular, and is approximated";
            self.losses.add("texture-matrix", text, place.clone(), 1);
        }
        let matrix = if matrix.is_finite() {
            *matrix
        } else {
            Affine2::IDENTITY
        };
        // Coordinates become S·R·(c + t). With M = S·R, t = M⁻¹ · translation.
        let m = matrix.matrix2;
        let rows = [
            Vec2::new(m.x_axis.x, m.y_axis.x),
            Vec2::new(m.x_axis.y, m.y_axis.y),
        ];
        let angle = libm::atan2f(-rows[0].y, rows[0].x);
        let mirrored = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        let scale = Vec2::new(rows[0].length(), mirrored * rows[1].length());
        let translation = m.inverse() * matrix.translation;
        let translation = match translation.is_finite() {
            true => translation,
            false => Vec2::ZERO,
        };
        self.node(
            "TextureTransform",
            vec![
                ("scale", Value::Vec2(scale)),
                ("rotation", Value::Float(angle)),
                ("translation", Value::Vec2(translation)),
            ],
        )
    }

    /// Returns the node with the colors of vertices. Those of VRML97 have no opacity.
    fn colors(&mut self, colors: &[[f32; 4]]) -> NodeId {
        let colors = colors.iter().map(|c| Vec4::from_array(*c));
        if self.options.target == Target::X3d && colors.clone().any(|c| c.w < 1.0) {
            let colors = Value::Vec4s(colors.collect());
            return self.node("ColorRGBA", vec![("color", colors)]);
        }
        let colors = Value::Vec3s(colors.map(Vec4::truncate).collect());
        self.node("Color", vec![("color", colors)])
    }
    fn geometry(&mut self, mesh: &Mesh, kind: GeometryKind) -> NodeId {
        let held = |id| Value::Node(Some(id));
        let mut fields = Vec::new();
        let points = Value::Vec3s(mesh.positions.clone());
        let coord = self.node("Coordinate", vec![("point", points)]);
        fields.push(("coord", held(coord)));
        if kind.keeps_colors && !mesh.colors.is_empty() {
            let color = self.colors(&mesh.colors);
            fields.push(("color", held(color)));
        }
        match &mesh.primitives {
            Primitives::Points => self.node("PointSet", fields),
            Primitives::Lines(lines) => {
                fields.push(("coordIndex", indices(lines)));
                self.node("IndexedLineSet", fields)
            }
            Primitives::Triangles(triangles) => {
                if !mesh.normals.is_empty() {
                    let vectors = Value::Vec3s(mesh.normals.clone());
                    let normal = self.node("Normal", vec![("vector", vectors)]);
                    fields.push(("normal", held(normal)));
                }
                if !mesh.coordinates.is_empty() {
                    let points = Value::Vec2s(mesh.coordinates.clone());
                    let coordinates = self.node("TextureCoordinate", vec![("point", points)]);
                    fields.push(("texCoord", held(coordinates)));
                }
                fields.push(("coordIndex", indices(triangles)));
                fields.push(("solid", Value::Bool(!kind.double_sided)));
                fields.push(("ccw", Value::Bool(!kind.is_mirrored)));
                self.node("IndexedFaceSet", fields)
            }
        }
    }
}

/// Returns the ambient light that the first lit material is in, color times intensity.
fn ambient_of(model: &Model) -> Vec3 {
    let lit = model.materials.iter().filter(|m| !m.unlit);
    let mut ambient = lit.filter(|m| m.ambient_part() != Vec3::ZERO);
    let found = ambient.next().map_or(Vec3::ZERO, |m| m.ambient_light);
    found.clamp(Vec3::ZERO, Vec3::ONE)
}

/// Whether a `TextureTransform` can have a matrix: its rows are orthogonal, and it can be inverted.
fn is_expressible(matrix: &Affine2) -> bool {
    let m = matrix.matrix2.as_dmat2().transpose();
    let sizes = m.x_axis.length() * m.y_axis.length();
    let is_square = m.x_axis.dot(m.y_axis).abs() <= 1e-5 * sizes;
    let offset = matrix.matrix2.inverse() * matrix.translation;
    matrix.is_finite() && is_square && sizes > 0.0 && offset.is_finite()
}

/// Returns a picture with its pixels multiplied by factors, which are limited to 0 … 1.
fn tinted<'i>(image: &'i Image, factors: Vec4) -> Cow<'i, Image> {
    if factors == Vec4::ONE {
        return Cow::Borrowed(image);
    }
    let factors = factors.clamp(Vec4::ZERO, Vec4::ONE).to_array();
    let has_color = image.has_color() || factors[..3] != [factors[0]; 3];
    let has_alpha = image.has_alpha() || factors[3] < 1.0;
    let level = |(value, factor): (u8, f32)| (f32::from(value) * factor + 0.5) as u8;
    let tint = |pixel: &[u8; 4]| std::array::from_fn(|i| level((pixel[i], factors[i])));
    Cow::Owned(Image {
        components: 1 + 2 * usize::from(has_color) + usize::from(has_alpha),
        pixels: image.pixels.iter().map(tint).collect(),
        ..image.clone()
    })
}

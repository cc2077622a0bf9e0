//! The nodes and fields that would change a picture and do not, because they are not supported,
//! with what is missing. Reports about pictures name each class once, and conversions each node.

use std::sync::OnceLock;

use ivcam_inventor::grammar::value::Value;
use ivcam_inventor::grammar::{
    CLASSES, Class, appearance, class, geo_coordinate, geo_origin, geo_separator, image_texture,
    matrix_transform, surround_scale, texture_properties, texture_unit,
    vrml97_indexed_face_set as faces97, vrml97_shape,
};
use ivcam_inventor::iv::NodeRef;
use ivcam_inventor::traversal::first_texture;
use ivcam_inventor::traversal::geo::GeoSystem;
use ivcam_inventor::traversal::state::UnitTexture;

/// The classes by name, in all dialects, and what the picture lacks.
const UNAPPLIED: [(&str, &str); 31] = [
    ("BumpMap", "surfaces are drawn without bumps"),
    ("TextureCubeMap", "its texture is not drawn"),
    ("SceneTexture2", "its texture is not drawn"),
    ("SceneTextureCubeMap", "its texture is not drawn"),
    ("TextureCombine", "textures are combined by their `model`"),
    (
        "TextureCoordinateNormalMap",
        "textures have the coordinates in force before it",
    ),
    (
        "TextureCoordinateReflectionMap",
        "textures have the coordinates in force before it",
    ),
    ("HeightMapToNormalMap", "surfaces are drawn without bumps"),
    ("ShaderProgram", "shapes are shaded as without it"),
    ("ColorIndex", "shapes have the colors of their materials"),
    ("VertexAttribute", "shapes are drawn without it"),
    ("AlphaTest", "transparent parts are blended"),
    ("DepthBuffer", "nearer shapes hide farther ones"),
    ("GradientBackground", "the background is as without it"),
    ("ImageBackground", "the background is as without it"),
    ("PyScript", "it is not run"),
    ("GeoCoordinate", "shapes with its points are not drawn"),
    ("GeoElevationGrid", "it is not drawn"),
    ("GeoLOD", "its children are not drawn"),
    ("GeoLocation", "its children are at the origin"),
    ("GeoOrigin", "positions on the globe are not converted"),
    ("GeoPositionInterpolator", "it moves nothing"),
    ("GeoViewpoint", "it is no camera"),
    ("NurbsPositionInterpolator", "it moves nothing"),
    ("CoordinateDouble", "shapes with its points are not drawn"),
    ("FogCoordinate", "fog depends on distances"),
    (
        "TextureCoordinateGenerator",
        "textures are placed by the box of the shape",
    ),
    ("LineProperties", "lines are drawn as without it"),
    ("PointProperties", "points are drawn as without it"),
    ("FillProperties", "faces are drawn as without it"),
    ("MultiTexture", "its first texture is drawn"),
];

/// A node, or a field of it, that would change the picture and is not applied.
#[derive(Clone, Copy)]
pub(super) struct Unapplied<'a> {
    /// The node.
    pub node: NodeRef<'a>,
    /// The field, or `None` for the whole node.
    pub field: Option<&'static str>,
    /// What the picture lacks, in lower case.
    pub lack: &'static str,
}

impl<'a> Unapplied<'a> {
    /// The node as a whole, unless it is applied.
    fn whole(node: NodeRef<'a>) -> Option<Self> {
        let field = None;
        lack(node).map(|lack| Self { node, field, lack })
    }

    /// Some fields of a node, with what the picture lacks.
    fn fields(
        node: NodeRef<'a>,
        fields: impl Iterator<Item = (&'static str, &'static str)>,
    ) -> impl Iterator<Item = Self> {
        fields.map(move |(field, lack)| Self {
            node,
            field: Some(field),
            lack,
        })
    }
}

/// Returns what is not applied of a node, and of the nodes in its fields that a walk does not
/// enter.
pub(super) fn unapplied(node: NodeRef<'_>) -> Vec<Unapplied<'_>> {
    let is_vrml97 = node.known_class().is_some_and(Class::is_vrml97);
    let points = node.get_node(faces97::COORD).filter(|_| is_vrml97);
    let mut found: Vec<_> = points.and_then(Unapplied::whole).into_iter().collect();
    if is_vrml97 && node.document.is_x3d() {
        if node.class_id() == Some(class::VRML97_SHAPE) {
            found.extend(of_shape(node));
        }
        let is_hidden = node.value("visible") == Some(&Value::Bool(false));
        let hidden = is_hidden.then_some(("visible", "the node is drawn"));
        found.extend(Unapplied::fields(node, hidden.into_iter()));
    }
    if has_perspective(node) {
        let lack = "shapes are drawn without the perspective of its fourth column";
        found.extend(Unapplied::fields(node, [("matrix", lack)].into_iter()));
    }
    found.extend(Unapplied::whole(node));
    found
}

/// Returns whether a node is a `MatrixTransform` that divides coordinates by a number that depends
/// on them, as one that casts a planar shadow does.
fn has_perspective(node: NodeRef<'_>) -> bool {
    node.class_id() == Some(class::MATRIX_TRANSFORM)
        && node
            .acting(matrix_transform::MATRIX)
            .is_some_and(|m| m.is_finite() && [m.x_axis.w, m.y_axis.w, m.z_axis.w] != [0.0; 3])
}

/// Returns what is not applied of the appearance and the geometry of a shape of X3D.
fn of_shape(shape: NodeRef<'_>) -> Vec<Unapplied<'_>> {
    let geometry = shape.get_node(vrml97_shape::GEOMETRY);
    let points = geometry.and_then(|g| g.get_node(faces97::TEX_COORD));
    let look = shape.get_node(vrml97_shape::APPEARANCE);
    let held = [
        appearance::LINE_PROPERTIES,
        appearance::POINT_PROPERTIES,
        appearance::FILL_PROPERTIES,
        appearance::TEXTURE,
    ]
    .map(|field| look.and_then(|look| look.get_node(field)));
    let fog = geometry.and_then(|geometry| held_node(geometry, "fogCoord"));
    let nodes = [points, fog].into_iter().chain(held).flatten();
    let mut found: Vec<_> = nodes.filter_map(Unapplied::whole).collect();
    let material = look.and_then(|look| look.get_node(appearance::MATERIAL));
    for node in [look, material].into_iter().flatten() {
        found.extend(Unapplied::fields(node, unapplied_fields(node)));
        let textures = TEXTURES_DRAWN.map(|field| held_node(node, field));
        for texture in textures.into_iter().flatten() {
            found.extend(of_texture(texture));
        }
    }
    found
}

/// The fields of appearances and materials with textures that are drawn.
const TEXTURES_DRAWN: [&str; 4] = [
    "texture",
    "diffuseTexture",
    "baseTexture",
    "emissiveTexture",
];

/// Returns the node in a field with one node.
fn held_node<'a>(node: NodeRef<'a>, field: &str) -> Option<NodeRef<'a>> {
    match node.value(field) {
        Some(Value::Node(Some(held))) => Some(node.document.node(*held)),
        _ => None,
    }
}

/// Returns what is not applied of the boundary modes of a texture, or of the first of a
/// `MultiTexture`.
fn of_texture(texture: NodeRef<'_>) -> Vec<Unapplied<'_>> {
    let Some(properties) = first_texture(texture).get_node(image_texture::TEXTURE_PROPERTIES)
    else {
        return Vec::new();
    };
    let modes = [
        ("boundaryModeS", texture_properties::BOUNDARY_MODE_S),
        ("boundaryModeT", texture_properties::BOUNDARY_MODE_T),
    ];
    let lacks = modes
        .into_iter()
        .filter_map(|(name, mode)| match properties.get(mode) {
            "MIRRORED_REPEAT" => Some((name, "textures are repeated without mirroring")),
            "CLAMP_TO_BOUNDARY" => Some((name, "textures end in the colors of their edges")),
            _ => None,
        });
    Unapplied::fields(properties, lacks).collect()
}

/// Returns what the picture lacks because a node is not applied, if it lacks anything.
fn lack(node: NodeRef<'_>) -> Option<&'static str> {
    let known = node.known_class()?;
    if known.id == class::TEXTURE_UNIT {
        let is_drawn = (0..=UnitTexture::LAST).contains(&node.get(texture_unit::UNIT));
        let is_bump = node.find(texture_unit::MAPPING_METHOD)
            == Some(texture_unit::MAPPING_METHOD_BUMP_MAPPING);
        return match (is_drawn, is_bump) {
            (false, _) => Some("the textures of its unit are not drawn"),
            (true, true) => Some("its textures are drawn as colors, not as bumps"),
            (true, false) => None,
        };
    }
    if known.id == class::SURROUND_SCALE {
        let is_on = node.get(surround_scale::NUM_NODES_UP_TO_CONTAINER) > 0;
        return is_on.then_some("what follows it keeps its size");
    }
    if let Some(words) = geo_system(node) {
        let is_known = GeoSystem::of(words).is_some();
        return (!is_known).then_some("its coordinate system is not known, and it is left out");
    }
    // A walk asks for every node, so the names are searched once for every class.
    static LACKS: OnceLock<Vec<Option<&'static str>>> = OnceLock::new();
    let of_class = |class: &Class| {
        let listed = UNAPPLIED.iter().find(|(name, _)| *name == class.name);
        listed.map(|(_, lack)| *lack)
    };
    LACKS.get_or_init(|| CLASSES.iter().map(of_class).collect())[usize::from(known.id.0)]
}

/// The names of the coordinate system of a node of Coin's that is drawn on the globe.
fn geo_system(node: NodeRef<'_>) -> Option<&[String]> {
    let field = match node.class_id()? {
        class::GEO_ORIGIN => geo_origin::GEO_SYSTEM,
        class::GEO_COORDINATE => geo_coordinate::GEO_SYSTEM,
        class::GEO_SEPARATOR => geo_separator::GEO_SYSTEM,
        _ => return None,
    };
    Some(node.get(field))
}

/// The fields of nodes of X3D that would change a picture, and what it lacks.
const UNAPPLIED_FIELDS: [(&str, &str); 10] = [
    ("normalTexture", "surfaces are drawn without bumps"),
    ("occlusionTexture", "surfaces are drawn without it"),
    ("emissiveTexture", "surfaces do not emit light by it"),
    ("specularTexture", "highlights have one color"),
    ("shininessTexture", "highlights have one size"),
    ("ambientTexture", "ambient light has one color"),
    ("metallicRoughnessTexture", "its means are used"),
    (
        "backMaterial",
        "backs of faces have the material of the front",
    ),
    (
        "separateBackColor",
        "backs of faces have the material of the front",
    ),
    ("shaders", "shapes are shaded as without it"),
];

/// Returns what the picture lacks because of fields of a node of X3D: the field, and what is
/// lacking.
fn unapplied_fields(node: NodeRef<'_>) -> impl Iterator<Item = (&'static str, &'static str)> {
    let is_used = move |name: &str| match node.value(name) {
        Some(Value::Node(held)) => held.is_some(),
        Some(Value::Nodes(list)) => !list.is_empty(),
        Some(Value::Bool(is_on)) => *is_on,
        _ => false,
    };
    let used = UNAPPLIED_FIELDS.into_iter();
    let used = used.filter(move |(name, _)| is_used(name));
    used.filter_map(move |(name, lack)| match (name, node.class_id()) {
        // The texture of an unlit material is drawn.
        ("emissiveTexture", Some(class::UNLIT_MATERIAL)) => None,
        ("emissiveTexture", Some(class::PHYSICAL_MATERIAL)) => Some((
            name,
            "surfaces emit no light, neither by it nor by `emissiveColor`",
        )),
        _ => Some((name, lack)),
    })
}

#[cfg(test)]
mod tests {
    use ivcam_inventor::grammar::{Role, Treatment};
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;

    use super::*;
    use crate::scene::model::{Model, ModelOptions};
    use crate::scene::{CompileOptions, RenderScene};

    /// Classes whose nodes are kept and change no picture by themselves.
    const ALONE: [&str; 23] = [
        "TextureProperties",
        "AudioClip",
        "Sound",
        "ShadowCulling",
        "TransparencyType",
        "TextureScalePolicy",
        "Callback",
        "EventCallback",
        "Info",
        "Label",
        "Listener",
        "CacheHint",
        "BBox",
        "VertexAttributeBinding",
        "PickStyle",
        "NavigationInfo",
        "BumpMapCoordinate",
        "BumpMapTransform",
        "GeoMetadata",
        "WorldInfo",
        "Script",
        "ShaderObject",
        "Path",
    ];
    /// Families of such classes: they hold data, move something, or answer to a user.
    const WITHOUT_EFFECT: [&str; 10] = [
        "X3DMetadata",
        "Engine",
        "Dragger",
        "InteractionKit",
        "ShaderObject",
        "ShaderParameter",
        "VRMLSensor",
        "VRMLInterpolator",
        "FieldContainer",
        "Interpolate",
    ];

    /// No class is kept without a decision whether the picture lacks something.
    #[test]
    fn every_class_that_is_kept_is_reported_or_known_to_change_no_picture() {
        for class in CLASSES.iter().filter(|c| c.treatment == Treatment::Kept) {
            let is_reported = UNAPPLIED.iter().any(|(name, _)| *name == class.name);
            let is_quiet = ALONE.contains(&class.name)
                || WITHOUT_EFFECT.iter().any(|family| class.is_a(family));
            assert!(
                is_reported || is_quiet,
                "`{}` ({}) is kept without a word",
                class.name,
                class.family
            );
        }
        for (name, _) in UNAPPLIED {
            assert!(CLASSES.iter().any(|class| class.name == name), "{name}");
        }
    }

    #[test]
    fn a_scene_with_a_node_that_is_not_applied_has_a_problem() {
        for (name, lack) in UNAPPLIED {
            // Coin's class of the same name may be drawn.
            let named = || CLASSES.iter().filter(|class| class.name == name);
            let class = named().find(|c| c.is_vrml97()).or_else(|| named().next());
            let is_vrml97 = class.is_some_and(|class| class.is_vrml97());
            let is_root = class.is_some_and(|class| class.role != Role::Held);
            if !is_root {
                continue;
            }
            let text = match (is_vrml97, name) {
                (true, "GeoCoordinate") => {
                    "#VRML V2.0 utf8\nShape { geometry PointSet { coord GeoCoordinate { } } }\n"
                        .to_owned()
                }
                (true, "GeoElevationGrid") => {
                    "#VRML V2.0 utf8\nShape { geometry GeoElevationGrid { } }\n".to_owned()
                }
                (true, _) => format!("#VRML V2.0 utf8\nGroup {{ children {name} {{ }} }}\n"),
                (false, _) => format!("#Inventor V2.1 ascii\n{name} {{ }} {name} {{ }}\n"),
            };
            let document = Document::read_headerless("a", text.into_bytes()).unwrap();
            let snapshot = Snapshot::at(&document, 0.0);
            let options = CompileOptions::default();
            let compiled = RenderScene::compile(&snapshot, &options).unwrap();
            let surveyed = RenderScene::survey(&snapshot, &options);
            for found in [&compiled.census().diagnostics, &surveyed.diagnostics] {
                let told: Vec<_> = found.iter().filter(|d| d.message.contains(lack)).collect();
                assert_eq!(told.len(), 1, "{name}: {found:?}");
            }
            let model = Model::of(&snapshot, &ModelOptions::default());
            let found = &model.not_applied;
            assert!(
                found.iter().any(|one| one.text == lack),
                "{name}: {found:?}"
            );
        }
    }

    /// Of X3D's texture properties the boundary modes are applied, but for two of them.
    #[test]
    fn parts_of_a_shape_of_x3d_that_are_not_applied_are_reported() {
        let problems_of = |text: &str| {
            let text = format!("#X3D V3.3 utf8\nPROFILE Full\nShape {{ {text} }}\n");
            let document = Document::read_headerless("a", text.into_bytes()).unwrap();
            let snapshot = Snapshot::at(&document, 0.0);
            let survey = RenderScene::survey(&snapshot, &Default::default());
            let model = Model::of(&snapshot, &ModelOptions::default());
            (survey.diagnostics.len(), model.not_applied.len())
        };
        let points = "coord Coordinate { point [0 0 0, 1 0 0, 0 1 0] }";
        let with_fog = format!("geometry TriangleSet {{ {points} fogCoord FogCoordinate {{ }} }}");
        assert_eq!(problems_of(&with_fog), (1, 1));
        for (mode, problems) in [
            ("CLAMP", 0),
            ("MIRRORED_REPEAT", 1),
            ("CLAMP_TO_BOUNDARY", 1),
        ] {
            let text = format!(
                "appearance Appearance {{ texture PixelTexture {{ image 1 1 1 0 textureProperties \
                 TextureProperties {{ boundaryModeT \"{mode}\" }} }} }} geometry Box {{ }}"
            );
            assert_eq!(problems_of(&text), (problems, problems), "{mode}");
        }
    }

    #[test]
    fn only_a_place_in_a_system_that_is_not_known_is_reported() {
        for (system, problems) in [("GD", 0), ("GD\", \"WE", 0), ("GD\", \"AA", 3), ("?", 3)] {
            let system = format!("geoSystem [ \"{system}\" ]");
            let text = format!(
                "#Inventor V2.1 ascii\nGeoOrigin {{ {system} }} GeoCoordinate {{ {system} }}
                 GeoSeparator {{ {system} Cube {{ }} }}"
            );
            let document = Document::read_headerless("a.iv", text.into_bytes()).unwrap();
            let survey = RenderScene::survey(&Snapshot::at(&document, 0.0), &Default::default());
            assert_eq!(
                survey.diagnostics.len(),
                problems,
                "{:?}",
                survey.diagnostics
            );
        }
    }

    /// In Coin a `SurroundScale` does nothing unless it says how far its container is.
    #[test]
    fn only_a_surround_scale_with_a_container_is_reported() {
        for (container, problems) in [(0, 0), (2, 1)] {
            let text = format!(
                "#Inventor V2.1 ascii\nSeparator {{ SurroundScale {{ numNodesUpToContainer {container} \
                 numNodesUpToReset 1 }} Cube {{ }} }}\n"
            );
            let document = Document::read_headerless("a", text.into_bytes()).unwrap();
            let survey = RenderScene::survey(&Snapshot::at(&document, 0.0), &Default::default());
            assert_eq!(survey.diagnostics.len(), problems);
        }
    }

    #[test]
    fn only_a_matrix_with_a_perspective_is_reported() {
        for (matrix, problems) in [
            ("4 0 0 0  0 1 0 -1  0 0 4 0  0 -3 0 3", 1),
            ("4 0 0 0  0 1 0 0  0 0 4 0  0 -3 0 3", 0),
            ("4 0 0 0  0 1 0 -1  0 0 4 0  0 -3 0 3 ~", 0),
        ] {
            let text =
                format!("#Inventor V2.1 ascii\nMatrixTransform {{ matrix {matrix} }} Cube {{ }}\n");
            let document = Document::read_headerless("a.iv", text.into_bytes()).unwrap();
            let snapshot = Snapshot::at(&document, 0.0);
            let survey = RenderScene::survey(&snapshot, &Default::default());
            assert_eq!(survey.diagnostics.len(), problems, "{matrix}");
            let model = Model::of(&snapshot, &ModelOptions::default());
            assert_eq!(model.not_applied.len(), problems, "{matrix}");
        }
    }

    #[test]
    fn only_a_texture_unit_that_is_not_drawn_is_reported() {
        for (unit, problems) in [
            ("0", 0),
            ("31", 0),
            ("32", 1),
            ("-1", 1),
            ("1 mappingMethod BUMP_MAPPING", 1),
        ] {
            let text = format!("#Inventor V2.1 ascii\nTextureUnit {{ unit {unit} }} Cube {{ }}\n");
            let document = Document::read_headerless("a.iv", text.into_bytes()).unwrap();
            let survey = RenderScene::survey(&Snapshot::at(&document, 0.0), &Default::default());
            assert_eq!(survey.diagnostics.len(), problems);
        }
    }
}

//! What a class does to a walk: its own role, or the nearest of its family's.

use std::sync::OnceLock;

use crate::grammar::{CLASSES, Class, Dialect};
use crate::iv::NodeRef;

/// What happens when the walk meets a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Nothing: sensors, engines, information, hints to a graphics library.
    Kept,
    Group,
    Separator,
    TransformSeparator,
    Switch,
    Blinker,
    PathSwitch,
    Array,
    MultipleCopy,
    Lod,
    LevelOfDetail,
    Collision,
    Kit,
    /// A kit's list of children, in a container of its own.
    ListPart,
    /// Files named by a node: their roots are its children.
    File,
    Property,
    /// VRML 97 `Background` and `Fog`: one a scene.
    Bindable,
    Light,
    Camera,
    Shape,
    /// VRML 97 `Shape`: appearance and geometry.
    AppearanceAndGeometry,
    Transform97,
    Billboard,
}

use Role as R;

/// By name; a class not listed has the role of the first listed class above it.
const ROLES: &[(&str, Role)] = &[
    ("Node", R::Kept),
    ("Group", R::Group),
    ("Separator", R::Separator),
    ("TransformSeparator", R::TransformSeparator),
    ("Switch", R::Switch),
    ("Blinker", R::Blinker),
    ("PathSwitch", R::PathSwitch),
    ("Array", R::Array),
    ("MultipleCopy", R::MultipleCopy),
    ("LOD", R::Lod),
    ("LevelOfDetail", R::LevelOfDetail),
    ("File", R::File),
    ("WWWInline", R::File),
    ("BaseKit", R::Kit),
    ("NodeKitListPart", R::ListPart),
    ("InteractionKit", R::Kept),
    ("Shape", R::Shape),
    ("Light", R::Light),
    ("Camera", R::Camera),
    ("Transformation", R::Property),
    ("Background", R::Bindable),
    ("BaseColor", R::Property),
    ("ClipPlane", R::Property),
    ("Complexity", R::Property),
    ("Coordinate3", R::Property),
    ("Coordinate4", R::Property),
    ("DrawStyle", R::Property),
    ("Environment", R::Property),
    ("Fog", R::Bindable),
    ("Font", R::Property),
    ("LightModel", R::Property),
    ("LocalFog", R::Property),
    ("Material", R::Property),
    ("MaterialBinding", R::Property),
    ("Normal", R::Property),
    ("NormalBinding", R::Property),
    ("PackedColor", R::Property),
    ("Profile", R::Property),
    ("PolygonOffset", R::Property),
    ("ProfileCoordinate2", R::Property),
    ("ProfileCoordinate3", R::Property),
    ("ShadowStyle", R::Property),
    ("ShapeHints", R::Property),
    ("Texture2", R::Property),
    ("Texture2Transform", R::Property),
    ("Texture3", R::Property),
    ("Texture3Transform", R::Property),
    ("TextureMatrixTransform", R::Property),
    ("TextureCoordinate2", R::Property),
    ("TextureCoordinate3", R::Property),
    ("TextureCoordinateBinding", R::Property),
    ("TextureCoordinateFunction", R::Property),
    ("TextureUnit", R::Property),
    ("VertexProperty", R::Property),
];

/// VRML 97 has its own rules under some of the same names.
const ROLES97: &[(&str, Role)] = &[
    ("Shape", R::AppearanceAndGeometry),
    ("Transform", R::Transform97),
    ("Group", R::Separator),
    ("Anchor", R::Separator),
    ("Collision", R::Collision),
    ("Billboard", R::Billboard),
    ("Inline", R::File),
    ("Switch", R::Switch),
    ("LOD", R::Lod),
    ("DirectionalLight", R::Light),
    ("PointLight", R::Light),
    ("SpotLight", R::Light),
    ("Viewpoint", R::Camera),
    ("Background", R::Bindable),
    ("Fog", R::Bindable),
    ("LocalFog", R::Property),
    ("Box", R::Shape),
    ("Cone", R::Shape),
    ("Cylinder", R::Shape),
    ("ElevationGrid", R::Shape),
    ("Extrusion", R::Shape),
    ("IndexedFaceSet", R::Shape),
    ("IndexedLineSet", R::Shape),
    ("PointSet", R::Shape),
    ("Sphere", R::Shape),
    ("Text", R::Shape),
    // Amendment 1: the geography is left out, the children are drawn.
    ("CoordinateDeformer", R::Separator),
    ("GeoLocation", R::Separator),
    ("NurbsGroup", R::Separator),
    ("NurbsCurve", R::Shape),
    ("NurbsSurface", R::Shape),
    ("TrimmedSurface", R::Shape),
];

/// The role of a node, by its class or by the class it says it is.
pub fn role(node: NodeRef<'_>) -> Role {
    node.known_class().map_or(Role::Kept, role_of)
}

pub fn role_of(class: &'static Class) -> Role {
    static TABLE: OnceLock<Vec<Role>> = OnceLock::new();
    TABLE.get_or_init(|| CLASSES.iter().map(find).collect())[usize::from(class.id.0)]
}

fn find(class: &'static Class) -> Role {
    if is_vrml97(class) {
        let name = class.name.strip_prefix("VRML").unwrap_or(class.name);
        return listed(ROLES97, name).unwrap_or(Role::Kept);
    }
    let mut class = class;
    loop {
        if let Some(role) = listed(ROLES, class.name) {
            return role;
        }
        match parent(class) {
            Some(above) if above.id != class.id => class = above,
            _ => return Role::Kept,
        }
    }
}

fn listed(table: &[(&str, Role)], name: &str) -> Option<Role> {
    table.iter().find(|(n, _)| *n == name).map(|(_, r)| *r)
}

fn parent(class: &Class) -> Option<&'static Class> {
    use crate::grammar::{any, by_name};
    by_name(class.family, class.dialects).or_else(|| any(class.family))
}

/// Whether the class is VRML 97's, under its own name or Coin's (`VRMLBox`).
pub fn is_vrml97(class: &Class) -> bool {
    class.dialects & Dialect::VRML97 != 0
        && class.dialects & (Dialect::IV1 | Dialect::IV2 | Dialect::VRML1) == 0
}

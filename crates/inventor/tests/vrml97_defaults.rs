//! The fields and defaults of VRML97's nodes, compared with the catalogue.
//!
//! The table is written from ISO/IEC 14772-1:1997, clause 6 (node reference), one line per node:
//! the types, names and defaults of its `field`s and `exposedField`s, in the spelling of a file. A
//! node's own text is read by the reader of files, so the expected values take another way than
//! the catalogue's.

use std::collections::BTreeSet;
use std::sync::Arc;

use ivcam_inventor::grammar::{Dialect, Value, by_name};
use ivcam_inventor::iv::{Document, Limits, NoFiles};

/// The nodes of the standard. A field is `TYPE name default`, and fields are separated by `|`.
const STANDARD: &[(&str, &str)] = &[
    (
        "Anchor",
        r#"MFNode children []|SFString description ""|MFString parameter []|MFString url []|
           SFVec3f bboxCenter 0 0 0|SFVec3f bboxSize -1 -1 -1"#,
    ),
    (
        "Appearance",
        "SFNode material NULL|SFNode texture NULL|SFNode textureTransform NULL",
    ),
    (
        "AudioClip",
        r#"SFString description ""|SFBool loop FALSE|SFFloat pitch 1.0|SFTime startTime 0|
           SFTime stopTime 0|MFString url []"#,
    ),
    (
        "Background",
        "MFFloat groundAngle []|MFColor groundColor []|MFString backUrl []|MFString bottomUrl []|
         MFString frontUrl []|MFString leftUrl []|MFString rightUrl []|MFString topUrl []|
         MFFloat skyAngle []|MFColor skyColor 0 0 0",
    ),
    (
        "Billboard",
        "SFVec3f axisOfRotation 0 1 0|MFNode children []|SFVec3f bboxCenter 0 0 0|
         SFVec3f bboxSize -1 -1 -1",
    ),
    ("Box", "SFVec3f size 2 2 2"),
    (
        "Collision",
        "MFNode children []|SFBool collide TRUE|SFVec3f bboxCenter 0 0 0|
         SFVec3f bboxSize -1 -1 -1|SFNode proxy NULL",
    ),
    ("Color", "MFColor color []"),
    ("ColorInterpolator", "MFFloat key []|MFColor keyValue []"),
    (
        "Cone",
        "SFFloat bottomRadius 1|SFFloat height 2|SFBool side TRUE|SFBool bottom TRUE",
    ),
    ("Coordinate", "MFVec3f point []"),
    (
        "CoordinateInterpolator",
        "MFFloat key []|MFVec3f keyValue []",
    ),
    (
        "Cylinder",
        "SFBool bottom TRUE|SFFloat height 2|SFFloat radius 1|SFBool side TRUE|SFBool top TRUE",
    ),
    (
        "CylinderSensor",
        "SFBool autoOffset TRUE|SFFloat diskAngle 0.262|SFBool enabled TRUE|SFFloat maxAngle -1|
         SFFloat minAngle 0|SFFloat offset 0",
    ),
    (
        "DirectionalLight",
        "SFFloat ambientIntensity 0|SFColor color 1 1 1|SFVec3f direction 0 0 -1|
         SFFloat intensity 1|SFBool on TRUE",
    ),
    (
        "ElevationGrid",
        "SFNode color NULL|SFNode normal NULL|SFNode texCoord NULL|MFFloat height []|
         SFBool ccw TRUE|SFBool colorPerVertex TRUE|SFFloat creaseAngle 0|
         SFBool normalPerVertex TRUE|SFBool solid TRUE|SFInt32 xDimension 0|SFFloat xSpacing 1.0|
         SFInt32 zDimension 0|SFFloat zSpacing 1.0",
    ),
    (
        "Extrusion",
        "SFBool beginCap TRUE|SFBool ccw TRUE|SFBool convex TRUE|SFFloat creaseAngle 0|
         MFVec2f crossSection [ 1 1, 1 -1, -1 -1, -1 1, 1 1 ]|SFBool endCap TRUE|
         MFRotation orientation 0 0 1 0|MFVec2f scale 1 1|SFBool solid TRUE|
         MFVec3f spine [ 0 0 0, 0 1 0 ]",
    ),
    (
        "Fog",
        r#"SFColor color 1 1 1|SFString fogType "LINEAR"|SFFloat visibilityRange 0"#,
    ),
    (
        "FontStyle",
        r#"MFString family "SERIF"|SFBool horizontal TRUE|MFString justify "BEGIN"|
           SFString language ""|SFBool leftToRight TRUE|SFFloat size 1.0|SFFloat spacing 1.0|
           SFString style "PLAIN"|SFBool topToBottom TRUE"#,
    ),
    (
        "Group",
        "MFNode children []|SFVec3f bboxCenter 0 0 0|SFVec3f bboxSize -1 -1 -1",
    ),
    (
        "ImageTexture",
        "MFString url []|SFBool repeatS TRUE|SFBool repeatT TRUE",
    ),
    (
        "IndexedFaceSet",
        "SFNode color NULL|SFNode coord NULL|SFNode normal NULL|SFNode texCoord NULL|
         SFBool ccw TRUE|MFInt32 colorIndex []|SFBool colorPerVertex TRUE|SFBool convex TRUE|
         MFInt32 coordIndex []|SFFloat creaseAngle 0|MFInt32 normalIndex []|
         SFBool normalPerVertex TRUE|SFBool solid TRUE|MFInt32 texCoordIndex []",
    ),
    (
        "IndexedLineSet",
        "SFNode color NULL|SFNode coord NULL|MFInt32 colorIndex []|SFBool colorPerVertex TRUE|
         MFInt32 coordIndex []",
    ),
    (
        "Inline",
        "MFString url []|SFVec3f bboxCenter 0 0 0|SFVec3f bboxSize -1 -1 -1",
    ),
    (
        "LOD",
        "MFNode level []|SFVec3f center 0 0 0|MFFloat range []",
    ),
    (
        "Material",
        "SFFloat ambientIntensity 0.2|SFColor diffuseColor 0.8 0.8 0.8|SFColor emissiveColor 0 0 0|
         SFFloat shininess 0.2|SFColor specularColor 0 0 0|SFFloat transparency 0",
    ),
    (
        "MovieTexture",
        "SFBool loop FALSE|SFFloat speed 1.0|SFTime startTime 0|SFTime stopTime 0|MFString url []|
         SFBool repeatS TRUE|SFBool repeatT TRUE",
    ),
    (
        "NavigationInfo",
        r#"MFFloat avatarSize [ 0.25, 1.6, 0.75 ]|SFBool headlight TRUE|SFFloat speed 1.0|
           MFString type [ "WALK", "ANY" ]|SFFloat visibilityLimit 0.0"#,
    ),
    ("Normal", "MFVec3f vector []"),
    ("NormalInterpolator", "MFFloat key []|MFVec3f keyValue []"),
    (
        "OrientationInterpolator",
        "MFFloat key []|MFRotation keyValue []",
    ),
    (
        "PixelTexture",
        "SFImage image 0 0 0|SFBool repeatS TRUE|SFBool repeatT TRUE",
    ),
    (
        "PlaneSensor",
        "SFBool autoOffset TRUE|SFBool enabled TRUE|SFVec2f maxPosition -1 -1|
         SFVec2f minPosition 0 0|SFVec3f offset 0 0 0",
    ),
    (
        "PointLight",
        "SFFloat ambientIntensity 0|SFVec3f attenuation 1 0 0|SFColor color 1 1 1|
         SFFloat intensity 1|SFVec3f location 0 0 0|SFBool on TRUE|SFFloat radius 100",
    ),
    ("PointSet", "SFNode color NULL|SFNode coord NULL"),
    ("PositionInterpolator", "MFFloat key []|MFVec3f keyValue []"),
    (
        "ProximitySensor",
        "SFVec3f center 0 0 0|SFVec3f size 0 0 0|SFBool enabled TRUE",
    ),
    ("ScalarInterpolator", "MFFloat key []|MFFloat keyValue []"),
    (
        "Script",
        "MFString url []|SFBool directOutput FALSE|SFBool mustEvaluate FALSE",
    ),
    ("Shape", "SFNode appearance NULL|SFNode geometry NULL"),
    (
        "Sound",
        "SFVec3f direction 0 0 1|SFFloat intensity 1|SFVec3f location 0 0 0|SFFloat maxBack 10|
         SFFloat maxFront 10|SFFloat minBack 1|SFFloat minFront 1|SFFloat priority 0|
         SFNode source NULL|SFBool spatialize TRUE",
    ),
    ("Sphere", "SFFloat radius 1"),
    (
        "SphereSensor",
        "SFBool autoOffset TRUE|SFBool enabled TRUE|SFRotation offset 0 1 0 0",
    ),
    (
        "SpotLight",
        "SFFloat ambientIntensity 0|SFVec3f attenuation 1 0 0|SFFloat beamWidth 1.570796|
         SFColor color 1 1 1|SFFloat cutOffAngle 0.785398|SFVec3f direction 0 0 -1|
         SFFloat intensity 1|SFVec3f location 0 0 0|SFBool on TRUE|SFFloat radius 100",
    ),
    ("Switch", "MFNode choice []|SFInt32 whichChoice -1"),
    (
        "Text",
        "MFString string []|SFNode fontStyle NULL|MFFloat length []|SFFloat maxExtent 0.0",
    ),
    ("TextureCoordinate", "MFVec2f point []"),
    (
        "TextureTransform",
        "SFVec2f center 0 0|SFFloat rotation 0|SFVec2f scale 1 1|SFVec2f translation 0 0",
    ),
    (
        "TimeSensor",
        "SFTime cycleInterval 1|SFBool enabled TRUE|SFBool loop FALSE|SFTime startTime 0|
         SFTime stopTime 0",
    ),
    ("TouchSensor", "SFBool enabled TRUE"),
    (
        "Transform",
        "SFVec3f center 0 0 0|MFNode children []|SFRotation rotation 0 0 1 0|SFVec3f scale 1 1 1|
         SFRotation scaleOrientation 0 0 1 0|SFVec3f translation 0 0 0|SFVec3f bboxCenter 0 0 0|
         SFVec3f bboxSize -1 -1 -1",
    ),
    (
        "Viewpoint",
        r#"SFFloat fieldOfView 0.785398|SFBool jump TRUE|SFRotation orientation 0 0 1 0|
           SFVec3f position 0 0 10|SFString description """#,
    ),
    (
        "VisibilitySensor",
        "SFVec3f center 0 0 0|SFBool enabled TRUE|SFVec3f size 0 0 0",
    ),
    ("WorldInfo", r#"MFString info []|SFString title """#),
];

/// Reads a node of one field, and returns the field's value.
fn value_in_file(class: &str, name: &str, text: &str) -> Value {
    let file = format!("#VRML V2.0 utf8\n{class} {{ {name} {text} }}\n");
    let read = Document::read("test", file.into(), Arc::new(NoFiles), &Limits::default());
    let document = read.expect("the standard's own default reads");
    let problems = document.sink.items();
    assert!(problems.is_empty(), "{class}.{name}: {problems:?}");
    let entry = &document.nodes[document.roots[0].0 as usize].fields[0];
    entry.value.clone()
}

#[test]
fn the_catalogue_has_the_fields_and_defaults_of_the_vrml97_standard() {
    assert_eq!(STANDARD.len(), 54, "clause 6 has sections 6.1 to 6.54");
    for (name, fields) in STANDARD {
        let class = by_name(name, Dialect::VRML97).unwrap_or_else(|| panic!("no class {name}"));
        let mut expected = BTreeSet::new();
        for field in fields.split('|') {
            let mut words = field.trim().splitn(3, ' ');
            let [kind, field, text] = std::array::from_fn(|_| words.next().unwrap());
            let (_, decl) = class
                .field(field)
                .unwrap_or_else(|| panic!("{name} has no field {field}"));
            assert_eq!(decl.kind.name(), kind, "{name}.{field}");
            let stated = value_in_file(name, field, text);
            assert_eq!(Value::default_of(decl), stated, "{name}.{field}");
            expected.insert(field);
        }
        let present: BTreeSet<&str> = class
            .fields
            .iter()
            .filter(|f| !f.x3d)
            .map(|f| f.name)
            .collect();
        assert_eq!(present, expected, "{name}");
    }
}

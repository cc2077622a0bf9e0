//! Documents made at random from the catalogue are the same after writing and reading.

use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3, Vec4};
use ivcam_base::diag::Span;
use ivcam_inventor::grammar::value::{Image, Plane, Rotation};
use ivcam_inventor::grammar::{CLASSES, Class, FieldDecl, FieldType, Treatment, class};
use ivcam_inventor::iv::document::FieldEntry;
use ivcam_inventor::iv::{
    ClassRef, Connection, Document, Format, Limits, NoFiles, Node, NodeId, Value,
};
use proptest::prelude::*;

/// A random number generator: splitmix64.
struct Stream(u64);

impl Stream {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn chance(&mut self, one_in: usize) -> bool {
        self.below(one_in) == 0
    }

    /// Returns a float: mostly ordinary ones, sometimes any bits at all, NaN and infinity included.
    fn float(&mut self) -> f32 {
        match self.below(4) {
            0 => f32::from_bits(self.next() as u32),
            1 => self.below(2000) as f32 - 1000.0,
            _ => (self.next() as i32) as f32 / 65536.0,
        }
    }

    fn double(&mut self) -> f64 {
        if self.chance(3) {
            f64::from_bits(self.next())
        } else {
            f64::from(self.float())
        }
    }

    fn text(&mut self) -> String {
        const CHARS: [char; 14] = [
            'a', 'B', '7', ' ', '"', '\\', '\n', '#', '{', ']', ',', 'é', '~', '\t',
        ];
        let mut text: String = (0..self.below(9))
            .map(|_| CHARS[self.below(CHARS.len())])
            .collect();
        if text.ends_with('\\') {
            // Inventor writes such strings without quotes, which not all characters can be.
            text.retain(|c| c.is_alphanumeric() || c == '\\');
        }
        text
    }

    fn many<T>(&mut self, mut one: impl FnMut(&mut Self) -> T) -> Vec<T> {
        (0..self.below(6)).map(|_| one(self)).collect()
    }

    fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.float(), self.float(), self.float())
    }

    fn vec4(&mut self) -> Vec4 {
        Vec4::new(self.float(), self.float(), self.float(), self.float())
    }

    fn rotation(&mut self) -> Rotation {
        Rotation::new(self.vec3(), self.float())
    }

    fn plane(&mut self) -> Plane {
        Plane {
            normal: self.vec3(),
            distance: self.float(),
        }
    }

    fn matrix(&mut self) -> Mat4 {
        Mat4::from_cols_array(&std::array::from_fn(|_| self.float()))
    }

    fn image(&mut self, solid: bool) -> Image {
        let (width, height) = (self.below(4) as u32, self.below(4) as u32);
        let depth = if solid { self.below(3) as u32 } else { 1 };
        let components = self.below(5) as u8;
        let count = (width * height * depth) as usize * usize::from(components);
        let bytes: Vec<u8> = (0..count).map(|_| self.next() as u8).collect();
        Image {
            width,
            height,
            depth,
            components,
            bytes: Arc::from(bytes),
        }
    }

    fn name_of(&mut self, decl: &FieldDecl) -> i32 {
        decl.names[self.below(decl.names.len())].1 as i32
    }

    /// Returns a value of the field's type; `nodes` is the number of nodes that it can refer to.
    fn value(&mut self, decl: &FieldDecl, nodes: usize) -> Value {
        use FieldType as F;
        let node = |s: &mut Self| NodeId(s.below(nodes) as u32);
        match decl.kind {
            F::SFBool => Value::Bool(self.chance(2)),
            F::SFInt32 | F::SFShort => Value::Int(self.next() as i32),
            F::SFUInt32 | F::SFUShort => Value::UInt(self.next() as u32),
            F::SFFloat => Value::Float(self.float()),
            F::SFDouble | F::SFTime => Value::Double(self.double()),
            F::SFString | F::SFName => Value::String(self.text().into()),
            F::SFEnum => Value::Int(self.name_of(decl)),
            F::SFBitMask => Value::Int(self.name_of(decl) | self.name_of(decl)),
            F::SFVec2f => Value::Vec2(Vec2::new(self.float(), self.float())),
            F::SFVec3f | F::SFColor => Value::Vec3(self.vec3()),
            F::SFVec4f => Value::Vec4(self.vec4()),
            F::SFVec2s | F::SFVec2i32 | F::SFVec3i32 | F::SFVec4i32 => {
                Value::Ints((0..decl.kind.width()).map(|_| self.next() as i32).collect())
            }
            F::SFVec3d => Value::Doubles((0..3).map(|_| self.double()).collect()),
            F::SFRotation => Value::Rotation(self.rotation()),
            F::SFMatrix => Value::Matrix(Box::new(self.matrix())),
            F::SFPlane => Value::Plane(self.plane()),
            F::SFImage => Value::Image(Box::new(self.image(false))),
            F::SFImage3 => Value::Image(Box::new(self.image(true))),
            F::SFNode | F::SFPath | F::SFEngine if nodes > 0 && !self.chance(4) => {
                Value::Node(Some(node(self)))
            }
            F::SFNode | F::SFPath | F::SFEngine => Value::Node(None),
            F::SFTrigger => Value::Trigger,
            F::MFBool => Value::Bools(self.many(|s| s.chance(2))),
            F::MFInt32 | F::MFShort => Value::Ints(self.many(|s| s.next() as i32)),
            F::MFUInt32 | F::MFUShort => Value::UInts(self.many(|s| s.next() as u32)),
            F::MFFloat => Value::Floats(self.many(Self::float)),
            F::MFDouble | F::MFTime => Value::Doubles(self.many(Self::double)),
            F::MFString | F::MFName => Value::Strings(self.many(Self::text)),
            F::MFEnum => Value::Ints(self.many(|s| s.name_of(decl))),
            F::MFVec2f => Value::Vec2s(self.many(|s| Vec2::new(s.float(), s.float()))),
            F::MFVec3f | F::MFColor => Value::Vec3s(self.many(Self::vec3)),
            F::MFVec4f => Value::Vec4s(self.many(Self::vec4)),
            F::MFVec2i32 | F::MFVec3i32 | F::MFVec4i32 => {
                let width = decl.kind.width();
                Value::Ints(self.many(|s| s.next() as i32).repeat(width))
            }
            F::MFVec3d => Value::Doubles(self.many(Self::double).repeat(3)),
            F::MFRotation => Value::Rotations(self.many(Self::rotation)),
            F::MFMatrix => Value::Matrices(self.many(Self::matrix)),
            F::MFPlane => Value::Planes(self.many(Self::plane)),
            F::MFNode if nodes > 0 => Value::Nodes(self.many(node)),
            F::MFNode => Value::Nodes(Vec::new()),
        }
    }
}

/// Returns whether a class is written as a list of fields; the others have tests in `iv.rs`.
fn plain(class: &&'static Class) -> bool {
    let special = [
        class::GATE,
        class::SELECT_ONE,
        class::CONCATENATE,
        class::GLOBAL_FIELD,
        class::PATH,
    ];
    class.treatment != Treatment::Abstract && !special.contains(&class.id)
}

/// Makes a document in which nodes refer only to nodes before them, so that there are no loops. The
/// last nodes are the roots.
#[allow(clippy::field_reassign_with_default)] // it has fields of its own
fn document(seed: u64, size: usize) -> Document {
    let mut stream = Stream(seed);
    let classes: Vec<&Class> = CLASSES.iter().filter(plain).collect();
    let mut document = Document::default();
    document.format = "Inventor V2.1 ascii".into();
    let mut engines: Vec<(NodeId, &str)> = Vec::new();
    for n in 0..size {
        let class = classes[stream.below(classes.len())];
        let mut fields = Vec::new();
        for (index, decl) in class.fields.iter().enumerate() {
            if !stream.chance(3) {
                continue;
            }
            let mut connection = None;
            if !engines.is_empty() && stream.chance(8) {
                let (from, output) = engines[stream.below(engines.len())];
                connection = Some(Box::new(Connection {
                    from,
                    output: output.into(),
                }));
            }
            fields.push(FieldEntry {
                index: index as u16,
                value: stream.value(decl, n),
                ignored: stream.chance(9),
                connection,
                span: Span::default(),
            });
        }
        let takes_children = class.is_a("Group") && class.field("children").is_none();
        let takes_children = takes_children && class.treatment == Treatment::Group && n > 0;
        let children = if takes_children {
            stream.many(|s| NodeId(s.below(n) as u32))
        } else {
            Vec::new()
        };
        let names = ["a", "b", "odd-name", "x.y", "_"];
        let name = stream
            .chance(3)
            .then(|| names[stream.below(names.len())].into());
        let id = document.add(Node {
            class: ClassRef::Known(class.id),
            name,
            fields,
            children,
            span: Span::default(),
            source: 0,
        });
        if let Some((output, _)) = class.outputs.first() {
            engines.push((id, output));
        }
    }
    let roots = 1 + stream.below(3);
    document.roots = (0..roots)
        .map(|_| NodeId((size - 1 - stream.below(size.min(4))) as u32))
        .collect();
    document
}

fn read(bytes: Vec<u8>) -> Document {
    Document::read("written.iv", bytes, Arc::new(NoFiles), &Limits::default())
        .unwrap_or_else(|e| panic!("{}", e.render(false)))
}

const PROTOS: &str = "#VRML V2.0 utf8
PROTO Inner [ field SFFloat r 1 eventIn SFFloat set_r ] { DEF s Sphere { radius IS r } }
PROTO Outer [ field SFFloat s 5 exposedField MFNode c [ Group { } ] eventIn SFVec3f move ] {
  DEF t Transform { translation 1 2 3 set_translation IS move children IS c }
  DEF k Script { url \"javascript:\" field SFFloat q IS s eventIn SFTime now eventOut SFFloat out }
  ROUTE k.out TO t.set_scale
}
EXTERNPROTO Far [ field SFBool b ] [ \"nowhere.wrl#Far\" ]
DEF o Outer { s 7 c [ Shape { geometry Inner { r 2 } } ] }
DEF p PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 1 1 1 ] }
USE o
ROUTE p.value_changed TO o.move
";

const ODDITIES: &str = "#Inventor V2.1 ascii
PathSwitch { path Path { DEF s Separator { Cube { } Cone { } } 1 1 } }
Widget { fields [ SFFloat width, MFString names, SFEnum kind, SFNode part ] isA [ \"Group\" ] width 2 kind HIGH names [ ] Cube { } }
Widget { fields [ SFFloat height ] }
Gadget { }
Text2 { string = SelectOne { type \"MFString\" index 1 input [ \"a\", \"b\" ] } . output }
Rotation { rotation = Gate { type \"MFRotation\" enable TRUE } . output }
Translation { translation = Concatenate { type \"MFVec3f\" input3 [ 1 2 3, 4 5 6 ] } . output ~ }
Blinker { on FALSE speed = GlobalField { type \"SFFloat\" pace 3 } . pace }
";

#[test]
fn protos_scripts_and_routes_are_written_as_they_were_read() {
    let document = read(PROTOS.into());
    assert_eq!(
        document.difference(&read(document.write(Format::Ascii))),
        None
    );
}

#[test]
fn protos_of_one_name_in_the_bodies_of_others_stay_there() {
    let document = read(
        "#VRML V2.0 utf8
PROTO A [ field SFFloat r 1 ] { PROTO Part [ field SFFloat q 1 ] { Sphere { radius IS q } } Shape { geometry Part { q IS r } } }
PROTO B [ ] { PROTO Part [ ] { Cone { } } Shape { geometry Part { } } }
EXTERNPROTO NurbsSurface [ field SFInt32 uOrder ] [ \"urn:one\" ]
EXTERNPROTO NurbsSurface [ field SFInt32 uOrder field SFInt32 vOrder ] [ \"urn:two\" ]
A { r 2 } B { }
DEF s Script { directOutput TRUE eventIn SFTime now field SFFloat k 3 url \"javascript:\" eventOut SFBool on field SFBool b TRUE }"
            .into(),
    );
    assert!(document.sink.items().is_empty());
    let again = read(document.write(Format::Ascii));
    assert_eq!(document.difference(&again), None);
    assert!(again.sink.items().is_empty());
}

#[test]
fn a_script_in_a_proto_whose_field_has_no_value_is_written_without_stray_ones() {
    let document = read(
        "#VRML V2.0 utf8
PROTO P [ field MFVec2f point [ ] ] { Group { children Script { field MFVec2f points IS gone eventOut SFBool b } } }
P { }"
            .into(),
    );
    let bytes = document.write(Format::Ascii);
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let words: Vec<&str> = text.split_whitespace().collect();
    let words = words.join(" ");
    assert!(words.contains("] { Group {"), "{text}");
    assert!(
        words.contains("Script { field MFVec2f points [ ] "),
        "{text}"
    );
    assert!(read(bytes).sink.items().is_empty(), "{text}");
}

/// Only `\"` is an escape in Inventor: SGI's library and Coin write back what is read here.
#[test]
fn backslashes_of_inventor_are_those_of_its_strings() {
    let document =
        |value: &str| read(format!("#Inventor V2.1 ascii\nInfo {{ string {value} }}").into());
    let string =
        |document: &Document| match document.roots().next().expect("a root").value("string") {
            Some(Value::String(string)) => string.to_string(),
            other => panic!("{other:?}"),
        };
    for (text, value) in [
        (r#""q\\"z""#, r#"q\"z"#),
        (r#""a\\b""#, r"a\\b"),
        (r#""x\n""#, r"x\n"),
        (r"c:\dir\ ", r"c:\dir\"),
    ] {
        let read_in = document(text);
        assert!(read_in.sink.items().is_empty(), "{text}");
        assert_eq!(string(&read_in), value);
        assert_eq!(string(&read(read_in.write(Format::Ascii))), value);
        assert_eq!(read_in.losses(Format::Ascii), []);
    }
    let mut blank = document("x");
    blank.nodes[0].fields[0].value = Value::String("My Files\\".into());
    let losses = blank.losses(Format::Ascii);
    assert_eq!(
        losses.iter().map(|l| l.code).collect::<Vec<_>>(),
        ["final-backslash"]
    );
    assert_eq!(string(&read(blank.write(Format::Ascii))), "My Files\\ ");
    assert_eq!(string(&read(blank.write(Format::Binary))), "My Files\\");
}

#[test]
fn paths_declared_classes_and_engines_of_any_type_are_written_as_they_were_read() {
    let document = read(ODDITIES.into());
    for format in [Format::Ascii, Format::Binary] {
        assert_eq!(
            document.difference(&read(document.write(format))),
            None,
            "{format:?}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn reading_what_was_written_gives_the_same_document(seed: u64, size in 1usize..40) {
        let document = document(seed, size);
        for format in [Format::Ascii, Format::Binary] {
            let bytes = document.write(format);
            let again = read(bytes.clone());
            let difference = document.difference(&again);
            prop_assert!(
                difference.is_none(),
                "{format:?}: {}\n{:?}\n{}",
                difference.unwrap_or_default(),
                again.sink.items().first().map(ToString::to_string),
                String::from_utf8_lossy(&bytes)
            );
        }
    }

    /// Changes, removes and inserts bytes. Reading terminates, and its result can be written and
    /// read.
    #[test]
    fn no_damage_to_a_file_makes_the_reader_panic(seed: u64, kind in 0usize..4) {
        let mut stream = Stream(seed);
        let mut bytes = match kind {
            0 => document(seed, 12).write(Format::Ascii),
            1 => document(seed, 12).write(Format::Binary),
            2 => PROTOS.into(),
            _ => ODDITIES.into(),
        };
        for _ in 0..1 + stream.below(8) {
            let at = 22 + stream.below(bytes.len().saturating_sub(22));
            let at = at.min(bytes.len() - 1);
            match stream.below(4) {
                0 => bytes[at] = stream.next() as u8,
                1 => bytes[at] = b"{}[]\"#=~.,0+-"[stream.below(13)],
                2 => drop(bytes.drain(at..(at + stream.below(9)).min(bytes.len()))),
                _ => {
                    let from = 22 + stream.below(bytes.len() - 22);
                    let piece = bytes[from..(from + stream.below(30)).min(bytes.len())].to_vec();
                    drop(bytes.splice(at..at, piece));
                }
            }
            if bytes.len() < 30 {
                break;
            }
        }
        let limits = Limits { bytes: 1 << 20, nodes: 10_000, copies: 10_000, ..Limits::default() };
        if let Ok(document) = Document::read("damaged.iv", bytes, Arc::new(NoFiles), &limits) {
            let _ = document.sink.items().iter().map(|d| d.render(false).len()).sum::<usize>();
            for format in [Format::Ascii, Format::Binary] {
                let _ = Document::read("again.iv", document.write(format), Arc::new(NoFiles), &limits);
            }
        }
    }
}

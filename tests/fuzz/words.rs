//! Dictionaries: the words that a fuzzer inserts into inputs.

use std::collections::BTreeSet;

use ivcam_inventor::grammar::CLASSES;

/// Returns an empty list, for formats that are not text.
pub(super) fn none() -> Vec<String> {
    Vec::new()
}

/// The words of scene files: headers, keywords, numbers at limits, and from the node catalogue the
/// names of classes, fields and constants.
pub(super) fn catalogue() -> Vec<String> {
    let mut words: BTreeSet<&str> = [
        "#Inventor V2.1 ascii\n",
        "#Inventor V2.1 binary\n",
        "#Inventor V1.0 ascii\n",
        "#VRML V1.0 ascii\n",
        "#VRML V2.0 utf8\n",
        "DEF a ",
        "USE a ",
        "PROTO P [ ] { } ",
        "EXTERNPROTO ",
        "ROUTE a.b TO c.d ",
        " IS ",
        "fields [ SFFloat x ] ",
        "isA [ \"Group\" ] ",
        "inputs [ ] ",
        " = USE a . ",
        "eventIn ",
        "exposedField ",
        "NULL ",
        "TRUE ",
        "~ ",
        "{ ",
        "} ",
        "[ ",
        "] ",
        "-1 ",
        "0 ",
        "1e38 ",
        "1e-45 ",
        "nan ",
        "inf ",
        "2147483647 ",
        "-2147483648 ",
        "4294967295 ",
        "0x7fffffff ",
    ]
    .into();
    for class in CLASSES {
        words.insert(class.name);
        for field in class.fields {
            words.insert(field.name);
            words.insert(field.kind.name());
            words.extend(field.names.iter().map(|(name, _)| *name));
        }
        words.extend(class.inputs.iter().chain(class.outputs).map(|e| e.0));
    }
    words.into_iter().map(str::to_owned).collect()
}

/// The words of prescriptions and glass catalogues.
pub(super) fn lens_formats() -> Vec<String> {
    let words = "SURF CURV DISZ DIAM GLAS STOP TYPE EVENASPH PARM CONI UNIT WAVM WAVL ENPD FNUM \
        RDM LEN NEW S SO SI STO K A B C CIR ASP GO THI DIM M WL REF EPD LENS RD TH AP AST GLA AIR \
        CC AD AE AF END NM CD lens_type radius thickness index surfaces schema ivlens-1 \
        curvature_per_mm semi_diameter_mm thickness_mm medium zoom iris coating [lens data] \
        [constants] [variable distances] [aspherical data] AS CM RDM;LEN axpos inf -0 1e308 1e-308 \
        nan 0 9999 N-BK7 SF2 100000000";
    words.split_whitespace().map(str::to_owned).collect()
}

/// The words of camera files.
pub(super) fn cameras() -> Vec<String> {
    let words = "PerspectiveCamera OrthographicCamera FrustumCamera FilmCamera Viewpoint { } \
        position orientation nearDistance farDistance focalDistance aspectRatio heightAngle height \
        viewportMapping ADJUST_CAMERA LEAVE_ALONE #Inventor V2.1 ascii inf nan 1e38 -1 0 1e-45";
    words.split_whitespace().map(str::to_owned).collect()
}

/// The words of timelines, films and tables.
pub(super) fn timelines() -> Vec<String> {
    let words = "frames rate shutter focus zoom aperture position orientation time f/4 inf nan 1e308 \
        200000 smooth linear diopters travel meters white sense positive negative method samples \
        seconds processor_seconds rel_rmse rel_mse , - # 1e-308 -1 0";
    words.split_whitespace().map(str::to_owned).collect()
}

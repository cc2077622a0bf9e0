//! Fuzz targets for scene files and for the files that scenes name.

use std::sync::Arc;

use ivcam_base::diag::Result;
use ivcam_inventor::iv::{Document, Format, Limits, Loader, NoFiles};
use ivcam_optics::film::Resolution;
use ivcam_render::geometry::TriangleMesh;
use ivcam_render::geometry::text::{
    Face, Fonts, Justify, SolidParts, TextOutput, TextStyle, ascii_text, pixel_text, text3,
};
use ivcam_render::render::Stop;

use ivcam::photo::{Era, IdealChoice, Optics, Plan, Session, Shading};

/// Limits that let one input take a fraction of a second.
fn limits() -> Limits {
    Limits {
        bytes: 4 << 20,
        nodes: 100_000,
        copies: 20_000,
        visits: 10_000,
        primitives: 50_000,
        ..Limits::default()
    }
}

/// Reads a scene, writes it in every format, and reads that again. The documents must be equal if
/// nothing was reported about the scene and the format can express it. A damaged scene need only be
/// readable again.
pub(super) fn scene(bytes: &[u8]) {
    let read = |bytes: Vec<u8>, limits: Limits| {
        Document::read("fuzzed.iv", bytes, Arc::new(NoFiles), &limits)
    };
    let Ok(document) = read(bytes.to_vec(), limits()) else {
        return;
    };
    for message in document.sink.items() {
        std::hint::black_box(message.render(false).len());
    }
    let formats = [Format::Ascii, Format::Binary];
    let count = if document.is_vrml97() { 1 } else { 2 };
    for format in &formats[..count] {
        let again = match read(document.write(*format), Limits::default()) {
            Ok(again) => again,
            Err(error) => panic!("written as {format:?}: {}", error.render(false)),
        };
        if document.sink.items().is_empty()
            && document.losses(*format).is_empty()
            && let Some(difference) = document.difference(&again)
        {
            panic!("written as {format:?}: {difference}");
        }
    }
}

/// Renders a scene in 16 × 12 pixels. The last byte chooses the shading model and the optics.
pub(super) fn picture(bytes: &[u8]) {
    let read = Document::read("fuzzed.iv", bytes.to_vec(), Arc::new(NoFiles), &limits());
    if let Ok(document) = read {
        render(document, Arc::default(), bytes.last().copied());
    }
}

/// Renders a scene with a texture from the bytes of a picture file.
pub(super) fn texture(bytes: &[u8]) {
    // The name counts only for a file without a signature, which is TGA.
    const SCENE: &str = "#Inventor V2.1 ascii
        PerspectiveCamera { position 0 0 5 } Texture2 { filename \"t.tga\" } Cube { }";
    let loader = Arc::new(OneFile(bytes.to_vec()));
    let document = Document::read("scene.iv", SCENE.into(), loader, &limits());
    render(document.expect("the scene is read"), Arc::default(), None);
}

/// Sets a text in the typefaces of a font file, in each of the four ways.
pub(super) fn font(bytes: &[u8]) {
    let fonts = Fonts::of_bytes(bytes);
    for own in fonts.all().take(4) {
        let style = TextStyle {
            face: Face {
                own: Some(own),
                ..Face::DEFAULT
            },
            size: 10.0,
            spacing: 1.0,
            justify: Justify::Left,
            complexity: 0.5,
        };
        let text = ["Rays & é", "ffi"];
        let mut check = |mesh: &TriangleMesh| {
            let is_finite = mesh.positions.iter().all(|p| p.is_finite());
            assert!(is_finite, "a corner is NaN");
        };
        ascii_text(&text, &style, &[], TextOutput::Batches(&mut check));
        let output = TextOutput::Batches(&mut check);
        text3(&text, &style, SolidParts::FRONT, None, 0.5, output);
        std::hint::black_box(pixel_text(&text, &style));
    }
}

/// Renders a document and checks that every pixel is a number.
fn render(document: Document, fonts: Arc<Fonts>, choice: Option<u8>) {
    let choice = usize::from(choice.unwrap_or_default());
    let mut plan = Plan::of_era(Era::Modern, "fuzzed.iv");
    plan.resolution = Resolution::new(16, 12).expect("a valid size");
    plan.stop = Stop::after(1);
    plan.limits = limits();
    plan.fonts = fonts;
    plan.shading = Shading::ALL[choice % Shading::ALL.len()];
    // Paths between white walls are long.
    plan.max_depth = Some(16);
    match choice / Shading::ALL.len() % 8 {
        0 => {}
        1 | 2 => plan.optics = Optics::Ideal(IdealChoice::default()),
        _ => plan.optics = Optics::Pinhole,
    }
    let Ok(session) = Session::with_document(plan, document) else {
        return;
    };
    for message in session.sink.items() {
        std::hint::black_box(message.render(false).len());
    }
    let exposure = session.expose(&|_progress| {});
    let picture = session.develop(&exposure, "ivcam render fuzzed.iv");
    let wrong = picture.pixels.iter().flatten().find(|x| !x.is_finite());
    assert_eq!(wrong, None, "a pixel is not a number");
}

/// A loader that gives the same bytes for every name.
#[derive(Debug)]
struct OneFile(Vec<u8>);

impl Loader for OneFile {
    fn load(&self, _: &str, reference: &str) -> Result<(String, Vec<u8>)> {
        Ok((reference.to_owned(), self.0.clone()))
    }
}

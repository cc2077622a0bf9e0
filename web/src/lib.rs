//! The program inside a web page: command lines go in, files come out.
//!
//! The page gives the program a folder of files in memory (WASI's calls for files are answered by
//! `page/files.js`). It writes the words of a command line to [`WORDS`], calls an exported function
//! with numbers, and reads the files that the function wrote. So a picture of the page is made by
//! the words that make it on a command line, and no memory is shared but files. Messages go to the
//! standard error, as on a terminal.
//!
//! Each function returns the exit code of the command, 0 for success.

use std::cell::RefCell;
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;

use ivcam::film::{Film, Region};
use ivcam::grammar::viewpoint;
use ivcam::photo::options::command_line;
use ivcam::picture::{Depth, Picture};
use ivcam::render::Exposure;
use ivcam::{Diagnostic, Document, NodeRef, Session};
use serde_json::json;

/// The words of a command line, separated by zero bytes.
const WORDS: &str = "/.page/words";
/// What a function says about its result, as JSON.
const ANSWER: &str = "/.page/answer";
/// The sums of a region, in and out.
const SUMS: &str = "/.page/sums";
/// The pixels of a region or of the picture, RGBA, 8 bits each, rows from the top.
const PIXELS: &str = "/.page/pixels";
/// The folder of the sums of all regions, whose files have the numbers from 0 as names.
const PARTS: &str = "/.page/parts";

/// The photograph that is open.
#[derive(Default)]
struct Open {
    session: Option<Session>,
    /// The whole picture so far.
    exposure: Option<Exposure>,
    /// The command line that opened it.
    command: String,
}

thread_local! {
    static OPEN: RefCell<Open> = RefCell::default();
}

type Result<T> = std::result::Result<T, Box<Diagnostic>>;

/// Returns the words of the command line.
fn words() -> Vec<OsString> {
    let text = std::fs::read_to_string(WORDS).unwrap_or_default();
    text.split('\0').map(OsString::from).collect()
}

/// Writes a file of the page.
fn write(path: &str, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes).map_err(|e| Diagnostic::io(path, &e))
}

/// Reads a file of the page.
fn read(path: &str) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|e| Diagnostic::io(path, &e))
}

/// Prints an error. Returns the exit code of a result.
fn code(result: Result<()>) -> i32 {
    let Err(error) = result else {
        return 0;
    };
    print(&error);
    2
}

/// Prints a message.
fn print(message: &Diagnostic) {
    let _ = writeln!(std::io::stderr(), "{}", message.render(false));
}

/// Does some work with the open session.
fn with_session(work: impl FnOnce(&Session) -> Result<()>) -> i32 {
    OPEN.with_borrow(|open| {
        let none = || Diagnostic::error("no photograph is open");
        code(open.session.as_ref().ok_or_else(none).and_then(work))
    })
}

/// Writes the pixels of a picture as a canvas shows them.
fn write_pixels(picture: &Picture) -> Result<()> {
    let levels = picture.levels(Depth::Eight);
    let rgba = levels.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]);
    write(PIXELS, &rgba.collect::<Vec<u8>>())
}

/// Runs a command of the program.
#[unsafe(export_name = "ivcam_run")]
extern "C" fn run() -> i32 {
    let code = ivcam::cli::run(words());
    let _ = std::io::stdout().flush();
    code
}

/// Opens the photograph of a command line, and describes it in the answer. The one that was open is
/// closed.
#[unsafe(export_name = "ivcam_open")]
extern "C" fn open() -> i32 {
    OPEN.set(Open::default());
    let words = words();
    let command = command_line(&words);
    warn_of_outputs(&words);
    let session = match ivcam::cli::open(words) {
        Ok(session) => session,
        Err(code) => return code.max(1),
    };
    let answer = describe(&session).to_string();
    OPEN.set(Open {
        session: Some(session),
        exposure: None,
        command,
    });
    code(write(ANSWER, answer.as_bytes()))
}

/// The options of what the program does beside the picture.
const BESIDE: [&str; 10] = [
    "aov",
    "checkpoint",
    "denoise",
    "every",
    "layers",
    "progress",
    "report",
    "sample-range",
    "tev",
    "write-camera",
];

/// Warns of options that do nothing on a page.
fn warn_of_outputs(words: &[OsString]) {
    let texts = words
        .iter()
        .filter_map(|word| word.to_str()?.strip_prefix("--"));
    let names = texts.map(|text| text.split_once('=').map_or(text, |(name, _)| name));
    for name in names.filter(|name| BESIDE.contains(name)) {
        let text = format!("`--{name}` does nothing on this page");
        let help = "the command line below the picture has it, for the program";
        print(&Diagnostic::warning(text).with_help(help));
    }
}

/// Describes an open photograph.
fn describe(session: &Session) -> serde_json::Value {
    let plan = &session.plan;
    let size = session
        .plan
        .region
        .map_or([plan.resolution.width, plan.resolution.height], |region| {
            [region.width, region.height]
        });
    let corner = session.plan.region.map_or([0, 0], |r| [r.left, r.top]);
    let bounds = session.scene.bounds().map(|(low, high)| {
        let world = |v: ivcam::glam::Vec3| (v.as_dvec3() + session.scene.origin).to_array();
        [world(low), world(high)]
    });
    json!({
        "size": size,
        "corner": corner,
        "samples": plan.stop.samples,
        "period": plan.pixel_sampler().period(),
        "in one part": plan.adaptive,
        "position": session.pose.position.to_array(),
        "orientation": session.pose.orientation.to_array(),
        "focal distance": session.pose.focal_distance,
        "camera": session.camera_file().ok(),
        "lens words": plan.to_lens_args(),
        "bounds": bounds,
        "choices": session.described,
        "seconds": session.seconds,
        "viewpoints": viewpoints(&session.document),
    })
}

/// Shows the open scene with the lens and the camera of another command line at once: a picture of
/// one sample per pixel whose sides are divided by a number. It is no picture of the program, which
/// compiles a scene for its camera. The photograph has to be opened again afterwards.
#[unsafe(export_name = "ivcam_preview")]
extern "C" fn preview(divisor: u32) -> i32 {
    let words = words();
    let mut plan = match ivcam::cli::plan(words) {
        Ok(plan) => plan,
        Err(code) => return code.max(1),
    };
    let side = |n: u32| (n / divisor.max(1)).max(8);
    plan.resolution.width = side(plan.resolution.width);
    plan.resolution.height = side(plan.resolution.height);
    plan.region = None;
    OPEN.with_borrow_mut(|open| {
        let Some(session) = &mut open.session else {
            return 2;
        };
        let mut shown = || {
            let size = plan.resolution;
            session.preview(plan.clone())?;
            let (_, film) = session.expose_part(Region::whole(size), 1, None)?;
            write_pixels(&Picture::develop(&film, session.plan.response.clone()))?;
            write(
                ANSWER,
                json!([size.width, size.height]).to_string().as_bytes(),
            )
        };
        code(shown())
    })
}

/// Returns the name and the description of each named `Viewpoint`.
fn viewpoints(document: &Document) -> Vec<[String; 2]> {
    let nodes = document
        .descendants()
        .filter(|n| n.class_name() == "Viewpoint");
    let described = |node: NodeRef<'_>| {
        let name = node.data().name.as_deref()?.to_owned();
        let text = node.get(viewpoint::DESCRIPTION);
        let text = if text.is_empty() { &name } else { text };
        Some([name.clone(), text.to_owned()])
    };
    nodes.filter_map(described).collect()
}

/// Adds samples to a region, up to a number per pixel, to those of the file of sums, which may be
/// empty. Writes the new sums and the pixels of the region.
#[unsafe(export_name = "ivcam_expose")]
extern "C" fn expose(left: u32, top: u32, width: u32, height: u32, samples: u32) -> i32 {
    let region = Region {
        left,
        top,
        width,
        height,
    };
    with_session(|session| {
        let before = read(SUMS)?;
        let before = (!before.is_empty()).then_some(&before[..]);
        let (sums, film): (Vec<u8>, Film) = session.expose_part(region, samples, before)?;
        write(SUMS, &sums)?;
        write_pixels(&Picture::develop(&film, session.plan.response.clone()))
    })
}

/// Joins the sums of a number of regions to the whole picture. Writes its pixels, and the report of
/// the render as the answer.
#[unsafe(export_name = "ivcam_join")]
extern "C" fn join(parts: u32) -> i32 {
    let mut whole = None;
    let joined = with_session(|session| {
        let part = |i: u32| read(&format!("{PARTS}/{i}"));
        let parts = (0..parts).map(part).collect::<Result<Vec<_>>>()?;
        let exposure = session.join_parts(parts.iter().map(Vec::as_slice))?;
        let picture = session.develop(&exposure, "");
        write_pixels(&picture)?;
        if exposure.samples >= session.plan.stop.samples {
            let warnings = [
                session.warn_without_diffraction(&picture),
                session.warn_if_black_or_clipped(&exposure.counts, &picture),
            ];
            warnings.iter().flatten().for_each(|warning| print(warning));
        }
        let report = session.report(&exposure);
        let answer = json!({ "report": report, "line": report.line() });
        whole = Some(exposure);
        write(ANSWER, answer.to_string().as_bytes())
    });
    OPEN.with_borrow_mut(|open| open.exposure = whole);
    joined
}

/// Writes the whole picture to the file that the words name.
#[unsafe(export_name = "ivcam_save")]
extern "C" fn save() -> i32 {
    let words = words();
    OPEN.with_borrow(|open| {
        let (Some(session), Some(exposure)) = (&open.session, &open.exposure) else {
            return code(Err(Diagnostic::error("there is no picture yet")));
        };
        let picture = session.develop(exposure, &open.command);
        let path = words.first().map(Path::new).unwrap_or(Path::new(""));
        code(picture.save(path, session.plan.depth))
    })
}

/// Draws the section of the lens with rays of the pixel at a place of the picture (x and y from 0
/// to 1), as SVG, into the answer. Returns 1 if the camera has no lens.
#[unsafe(export_name = "ivcam_section")]
extern "C" fn section(x: f64, y: f64, width: f64, height: f64) -> i32 {
    OPEN.with_borrow(|open| {
        let drawn = open.session.as_ref();
        let drawn = drawn.and_then(|s| s.ray_section([x, y], [width, height]));
        drawn.map_or(1, |svg| code(write(ANSWER, svg.as_bytes())))
    })
}

/// Returns the distance in meters of what is visible at a place of the picture (x and y from 0 to
/// 1), as focus distances are measured; NaN if nothing is.
#[unsafe(export_name = "ivcam_distance")]
extern "C" fn distance(x: f64, y: f64) -> f64 {
    OPEN.with_borrow(|open| {
        let visible = open.session.as_ref().and_then(|s| s.visible_at(x, y));
        visible.map_or(f64::NAN, |visible| visible.distance)
    })
}

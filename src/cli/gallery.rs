//! `ivcam gallery`: one scene through every lens that comes with the program, as pictures, a page
//! and a contact sheet.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::{ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result, Sink};
use ivcam_base::files::{escaped, write_whole};
use ivcam_optics::film::FilmFormat;
use ivcam_optics::lens::{Lens, shipped_names};
use ivcam_optics::picture::{Depth, Picture};
use ivcam_optics::prescription::About;

use super::folder_mode::{FileProgress, create_folder, refuse_standard_output};
use super::render::{on_threads, plan, set_arithmetic, threads};
use super::render_outputs::listed;
use super::{ERROR, flags, scene_argument, text, value};
use crate::compare::sheet::{ComparisonSheet, ContactPicture, format_of};
use crate::photo::options::command_line;
use crate::photo::{Era, LensChoice, Optics, Plan, Session};

/// The options of one picture through one lens.
const OF_ONE: [&str; 9] = [
    "lens",
    "efl",
    "fov",
    "zoom",
    "zoom-position",
    "film",
    "report",
    "progress",
    "region",
];
/// The pictures in a row of the contact sheet.
const COLUMNS: usize = 6;
/// The style of the page.
const STYLE: &str = "body{font:15px/1.4 sans-serif;margin:2em;background:#202022;color:#e6e6e1}\
    main{display:grid;gap:1.2em;grid-template-columns:repeat(auto-fill,minmax(15em,1fr))}\
    figure{margin:0}img{width:100%;height:auto}b{font-weight:600}";

/// A lens of the gallery, with its picture or the reason why there is none.
struct GalleryEntry {
    name: &'static str,
    /// The name of the design.
    title: String,
    /// Focal length, f-number and field.
    facts: String,
    picture: Result<Picture>,
}

/// Returns the definition of the command.
pub(crate) fn command() -> Command {
    Command::new("gallery")
        .about("Photographs one scene through every lens that comes with the program")
        .args(flags::photograph().map(|arg| listed(arg, "gallery", &OF_ONE)))
        .after_help(flags::MORE)
        .mut_arg("output", |arg| {
            arg.value_name("FOLDER")
                .help("folder of the gallery, which gets a picture for each lens and index.html")
        })
        .arg(value(
            "sheet",
            "FILE",
            "also writes the pictures on one sheet: .png, .jpg, .tiff or .bmp",
        ))
        .arg(scene_argument())
}

/// Runs the command and returns the exit code.
///
/// # Errors
/// Returns an error if an option is invalid, if the scene cannot be read, or if a file cannot be
/// written. A lens that cannot photograph the scene is named instead, with exit code 2.
pub(crate) fn run(m: &ArgMatches, words: &[std::ffi::OsString]) -> Result<i32> {
    let Some(folder) = text(m, "output").map(PathBuf::from) else {
        let error = Diagnostic::error("a gallery has no folder to be in");
        return Err(error.with_help("name one with `-o FOLDER`"));
    };
    refuse_standard_output(&folder)?;
    if let Some(option) = OF_ONE.into_iter().find(|option| text(m, option).is_some()) {
        let error =
            format!("`--{option}` is for one picture, and a gallery is made through all lenses");
        return Err(Diagnostic::unsupported(error).with_help("leave it out, or use `ivcam render`"));
    }
    let sheet_file = text(m, "sheet").map(Path::new);
    sheet_file.map(format_of).transpose()?;
    set_arithmetic(m)?;
    let plan = plan(m, Era::Modern)?;
    create_folder(&folder)?;
    let (threads, command) = (threads(m)?, command_line(words));
    let progress = FileProgress::new(shipped_names().count(), m.get_flag("quiet"));
    let mut entries = Vec::new();
    for name in shipped_names() {
        let entry = on_threads(threads, || GalleryEntry::of(name, &plan, &command))?;
        let path = folder.join(format!("{name}.png"));
        if let Ok(picture) = &entry.picture {
            picture.save(&path, Depth::Eight)?;
        }
        let line = entry
            .picture
            .as_ref()
            .err()
            .map(|error| format!("{name}: {error}"));
        progress.done(name, line.as_deref());
        entries.push(entry);
    }
    progress.clear();
    let page = page(&plan.scene, &entries);
    write_whole(&folder.join("index.html"), |file| {
        file.write_all(page.as_bytes())
    })?;
    if let Some(path) = sheet_file {
        let bytes = sheet(&entries).encode(path)?;
        write_whole(path, |file| file.write_all(&bytes))?;
    }
    let failed = entries
        .iter()
        .filter(|entry| entry.picture.is_err())
        .count();
    Ok(if failed > 0 { ERROR } else { 0 })
}

impl GalleryEntry {
    /// Photographs the scene of a plan through a lens that comes with the program, on film of the
    /// size that the lens was made for.
    fn of(name: &'static str, plan: &Plan, command: &str) -> Self {
        let (mut title, mut facts) = (name.to_owned(), String::new());
        let mut photograph = || {
            let choice = match &plan.optics {
                Optics::Lens(choice) => LensChoice {
                    name: name.into(),
                    ..choice.clone()
                },
                _ => LensChoice::of_era(plan.era, name),
            };
            let lens = choice.open(&mut Sink::new())?;
            let about = About::of(lens.prescription());
            let film = film_of(&lens, &about);
            facts = facts_of(&lens, &about);
            title = about.title.unwrap_or_else(|| name.to_owned());
            let plan = Plan {
                optics: Optics::Lens(choice),
                film,
                ..plan.clone()
            };
            let session = Session::open_once(plan)?;
            let exposure = session.expose(&|_| ());
            Ok(session.develop_last(exposure, command))
        };
        let picture = photograph();
        Self {
            name,
            title,
            facts,
            picture,
        }
    }
}

/// Returns a film of 3:2 whose diagonal is the image that a lens was made for: as its file states
/// it, or as chief rays of the stated field arrive, or else 36×24 mm.
fn film_of(lens: &Lens, about: &About) -> FilmFormat {
    let by_field = || {
        let angle = 0.5 * about.field_degrees?.to_radians();
        let focal = lens.first_order().focal?;
        lens.image_height(angle, focal.efl.abs() * angle, focal.rear_focal_point)
    };
    let height = about.image_height.or_else(by_field).map(f64::abs);
    let Some(height) = height.filter(|height| height.is_finite() && *height > 0.0) else {
        return FilmFormat::STANDARD;
    };
    let unit = 2.0 * height / libm::sqrt(13.0);
    FilmFormat {
        width: 3.0 * unit,
        height: 2.0 * unit,
    }
}

/// Returns the focal length, the f-number, and the field that the file states.
fn facts_of(lens: &Lens, about: &About) -> String {
    let mut facts = Vec::new();
    if let Some(optics) = lens.first_order().focal {
        facts.push(format!("{:.1} mm", optics.efl));
    }
    if let Some(number) = lens.real_f_number() {
        facts.push(format!("f/{number:.1}"));
    }
    if let Some(field) = about.field_degrees {
        facts.push(format!("{field:.0} deg"));
    }
    facts.join(" ")
}

/// Draws the contact sheet.
fn sheet(entries: &[GalleryEntry]) -> ComparisonSheet {
    let pictures: Vec<ContactPicture> = entries
        .iter()
        .filter_map(|entry| {
            let picture = entry.picture.as_ref().ok()?;
            Some(ContactPicture {
                width: picture.width as usize,
                levels: picture.levels(Depth::Eight),
                lines: [entry.name.to_owned(), entry.facts.clone()],
            })
        })
        .collect();
    ComparisonSheet::of_pictures(&pictures, COLUMNS)
}

/// Returns the page, which needs neither a network nor scripts.
fn page(scene: &Path, entries: &[GalleryEntry]) -> String {
    let title = format!("{} through {} lenses", scene.display(), entries.len());
    let title = escaped(&title);
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n<h1>{title}</h1>\n<main>\n"
    );
    for entry in entries {
        let (name, label) = (entry.name, escaped(&entry.title));
        let picture = match &entry.picture {
            Ok(_) => format!("<a href=\"{name}.png\"><img src=\"{name}.png\" alt=\"{name}\"></a>"),
            Err(error) => format!("<p>{}</p>", escaped(&error.message)),
        };
        let facts = escaped(&entry.facts);
        let _ = writeln!(
            page,
            "<figure>{picture}<figcaption><b>{name}</b> {label}<br>{facts}</figcaption></figure>"
        );
    }
    page + "</main>\n</html>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gallery_has_a_picture_through_every_lens() {
        let folder = std::env::temp_dir().join(format!("ivcam-gallery-{}", std::process::id()));
        create_folder(&folder).expect("a folder");
        let scene = folder.join("scene.iv");
        let text = "#Inventor V2.1 ascii\nPerspectiveCamera { position 0 0 4 focalDistance 3 }\n\
            BaseColor { rgb 1 1 1 } Cube { }\n";
        std::fs::write(&scene, text).expect("the scene can be written");
        let line = format!(
            "ivcam gallery {0}/scene.iv -o {0}/out --size 24x16 --samples 4 \
            --shading flat --quiet --sheet {0}/sheet.png",
            folder.display()
        );
        let words: Vec<std::ffi::OsString> = line.split(' ').map(Into::into).collect();
        let matches = Command::new("ivcam").subcommand(command());
        let matches = matches
            .try_get_matches_from(&words)
            .expect("the line is right");
        let (_, matches) = matches.subcommand().expect("a command");
        assert_eq!(run(matches, &words).expect("a gallery"), 0);
        let page = std::fs::read_to_string(folder.join("out/index.html")).expect("a page");
        for name in shipped_names() {
            let path = folder.join(format!("out/{name}.png"));
            let raster = ivcam_optics::picture::Raster::open(&path).expect("a picture");
            assert_eq!((raster.width, raster.height), (24, 16), "{name}");
            assert!(page.contains(&format!("<img src=\"{name}.png\"")), "{name}");
        }
        assert!(page.contains("<b>double-gauss</b>") && page.contains("f/2.0"));
        let sheet =
            ivcam_optics::picture::Raster::open(&folder.join("sheet.png")).expect("a sheet");
        let rows = shipped_names().count().div_ceil(COLUMNS) as u32;
        assert_eq!((sheet.width, sheet.height), (10 + 6 * 34, 10 + rows * 48));
        std::fs::remove_dir_all(folder).unwrap();
    }
}

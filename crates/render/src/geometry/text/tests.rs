use glam::Vec2;

use super::glyph::{Typeface, length};
use super::layout::layout;
use super::letters::LetterOrder;
use super::letters::MAX_GLYPHS;
use super::vrml97::{ABOVE, vrml97_layout};
use super::*;
use crate::geometry::TriangleMesh;

/// Joins the meshes that `draw` passes on.
fn joined<T>(draw: impl FnOnce(&mut dyn FnMut(&TriangleMesh)) -> T) -> (TriangleMesh, T) {
    let mut all = TriangleMesh::default();
    let laid = draw(&mut |mesh| {
        let first = all.positions.len() as u32;
        all.positions.extend(&mesh.positions);
        all.normals.extend(&mesh.normals);
        all.texcoords.extend(&mesh.texcoords);
        all.parts.extend(&mesh.parts);
        let triangles = mesh.triangles.iter();
        all.triangles
            .extend(triangles.map(|t| t.map(|i| first + i)));
    });
    (all, laid)
}

fn text3<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle<'_>,
    parts: SolidParts,
    profile: Option<&[Vec2]>,
    crease_angle: f32,
) -> (TriangleMesh, Layout) {
    joined(|draw| {
        super::text3(
            strings,
            style,
            parts,
            profile,
            crease_angle,
            TextOutput::Batches(draw),
        )
    })
}

fn ascii_text<S: AsRef<str>>(
    strings: &[S],
    style: &TextStyle<'_>,
    widths: &[f32],
) -> (TriangleMesh, Layout) {
    joined(|draw| super::ascii_text(strings, style, widths, TextOutput::Batches(draw)))
}

#[test]
fn a_long_text_is_passed_on_in_batches_with_the_glyphs_of_a_short_one() {
    let style = style("Helvetica", 1.0);
    let (one, _) = text3(&["ab"], &style, SolidParts::ALL, None, 0.0);
    let (mut largest, mut triangles) = (0, 0);
    let line = "ab".repeat(500);
    let mut draw = |mesh: &TriangleMesh| {
        assert!(mesh.is_sound());
        largest = largest.max(mesh.triangles.len());
        triangles += mesh.triangles.len();
    };
    let output = TextOutput::Batches(&mut draw);
    super::text3(&[line], &style, SolidParts::ALL, None, 0.0, output);
    assert_eq!(triangles, 500 * one.triangles.len());
    assert!(
        largest < 10_000 && largest < triangles / 2,
        "{largest} of {triangles}"
    );
}

#[test]
fn a_text_with_too_many_characters_says_so() {
    let cut = |lines: &[String]| layout(lines, &style("Courier", 1.0)).is_cut;
    let most = "a".repeat(MAX_GLYPHS);
    assert!(!cut(std::slice::from_ref(&most)));
    assert!(cut(&[most.clone(), "b".to_owned()]));
    assert!(cut(&[most + "b"]));
}

fn style(name: &str, size: f32) -> TextStyle<'_> {
    TextStyle {
        face: Face::named(name),
        size,
        spacing: 1.0,
        justify: Justify::Left,
        complexity: 0.5,
    }
}

fn every_face() -> impl Iterator<Item = Face<'static>> {
    [Family::Serif, Family::Sans, Family::Mono]
        .into_iter()
        .flat_map(|f| (0..4).map(move |s| Face::plain(f, s & 1 != 0, s & 2 != 0)))
}

#[test]
fn typefaces_are_found_by_the_names_in_files() {
    let face = Face::named("Helvetica-BoldOblique");
    assert_eq!(
        (face.family, face.bold, face.italic),
        (Family::Sans, true, true)
    );
    assert_eq!(Face::named("Times New Roman").family, Family::Serif);
    assert_eq!(Face::named("Courier").family, Family::Mono);
    assert_eq!(Face::named("defaultFont"), Face::DEFAULT);
    assert!(Face::named("Times-Roman:Bold Italic").bold);
}

/// The letter I of a sans-serif font is one rectangle, so its area and volume are known.
#[test]
fn an_extruded_i_is_a_box_facing_outward() {
    let (mesh, _) = text3(&["I"], &style("Helvetica", 2.0), SolidParts::ALL, None, 0.0);
    assert!(mesh.is_sound());
    assert_eq!(mesh.triangles.len(), 12);
    let (lo, hi) = mesh.bounds().unwrap();
    assert_eq!((lo.z, hi.z), (-1.0, 0.0));
    let size = (hi - lo).as_dvec3();
    let volume = size.x * size.y * size.z;
    assert!(
        (mesh.volume() - volume).abs() < 1e-6 * volume,
        "{}",
        mesh.volume()
    );
    for (i, t) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let normal = mesh.normals[t[0] as usize];
        assert!(
            (b - a).cross(c - a).dot(normal) > 0.0,
            "triangle {i} faces its normal"
        );
    }
}

/// The sides and the faces meet without gaps only if outlines and fills agree. The volume is then
/// the area of the face times the depth. Letters that are overlapped by their accents are left out,
/// because the overlap would be counted twice.
#[test]
fn every_glyph_is_closed_and_faces_outward() {
    let all: String = (' '..='~').chain('\u{a1}'..='\u{ff}').collect();
    for face in every_face() {
        let style = TextStyle {
            face,
            ..style("", 1.0)
        };
        for c in all.chars().filter(|c| !"ÅÇç".contains(*c)) {
            let line = [c.to_string()];
            let (mesh, _) = text3(&line, &style, SolidParts::ALL, None, 0.0);
            let (front, _) = text3(&line, &style, SolidParts::FRONT, None, 0.0);
            assert!(mesh.is_sound(), "{c} {face:?}");
            let difference = (mesh.volume() - front.area()).abs();
            assert!(difference < 2e-4, "{c} {face:?}: {difference}");
        }
    }
}

#[test]
fn a_profile_bevels_outward_and_ends_at_its_depth() {
    let profile = [
        Vec2::ZERO,
        Vec2::splat(0.05),
        Vec2::new(0.25, 0.05),
        Vec2::new(0.3, 0.0),
    ];
    let sans = style("Helvetica", 1.0);
    let (plain, _) = text3(&["I"], &sans, SolidParts::ALL, None, 0.0);
    let (mesh, _) = text3(&["I"], &sans, SolidParts::ALL, Some(&profile), 0.0);
    let ((p0, p1), (lo, hi)) = (plain.bounds().unwrap(), mesh.bounds().unwrap());
    assert!((lo.x - (p0.x - 0.05)).abs() < 1e-6 && (hi.y - (p1.y + 0.05)).abs() < 1e-6);
    assert_eq!((lo.z, hi.z), (-0.3, 0.0));
    assert!(mesh.volume() > 0.0);
}

/// The expected widths are those of Coin's bounding boxes at size 10.
#[test]
fn lines_are_as_long_as_coins() {
    for (name, text, width) in [
        ("Times-Roman", "H", 7.25),
        ("Times-Roman:Bold", "H", 7.75),
        ("Helvetica", "HH", 14.5),
        ("Helvetica", "gx", 10.5),
        ("Courier", "gx", 12.0),
    ] {
        let laid = layout(&[text], &style(name, 10.0));
        assert!((laid.right - width).abs() < 1e-4, "{name}: {}", laid.right);
    }
}

#[test]
fn lines_are_spaced_by_size_and_justified() {
    let base = TextStyle {
        spacing: 2.0,
        justify: Justify::Right,
        ..style("Courier", 10.0)
    };
    let laid = layout(&["ab", "", "c"], &base);
    let places: Vec<_> = laid
        .glyphs
        .iter()
        .map(|g| (g.origin.x, g.origin.y))
        .collect();
    assert_eq!(places, [(-12.0, 0.0), (-6.0, 0.0), (-6.0, -40.0)]);
}

#[test]
fn a_stated_width_compresses_and_expands_a_line_and_its_letters() {
    let sans = style("Helvetica", 1.0);
    let extent = |text: &str, widths: &[f32]| {
        let (mesh, laid) = ascii_text(&[text], &sans, widths);
        let (low, high) = mesh.bounds().unwrap();
        (low.x, high.x, laid.right)
    };
    let (left, right, natural) = extent("HIH", &[]);
    for wanted in [4.0_f32, 0.9, 0.1] {
        let (low, high, end) = extent("HIH", &[wanted]);
        let scale = wanted / natural;
        assert!((low - scale * left).abs() < 1e-5, "{wanted}: {low}");
        assert!((high - scale * right).abs() < 1e-5, "{wanted}: {high}");
        assert!((end - wanted).abs() < 1e-5);
    }
}

/// Returns the characters of a text that have outlines in a typeface.
fn drawn(text: &str, face: Face<'_>) -> String {
    let typeface = Typeface::open(face);
    let has_outlines = |c: &char| !typeface.outlines(*c, 1e-3).is_empty();
    text.chars().filter(has_outlines).collect()
}

#[test]
fn a_text_of_the_first_characters_opens_no_other_typeface() {
    let all: String = (' '..='~').chain('\u{a0}'..='\u{ff}').collect();
    for face in every_face() {
        let typeface = Typeface::open(face);
        assert_eq!(typeface.line(&all, LetterOrder::Visual, 1.0).len(), 191);
        assert_eq!(typeface.others_opened(), 0, "{face:?}");
        typeface.line("ř", LetterOrder::Visual, 1.0);
        assert!(typeface.others_opened() > 0);
    }
}

#[test]
fn every_letter_of_other_alphabets_is_drawn() {
    for word in [
        "Příklad",
        "Жук",
        "Ελληνικά",
        "עברית",
        "Հայերեն",
        "ქართული",
        "Tiếng",
    ] {
        for face in every_face().chain([Face::DEFAULT]) {
            assert_eq!(drawn(word, face), word, "{face:?}");
        }
    }
    let symbols = "€№½→…≤∑√∞■★";
    assert_eq!(drawn(symbols, Face::DEFAULT), symbols);
    assert_eq!(drawn("\u{2003}\u{3000}", Face::DEFAULT), "");
}

/// The expected advances are those that fontTools reads from the fonts before they were reduced.
/// Advances of the text's own design are rounded to fortieths.
#[test]
fn lines_have_the_advances_of_the_fonts() {
    let width = |name: &str, text: &str| {
        let line = Typeface::open(Face::named(name)).line(text, LetterOrder::Visual, 1.0);
        length(&line)
    };
    let sans = |units: f32| units / 2048.0;
    for (name, text, expected) in [
        ("Helvetica", "Жש→", sans(2206.0 + 1451.0 + 1716.0)),
        ("Helvetica-Bold", "Ж", sans(2507.0)),
        ("Courier", "Ж", sans(1233.0)),
        ("Times", "ЖΩ", 0.9 * sans(2301.0 + 1698.0)),
        ("Helvetica", "ř€", (13.0 + 22.0) / 40.0),
        ("Times-Bold", "ř€", (18.0 + 20.0) / 40.0),
        ("Times", "你", 0.6),
        ("Times", "\u{3000}", 0.25),
    ] {
        let found = width(name, text);
        assert!(
            (found - expected).abs() < 1e-5,
            "{name} {text}: {found}, {expected}"
        );
    }
}

/// The box is 0.48 by 0.7 of the size, with lines of 0.05.
#[test]
fn a_box_stands_for_a_letter_without_a_glyph() {
    let area = 0.48 * 0.7 - 0.38 * 0.6;
    for (face, scale) in [(Face::named("Courier"), 1.0), (Face::DEFAULT, 10.0 / 9.0)] {
        let style = TextStyle {
            face,
            ..style("", 3.0)
        };
        let (mesh, laid) = text3(&["你"], &style, SolidParts::ALL, None, 0.0);
        let expected = area * scale * scale * 9.0;
        assert!((mesh.volume() - expected).abs() < 1e-5, "{}", mesh.volume());
        assert!((f64::from(laid.right) - 3.0 * 0.6 * scale).abs() < 1e-5);
    }
}

/// Unicode has no composed letter for these, and the accent has no place of its own in the line.
#[test]
fn an_accent_is_over_the_middle_of_its_letter() {
    for face in every_face().chain([Face::DEFAULT]) {
        let typeface = Typeface::open(face);
        let middle = |c| {
            let outlines = typeface.outlines(c, 1e-3);
            let x = outlines.iter().flatten().map(|p| p.x);
            let (left, right) = x.fold((9.0f32, -9.0f32), |(l, r), x| (l.min(x), r.max(x)));
            0.5 * (left + right)
        };
        let line = typeface.line("x\u{302}q\u{303}", LetterOrder::Visual, 2.0);
        let plain = typeface.line("xq", LetterOrder::Visual, 2.0);
        assert_eq!(length(&line), length(&plain));
        assert_eq!(
            typeface.ink_width(&line, 2.0),
            typeface.ink_width(&plain, 2.0)
        );
        let over = line[1].over.expect("a mark");
        let off = over + 2.0 * middle('\u{302}') - 2.0 * middle('x');
        assert!(off.abs() < 1e-5, "{face:?}: {off}");
    }
}

#[test]
fn accents_stay_on_their_letters_in_stretched_lines() {
    let offset = |laid: &Layout| laid.glyphs[1].origin - laid.glyphs[0].origin;
    let text = ["x\u{302}x"];
    let style = &Vrml97Style::DEFAULT;
    let natural = vrml97_layout(&text, style, &[], 0.0);
    let wide = vrml97_layout(&text, style, &[5.0], 0.0);
    assert!(wide.right > 4.9 && offset(&wide) == offset(&natural));
    let narrow = vrml97_layout(&text, style, &[0.5 * natural.right], 0.0);
    assert!((offset(&narrow) - 0.5 * offset(&natural)).length() < 1e-6);
    let down = Vrml97Style {
        horizontal: false,
        ..*style
    };
    let down = vrml97_layout(&text, &down, &[], 0.0);
    assert!((offset(&down) - offset(&natural)).length() < 1e-6);
    let step = down.glyphs[2].origin.y - down.glyphs[0].origin.y;
    assert!((step + 1.0).abs() < 1e-6, "{step}");
}

/// The first letter of the word, shin, is at the right whichever way the text advances.
#[test]
fn a_hebrew_word_begins_at_the_right() {
    let leftward = Vrml97Style {
        left_to_right: false,
        ..Vrml97Style::DEFAULT
    };
    for laid in [
        layout(&["שלום"], &style("Times", 1.0)),
        vrml97_layout(&["שלום"], &Vrml97Style::DEFAULT, &[], 0.0),
        vrml97_layout(&["שלום"], &leftward, &[], 0.0),
    ] {
        let mut glyphs = laid.glyphs;
        glyphs.sort_by(|a, b| b.origin.x.total_cmp(&a.origin.x));
        let read: String = glyphs.iter().map(|glyph| glyph.character).collect();
        assert_eq!(read, "שלום");
    }
}

/// Joined letters touch: the word has no vertical line that meets none of its letters.
#[test]
fn the_letters_of_an_arabic_word_touch() {
    let (mesh, laid) = ascii_text(&["سلم"], &style("Helvetica", 1.0), &[]);
    assert_eq!(laid.glyphs.len(), 3);
    let mut spans: Vec<(f32, f32)> = (mesh.triangles.iter())
        .map(|t| t.map(|i| mesh.positions[i as usize].x))
        .map(|[a, b, c]| (a.min(b).min(c), a.max(b).max(c)))
        .collect();
    spans.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut end = spans[0].1;
    for (from, to) in spans {
        assert!(from <= end + 1e-4, "a gap at {end} to {from}");
        end = end.max(to);
    }
}

#[test]
fn text2_places_other_letters_like_the_first_ones() {
    for name in ["Courier", ""] {
        let style = style(name, 20.0);
        let plain = pixel_text(&["xx"], &style);
        let accents = pixel_text(&["x\u{302}x"], &style);
        assert_eq!(accents.width, plain.width, "{name}");
        assert!(accents.height > plain.height);
        // A Cyrillic letter of Courier is as wide as a Latin one.
        let centered = TextStyle {
            justify: Justify::Center,
            ..style
        };
        let anchor = |text| pixel_text(&[text], &centered).anchor;
        assert_eq!(anchor("ЖЖЖ"), anchor("xxx"), "{name}");
        assert!(!pixel_text(&["你"], &style).missing.is_empty());
    }
}

#[test]
fn a_text_of_every_character_is_laid_out() {
    let all: String = ('\0'..=char::MAX).collect();
    let laid = layout(&[all], &style("Times", 1.0));
    assert!(laid.is_cut && laid.right.is_finite());
}

#[test]
fn vrml97_aligns_lines_on_both_axes() {
    let middle = Vrml97Style::DEFAULT.justified(&["MIDDLE", "MIDDLE"]);
    let laid = vrml97_layout(&["HH", "HH"], &middle, &[], 0.0);
    assert!((laid.left + laid.right).abs() < 1e-6);
    let ys: Vec<f32> = laid.glyphs.iter().map(|g| g.origin.y).collect();
    let center = 0.5 * (ys[0] + ABOVE + ys[2] - (1.0 - ABOVE));
    assert!(center.abs() < 1e-6, "{center}");
    let squeezed = vrml97_layout(&["HHHH", "HH"], &Vrml97Style::DEFAULT, &[], 1.0);
    assert!((squeezed.right - 1.0).abs() < 1e-6);
}

#[test]
fn wrong_values_give_valid_meshes() {
    for size in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let odd = TextStyle {
            complexity: f32::NAN,
            ..style("Times", size)
        };
        let (mesh, _) = text3(
            &["a\u{1F600}\n"],
            &odd,
            SolidParts::ALL,
            Some(&[Vec2::NAN]),
            f32::NAN,
        );
        assert!(
            mesh.triangles
                .iter()
                .flatten()
                .all(|&i| (i as usize) < mesh.positions.len())
        );
    }
    assert_eq!(
        text3::<&str>(&[], &style("", 1.0), SolidParts::ALL, None, 0.0).0,
        TriangleMesh::default()
    );
    let long = "x".repeat(MAX_GLYPHS + 5);
    assert_eq!(layout(&[long], &style("", 1.0)).glyphs.len(), MAX_GLYPHS);
}

use glam::Vec2;

use super::glyph::MAX_GLYPHS;
use super::layout::layout;
use super::vrml97::{ABOVE, vrml97_layout};
use super::*;
use crate::geometry::Mesh;

/// Joins the meshes that `draw` passes on.
fn joined<T>(draw: impl FnOnce(&mut dyn FnMut(&Mesh)) -> T) -> (Mesh, T) {
    let mut all = Mesh::default();
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
) -> (Mesh, Layout) {
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
) -> (Mesh, Layout) {
    joined(|draw| super::ascii_text(strings, style, widths, TextOutput::Batches(draw)))
}

#[test]
fn a_long_text_is_passed_on_in_batches_with_the_glyphs_of_a_short_one() {
    let style = style("Helvetica", 1.0);
    let (one, _) = text3(&["ab"], &style, SolidParts::ALL, None, 0.0);
    let (mut largest, mut triangles) = (0, 0);
    let line = "ab".repeat(500);
    let mut draw = |mesh: &Mesh| {
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
        Mesh::default()
    );
    let long = "x".repeat(MAX_GLYPHS + 5);
    assert_eq!(layout(&[long], &style("", 1.0)).glyphs.len(), MAX_GLYPHS);
}

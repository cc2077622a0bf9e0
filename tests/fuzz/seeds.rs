//! The first inputs of each target: small files of the repository, and files that are made here.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use image::ImageFormat;
use ivcam::export::{ExportOptions, Target, convert};
use ivcam_inventor::iv::{Document, Format};
use ivcam_optics::film::Response;
use ivcam_optics::picture::{Depth, Picture, PictureFormat};

/// An input with its name.
type Seed = (String, Vec<u8>);

/// Returns the files below a folder of the repository that have at most `most` bytes and one of
/// some extensions, in the order of their paths.
fn below(folder: &str, extensions: &[&str], most: u64) -> Vec<Seed> {
    // The program for AFL++ has a manifest of its own further down.
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut tops = manifest.ancestors();
    let top = tops
        .find(|top| top.join("scenes").is_dir())
        .unwrap_or(manifest);
    let mut folders = vec![top.join(folder)];
    let mut paths: Vec<PathBuf> = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
            if path.is_dir() {
                folders.push(path);
            } else if extensions.contains(&ending)
                && entry.metadata().is_ok_and(|about| about.len() <= most)
            {
                paths.push(path);
            }
        }
    }
    paths.sort();
    let seed = |path: PathBuf| {
        let name = path.strip_prefix(top).unwrap_or(&path).to_string_lossy();
        Some((name.replace('/', "-"), std::fs::read(&path).ok()?))
    };
    paths.into_iter().filter_map(seed).collect()
}

/// Scenes in ASCII, some of them in binary and compressed too.
pub(super) fn scenes() -> Vec<Seed> {
    let mut seeds = below("tests/golden", &["iv", "wrl"], 1500);
    seeds.extend(below("tests/iv", &["iv", "wrl"], 1500));
    seeds.extend(below("tests/graph", &["iv", "wrl"], 1500));
    let mut more = Vec::new();
    for (name, bytes) in seeds.iter().step_by(5) {
        let loader = std::sync::Arc::new(ivcam_inventor::iv::NoFiles);
        let document = Document::read(name, bytes.clone(), loader, &Default::default());
        if let Ok(document) = document.as_ref().map(|d| (!d.is_vrml97()).then_some(d))
            && let Some(document) = document
        {
            more.push((format!("binary-{name}"), document.write(Format::Binary)));
        }
    }
    for (name, bytes) in seeds.iter().step_by(40) {
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        if packed.write_all(bytes).is_ok()
            && let Ok(bytes) = packed.finish()
        {
            more.push((format!("gzip-{name}"), bytes));
        }
    }
    seeds.extend(more);
    seeds
}

/// Scenes of the repository converted to the formats of other programs, and small files of those
/// that are not written.
pub(super) fn formats() -> Vec<Seed> {
    let mut seeds: Vec<Seed> = [
        (
            "square.obj",
            "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nvt 0 0\nvn 0 0 1\ng a\ns 1\n\
             f 1/1/1 2/1/1 -1/-1/-1\nl 1 2\np 3\nmtllib a.mtl\nusemtl b\n",
        ),
        (
            "tile.stl",
            "solid tile\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
             vertex 0 1 0\nendloop\nendfacet\nendsolid tile\n",
        ),
        (
            "square.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
             property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
             element face 1\nproperty list uchar int vertex_index\nend_header\n\
             0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n3 0 1 2\n",
        ),
        (
            "scene.x3dv",
            "#X3D V4.0 utf8\nPROFILE Immersive\nMETA \"a\" \"b\"\nShape { appearance Appearance \
             { material PhysicalMaterial { metallic 0 } } geometry IndexedTriangleSet { index [ 0 \
             1 2 ] coord Coordinate { point [ 0 0 0 1 0 0 0 1 0 ] } } }\n",
        ),
    ]
    .map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec()))
    .into();
    let scenes = below("tests/golden/vrml97", &["wrl"], 1500);
    let targets = [Target::X3d, Target::Gltf, Target::Glb, Target::Ply];
    for (number, (name, bytes)) in scenes.into_iter().step_by(4).enumerate() {
        let loader = std::sync::Arc::new(ivcam_inventor::iv::NoFiles);
        let Ok(document) = Document::read(&name, bytes, loader, &Default::default()) else {
            continue;
        };
        let target = targets[number % targets.len()];
        if let Ok(made) = convert(&document, target, &ExportOptions::default()) {
            seeds.push((format!("{name}.{}", target.name()), made.bytes));
        }
    }
    seeds
}

/// Pictures of a few pixels in every format that is read.
pub(super) fn pictures() -> Vec<Seed> {
    let mut seeds = Vec::new();
    let color = image::RgbaImage::from_fn(5, 4, |x, y| {
        image::Rgba([x as u8 * 50, y as u8 * 60, 7, if x > y { 255 } else { 0 }])
    });
    let formats = [
        (ImageFormat::Png, "png"),
        (ImageFormat::Jpeg, "jpg"),
        (ImageFormat::Tiff, "tif"),
        (ImageFormat::Gif, "gif"),
        (ImageFormat::Bmp, "bmp"),
        (ImageFormat::Pnm, "ppm"),
        (ImageFormat::Tga, "tga"),
    ];
    for (format, ending) in formats {
        let mut bytes = Cursor::new(Vec::new());
        let color = image::DynamicImage::from(color.clone());
        let gray = image::DynamicImage::from(color.to_luma8());
        for (kind, picture) in [
            ("color", color.to_rgb8().into()),
            ("alpha", color),
            ("gray", gray),
        ] {
            bytes.get_mut().clear();
            bytes.set_position(0);
            if picture.write_to(&mut bytes, format).is_ok() {
                seeds.push((format!("{kind}.{ending}"), bytes.get_ref().clone()));
            }
        }
    }
    let exposure = Picture {
        width: 5,
        height: 4,
        pixels: (0..20).map(|i| [0.1 * i as f32, 0.5, 3.0]).collect(),
        response: Response::Linear,
        provenance: Default::default(),
    };
    for (format, ending) in [(PictureFormat::Exr, "exr"), (PictureFormat::Sgi, "sgi")] {
        for depth in [Depth::Eight, Depth::Sixteen] {
            let mut bytes = Vec::new();
            if exposure.write(format, depth, &mut bytes).is_ok() {
                seeds.push((format!("{depth:?}.{ending}"), bytes));
            }
        }
    }
    seeds
}

/// The smallest of the shipped typefaces.
pub(super) fn fonts() -> Vec<Seed> {
    below("crates/render/src/geometry/text/fonts", &["otf"], 18_000)
}

/// Prescriptions in all formats.
pub(super) fn lenses() -> Vec<Seed> {
    let endings = ["dat", "zmx", "seq", "json", "roa", "len", "lens", "txt"];
    let mut seeds = below("tests/lenses/dialects", &endings, 4000);
    seeds.extend(below("lenses", &endings, 1500));
    seeds
}

/// A glass catalogue with one glass of each dispersion formula.
pub(super) fn glass_catalogues() -> Vec<Seed> {
    let rows = (1..=13).map(|formula| {
        format!("NM G{formula} {formula} 517642 1.5168 64.17 0 1\nCD 1.0396 0.006 0.2318 0.02 1.0105 103.56 0 0\n")
    });
    vec![("all.agf".into(), rows.collect::<String>().into_bytes())]
}

/// The camera files of the repository, and cameras of each class.
pub(super) fn cameras() -> Vec<Seed> {
    let mut seeds = below("camera", &["dat"], 2000);
    for (name, fields) in [
        ("PerspectiveCamera", "heightAngle 0.8 aspectRatio 1.5"),
        ("OrthographicCamera", "height 2"),
        ("FrustumCamera", "left -1 right 1"),
    ] {
        let text = format!(
            "{name} {{ position 0 1 5 orientation 0 1 0 0.3 nearDistance 1 farDistance 10 \
             focalDistance 5 viewportMapping ADJUST_CAMERA {fields} }}"
        );
        seeds.push((format!("{name}.iv"), text.into_bytes()));
    }
    seeds
}

/// A timeline with a key of every kind.
pub(super) fn timelines() -> Vec<Seed> {
    let text = "frames 20\nrate 24 # a second\nshutter 0.5\nfocus 0 1.2\nfocus 19 1.99 diopters smooth\n\
        zoom 0 0.2\nzoom 9 2 smooth\naperture 0 f/4\naperture 19 f/8\nposition 0 0 0.7 1.6\n\
        position 19 0.3 0.7 1.6 smooth\norientation 0 1 0 0 -0.2\norientation 5 0 1 0 3\n\
        time 0 0\ntime 19 8.3 linear\n";
    vec![("all.txt".into(), text.into())]
}

/// The shipped films.
pub(super) fn films() -> Vec<Seed> {
    below("films", &["txt"], 8000)
}

/// Tables of both kinds of errors.
pub(super) fn curves() -> Vec<Seed> {
    let first = "method,samples,seconds,rel_rmse\npath,16,1.5,0.1\nmlt,,2,0.05\n";
    let second = "rel_mse,processor_seconds,method\n1e-3,4,x\n";
    vec![
        ("rmse.csv".into(), first.into()),
        ("mse.csv".into(), second.into()),
    ]
}

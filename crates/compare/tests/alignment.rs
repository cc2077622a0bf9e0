//! Alignment of pictures: the same one disturbed in the ways of an archive, and unrelated ones.
//!
//! The pictures are references of golden scenes. The large count is a command:
//! `cargo test --release -p ivcam-compare counted -- --ignored --nocapture`.

use std::path::{Path, PathBuf};

use ivcam_compare::{Alignment, Options, Plane, Plate, Registration, align, compare};

/// Numbers that are the same in every run (SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number from 0 to 1.
    fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// Returns a nearly normal number of mean 0 and variance 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.share()).sum::<f64>() - 6.0
    }
}

/// The folder of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn open(path: &Path) -> Plate {
    Plate::open(path).unwrap()
}

/// Opens the reference of a golden scene, 96×64 pixels.
fn golden(name: &str) -> Plate {
    let folder = root().join("tests/golden");
    open(&folder.join(format!("{name}.png")))
}

/// Returns the level at a position, or the paper's outside the picture.
fn at(plane: &Plane, x: f64, y: f64) -> f32 {
    let inside = |v: f64, n: usize| (0.0..n as f64).contains(&v);
    if inside(x, plane.width) && inside(y, plane.height) {
        plane.sample(x, y)
    } else {
        0.92
    }
}

/// Returns the picture turned clockwise about its center, within a frame of paper that is larger by
/// `border`.
fn turned(picture: &Plate, degrees: f64, border: f64) -> Plate {
    let (sin, cos) = (
        libm::sin(degrees.to_radians()),
        libm::cos(degrees.to_radians()),
    );
    let (w, h) = (picture.width as f64, picture.height as f64);
    let size = |n: f64| (n * border).round() as usize;
    let (width, height) = (size(w), size(h));
    picture.map(|p| {
        Plane::from_fn(width, height, |x, y| {
            let (x, y) = (
                x as f64 + 0.5 - 0.5 * width as f64,
                y as f64 + 0.5 - 0.5 * height as f64,
            );
            at(p, cos * x + sin * y + 0.5 * w, cos * y - sin * x + 0.5 * h)
        })
    })
}

/// Adds grain of a standard deviation, and rounds to 8 bits.
fn grainy(picture: &Plate, deviation: f64, random: &mut Random) -> Plate {
    let mut out = picture.clone();
    for v in out.channels.iter_mut().flat_map(|c| &mut c.values) {
        let level = f64::from(*v) + deviation * random.normal();
        *v = ((255.0 * level).round().clamp(0.0, 255.0) / 255.0) as f32;
    }
    out
}

/// Encodes as JPEG and decodes.
fn jpeg(picture: &Plate, quality: u8) -> Plate {
    let (width, height) = (picture.width as u32, picture.height as u32);
    let level = |v: f32| (255.0 * v).round().clamp(0.0, 255.0) as u8;
    let image = image::RgbImage::from_fn(width, height, |x, y| {
        image::Rgb(picture.color((y * width + x) as usize).map(level))
    });
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode_image(&image)
        .unwrap();
    let image = image::load_from_memory(&bytes).unwrap().to_rgb8();
    let channel = |c: usize| {
        Plane::from_fn(picture.width, picture.height, |x, y| {
            f32::from(image.get_pixel(x as u32, y as u32)[c]) / 255.0
        })
    };
    Plate::from_planes([channel(0), channel(1), channel(2)])
}

/// Returns a part of a picture.
fn cropped(picture: &Plate, [left, top, width, height]: [usize; 4]) -> Plate {
    picture.map(|p| Plane::from_fn(width, height, |x, y| p.at(left + x, top + y)))
}

/// Multiplies red, green and blue.
fn tinted(picture: &Plate, factors: [f32; 3]) -> Plate {
    Plate::from_planes([0, 1, 2].map(|c| picture.channels[c].map(|v| factors[c] * v)))
}

/// Returns a scan: a border of paper, turned, another gamma, yellowed, grainy, as JPEG.
fn scanned(picture: &Plate, degrees: f64, random: &mut Random) -> Plate {
    let page = turned(picture, degrees, 1.15);
    let page = page.map(|p| p.map(|v| libm::powf(v.max(0.0), 0.8)));
    jpeg(
        &grainy(&tinted(&page, [1.0, 0.93, 0.85]), 0.016, random),
        80,
    )
}

/// Returns plasma: noise whose amplitude falls with the frequency.
fn plasma(width: usize, height: usize, random: &mut Random) -> Plate {
    let octaves: [f64; 5] = [16.0, 8.0, 4.0, 2.0, 0.5];
    let mut channel = || {
        let mut sum = Plane::from_fn(width, height, |_, _| 0.5);
        for sigma in octaves {
            let mut noise = Plane::from_fn(width, height, |_, _| 0.0);
            noise.values.fill_with(|| random.normal() as f32);
            // Blurred white noise falls by 1/(2·√π·σ), so that each octave has its own weight.
            let weight = (0.004 * sigma.max(2.0) * sigma * 3.5) as f32;
            sum = sum.zip(&noise.blurred(sigma), |s, n| s + weight * n);
        }
        sum.map(|v| v.clamp(0.0, 1.0))
    };
    Plate::from_planes([channel(), channel(), channel()])
}

/// Returns a smooth gradient, linear or round.
fn gradient(width: usize, height: usize, random: &mut Random) -> Plate {
    let (u, v, round) = (random.share(), random.share(), random.below(2) == 1);
    let plane = Plane::from_fn(width, height, |x, y| {
        let (x, y) = (x as f64 / width as f64, y as f64 / height as f64);
        let value = if round {
            libm::hypot(x - u, y - v)
        } else {
            (u * x + v * y) / (u + v)
        };
        value.min(1.0) as f32
    });
    Plate::from_planes([plane.clone(), plane.clone(), plane])
}

fn alignment(new: &Plate, old: &Plate) -> Option<Alignment> {
    align(new, old).ok().map(|found| found.alignment)
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn the_same_picture_is_recognized_in_a_scan_a_crop_a_third_and_turned_by_90_degrees() {
    let mut random = Random(1);
    let new = golden("materials/textures");
    let scan = alignment(&new, &scanned(&new, 1.7, &mut random)).unwrap();
    assert!(
        (scan.rotation + 1.7).abs() < 4.0 * scan.rotation_error,
        "{scan:?}"
    );
    // The bias that grain and paper cause in a picture of this size; docs/guide/compare.md has it.
    assert!((scan.scale - 1.0).abs() < 0.02, "{scan:?}");
    let crop = alignment(&new, &cropped(&new, [10, 9, 72, 52])).unwrap();
    assert_eq!(
        (crop.shift, crop.scale, crop.rotation),
        ([-2.0, 3.0], 1.0, 0.0)
    );
    let book = root().join("docs/guide/fisheye.png");
    let book = cropped(&open(&book), [60, 60, 180, 120]);
    let third = alignment(&book, &book.map(|p| p.resized(60, 40))).unwrap();
    assert!(
        (third.scale - 3.0).abs() < 4.0 * third.scale_error,
        "{third:?}"
    );
    assert!(third.scale_error < 0.02 * third.scale, "{third:?}");
    let quarter = new.map(|p| Plane::from_fn(64, 96, |x, y| p.at(y, 63 - x)));
    let quarter = alignment(&new, &quarter).unwrap();
    assert_eq!(
        (quarter.shift, quarter.scale, quarter.rotation),
        ([0.0, 0.0], 1.0, -90.0)
    );
    assert!(!quarter.mirrored && quarter.chance < 1e-12);
}

#[test]
fn a_same_size_picture_with_another_gamma_and_tint_is_not_resampled() {
    let new = golden("materials/textures");
    let mut random = Random(2);
    let old = new.map(|p| p.map(|v| 0.05 + 0.9 * libm::powf(v.max(0.0), 1.8)));
    let old = jpeg(
        &grainy(&tinted(&old, [1.0, 0.9, 0.7]), 0.01, &mut random),
        90,
    );
    let measures = |registration| {
        let options = Options {
            registration,
            ..Options::default()
        };
        compare(&new, &old, &options).unwrap().measures
    };
    assert_eq!(measures(Registration::Align), measures(Registration::None));
}

#[test]
fn a_mirrored_picture_is_recognized_as_such() {
    let new = golden("materials/textures");
    let old = scanned(
        &new.map(|p| Plane::from_fn(p.width, p.height, |x, y| p.at(p.width - 1 - x, y))),
        -3.0,
        &mut Random(3),
    );
    let found = alignment(&new, &old).unwrap();
    assert!(found.mirrored && found.chance < 1e-6, "{found:?}");
    assert!(
        (found.rotation + 3.0).abs() < 4.0 * found.rotation_error,
        "{found:?}"
    );
}

#[test]
#[ignore = "a measurement of minutes, listed in docs/performance.md"]
fn a_negative_a_black_a_tiny_and_an_unrelated_picture_are_refused() {
    let new = golden("materials/textures");
    let mut random = Random(4);
    let refused = [
        new.map(|p| p.map(|v| 1.0 - v)),
        new.map(|p| p.map(|_| 0.0)),
        new.map(|p| p.resized(4, 4)),
        golden("shapes/solids"),
        plasma(96, 64, &mut random),
        gradient(96, 64, &mut random),
    ];
    for (i, old) in refused.iter().enumerate() {
        let error = align(&new, old).err().unwrap_or_else(|| panic!("{i}"));
        assert!(error.message.contains("can't be aligned"), "{i}: {error:?}");
    }
}

/// Returns the golden references of 96×64 pixels.
fn all_golden(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            all_golden(&path, out);
        } else if path.extension().is_some_and(|e| e == "png") {
            let picture = open(&path);
            if (picture.width, picture.height) == (96, 64) {
                out.push(path);
            }
        }
    }
}

/// Counts acceptances of 500 unrelated pairs and refusals of 100 scans. It takes about 20 minutes.
#[test]
#[ignore = "takes 20 minutes; run it with --release"]
fn false_acceptances_and_refusals_are_counted_over_600_pairs() {
    let mut random = Random(5);
    let mut paths = Vec::new();
    all_golden(&root().join("tests/golden"), &mut paths);
    let mut accepted = 0;
    for i in 0..500 {
        let first = random.below(paths.len());
        let second = (first + 1 + random.below(paths.len() - 1)) % paths.len();
        let new = open(&paths[first]);
        let old = match i % 5 {
            0 => plasma(96, 64, &mut random),
            1 => gradient(96, 64, &mut random),
            2 => open(&paths[first]).map(|p| p.map(|v| 1.0 - v)),
            _ => open(&paths[second]),
        };
        if let Some(found) = alignment(&new, &old) {
            accepted += 1;
            let (a, b) = (paths[first].display(), paths[second].display());
            eprintln!("accepted: kind {} {a} {b} {found:?}", i % 5);
        }
    }
    let mut refused = 0;
    for _ in 0..100 {
        let path = &paths[random.below(paths.len())];
        let new = open(path);
        let old = scanned(&new, 6.0 * random.share() - 3.0, &mut random);
        if alignment(&new, &old).is_none() {
            refused += 1;
            eprintln!("refused: {}", path.display());
        }
    }
    eprintln!("{accepted} of 500 unrelated pairs accepted, {refused} of 100 scans refused");
}

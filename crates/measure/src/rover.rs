//! Writes scenes of the structure that planetary archives hold, with a made-up terrain.
//!
//! `cargo run --release -p measure -- rover -o FOLDER [--columns N]`.
//!
//! * `wedge.iv`: a wedge as of the Mars rovers, Inventor V2.0: a `LevelOfDetail` whose children are
//!   `IndexedTriangleStripSet`s, the finest of N by ⅔N corners [1536: 3.1 million triangles], each
//!   of the next with half as many on a side, under one picture, `wedge.rgb`. It is in the site's
//!   frame: meters, x to the north, y to the east, z down, the ground at the origin. Corners are
//!   those of a stereo picture: they are dense near the camera, 1.5 m above the origin, and the
//!   picture lies on them as the camera took it.
//! * `patches.wrl`: a panorama as of Pathfinder, VRML 1.0: 388 patches in their places around the
//!   lander, each an `IndexedFaceSet` under its own picture, `patch-NNN.rgb`, with z up.
//!
//! Pictures are SGI's with run lengths, that of a wedge of 512 columns and more with 16 bits. The
//! terrain and the numbers of both are made up; the structure is as archives describe it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use glam::{DVec2, DVec3};
use ivcam_optics::sampling::mix;

use super::shared::words::value_of;

/// The height of the camera above the ground in meters.
const MAST: f64 = 1.5;
/// The directions of the wedge, from the lowest row to the highest, below the horizon.
const PITCH: [f64; 2] = [0.70, 0.045];
/// Half of the angle that the wedge spans, in radians.
const HALF_WIDTH: f64 = 0.40;
/// The levels of detail of the wedge.
const LEVELS: u32 = 5;
/// The rings and sectors of Pathfinder's patches.
const RINGS: usize = 4;
const SECTORS: usize = 97;
/// The corners of a patch on each side.
const PATCH: usize = 24;

pub(crate) fn run(words: Vec<String>) -> ExitCode {
    let value = |name: &str| value_of(name, &words);
    let columns = value("--columns").map_or(Some(1536), |n| n.parse().ok());
    let (Some(folder), Some(columns)) = (value("-o").map(PathBuf::from), columns) else {
        return crate::usage("rover");
    };
    let written = std::fs::create_dir_all(&folder)
        .and_then(|()| wedge(&folder, usize::max(columns, 64)))
        .and_then(|()| patches(&folder));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", folder.display());
            ExitCode::FAILURE
        }
    }
}

/// Writes the wedge and its picture.
fn wedge(folder: &Path, columns: usize) -> std::io::Result<()> {
    let rows = columns * 2 / 3;
    let width = (10 * columns / 3).min(1024);
    let picture = SgiPicture {
        width,
        height: width * 2 / 3,
        bytes: if columns < 512 { 1 } else { 2 },
    };
    picture.write(&folder.join("wedge.rgb"), |u, v| color(on_ground(u, v)))?;
    let mut text = String::from(
        "#Inventor V2.0 ascii\nSeparator {\n  Texture2 { filename \"wedge.rgb\" }\n\
           Material { diffuseColor 1 1 1 }\n  LevelOfDetail {\n    screenArea [ ",
    );
    for level in 0..LEVELS - 1 {
        let _ = write!(text, "{}, ", 1_200_000 >> (2 * level));
    }
    text += "]\n";
    for level in 0..LEVELS {
        strips(&mut text, columns >> level, rows >> level);
    }
    text += "  }\n}\n";
    std::fs::write(folder.join("wedge.iv"), text)
}

/// Adds a level of the wedge: a strip for each pair of rows.
fn strips(text: &mut String, columns: usize, rows: usize) {
    let part = |i: usize, n: usize| i as f64 / (n - 1) as f64;
    let corners = || (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    *text += "    Separator {\n      Coordinate3 { point [\n";
    for (i, j) in corners() {
        let at = on_ground(part(i, columns), part(j, rows));
        // The site's frame has z down.
        let _ = writeln!(text, "{:.4} {:.4} {:.4},", at.x, at.y, -height(at));
    }
    *text += "      ] }\n      TextureCoordinate2 { point [\n";
    for (i, j) in corners() {
        let _ = writeln!(text, "{:.5} {:.5},", part(i, columns), part(j, rows));
    }
    *text += "      ] }\n      IndexedTriangleStripSet { coordIndex [\n";
    for j in 0..rows - 1 {
        for i in 0..columns {
            let _ = write!(text, "{},{},", (j + 1) * columns + i, j * columns + i);
        }
        *text += "-1,\n";
    }
    *text += "      ] }\n    }\n";
}

/// Writes Pathfinder's patches and their pictures.
fn patches(folder: &Path) -> std::io::Result<()> {
    let mut text = String::from("#VRML V1.0 ascii\nSeparator {\n");
    for number in 0..RINGS * SECTORS {
        let (ring, sector) = (number / SECTORS, number % SECTORS);
        // Each ring is twice as far away as the one inside it.
        let radius = |v: f64| 1.2 * f64::powf(2.0, ring as f64 + v);
        let turn = |u: f64| std::f64::consts::TAU * (sector as f64 + 1.0 - u) / SECTORS as f64;
        let at = |u: f64, v: f64| radius(v) * DVec2::new(libm::cos(turn(u)), libm::sin(turn(u)));
        let name = format!("patch-{number:03}.rgb");
        let picture = SgiPicture {
            width: 48,
            height: 64,
            bytes: 1,
        };
        picture.write(&folder.join(&name), |u, v| color(at(u, v)))?;
        patch(&mut text, &name, at);
    }
    text += "}\n";
    std::fs::write(folder.join("patches.wrl"), text)
}

/// Adds a patch, whose corners are given by their places in the picture.
fn patch(text: &mut String, name: &str, at: impl Fn(f64, f64) -> DVec2) {
    let part = |i: usize| i as f64 / (PATCH - 1) as f64;
    let corners = || (0..PATCH).flat_map(|j| (0..PATCH).map(move |i| (part(i), part(j))));
    let _ = writeln!(text, "  Separator {{ Texture2 {{ filename \"{name}\" }}");
    *text += "  Coordinate3 { point [\n";
    for (u, v) in corners() {
        let at = at(u, v);
        let _ = writeln!(text, "{:.4} {:.4} {:.4},", at.x, at.y, height(at));
    }
    *text += "  ] }\n  TextureCoordinate2 { point [\n";
    for (u, v) in corners() {
        let _ = writeln!(text, "{u:.4} {v:.4},");
    }
    *text += "  ] }\n  IndexedFaceSet { coordIndex [\n";
    for (j, i) in (1..PATCH).flat_map(|j| (1..PATCH).map(move |i| (j, i))) {
        let [a, b] = [(j - 1) * PATCH + i - 1, j * PATCH + i - 1];
        let _ = writeln!(text, "{},{},{},{},-1,", a, a + 1, b + 1, b);
    }
    *text += "  ] }\n  }\n";
}

/// The place that the wedge's camera sees at a place of its picture, from the lower left corner.
fn on_ground(u: f64, v: f64) -> DVec2 {
    let down = PITCH[0] + v * (PITCH[1] - PITCH[0]);
    let turn = HALF_WIDTH * (2.0 * u - 1.0);
    MAST / libm::tan(down) * DVec2::new(libm::cos(turn), libm::sin(turn))
}

/// The height of the ground in meters: ripples, slopes and rocks.
fn height(at: DVec2) -> f64 {
    let mut sum = 0.02 * at.length() * (noise(at / 9.0) - 0.5);
    for octave in 0..5 {
        let scale = f64::powi(2.0, octave);
        sum += 0.10 / scale * (noise(at * scale * 0.8 + DVec2::splat(37.0)) - 0.5);
    }
    sum + rock(at).map_or(0.0, |(height, _)| height)
}

/// The height of a rock above the ground, and its number, if there is one at a place.
fn rock(at: DVec2) -> Option<(f64, f64)> {
    let near = (-1..=1).flat_map(|i| (-1..=1).map(move |j| DVec2::new(f64::from(i), f64::from(j))));
    let rocks = near.filter_map(|step| {
        let cell = (at / 0.7).floor() + step;
        let number = hash(cell);
        let offset = DVec2::new(hash(cell + 0.3), hash(cell + 0.6));
        let radius = 0.05 + 0.4 * f64::powi(number, 6);
        let off = (at - 0.7 * (cell + offset)).length() / radius;
        (number > 0.35 && off < 1.0).then(|| (0.8 * radius * (1.0 - off * off).sqrt(), number))
    });
    rocks.reduce(|a, b| if a.0 > b.0 { a } else { b })
}

/// The color of the ground as a camera under a pink sky sees it, from 0 to 1.
fn color(at: DVec2) -> DVec3 {
    let step = 0.01;
    let slope = |aside: DVec2| (height(at + aside) - height(at - aside)) / (2.0 * step);
    let normal = DVec3::new(-slope(DVec2::X * step), -slope(DVec2::Y * step), 1.0).normalize();
    let sun = normal.dot(DVec3::new(-0.3, 0.75, 0.6).normalize()).max(0.0);
    let dust = DVec3::new(0.78, 0.50, 0.32) * (0.8 + 0.4 * noise(at * 40.0));
    let stone = DVec3::new(0.42, 0.33, 0.28) * (0.7 + 0.6 * noise(at * 90.0));
    let own = if rock(at).is_some() { stone } else { dust };
    (own * (0.25 + 0.85 * sun)).clamp(DVec3::ZERO, DVec3::ONE)
}

/// A number from 0 to 1 for a place in the plane.
fn hash(at: DVec2) -> f64 {
    let mixed = mix(mix((at.x + 0.0).to_bits()) ^ (at.y + 0.0).to_bits());
    (mixed >> 11) as f64 / (1_u64 << 53) as f64
}

/// Noise between the corners of a grid of width 1, from 0 to 1.
fn noise(at: DVec2) -> f64 {
    let (cell, part) = (at.floor(), at - at.floor());
    let part = part * part * (3.0 - 2.0 * part);
    let corner = |x: f64, y: f64| hash(cell + DVec2::new(x, y));
    let row = |y: f64| corner(0.0, y) + part.x * (corner(1.0, y) - corner(0.0, y));
    row(0.0) + part.y * (row(1.0) - row(0.0))
}

/// An SGI picture with run lengths.
struct SgiPicture {
    width: usize,
    height: usize,
    /// 1 or 2 bytes for each level.
    bytes: usize,
}

impl SgiPicture {
    /// Writes the picture of a color at each place, which goes from 0 to 1 from the lower left.
    fn write(&self, file: &Path, color: impl Fn(f64, f64) -> DVec3) -> std::io::Result<()> {
        let most = if self.bytes == 1 { 255.0 } else { 65_535.0 };
        let mut header = vec![0x01, 0xda, 1, self.bytes as u8, 0, 3];
        for side in [self.width, self.height, 3] {
            header.extend((side as u16).to_be_bytes());
        }
        header.extend(0_u32.to_be_bytes());
        header.extend((most as u32).to_be_bytes());
        header.resize(512, 0);
        let pixels: Vec<DVec3> = (0..self.height)
            .flat_map(|y| (0..self.width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let part = |at: usize, size: usize| (at as f64 + 0.5) / size as f64;
                color(part(x, self.width), part(y, self.height))
            })
            .collect();
        let count = 3 * self.height;
        let (mut starts, mut lengths, mut data) = (Vec::new(), Vec::new(), Vec::new());
        for channel in 0..3 {
            for row in pixels.chunks_exact(self.width) {
                let levels = row.iter().map(|p| (p[channel] * most + 0.5) as u16);
                let start = 512 + 8 * count + data.len();
                self.add_runs(&levels.collect::<Vec<_>>(), &mut data);
                starts.push(start);
                lengths.push(512 + 8 * count + data.len() - start);
            }
        }
        for number in starts.into_iter().chain(lengths) {
            header.extend((number as u32).to_be_bytes());
        }
        header.extend(data);
        std::fs::write(file, header)
    }

    /// Adds a row: runs of equal levels, and levels as they are, up to 126 of each.
    fn add_runs(&self, row: &[u16], data: &mut Vec<u8>) {
        let mut add = |level: u16| {
            let bytes = level.to_be_bytes();
            data.extend(&bytes[2 - self.bytes..]);
        };
        let mut rest = row;
        while let Some(&first) = rest.first() {
            let equal = rest.iter().take(126).take_while(|l| **l == first).count();
            if equal > 2 {
                add(equal as u16);
                add(first);
                rest = &rest[equal..];
                continue;
            }
            let ends = |at: &usize| {
                rest[*at..]
                    .windows(3)
                    .next()
                    .is_some_and(|w| w[0] == w[1] && w[1] == w[2])
            };
            let most = rest.len().min(126);
            let length = (1..most).find(ends).unwrap_or(most);
            add(0x80 | length as u16);
            rest[..length].iter().for_each(|level| add(*level));
            rest = &rest[length..];
        }
        add(0);
    }
}

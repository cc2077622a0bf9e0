//! Renders pictures through the reference's camera and compares them with the reference's picture:
//! with `--shading p`, lit at every point, and with `--shading g --handles`, as an OpenGL program
//! draws.

use std::path::Path;

use glam::{DQuat, DVec3, Vec3};
use image::{Rgb, RgbImage};
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::Document;
use ivcam_inventor::pose::{CameraPose, Projection, ViewportMapping};
use ivcam_render::bvh::Ray;
use ivcam_render::camera::{Camera, Pinhole};
use ivcam_render::scene::{CompileOptions, Light, RenderScene, snapshot};
use ivcam_render::shade::{ShadeOptions, Shader, Shading, Work};
use serde_json::Value;

use super::point;

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;

/// The color of the frame that Coin draws around a cropped view.
const FRAME_GRAY: Vec3 = Vec3::splat(0.8);

/// The comparison of a picture with the reference's.
#[derive(Clone, Copy)]
pub(super) struct Likeness {
    /// The share of pixels drawn in either picture that are drawn in both.
    pub overlap: f64,
    /// The mean difference in levels where both draw something.
    pub difference: f64,
}

impl Likeness {
    pub(super) fn is_alike(self) -> bool {
        self.overlap >= 0.98 && self.difference <= 4.0
    }

    fn of(ours: &RgbImage, theirs: &RgbImage) -> Self {
        let (mut both, mut either, mut sum) = (0u32, 0u32, 0u64);
        for (a, b) in ours.pixels().zip(theirs.pixels()) {
            let shown = |p: &Rgb<u8>| p.0.iter().any(|&c| c > 0);
            either += u32::from(shown(a) || shown(b));
            if shown(a) && shown(b) {
                both += 1;
                let off = (0..3).map(|i| u64::from(a.0[i].abs_diff(b.0[i])));
                sum += off.sum::<u64>();
            }
        }
        Self {
            overlap: if either == 0 {
                1.0
            } else {
                f64::from(both) / f64::from(either)
            },
            difference: sum as f64 / f64::from(3 * both.max(1)),
        }
    }
}

/// The comparisons of a file's two pictures.
pub(super) struct Pictures {
    pub path: String,
    pub by_point: Likeness,
    pub by_corner: Likeness,
}

/// Returns `None` if the reference has no picture or no usable camera.
pub(super) fn compare(
    document: &Document,
    options: &CompileOptions,
    reference: &Value,
    path: &str,
    theirs: &Path,
    folder: &Path,
) -> Option<Pictures> {
    let theirs = image::open(theirs).ok()?.to_rgb8();
    let by_point = draw(document, options, reference, Shading::Phong)?;
    let by_corner = draw(document, options, reference, Shading::Gl)?;
    let pictures = Pictures {
        path: path.to_owned(),
        by_point: Likeness::of(&by_point, &theirs),
        by_corner: Likeness::of(&by_corner, &theirs),
    };
    if !pictures.by_point.is_alike() || !pictures.by_corner.is_alike() {
        let mut beside = RgbImage::new(3 * WIDTH, HEIGHT);
        for (i, picture) in [&by_point, &by_corner, &theirs].into_iter().enumerate() {
            image::imageops::replace(&mut beside, picture, i as i64 * i64::from(WIDTH), 0);
        }
        let name = path.replace('/', "_");
        let _ = std::fs::create_dir_all(folder);
        let _ = beside.save(folder.join(format!("{name}.png")));
    }
    Some(pictures)
}

fn draw(
    document: &Document,
    options: &CompileOptions,
    reference: &Value,
    shading: Shading,
) -> Option<RgbImage> {
    let pose = pose(reference)?;
    let options = CompileOptions {
        origin: pose.position,
        camera: Some(pose.clone()),
        needs: shading.needs(),
        pixel_rows: HEIGHT,
        ..options.clone()
    };
    let at = SnapshotOptions {
        handles: shading == Shading::Gl,
        ..SnapshotOptions::default()
    };
    let scene = RenderScene::compile(&snapshot(document, &at, &options), &options).ok()?;
    let headlight = reference["lights"]
        .as_array()?
        .iter()
        .find(|l| l["headlight"] == true)
        .and_then(|l| point(&l["direction"]))
        .map(|d| Light::headlight(d.as_vec3()));
    let options = ShadeOptions {
        headlight,
        backward: (pose.orientation * DVec3::Z).as_vec3(),
        ..ShadeOptions::default()
    };
    let shader = Shader::new(&scene, shading, options);
    let aspect = f64::from(WIDTH) / f64::from(HEIGHT);
    let camera = Camera::Pinhole(Pinhole::new(&pose, aspect)).posed(&pose, pose.position);
    let mut picture = RgbImage::new(WIDTH, HEIGHT);
    let mut work = Work::default();
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let along = |x: u32, size: u32| (f64::from(x) + 0.5) / f64::from(size);
        let ray = camera.at(along(x, WIDTH), along(y, HEIGHT)).ray([0.5; 2]);
        let color = match ray {
            Some(ray) => {
                let ray = Ray::new(ray.origin.as_vec3(), ray.direction.as_vec3());
                shader.radiance(&ray, &mut work)
            }
            None if pose.viewport_mapping == ViewportMapping::CropViewportFillFrame => FRAME_GRAY,
            None => Vec3::ZERO,
        };
        let level = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        *pixel = Rgb([level(color.x), level(color.y), level(color.z)]);
    }
    Some(picture)
}

/// Returns the camera that the other program used.
fn pose(reference: &Value) -> Option<CameraPose> {
    let c = &reference["camera"];
    let number = |name: &str, silent: f64| c[name].as_f64().unwrap_or(silent);
    let turn = &c["orientation"];
    let axis = point(&turn["axis"])?;
    let projection = match c["heightAngle"].as_f64() {
        Some(height_angle) => Projection::Perspective { height_angle },
        None => Projection::Orthographic {
            height: c["height"].as_f64()?,
        },
    };
    Some(CameraPose {
        position: point(&c["position"])?,
        orientation: DQuat::from_axis_angle(axis.normalize_or(DVec3::Z), turn["angle"].as_f64()?),
        projection,
        near: number("near", 0.0),
        aspect_ratio: number("aspectRatio", 1.0),
        viewport_mapping: ViewportMapping::of(c["viewportMapping"].as_i64().unwrap_or(3) as i32),
        ..CameraPose::view_all((DVec3::ZERO, DVec3::ONE), 1.0)
    })
}

/// Prints the sums, and a row for each file whose picture by `--shading g` differs, by cause.
pub(super) fn table(pictures: &mut [Pictures], cause: impl Fn(&str) -> String) {
    let good = |of: fn(&Pictures) -> Likeness| pictures.iter().filter(|p| of(p).is_alike()).count();
    let median = |of: fn(&Pictures) -> Likeness| {
        let mut overlaps: Vec<f64> = pictures.iter().map(|p| of(p).overlap).collect();
        overlaps.sort_by(f64::total_cmp);
        overlaps.get(overlaps.len() / 2).copied().unwrap_or(1.0)
    };
    let point = |p: &Pictures| p.by_point;
    let corner = |p: &Pictures| p.by_corner;
    println!(
        "\n| pictures of {} | `--shading p` | `--shading g --handles` |\n|---|---|---|",
        pictures.len()
    );
    println!("| alike | {} | {} |", good(point), good(corner));
    println!(
        "| median overlap | {:.4} | {:.4} |",
        median(point),
        median(corner)
    );
    let only = |p: &&Pictures| !p.by_point.is_alike() && p.by_corner.is_alike();
    println!(
        "| alike by `g` only | | {} |",
        pictures.iter().filter(only).count()
    );
    pictures.sort_by_cached_key(|p| (cause(&p.path), p.path.clone()));
    println!("\n| file | `p` | `g` | cause |\n|---|---|---|---|");
    for p in pictures.iter().filter(|p| !p.by_corner.is_alike()) {
        let show = |l: Likeness| format!("{:.3} {:.1}", l.overlap, l.difference);
        let (point, corner) = (show(p.by_point), show(p.by_corner));
        println!("| {} | {point} | {corner} | {} |", p.path, cause(&p.path));
    }
    println!("\nalike by `--shading g`, not by `--shading p`:");
    for p in pictures.iter().filter(only) {
        println!(
            "  {:.3} {:6.2}  {}",
            p.by_point.overlap, p.by_point.difference, p.path
        );
    }
}

//! Extreme scenes, whose hits and light are known in closed form.

use std::sync::Arc;

use glam::Vec3;
use ivcam_base::diag::Result;
use ivcam_inventor::events::SnapshotOptions;
use ivcam_inventor::iv::{Document, Limits, NoFiles};
use ivcam_inventor::pose::{CameraPose, Projection, ViewportMapping};
use ivcam_optics::film::{Region, Resolution};
use ivcam_optics::sampling::{Filter, FilterTable, Sampler, SamplerKind};
use ivcam_render::bvh::Ray;
use ivcam_render::camera::{Camera, Pinhole};
use ivcam_render::render::{Render, Stop, Task};
use ivcam_render::scene::{CompileOptions, RenderScene, snapshot};
use ivcam_render::shade::{ShadeOptions, Shader, Shading, Work};

use super::case::Case;

/// The bound of positions and colors, which are rounded to 24 bits in several steps.
const SINGLE: f64 = 1e-5;

/// Compiles a scene around a point, in meters.
fn scene(body: &str, origin: glam::DVec3) -> Result<RenderScene> {
    let bytes = format!("#Inventor V2.1 ascii\n{body}").into_bytes();
    let document = Document::read("case.iv", bytes, Arc::new(NoFiles), &Limits::default())?;
    let options = CompileOptions {
        origin,
        ..CompileOptions::default()
    };
    let at = snapshot(&document, &SnapshotOptions::default(), &options);
    RenderScene::compile(&at, &options)
}

/// Returns the distance to the first surface from the origin along −z; infinite if there is none.
fn depth(body: &str) -> Result<f64> {
    depth_from(body, glam::DVec3::ZERO, Vec3::NEG_Z)
}

fn depth_from(body: &str, origin: glam::DVec3, toward: Vec3) -> Result<f64> {
    let scene = scene(body, origin)?;
    let hit = scene.hit(&Ray::new(Vec3::ZERO, toward));
    Ok(hit.map_or(f64::INFINITY, |hit| f64::from(hit.t)))
}

/// Returns the red light along −z from the origin, with shadows, reflections and refractions.
fn light(body: &str, max_depth: u32) -> Result<f64> {
    let scene = scene(body, glam::DVec3::ZERO)?;
    let options = ShadeOptions {
        max_depth,
        mirrors: Some(0.0),
        least_share: 0.0,
        ..ShadeOptions::default()
    };
    let shader = Shader::new(&scene, Shading::Recursive, options);
    let ray = Ray::new(Vec3::ZERO, Vec3::NEG_Z);
    let color = shader.radiance_of(&ray, scene.hit(&ray), &mut Work::default());
    Ok(f64::from(color.x))
}

/// Computes the cases of scenes.
///
/// # Errors
/// Returns an error if one of the scenes does not compile.
pub(crate) fn scene_cases() -> Result<Vec<Case>> {
    let mut cases = sizes()?;
    cases.extend(transforms()?);
    cases.extend(faces()?);
    cases.extend(lights()?);
    cases.extend(pictures()?);
    Ok(cases)
}

/// Pictures of one pixel and of one row of 65,536 pixels, of a wall that glows evenly.
fn pictures() -> Result<Vec<Case>> {
    let wall = "LightModel { model BASE_COLOR } BaseColor { rgb .5 .5 .5 } \
                Translation { translation 0 0 -5 } Cube { width 1e6 height 1e6 }";
    let scene = scene(wall, glam::DVec3::ZERO)?;
    let shader = Shader::new(&scene, Shading::Phong, ShadeOptions::default());
    let mut cases = Vec::new();
    for (width, height) in [(1, 1), (65_536, 1), (1, 65_536)] {
        let resolution = Resolution { width, height };
        let pose = CameraPose {
            projection: Projection::Orthographic { height: 1.0 },
            viewport_mapping: ViewportMapping::LeaveAlone,
            ..CameraPose::view_all((glam::DVec3::NEG_ONE, glam::DVec3::ONE), 1.0)
        };
        let render = Render {
            shader: &shader,
            camera: &Camera::Pinhole(Pinhole::new(&pose, f64::from(width) / f64::from(height))),
            sampler: Sampler::new(SamplerKind::Sobol, 1, 0),
            resolution,
            exposure: 1.0,
            stop: Stop::after(1),
            filter: &FilterTable::new(Filter::Box),
            adaptive: false,
            team: None,
            lamps: None,
        };
        let film = render
            .run_inside(Region::whole(resolution), Task::default(), &|_| ())
            .film;
        let levels = film.pixels.iter().map(|pixel| pixel.mean.x);
        let darkest = levels.fold(f64::INFINITY, f64::min);
        let name = format!("{width}x{height} pixels: the darkest of a gray wall");
        cases.push(Case::of(name, 0.5, darkest, SINGLE));
    }
    Ok(cases)
}

/// Scales from a picometer to 100,000 km, and places far from the origin.
fn sizes() -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    for power in [-12, -6, -3, 0, 3, 6, 8] {
        let s = libm::pow(10.0, f64::from(power));
        let body = format!(
            "Scale {{ scaleFactor {s:e} {s:e} {s:e} }} Translation {{ translation 0 0 -3 }} Sphere {{ }}"
        );
        let name = format!("scale 1e{power}: distance to a sphere, m");
        cases.push(Case::of(name, 2.0 * s, depth(&body)?, SINGLE));
    }
    for power in [3, 5, 7] {
        let away = libm::pow(10.0, f64::from(power));
        let body = format!("Translation {{ translation {away:e} 0 -3 }} Sphere {{ }}");
        let origin = glam::DVec3::new(away, 0.0, 0.0);
        let got = depth_from(&body, origin, Vec3::NEG_Z)?;
        let name = format!("1e{power} m from the origin: distance to a sphere, m");
        cases.push(Case::of(name, 2.0, got, SINGLE));
    }
    for power in [2, 4, 6] {
        let far = libm::pow(10.0, f64::from(power));
        let body = format!("Translation {{ translation 0 0 -{far:e} }} Sphere {{ }}");
        let name = format!("a sphere of 1 m at 1e{power} m, m");
        cases.push(Case::of(name, far - 1.0, depth(&body)?, SINGLE));
    }
    Ok(cases)
}

/// Mirrored, flat, sheared and rotated shapes.
fn transforms() -> Result<Vec<Case>> {
    let sphere = "Translation { translation 0 0 -3 }";
    let sheared = format!(
        "{sphere} MatrixTransform {{ matrix 1 0 0 0  0 1 0 0  .5 0 1 0  0 0 0 1 }} Sphere {{ }}"
    );
    // A point q of the sphere is at (x + z/2, y, z): on the axis x = −z/2, so 5/4 z² = 1.
    let along = 3.0 - (0.8f64).sqrt();
    let mirrored = format!("{sphere} Scale {{ scaleFactor -1 1 1 }} Sphere {{ }}");
    let flat = format!("{sphere} Scale {{ scaleFactor 1 1 0 }} Sphere {{ }}");
    let thin = format!("{sphere} Scale {{ scaleFactor 1e-6 1e-6 1 }} Sphere {{ }}");
    let turned = format!(
        "{sphere} Rotation {{ rotation 1 2 3 1.234 }} Scale {{ scaleFactor 1 1 1 }} Sphere {{ }}"
    );
    Ok(vec![
        Case::of("a sheared sphere, m", along, depth(&sheared)?, SINGLE),
        Case::of("a mirrored sphere, m", 2.0, depth(&mirrored)?, SINGLE),
        Case::of("a sphere pressed flat, m", 3.0, depth(&flat)?, SINGLE),
        Case::of("a sphere as a needle, m", 2.0, depth(&thin)?, SINGLE),
        Case::of("a rotated sphere, m", 2.0, depth(&turned)?, SINGLE),
    ])
}

/// Needles, faces without area, faces in one plane.
fn faces() -> Result<Vec<Case>> {
    let face = |points: &str| {
        format!(
            "ShapeHints {{ faceType CONVEX }} Coordinate3 {{ point [ {points} ] }} \
             IndexedFaceSet {{ coordIndex [ 0, 1, 2, -1 ] }}"
        )
    };
    let needle = face("-1e-6 -1e3 -2, 1e-6 -1e3 -2, 0 1e3 -2");
    let wide = face("-1e7 -1e7 -2, 1e7 -1e7 -2, 0 1e7 -2");
    let point = face("0 0 -2, 0 0 -2, 0 0 -2");
    let line = face("-1 0 -2, 1 0 -2, 3 0 -2");
    let wall = |red: &str| {
        format!(
            "BaseColor {{ rgb {red} 0 0 }} {}",
            face("-1 -1 -2, 1 -1 -2, 0 1 -2")
        )
    };
    let both = format!(
        "LightModel {{ model BASE_COLOR }} {} {}",
        wall("1"),
        wall(".25")
    );
    let steep = face("-1 -1 -2, 1 -1 -2.000001, 0 1 -2");
    Ok(vec![
        Case::of(
            "a needle of 1e-6 by 1000 m, m",
            2.0,
            depth(&needle)?,
            SINGLE,
        ),
        Case::of("a face of 10,000 km, m", 2.0, depth(&wide)?, SINGLE),
        Case::of(
            "1 / distance to a face without area",
            0.0,
            1.0 / depth(&point)?,
            0.0,
        ),
        Case::of(
            "1 / distance to a face that is a line",
            0.0,
            1.0 / depth(&line)?,
            0.0,
        ),
        Case::of(
            "two faces in one plane: the last one's red",
            0.25,
            light(&both, 0)?,
            SINGLE,
        ),
        Case::of(
            "a face almost across the axis, m",
            2.000_000_25,
            depth(&steep)?,
            1e-6,
        ),
    ])
}

/// Lights inside shapes, and light between mirrors.
fn lights() -> Result<Vec<Case>> {
    let matte = "Material { diffuseColor 1 1 1 ambientColor 0 0 0 specularColor 0 0 0 }";
    let wall = "Coordinate3 { point [ -9 -9 -4, 9 -9 -4, 9 9 -4, -9 9 -4 ] } \
                IndexedFaceSet { coordIndex [ 0, 1, 2, 3, -1 ] }";
    let inside = format!(
        "{matte} PointLight {{ location 3 0 -3 }} Separator {{ Translation {{ translation 3 0 -3 }} \
         Cube {{ }} }} {wall}"
    );
    let lit = format!("{matte} DirectionalLight {{ direction 0 0 -1 }} {wall}");
    let near = format!("{matte} PointLight {{ location 0 0 -3.999999 }} {wall}");
    let mut cases = vec![
        Case::of(
            "a wall, its light inside a cube",
            0.0,
            light(&inside, 5)?,
            0.0,
        ),
        Case::of("a wall, lit straight on", 1.0, light(&lit, 5)?, SINGLE),
        Case::of(
            "a wall, a light 1 µm before it",
            1.0,
            light(&near, 5)?,
            SINGLE,
        ),
    ];
    // The first of two mirrors faces the camera, which looks through the second from behind it.
    for depth in [0u32, 1, 8, 32] {
        let glow = "Material { ambientColor 0 0 0 diffuseColor 0 0 0 specularColor 0.5 0 0 emissiveColor 0.5 0 0 \
                    shininess 1 }";
        let front = "Coordinate3 { point [ -9 -9 -4, 9 -9 -4, 9 9 -4, -9 9 -4 ] } \
                     IndexedFaceSet { coordIndex [ 0, 1, 2, 3, -1 ] }";
        let rear = "Coordinate3 { point [ -9 -9 4, -9 9 4, 9 9 4, 9 -9 4 ] } \
                    IndexedFaceSet { coordIndex [ 0, 1, 2, 3, -1 ] }";
        let body = format!("{glow} {front} {rear}");
        // The sum of the geometric series with `depth` reflections.
        let expected = 1.0 - libm::pow(0.5, f64::from(depth) + 1.0);
        let name = format!("two mirrors, {depth} reflections");
        cases.push(Case::of(name, expected, light(&body, depth)?, SINGLE));
    }
    Ok(cases)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_every_extreme_scene_is_within_its_bound() {
        for case in scene_cases().expect("the scenes compile") {
            assert!(case.holds(), "{case:?}");
        }
    }
}

//! The section of a lens with the rays of one pixel.

use glam::{DVec2, DVec3};
use ivcam_optics::diagram::drawing::{Drawing, Ink};
use ivcam_optics::diagram::{LensDiagram, SectionOptions};
use ivcam_optics::lens::{Lens, LensRay, RayPath};
use ivcam_render::camera::{Camera, LensCamera};

use super::plan::Plan;
use super::session::Session;

/// The number of samples of the pixel that are drawn.
pub(crate) const RAYS: u32 = 24;

/// Returns the section with the size of the room, in which its letters are legible, and the number
/// of rays that pass through the lens.
pub(crate) fn ray_section(
    camera: &LensCamera,
    plan: &Plan,
    [px, py]: [u32; 2],
    [width, height]: [f64; 2],
) -> (Drawing, usize) {
    let options = SectionOptions {
        width: width.max(80.0),
        height: height.max(80.0),
        fields: Vec::new(),
        lost: false,
        ..SectionOptions::of(camera.focus.film_z, 0.0)
    };
    let mut diagram = LensDiagram::of(&camera.lens, options);
    let mut passed = 0;
    let number = u64::from(py * plan.resolution.width + px);
    let pixel = plan.pixel_sampler().pixel(number, [px, py]);
    for index in 0..RAYS {
        let sample = pixel.sample(index);
        let x = (f64::from(px) + sample.film[0]) / f64::from(plan.resolution.width);
        let y = (f64::from(py) + sample.film[1]) / f64::from(plan.resolution.height);
        let Some((start, path)) = camera.path(camera.film_point(x, y), sample.pupil) else {
            continue;
        };
        passed += usize::from(path.outcome.is_ok());
        let ink = match path.outcome {
            Ok(_) => Ink::Ray(0),
            Err(_) => Ink::Lost(2),
        };
        let lost = path.outcome.is_err();
        diagram.add_path(flat(&camera.lens, &start, &path), ink, lost);
    }
    (diagram.drawing(), passed)
}

/// Projects a path to the plane of the axis and the film point: z, and the height along that
/// direction.
fn flat(lens: &Lens, start: &LensRay, path: &RayPath) -> Vec<DVec2> {
    let up = start.origin.truncate().try_normalize().unwrap_or(DVec2::Y);
    // The film point is drawn below the axis, as its image is upside down.
    let place = |p: DVec3| DVec2::new(p.z, -p.truncate().dot(up));
    let mut points = vec![place(lens.in_lens_space(start.origin))];
    points.extend(path.hits.iter().map(|p| place(*p)));
    if let Ok(out) = path.outcome {
        let lead = 0.35 * lens.length().max(start.origin.z);
        points.push(place(
            out.origin + lead / out.direction.z.abs().max(0.2) * out.direction,
        ));
    }
    points
}

impl Session {
    /// Returns the section of the lens with rays of the pixel at a place of the picture (x and y
    /// from 0 to 1), as SVG of a size in points; `None` without a real lens.
    pub fn ray_section(&self, [x, y]: [f64; 2], size: [f64; 2]) -> Option<String> {
        let Camera::Lens(camera) = &self.camera else {
            return None;
        };
        let cell = |t: f64, n: u32| ((t * f64::from(n)) as u32).min(n.saturating_sub(1));
        let all = self.plan.resolution;
        let pixel = [cell(x, all.width), cell(y, all.height)];
        let (drawing, _) = ray_section(camera, &self.plan, pixel, size);
        Some(drawing.to_svg())
    }
}

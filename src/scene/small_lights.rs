//! Finds luminous shapes that are so small in the picture that its samples may miss them.
//!
//! A shape is luminous if it has an emissive color or is not lit. Lights themselves (`PointLight`)
//! are invisible. Only what the camera sees directly is found; images in mirrors are not.

use glam::{DVec3, Vec3};

use super::RenderScene;
use crate::bvh::Ray;

/// A luminous shape that is small in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SmallLight {
    /// The radiance of the shape, as a level.
    pub radiance: DVec3,
    /// The area in pixels.
    pub pixels: f64,
    /// The place in the picture by the angle from the camera's axis, in pixels from its upper left
    /// corner. A lens with distortion shows the light elsewhere.
    pub place: [f64; 2],
}

/// The primitives of one luminous surface in front of the camera.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// The area in pixels.
    pixels: f64,
    /// The place to the right of and above the middle of the picture, times the area.
    place: [f64; 2],
    /// A point of each of the first primitives, with the primitive's number.
    points: [Option<(u32, Vec3)>; 8],
}

impl RenderScene {
    /// Returns the visible luminous shapes whose area is less than a number of pixels, in a picture
    /// with a width and height in pixels.
    pub(crate) fn small_lights(&self, size: [f64; 2], smaller_than: f64) -> Vec<SmallLight> {
        let luminous: Vec<Vec3> = self.surfaces.iter().map(Self::own_light).collect();
        if luminous.iter().all(|light| *light == Vec3::ZERO) {
            return Vec::new();
        }
        let mut seen = vec![Seen::default(); luminous.len()];
        for (primitive, &owner) in self.owners.iter().enumerate() {
            let owner = owner as usize;
            if luminous[owner] != Vec3::ZERO && seen[owner].pixels < smaller_than {
                self.see(primitive as u32, size, &mut seen[owner]);
            }
        }
        let small = |(radiance, seen): (Vec3, Seen)| SmallLight {
            radiance: radiance.as_dvec3(),
            pixels: seen.pixels,
            place: [
                0.5 * size[0] + seen.place[0] / seen.pixels,
                0.5 * size[1] - seen.place[1] / seen.pixels,
            ],
        };
        let is_small = |(_, seen): &(Vec3, Seen)| {
            seen.pixels > 0.0 && seen.pixels < smaller_than && self.is_in_sight(seen)
        };
        let all = luminous.into_iter().zip(seen);
        all.filter(is_small).map(small).collect()
    }

    /// The light that a surface has without lights.
    fn own_light(surface: &super::Surface) -> Vec3 {
        match surface.base_color {
            true => surface.diffuse.iter().copied().fold(Vec3::ZERO, Vec3::max),
            false => surface.emissive,
        }
    }

    /// Adds the area of a primitive in pixels to that of its surface, if it is in the picture.
    fn see(&self, primitive: u32, size: [f64; 2], seen: &mut Seen) {
        let Some((center, area)) = self.across(primitive) else {
            return;
        };
        let pixel = f64::from(self.view.pixel(center));
        let place = [self.view.right, self.view.up].map(|a| f64::from(center.dot(a)) / pixel);
        let outside = (0..2).any(|i| place[i].abs() > 0.5 * size[i] + 1.0);
        if !(pixel > 0.0) || outside {
            return;
        }
        let pixels = area / (pixel * pixel);
        seen.pixels += pixels;
        for (sum, place) in seen.place.iter_mut().zip(place) {
            *sum += pixels * place;
        }
        if let Some(free) = seen.points.iter_mut().find(|p| p.is_none()) {
            *free = Some((primitive, center));
        }
    }

    /// Returns the center of a primitive and its area as the camera sees it, in square meters.
    fn across(&self, primitive: u32) -> Option<(Vec3, f64)> {
        let toward = |p: Vec3| p.normalize_or(self.view.forward);
        if let Some([a, b, c]) = self.corners(primitive, 0) {
            let center = (a + b + c) / 3.0;
            let area = 0.5 * (b - a).cross(c - a).dot(toward(center)).abs();
            // Half of a closed surface's triangles face away.
            return Some((center, 0.5 * f64::from(area)));
        }
        let quadric = self
            .quadrics
            .get(primitive as usize - self.triangles.len())?;
        let (min, max) = quadric.bounds();
        let center = (0.5 * (min + max)).as_vec3();
        // The shadow of a box is the sum of its faces' shadows; an ellipsoid's is at most π/4 of
        // it.
        let side = max - min;
        let d = toward(center).as_dvec3().abs();
        let area = side.y * side.z * d.x + side.x * side.z * d.y + side.x * side.y * d.z;
        Some((center, std::f64::consts::FRAC_PI_4 * area))
    }

    /// Returns whether a ray from the camera meets one of the points.
    fn is_in_sight(&self, seen: &Seen) -> bool {
        let meets = |&(primitive, point): &(u32, Vec3)| {
            let hit = self.hit(&Ray::new(Vec3::ZERO, point));
            let owner = self.owner(primitive, 0);
            hit.is_none_or(|hit| hit.t >= 1.0 || self.owner(hit.primitive, hit.place) == owner)
        };
        seen.points.iter().flatten().any(meets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::iv::Document;
    use crate::scene::CompileOptions;
    use crate::snapshot::Snapshot;

    /// Returns the small lights of a scene in a picture of 100x100 pixels with a height angle of 45
    /// degrees, seen from the origin along -z.
    fn lights(text: &str, smaller_than: f64) -> Vec<SmallLight> {
        let text = format!("#Inventor V2.1 ascii\n{text}");
        let document = Document::read_headerless("lights.iv", text.into_bytes()).unwrap();
        let options = CompileOptions {
            pixel_rows: 100,
            ..CompileOptions::default()
        };
        let scene = RenderScene::compile(&Snapshot::at(&document, 0.0), &options).unwrap();
        scene.small_lights([100.0; 2], smaller_than)
    }

    const BALL: &str = "Separator { Material { diffuseColor 0 0 0 emissiveColor 9 6 3 }\n\
        Translation { translation 0 0 -10 } Sphere { radius .01 } }\n";

    /// A pixel is 2·tan 22.5°/100 of the distance, 0.0828 m at 10 m.
    #[test]
    fn a_small_ball_has_the_area_of_its_disc_in_pixels() {
        let found = lights(BALL, 1.0);
        let pixel = 20.0 * libm::tan(std::f64::consts::PI / 8.0) / 100.0;
        let disc = std::f64::consts::PI * 1e-4 / (pixel * pixel);
        assert_eq!(found.len(), 1);
        assert!((found[0].pixels / disc - 1.0).abs() < 1e-3, "{found:?}");
        assert!((found[0].radiance - DVec3::new(9.0, 6.0, 3.0)).length() < 1e-6);
        assert!((found[0].place[0] - 50.0).abs() < 1e-3);
    }

    #[test]
    fn only_small_lights_in_sight_are_found() {
        assert!(lights(BALL, 0.01).is_empty());
        let wall = "Translation { translation 0 0 -5 } Cube { }\n";
        assert!(lights(&format!("{BALL}{wall}"), 1.0).is_empty());
        let outside = BALL.replace("0 0 -10", "9 0 -10");
        assert!(lights(&outside, 1.0).is_empty());
        let behind = BALL.replace("0 0 -10", "0 0 10");
        assert!(lights(&behind, 1.0).is_empty());
        assert!(lights(&BALL.replace("emissiveColor 9 6 3", ""), 1.0).is_empty());
    }

    /// The triangles of a mesh count as one light.
    #[test]
    fn the_area_of_a_mesh_is_that_of_its_outline() {
        let cube = BALL.replace(
            "Sphere { radius .01 }",
            "Cube { width .02 height .02 depth .02 }",
        );
        let found = lights(&cube, 1.0);
        let pixel = 20.0 * libm::tan(std::f64::consts::PI / 8.0) / 100.0;
        let face = 4e-4 / (pixel * pixel);
        assert_eq!(found.len(), 1);
        assert!(
            (found[0].pixels / face - 1.0).abs() < 0.01,
            "{found:?} {face}"
        );
    }
}

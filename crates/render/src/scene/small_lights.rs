//! Finds luminous shapes that are so small in the picture that its samples may miss them.
//!
//! A shape is luminous if it has an emissive color or is not lit. Lights themselves (`PointLight`)
//! are invisible. Only what the camera sees in a straight line is found, be it through transparent
//! shapes; images in mirrors and behind glass that bends light are not, nor are glyphs that are
//! prototypes.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};
use ivcam_optics::sampling::{mix, unit};

use super::RenderScene;
use super::placed::Primitive;
use crate::bvh::{Hit, Ray};

/// The largest number of luminous shapes of prototypes that are examined, each as often as it is
/// drawn.
const MOST_INSTANCED: usize = 1 << 14;

/// The number of rays that look for a shape whose middle is hidden.
const LOOKS: u64 = 64;

/// A luminous shape that is small in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SmallLight {
    /// The radiance that comes from the shape to the camera, as a level.
    pub radiance: DVec3,
    /// The area in pixels.
    pub pixels: f64,
    /// The place in the picture by the angle from the camera's axis, in pixels from its upper left
    /// corner. A lens with distortion shows the light elsewhere.
    pub place: [f64; 2],
    /// The box around the shape in the scene.
    pub bounds: [Vec3; 2],
    /// The number of the shape's surface, and the place where it is drawn.
    pub shape: (u32, u64),
}

/// The primitives of one luminous surface in front of the camera.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// The area in pixels.
    pixels: f64,
    /// The place to the right of and above the middle of the picture, times the area.
    place: [f64; 2],
    /// A point of each of the first primitives, with the number and the place of the primitive.
    points: [Option<(u32, u64, Vec3)>; 8],
    /// The box around the primitives.
    bounds: Option<[Vec3; 2]>,
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
            let is_luminous = luminous[owner] != Vec3::ZERO && !self.is_in_prototype(owner as u32);
            if is_luminous && seen[owner].pixels < smaller_than {
                self.see((primitive as u32, 0), size, &mut seen[owner]);
            }
        }
        let small = |(radiance, seen): (Vec3, Seen)| {
            let (primitive, place, _) = seen.points[0]?;
            let share = self.share_in_sight(&seen);
            (share > 0.0).then_some(SmallLight {
                radiance: (share * radiance).as_dvec3(),
                pixels: seen.pixels,
                place: [
                    0.5 * size[0] + seen.place[0] / seen.pixels,
                    0.5 * size[1] - seen.place[1] / seen.pixels,
                ],
                bounds: seen.bounds?,
                shape: (self.owner(primitive), place),
            })
        };
        let is_small = |(_, seen): &(Vec3, Seen)| seen.pixels > 0.0 && seen.pixels < smaller_than;
        let instanced = self.instanced_lights(&luminous, size, smaller_than);
        let all = luminous.into_iter().zip(seen).chain(instanced);
        all.filter(is_small).filter_map(small).collect()
    }

    /// Returns the radiance of each luminous shape of a prototype, as often as it is drawn, with
    /// what is seen of it.
    fn instanced_lights(
        &self,
        luminous: &[Vec3],
        size: [f64; 2],
        smaller_than: f64,
    ) -> Vec<(Vec3, Seen)> {
        let Some(instances) = &self.instances else {
            return Vec::new();
        };
        let is_luminous = |surface: u32| luminous[surface as usize] != Vec3::ZERO;
        let shapes = instances.shapes_with(&is_luminous, MOST_INSTANCED);
        let light = |(surface, place): (u32, u64)| {
            let mut seen = Seen::default();
            for primitive in self.lists().numbers(&instances.shapes[surface as usize]) {
                if seen.pixels < smaller_than {
                    self.see((primitive, place), size, &mut seen);
                }
            }
            (luminous[surface as usize], seen)
        };
        shapes.into_iter().map(light).collect()
    }

    /// The light that a surface has without lights.
    fn own_light(surface: &super::Surface) -> Vec3 {
        match surface.base_color {
            true => surface.diffuse.iter().copied().fold(Vec3::ZERO, Vec3::max),
            false => surface.emissive,
        }
    }

    /// Adds the area of a primitive in pixels to that of its surface, if it is in the picture.
    fn see(&self, (primitive, place): (u32, u64), size: [f64; 2], seen: &mut Seen) {
        let Some((center, area, [min, max])) = self.across(primitive, place) else {
            return;
        };
        let pixel = f64::from(self.view.pixel(center));
        let at = [self.view.right, self.view.up].map(|a| f64::from(center.dot(a)) / pixel);
        let outside = (0..2).any(|i| at[i].abs() > 0.5 * size[i] + 1.0);
        if !(pixel > 0.0) || outside {
            return;
        }
        let pixels = area / (pixel * pixel);
        seen.pixels += pixels;
        for (sum, at) in seen.place.iter_mut().zip(at) {
            *sum += pixels * at;
        }
        let bounds = seen.bounds.unwrap_or([min, max]);
        seen.bounds = Some([bounds[0].min(min), bounds[1].max(max)]);
        if let Some(free) = seen.points.iter_mut().find(|p| p.is_none()) {
            *free = Some((primitive, place, center));
        }
    }

    /// Returns the center of a primitive, its area as the camera sees it, in square meters, and its
    /// box.
    fn across(&self, primitive: u32, place: u64) -> Option<(Vec3, f64, [Vec3; 2])> {
        let toward = |p: Vec3| p.normalize_or(self.view.forward);
        let hit = Hit::on(primitive, place, 0.0);
        let quadric = match self.primitive(&hit) {
            Primitive::Triangle([a, b, c]) => {
                let center = (a + b + c) / 3.0;
                let area = 0.5 * (b - a).cross(c - a).dot(toward(center)).abs();
                // Half of a closed surface's triangles face away.
                let bounds = [a.min(b).min(c), a.max(b).max(c)];
                return Some((center, 0.5 * f64::from(area), bounds));
            }
            Primitive::Quadric(quadric) => quadric,
            Primitive::Stroke(_) => return None,
        };
        let (min, max) = quadric.bounds();
        let center = (0.5 * (min + max)).as_vec3();
        // The shadow of a box is the sum of its faces' shadows; an ellipsoid's is at most π/4 of
        // it.
        let side = max - min;
        let d = toward(center).as_dvec3().abs();
        let area = side.y * side.z * d.x + side.x * side.z * d.y + side.x * side.y * d.z;
        let bounds = [min.as_vec3(), max.as_vec3()];
        Some((center, std::f64::consts::FRAC_PI_4 * area, bounds))
    }

    /// Returns the share of the light that comes along a ray from the camera to one of the points,
    /// or to another point of the shape's box; 0 if none meets the shape.
    fn share_in_sight(&self, seen: &Seen) -> f32 {
        let (Some(&(primitive, place, _)), Some([min, max])) =
            (seen.points[0].as_ref(), seen.bounds)
        else {
            return 0.0;
        };
        let shape = (self.owner(primitive), place);
        let toward =
            |point, distance| self.share_of_shape(&Ray::new(Vec3::ZERO, point), shape, distance);
        let shown = |number: u64| {
            let part = [0, 1, 2].map(|axis| unit(mix(3 * number + axis)) as f32);
            toward(min + Vec3::from_array(part) * (max - min), f32::INFINITY)
        };
        let points = seen.points.iter().flatten();
        let points = points.map(|(_, _, point)| toward(*point, 1.0));
        match points.fold(0.0, f32::max) {
            0.0 => (0..LOOKS).map(shown).fold(0.0, f32::max),
            share => share,
        }
    }

    /// Returns the share of the light of a shape that comes along a ray, through other shapes that
    /// light passes in a straight line. A ray without a hit nearer than a finite distance counts as
    /// one that meets the shape; otherwise the share is 0 if the ray does not meet it.
    pub(crate) fn share_of_shape(&self, ray: &Ray, shape: (u32, u64), distance: f32) -> f32 {
        self.share_passed(ray, |ahead| match self.hit(ahead) {
            Some(hit) if hit.t < distance && self.shape_of(&hit) == shape => {
                ControlFlow::Break(true)
            }
            Some(hit) if hit.t < distance => ControlFlow::Continue(hit),
            _ => ControlFlow::Break(distance.is_finite()),
        })
    }

    /// The number of the surface of a hit, and the place where it is drawn.
    pub(crate) fn shape_of(&self, hit: &Hit) -> (u32, u64) {
        (self.owner(hit.primitive), hit.place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{CompileOptions, Instancing};
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;

    /// Returns the small lights of a scene in a picture of 100x100 pixels with a height angle of 45
    /// degrees, seen from the origin along -z.
    fn lights(text: &str, smaller_than: f64) -> Vec<SmallLight> {
        stored_lights(text, smaller_than, Instancing::WhereItPays)
    }

    fn stored_lights(text: &str, smaller_than: f64, instancing: Instancing) -> Vec<SmallLight> {
        let text = format!("#Inventor V2.1 ascii\n{text}");
        let document = Document::read_headerless("lights.iv", text.into_bytes()).unwrap();
        let options = CompileOptions {
            pixel_rows: 100,
            instancing,
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

    /// Light passes a transparent shape, unless its glass bends it.
    #[test]
    fn a_light_behind_a_pane_has_the_share_that_passes() {
        let pane = "Translation { translation 0 0 -5 } Material { transparency .5 } Cube { }\n";
        let found = lights(&format!("{BALL}{pane}"), 1.0);
        assert_eq!(found.len(), 1);
        assert!((found[0].radiance - DVec3::new(2.25, 1.5, 0.75)).length() < 1e-6);
        let bent = "fields [ SFFloat refractionIndex, MFFloat transparency ] refractionIndex 1.5";
        let bent = pane.replace("transparency", &format!("{bent} transparency"));
        assert!(lights(&format!("{BALL}{bent}"), 1.0).is_empty());
    }

    /// A bar hides the middle of a ball and leaves a tenth of it in sight.
    #[test]
    fn a_light_that_shows_beside_a_bar_is_found() {
        let bar = |right: f64| {
            format!(
                "Translation {{ translation {} 0 -5 }} Cube {{ width .1 height 1 depth .001 }}",
                0.5 * right - 0.05
            )
        };
        assert_eq!(lights(&format!("{BALL}{}", bar(0.008)), 1.0).len(), 1);
        assert!(lights(&format!("{BALL}{}", bar(0.012)), 1.0).is_empty());
    }

    #[test]
    fn lights_in_shared_parts_are_found_as_often_as_they_are_drawn() {
        let cube = BALL.replace(
            "Sphere { radius .01 }",
            "Cube { width .02 height .03 depth .02 }",
        );
        let scene = format!(
            "DEF two Separator {{ {BALL} Translation {{ translation -1 .5 0 }} {cube} }}
            Separator {{ Translation {{ translation 1 0 0 }} USE two }}
            Separator {{ Translation {{ translation -.7 -1 0 }}
                Array {{ numElements1 3 separation1 .2 .3 -1 USE two }} }}"
        );
        let mut found = stored_lights(&scene, 1.0, Instancing::Everywhere);
        let expected = lights(&scene, 1.0);
        assert_eq!((found.len(), expected.len()), (2 + 2 + 3 * 2, 10));
        for light in expected {
            let what =
                |light: &SmallLight| (light.radiance, light.pixels, light.place, light.bounds);
            let same = found.iter().position(|other| what(other) == what(&light));
            found.remove(same.expect("the light is found"));
        }
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

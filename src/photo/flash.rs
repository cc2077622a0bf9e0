//! The flash of model `i`: the headlight of a scene without lights, as a small lamp beside the
//! lens.
//!
//! A light at the lens throws no shadows that are seen, so shapes look flat. A photographer's flash
//! is beside the lens: its shadows are narrow and soft. Sizes are relative to the distance of what
//! is seen, because the units of a scene say little about its size.

use glam::DVec3;
use ivcam_inventor::pose::CameraPose;
use ivcam_render::camera::Camera;
use ivcam_render::scene::RenderScene;
use ivcam_render::shade::Flash;

use super::view::rays_over;

/// The distance to the right of the lens and that above it, as shares of the distance of what is
/// seen: a tenth in sum, 5.7° from the lens's axis.
const ASIDE: [f64; 2] = [0.06, 0.08];
/// The radius, as a share of that distance: the flash looks 4.6° large.
const RADIUS: f64 = 0.04;
/// The rays over the picture whose median distance is that of what is seen.
const GRID: (u32, u32) = (12, 8);

/// Returns the flash of a camera that sees a scene; none if the camera sees no surface.
pub(super) fn flash_of(scene: &RenderScene, camera: &Camera, pose: &CameraPose) -> Option<Flash> {
    let rays = rays_over(camera, GRID, &[[0.5; 2]]);
    let distance = |ray| Some(scene.hit(&ray)?.t);
    let mut distances: Vec<f32> = rays.filter_map(distance).collect();
    distances.sort_by(f32::total_cmp);
    let median = f64::from(*distances.get(distances.len() / 2)?);
    let [right, up] = ASIDE;
    let aside = pose.orientation * DVec3::new(right, up, 0.0);
    let eye = pose.position - scene.origin;
    Some(Flash {
        position: (eye + median * aside).as_vec3(),
        radius: (RADIUS * median) as f32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, Vec3};
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;
    use ivcam_render::camera::Pinhole;
    use ivcam_render::scene::CompileOptions;

    #[test]
    fn a_flash_is_beside_the_lens_by_a_tenth_of_the_distance_of_what_is_seen() {
        let text = "#Inventor V2.1 ascii\nTranslation { translation 0 0 -10 }
            Cube { width 99 height 99 depth .01 }";
        let document = Document::read_headerless("w.iv", text.as_bytes().to_vec()).unwrap();
        let snapshot = Snapshot::at(&document, 0.0);
        let scene = RenderScene::compile(&snapshot, &CompileOptions::default()).unwrap();
        // A quarter turn to the left about the line of sight: right is up.
        let pose = CameraPose {
            orientation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
            ..CameraPose::view_all((DVec3::NEG_ONE, DVec3::ONE), 1.5)
        };
        let pose = CameraPose {
            position: scene.origin,
            ..pose
        };
        let camera = Camera::Pinhole(Pinhole::new(&pose, 1.5));
        let flash = flash_of(&scene, &camera, &pose).unwrap();
        // The median ray of a view of 45° is about 4% longer than the axis.
        let near = |a: f32, b: f32| (a / b - 1.0).abs() < 0.08;
        assert!(near(flash.radius, 0.4), "{flash:?}");
        let Vec3 { x, y, z } = flash.position;
        assert!(near(x, -0.8) && near(y, 0.6) && z.abs() < 1e-6, "{flash:?}");
        let away = CameraPose {
            orientation: DQuat::from_rotation_y(std::f64::consts::PI),
            ..pose
        };
        let camera = Camera::Pinhole(Pinhole::new(&away, 1.5));
        assert_eq!(flash_of(&scene, &camera, &away), None);
    }
}

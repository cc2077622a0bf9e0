//! Adds a studio to a scene that is being compiled.

use glam::{DVec3, Vec3};
use ivcam_inventor::traversal::state::{AlphaMode, EnvironmentElement, FogKind};

use super::walk::Compiler;
use crate::scene::looks::{CornerNormals, Surface};
use crate::scene::studio::{LAMPS, Strip};

impl Compiler<'_> {
    /// Adds the studio of the options after everything else. Its ground is lit by the lights of the
    /// shape that has most.
    pub(super) fn add_studio(&mut self) {
        let studio = self.builder.options.studio;
        let Some(studio) = studio.filter(|_| !self.builder.scene.surfaces.is_empty()) else {
            return;
        };
        let camera = self.builder.options.camera.as_ref();
        let looks = camera.map_or(DVec3::NEG_Z, |c| c.orientation * DVec3::NEG_Z);
        let Some(place) = studio.place(looks) else {
            return;
        };
        if let Some(reflectance) = studio.ground {
            let ground = Surface {
                diffuse: vec![reflectance],
                two_sided: true,
                ..self.studio_surface()
            };
            self.add_strip(ground, &place.ground(studio.has_backdrop));
        }
        if studio.has_lamps {
            for lamp in &LAMPS {
                let (strip, radiance) = place.lamp(lamp);
                let surface = Surface {
                    emissive: Vec3::splat(radiance),
                    culls: true,
                    ..self.studio_surface()
                };
                self.builder.scene.special = true;
                self.add_strip(surface, &strip);
            }
        }
    }

    /// A black surface outside of all fog.
    fn studio_surface(&self) -> Surface {
        let environment = EnvironmentElement {
            ambient: Vec3::ZERO,
            attenuation: Vec3::Z,
            fog: FogKind::None,
            fog_color: Vec3::ZERO,
            visibility: 0.0,
        };
        Surface {
            class: "Studio",
            ambient: Vec3::ZERO,
            ambient_intensity: None,
            diffuse: vec![Vec3::ZERO],
            specular: Vec3::ZERO,
            emissive: Vec3::ZERO,
            shininess: 0.0,
            transparency: vec![0.0],
            alpha: AlphaMode::Blend,
            refraction: 1.0,
            physical: None,
            local_viewer: false,
            base_color: false,
            two_sided: false,
            culls: false,
            counterclockwise: true,
            layer: 1,
            casts_shadow: true,
            on_top: false,
            environment,
            lights: self.builder.shared.lights.largest_set(),
            texture: None,
            further_textures: Vec::new(),
            clip: Vec::new(),
            first: self.builder.scene.triangles.len() as u32,
            normals: CornerNormals::default(),
            materials: Vec::new(),
            coordinates: Vec::new(),
            thirds: Vec::new(),
            center: Vec3::ZERO,
        }
    }

    /// Adds the triangles of a strip as one shape.
    fn add_strip(&mut self, surface: Surface, strip: &Strip) {
        let before = self.builder.lengths();
        let builder = &mut self.builder;
        builder.assign_surface();
        builder.add_surface(surface);
        let origin = builder.scene.origin;
        let at = |point: DVec3| (point - origin).as_vec3();
        let scene = &mut builder.scene;
        for pair in strip.windows(2) {
            let [(near, n), (far, m)] = [pair[0], pair[1]];
            let [a, b, c, d] = [near[0], near[1], far[1], far[0]].map(at);
            let [n, m] = [n, m].map(|normal| normal.as_vec3());
            scene.triangles.extend([[a, b, c], [a, c, d]]);
            if let Some(surface) = scene.surfaces.last_mut() {
                surface.normals.push([n, n, m]);
                surface.normals.push([n, m, m]);
            }
        }
        builder.assign_surface();
        if self.instances.prototypes.is_some() {
            self.keep_shape(before, Some(Vec::new()));
        }
    }
}

//! Packets of rays in a scene: their hits, and the light that they transmit.
//!
//! The results have the same bits as those of single rays.

use glam::Vec3;
use ivcam_base::math::lanes::{LANES, Lanes, RaysInLanes, SimdKernel, bits, dispatch, of_lane};

use super::render_scene::RenderScene;
use crate::bvh::{Hit, PacketHits, Primitives, Ray, RayPacket};

impl Primitives for RenderScene {
    fn distances(&self, origin: Vec3, direction: Vec3, primitive: u32, t_max: f32) -> [f32; 2] {
        let index = primitive as usize - self.triangles.len();
        if let Some(quadric) = self.quadrics.get(index) {
            if !quadric.may_hit(origin, direction, t_max) {
                return [f32::NAN; 2];
            }
            let found = quadric.intersect(origin.as_dvec3(), direction.as_dvec3());
            return found.map(|t| t as f32);
        }
        let stroke = &self.strokes[index - self.quadrics.len()];
        let found = stroke.intersect(origin, direction, &self.view);
        [found.unwrap_or(f32::NAN), f32::NAN]
    }

    fn distances_in_lanes(
        &self,
        rays: RaysInLanes<'_>,
        primitive: u32,
        lanes: u32,
        distances: &mut [Lanes<f32>; 2],
    ) -> u32 {
        if let Some(quadric) = self.quadrics.get(primitive as usize - self.triangles.len()) {
            return quadric.intersect_lanes(rays, lanes, distances);
        }
        for lane in bits(lanes) {
            let (origin, direction) = (of_lane(rays.origin, lane), of_lane(rays.direction, lane));
            let found = self.distances(origin, direction, primitive, rays.t_max[lane]);
            (distances[0][lane], distances[1][lane]) = (found[0], found[1]);
        }
        lanes
    }

    #[inline]
    fn transmittance_of(&self, primitive: u32) -> f32 {
        match self.solid {
            true => 0.0,
            false => self.surface_transmittances[self.owners[primitive as usize] as usize],
        }
    }

    #[inline]
    fn may_be_culled(&self, primitive: u32) -> bool {
        self.culls_shadows && self.surfaces[self.owners[primitive as usize] as usize].culls
    }

    #[inline]
    fn is_culled(&self, origin: Vec3, toward_light: Vec3, primitive: u32, t: f32) -> bool {
        if !self.may_be_culled(primitive) {
            return false;
        }
        let hit = Hit::on(primitive, 0, t);
        self.is_culled_from_light(&Ray::new(origin, toward_light), &hit)
    }
}

impl RenderScene {
    /// Finds the hits of a packet of rays, as [`RenderScene::hit`] does for one ray.
    pub(crate) fn hits(&self, rays: &RayPacket, hits: &mut PacketHits) {
        if self.stop.is_set() {
            hits.mask = 0;
            return;
        }
        // Rays whose nearest hit may not be the visible one.
        let mut doubtful = if self.annotated {
            hits.mask = 0;
            rays.mask
        } else {
            self.nearest_hits(rays, hits)
        };
        if self.special {
            for lane in bits(hits.mask & !doubtful) {
                let visible = |hit: Hit| self.is_visible(&rays.ray(lane), &hit);
                doubtful |= u32::from(!hits.hit(lane).is_none_or(visible)) << lane;
            }
        }
        bits(doubtful).for_each(|lane| hits.set(lane, self.hit(&rays.ray(lane))));
    }

    /// Finds the hits of a packet of rays, as [`RenderScene::hit_any_side`] does for one ray.
    pub(crate) fn hits_any_side(&self, rays: &RayPacket, hits: &mut PacketHits) {
        let doubtful = self.nearest_hits(rays, hits);
        bits(doubtful).for_each(|lane| hits.set(lane, self.hit_any_side(&rays.ray(lane))));
    }

    /// Whether rays are traced one by one: packets cannot limit a ray's steps.
    fn traces_alone(&self) -> bool {
        self.instances.is_some() || self.is_crowded()
    }

    /// Finds the nearest hits of a packet of rays, whether or not they are visible. Returns a bit
    /// mask of the rays that must be traced alone.
    fn nearest_hits(&self, rays: &RayPacket, hits: &mut PacketHits) -> u32 {
        if self.traces_alone() {
            hits.mask = 0;
            return rays.mask;
        }
        self.tree().nearest_hits(rays, self, hits)
    }

    /// Computes the transmittances of a packet of rays, each up to its own `t_max`, as
    /// [`RenderScene::transmittance`] does for one ray. Behind three transparent primitives or more
    /// the order of the factors, and so the rounding, may differ.
    pub(crate) fn transmittances(&self, rays: &RayPacket, through: &mut Lanes<f32>) {
        if self.traces_alone() {
            for lane in bits(rays.mask) {
                through[lane] = self.transmittance(&rays.ray(lane), rays.t_max[lane]);
            }
            return;
        }
        let mut hits = PacketHits::default();
        let differing = self.tree().transmittances(rays, self, &mut hits);
        dispatch(Remaining {
            hits: &hits,
            through,
        });
        for lane in bits(differing & !hits.mask) {
            through[lane] = self.transmittance(&rays.ray(lane), rays.t_max[lane]);
        }
    }
}

/// Computes the fraction of light that remains of rays toward a light.
struct Remaining<'a> {
    hits: &'a PacketHits,
    through: &'a mut Lanes<f32>,
}

impl SimdKernel for Remaining<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const FUSED: bool>(self) {
        for i in 0..LANES {
            let blocked = self.hits.mask >> i & 1 == 1;
            self.through[i] = if blocked { 0.0 } else { self.hits.through[i] };
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use ivcam_base::math::use_portable_arithmetic;

    use super::*;
    use crate::scene::CompileOptions;
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;

    fn compiled(text: String) -> RenderScene {
        let document = Document::read_headerless("bundle.iv", text.into_bytes()).unwrap();
        RenderScene::compile(&Snapshot::at(&document, 0.0), &CompileOptions::default()).unwrap()
    }

    #[test]
    fn a_ray_among_many_primitives_at_one_place_is_cut_and_counted() {
        let sphere = "Translation { translation .0001 0 0 } Sphere { } ";
        let scene =
            |count: usize| compiled(format!("#Inventor V2.1 ascii\n{}", sphere.repeat(count)));
        let ray = Ray::new(Vec3::new(0.3, 0.2, 9.0), Vec3::NEG_Z);
        let few = scene(500);
        assert!(!few.is_crowded() && few.hit(&ray).is_some());
        let many = scene(6000);
        assert!(many.is_crowded() && many.hit(&ray).is_some());
        assert_eq!(many.cut_rays(), 1);
        let mut rays = RayPacket::default();
        rays.set(3, &ray);
        let mut hits = PacketHits::default();
        many.hits(&rays, &mut hits);
        assert_eq!(hits.hit(3), many.hit(&ray));
        assert_eq!(many.cut_rays(), 3);
        let warning = many.warn_of_cut_rays().expect("a warning");
        assert!(
            warning
                .message
                .starts_with("3 rays took more than 3814 steps")
        );
    }

    /// Set for a process whose tests use the vectors that every processor has.
    const PORTABLE: &str = "IVCAM_TEST_PORTABLE";

    #[test]
    fn a_packet_in_the_vectors_of_every_processor_has_the_hits_of_its_single_rays() {
        let this = std::env::current_exe().unwrap();
        let test = "scene::packets::tests::a_packet_has_the_hits_of_its_single_rays";
        let mut command = std::process::Command::new(this);
        let run = command.args([test, "--exact"]).env(PORTABLE, "1").output();
        let output = String::from_utf8(run.unwrap().stdout).unwrap();
        assert!(output.contains("1 passed"), "{output}");
    }

    #[test]
    fn a_packet_has_the_hits_of_its_single_rays() {
        if std::env::var_os(PORTABLE).is_some() {
            use_portable_arithmetic();
        }
        let text = "#Inventor V2.1 ascii\nSphere { }\nTranslation { translation 1 .4 .5 }\n\
             Cube { width .5 }\nTranslation { translation -2 -1 0 } Cone { }\n\
             Coordinate3 { point [ -1 -1 2, 3 -1 2, 3 2 2.5, -1 2 2 ] }\n\
             IndexedFaceSet { coordIndex [ 0, 1, 2, -1, 0, 2, 3, -1, 0, 1, 2, -1 ] }\n";
        for hints in [
            "",
            "ShapeHints { vertexOrdering CLOCKWISE shapeType SOLID }\n",
            "Separator { Material { transparency .4 } Cube { width 4 depth 1 } }\n",
            "Separator { Material { transparency .3 } Sphere { radius 1.5 } }\n",
            "ClipPlane { plane 1 0 0 -.5 }\n",
            "Separator { Texture2 { image 2 1 2 0xffff 0xff40 } Cube { width 4 depth 1 } }\n",
            "Separator { ShadowStyle { style NO_SHADOWS } Cube { width 4 depth 1 } }\n",
        ] {
            let text = text.replacen('\n', &format!("\n{hints}"), 1);
            let document = Document::read_headerless("bundle.iv", text.into_bytes()).unwrap();
            let scene =
                RenderScene::compile(&Snapshot::at(&document, 0.0), &CompileOptions::default())
                    .unwrap();
            let mut state = 1u64;
            let mut unit = move || {
                state = ivcam_optics::sampling::mix(state);
                (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
            };
            let (mut hit, mut blocked) = (0, 0);
            for count in (0..=LANES).cycle().take(400) {
                let mut any = || Vec3::new(unit(), unit(), unit());
                let (eye, aim) = (8.0 * any(), 3.0 * any());
                let ray = |at: Vec3| Ray {
                    t_max: 1.0,
                    ..Ray::new(eye + 0.01 * at, aim + at - eye)
                };
                // Lanes without a ray have NaN.
                let mut rays = RayPacket::default();
                rays.origin[0] = [f32::NAN; LANES];
                let every = 1 + count % 3;
                (0..count).for_each(|i| rays.set(i * every % LANES, &ray(any())));
                let mut hits = PacketHits::default();
                let mut through = [0.5; LANES];
                scene.hits(&rays, &mut hits);
                let mut any_side = PacketHits::default();
                scene.hits_any_side(&rays, &mut any_side);
                scene.transmittances(&rays, &mut through);
                assert_eq!(hits.mask & !rays.mask, 0);
                for i in bits(rays.mask) {
                    let ray = rays.ray(i);
                    assert_eq!(hits.hit(i), scene.hit(&ray), "{ray:?}");
                    assert_eq!(any_side.hit(i), scene.hit_any_side(&ray), "{ray:?}");
                    assert_eq!(through[i], scene.transmittance(&ray, 1.0), "{ray:?}");
                    hit += usize::from(hits.hit(i).is_some());
                    blocked += usize::from(through[i] == 0.0);
                }
            }
            assert!(hit > 1000 && blocked > 1000, "{hit} {blocked}");
        }
    }
}

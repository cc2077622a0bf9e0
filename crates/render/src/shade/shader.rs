//! The shader, which computes the radiance along rays.

use std::sync::OnceLock;

use glam::Vec3;
use ivcam_base::math::lanes::{LANES, Lanes, Vec3Lanes, bits, set_lane};
use ivcam_optics::sampling::PathPoints;

use super::counts::RayCounts;
use super::lanes::{PointLanes, SurfaceValues};
use super::lighting;
use super::many_lights::LightChoice;
use super::path::{PathLights, PathOptions, PathSurface, PathWork};
use super::shading::Shading;
use crate::bvh::{Hit, PacketHits, Ray, RayPacket};
use crate::scene::{IncidentLight, Light, Point, RenderScene, SHADOW_END, Surface};

/// The options of a [`Shader`].
#[derive(Clone, Debug)]
pub struct ShadeOptions {
    /// A light on the camera, in world directions. Default: none, as in the 1999 program.
    pub headlight: Option<Light>,
    /// The camera's backward direction, used for highlights and fog. Default: +z.
    pub backward: Vec3,
    /// How far in front of the camera its rays start, in meters, which fog counts too: the near
    /// distance of an orthographic camera. Default: 0.
    pub start: f32,
    /// The viewer's position in the scene's coordinates, used for highlights of VRML97. Default:
    /// the origin.
    pub viewer: Vec3,
    /// The largest number of successive reflections and refractions. Default: 5.
    pub max_depth: u32,
    /// Whether lights at the camera, such as the headlight, cast shadows. Default: no, because
    /// nothing that is seen can be in them. The 1999 program: yes (a guess).
    pub shadows_at_eye: bool,
    /// The least fraction of light that a surface reflects for it to be a mirror, from 0 to 1.
    /// Other surfaces have highlights only. Default: no surface is a mirror. The 1999 program: 0,
    /// every surface with highlights.
    pub mirrors: Option<f32>,
    /// A ray ends if it contributes at most this fraction of its radiance to the picture. Default:
    /// 1/1024.
    pub least_share: f32,
    /// The options of model `i`.
    pub path: PathOptions,
}

impl Default for ShadeOptions {
    fn default() -> Self {
        Self {
            headlight: None,
            backward: Vec3::Z,
            start: 0.0,
            viewer: Vec3::ZERO,
            max_depth: 5,
            shadows_at_eye: false,
            mirrors: None,
            least_share: 1.0 / 1024.0,
            path: PathOptions::default(),
        }
    }
}

impl ShadeOptions {
    /// Returns the direction to the viewer for the highlight at a point. Inventor's viewer is at
    /// infinity (as in OpenGL without `GL_LIGHT_MODEL_LOCAL_VIEWER`), VRML97's is where it is (ISO
    /// 14772-1, 4.14.4).
    pub(super) fn to_viewer(&self, point: Vec3, local_viewer: bool) -> Vec3 {
        match local_viewer {
            true => (self.viewer - point).normalize_or(self.backward),
            false => self.backward,
        }
    }
}

/// The largest number of transparent faces behind which the models without reflected rays still
/// show what is there.
const MAX_FACES: u32 = 64;
/// The largest number of transparent faces that model `gl` blends.
const MAX_LAYERS: usize = 1000;

/// Computes the radiance along rays through a scene by one shading model.
#[derive(Debug)]
pub struct Shader<'a> {
    pub(super) scene: &'a RenderScene,
    pub(super) shading: Shading,
    pub(super) options: ShadeOptions,
    /// The values of surfaces that packets need, computed for the first packet.
    surfaces: OnceLock<Vec<SurfaceValues>>,
    /// What lights the scene of model `i`, and its surfaces, found for the first path.
    pub(super) path_lights: OnceLock<(PathLights, Vec<PathSurface>)>,
}

/// The state that a thread keeps between rays: counts, and buffers for reuse.
#[derive(Debug, Default)]
pub struct Work {
    /// The rays traced so far.
    pub(crate) counts: RayCounts,
    pub(super) pending: Vec<Pending>,
    /// The points of the packet that was shaded last that are lit in lanes.
    pub(super) points: Box<PointLanes>,
    /// The choice among many lights.
    pub(super) choice: LightChoice,
    /// The paths of model `i`.
    pub(super) paths: PathWork,
}

/// A ray still to be traced, and how much of its radiance reaches the film.
#[derive(Debug)]
pub(super) struct Pending {
    pub(super) ray: Ray,
    /// The lane of the packet whose ray led to this one.
    pub(super) lane: usize,
    /// The fraction of its radiance that reaches the film.
    pub(super) share: Vec3,
    depth: u32,
    /// Whether the ray hits surfaces from either side. A ray that a mirror or glass has turned also
    /// hits the back faces of closed shapes, which are hidden from the camera.
    any_side: bool,
}

impl Pending {
    /// The path of a camera ray.
    pub(super) fn first(ray: &Ray, lane: usize) -> Self {
        Self {
            ray: *ray,
            lane,
            share: Vec3::ONE,
            depth: 0,
            any_side: false,
        }
    }

    /// Whether the ray can be traced in a packet with others.
    pub(super) fn joins_packet(&self) -> bool {
        self.any_side && self.ray.has_no_limits()
    }
}

impl<'a> Shader<'a> {
    /// Makes a shader for a scene.
    pub fn new(scene: &'a RenderScene, shading: Shading, options: ShadeOptions) -> Self {
        Self {
            scene,
            shading,
            options,
            surfaces: OnceLock::new(),
            path_lights: OnceLock::new(),
        }
    }

    /// The values of surfaces that packets need, by surface number.
    pub(super) fn surface_values(&self) -> &[SurfaceValues] {
        self.surfaces.get_or_init(|| {
            let surfaces = self.scene.surfaces().iter();
            surfaces
                .map(|surface| {
                    let mirror = self.mirror_share(surface);
                    SurfaceValues::new(surface, self.shading, mirror != Vec3::ZERO)
                })
                .collect()
        })
    }

    /// The scene that is shaded.
    pub(crate) fn scene(&self) -> &'a RenderScene {
        self.scene
    }

    /// Returns the radiance along a ray from the camera.
    pub fn radiance(&self, ray: &Ray, work: &mut Work) -> Vec3 {
        work.counts.scene += 1;
        self.radiance_of(ray, self.scene.hit(ray), work)
    }

    /// Returns the radiance along a ray from the camera whose hit is already known.
    pub fn radiance_of(&self, ray: &Ray, hit: Option<Hit>, work: &mut Work) -> Vec3 {
        if self.shading == Shading::Path {
            return self.path_radiance(ray, hit, work);
        }
        let Some(hit) = hit else {
            return self.scene.background().color(ray.direction);
        };
        if self.shading == Shading::Gl {
            return self.blended(ray, hit);
        }
        let mut color = Vec3::ZERO;
        self.shade(hit, &Pending::first(ray, 0), &mut color, work);
        self.follow_pending(color, work)
    }

    /// Computes the hits of a packet of rays, and the radiances along them. They equal those of
    /// [`Shader::radiance`] up to rounding and take less time. `points` are the random numbers of
    /// the samples, for model `i`; without them, those of a ray depend on its bits.
    pub(crate) fn radiances(
        &self,
        rays: &RayPacket,
        points: Option<&Lanes<PathPoints>>,
        hits: &mut PacketHits,
        radiances: &mut Vec3Lanes,
        work: &mut Work,
    ) {
        self.hits(rays, hits, work);
        if self.shading == Shading::Path {
            return self.path_radiances((rays, hits), points, &[1.0; LANES], radiances, work);
        }
        let done = self.shade_packet(rays, hits, radiances, work);
        for lane in bits(rays.mask & !done) {
            let color = self.radiance_of(&rays.ray(lane), hits.hit(lane), work);
            set_lane(radiances, lane, color);
        }
    }

    /// Traces the pending rays and adds their radiances to a color.
    fn follow_pending(&self, mut color: Vec3, work: &mut Work) -> Vec3 {
        while let Some(next) = work.pending.pop() {
            work.counts.scene += 1;
            match self.next_hit(&next) {
                Some(hit) => self.shade(hit, &next, &mut color, work),
                None => {
                    color += next.share * self.scene.background().color(next.ray.direction);
                }
            }
        }
        color
    }

    /// Returns the hit of a pending ray.
    pub(super) fn next_hit(&self, next: &Pending) -> Option<Hit> {
        if next.any_side {
            self.scene.hit_any_side(&next.ray)
        } else {
            self.scene.hit(&next.ray)
        }
    }

    fn shade(&self, hit: Hit, path: &Pending, color: &mut Vec3, work: &mut Work) {
        let point = self.scene.point(&path.ray, &hit);
        let light = self.light_point(&point, &mut work.counts);
        self.accumulate(&hit, &point, light, path, color, &mut work.pending);
    }

    /// Computes the hits of a packet of rays without shading.
    pub(crate) fn hits(&self, rays: &RayPacket, hits: &mut PacketHits, work: &mut Work) {
        work.counts.scene += u64::from(rays.mask.count_ones());
        self.scene.hits(rays, hits);
    }

    /// The light that leaves a point, before texture and fog.
    pub(super) fn light_point(&self, point: &Point<'_>, counts: &mut RayCounts) -> Vec3 {
        if self.shading == Shading::Recursive {
            self.lit_in_shadow(point, counts)
        } else {
            self.lit_without_shadow(point)
        }
    }

    /// Adds to a color what a lit point sends back along a path, and appends the rays to trace from
    /// the point.
    pub(super) fn accumulate(
        &self,
        hit: &Hit,
        point: &Point<'_>,
        light: Vec3,
        path: &Pending,
        color: &mut Vec3,
        pending: &mut Vec<Pending>,
    ) {
        let ray = &path.ray;
        if self.shading == Shading::Recursive {
            self.recurse(hit, point, light, path, color, pending);
            return;
        }
        let local = self.local(ray, point, light);
        let through = point.transparency;
        *color += path.share * (1.0 - through) * local;
        // A transparent face shows what lies behind it, as sorted blending does in Coin.
        let share = path.share * through;
        if through > 0.0 && share.max_element() > self.options.least_share && path.depth < MAX_FACES
        {
            pending.push(Pending {
                ray: self.scene.continue_behind(ray, hit),
                lane: path.lane,
                share,
                depth: path.depth + 1,
                any_side: path.any_side,
            });
        }
    }

    /// The color by model `g`, as in OpenGL's frame buffer. The opaque shapes are drawn first. The
    /// transparent ones are then blended over them, from the shape with the farthest center to the
    /// nearest (Inventor's `SORTED_OBJECT_BLEND`).
    fn blended(&self, ray: &Ray, first: Hit) -> Vec3 {
        let mut ray = *ray;
        let mut layers: Vec<(f32, u64, Vec3, f32)> = Vec::new();
        let mut next = Some(first);
        let mut color = self.scene.background().color(ray.direction);
        while let Some(hit) = next {
            let point = self.scene.point_before_texture(&ray, &hit);
            let local = self.interpolated(&ray, &hit, &point);
            if point.surface.is_opaque() {
                color = local;
                break;
            }
            let away = (ray.origin - point.surface.center).dot(self.options.backward);
            let rank = self.scene.rank(&hit);
            layers.push((away, rank, local, point.transparency));
            ray = self.scene.continue_behind(&ray, &hit);
            next = self.scene.hit(&ray).filter(|_| layers.len() < MAX_LAYERS);
        }
        layers.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        layers.iter().fold(color, |below, (_, _, own, through)| {
            own.lerp(below, *through)
        })
    }

    /// The color interpolated between a triangle's lit corners. Lines and points are lit at the
    /// hit.
    fn interpolated(&self, ray: &Ray, hit: &Hit, point: &Point<'_>) -> Vec3 {
        match self.scene.corner_points(ray, hit) {
            Some(corners) => {
                let lit = corners.map(|(corner, weight)| weight * self.lit_without_shadow(&corner));
                self.fogged(ray, point, lit[0] + lit[1] + lit[2])
            }
            None => self.local(ray, point, self.lit_without_shadow(point)),
        }
    }

    /// The color of a point by the models without reflected rays.
    fn local(&self, ray: &Ray, point: &Point<'_>, light: Vec3) -> Vec3 {
        match self.shading {
            Shading::Normal => 0.5 * point.normal + 0.5,
            Shading::Flat => point.textured(point.diffuse),
            _ => self.fogged(ray, point, light),
        }
    }

    /// The light that leaves a point with its texture, through the fog between it and the camera of
    /// a ray.
    #[inline]
    fn fogged(&self, ray: &Ray, point: &Point<'_>, light: Vec3) -> Vec3 {
        let color = point.textured(light);
        lighting::fogged(color, point, self.eye(ray), self.options.backward)
    }

    /// The eye of a camera ray.
    fn eye(&self, ray: &Ray) -> Vec3 {
        lighting::eye(ray.origin, self.options.backward, self.options.start)
    }

    /// The direction to the viewer for the highlight at a point.
    fn to_viewer(&self, point: &Point<'_>) -> Vec3 {
        let local_viewer = point.surface.local_viewer;
        self.options.to_viewer(point.position, local_viewer)
    }

    /// The light that leaves a point, without shadows, texture and fog, clamped to 0 to 1 as in
    /// OpenGL.
    fn lit_without_shadow(&self, point: &Point<'_>) -> Vec3 {
        if point.surface.base_color || matches!(self.shading, Shading::Flat | Shading::Normal) {
            return point.diffuse;
        }
        let mut sum = lighting::ambient(point);
        if self.shading != Shading::Ambient {
            let specular = self.shading != Shading::Diffuse;
            let to_viewer = self.to_viewer(point);
            for light in self.lights(point) {
                let incident = light.reach(point.position);
                sum += lighting::direct(point, &incident, to_viewer, specular, 1.0);
            }
        }
        sum.clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// The lights that light a point.
    fn lights<'b>(&'b self, point: &Point<'b>) -> impl Iterator<Item = &'b Light> {
        self.scene
            .lights_of(point.surface)
            .chain(self.options.headlight.as_ref())
    }

    /// Whether a light casts shadows.
    #[inline]
    pub(super) fn casts_shadows(&self, light: &Light) -> bool {
        self.shading == Shading::Recursive && (self.options.shadows_at_eye || !light.at_eye)
    }

    /// The fraction of light that a surface reflects as a mirror where it is opaque.
    fn mirror_share(&self, surface: &Surface) -> Vec3 {
        let share = surface.mirror();
        match self.options.mirrors {
            Some(least) if self.shading == Shading::Recursive && share.max_element() >= least => {
                share
            }
            _ => Vec3::ZERO,
        }
    }

    /// The light that leaves a point by model `r`.
    fn lit_in_shadow(&self, point: &Point<'_>, counts: &mut RayCounts) -> Vec3 {
        if point.surface.base_color {
            return point.diffuse;
        }
        let mut sum = lighting::ambient(point);
        let to_viewer = self.to_viewer(point);
        for light in self.lights(point) {
            let incident = light.reach(point.position);
            let ray = shadow_ray(point, &incident).filter(|_| self.casts_shadows(light));
            let shadow = ray.map_or(1.0, |ray| {
                counts.shadow += 1;
                self.scene.transmittance(&ray, ray.t_max)
            });
            sum += lighting::direct(point, &incident, to_viewer, true, shadow);
        }
        sum
    }

    /// Adds the color of a point by model `r`, and appends up to two rays to trace from the point.
    ///
    /// The direct light is that of `p` times the transmittance along the shadow ray. The opaque
    /// part has the share 1 − transparency. The two rays are:
    ///
    /// * on a mirror the reflected ray, with the share specular · shininess;
    /// * on a transparent surface the refracted ray, with the share transparency. It is bent by
    ///   the index of refraction, which is 1 unless an extension field sets it. Beyond the critical
    ///   angle its share goes to the reflected ray.
    ///
    /// The fog before the point dims a ray that leaves in another direction. One that goes straight
    /// on has the fog of its whole length.
    fn recurse(
        &self,
        hit: &Hit,
        point: &Point<'_>,
        lit: Vec3,
        path: &Pending,
        color: &mut Vec3,
        pending: &mut Vec<Pending>,
    ) {
        let ray = &path.ray;
        let surface = point.surface;
        let opaque = 1.0 - point.transparency;
        let eye = match path.any_side {
            true => ray.origin, // A mirror or glass has turned the ray here.
            false => self.eye(ray),
        };
        let backward = self.options.backward;
        let seen = lighting::fogged(point.textured(lit), point, eye, backward);
        *color += path.share * opaque * seen;
        if path.depth >= self.options.max_depth {
            return;
        }
        let mut mirror = self.mirror_share(surface) * opaque;
        if point.transparency <= 0.0 && mirror.max_element() <= 0.0 {
            return;
        }
        let clear = || lighting::clearness(point, eye, backward);
        let d = ray.direction.normalize_or(Vec3::NEG_Z);
        let facing = if point.normal.dot(d) > 0.0 {
            -point.normal
        } else {
            point.normal
        };
        let normal = facing.normalize_or(point.geometric);
        if point.transparency > 0.0 {
            let share = path.share * point.transparency;
            match refract(d, normal, surface.refraction, point.front) {
                Some(_) if surface.refraction == 1.0 => {
                    // The ray continues in its direction, and also hits primitives in the same
                    // plane.
                    let ahead = self.scene.continue_behind(ray, hit);
                    self.follow(ahead, share, path.any_side, path, pending);
                }
                Some(direction) => {
                    self.follow(point.leave(direction), share * clear(), true, path, pending);
                }
                None => mirror += point.transparency, // total reflection
            }
        }
        if mirror.max_element() > 0.0 {
            let direction = d - 2.0 * d.dot(normal) * normal;
            let share = path.share * mirror * clear();
            self.follow(point.leave(direction), share, true, path, pending);
        }
    }

    /// Appends a ray to trace, unless its share is negligible.
    fn follow(
        &self,
        ray: Ray,
        share: Vec3,
        any_side: bool,
        path: &Pending,
        pending: &mut Vec<Pending>,
    ) {
        if share.max_element() > self.options.least_share {
            pending.push(Pending {
                ray,
                lane: path.lane,
                share,
                depth: path.depth + 1,
                any_side,
            });
        }
    }
}

/// The ray from a point to a light; none if the light adds nothing to the point.
fn shadow_ray(point: &Point<'_>, incident: &IncidentLight) -> Option<Ray> {
    if incident.color == Vec3::ZERO || point.normal.dot(incident.toward) <= 0.0 {
        return None;
    }
    let mut ray = point.leave(incident.toward);
    ray.t_max = incident.distance * SHADOW_END;
    Some(ray)
}

/// Refracts a direction by Snell's law; returns `None` beyond the critical angle. `index` is the
/// refractive index of the inside relative to the outside.
fn refract(d: Vec3, normal: Vec3, index: f32, entering: bool) -> Option<Vec3> {
    if index == 1.0 {
        return Some(d);
    }
    let ratio = if entering { 1.0 / index } else { index };
    let cos = -d.dot(normal);
    let squared = 1.0 - ratio * ratio * (1.0 - cos * cos);
    (squared >= 0.0).then(|| ratio * d + (ratio * cos - squared.sqrt()) * normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_bends_toward_the_normal_in_glass() {
        let d = Vec3::new(0.5, 0.0, -(0.75f32.sqrt()));
        let inside = refract(d, Vec3::Z, 1.5, true).expect("glass takes all angles");
        assert!((inside.x - 0.5 / 1.5).abs() < 1e-6);
        let grazing = Vec3::new(0.9, 0.0, -(0.19f32.sqrt()));
        assert_eq!(refract(grazing, Vec3::Z, 1.5, false), None);
    }

    /// A light is near the middle of a triangle. By model `g` the middle is only as bright as the
    /// mean of the corners.
    #[test]
    fn model_g_interpolates_the_colors_of_a_triangles_corners() {
        let text = "#Inventor V2.1 ascii\n\
            Environment { attenuation 1 0 1 } PointLight { location .2 -.1 .5 color 1 .5 .2 }\n\
            Normal { vector 0 0 1 } NormalBinding { value OVERALL }\n\
            Coordinate3 { point [ -1 -1 0, 1 -1 0, 0 1 0 ] } FaceSet { numVertices 3 }";
        let document =
            ivcam_inventor::iv::Document::read_headerless("t.iv", text.as_bytes().to_vec());
        let options = crate::scene::CompileOptions::default();
        let document = document.unwrap();
        let snapshot = ivcam_inventor::snapshot::Snapshot::at(&document, 0.0);
        let scene = RenderScene::compile(&snapshot, &options).unwrap();
        let seen = |shading, x, y| {
            let shader = Shader::new(&scene, shading, ShadeOptions::default());
            let ray = Ray::new(Vec3::new(x, y, 1.0), Vec3::NEG_Z);
            shader.radiance(&ray, &mut Work::default())
        };
        let inside = |x: f32, y: f32| (0.9999 * x, 0.9999 * y - 1e-5);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, y)| inside(x, y));
        let sum: Vec3 = corners
            .map(|(x, y)| seen(Shading::Phong, x, y))
            .iter()
            .sum();
        let middle = seen(Shading::Gl, 0.0, -1.0 / 3.0);
        assert!((middle - sum / 3.0).abs().max_element() < 1e-4);
        assert!(seen(Shading::Phong, 0.0, -1.0 / 3.0).x > 2.0 * middle.x);
    }

    /// Model `g` needs triangles; all other models use quadrics.
    #[test]
    fn model_g_makes_triangles_of_round_shapes() {
        let text = b"#Inventor V2.1 ascii\nSphere { } Cone { } Cylinder { }".to_vec();
        let document = ivcam_inventor::iv::Document::read_headerless("r.iv", text).unwrap();
        for shading in Shading::ALL {
            let options = crate::scene::CompileOptions {
                needs: shading.needs(),
                ..Default::default()
            };
            let snapshot = ivcam_inventor::snapshot::Snapshot::at(&document, 0.0);
            let scene = RenderScene::compile(&snapshot, &options).unwrap();
            let (triangles, quadrics, _) = scene.primitives();
            assert_eq!(triangles > 0, shading == Shading::Gl);
            assert_eq!(quadrics == 0, shading == Shading::Gl);
        }
    }

    /// A scene with colors, a texture, highlights, reflection, fog, transparent and unlit shapes,
    /// and every kind of light.
    const SCENE: &str = "#Inventor V2.1 ascii\n\
        PointLight { location 2 3 4 color 1 .8 .6 } DirectionalLight { direction 1 -1 -2 }\n\
        SpotLight { location -3 2 5 direction 3 -2 -5 cutOffAngle .3 dropOffRate .2 }\n\
        Environment { ambientIntensity .3 attenuation .02 .1 1 }\n\
        Material { diffuseColor .2 .5 .9 } Cube { width 30 height 30 depth 1 }\n\
        Translation { translation 0 0 3 }\n\
        Material { diffuseColor .8 .3 .2 specularColor .6 .6 .5 shininess .4 ambientColor .2 .1 .1 }\n\
        Sphere { radius 1.2 } Translation { translation 2 0 0 }\n\
        Separator { Texture2 { image 2 2 3 0xff0000 0x00ff00 0x0000ff 0xffffff } Cube { } }\n\
        Translation { translation -4 0 0 }\n\
        Separator { Material { diffuseColor .1 .9 .1 transparency .5 specularColor 1 1 1 shininess 0 }\n\
        Cone { } }\n\
        Translation { translation 2 2 0 } Environment { fogType FOG fogVisibility 40 }\n\
        Separator { BaseColor { rgb .9 .9 0 } Cylinder { } }\n\
        Separator { Translation { translation 0 -4 0 } LightModel { model BASE_COLOR } Cube { } }\n\
        Translation { translation 2 -4 1 }\n\
        Material { specularColor .5 .5 .5\n\
        diffuseColor [ .9 .1 .1, .1 .9 .1, .1 .1 .9, .8 .8 .2 ] }\n\
        MaterialBinding { value PER_VERTEX } NormalBinding { value PER_VERTEX }\n\
        Normal { vector [ -1 -1 1, 1 -1 1, 1 1 1, -1 1 1 ] }\n\
        Coordinate3 { point [ -1 -1 0, 1 -1 0, 1 1 0, -1 1 0 ] } FaceSet { numVertices 4 }\n";

    /// A texture that replaces the diffuse color, and one that multiplies it.
    const TEXTURES: &str = "#VRML V2.0 utf8\n\
        DirectionalLight { direction .3 -.5 -1 }\n\
        Transform { translation 1 0 0 children Shape { geometry Box { }\n\
        appearance Appearance { material Material { diffuseColor .9 .2 .1 specularColor .3 .3 .3\n\
        emissiveColor .6 .6 .6 }\n\
        texture PixelTexture { image 2 2 3 0xff0000 0x00ff00 0x0000ff 0xffffff } } } }\n\
        Transform { translation -2 0 0 children Shape { geometry Sphere { }\n\
        appearance Appearance { material Material { diffuseColor .9 .2 .1 }\n\
        texture PixelTexture { image 2 2 1 0xff 0x40 0x80 0xc0 } } } }\n";

    #[test]
    fn packets_are_lit_like_single_rays() {
        use ivcam_inventor::iv::Document;
        use ivcam_inventor::snapshot::Snapshot;
        let read = |text: &str| Document::read_headerless("lit", text.as_bytes().to_vec()).unwrap();
        for document in [SCENE, TEXTURES].map(read) {
            for shading in Shading::ALL {
                let options = crate::scene::CompileOptions {
                    needs: shading.needs(),
                    ..Default::default()
                };
                let scene = RenderScene::compile(&Snapshot::at(&document, 0.0), &options).unwrap();
                compare_packets(&scene, shading);
            }
        }
    }

    fn compare_packets(scene: &RenderScene, shading: Shading) {
        use ivcam_base::math::lanes::{LANES, of_lane};
        let shader = Shader::new(scene, shading, ShadeOptions::default());
        let (mut work, mut alone) = (Work::default(), Work::default());
        let (mut farthest, mut brightest) = (0.0f32, 0.0f32);
        for row in 0..400u16 {
            let mut rays = RayPacket::default();
            for lane in 0..LANES as u16 {
                let place = |i: u16, of: u16| 2.0 * (f32::from(i) + 0.5) / f32::from(of) - 1.0;
                let aim = Vec3::new(
                    5.0 * place(20 * (row % 20) + lane % 8, 408),
                    5.0 * place(20 * (row / 20) + lane / 8, 404),
                    -9.0,
                );
                rays.set(usize::from(lane), &Ray::new(Vec3::new(0.1, 0.2, 12.0), aim));
            }
            let mut radiances = Vec3Lanes::default();
            let mut hits = PacketHits::default();
            shader.radiances(&rays, None, &mut hits, &mut radiances, &mut work);
            for lane in 0..LANES {
                let found = of_lane(&radiances, lane);
                let known = shader.radiance(&rays.ray(lane), &mut alone);
                let off = (found - known).abs().max_element();
                assert!(off < 2e-3, "{shading:?}, row {row}: {found} {known}");
                farthest += off;
                brightest = brightest.max(known.max_element());
            }
        }
        // The sum over 12,800 rays.
        assert!(farthest < 0.05, "{shading:?}: {farthest}");
        assert!(brightest > 0.5, "{shading:?}");
        let (found, known) = (work.counts, alone.counts);
        assert_eq!(found.scene, known.scene, "{shading:?}");
        assert!(found.shadow.abs_diff(known.shadow) < 20, "{shading:?}");
    }
}

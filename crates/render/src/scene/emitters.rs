//! The luminous shapes of a scene as lights: triangles and round surfaces with an emissive color,
//! and those that show their color unlit.
//!
//! They are the leaves of a tree, by which one is chosen, and a point on it evenly. Lines are no
//! leaves, nor are the shapes of prototypes if [`MOST_INSTANCED`] of them or more are luminous,
//! counted as often as they are drawn. Those light the scene only where a ray meets them by chance.

use std::collections::HashSet;

use glam::{DMat3, DVec3, Vec3};

use super::RenderScene;
use super::emitter_list::{Emitters, NO_LEAF};
use super::emitter_tree::{LampNode, LampRange, LampTree, TreeItem};
use super::lamp_faces::{LampFace, LampTriangle, MOST_FACES, NONE, even_weights, faces};
use super::lamp_lanes::{GROUP, LampLanes};
use super::lit_face::LitFace;
use super::looks::Surface;
use super::placed::Primitive;
use crate::bvh::Hit;
use crate::geometry::{Quadric, QuadricKind};

/// The largest number of luminous shapes of prototypes that are listed, each as often as it is
/// drawn.
const MOST_INSTANCED: usize = 1 << 16;

/// The largest emission that is used; what is brighter is shown as this.
pub(crate) const MAX_EMISSION: f32 = 1e9;

/// A point on a luminous primitive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EmitterPoint {
    pub(crate) position: Vec3,
    /// The hit of a ray that meets it, at a distance of 1.
    pub(crate) hit: Hit,
    /// The density of the point over the area.
    pub(crate) density: f32,
    leaf: u32,
}

/// Returns a color with NaN and negative values as 0, and none above [`MAX_EMISSION`].
pub(crate) fn sound_color(color: Vec3) -> Vec3 {
    color.map(|x| if x > 0.0 { x.min(MAX_EMISSION) } else { 0.0 })
}

impl Emitters {
    /// Finds the luminous primitives of a scene.
    pub(crate) fn of(scene: &RenderScene) -> Self {
        let brightness: Vec<f32> = scene.surfaces.iter().map(brightness_of).collect();
        if brightness.iter().all(|b| *b == 0.0) {
            return Self::default();
        }
        let mut list = Vec::new();
        let faces = scene.triangles.len() + scene.quadrics.len();
        for (number, owner) in scene.owners[..faces].iter().enumerate() {
            if brightness[*owner as usize] > 0.0 && !scene.is_in_prototype(*owner) {
                list.push((number as u32, 0));
            }
        }
        if let Some(instances) = &scene.instances {
            let is_luminous = |surface: u32| brightness[surface as usize] > 0.0;
            let shapes = instances.shapes_with(&is_luminous, MOST_INSTANCED);
            if shapes.len() < MOST_INSTANCED {
                for (surface, place) in shapes {
                    let numbers = scene.lists().numbers(&instances.shapes[surface as usize]);
                    list.extend(numbers.map(|number| (number, place)));
                }
            }
        }
        let faces = match list.len() > MOST_FACES {
            true => Vec::new(),
            false => scene.take_faces(&mut list),
        };
        let bright = |primitive: u32| brightness[scene.owner(primitive) as usize];
        let flat = (0..).zip(&faces).map(|(number, face)| {
            let item = scene.tree_item((face.halves[0], 0), bright(face.halves[0]));
            item.map(|item| face.item(number, &item))
        });
        let others = list
            .into_iter()
            .map(|place| scene.tree_item(place, bright(place.0)));
        let is_bright = |item: &TreeItem| item.power > 0.0 && item.power.is_finite();
        let items = flat.chain(others).flatten();
        Self::from_items(items.filter(is_bright).collect(), &faces)
    }

    /// Makes the leaves of items, whose flat shapes are in a list.
    fn from_items(mut items: Vec<TreeItem>, faces: &[LampFace]) -> Self {
        let tree = LampTree::build(&mut items);
        if !tree
            .root()
            .is_some_and(|all| tree.node(all).power.is_finite())
        {
            return Self::default();
        }
        let face = |item: &TreeItem| faces.get(item.face as usize).copied();
        let flat = |item: &TreeItem| face(item).map(|face| (face.normal, face.is_closed));
        let mut this = Self {
            list: items.iter().map(|item| item.primitive).collect(),
            lanes: LampLanes::of(&items, flat),
            faces: match faces.is_empty() {
                true => Vec::new(),
                false => items.iter().map(face).collect(),
            },
            tree,
            ..Self::default()
        };
        this.number_leaves();
        this
    }

    /// Notes the leaf of each primitive.
    fn number_leaves(&mut self) {
        let others = (0..).zip(&self.faces);
        let others = others.filter_map(|(leaf, face)| Some((leaf, face.as_ref()?.halves[1], 0)));
        let own = (0..).zip(&self.list);
        let own = own.map(|(leaf, &(primitive, place))| (leaf, primitive, place));
        for (leaf, primitive, place) in own.chain(others.filter(|other| other.1 != NONE)) {
            if place != 0 {
                self.placed_leaves.insert((primitive, place), leaf);
                continue;
            }
            let number = primitive as usize;
            if number >= self.leaves.len() {
                self.leaves.resize(number + 1, NO_LEAF);
            }
            self.leaves[number] = leaf;
        }
    }

    /// The flat shape of a leaf, if it is one.
    #[inline]
    fn face_of_leaf(&self, leaf: u32) -> Option<&LampFace> {
        self.faces.get(leaf as usize)?.as_ref()
    }

    /// The flat shape that a point is on, if it is one.
    #[inline]
    pub(crate) fn face(&self, point: &EmitterPoint) -> Option<&LampFace> {
        self.face_of_leaf(point.leaf)
    }

    /// Whether no luminous primitive is listed.
    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The number of leaves.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// The tree of the primitives.
    pub(crate) fn tree(&self) -> &LampTree {
        &self.tree
    }

    /// The leaf of the primitive that a ray has hit; `None` if it is in no list.
    #[inline]
    pub(crate) fn leaf(&self, hit: &Hit) -> Option<u32> {
        let leaf = match hit.place {
            0 => self.leaves.get(hit.primitive as usize),
            place => self.placed_leaves.get(&(hit.primitive, place)),
        };
        leaf.copied().filter(|leaf| *leaf != NO_LEAF)
    }

    /// Draws a point on a primitive, for light on a face, by two numbers from 0 to 1. The first
    /// chooses the primitive, and its rest serves for the place, so that samples that are spread
    /// evenly are spread over all primitives. Returns `None` if no primitive lights the face.
    pub(crate) fn sample(
        &self,
        scene: &RenderScene,
        face: &LitFace,
        (across, along): (f64, f32),
    ) -> Option<EmitterPoint> {
        let (leaf, probability, rest) = self.choose(self.tree.root()?, across, face)?;
        let mut point = self.point_on(scene, face.position, leaf, [rest, along])?;
        point.density *= probability;
        Some(point)
    }

    /// Chooses a leaf of a range for light on a face, by a number from 0 to 1. Returns it with its
    /// probability and a number from 0 to 1 that does not depend on the choice; `None` if no
    /// primitive lights the face.
    pub(crate) fn choose(
        &self,
        range: LampRange,
        across: f64,
        face: &LitFace,
    ) -> Option<(u32, f32, f32)> {
        let weight = |node: &LampNode| face.light_of(node);
        let (range, probability, rest) = self.tree.choose(range, GROUP as u32, across, weight)?;
        let (light, total) = self.lanes.light(range.leaves(), face);
        let mut rest = rest as f32 * total;
        let mut chosen = None;
        for (leaf, light) in range.leaves().zip(light).filter(|(_, light)| *light > 0.0) {
            chosen = Some((leaf, light, rest / light));
            if rest < light {
                break;
            }
            rest -= light;
        }
        // Rounding may leave a rest behind the last one.
        let (leaf, own, rest) = chosen?;
        let rest = rest.clamp(0.0, 1.0 - f32::EPSILON);
        Some((leaf, probability * (own / total), rest))
    }

    /// The probability with which [`Emitters::choose`] returns a leaf of a range.
    pub(crate) fn probability(&self, range: LampRange, leaf: u32, face: &LitFace) -> f32 {
        let weight = |node: &LampNode| face.light_of(node);
        let (range, probability) = self.tree.probability(range, GROUP as u32, leaf, weight);
        let (light, total) = self.lanes.light(range.leaves(), face);
        let own = light[(leaf - range.leaves().start) as usize];
        if own > 0.0 {
            probability * (own / total)
        } else {
            0.0
        }
    }

    /// Draws a point on the primitive of a leaf, for light toward a point `seen_from`, with the
    /// density over its area.
    pub(crate) fn point_on(
        &self,
        scene: &RenderScene,
        seen_from: Vec3,
        leaf: u32,
        u: [f32; 2],
    ) -> Option<EmitterPoint> {
        let (primitive, place) = self.list[leaf as usize];
        let mut hit = Hit::on(primitive, place, 1.0);
        if let Some(face) = self.face_of_leaf(leaf) {
            let (position, primitive, [u, v]) = face.point(u);
            (hit.primitive, hit.u, hit.v) = (primitive, u, v);
            return Some(EmitterPoint {
                position,
                hit,
                density: 1.0 / face.area,
                leaf,
            });
        }
        let position = match scene.primitive(&hit) {
            Primitive::Triangle([a, b, c]) => {
                [hit.u, hit.v] = even_weights(u);
                a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v
            }
            Primitive::Quadric(quadric) => {
                let mut at = quadric.point_at(u);
                if let (QuadricKind::Sphere { .. }, eye) =
                    (quadric.kind, object(&quadric, seen_from))
                    && faces_outside(&quadric, eye)
                    && at.dot(eye) < 0.0
                {
                    at = -at;
                }
                quadric.scene_from_object.transform_point3(at).as_vec3()
            }
            Primitive::Stroke(_) => return None,
        };
        let density = self.density_on(scene, seen_from, position, &hit);
        (density > 0.0).then_some(EmitterPoint {
            position,
            hit,
            density,
            leaf,
        })
    }

    /// The density over the area with which [`Emitters::sample`] draws a point on a primitive for
    /// light on a face; 0 if the primitive is in no list.
    pub(crate) fn density(
        &self,
        scene: &RenderScene,
        face: &LitFace,
        position: Vec3,
        hit: &Hit,
    ) -> f32 {
        let (Some(root), Some(leaf)) = (self.tree.root(), self.leaf(hit)) else {
            return 0.0;
        };
        let probability = self.probability(root, leaf, face);
        if !(probability > 0.0) {
            return 0.0;
        }
        probability * self.density_on(scene, face.position, position, hit)
    }

    /// The density over the area with which [`Emitters::point_on`] draws a point on its primitive.
    pub(crate) fn density_on(
        &self,
        scene: &RenderScene,
        seen_from: Vec3,
        position: Vec3,
        hit: &Hit,
    ) -> f32 {
        if let Some(face) = self.leaf(hit).and_then(|leaf| self.face_of_leaf(leaf)) {
            return 1.0 / face.area;
        }
        match scene.primitive(hit) {
            Primitive::Triangle([a, b, c]) => 1.0 / (0.5 * (b - a).cross(c - a).length()),
            Primitive::Stroke(_) => 0.0,
            Primitive::Quadric(quadric) => {
                let (at, normal) = quadric.project_to_surface(position.as_dvec3());
                let mut density = 1.0 / (quadric.area() * stretch(&quadric, normal));
                let eye = object(&quadric, seen_from);
                if faces_outside(&quadric, eye) {
                    // What is drawn on the other half is put on this one.
                    density *= if at.dot(eye) < 0.0 { 0.0 } else { 2.0 };
                }
                density as f32
            }
        }
    }
}

/// The brightness by which the primitives of a surface are chosen.
fn brightness_of(surface: &Surface) -> f32 {
    let color = match surface.base_color {
        true => {
            let sum: Vec3 = surface.diffuse.iter().copied().map(sound_color).sum();
            sum / surface.diffuse.len() as f32
        }
        false => sound_color(surface.emissive),
    };
    color.element_sum() / 3.0
}

/// The emissive color of a surface that shows it everywhere.
fn even_emission(surface: &Surface) -> Option<Vec3> {
    let is_even = !surface.base_color
        && surface.textures().next().is_none()
        && surface.is_opaque()
        && surface.clip.is_empty()
        && !surface.culls;
    is_even.then_some(surface.emissive)
}

fn object(quadric: &Quadric, point: Vec3) -> DVec3 {
    quadric.object_from_scene.transform_point3(point.as_dvec3())
}

/// Whether a point in object space is outside a sphere and not on it, so that it sees less than
/// half of it.
fn faces_outside(quadric: &Quadric, eye: DVec3) -> bool {
    let outside = |radius: f64| eye.length_squared() > 1.0002 * radius * radius;
    matches!(quadric.kind, QuadricKind::Sphere { radius } if outside(radius))
}

/// The area in the scene of a unit of area in object space, where the normal is `normal` there.
fn stretch(quadric: &Quadric, normal: DVec3) -> f64 {
    let matrix: DMat3 = quadric.scene_from_object.matrix3;
    let inverse = quadric.object_from_scene.matrix3;
    (inverse.transpose() * normal).length() * matrix.determinant().abs()
}

/// A mean of [`stretch`] over all normals, exact for a matrix that keeps angles.
fn mean_stretch(quadric: &Quadric) -> f64 {
    let volume = quadric.scene_from_object.matrix3.determinant().abs();
    let side = libm::cbrt(volume);
    side * side
}

impl RenderScene {
    /// The leaf for a primitive with a brightness; `None` for a stroke. The area of a stretched
    /// round surface is about right.
    fn tree_item(&self, (primitive, place): (u32, u64), bright: f32) -> Option<TreeItem> {
        let hit = Hit::on(primitive, place, 0.0);
        let ([low, high], area) = match self.primitive(&hit) {
            Primitive::Triangle([a, b, c]) => (
                [a.min(b).min(c), a.max(b).max(c)],
                0.5 * (b - a).cross(c - a).length(),
            ),
            Primitive::Quadric(quadric) => {
                let (low, high) = quadric.bounds();
                let area = (quadric.area() * mean_stretch(&quadric)) as f32;
                ([low, high].map(|corner| corner.as_vec3()), area)
            }
            Primitive::Stroke(_) => return None,
        };
        Some(TreeItem {
            primitive: (primitive, place),
            face: NONE,
            low,
            high,
            area,
            power: area * bright,
        })
    }

    /// Takes the triangles that are not of prototypes from a list of primitives and their places.
    /// Returns their faces.
    fn take_faces(&self, list: &mut Vec<(u32, u64)>) -> Vec<LampFace> {
        let is_flat = |&(primitive, place): &(u32, u64)| {
            place == 0 && (primitive as usize) < self.triangles.len()
        };
        let triangles: Vec<LampTriangle> = list
            .iter()
            .filter(|place| is_flat(place))
            .map(|&(primitive, _)| LampTriangle {
                primitive,
                surface: self.owner(primitive),
                corners: self.triangles[primitive as usize],
                even: even_emission(&self.surfaces[self.owner(primitive) as usize]),
            })
            .collect();
        list.retain(|place| !is_flat(place));
        faces(&triangles)
    }

    /// The luminous shapes as lights, which are found at the first call.
    pub(crate) fn emitters(&self) -> &Emitters {
        self.emitters.get_or_init(|| Emitters::of(self))
    }

    /// The radiance of an even sky that shows the level of the file's ambient light on open matte
    /// shapes: the sum of the materials' ambient terms over that of their diffuse colors. Each
    /// material counts once, however often it is drawn.
    pub(crate) fn ambient_radiance(&self) -> Vec3 {
        let (mut shown, mut full) = (DVec3::ZERO, DVec3::ZERO);
        let mut seen = HashSet::new();
        for surface in self.surfaces.iter().filter(|s| !s.base_color) {
            let diffuse = surface.diffuse_at(0).clamp(Vec3::ZERO, Vec3::ONE);
            let lights: Vec3 = self.lights_of(surface).map(|light| light.ambient).sum();
            let ambient = surface.ambient_at(diffuse) * (surface.environment.ambient + lights);
            let ambient = sound_color(ambient);
            if seen.insert([diffuse, ambient].map(|v| v.to_array().map(f32::to_bits))) {
                shown += ambient.as_dvec3();
                full += diffuse.as_dvec3();
            }
        }
        let ratio = |shown: f64, full: f64| if full > 0.0 { shown / full } else { 0.0 };
        let [r, g, b] = [0, 1, 2].map(|i| ratio(shown[i], full[i]) as f32);
        sound_color(Vec3::new(r, g, b))
    }

    /// The number of materials whose diffuse and specular colors exceed 1 in sum. Physical
    /// materials have none of these colors.
    pub fn excess_materials(&self) -> usize {
        let exceeds = |s: &&Surface| {
            let sum = |d: &Vec3| (d.clamp(Vec3::ZERO, Vec3::ONE) + s.specular).max_element() > 1.0;
            !s.base_color && s.physical.is_none() && s.diffuse.iter().any(sum)
        };
        self.surfaces.iter().filter(exceeds).count()
    }

    /// The number of materials whose emission is not a number, negative, or too bright.
    pub fn unsound_emitters(&self) -> usize {
        let unsound = |s: &&Surface| sound_color(s.emissive) != s.emissive;
        self.surfaces.iter().filter(unsound).count()
    }

    /// Whether any lit shape is meant as a lamp: its emission, times a factor, is at least half of
    /// white.
    pub fn has_lamps(&self, emission: f32) -> bool {
        let glows = |s: &Surface| emission * sound_color(s.emissive).max_element() >= 0.5;
        self.surfaces.iter().any(|s| !s.base_color && glows(s))
    }

    /// Whether any shape shines: by its emission times a factor, or because it is not lit.
    pub fn has_glow(&self, emission: f32) -> bool {
        let glows = |s: &Surface| (s.base_color || emission > 0.0) && brightness_of(s) > 0.0;
        self.surfaces.iter().any(glows)
    }

    /// Whether any shape is luminous as a light.
    pub fn has_emitters(&self) -> bool {
        !self.emitters().is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{CompileOptions, Instancing};
    use ivcam_inventor::iv::Document;
    use ivcam_inventor::snapshot::Snapshot;

    fn compile(text: &str, instancing: Instancing) -> RenderScene {
        let text = format!("#Inventor V2.1 ascii\n{text}");
        let document = Document::read_headerless("e.iv", text.into_bytes()).unwrap();
        let options = CompileOptions {
            instancing,
            ..CompileOptions::default()
        };
        RenderScene::compile(&Snapshot::at(&document, 0.0), &options).unwrap()
    }

    /// The mean of 1/density over points on all lights is their area (of the half that is seen).
    #[test]
    fn points_on_lights_have_the_density_of_the_area() {
        let pi = std::f64::consts::PI;
        let glow = "Material { emissiveColor 2 1 1 }";
        for (shape, area) in [
            ("Cube { width 3 }", 32.0),
            ("Sphere { radius 2 }", 8.0 * pi),
            ("Cylinder { height 3 }", 6.0 * pi + 2.0 * pi),
            ("Cone { }", pi + pi * 5f64.sqrt()),
            (
                "Separator { Cube { } } Material { emissiveColor 9 9 9 } Sphere { }",
                24.0 + 2.0 * pi,
            ),
        ] {
            for way in [Instancing::WhereItPays, Instancing::Everywhere] {
                let scene = compile(&format!("{glow} {shape}"), way);
                let emitters = scene.emitters();
                // It sees three sides of a box, and none of them at a grazing angle.
                let face = LitFace {
                    position: Vec3::new(40.0, 30.0, 100.0),
                    normal: Vec3::NEG_Z,
                    highlight: None,
                };
                let count = 40_000.0;
                let (mut sum, mut square) = (0.0f64, 0.0f64);
                for i in 0..40_000 {
                    // Roberts's sequence: the inner sides of a box are drawn seldom.
                    let [x, y] =
                        [0.754_877_666_2, 0.569_840_291].map(|step| (step * f64::from(i)).fract());
                    let point = emitters.sample(&scene, &face, (x, y as f32)).unwrap();
                    let inverse = 1.0 / f64::from(point.density);
                    (sum, square) = (sum + inverse, square + inverse * inverse);
                }
                let mean = sum / count;
                let sigma = ((square / count - mean * mean).max(0.0) / count).sqrt();
                assert!(
                    (mean - area).abs() < 4.0 * sigma + 1e-3 * area,
                    "{shape}: {mean} {area}"
                );
            }
        }
    }

    #[test]
    fn the_sky_shows_the_level_of_the_ambient_light() {
        let scene = compile(
            "Environment { ambientIntensity .5 } Cube { }",
            Instancing::WhereItPays,
        );
        let expected = 0.5 * 0.2 / 0.8;
        assert!((scene.ambient_radiance() - expected).abs().max_element() < 1e-6);
    }
}

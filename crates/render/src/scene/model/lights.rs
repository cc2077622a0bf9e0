//! The lights and cameras of a model.

use glam::{DQuat, DVec3, Vec3};
use ivcam_inventor::grammar::value::Value;
use ivcam_inventor::grammar::{Class, environment, vrml97_point_light};
use ivcam_inventor::iv::{NodeRef, display_of_linear};
use ivcam_inventor::pose::CameraPose;
use ivcam_inventor::traversal::state::{LightElement, LightKind, State};

use super::feature::Place;
use crate::scene::precision::are_in_reach;

/// The shape of a light. Angles are in radians from its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightShape {
    /// All rays are parallel.
    Directional,
    /// The light shines from a point in all directions.
    Point,
    /// The light shines from a point into a cone.
    Spot {
        /// The angle up to which the intensity is full.
        inner: f32,
        /// The angle at the cone's edge.
        outer: f32,
        /// The exponent of the cosine by which Inventor's spot falls off inside the cone, or `None`
        /// for VRML97's, which falls linearly from the inner to the outer angle, and for a linear
        /// light, which falls as glTF's.
        exponent: Option<f32>,
    },
}

/// A light that is on, in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneLight {
    /// The name after `DEF`, or the class.
    pub name: String,
    /// The light's node in the file.
    pub place: Place,
    /// The shape of the light.
    pub shape: LightShape,
    /// The color, which is multiplied by the intensity.
    pub color: Vec3,
    /// The intensity; 1 is full.
    pub intensity: f32,
    /// The position in meters.
    pub position: DVec3,
    /// The direction of the light or of its axis, of length 1.
    pub direction: DVec3,
    /// The quadratic, linear and constant coefficient of the attenuation 1 / (a₀d² + a₁d + a₂).
    pub attenuation: Vec3,
    /// The least value of that divisor: 1 for VRML97's lights.
    pub least_divisor: f32,
    /// Whether intensity and attenuation are of light, as glTF's, and not of a screen's levels.
    pub linear: bool,
    /// Whether the file states the attenuation.
    pub states_attenuation: bool,
    /// The distance in meters at which the light ends; infinite for Inventor's lights.
    pub radius: f32,
    /// Whether the file states the radius.
    pub states_radius: bool,
    /// The share of the color that a VRML97 light adds to the ambient light; 0 for Inventor's
    /// lights.
    pub ambient: f32,
}

/// A camera or viewpoint of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCamera {
    /// The name after `DEF`, the description of a viewpoint, or the class.
    pub name: String,
    /// The camera's node in the file.
    pub place: Place,
    /// Where it stands in world space, and how it projects.
    pub pose: CameraPose,
}

/// The place of a camera or of a light at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The position in meters.
    pub position: DVec3,
    /// The rotation from the camera's space to the world, or from −z to the light's direction.
    pub orientation: DQuat,
}

impl SceneLight {
    /// Converts a light of the traversal. Numbers that are not finite, and positions that are not
    /// in reach ([`are_in_reach`]), become the defaults of their fields.
    pub(super) fn new(
        light: &LightElement,
        node: NodeRef<'_>,
        state: &State<'_>,
        name: String,
        place: Place,
    ) -> Self {
        let environment = state.environment_node;
        let states_attenuation = match node.known_class().is_some_and(Class::is_vrml97) {
            true => node.states(vrml97_point_light::ATTENUATION),
            false => environment.is_some_and(|node| node.states(environment::ATTENUATION)),
        };
        let angle = |angle: f32| finite_or(angle, std::f32::consts::FRAC_PI_4);
        let shape = match light.kind {
            LightKind::Directional => LightShape::Directional,
            LightKind::Point => LightShape::Point,
            LightKind::Spot { drop_off, cut_off } => {
                let cut_off = angle(cut_off);
                let exponent = 128.0 * finite_or(drop_off, 0.0).clamp(0.0, 1.0);
                // A light that falls from full to none between two angles is half between them.
                LightShape::Spot {
                    inner: (2.0 * half_angle(exponent) - cut_off).clamp(0.0, cut_off.max(0.0)),
                    outer: cut_off,
                    exponent: Some(exponent),
                }
            }
            LightKind::Beam {
                beam_width,
                cut_off,
            }
            | LightKind::Cone {
                inner: beam_width,
                outer: cut_off,
            } => LightShape::Spot {
                inner: finite_or(beam_width, std::f32::consts::FRAC_PI_2).min(angle(cut_off)),
                outer: angle(cut_off),
                exponent: None,
            },
        };
        Self {
            name,
            place,
            shape,
            color: if light.color.is_finite() {
                light.color
            } else {
                Vec3::ONE
            },
            intensity: finite_or(light.intensity, 1.0),
            position: position_or_default(light.position, node, "location"),
            direction: light.direction,
            attenuation: if light.attenuation.is_finite() {
                light.attenuation
            } else {
                Vec3::Z
            },
            least_divisor: light.least_divisor,
            linear: light.linear,
            states_attenuation,
            radius: light.radius,
            states_radius: node.states(vrml97_point_light::RADIUS),
            ambient: finite_or(light.ambient, 0.0),
        }
    }
}

impl SceneLight {
    /// The level of white that the light gives a surface that faces it at a distance, in its cone.
    pub fn level_at(&self, distance: f64) -> f32 {
        let coding = |value: f32| match self.linear {
            true => display_of_linear(value),
            false => value,
        };
        if self.shape == LightShape::Directional {
            return coding(self.intensity);
        }
        let [quadratic, linear, constant] = self.attenuation.as_dvec3().to_array();
        let divisor = constant + distance * (linear + distance * quadratic);
        let divisor = divisor.max(f64::from(self.least_divisor));
        let divisor = if divisor > 0.0 { divisor } else { 1.0 };
        coding((f64::from(self.intensity) / divisor) as f32)
    }

    /// The light for a format whose lights are levels of a screen: a level falls by the distance
    /// nearly as its light by the square. It is right at a distance, such as that of the scene's
    /// center, and full at a tenth of it or where it is white.
    pub fn on_screen(&self, distance: f64) -> Self {
        let level = self.level_at(distance);
        let (nearer, attenuation) = match self.shape {
            _ if !self.linear => return self.clone(),
            LightShape::Directional => (1.0, Vec3::Z),
            _ => {
                let nearer = (1.0 / level.max(f32::MIN_POSITIVE)).clamp(1.0, 10.0);
                (nearer, Vec3::new(0.0, nearer / distance as f32, 0.0))
            }
        };
        Self {
            intensity: level * nearer,
            attenuation,
            least_divisor: 1.0,
            linear: false,
            ..self.clone()
        }
    }

    /// The rotation that turns −z to the light's direction.
    pub fn rotation(&self) -> DQuat {
        DQuat::from_rotation_arc(DVec3::NEG_Z, self.direction)
    }
}

impl SceneCamera {
    /// Makes the camera of a node. A position that is not in reach ([`are_in_reach`]) becomes the
    /// default of its field, and an orientation that is not finite becomes no rotation.
    pub(super) fn new(node: NodeRef<'_>, mut pose: CameraPose, name: String, place: Place) -> Self {
        pose.position = position_or_default(pose.position, node, "position");
        if !pose.orientation.is_finite() {
            pose.orientation = DQuat::IDENTITY;
        }
        Self { name, place, pose }
    }
}

fn finite_or(value: f32, default: f32) -> f32 {
    if value.is_finite() { value } else { default }
}

/// Returns a position if it is in reach ([`are_in_reach`]), or else the default of the node's
/// field.
fn position_or_default(position: DVec3, node: NodeRef<'_>, field: &str) -> DVec3 {
    if are_in_reach(&position.to_array()) {
        return position;
    }
    let declared = node.known_class().and_then(|class| class.field(field));
    match declared.map(|(_, field)| Value::default_of(field)) {
        Some(Value::Vec3(default)) => default.as_dvec3(),
        _ => DVec3::ZERO,
    }
}

/// The angle at which the cosine to the power of an exponent is ½, or a right angle if it is
/// beyond.
fn half_angle(exponent: f32) -> f32 {
    if exponent <= 0.0 {
        return std::f32::consts::FRAC_PI_2;
    }
    libm::acosf(libm::powf(0.5, 1.0 / exponent))
}

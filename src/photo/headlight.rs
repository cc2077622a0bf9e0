//! The light on the camera: whether it is on, and which setting decided that.

use glam::Vec3;
use ivcam_inventor::pose::CameraPose;
use ivcam_render::scene::Light;

/// The plan's setting of the headlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Headlight {
    /// The environment file decides. Without one the scene's `NavigationInfo` decides, and without
    /// either the headlight is on in a VRML97 scene, and in any other if it has no light. This is
    /// the default of [`Era::Modern`](super::Era::Modern).
    Automatic,
    /// The environment file decides. Without one the headlight is off. This is the default of
    /// [`Era::Vintage`](super::Era::Vintage).
    Environment,
    /// As a viewer has it: the environment file decides, without one the scene's `NavigationInfo`,
    /// and without either the headlight is on.
    Viewer,
    /// The headlight is the opposite of the result of [`Headlight::Environment`].
    Flipped,
    /// The headlight is on or off.
    Set(bool),
}

/// The facts that decide about the headlight if the plan does not set it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct HeadlightSources {
    /// Whether the environment file has its headlight on, if there is such a file.
    pub environment: Option<bool>,
    /// The field `headlight` of the scene's first `NavigationInfo`, if it has one.
    pub navigation_info: Option<bool>,
    /// Whether the scene is a VRML97 file, whose headlight is on by default.
    pub is_vrml97: bool,
    /// Whether a light that is on lights a shape of the scene.
    pub scene_has_light: bool,
}

/// The setting or fact that decided about the headlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum HeadlightCause {
    /// An option of the plan.
    Option,
    /// The environment file.
    Environment,
    /// The scene's `NavigationInfo`.
    NavigationInfo,
    /// The default of VRML97, in a scene without `NavigationInfo`.
    Vrml97,
    /// Whether the scene has a light.
    Scene,
    /// The default of the era, independent of the scene.
    Era,
}

/// Whether the headlight is on, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeadlightState {
    /// Whether the headlight is on.
    pub on: bool,
    /// The setting or fact that decided.
    pub cause: HeadlightCause,
}

impl HeadlightSources {
    /// Decides whether the headlight is on.
    pub(crate) fn resolve(self, asked: Headlight) -> HeadlightState {
        let (on, cause) = match (asked, self.environment, self.navigation_info) {
            (Headlight::Set(on), ..) => (on, HeadlightCause::Option),
            (Headlight::Flipped, environment, _) => {
                (environment != Some(true), HeadlightCause::Option)
            }
            (_, Some(on), _) => (on, HeadlightCause::Environment),
            (Headlight::Environment, ..) => (false, HeadlightCause::Era),
            (_, None, Some(on)) => (on, HeadlightCause::NavigationInfo),
            (Headlight::Viewer, None, None) => (true, HeadlightCause::Option),
            // A scene without a `NavigationInfo` has the default of its fields (VRML97, 6.29).
            (Headlight::Automatic, None, None) if self.is_vrml97 => (true, HeadlightCause::Vrml97),
            (Headlight::Automatic, None, None) => (!self.scene_has_light, HeadlightCause::Scene),
        };
        HeadlightState { on, cause }
    }
}

impl HeadlightState {
    /// Returns the state as text for the metadata and the report.
    pub fn describe(self) -> &'static str {
        match (self.on, self.cause) {
            (true, HeadlightCause::Option) => "on, by option",
            (false, HeadlightCause::Option) => "off, by option",
            (true, HeadlightCause::Environment) => "on, by the environment file",
            (false, HeadlightCause::Environment) => "off, by the environment file",
            (true, HeadlightCause::NavigationInfo) => "on, by NavigationInfo",
            (false, HeadlightCause::NavigationInfo) => "off, by NavigationInfo",
            (true, HeadlightCause::Vrml97) => "on, by VRML97's default",
            (true, _) => "on, because the scene has no light",
            (false, _) => "off",
        }
    }
}

/// Returns the headlight in world space. It is attached to the camera: `own`, the headlight of the
/// environment file, is in camera space.
pub(super) fn headlight_in_world(on: bool, own: Option<Light>, pose: &CameraPose) -> Option<Light> {
    on.then(|| {
        let mut light = own.unwrap_or(Light::headlight(Vec3::NEG_Z));
        // The cosine of a thousandth of a radian: shadows of such a light are hidden.
        light.at_eye = light.direction.dot(Vec3::NEG_Z) > 1.0 - 5e-7;
        light.direction = (pose.orientation * light.direction.as_dvec3()).as_vec3();
        light
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_go_before_environment_and_that_before_the_scene() {
        let dark = HeadlightSources::default();
        let lit = HeadlightSources {
            scene_has_light: true,
            ..dark
        };
        let walking = |on| HeadlightSources {
            navigation_info: Some(on),
            ..lit
        };
        let around = |on, sources| HeadlightSources {
            environment: Some(on),
            ..sources
        };
        let on = |sources: HeadlightSources, asked| sources.resolve(asked).on;
        assert!(on(dark, Headlight::Automatic) && !on(lit, Headlight::Automatic));
        assert!(!on(dark, Headlight::Environment) && !on(walking(true), Headlight::Environment));
        assert!(on(walking(true), Headlight::Automatic));
        let vrml97 = |sources| HeadlightSources {
            is_vrml97: true,
            ..sources
        };
        assert!(on(vrml97(lit), Headlight::Automatic) && on(vrml97(dark), Headlight::Automatic));
        assert!(!on(vrml97(walking(false)), Headlight::Automatic));
        assert!(!on(vrml97(lit), Headlight::Environment));
        assert!(on(lit, Headlight::Viewer) && on(dark, Headlight::Viewer));
        assert!(!on(walking(false), Headlight::Viewer));
        assert!(!on(walking(false), Headlight::Automatic));
        assert!(!on(around(false, walking(true)), Headlight::Automatic));
        assert!(on(around(true, walking(false)), Headlight::Automatic));
        for asked in [Headlight::Automatic, Headlight::Environment] {
            assert!(on(around(true, lit), asked) && !on(around(false, dark), asked));
        }
        assert!(on(dark, Headlight::Flipped) && on(lit, Headlight::Flipped));
        assert!(!on(around(true, dark), Headlight::Flipped));
        for sources in [dark, lit, walking(true), around(true, lit)] {
            assert!(on(sources, Headlight::Set(true)) && !on(sources, Headlight::Set(false)));
        }
    }
}

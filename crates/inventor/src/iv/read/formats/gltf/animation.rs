//! Animations of glTF as clocks, interpolators and routes of X3D.
//!
//! All animations of a file play together, from when the scene is opened, and repeat.

use std::collections::HashSet;

use glam::{Quat, Vec3, Vec4};
use ivcam_base::diag::{Result, Span, excerpt};

use super::reader::{GltfReader, rotation_of};
use super::schema::{Animation, AnimationSampler, Channel};
use crate::grammar::value::{NodeId, Value};
use crate::grammar::{
    class, orientation_interpolator, position_interpolator, time_sensor, vrml_interpolator,
};
use crate::iv::declarations::Route;

/// The intervals into which a part of a cubic spline is cut.
const SPLINE_STEPS: usize = 8;

/// The times and values of a channel, with as many numbers for each value.
struct Keys {
    times: Vec<f32>,
    values: Vec<Vec4>,
}

impl GltfReader<'_, '_, '_> {
    /// Adds the nodes and routes of all animations, and returns the nodes.
    ///
    /// # Errors
    /// Returns an error if a limit is exceeded.
    pub(super) fn animations(&mut self) -> Result<Vec<NodeId>> {
        let root = self.root;
        let mut nodes = Vec::new();
        let mut moved: HashSet<(usize, &str)> = HashSet::new();
        for animation in &root.animations {
            let mut channels: Vec<(&Channel, NodeId, Keys)> = Vec::new();
            for channel in &animation.channels {
                let Some((transform, node)) = self.target(channel) else {
                    continue;
                };
                if !moved.insert((node, &channel.target.path)) {
                    let message = "several animations move the same node";
                    let help = "the first of them plays";
                    self.builder.warn(Span::at(0), message).help(help);
                    continue;
                }
                match self.keys(animation, channel) {
                    Ok(keys) if keys.times.is_empty() => {}
                    Ok(keys) => channels.push((channel, transform, keys)),
                    Err(message) => {
                        let message = format!("an animation: {message}");
                        self.builder.damage(Span::at(0), message);
                    }
                }
            }
            let ends = channels
                .iter()
                .filter_map(|(_, _, keys)| keys.times.last().copied());
            let duration = ends.fold(0.0f32, f32::max);
            if channels.is_empty() || !(duration > 0.0) {
                continue;
            }
            let clock = self.clock(animation, duration)?;
            nodes.push(clock);
            for (channel, transform, keys) in channels {
                nodes.push(self.channel(&channel.target.path, clock, transform, keys, duration)?);
            }
        }
        Ok(nodes)
    }

    /// Returns the `Transform` that a channel moves, with the number of its node.
    fn target(&mut self, channel: &Channel) -> Option<(NodeId, usize)> {
        let path = &*channel.target.path;
        if !matches!(path, "translation" | "rotation" | "scale") {
            let message = match path {
                "weights" => "animations of the weights of a mesh are not played".to_owned(),
                path => format!("animations of `{}` are not played", excerpt(path)),
            };
            self.builder.warn(Span::at(0), message);
            return None;
        }
        let node = channel.target.node?;
        Some((self.transforms.get(node).copied().flatten()?, node))
    }

    fn clock(&mut self, animation: &Animation, duration: f32) -> Result<NodeId> {
        let clock = self.builder.node(class::TIME_SENSOR, Span::default())?;
        self.builder.name(clock, &animation.name);
        let interval = Value::Double(f64::from(duration));
        self.builder
            .set(clock, time_sensor::CYCLE_INTERVAL, interval);
        self.builder
            .set(clock, time_sensor::LOOP, Value::Bool(true));
        Ok(clock)
    }

    /// Adds the interpolator of a channel and its routes.
    fn channel(
        &mut self,
        path: &str,
        clock: NodeId,
        transform: NodeId,
        keys: Keys,
        duration: f32,
    ) -> Result<NodeId> {
        let is_rotation = path == "rotation";
        let class = match is_rotation {
            true => class::ORIENTATION_INTERPOLATOR,
            false => class::POSITION_INTERPOLATOR,
        };
        let node = self.builder.node(class, Span::default())?;
        let fractions = keys.times.iter().map(|time| time / duration).collect();
        self.builder
            .set(node, vrml_interpolator::KEY, Value::Floats(fractions));
        if is_rotation {
            let values = keys.values.iter().map(|v| rotation_of(Quat::from_vec4(*v)));
            let values = Value::Rotations(values.collect());
            self.builder
                .set(node, orientation_interpolator::KEY_VALUE, values);
        } else {
            let values = Value::Vec3s(keys.values.iter().map(|v| v.truncate()).collect());
            self.builder
                .set(node, position_interpolator::KEY_VALUE, values);
        }
        for (from, output, to, input) in [
            (clock, "fraction_changed", node, "set_fraction"),
            (node, "value_changed", transform, path),
        ] {
            self.builder.asm.document.routes.push(Route {
                from,
                output: output.into(),
                to,
                input: match input {
                    "set_fraction" => input.into(),
                    field => format!("set_{field}").into(),
                },
                stated: true,
            });
        }
        Ok(node)
    }

    /// Reads the keys of a channel.
    fn keys(
        &mut self,
        animation: &Animation,
        channel: &Channel,
    ) -> std::result::Result<Keys, String> {
        let sampler = animation.samplers.get(channel.sampler);
        let sampler = sampler.ok_or("a sampler does not exist")?;
        let width = if channel.target.path == "rotation" {
            4
        } else {
            3
        };
        let (times, _) = self.buffers.floats(self.root, sampler.input, &[1])?;
        let (numbers, _) = self.buffers.floats(self.root, sampler.output, &[width])?;
        let value = |numbers: &[f32]| {
            let fourth = numbers.get(3).copied().unwrap_or(0.0);
            Vec3::from_slice(&numbers[..3]).extend(fourth)
        };
        let values: Vec<Vec4> = numbers.chunks_exact(width).map(value).collect();
        if times.windows(2).any(|pair| !(pair[0] <= pair[1])) {
            return Err("its times do not increase".into());
        }
        if sampler.interpolation == "CUBICSPLINE" {
            let message = format!("cubic splines are drawn as {SPLINE_STEPS} lines each");
            self.builder.asm.document.sink.note(Span::at(0), message);
        }
        keys(sampler, times, values, width == 4)
    }
}

/// Returns keys between which values are interpolated linearly.
fn keys(
    sampler: &AnimationSampler,
    times: Vec<f32>,
    values: Vec<Vec4>,
    is_rotation: bool,
) -> std::result::Result<Keys, String> {
    let parts = if sampler.interpolation == "CUBICSPLINE" {
        3
    } else {
        1
    };
    if values.len() < parts * times.len() {
        return Err("it has fewer values than times".into());
    }
    let mut keys = Keys {
        times: Vec::new(),
        values: Vec::new(),
    };
    let mut push = |time: f32, value: Vec4| {
        keys.times.push(time);
        keys.values.push(if is_rotation {
            value.normalize_or(Vec4::W)
        } else {
            value
        });
    };
    match &*sampler.interpolation {
        "STEP" => {
            for (place, &time) in times.iter().enumerate() {
                if let Some(before) = place.checked_sub(1) {
                    push(time, values[before]);
                }
                push(time, values[place]);
            }
        }
        "CUBICSPLINE" => {
            for (place, &time) in times.iter().enumerate() {
                let (value, leaving) = (values[3 * place + 1], values[3 * place + 2]);
                push(time, value);
                let Some(&next) = times.get(place + 1) else {
                    break;
                };
                let (arriving, to) = (values[3 * place + 3], values[3 * place + 4]);
                for step in 1..SPLINE_STEPS {
                    let share = step as f32 / SPLINE_STEPS as f32;
                    let length = next - time;
                    push(
                        time + share * length,
                        hermite([value, leaving * length, arriving * length, to], share),
                    );
                }
            }
        }
        _ => times
            .iter()
            .zip(&values)
            .for_each(|(&time, &value)| push(time, value)),
    }
    Ok(keys)
}

/// Returns a value of a cubic spline between two values, whose tangents are those of the interval.
fn hermite([from, leaving, arriving, to]: [Vec4; 4], t: f32) -> Vec4 {
    let (t2, t3) = (t * t, t * t * t);
    from * (2.0 * t3 - 3.0 * t2 + 1.0)
        + leaving * (t3 - 2.0 * t2 + t)
        + to * (3.0 * t2 - 2.0 * t3)
        + arriving * (t3 - t2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampler(interpolation: &str) -> AnimationSampler {
        AnimationSampler {
            input: 0,
            output: 0,
            interpolation: interpolation.into(),
        }
    }

    #[test]
    fn a_step_keeps_its_value_up_to_the_next_key() {
        let values = vec![Vec4::X, Vec4::Y];
        let keys = keys(&sampler("STEP"), vec![0.0, 2.0], values, false).expect("keys");
        assert_eq!(keys.times, [0.0, 2.0, 2.0]);
        assert_eq!(keys.values, [Vec4::X, Vec4::X, Vec4::Y]);
    }

    /// A cubic polynomial is its own spline.
    #[test]
    fn a_spline_has_the_values_of_its_cubic_polynomial() {
        let (p, slope) = (|t: f32| t * t * t - t, |t: f32| 3.0 * t * t - 1.0);
        let at = |t| Vec4::splat(p(t));
        let tangent = |t| Vec4::splat(slope(t));
        let times = vec![0.0, 2.0];
        let list = times
            .iter()
            .flat_map(|&t| [tangent(t), at(t), tangent(t)])
            .collect();
        let keys = keys(&sampler("CUBICSPLINE"), times, list, false).expect("keys");
        assert_eq!(keys.times.len(), SPLINE_STEPS + 1);
        for (time, value) in keys.times.iter().zip(&keys.values) {
            assert!((value.x - p(*time)).abs() < 1e-5, "{time}: {value}");
        }
    }
}

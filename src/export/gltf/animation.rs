//! Writes sampled motion as an animation, with the samples that a line between others predicts left
//! out.

use glam::{DAffine3, DQuat, DVec3};
use ivcam_render::scene::model::{Feature, Model, Motion, Pose};

use super::buffer::BinaryBuffer;
use super::nodes::NodeList;
use super::schema::{Animation, AnimationSampler, Channel, ChannelTarget, Index};
use crate::export::losses::Losses;
use crate::export::trs::Trs;

/// The largest error of a value that is left out, as a fraction of the scene's size, of a unit
/// quaternion, and of a scale.
const ERROR: f64 = 1e-5;

/// Writes a motion. Nodes that shear while they move stand still, which `losses` receives.
pub(super) fn animate(
    model: &Model,
    motion: &Motion,
    nodes: &mut NodeList,
    buffer: &mut BinaryBuffer,
    losses: &mut Losses,
) -> Option<Animation> {
    if motion.is_empty() {
        return None;
    }
    let size = model.bounds().map_or(1.0, |(a, b)| (b - a).length());
    let mut writer = AnimationWriter {
        times: &motion.times,
        size,
        buffer,
        animation: Animation::default(),
    };
    for (number, matrices) in &motion.nodes {
        match tracks(matrices) {
            Some(tracks) => writer.node(nodes.of_model[*number], &tracks),
            None => losses.feature(Feature::Motion, &model.nodes[*number].place, 1),
        }
    }
    for (number, poses) in &motion.cameras {
        writer.poses(nodes.of_cameras[*number], poses);
    }
    for (number, poses) in &motion.lights {
        writer.poses(nodes.of_lights[*number], poses);
    }
    Some(writer.animation).filter(|animation| !animation.channels.is_empty())
}

/// The values of a node at all times.
struct Tracks {
    translations: Vec<DVec3>,
    rotations: Vec<DQuat>,
    scales: Vec<DVec3>,
    /// Whether the node is hidden at some time, which a scale of 0 expresses.
    blinks: bool,
}

/// Returns the values of a node, or `None` if its matrix shears at some time.
fn tracks(matrices: &[Option<DAffine3>]) -> Option<Tracks> {
    let mut tracks = Tracks {
        translations: Vec::new(),
        rotations: Vec::new(),
        scales: Vec::new(),
        blinks: matrices.iter().any(Option::is_none),
    };
    let first = matrices.iter().flatten().next()?;
    let mut last = Trs::of(first)?;
    for matrix in matrices {
        if let Some(matrix) = matrix {
            last = Trs::of(matrix)?;
        }
        tracks.translations.push(last.translation);
        tracks.rotations.push(last.rotation);
        tracks.scales.push(match matrix {
            Some(_) => last.scale,
            None => DVec3::ZERO,
        });
    }
    Some(tracks)
}

/// Writes channels.
struct AnimationWriter<'a> {
    times: &'a [f64],
    size: f64,
    buffer: &'a mut BinaryBuffer,
    animation: Animation,
}

impl AnimationWriter<'_> {
    /// Writes the motion of a node.
    fn node(&mut self, node: Index, tracks: &Tracks) {
        let translations: Vec<[f64; 3]> =
            tracks.translations.iter().map(|v| v.to_array()).collect();
        self.vectors(node, "translation", &translations, ERROR * self.size, false);
        self.rotations(node, &tracks.rotations);
        let scales: Vec<[f64; 3]> = tracks.scales.iter().map(|v| v.to_array()).collect();
        let largest = scales
            .as_flattened()
            .iter()
            .fold(0.0f64, |a, b| a.max(b.abs()));
        self.vectors(node, "scale", &scales, ERROR * largest, tracks.blinks);
    }

    /// Writes the motion of a camera or a light.
    fn poses(&mut self, node: Index, poses: &[Pose]) {
        let positions: Vec<[f64; 3]> = poses.iter().map(|p| p.position.to_array()).collect();
        self.vectors(node, "translation", &positions, ERROR * self.size, false);
        let turns: Vec<DQuat> = poses.iter().map(|p| p.orientation).collect();
        self.rotations(node, &turns);
    }

    /// Writes a channel of rotations.
    fn rotations(&mut self, node: Index, list: &[DQuat]) {
        let mut last = DQuat::IDENTITY;
        let values: Vec<[f64; 4]> = list
            .iter()
            .map(|turn| {
                // Both q and −q describe a rotation; the one nearer to the previous key is used.
                last = if turn.dot(last) < 0.0 { -*turn } else { *turn };
                last.to_array()
            })
            .collect();
        self.vectors(node, "rotation", &values, ERROR, false);
    }

    /// Writes a channel, unless its values are all the same.
    fn vectors<const N: usize>(
        &mut self,
        node: Index,
        path: &'static str,
        values: &[[f64; N]],
        error: f64,
        steps: bool,
    ) {
        if values.iter().all(|v| distance(v, &values[0]) <= error) {
            return;
        }
        let kept = if steps {
            changes(values)
        } else {
            needed(self.times, values, error)
        };
        let times: Vec<[f32; 1]> = kept.iter().map(|&i| [self.times[i] as f32]).collect();
        let values: Vec<[f32; N]> = kept.iter().map(|&i| values[i].map(|v| v as f32)).collect();
        let input = self.buffer.floats(&times, None, true);
        let output = self.buffer.floats(&values, None, false);
        self.animation.samplers.push(AnimationSampler {
            input,
            output,
            interpolation: steps.then_some("STEP"),
        });
        self.animation.channels.push(Channel {
            sampler: self.animation.samplers.len() - 1,
            target: ChannelTarget { node, path },
        });
    }
}

/// The largest difference of two values.
fn distance<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.fold(0.0, |most, (x, y)| most.max((x - y).abs()))
}

/// Returns the samples at which a value changes, with the first and the last one.
fn changes<const N: usize>(values: &[[f64; N]]) -> Vec<usize> {
    let last = values.len() - 1;
    let changed = |&i: &usize| i == 0 || i == last || values[i] != values[i - 1];
    (0..values.len()).filter(changed).collect()
}

/// Returns the samples that are needed, so that lines between them are within an error of all
/// others (Douglas and Peucker 1973).
fn needed<const N: usize>(times: &[f64], values: &[[f64; N]], error: f64) -> Vec<usize> {
    let mut kept = vec![false; values.len()];
    let last = values.len() - 1;
    (kept[0], kept[last]) = (true, true);
    let mut spans = vec![(0, last)];
    while let Some((from, to)) = spans.pop() {
        let off = |i: usize| {
            let share = (times[i] - times[from]) / (times[to] - times[from]);
            let line = std::array::from_fn(|k| {
                values[from][k] + share * (values[to][k] - values[from][k])
            });
            distance(&values[i], &line)
        };
        let farthest = (from + 1..to).map(|i| (off(i), i));
        if let Some((most, i)) = farthest.max_by(|a, b| a.0.total_cmp(&b.0))
            && most > error
        {
            kept[i] = true;
            spans.extend([(from, i), (i, to)]);
        }
    }
    (0..values.len()).filter(|&i| kept[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_on_a_line_are_left_out() {
        let times: Vec<f64> = (0..11).map(f64::from).collect();
        let values: Vec<[f64; 1]> = times.iter().map(|t| [(t - 4.0).abs()]).collect();
        assert_eq!(needed(&times, &values, 1e-9), [0, 4, 10]);
        let steps: Vec<[f64; 1]> = times.iter().map(|t| [f64::from(*t > 6.5)]).collect();
        assert_eq!(changes(&steps), [0, 7, 10]);
    }
}

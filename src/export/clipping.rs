//! The near and far planes of written cameras, which enclose the scene at all times of its motion.
//! Inventor's viewers choose them so, whatever the file says.

use glam::{DAffine3, DVec3};
use ivcam_render::scene::model::{Model, Motion, Pose, SceneCamera, SceneNode};

/// A sphere around a scene, in meters.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneSphere {
    /// The center.
    pub center: DVec3,
    /// The radius, at least 1e-6.
    pub radius: f64,
}

impl SceneSphere {
    /// The sphere around a box; around nothing it is the unit sphere.
    pub(super) fn of(bounds: Option<(DVec3, DVec3)>) -> Self {
        bounds.map_or(
            Self {
                center: DVec3::ZERO,
                radius: 1.0,
            },
            |(min, max)| Self {
                center: 0.5 * (min + max),
                radius: (0.5 * (max - min).length()).max(1e-6),
            },
        )
    }

    /// The sphere around a model at all times of its motion.
    pub(super) fn in_motion(model: &Model, motion: &Motion) -> Self {
        Self::of(bounds_in_motion(model, motion))
    }

    /// The distances of the near and the far plane from a camera by its number, in all its poses.
    /// The first is negative if the camera comes into the sphere.
    pub(super) fn depths(&self, number: usize, camera: &SceneCamera, motion: &Motion) -> [f64; 2] {
        let still = Pose {
            position: camera.pose.position,
            orientation: camera.pose.orientation,
        };
        let moving = motion.cameras.iter().find(|(n, _)| *n == number);
        let poses = moving.into_iter().flat_map(|(_, poses)| poses);
        let depth = |pose: &Pose| {
            let direction = pose.orientation * DVec3::NEG_Z;
            (self.center - pose.position).dot(direction)
        };
        let depths = poses.chain([&still]).map(depth);
        let (least, most) = depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), depth| {
            (a.min(depth), b.max(depth))
        });
        let far = (most + 1.01 * self.radius).max(2.0 * self.radius);
        [least - 1.01 * self.radius, far]
    }
}

/// Returns a box around a model at all times of its motion. Around meshes that move it may be
/// larger than the smallest one.
fn bounds_in_motion(model: &Model, motion: &Motion) -> Option<(DVec3, DVec3)> {
    let joined = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
    let mut samples: Vec<Option<&[Option<DAffine3>]>> = vec![None; model.nodes.len()];
    for (node, matrices) in &motion.nodes {
        samples[*node] = Some(matrices);
    }
    let mut moves = vec![false; model.nodes.len()];
    for (i, node) in model.nodes.iter().enumerate() {
        moves[i] = samples[i].is_some() || node.parent.is_some_and(|parent| moves[parent]);
    }
    let own_box = |node: &SceneNode| {
        let parts = node.parts.iter();
        let boxes = parts.filter_map(|p| model.meshes[p.mesh].bounds(&DAffine3::IDENTITY));
        boxes.reduce(joined)
    };
    let moving = model.nodes.iter().enumerate().filter(|(i, _)| moves[*i]);
    let moving: Vec<_> = moving.map(|(i, node)| (i, node, own_box(node))).collect();
    let mut worlds: Vec<Option<DAffine3>> = model.nodes.iter().map(|n| Some(n.world)).collect();
    let mut bounds = model.bounds();
    for time in 0..motion.times.len() {
        for (i, node, own) in &moving {
            let local = samples[*i].map_or(Some(node.local), |list| list[time]);
            let above = node
                .parent
                .map_or(Some(DAffine3::IDENTITY), |parent| worlds[parent]);
            worlds[*i] = above.zip(local).map(|(above, local)| above * local);
            let placed = worlds[*i].zip(*own).map(|(world, own)| placed(&world, own));
            bounds = bounds.into_iter().chain(placed).reduce(joined);
        }
    }
    bounds
}

/// Returns the box around a box after a matrix.
fn placed(matrix: &DAffine3, (min, max): (DVec3, DVec3)) -> (DVec3, DVec3) {
    let (center, half) = (0.5 * (min + max), 0.5 * (max - min));
    let m = matrix.matrix3;
    let half = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
    let center = matrix.transform_point3(center);
    (center - half, center + half)
}

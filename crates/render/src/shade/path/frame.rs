//! Coordinates whose z axis is a surface's normal.

use glam::Vec3;

/// Three axes at right angles.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadingFrame {
    x: Vec3,
    y: Vec3,
    z: Vec3,
}

impl ShadingFrame {
    /// The axes around a normal of length 1 (Duff and others, "Building an orthonormal basis,
    /// revisited", 2017).
    pub(super) fn around(z: Vec3) -> Self {
        let sign = 1.0f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// A direction of the scene in these axes.
    pub(super) fn local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// A direction in these axes in the scene.
    pub(super) fn world(&self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

/// A direction above the plane z = 0 whose density is its cosine over π.
pub(super) fn cosine_direction(u: [f32; 2]) -> Vec3 {
    let (r, turn) = (u[0].sqrt(), std::f32::consts::TAU * u[1]);
    let (x, y) = (r * libm::cosf(turn), r * libm::sinf(turn));
    Vec3::new(x, y, (1.0 - u[0]).max(0.0).sqrt())
}

/// A direction around an axis, evenly distributed over the cone with a cosine at its edge.
pub(super) fn cone_direction(axis: Vec3, least_cosine: f32, u: [f32; 2]) -> Vec3 {
    let z = 1.0 - u[0] * (1.0 - least_cosine);
    let (r, turn) = ((1.0 - z * z).max(0.0).sqrt(), std::f32::consts::TAU * u[1]);
    let local = Vec3::new(r * libm::cosf(turn), r * libm::sinf(turn), z);
    ShadingFrame::around(axis).world(local)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_are_at_right_angles_for_every_normal() {
        for i in 0..1000 {
            let u = [(i as f32 + 0.5) / 1000.0, (0.618_034 * i as f32).fract()];
            let z = cone_direction(Vec3::Y, -1.0, u);
            let frame = ShadingFrame::around(z);
            let (x, y) = (frame.world(Vec3::X), frame.world(Vec3::Y));
            assert!((x.cross(y) - z).length() < 1e-5, "{z}");
            assert!((frame.local(frame.world(u[0] * Vec3::ONE)) - u[0]).length() < 1e-5);
        }
    }
}

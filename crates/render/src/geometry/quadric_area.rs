//! Points that are evenly distributed over a round surface, in object space.

use glam::DVec3;

use super::quadric::{Quadric, QuadricKind, sag};

use std::f64::consts::{PI, TAU};

impl Quadric {
    /// The area in object space.
    pub(crate) fn area(&self) -> f64 {
        match self.kind {
            QuadricKind::Sphere { radius } => 4.0 * PI * radius * radius,
            QuadricKind::CylinderSide {
                radius,
                half_height,
            } => 2.0 * TAU * radius * half_height,
            QuadricKind::ConeSide {
                radius,
                half_height,
            } => PI * radius * (radius * radius + 4.0 * half_height * half_height).sqrt(),
            // A zone of a sphere has the area of the cylinder around it (Archimedes).
            QuadricKind::Zone {
                curvature,
                inner,
                outer,
            } => match curvature {
                0.0 => PI * (outer * outer - inner * inner),
                c => TAU / c.abs() * (sag(c, outer) - sag(c, inner)).abs(),
            },
            QuadricKind::Disc { radius, .. } => PI * radius * radius,
        }
    }

    /// The point for a point of the unit square. Equal areas of the square have equal areas of the
    /// surface.
    pub(crate) fn point_at(&self, u: [f32; 2]) -> DVec3 {
        let [u, turn] = u.map(f64::from);
        let ring = |radius: f64, y: f64| {
            let angle = TAU * turn;
            DVec3::new(radius * libm::cos(angle), y, radius * libm::sin(angle))
        };
        match self.kind {
            QuadricKind::Sphere { radius } => {
                let y = 2.0 * u - 1.0;
                ring(radius * (1.0 - y * y).max(0.0).sqrt(), radius * y)
            }
            QuadricKind::CylinderSide {
                radius,
                half_height,
            } => ring(radius, half_height * (2.0 * u - 1.0)),
            QuadricKind::ConeSide {
                radius,
                half_height,
            } => {
                let share = u.sqrt();
                ring(radius * share, half_height * (1.0 - 2.0 * share))
            }
            QuadricKind::Zone {
                curvature,
                inner,
                outer,
            } => match curvature {
                0.0 => {
                    let square = inner * inner + u * (outer * outer - inner * inner);
                    ring(square.sqrt(), 0.0)
                }
                c => {
                    let (low, high) = (sag(c, inner), sag(c, outer));
                    let y = low + u * (high - low);
                    ring((2.0 * y / c - y * y).max(0.0).sqrt(), y)
                }
            },
            QuadricKind::Disc { radius, y, .. } => ring(radius * u.sqrt(), y),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;

    /// The distances between neighboring points of a grid multiply to the area of a cell.
    #[test]
    fn points_are_on_the_surface_and_evenly_distributed() {
        for kind in [
            QuadricKind::Sphere { radius: 2.0 },
            QuadricKind::CylinderSide {
                radius: 0.5,
                half_height: 2.0,
            },
            QuadricKind::ConeSide {
                radius: 2.0,
                half_height: 1.5,
            },
            QuadricKind::Zone {
                curvature: -0.3,
                inner: 0.5,
                outer: 2.0,
            },
            QuadricKind::Zone {
                curvature: 0.0,
                inner: 0.5,
                outer: 2.0,
            },
            QuadricKind::Disc {
                radius: 1.5,
                y: 0.3,
                up: true,
            },
        ] {
            let quadric = Quadric::new(kind, DAffine3::IDENTITY, 0).unwrap();
            for i in 0..400u16 {
                let u = [i / 20, i % 20].map(|k| (f32::from(k) + 0.5) / 20.0);
                let step = 1.0 / 4096.0;
                let at = quadric.point_at(u);
                let (on, _) = quadric.project_to_surface(at);
                assert!((on - at).length() < 1e-9, "{kind:?}");
                let along =
                    quadric.point_at([u[0] + step, u[1]]) - quadric.point_at([u[0] - step, u[1]]);
                let around =
                    quadric.point_at([u[0], u[1] + step]) - quadric.point_at([u[0], u[1] - step]);
                let cell = along.cross(around).length() / (4.0 * f64::from(step) * f64::from(step));
                assert!(
                    (cell / quadric.area() - 1.0).abs() < 1e-3,
                    "{kind:?} {u:?}: {cell}"
                );
            }
        }
    }
}

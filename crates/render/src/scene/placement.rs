//! The matrix of the current shape to the scene.

use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};

/// The position and orientation of a shape in the scene, whose origin is the compile origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// The point of world space that is the scene's origin, in meters.
    pub origin: DVec3,
    /// The matrix from object space to the scene.
    pub scene_from_object: DAffine3,
    normal_matrix: DMat3,
    /// The normal of the plane into which the matrix presses every shape, toward the origin.
    pressed: Option<DVec3>,
    /// Whether normals are kept as they are, because the shape is placed later.
    is_deferred: bool,
}

impl Placement {
    /// The placement of world space itself in a scene with an origin.
    pub(crate) fn around(origin: DVec3) -> Self {
        Self {
            origin,
            scene_from_object: DAffine3::IDENTITY,
            normal_matrix: DMat3::IDENTITY,
            pressed: None,
            is_deferred: false,
        }
    }

    /// The placement of a shape that is kept in its object space, to be placed later. Points and
    /// normals are not changed.
    pub(crate) fn deferred(&self) -> Self {
        Self {
            is_deferred: true,
            ..Self::around(self.origin)
        }
    }

    /// The placement of a shape with a matrix to world space.
    pub(crate) fn moved_to(&self, world_from_object: DMat4) -> Self {
        let mut affine = DAffine3::from_mat4(world_from_object);
        affine.translation -= self.origin;
        let inverse = affine.matrix3.inverse();
        Self {
            origin: self.origin,
            scene_from_object: affine,
            normal_matrix: if inverse.is_finite() {
                inverse.transpose()
            } else {
                affine.matrix3
            },
            pressed: plane_normal(&affine),
            is_deferred: false,
        }
    }

    /// The placement with an additional matrix.
    pub(crate) fn times(&self, matrix: DMat4) -> Self {
        let mut world = self.scene_from_object;
        world.translation += self.origin;
        self.moved_to(DMat4::from(world) * matrix)
    }

    /// Whether the matrix collapses every shape to a line or a point, by a scale of 0 in two
    /// directions.
    pub(crate) fn is_collapsed(&self) -> bool {
        let m = self.scene_from_object.matrix3;
        let areas = [
            m.x_axis.cross(m.y_axis),
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
        ];
        areas.iter().all(|area| *area == DVec3::ZERO)
    }

    /// Whether the matrix collapses every shape to a point, by a scale of 0 in all directions.
    pub(crate) fn is_point(&self) -> bool {
        self.scene_from_object.matrix3 == DMat3::ZERO
    }

    /// Transforms a point to the scene.
    #[inline]
    pub(crate) fn point(&self, p: Vec3) -> Vec3 {
        let moved = self.scene_from_object.transform_point3(p.as_dvec3());
        moved.as_vec3()
    }

    /// Transforms a normal to the scene, with length 1 or 0.
    #[inline]
    pub(crate) fn normal(&self, normal: Vec3) -> Vec3 {
        if self.is_deferred {
            return normal;
        }
        if let Some(pressed) = self.pressed {
            return pressed.as_vec3();
        }
        let turned = self.normal_matrix * normal.as_dvec3();
        turned.normalize_or_zero().as_vec3()
    }
}

/// Returns the unit normal, toward the origin, of the plane into which a matrix presses every
/// shape, by a scale of 0 in one direction. Front and back of a shape are at one place then, and
/// the viewer at the origin sees the front.
fn plane_normal(matrix: &DAffine3) -> Option<DVec3> {
    let m = matrix.matrix3;
    let size = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    if m.determinant().abs() > 1e-13 * size {
        return None;
    }
    let products = [
        m.x_axis.cross(m.y_axis),
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
    ];
    let longest = |a: DVec3, b: DVec3| if b.length() > a.length() { b } else { a };
    let normal = products.into_iter().fold(DVec3::ZERO, longest);
    let toward = -normal.dot(matrix.translation).signum();
    normal.try_normalize().map(|normal| toward * normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_normals_of_a_pressed_shape_are_those_of_its_plane_toward_the_viewer() {
        let turn = DMat4::from_rotation_y(0.3);
        for z in [-5.0, 5.0] {
            let moved = DMat4::from_translation(DVec3::new(0.0, 0.0, z)) * turn;
            let pressed = moved * DMat4::from_scale(DVec3::new(2.0, 1.0, 0.0));
            let placement = Placement::around(DVec3::ZERO).moved_to(pressed);
            let facing = -z.signum() * turn.transform_vector3(DVec3::Z);
            for normal in [Vec3::Z, Vec3::NEG_Z, Vec3::X] {
                let found = placement.normal(normal).as_dvec3();
                assert!(found.distance(facing) < 1e-6, "{found}");
            }
        }
    }
}

//! The geometry of drag sensors: what the motion of the pointer does to a plane, a cylinder and a
//! sphere (ISO 14772-1, 6.34, 6.15 and 6.44).
//!
//! Everything here is in the coordinate system of the sensor at the moment of the press, in which a
//! sensor below the group that it moves stays where it was.

use std::f64::consts::{PI, TAU};

use glam::{DMat4, DQuat, DVec2, DVec3, Vec3};

use crate::grammar::value::Rotation;
use crate::grammar::{class, cylinder_sensor, plane_sensor, sphere_sensor};
use crate::iv::{NodeRef, Value};
use crate::pose::{ViewRay, quat, rotation_value};

/// An output with its value.
pub(super) type Sent = (&'static str, Value);

/// What the pointer is moved on.
#[derive(Clone, Copy, Debug)]
enum Projector {
    /// The plane through the first point, parallel to z = 0.
    Plane,
    /// The cylinder around the y axis through the first point. The pointer is on its far side if
    /// the first point is.
    Cylinder { is_far: bool },
    /// The plane through the first point, parallel to y = 0.
    Disk,
    /// The sphere around the origin through the first point.
    Sphere { is_far: bool },
}

/// A drag of one sensor.
#[derive(Clone, Debug)]
pub(super) struct Drag {
    sensor_from_world: DMat4,
    track: Projector,
    /// The first point.
    start: DVec3,
    /// The angle around the y axis, without the offset. It is followed beyond half a turn.
    angle: f64,
    /// What the offset becomes with the release, if it is kept.
    offset: Option<Value>,
}

impl Drag {
    /// Begins a drag at a point of the world, which the pointer reaches along a ray.
    pub(super) fn begin(
        sensor: NodeRef<'_>,
        world_from_sensor: DMat4,
        point: DVec3,
        ray: &ViewRay,
    ) -> Option<Self> {
        let sensor_from_world = world_from_sensor.inverse();
        if !sensor_from_world.is_finite() {
            return None;
        }
        let start = sensor_from_world.transform_point3(point);
        let along = ray.transformed(&sensor_from_world).direction;
        let around = |v: DVec3| DVec2::new(v.x, v.z);
        let track = match sensor.class_id()? {
            class::PLANE_SENSOR => Projector::Plane,
            class::SPHERE_SENSOR => Projector::Sphere {
                is_far: along.dot(start) > 0.0,
            },
            class::CYLINDER_SENSOR => {
                let tilt = libm::acos((along.y.abs() / along.length()).min(1.0));
                match tilt < f64::from(sensor.get(cylinder_sensor::DISK_ANGLE)) {
                    true => Projector::Disk,
                    false => Projector::Cylinder {
                        is_far: around(along).dot(around(start)) > 0.0,
                    },
                }
            }
            _ => return None,
        };
        Some(Self {
            sensor_from_world,
            track,
            start,
            angle: 0.0,
            offset: None,
        })
    }

    /// Returns what the sensor sends when the pointer is on a ray: nothing if the ray leaves the
    /// plane.
    pub(super) fn follow(&mut self, sensor: NodeRef<'_>, ray: &ViewRay) -> Vec<Sent> {
        let ray = ray.transformed(&self.sensor_from_world);
        let point = match self.track {
            Projector::Plane => on_plane(&ray, 2, self.start.z),
            Projector::Disk => on_plane(&ray, 1, self.start.y),
            Projector::Sphere { is_far } => Some(on_sphere(&ray, self.start.length(), is_far)),
            Projector::Cylinder { is_far } => {
                let radius = DVec2::new(self.start.x, self.start.z).length();
                Some(on_cylinder(&ray, radius, is_far))
            }
        };
        let Some(point) = point.filter(|point| point.is_finite()) else {
            return Vec::new();
        };
        let moved = match self.track {
            Projector::Plane => self.translation(sensor, point),
            Projector::Sphere { .. } => self.turn(sensor, point),
            Projector::Disk | Projector::Cylinder { .. } => self.turn_around_y(sensor, point),
        };
        vec![("trackPoint_changed", Value::Vec3(point.as_vec3())), moved]
    }

    /// Returns what the field `offset` becomes if `autoOffset` keeps the last value.
    pub(super) fn new_offset(&self) -> Option<&Value> {
        self.offset.as_ref()
    }

    /// The translation of a `PlaneSensor` (6.34).
    fn translation(&mut self, sensor: NodeRef<'_>, point: DVec3) -> Sent {
        let offset = sensor.get(plane_sensor::OFFSET);
        let mut moved = (point - self.start).as_vec3() + offset;
        let least = sensor.get(plane_sensor::MIN_POSITION);
        let most = sensor.get(plane_sensor::MAX_POSITION);
        for axis in 0..2 {
            if least[axis] <= most[axis] {
                moved[axis] = moved[axis].clamp(least[axis], most[axis]);
            }
        }
        let value = Value::Vec3(moved);
        self.offset = Some(value.clone());
        ("translation_changed", value)
    }

    /// The rotation of a `SphereSensor` (6.44): that of the offset, and then the shortest one from
    /// the first point to this one.
    fn turn(&mut self, sensor: NodeRef<'_>, point: DVec3) -> Sent {
        let arc = match (self.start.try_normalize(), point.try_normalize()) {
            (Some(from), Some(to)) => DQuat::from_rotation_arc(from, to),
            _ => DQuat::IDENTITY,
        };
        let turn = arc * quat(sensor.get(sphere_sensor::OFFSET));
        let value = Value::Rotation(rotation_value(turn));
        self.offset = Some(value.clone());
        ("rotation_changed", value)
    }

    /// The rotation of a `CylinderSensor` (6.15).
    fn turn_around_y(&mut self, sensor: NodeRef<'_>, point: DVec3) -> Sent {
        let angle_of = |p: DVec3| libm::atan2(p.x, p.z);
        let new = angle_of(point) - angle_of(self.start);
        let step = new - self.angle;
        self.angle += step - TAU * ((step + PI) / TAU).floor();
        let mut angle = self.angle as f32 + sensor.get(cylinder_sensor::OFFSET);
        let least = sensor.get(cylinder_sensor::MIN_ANGLE);
        let most = sensor.get(cylinder_sensor::MAX_ANGLE);
        if least <= most {
            angle = angle.clamp(least, most);
        }
        self.offset = Some(Value::Float(angle));
        let axis = Vec3::Y;
        (
            "rotation_changed",
            Value::Rotation(Rotation { axis, angle }),
        )
    }
}

/// Returns where a ray meets the plane on which a coordinate has a value.
fn on_plane(ray: &ViewRay, axis: usize, value: f64) -> Option<DVec3> {
    let distance = (value - ray.origin[axis]) / ray.direction[axis];
    (distance >= 0.0 && distance.is_finite()).then(|| {
        let mut point = ray.at(distance);
        point[axis] = value;
        point
    })
}

/// Returns where a ray meets a sphere around the origin, or beside it the nearest point.
fn on_sphere(ray: &ViewRay, radius: f64, is_far: bool) -> DVec3 {
    let (d, o) = (ray.direction, ray.origin);
    let foot = -o.dot(d) / d.length_squared();
    let beside = ray.at(foot);
    let left = radius * radius - beside.length_squared();
    let reach = (left.max(0.0) / d.length_squared()).sqrt();
    let point = ray.at(if is_far { foot + reach } else { foot - reach });
    radius * point.normalize_or_zero()
}

/// Returns where a ray meets a cylinder around the y axis, or beside it the nearest point.
fn on_cylinder(ray: &ViewRay, radius: f64, is_far: bool) -> DVec3 {
    let around = |v: DVec3| DVec2::new(v.x, v.z);
    let (d, o) = (around(ray.direction), around(ray.origin));
    let foot = -o.dot(d) / d.length_squared();
    let left = radius * radius - (o + foot * d).length_squared();
    let reach = (left.max(0.0) / d.length_squared()).sqrt();
    let point = ray.at(if is_far { foot + reach } else { foot - reach });
    let side = radius * around(point).normalize_or_zero();
    DVec3::new(side.x, point.y, side.y)
}

//! The table of classes and the field handles, which `build/nodes/` generates from
//! `grammar/*.nodes`.

#![allow(clippy::all)]
#![allow(dead_code, unused_imports)]

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::class_id::ClassId;
use super::entry::{Class, Dialect, KitPart, Role, Treatment};
use super::field::{Default, Field, FieldDecl, FieldType};
use super::value::{Choice, Image, NodeId, NodeRefValue, Plane, Rotation, Seconds, Text, Trigger};

include!(concat!(env!("OUT_DIR"), "/catalogue.rs"));

//! Rays through a tree of boxes: building, single rays, and packets of rays.
//!
//! The tree has nodes of eight boxes and leaves of four triangles, each tested at once. It is
//! collapsed from a binary tree. A hit has the same bits on every processor, in a packet or by
//! itself: the triangle test is the same operations in the same order everywhere, never fused.
//!
//! Primitives are numbers. The tree knows the corners of those that are triangles; the caller
//! intersects the others ([`NonTriangles`]). Nothing here knows scenes.
//!
//! The walks are our own because of three measured faults of obvhs 0.4.0: it misses everything with
//! a direction component of −0.0, it clamps inverse components at f32 epsilon, and its wide nodes
//! have a smallest distance built in. [`PreparedRay`] makes the inverse in one place: `+0.0` first,
//! then clamped at 2^64.

mod binary;
mod block;
mod build;
mod collapse;
mod hit;
mod nodes;
mod packet;
mod prepared_packet;
#[cfg(target_arch = "x86_64")]
mod prepared_packet_avx512;
mod ray;
mod sah;
mod stack;
mod triangle;
mod walk;

pub(crate) use block::{Block, BlockHits};
pub(crate) use hit::{COPLANAR, Hit, NonTriangles};
pub(crate) use nodes::Bvh;
pub(crate) use packet::{PacketHits, RayPacket};
pub(crate) use ray::Ray;
pub(crate) use triangle::PreparedRay;

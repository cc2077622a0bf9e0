//! A bounding volume hierarchy (BVH): building it, and tracing single rays and packets through it.
//!
//! A node has eight boxes and a leaf has blocks of four triangles; the boxes of a node and the
//! triangles of a block are tested together. The tree is collapsed from a binary tree. A hit has
//! the same bits on every processor, in a packet or traced alone, because the triangle test does
//! the same operations in the same order everywhere and never uses fused multiply-add.
//!
//! A primitive is a number. The tree stores the corners of triangles; the caller intersects the
//! other primitives ([`Primitives`]). Nothing here knows scenes.
//!
//! obvhs 0.4.0 builds the tree but does not trace rays, because of three measured faults: it misses
//! every box if a direction component is −0.0, it clamps inverse components at the f32 epsilon, and
//! its wide nodes have a fixed smallest distance. [`PreparedRay`] computes the inverse in one
//! place: it turns −0.0 into +0.0, then clamps at 2^64.

mod binary;
mod block;
mod build;
mod chunks;
mod collapse;
mod crowding;
mod hit;
mod nearest_hit;
mod nodes;
mod packet;
mod packet_walk;
mod prepared_packet;
mod ray;
mod sah;
mod stack;
mod triangle;
mod walk;

pub use block::{Block, BlockHits};
pub use hit::{COPLANAR, Hit, Primitives};
pub use nodes::Bvh;
pub use packet::{PacketHits, RayPacket};
pub use ray::Ray;
pub use triangle::PreparedRay;

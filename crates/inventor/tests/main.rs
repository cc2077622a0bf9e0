//! Tests of reading, writing and walking through the public interface of the crate.

mod iv;
mod roundtrip;
mod vrml97_defaults;
mod walk;

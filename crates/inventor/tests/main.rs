//! Tests of reading, writing and walking through the public interface of the crate.

mod formats;
mod iv;
mod roundtrip;
mod vrml97_defaults;
mod walk;

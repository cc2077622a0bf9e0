//! How much memory a scene, its textures and its film may use.
//!
//! A [`MemoryLimit`] is the choice of the user, and a [`MemoryBudget`] counts what is in use. Code
//! asks the budget before it allocates a large block, and leaves out what does not fit, with a
//! message. Sizes are estimates of the large lists; the program itself, its threads and small lists
//! are not counted.

mod budget;
mod free_blocks;
mod limit;
mod machine;
mod size;

pub use budget::MemoryBudget;
pub use free_blocks::release_free_blocks;
pub use limit::MemoryLimit;
pub use size::size_text;

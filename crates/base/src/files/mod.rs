//! Reads files of bounded size, writes files that appear only when they are complete, asks for the
//! space that they take, records what was read, claims work in shared folders and names of files,
//! finds the folders of files, and escapes text for markup.

mod claim;
mod folder;
mod inputs;
#[cfg(target_os = "linux")]
mod mapped;
mod markup;
mod name_claim;
#[cfg(feature = "mpi")]
pub mod passed_on;
#[cfg(unix)]
mod pipes;
mod read;
mod space;
mod standard_output;
mod whole;

pub use claim::{Claims, Held, host_name};
pub use folder::{folder_of, named_project, project_of};
pub use inputs::{InputRecord, Inputs, hash_of_file};
pub use markup::escaped;
pub use name_claim::NameClaim;
pub use read::{FileBytes, LARGE_FILE, MAX_PICTURE, MAX_TEXT, open_file};
pub use read::{read_file, read_file_named, read_stream};
pub use space::{SizeEstimate, check_space};
pub use standard_output::is_output_closed;
pub use whole::{WriteSeek, check_writable, temporary_prefix};
pub use whole::{write_new, write_whole, write_whole_seekable};

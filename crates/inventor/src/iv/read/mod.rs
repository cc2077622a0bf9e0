//! Reads the bytes of a file, and of the files that it includes, into a `Document`.
//!
//! The header determines the format. A file with mistakes is read as far as possible, and the
//! messages are in `Document::sink`. Reading fails only because of a wrong header, a limit or an
//! I/O error.
//!
//! The modules form layers, each of which imports only the layers before it:
//!
//! * `syntax_error`, `tokens`, `numbers`, `blocks`, `values` and `binary_values` parse bytes with
//!   nom and do not depend on documents. The readers keep the nesting of nodes on a stack;
//! * `header`, `upgrade` and `assemble` resolve the names of classes and fields in each version of
//!   the format, and assemble nodes; `mistakes` reports what is read and means nothing;
//! * `expand` and `cycles` complete a document: they expand protos and remove cycles;
//! * `ascii` and `binary` read the nodes of one file, and `formats` makes nodes from a file of
//!   another format;
//! * `file`, `inline` and `open` read whole files.

mod ascii;
mod assemble;
mod binary;
mod binary_values;
mod blocks;
mod cycles;
mod enum_names;
mod expand;
mod file;
mod formats;
mod header;
mod inline;
mod mistakes;
mod numbers;
mod open;
mod stated;
mod syntax_error;
mod tokens;
mod upgrade;
mod values;

//! Reads the bytes of a file, and of the files that it names, into a `Document`.
//!
//! The header decides the format. A file with mistakes is read as far as possible, and the
//! messages are in `Document::sink`; only a wrong header, a limit or I/O ends reading.
//!
//! The layers, each of which imports only those before it:
//!
//! * `syntax_error`, `tokens`, `numbers`, `values` and `binary_values` parse bytes with nom, and
//!   know
//!   no document. The nesting of nodes is not theirs: it is a stack of the readers;
//! * `header`, `upgrade` and `assemble` know what a class or field name means in a version of the
//!   format, and put nodes together;
//! * `expand` and `cycles` finish a document: instances of protos, and nodes inside themselves;
//! * `ascii` and `binary` read the nodes of one file;
//! * `file`, `inline` and `open` read whole files.

mod ascii;
mod assemble;
mod binary;
mod binary_values;
mod cycles;
mod enum_names;
mod expand;
mod file;
mod header;
mod inline;
mod numbers;
mod open;
mod syntax_error;
mod tokens;
mod upgrade;
mod values;

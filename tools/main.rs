//! Measuring programs: `cargo run --release --features tools --bin measure -- NAME ARGUMENTS`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ivcam::tools::run(std::env::args().skip(1).collect())
}

//! The limits of the program's memory in a page.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // A scene that needs more ends its worker, and not the page.
    println!("cargo::rustc-cdylib-link-arg=--max-memory=2147483648");
    // The stack of a program's first thread on Linux.
    println!("cargo::rustc-cdylib-link-arg=-zstack-size=8388608");
}

//! A temporary folder in which a test runs the program.

use std::path::PathBuf;
use std::process::{Command, Output};

/// A temporary folder with a scene, which is removed at the end.
pub struct Scratch(pub PathBuf);

impl Scratch {
    /// Makes a folder for a test, with the file of a scene.
    pub fn new(name: &str, file: &str, scene: &str) -> Self {
        let name = format!("ivcam-{}-{name}", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&path).unwrap();
        std::fs::write(path.join(file), scene).unwrap();
        Self(path)
    }

    /// Runs the program in the folder.
    pub fn ivcam(&self, line: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ivcam"));
        command.current_dir(&self.0).args(line.split_whitespace());
        command.output().unwrap()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Checks that a run ends with one error that has the text.
pub fn must_fail(output: &Output, text: &str) {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.matches("error: ").count(), 1, "{said}");
    let line = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(line.contains(text), "`{text}` missing in\n{said}");
}

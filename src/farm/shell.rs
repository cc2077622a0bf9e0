//! Words and scripts of POSIX shells.

/// Returns a word that a POSIX shell reads as exactly this text.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// A word of a command in a script.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ShellWord {
    /// A text.
    Text(String),
    /// The script's first argument.
    Argument,
    /// The script's first argument between two texts.
    Around(String, String),
}

impl ShellWord {
    /// Returns the word as a shell reads it.
    fn quoted(&self) -> String {
        match self {
            Self::Text(text) => quoted(text),
            Self::Argument => "\"$1\"".to_owned(),
            Self::Around(before, after) => format!("{}\"$1\"{}", quoted(before), quoted(after)),
        }
    }
}

impl From<&str> for ShellWord {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

/// Returns a script that runs commands in a folder, one after another until one fails.
pub(crate) fn script(purpose: &str, folder: &str, commands: &[Vec<ShellWord>]) -> String {
    let line = |(i, words): (usize, &Vec<ShellWord>)| {
        let words: Vec<String> = words.iter().map(ShellWord::quoted).collect();
        match i + 1 == commands.len() {
            true => format!("exec {}\n", words.join(" ")),
            false => format!("{} || exit\n", words.join(" ")),
        }
    };
    let lines: Vec<String> = commands.iter().enumerate().map(line).collect();
    format!(
        "#!/bin/sh\n# {purpose}\ncd {} || exit 2\n{}",
        path(folder),
        lines.concat()
    )
}

/// Returns a quoted path that `cd` does not take for an option or a search in `CDPATH`.
fn path(folder: &str) -> String {
    match folder.starts_with('/') {
        true => quoted(folder),
        false => quoted(&format!("./{folder}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names that have a meaning for a shell, for JSON, for Python or for a template.
    const NAMES: [&str; 9] = [
        "plain.iv",
        "two words.iv",
        "it's \"here\".iv",
        "Küche ☕.iv",
        "$HOME `x` \\n.iv",
        "{{Task.File.Run}}{{{a}}.iv",
        "100%_%A_%{CWD}.iv",
        "line\nbreak.iv",
        "-o",
    ];

    #[cfg(unix)]
    #[test]
    fn a_shell_reads_quoted_words_as_they_were() {
        for name in NAMES {
            let echo = format!("printf '%s' {}", quoted(name));
            let run = std::process::Command::new("sh")
                .args(["-c", &echo])
                .output();
            assert_eq!(String::from_utf8_lossy(&run.unwrap().stdout), name);
        }
        assert_eq!(quoted(""), "''");
    }

    #[cfg(unix)]
    #[test]
    fn a_script_ends_with_the_command_that_fails() {
        let run = |first: &str| {
            let commands = [vec![first.into()], vec!["echo".into(), "second".into()]];
            let text = script("Tries.", "/", &commands);
            std::process::Command::new("sh")
                .args(["-c", &text])
                .output()
                .unwrap()
        };
        assert_eq!(run("true").stdout, b"second\n");
        let failed = run("false");
        assert!(failed.stdout.is_empty() && failed.status.code() == Some(1));
    }

    #[cfg(unix)]
    #[test]
    fn a_script_runs_its_command_in_the_folder_with_its_argument() {
        let mut words = ["printf", "%s|", "a b"].map(ShellWord::from).to_vec();
        words.extend([
            ShellWord::Argument,
            ShellWord::Around("x y/".into(), ".z".into()),
        ]);
        let text = script("Prints.", "/", &[words]);
        let mut command = std::process::Command::new("sh");
        let run = command.args(["-c", &text, "sh", "1-2,7"]).output().unwrap();
        assert_eq!(
            String::from_utf8_lossy(&run.stdout),
            "a b|1-2,7|x y/1-2,7.z|"
        );
    }
}

//! Words and scripts of POSIX shells.

/// Returns a word that a POSIX shell reads as exactly this text.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Returns a script that runs a command in a folder. The command is given as words, of which
/// [`None`] is the script's first argument.
pub(crate) fn script(purpose: &str, folder: &str, words: &[Option<String>]) -> String {
    let word = |word: &Option<String>| match word {
        Some(word) => quoted(word),
        None => "\"$1\"".to_owned(),
    };
    let command: Vec<String> = words.iter().map(word).collect();
    format!(
        "#!/bin/sh\n# {purpose}\ncd {} || exit 2\nexec {}\n",
        path(folder),
        command.join(" ")
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
    fn a_script_runs_its_command_in_the_folder_with_its_argument() {
        let words = ["printf", "%s|", "a b"].map(|w| Some(w.to_owned()));
        let words = [&words[..], &[None]].concat();
        let text = script("Prints.", "/", &words);
        let mut command = std::process::Command::new("sh");
        let run = command.args(["-c", &text, "sh", "1-2,7"]).output().unwrap();
        assert_eq!(String::from_utf8_lossy(&run.stdout), "a b|1-2,7|");
    }
}

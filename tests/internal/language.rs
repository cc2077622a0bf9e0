//! Checks the language of the repository: phrases that are not used in comments, messages and
//! documents, and the width of comment lines.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Phrases of a dialect that readers of technical English do not know. The standard term is
/// clearer. They are matched in whole words, in upper or lower case.
const PHRASES: &[&str] = &[
    "a hair",
    "a second look",
    "a word on",
    "afresh",
    "albeit",
    "all there is",
    "are felt",
    "are told",
    "as one likes",
    "at one speed",
    "be held against",
    "be told",
    "bears on",
    "begins anew",
    "by leave",
    "by so much",
    "by the way of",
    "by turns",
    "bytes a sample",
    "bytes a texel",
    "calls itself",
    "clothe",
    "comes of it",
    "compiled anew",
    "complain",
    "complain about",
    "complains",
    "counted anew",
    "does not know what",
    "does not speak of",
    "does not tell",
    "drawn anew",
    "errs",
    "found again",
    "from then on",
    "gives the bits",
    "go by",
    "goes on to",
    "good and bad",
    "half the way",
    "handed on",
    "hands on",
    "has its say",
    "has to say",
    "have their say",
    "have to say",
    "hear of",
    "hears of",
    "heed",
    "heedless",
    "held against",
    "heretofore",
    "hither",
    "hitherto",
    "hold against",
    "holds against",
    "how far apart",
    "in wholes",
    "is even in",
    "is felt",
    "is given up",
    "is looked at",
    "is told",
    "like itself",
    "line pairs a millimeter",
    "long gone",
    "look like itself",
    "looked at",
    "makes of it",
    "met by",
    "more of the same",
    "nine to ten times in ten",
    "no other arithmetic",
    "no other way",
    "nobody knows",
    "nobody's business",
    "numbers a triangle",
    "numbers that are no numbers",
    "numbers that are none",
    "of yore",
    "on screen and off",
    "over and over",
    "put right",
    "rays a pixel",
    "rays a second",
    "reaches over",
    "said of",
    "settle",
    "settles",
    "shines through",
    "slip of the finger",
    "speak of",
    "speaks of",
    "stands still",
    "starts anew",
    "stays what it was",
    "tell_of",
    "tells of",
    "that are none",
    "that it brings",
    "that nobody knows",
    "the likes",
    "the same in short",
    "thence",
    "thereby",
    "therein",
    "thereof",
    "thither",
    "times in ten",
    "to and fro",
    "to be meant",
    "told by",
    "told once",
    "trouble",
    "troubles",
    "was told",
    "what is left of",
    "what is said",
    "what it brings",
    "whatever comes",
    "whatever stands",
    "whence",
    "wherein",
    "whereof",
    "wholes of",
    "with their words",
    "without a widget in it",
    "without a word on",
    "would have it",
    "written anew",
];

/// The greatest width of a comment line in `src`, in characters.
const WIDEST: usize = 100;

/// A word of prose, in lower case, with its line. `None` ends a phrase: code or punctuation.
type Words = Vec<Option<(String, usize)>>;

/// A part of a source file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Code,
    Comment,
    Text,
    /// A raw string, with the number of `#` that end it.
    RawText(usize),
}

/// Collects words from prose that is given a character at a time.
#[derive(Default)]
struct Prose {
    words: Words,
    word: String,
    /// Whether the text is an identifier or a command in backticks.
    quoted: bool,
}

impl Prose {
    fn add(&mut self, c: char, line: usize) {
        if c == '`' {
            self.quoted = !self.quoted;
            return self.end(line);
        }
        if self.quoted {
            return;
        }
        if c.is_alphanumeric() || c == '_' || c == '\'' || c == '-' {
            self.word.extend(c.to_lowercase());
            return;
        }
        self.finish_word(line);
        if !c.is_whitespace() && c != '*' {
            self.words.push(None);
        }
    }

    fn finish_word(&mut self, line: usize) {
        if !self.word.is_empty() {
            let word = std::mem::take(&mut self.word);
            self.words.push(Some((word, line)));
        }
    }

    /// Ends a phrase.
    fn end(&mut self, line: usize) {
        self.finish_word(line);
        self.words.push(None);
    }
}

/// Returns the words of comments and string literals of a Rust file.
fn rust_prose(text: &str) -> Words {
    let chars: Vec<char> = text.chars().collect();
    let (mut prose, mut part, mut line, mut i) = (Prose::default(), Part::Code, 1, 0);
    while i < chars.len() {
        let c = chars[i];
        let next = chars.get(i + 1).copied().unwrap_or(' ');
        let mut step = 1;
        match part {
            Part::Code => match (c, next) {
                ('/', '/') => {
                    part = Part::Comment;
                    step = 2 + chars[i + 2..]
                        .iter()
                        .take_while(|c| "/!".contains(**c))
                        .count();
                }
                ('"', _) => part = Part::Text,
                ('r', '"' | '#') if !chars[..i].last().is_some_and(|c| c.is_alphanumeric()) => {
                    let hashes = chars[i + 1..].iter().take_while(|c| **c == '#').count();
                    if chars.get(i + 1 + hashes) == Some(&'"') {
                        part = Part::RawText(hashes);
                        step = 2 + hashes;
                    }
                }
                ('\'', '\\') => step = 3,
                ('\'', _) if chars.get(i + 2) == Some(&'\'') => step = 3,
                // Code ends a phrase, but the indentation between two comment lines does not.
                _ if !c.is_whitespace() => prose.end(line),
                _ => {}
            },
            Part::Comment if c == '\n' => {
                part = Part::Code;
                prose.quoted = false;
                prose.add(' ', line);
            }
            Part::Text if c == '\\' => {
                step = 2;
                prose.add(' ', line);
            }
            Part::Text if c == '"' => {
                part = Part::Code;
                prose.quoted = false;
                prose.end(line);
            }
            Part::RawText(hashes)
                if c == '"' && chars[i + 1..].iter().take(hashes).all(|c| *c == '#') =>
            {
                part = Part::Code;
                step = 1 + hashes;
                prose.quoted = false;
                prose.end(line);
            }
            Part::Comment | Part::Text | Part::RawText(_) => prose.add(c, line),
        }
        let end = chars.len().min(i + step);
        line += chars[i..end].iter().filter(|c| **c == '\n').count();
        i = end;
    }
    prose.end(line);
    prose.words
}

/// Returns the words of a text file without code blocks.
fn plain_prose(text: &str) -> Words {
    let mut prose = Prose::default();
    let mut in_block = false;
    for (line, content) in text.lines().enumerate() {
        if content.trim_start().starts_with("```") {
            in_block = !in_block;
            prose.quoted = false;
            prose.end(line + 1);
        } else if !in_block {
            let content = content.trim_start_matches(['#', '>', ' ']);
            content.chars().for_each(|c| prose.add(c, line + 1));
            prose.add(' ', line + 1);
            if content.is_empty() {
                prose.quoted = false;
                prose.end(line + 1);
            }
        }
    }
    prose.words
}

/// Returns the lines on which a phrase begins.
fn lines_with(phrase: &str, words: &Words) -> Vec<usize> {
    let phrase: Vec<String> = phrase.split(' ').map(str::to_lowercase).collect();
    let begins = |window: &&[Option<(String, usize)>]| {
        let mut pairs = window.iter().zip(&phrase);
        pairs.all(|(w, p)| w.as_ref().is_some_and(|(w, _)| w == p))
    };
    let windows = words.windows(phrase.len()).filter(begins);
    windows
        .filter_map(|w| w[0].as_ref().map(|(_, line)| *line))
        .collect()
}

/// Finds the files with an extension below a folder, in order.
fn find(folder: &Path, extensions: &[&str], files: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return;
    };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            find(&path, extensions, files);
        } else if path
            .extension()
            .is_some_and(|e| extensions.iter().any(|x| *x == e))
        {
            files.push(path);
        }
    }
}

/// Returns the files that are checked, without the list of phrases itself.
fn files() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files: Vec<PathBuf> = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"]
        .iter()
        .map(|name| root.join(name))
        .collect();
    for folder in ["src", "crates", "tests", "grammar", "docs"] {
        find(&root.join(folder), &["rs", "md", "nodes"], &mut files);
    }
    files.retain(|path| !path.ends_with("tests/internal/language.rs"));
    files
}

/// Writes a location relative to the package.
fn report(out: &mut String, path: &Path, line: usize, what: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = path.strip_prefix(root).unwrap_or(path);
    let _ = writeln!(out, "{}:{line}: {what}", path.display());
}

#[test]
fn comments_messages_and_documents_have_no_dialect() {
    let mut found = String::new();
    let files = files();
    assert!(files.len() > 300, "only {} files are checked", files.len());
    for path in files {
        let text = std::fs::read_to_string(&path).expect("a source file is readable");
        let is_rust = path.extension().is_some_and(|e| e == "rs");
        let words = if is_rust {
            rust_prose(&text)
        } else {
            plain_prose(&text)
        };
        let held: HashSet<&str> = words.iter().flatten().map(|(w, _)| w.as_str()).collect();
        let may_be_here = |phrase: &&&str| phrase.split(' ').all(|word| held.contains(word));
        for phrase in PHRASES.iter().filter(may_be_here) {
            for line in lines_with(phrase, &words) {
                report(&mut found, &path, line, &format!("`{phrase}`"));
            }
        }
    }
    assert!(found.is_empty(), "use the standard term instead:\n{found}");
}

#[test]
fn comment_lines_of_the_sources_fit_in_100_columns() {
    let mut found = String::new();
    let mut files = Vec::new();
    for folder in ["src", "crates"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        find(&folder, &["rs"], &mut files);
    }
    for path in files {
        let text = std::fs::read_to_string(&path).expect("a source file is readable");
        for (i, line) in text.lines().enumerate() {
            let width = line.chars().count();
            if line.trim_start().starts_with("//") && width > WIDEST {
                report(&mut found, &path, i + 1, &format!("{width} columns"));
            }
        }
    }
    assert!(found.is_empty(), "wrap these comment lines:\n{found}");
}

#[test]
fn phrases_are_found_in_comments_and_texts_over_lines_and_not_in_code() {
    let text =
        "// one Two\n    // three `one two` four\nlet one = \"one two\"; two();\n'\"'; // one two";
    let words = rust_prose(text);
    assert_eq!(lines_with("one two", &words), [1, 3, 4]);
    assert_eq!(lines_with("two three", &words), [1]);
    assert_eq!(lines_with("three four", &words), [0; 0]);
    let raw = rust_prose("r#\"a \"b\" c\"#; /// d\ne");
    assert_eq!(lines_with("c", &raw), [1]);
    assert_eq!(lines_with("e", &raw), [0; 0]);
    let page = plain_prose("one\ntwo. three\n```\none two\n```\n");
    assert_eq!(lines_with("one two", &page), [1]);
    assert_eq!(lines_with("two three", &page), [0; 0]);
}

//! Work that is divided into tasks, and files that describe it.

/// Work that is divided into tasks, and what follows them.
#[derive(Clone, Debug)]
pub(crate) struct Division {
    /// The shell script of a task. Its first argument says which one.
    pub task: String,
    /// The argument of each task. It consists of digits, `,`, `-`, `:` and `.`, which have no
    /// special meaning for any scheduler.
    pub arguments: Vec<String>,
    /// The shell script that runs after all tasks have succeeded.
    pub last: Option<String>,
    /// The number of processors that a task uses.
    pub cores: u32,
}

/// Divides a list into pieces of `size`, or of as many that there are at most `most` pieces.
pub(crate) fn pieces<T>(list: &[T], size: Option<usize>, most: usize) -> Vec<&[T]> {
    let least = list.len().div_ceil(most).max(1);
    list.chunks(size.unwrap_or(1).max(least)).collect()
}

/// One of the files to write.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JobFile {
    /// The name of the file.
    pub name: &'static str,
    /// The text of the file.
    pub content: String,
}

impl JobFile {
    pub(super) fn new(name: &'static str, content: impl Into<String>) -> Self {
        Self {
            name,
            content: content.into(),
        }
    }
}

/// Returns the files that several schedulers share: the scripts, and the arguments one a line.
pub(super) fn scripts(division: &Division) -> Vec<JobFile> {
    let mut files = vec![
        JobFile::new("task.sh", division.task.clone()),
        JobFile::new("tasks.txt", division.arguments.join("\n") + "\n"),
    ];
    files.extend(
        division
            .last
            .clone()
            .map(|last| JobFile::new("last.sh", last)),
    );
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_has_pieces_of_a_size_and_never_too_many() {
        let count = |n: usize, size, most| {
            let list: Vec<usize> = (0..n).collect();
            let pieces = pieces(&list, size, most);
            assert_eq!(pieces.concat(), list);
            pieces.len()
        };
        assert_eq!(count(200, None, 1000), 200);
        assert_eq!(count(200, Some(10), 1000), 20);
        assert_eq!(count(201, Some(10), 1000), 21);
        assert_eq!(count(5000, None, 1000), 1000);
        assert_eq!(count(5001, Some(2), 1000), 834);
        assert_eq!(count(0, None, 1000), 0);
    }
}

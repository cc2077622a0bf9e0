//! Pairs the scenes below a folder with the files that are made of them.

use std::collections::HashMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use ivcam_base::diag::{Diagnostic, Result, Sink, counted};
use ivcam_base::platform::real_path;
use ivcam_render::scene::check::{scene_files, without_ending};

use super::names::name_of;

/// A scene and the file that is made of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Job {
    /// The path of the scene.
    pub input: PathBuf,
    /// The path of the scene below the folder of scenes, as [`name_of`] writes it.
    pub name: String,
    /// The path of the file to make.
    pub output: PathBuf,
}

/// How an output is named after its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Naming {
    /// The ending of the scene's name is replaced, as in `a.png` for `a.iv`.
    ///
    /// Scenes of one folder that differ only in their endings would become the same file. These
    /// keep their endings: `a.iv` and `a.wrl` become `a.iv.png` and `a.wrl.png`.
    Short,
    /// The ending of the scene's name is kept, as in `a.iv.png`.
    Full,
}

/// The scenes below a folder, in the order of their paths.
#[derive(Debug)]
pub(crate) struct Jobs {
    /// One job for each scene.
    pub list: Vec<Job>,
    /// The number of jobs whose output keeps the ending of the scene's name, as in `a.iv.png`,
    /// because another scene differs from it only in the ending.
    pub renamed: usize,
    /// Warnings about files that are not read and about names.
    pub sink: Sink,
}

impl Jobs {
    /// Finds the scenes below `folder`. Each becomes a file with its name and `ending` (without a
    /// dot) at the same place below `out`. Scenes below `out` are not read: an earlier run may have
    /// written them.
    ///
    /// # Errors
    /// Returns an error if `out` is the folder itself, or if there are no scenes.
    pub(crate) fn find(folder: &Path, out: &Path, ending: &str, naming: Naming) -> Result<Self> {
        if is_below(out, folder) && is_below(folder, out) {
            let text = format!("`{}` is the folder that is read", out.display());
            return Err(Diagnostic::error(text).with_help("name another folder with `-o`"));
        }
        let mut sink = Sink::new();
        let mut inputs = scene_files(&[&folder.to_path_buf()], &mut sink)?;
        if is_below(out, folder) {
            let found = inputs.len();
            inputs.retain(|input| !is_below(input, out));
            let mut text = format!(
                "the output folder `{}` is inside `{}`",
                out.display(),
                folder.display()
            );
            if found > inputs.len() {
                let scenes = counted(found - inputs.len(), "scene");
                text += &format!("; {scenes} in it left out");
            }
            let help = "an output folder beside the archive leaves the archive unchanged";
            sink.add(*Diagnostic::warning(text).with_help(help));
        }
        if inputs.is_empty() {
            let text = format!("no scene files below `{}`", folder.display());
            return Err(Diagnostic::not_found(text));
        }
        let mut list: Vec<Job> = inputs
            .into_iter()
            .map(|input| {
                let inside = input.strip_prefix(folder).unwrap_or(&input);
                let name = name_of(inside);
                let output = out.join(with_ending(inside, ending, naming));
                Job {
                    name,
                    output,
                    input,
                }
            })
            .collect();
        let renamed = match naming {
            Naming::Short => separate(&mut list, folder, out, ending, &mut sink),
            Naming::Full => 0,
        };
        Ok(Self {
            list,
            renamed,
            sink,
        })
    }
}

/// Gives the jobs that share an output the full names of their scenes. Returns their number.
///
/// A full name can equal the short name of another job (`a.iv` and `a.iv.gz.iv`), so this repeats
/// until all outputs differ. Each round gives at least one job its full name, and full names
/// differ. Names that differ only in case count as one, for disks that do not distinguish them.
fn separate(list: &mut [Job], folder: &Path, out: &Path, ending: &str, sink: &mut Sink) -> usize {
    let mut is_full = vec![false; list.len()];
    loop {
        let mut same: HashMap<String, Vec<usize>> = HashMap::new();
        for (i, job) in list.iter().enumerate() {
            let key = name_of(&job.output).to_lowercase();
            same.entry(key).or_default().push(i);
        }
        let mut groups: Vec<Vec<usize>> = same
            .into_values()
            .filter(|group| group.len() > 1 && group.iter().any(|&i| !is_full[i]))
            .collect();
        if groups.is_empty() {
            return is_full.iter().filter(|full| **full).count();
        }
        groups.sort();
        for group in groups {
            let names: Vec<String> = group.iter().map(|&i| list[i].name.clone()).collect();
            for i in group {
                let inside = list[i].input.strip_prefix(folder).unwrap_or(&list[i].input);
                list[i].output = out.join(with_ending(inside, ending, Naming::Full));
                is_full[i] = true;
            }
            let text = format!(
                "`{}` would become the same file; they keep their endings, as in `{}.{ending}`",
                names.join("` and `"),
                names[0]
            );
            sink.add(*Diagnostic::warning(text));
        }
    }
}

/// Returns a scene's path with another ending in place of the scene's own, or behind it.
fn with_ending(path: &Path, ending: &str, naming: Naming) -> PathBuf {
    let file = path.file_name().unwrap_or_default();
    let mut name = match file.to_str() {
        Some(text) if naming == Naming::Short => OsString::from(without_ending(text)),
        _ => file.to_os_string(),
    };
    name.push(".");
    name.push(ending);
    path.with_file_name(name)
}

/// Returns whether a path lies below a folder, or is that folder. The path need not exist.
pub(crate) fn is_below(path: &Path, folder: &Path) -> bool {
    match real_path(folder) {
        Ok(folder) => real(path).starts_with(folder),
        Err(_) => false,
    }
}

/// Returns the canonical path, with the parts that do not exist yet as they are written.
fn real(path: &Path) -> PathBuf {
    let start = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let found = start.ancestors().find_map(|above| {
        let real = real_path(above).ok()?;
        let rest = start.strip_prefix(above).ok()?;
        Some(real.join(rest))
    });
    found.unwrap_or(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the jobs for some files below `in`, with outputs below `out`, and the warnings.
    fn jobs(name: &str, files: &[&str], out: &str) -> Result<(Vec<String>, usize, Vec<String>)> {
        let top = std::env::temp_dir().join(format!("ivcam-jobs-{}-{name}", std::process::id()));
        for file in files {
            let path = top.join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "#Inventor V2.1 ascii\n").unwrap();
        }
        let found = Jobs::find(&top.join("in"), &top.join(out), "png", Naming::Short);
        std::fs::remove_dir_all(&top).unwrap();
        found.map(|jobs| {
            let below = |path: &Path| path.strip_prefix(&top).unwrap().display().to_string();
            let list = jobs.list.iter().map(|job| below(&job.output));
            let said = jobs.sink.items().iter().map(|d| d.message.clone());
            (list.collect(), jobs.renamed, said.collect())
        })
    }

    #[test]
    fn the_tree_and_the_names_are_kept() {
        let files = ["in/b/c.wrl.gz", "in/a.iv", "in/b/d.e.IV", "in/f.txt"];
        let (list, renamed, said) = jobs("tree", &files, "out").unwrap();
        assert_eq!(list, ["out/a.png", "out/b/c.png", "out/b/d.e.png"]);
        assert_eq!((renamed, said.len()), (0, 0));
    }

    #[test]
    fn scenes_that_would_become_one_file_keep_their_endings() {
        let files = [
            "in/a.iv",
            "in/a.wrl",
            "in/a.iv.iv",
            "in/b/a.iv",
            "in/A.gz.iv",
        ];
        let (list, renamed, said) = jobs("same", &files, "out").unwrap();
        let expected = [
            "out/A.gz.png",
            "out/a.iv.png",
            "out/a.iv.iv.png",
            "out/a.wrl.png",
            "out/b/a.png",
        ];
        assert_eq!(list, expected);
        assert_eq!((renamed, said.len()), (3, 2), "{said:?}");
    }

    #[test]
    fn an_output_folder_inside_the_input_is_not_read() {
        let files = ["in/a.iv", "in/out/old.iv"];
        let (list, _, said) = jobs("inside", &files, "in/out").unwrap();
        assert_eq!(list, ["in/out/a.png"]);
        assert!(said[0].ends_with("; 1 scene in it left out"), "{said:?}");
        for out in ["in", "in/../in", "in/b/.."] {
            let error = jobs("itself", &["in/a.iv", "in/b/b.iv"], out).unwrap_err();
            assert!(error.message.contains("is the folder that is read"));
        }
        assert!(jobs("only", &["in/out/old.iv"], "in/out").is_err());
    }
}

//! Guards files: no output of a command replaces one of its inputs, or another of its outputs.

use std::io::{BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Arg, ArgMatches, Command};
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_base::files::{NameClaim, check_space, is_output_closed};
use ivcam_base::platform::temporary_folder;
use ivcam_optics::film::Resolution;
use ivcam_optics::picture::{
    Depth, Heading, Picture, PictureFormat, RowSource, save_rows, write_png_rows,
};

use super::{compares_folder, folder_of_scenes, is_given, print_diagnostic};
use crate::photo::free_name;
use crate::photo::output_files::{files_in, is_same_file, overwritten_input, writable};

/// The arguments that name a file to write, in whichever command has them.
const OUTPUTS: [&str; 15] = [
    "output",
    "checkpoint",
    "report",
    "aov",
    "write-camera",
    "sheet",
    "difference",
    "fit",
    "csv",
    "json",
    "svg",
    "write",
    "diagram",
    "psf",
    "as-scene",
];

/// The switch that lets an output replace an input, in the commands that have it.
pub(crate) const FORCE: &str = "force";

/// Checks all files that the words of a command name, before the command starts.
///
/// Every value that is the name of an existing file counts as an input, whatever its argument
/// means by it. So a new option is covered from its first day; a wrong alarm costs another name.
///
/// # Errors
/// Fails if an output is also an input or another output, is a folder, or has no folder to be in.
pub(crate) fn check(command: &Command, matches: &ArgMatches) -> Result<()> {
    let named = |arg: &Arg| values(arg, matches);
    let takes_values = |arg: &&Arg| arg.get_action().takes_values();
    let (outputs, others): (Vec<&Arg>, Vec<&Arg>) = command
        .get_arguments()
        .filter(takes_values)
        .partition(|arg| OUTPUTS.contains(&arg.get_id().as_str()));
    refuse_streams(&outputs, matches)?;
    // The output of a folder of scenes or pictures is a folder, which need not exist.
    let is_folder = folder_of_scenes(matches).is_some()
        || compares_folder(matches)
        || command.get_name() == "gallery";
    let outputs: Vec<(String, PathBuf)> = outputs
        .into_iter()
        .filter(|arg| !is_folder || arg.get_id() != "output")
        .flat_map(named)
        .collect();
    let inputs: Vec<PathBuf> = others
        .into_iter()
        .flat_map(named)
        .flat_map(|(_, path)| files_in(&path))
        .collect();
    for (_, path) in outputs.iter().filter(|(option, _)| option == "--report") {
        // The files that the scenes of a folder use are not known yet.
        let is_json = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("json"));
        if is_folder && path.exists() && !path.is_dir() && !is_json {
            let text = format!("`{}` exists and is not a JSON file", path.display());
            return Err(
                Diagnostic::error(text).with_help("give `--report` a name that ends in .json")
            );
        }
    }
    match is_forced(matches) {
        true => check_outputs(&outputs, &[]),
        false => check_outputs(&outputs, &inputs),
    }
}

/// Checks files to write, each with the option that names it, before the work that fills them.
///
/// # Errors
/// Fails if an output is also an input or another output, is a folder, or has no folder to be in.
pub fn check_outputs(outputs: &[(String, PathBuf)], inputs: &[PathBuf]) -> Result<()> {
    for (i, (option, path)) in outputs.iter().enumerate() {
        writable(path)?;
        keep_inputs(option, path, inputs)?;
        if let Some((other, _)) = outputs[..i].iter().find(|(_, p)| is_same_file(p, path)) {
            return Err(Diagnostic::error(format!(
                "`{other}` and `{option}` write to the same file"
            ))
            .in_file(path.display().to_string())
            .with_help(format!("give `{option}` another name")));
        }
    }
    Ok(())
}

/// Refuses `-` for the outputs that cannot be a stream: all but `--output`, so that there is one
/// stream at most.
fn refuse_streams(outputs: &[&Arg], matches: &ArgMatches) -> Result<()> {
    let is_stream = |id: &str| {
        let mut raw = matches.get_raw(id).into_iter().flatten();
        id != "output" && is_given(matches, id) && raw.any(|word| word == "-")
    };
    let mut names = outputs.iter().map(|arg| arg.get_id().as_str());
    match names.find(|id| is_stream(id)) {
        None => Ok(()),
        Some(id) => Err(Diagnostic::unsupported(format!(
            "`--{id} -`: it can't be written to standard output"
        ))
        .with_help("give the name of a file")),
    }
}

/// Refuses to write to a file that the command has read.
///
/// # Errors
/// Fails if `path` is one of the inputs under any name: a link, or another spelling.
pub fn keep_inputs(option: &str, path: &Path, inputs: &[PathBuf]) -> Result<()> {
    let Some(input) = overwritten_input(path, inputs) else {
        return Ok(());
    };
    let (input, path) = (input.display(), path.display());
    let help = match option {
        "--output" => "give `-o` another name".to_owned(),
        _ => format!("give `{option}` another name"),
    };
    Err(Diagnostic::error(format!(
        "`{option} {path}` would overwrite the input `{input}`"
    ))
    .with_help(help))
}

/// Returns whether `--force` was given to a command that has it.
pub(crate) fn is_forced(matches: &ArgMatches) -> bool {
    let given = matches.try_get_one::<bool>(FORCE);
    given.ok().flatten().copied().unwrap_or_default()
}

/// Checks an option's picture file, or `-` for standard output.
///
/// # Errors
/// Fails if the ending is unknown, or standard output is a terminal.
pub(crate) fn picture_format(output: &Path) -> Result<PictureFormat> {
    if !is_standard_stream(output) {
        return PictureFormat::of(output);
    }
    if is_output_closed() {
        return Err(Diagnostic::error("standard output is closed")
            .with_help("name the picture's file with `-o`"));
    }
    if std::io::stdout().is_terminal() {
        return Err(
            Diagnostic::error("standard output is a terminal, not a file or a pipe")
                .with_help("redirect it, as in `-o - > picture.png`"),
        );
    }
    Ok(PictureFormat::Png)
}

/// Checks that a picture's file has room on its disk, and prints a warning if it may not fit.
/// `files` is the number of files of this size that are made in the folder or under the name.
///
/// # Errors
/// Fails if the free space is less than the least size of the files.
pub(crate) fn check_picture_space(
    output: &Path,
    format: PictureFormat,
    (resolution, depth): (Resolution, Depth),
    files: u64,
) -> Result<()> {
    if is_standard_stream(output) {
        return Ok(());
    }
    let size = format.size(resolution, depth).times(files);
    if let Some(warning) = check_space(output, size)? {
        print_diagnostic(&warning);
    }
    Ok(())
}

/// Writes a picture to its file, or to standard output as PNG if the file is `-`. If the file
/// cannot be written, the exposures are kept as an EXR in another folder, so that a long render is
/// not lost.
///
/// # Errors
/// Fails if the file cannot be written. The message names the file that has the exposures instead.
pub(crate) fn save_picture(picture: &Picture, output: &Path, depth: Depth) -> Result<()> {
    if is_standard_stream(output) {
        let mut out = BufWriter::new(std::io::stdout().lock());
        let result = picture.write(PictureFormat::Png, depth, &mut out);
        return super::exit_code(result.and_then(|()| out.flush())).map(|_| ());
    }
    let result = picture.save(output, depth);
    result.map_err(|error| match keep_exposures(picture, output) {
        Some(kept) => error.with_help(format!(
            "the exposures were kept: `ivcam expose {} -o OUTPUT` makes a picture of them",
            kept.display()
        )),
        None => error,
    })
}

/// Writes a picture to its file, or to standard output as PNG if the file is `-`, while its rows
/// are made.
///
/// # Errors
/// Fails if the file cannot be written, or if its format cannot be written by rows.
pub(crate) fn save_picture_rows(
    output: &Path,
    depth: Depth,
    heading: &Heading,
    rows: &mut dyn RowSource,
) -> Result<()> {
    if !is_standard_stream(output) {
        return save_rows(output, depth, heading, rows);
    }
    let mut out = BufWriter::new(std::io::stdout().lock());
    let result = write_png_rows(heading, depth, rows, &mut out);
    super::exit_code(result.and_then(|()| out.flush())).map(|_| ())
}

/// Writes the exposures of a picture whose file cannot be written as an EXR: to the folder for
/// temporary files, else to the current folder, else to the user's home. Returns the file, if one
/// could be written.
fn keep_exposures(picture: &Picture, output: &Path) -> Option<PathBuf> {
    let name = Path::new(output.file_stem().unwrap_or_default()).with_extension("exr");
    let folders = [
        temporary_folder(),
        std::env::current_dir().ok(),
        std::env::home_dir(),
    ];
    folders.into_iter().flatten().find_map(|folder| {
        let file = free_name(&folder.join(&name), |p| p.symlink_metadata().is_ok());
        picture.save(&file, Depth::Eight).ok().map(|()| file)
    })
}

/// Returns the first of `name.png`, `name-2.png`, … that does not exist and that no other process
/// has claimed, with the claim. Where no file can be created there is none, and writing fails
/// later.
pub(crate) fn claimed_name(path: &Path) -> (PathBuf, Option<NameClaim>) {
    let mut claim = None;
    let exists = |path: &Path| path.symlink_metadata().is_ok();
    let name = free_name(path, |path| {
        claim = None;
        if exists(path) {
            return true;
        }
        match NameClaim::take(path) {
            Ok(None) => return true,
            Ok(taken) => claim = taken,
            Err(_) => {}
        }
        // Another process may have written the file and ended before the claim.
        exists(path)
    });
    (name, claim)
}

/// Returns whether a name stands for standard input or output.
pub(crate) fn is_standard_stream(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Returns the values that the user gave to an argument, each with the argument's spelling.
fn values(arg: &Arg, matches: &ArgMatches) -> Vec<(String, PathBuf)> {
    let id = arg.get_id().as_str();
    if !is_given(matches, id) {
        return Vec::new();
    }
    let raw = matches.get_raw(id).into_iter().flatten();
    raw.filter(|word| *word != "-")
        .map(|word| (format!("--{id}"), PathBuf::from(word)))
        .collect()
}

//! Denoising by another program: Intel Open Image Denoise's `oidnDenoise`, or one that takes the
//! same arguments.
//!
//! Color, albedo and normals are passed as PFM files in a temporary folder. What comes back is a
//! picture whose error nobody can state: a denoiser trades noise for bias.

use std::hash::{BuildHasher, RandomState};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use glam::DVec3;
use ivcam_base::diag::{Diagnostic, Result};
use ivcam_optics::film::ErrorUnknown;
use ivcam_optics::picture::Picture;
use ivcam_render::render::report::stated_error;
use ivcam_render::render::{Exposure, SurfaceSum};

use super::session::Session;

/// The program that denoises.
#[derive(Clone, Debug)]
pub(crate) struct Denoiser {
    program: PathBuf,
}

impl Denoiser {
    /// Returns the denoiser that a path or a name on the `PATH` stands for.
    ///
    /// # Errors
    /// Returns an error if it cannot be run.
    pub(crate) fn find(program: &Path) -> Result<Self> {
        let asked = Command::new(program)
            .arg("--help")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        let program = program.to_path_buf();
        match asked {
            Ok(_) => Ok(Self { program }),
            Err(error) => {
                let (program, kind) = (program.display(), error.kind());
                let message = format!("the denoiser `{program}` cannot be run: {kind}");
                Err(Diagnostic::not_found(message).with_help(
                    "install Intel Open Image Denoise, or name its program, as in \
                     `--denoise=/opt/oidn/bin/oidnDenoise`",
                ))
            }
        }
    }

    /// Returns the program as it was given.
    pub(crate) fn name(&self) -> String {
        self.program.display().to_string()
    }

    /// Denoises the pixels of a picture by its surfaces.
    ///
    /// Albedo and normals are as noisy as the picture where it is out of focus, so they are
    /// denoised first. The error of the living room at 4 samples is 5.6%. Denoised with noisy
    /// albedo and normals it is 4.9%, with clean ones 3.6% (`docs/accuracy.md`).
    ///
    /// # Errors
    /// Returns an error if a file cannot be written, if the program fails, or if it writes no
    /// picture of the same size with finite values.
    fn denoise(&self, picture: &Picture, surfaces: &[SurfaceSum]) -> Result<Vec<[f32; 3]>> {
        let folder = TemporaryFolder::new()?;
        let size = [picture.width, picture.height];
        let mean = |sum: fn(&SurfaceSum) -> DVec3| -> Vec<[f32; 3]> {
            // What passes every surface has no albedo and no normal, like a black background.
            let mean = |s: &SurfaceSum| sum(s) / f64::from(s.passed.max(1));
            let means = surfaces.iter().map(|s| mean(s).as_vec3().to_array());
            means.collect()
        };
        let [color, output] = ["color", "output"].map(|name| folder.file(name));
        write_pfm(&color, size, &picture.pixels)?;
        let clean = |option: &str, name: &str, pixels: &[[f32; 3]]| {
            let [noisy, clean] =
                [name.to_owned(), format!("{name}-clean")].map(|n| folder.file(&n));
            write_pfm(&noisy, size, pixels)?;
            self.run(&[(option, &noisy)], &clean).map(|()| clean)
        };
        let albedo = clean("--alb", "albedo", &mean(|s| s.albedo))?;
        let normal = clean("--nrm", "normal", &mean(|s| s.normal))?;
        let inputs = [("--hdr", &color), ("--alb", &albedo), ("--nrm", &normal)];
        self.run(&inputs, &output)?;
        read_pfm(&output, size).ok_or_else(|| {
            let [width, height] = size;
            let name = self.name();
            Diagnostic::error(format!(
                "the denoiser `{name}` wrote no picture of {width}x{height} pixels"
            ))
        })
    }

    /// Runs the program with input files, each after its option. If there are several, the first
    /// is denoised and the others guide it without noise of their own.
    fn run(&self, inputs: &[(&str, &PathBuf)], output: &Path) -> Result<()> {
        let mut command = Command::new(&self.program);
        for (option, file) in inputs {
            command.arg(option).arg(file);
        }
        if inputs.len() > 1 {
            command.arg("--clean_aux");
        }
        command.args(["--threads", &rayon::current_num_threads().to_string()]);
        command.arg("--output").arg(output).stdin(Stdio::null());
        let run = command.output();
        let run = run.map_err(|e| Diagnostic::io(self.program.display(), &e))?;
        if run.status.success() {
            return Ok(());
        }
        let said = [run.stdout, run.stderr].map(|s| String::from_utf8_lossy(&s).into_owned());
        let mut lines = said.iter().flat_map(|text| text.lines()).rev();
        let last = lines.find(|line| !line.trim().is_empty());
        let (name, reason) = (self.name(), last.unwrap_or("no reason given").trim());
        let message = format!("the denoiser `{name}` failed: {reason}");
        Err(Diagnostic::error(message))
    }
}

impl Session {
    /// Returns a picture after denoising. Its metadata names the denoiser and states no error.
    /// Uses rayon's current pool.
    ///
    /// # Errors
    /// Returns an error if the denoiser fails.
    pub(crate) fn denoised(
        &self,
        picture: &Picture,
        surfaces: &[SurfaceSum],
        denoiser: &Denoiser,
    ) -> Result<Picture> {
        let mut clean = Picture {
            pixels: denoiser.denoise(picture, surfaces)?,
            ..picture.clone()
        };
        let error = stated_error(Err(ErrorUnknown::Denoised));
        clean.provenance.insert("ivcam:error".into(), error);
        let name = denoiser.name();
        clean.provenance.insert("ivcam:denoise".into(), name);
        Ok(clean)
    }

    /// Returns the picture of an exposure after denoising; or, if the denoiser fails, the picture
    /// itself and why.
    pub(crate) fn denoised_or_kept(
        &self,
        picture: Picture,
        exposure: &Exposure,
        denoiser: &Denoiser,
    ) -> (Picture, Result<()>) {
        match self.denoised(&picture, &self.surfaces_of(exposure), denoiser) {
            Ok(clean) => (clean, Ok(())),
            Err(error) => (picture, Err(error)),
        }
    }
}

/// A folder for temporary files, which is removed when it is dropped.
struct TemporaryFolder(PathBuf);

impl TemporaryFolder {
    fn new() -> Result<Self> {
        let random = RandomState::new().hash_one(std::process::id());
        let path = std::env::temp_dir().join(format!("ivcam-denoise-{random:016x}"));
        match std::fs::create_dir(&path) {
            Ok(()) => Ok(Self(path)),
            Err(error) => Err(Diagnostic::io(path.display(), &error)),
        }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name).with_extension("pfm")
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Writes pixels, with rows from the top, as a PFM file, whose rows go from the bottom up.
fn write_pfm(path: &Path, [width, height]: [u32; 2], pixels: &[[f32; 3]]) -> Result<()> {
    let write = || {
        let mut file = std::io::BufWriter::new(std::fs::File::create_new(path)?);
        write!(file, "PF\n{width} {height}\n-1.0\n")?;
        for row in pixels.chunks(width as usize).rev() {
            for value in row.as_flattened() {
                file.write_all(&value.to_le_bytes())?;
            }
        }
        file.flush()
    };
    write().map_err(|e: std::io::Error| Diagnostic::io(path.display(), &e))
}

/// Reads a PFM file of three channels in little-endian order. Returns its pixels with rows from the
/// top; `None` if there is no such file of this size, or if a value is not finite.
fn read_pfm(path: &Path, [width, height]: [u32; 2]) -> Option<Vec<[f32; 3]>> {
    let bytes = std::fs::read(path).ok()?;
    let size = width as usize * height as usize * 12;
    let (header, values) = bytes.split_at_checked(bytes.len().checked_sub(size)?)?;
    let mut words = std::str::from_utf8(header).ok()?.split_ascii_whitespace();
    let is_color = words.next()? == "PF";
    let sides: [u32; 2] = [words.next()?.parse().ok()?, words.next()?.parse().ok()?];
    let scale: f32 = words.next()?.parse().ok()?;
    if !is_color || sides != [width, height] || scale >= 0.0 || words.next().is_some() {
        return None;
    }
    let (values, _) = values.as_chunks::<4>();
    let values: Vec<f32> = values.iter().map(|v| f32::from_le_bytes(*v)).collect();
    let (pixels, _) = values.as_chunks::<3>();
    let rows = pixels.chunks(width as usize).rev();
    let is_finite = values.iter().all(|v| v.is_finite());
    is_finite.then(|| rows.flatten().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_written_from_the_last_row_to_the_first_and_come_back() {
        let folder = TemporaryFolder::new().unwrap();
        let path = folder.0.join("a.pfm");
        let pixels = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.5]];
        write_pfm(&path, [1, 2], &pixels).unwrap();
        let mut expected = b"PF\n1 2\n-1.0\n".to_vec();
        for value in [4.0f32, 5.0, 6.5, 1.0, 2.0, 3.0] {
            expected.extend(value.to_le_bytes());
        }
        assert_eq!(std::fs::read(&path).unwrap(), expected);
        assert_eq!(read_pfm(&path, [1, 2]).unwrap(), pixels);
        assert_eq!(read_pfm(&path, [2, 1]), None);
        assert_eq!(read_pfm(&path, [1, 3]), None);
        let other = folder.0.join("b.pfm");
        for pixel in [[f32::NAN; 3], [f32::INFINITY; 3]] {
            write_pfm(&other, [1, 1], &[pixel]).unwrap();
            assert_eq!(read_pfm(&other, [1, 1]), None);
            std::fs::remove_file(&other).unwrap();
        }
        let parent = folder.0.clone();
        drop(folder);
        assert!(!parent.exists());
    }
}

//! Films: through ffmpeg if available, otherwise as animated PNG.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};

use crate::error::PictureError;
use crate::picture::{Picture, coding};

/// Returns true if ffmpeg is installed, which makes films.
pub fn ffmpeg() -> bool {
    let mut command = Command::new("ffmpeg");
    command.arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// A film that ffmpeg makes (H.264, plays everywhere), as long as pictures come.
#[derive(Debug)]
pub struct Film {
    path: PathBuf,
    child: Child,
    input: Option<ChildStdin>,
}

impl Film {
    /// Starts a film with `rate` pictures a second, all of one size.
    ///
    /// # Errors
    /// If ffmpeg doesn't start.
    pub fn start(path: &Path, [width, height]: [u32; 2], rate: f64) -> Result<Self, PictureError> {
        let mut command = Command::new("ffmpeg");
        command.args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-s", &format!("{width}x{height}"), "-r", &rate.to_string(), "-i", "-"]);
        // H.264 takes even sizes only: an odd one loses its last row or column.
        command.args(["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-c:v", "libx264", "-pix_fmt", "yuv420p"]);
        command.args(["-crf", "18", "-movflags", "+faststart"]).arg(path);
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let failed = |reason: String| PictureError::Ffmpeg { path: path.to_owned(), reason };
        let mut child = command.spawn().map_err(|error| failed(error.to_string()))?;
        let input = child.stdin.take();
        Ok(Self { path: path.to_owned(), child, input })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// If ffmpeg has ended; [`Self::finish`] gives the reason.
    pub fn add(&mut self, picture: &Picture) -> Result<(), PictureError> {
        let written = self.input.as_mut().is_some_and(|input| input.write_all(&picture.rgb()).is_ok());
        if written {
            return Ok(());
        }
        self.input = None;
        Err(self.end().err().unwrap_or_else(|| self.failed("it accepts no more pictures".into())))
    }

    /// Ends the film.
    ///
    /// # Errors
    /// If ffmpeg failed.
    pub fn finish(mut self) -> Result<(), PictureError> {
        self.input = None;
        self.end()
    }

    fn failed(&self, reason: String) -> PictureError {
        PictureError::Ffmpeg { path: self.path.clone(), reason }
    }

    fn end(&mut self) -> Result<(), PictureError> {
        let mut said = String::new();
        if let Some(mut errors) = self.child.stderr.take() {
            // Its output is lost only if it is not text.
            let _ = std::io::Read::read_to_string(&mut errors, &mut said);
        }
        let status = self.child.wait().map_err(|error| self.failed(error.to_string()))?;
        if status.success() {
            return Ok(());
        }
        let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("no error message");
        Err(self.failed(last.to_owned()))
    }
}

/// An animated PNG, which browsers play.
pub struct AnimatedPng {
    path: PathBuf,
    writer: png::Writer<BufWriter<File>>,
}

impl AnimatedPng {
    /// Starts a film with a number of pictures and a frame rate, all of one size.
    ///
    /// # Errors
    /// If the file can't be written, or there are no pictures.
    pub fn start(
        path: &Path,
        [width, height]: [u32; 2],
        count: u32,
        rate: f64,
    ) -> Result<Self, PictureError> {
        let failed =
            |error: std::io::Error| PictureError::Write { path: path.to_owned(), reason: error.to_string() };
        let file = File::create(path).map_err(failed)?;
        let mut encoder = png::Encoder::new(BufWriter::new(file), width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_animated(count, 0).map_err(coding)?;
        encoder.set_frame_delay((1000.0 / rate).round().clamp(1.0, 65_535.0) as u16, 1000).map_err(coding)?;
        let writer = encoder.write_header().map_err(coding)?;
        Ok(Self { path: path.to_owned(), writer })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// If it can't be written.
    pub fn add(&mut self, picture: &Picture) -> Result<(), PictureError> {
        self.writer.write_image_data(&picture.rgb()).map_err(|error| self.failed(&error))
    }

    /// Ends the film.
    ///
    /// # Errors
    /// If it can't be written, or has fewer pictures than it was started with.
    pub fn finish(self) -> Result<(), PictureError> {
        let path = self.path;
        self.writer.finish().map_err(|error| PictureError::Write { path, reason: error.to_string() })
    }

    fn failed(&self, error: &png::EncodingError) -> PictureError {
        PictureError::Write { path: self.path.clone(), reason: error.to_string() }
    }
}

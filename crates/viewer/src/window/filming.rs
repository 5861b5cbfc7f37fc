//! A film of the picture as it is played: ten pictures a second, half as wide and high, as an animated PNG
//! beside the scene.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use pliant_picture::{AnimatedPng, Picture, PictureError};

use super::App;
use super::keep::Taking;
use super::told::Told;
use crate::beside::create_beside;

/// Wall time between pictures, and the length of the longest film.
const BETWEEN: Duration = Duration::from_millis(100);
const LONGEST: Duration = Duration::from_secs(30);

/// A film that is taken, or written.
#[derive(Default)]
pub(super) struct Filming {
    taking: Taking,
    /// Wall times of the start and of the last request for a picture.
    since: Option<[Instant; 2]>,
    pub pictures: Vec<Picture>,
    written: Option<Receiver<Told>>,
}

impl Filming {
    /// True if a film is being recorded.
    pub fn is_on(&self) -> bool {
        self.since.is_some()
    }
}

impl App {
    /// Begins a film, or ends and writes it.
    pub(super) fn film(&mut self) {
        let now = Instant::now();
        let Some([since, _]) = self.filming.since.take() else {
            self.filming = Filming { since: Some([now, now - BETWEEN]), ..Filming::default() };
            self.message = Some(Told::hint("recording a film: *Film* or V ends it"));
            return;
        };
        let pictures = std::mem::take(&mut self.filming.pictures);
        let rate = pictures.len() as f64 / now.duration_since(since).as_secs_f64().max(1e-3);
        let (send, receive) = channel();
        let (scene, context) = (self.file.clone(), self.context.clone());
        std::thread::spawn(move || {
            let message = match write(&scene, &pictures, rate.clamp(1.0, 60.0)) {
                Ok(path) => Told::done(format!("`{}` was written", path.display())),
                Err(reason) => Told::failure(format!("no film was written: {reason}")),
            };
            // The window may be closed by now.
            let _ = send.send(message);
            context.request_repaint();
        });
        self.filming.written = Some(receive);
        self.message = Some(Told::hint("writing the film …"));
    }

    /// Takes the next picture of a film when it is due.
    pub(super) fn go_on_filming(&mut self) {
        if let Some(message) = self.filming.written.as_ref().and_then(|written| written.try_recv().ok()) {
            self.filming.written = None;
            self.message = Some(message);
        }
        let Filming { taking, since: Some([since, last]), pictures, .. } = &mut self.filming else { return };
        if let Some(picture) = taking.picture(&self.context, self.port.rect) {
            let picture = halved(&picture);
            // A film has one size: pictures of another window are left out.
            let first =
                pictures.first().map_or([picture.width, picture.height], |one| [one.width, one.height]);
            pictures.extend((first == [picture.width, picture.height]).then_some(picture));
        }
        if last.elapsed() >= BETWEEN {
            *last = Instant::now();
            taking.ask(&self.context);
        }
        self.context.request_repaint_after(BETWEEN / 2);
        if since.elapsed() > LONGEST {
            self.film();
        }
    }
}

/// Half as wide and high: the mean of each four pixels.
fn halved(picture: &Picture) -> Picture {
    let (width, height) = (picture.width / 2, picture.height / 2);
    let at = |x: u32, y: u32, c: u32| u16::from(picture.rgba[(4 * (y * picture.width + x) + c) as usize]);
    let mean = |x: u32, y: u32, c: u32| {
        ((at(x, y, c) + at(x + 1, y, c) + at(x, y + 1, c) + at(x + 1, y + 1, c)) / 4) as u8
    };
    let pixel = |x: u32, y: u32| (0..4).map(move |c| (x, y, c));
    let places = (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(2 * x, 2 * y)));
    Picture { width, height, rgba: places.map(|(x, y, c)| mean(x, y, c)).collect() }
}

fn write(scene: &Path, pictures: &[Picture], rate: f64) -> Result<PathBuf, String> {
    let Some(first) = pictures.first() else { return Err("it has no pictures".into()) };
    let (path, _) = create_beside(scene, "film", "png").map_err(|error| error.to_string())?;
    let film = || -> Result<(), PictureError> {
        let size = [first.width, first.height];
        let mut film = AnimatedPng::start(&path, size, pictures.len() as u32, rate)?;
        pictures.iter().try_for_each(|picture| film.add(picture))?;
        film.finish()
    };
    film().map_err(|error| error.to_string())?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_are_half_as_wide_and_never_overwrite() {
        let picture = Picture { width: 5, height: 4, rgba: (0..80).collect() };
        let half = halved(&picture);
        assert_eq!((half.width, half.height, half.rgba.len()), (2, 2, 16));
        assert_eq!(half.rgba[..4], [12, 13, 14, 15], "the mean of pixels 0, 1, 5 and 6");
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("ball.toml");
        let films = [0, 1].map(|_| write(&scene, &[half.clone(), half.clone()], 10.0).unwrap());
        assert_eq!(films, ["ball-film.png", "ball-film-2.png"].map(|name| folder.path().join(name)));
        assert!(std::fs::read(&films[0]).unwrap().windows(4).any(|part| part == b"acTL"));
        assert!(write(&scene, &[], 10.0).is_err());
    }
}

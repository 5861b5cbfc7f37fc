//! `pliant view`: input of the window, and its final message.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use pliant_geometry::words::number;
use pliant_picture::Series;
use pliant_scene::World;
use pliant_viewer::{
    Break, FinishedRun, Lags, Opening, Recording, WindowError, open, open_finished, replay_in_real_time,
    replay_until,
};

use crate::SUCCESS;
use crate::arguments::View;
use crate::look::look_of;
use crate::prepare::prepare;
use crate::report::{Failure, say};
use crate::signals::{exit_code, stop};

impl From<WindowError> for Failure {
    fn from(error: WindowError) -> Self {
        Self::plain(&error, error.remedy())
    }
}

pub fn view(arguments: &View) -> Result<u8, Failure> {
    let began = Instant::now();
    if let Some(run) = finished_run(arguments)? {
        if let Some(summary) = open_finished(run)? {
            say(summary)?;
        }
        return Ok(SUCCESS);
    }
    if let Some(path) = &arguments.record {
        Recording::try_path(path).map_err(|error| {
            Failure::plain(
                format!("`{}` cannot be written: {error}", path.display()),
                "give a file in a folder that you can write, so that the recording is not lost",
            )
        })?;
    }
    let world = prepare(&arguments.scene, &arguments.overrides)?;
    for note in world.notes() {
        eprintln!("note: {note}");
    }
    if let Some(file) = &arguments.replay {
        return repeat(&world, file, arguments.real_time);
    }
    let overrides = arguments.overrides.clone();
    let read = move |path: &Path| {
        prepare(path, &overrides).map_err(|failure| match failure {
            Failure::Scene(errors) => errors.plain().to_string(),
            Failure::Output(error) => error.to_string(),
            Failure::Plain { message, .. } => message,
        })
    };
    let summary = open(Opening {
        look: look_of,
        file: pliant_format::scene_file(&arguments.scene),
        world,
        read: Arc::new(read),
        record: arguments.record.clone(),
        stop: stop().clone(),
        portrait: portrait(arguments),
        size: arguments.size,
        began,
    })?;
    if let Some(summary) = summary {
        say(summary)?;
    }
    Ok(if stop().is_asked() { exit_code() } else { SUCCESS })
}

/// A finished run: a folder with series of frames and no scene, or one of its series (`.pvd`).
fn finished_run(arguments: &View) -> Result<Option<FinishedRun>, Failure> {
    let path = &arguments.scene;
    let is_series = path.extension().is_some_and(|extension| extension == "pvd");
    let is_run = path.is_dir() && !path.join("scene.toml").exists() && Series::names(path).is_ok();
    if !is_series && !is_run {
        return Ok(None);
    }
    let options = [
        ("--record", arguments.record.is_some()),
        ("--replay", arguments.replay.is_some()),
        ("--set", !arguments.overrides.set.is_empty()),
    ];
    if let Some((option, _)) = options.into_iter().find(|(_, given)| *given) {
        return Err(Failure::plain(
            format!("`{}` is a finished run, and `{option}` is for scenes", path.display()),
            "leave it out, or give the scene",
        ));
    }
    let series = path.file_stem().filter(|_| is_series).map(|stem| stem.to_string_lossy().into_owned());
    let folder = if is_series { path.parent().unwrap_or(path) } else { path };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder }.to_owned();
    Ok(Some(FinishedRun { folder, series, portrait: portrait(arguments), size: arguments.size }))
}

/// Time at which the window takes a picture of itself, and the picture's file.
fn portrait(arguments: &View) -> Option<(f64, PathBuf)> {
    arguments.screenshot.clone().map(|file| (arguments.after, file))
}

/// Replays a recording without a window and prints the result; optionally also in real time, to measure the
/// input lag.
fn repeat(world: &World, file: &Path, real_time: bool) -> Result<u8, Failure> {
    let wrong = |error: &dyn std::fmt::Display| {
        Failure::plain(
            format!("`{}` is not a recording: {error}", file.display()),
            "`pliant view --record FILE` makes one",
        )
    };
    let bytes = std::fs::read(file).map_err(|error| wrong(&error))?;
    let recording = Recording::from_bytes(&bytes).map_err(|error| wrong(&error))?;
    match replay_until(world, &recording, stop()) {
        Ok(replayed) => {
            let mut summary = serde_json::to_value(&replayed).map_err(|error| wrong(&error))?;
            if real_time {
                let played = replay_in_real_time(world, &recording, stop());
                let played = played.map_err(|message| Failure::plain(message, ""))?;
                summary["input_lag"] =
                    serde_json::to_value(Lags::of(&played)).map_err(|error| wrong(&error))?;
            }
            say(summary)?;
            for Break { times: [broken, back], message } in &replayed.breaks {
                eprintln!(
                    "error: at t = {} s a pull broke the run, which then went back to t = {} s: {message}",
                    number(*broken),
                    number(*back)
                );
            }
            Ok(if replayed.breaks.is_empty() { SUCCESS } else { 1 })
        }
        Err(message) => {
            eprintln!("error: {message}");
            Ok(if stop().is_asked() { exit_code() } else { 1 })
        }
    }
}

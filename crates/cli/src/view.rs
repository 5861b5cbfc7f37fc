//! `pliant view`: input of the window, and its final message.

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use pliant_viewer::{
    Errand, Lags, Opening, Recording, Stage, WindowError, open, replay, replay_in_real_time,
};

use crate::arguments::{Overrides, View};
use crate::commands::prepare;
use crate::pictures::look_of;
use crate::report::{Failure, say};

impl From<WindowError> for Failure {
    fn from(error: WindowError) -> Self {
        Self::plain(&error, error.remedy())
    }
}

fn stage(path: &Path, overrides: &Overrides) -> Result<Stage, Failure> {
    let (scene, built, plan) = prepare(path, overrides)?;
    Ok(Stage { scene, built, plan })
}

pub fn view(arguments: &View) -> Result<ExitCode, Failure> {
    let stage_now = stage(&arguments.scene, &arguments.overrides)?;
    for note in stage_now.built.notes.iter().chain(&stage_now.plan.note).chain(&stage_now.plan.target.note) {
        eprintln!("note: {note}");
    }
    if let Some(file) = &arguments.replay {
        return repeat(&stage_now, file, arguments.real_time);
    }
    let look = look_of(&stage_now.scene);
    let overrides = arguments.overrides.clone();
    let read = move |path: &Path| {
        stage(path, &overrides).map_err(|failure| match failure {
            Failure::Scene(errors) => errors.plain().to_string(),
            Failure::Output(error) => error.to_string(),
            Failure::Plain { message, .. } => message,
        })
    };
    let told = open(Opening {
        style: look.style,
        camera: look.camera,
        file: pliant_scene::scene_file(&arguments.scene),
        stage: stage_now,
        read: Arc::new(read),
        record: arguments.record.clone(),
        errand: errand(arguments),
    })?;
    if let Some(told) = told {
        say(told)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The automatic task of the window.
fn errand(arguments: &View) -> Option<Errand> {
    let file = arguments.screenshot.clone();
    match file {
        _ if arguments.rehearse => Some(Errand::Rehearsal { file }),
        Some(file) => Some(Errand::Portrait { after: arguments.after, file }),
        None => None,
    }
}

/// Replays a recording without a window and prints the result; optionally also in real time, to measure the input lag.
fn repeat(stage: &Stage, file: &Path, real_time: bool) -> Result<ExitCode, Failure> {
    let wrong = |error: &dyn std::fmt::Display| {
        Failure::plain(
            format!("`{}` is not a recording: {error}", file.display()),
            "`pliant view --record FILE` makes one",
        )
    };
    let bytes = std::fs::read(file).map_err(|error| wrong(&error))?;
    let recording = Recording::from_bytes(&bytes).map_err(|error| wrong(&error))?;
    match replay(stage, &recording) {
        Ok(replayed) => {
            let mut told = serde_json::to_value(&replayed).map_err(|error| wrong(&error))?;
            if real_time {
                let played = replay_in_real_time(stage, &recording);
                let played = played.map_err(|message| Failure::plain(message, ""))?;
                told["input_lag"] = serde_json::to_value(Lags::of(&played)).map_err(|error| wrong(&error))?;
            }
            say(told)?;
            Ok(ExitCode::SUCCESS)
        }
        Err(message) => {
            eprintln!("error: {message}");
            Ok(ExitCode::from(1))
        }
    }
}

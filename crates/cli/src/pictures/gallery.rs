//! `pliant render`, also for all scenes: a page with a picture of each, and the pictures that a folder lists.
//! Pictures that do not fit their scenes are made anew. File times do not last, so each picture has a hash of
//! its scene and options.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use pliant_picture::Graphics;
use sha2::{Digest, Sha256};

use super::render::{claim, draw, film_kind, is_folder_of_run, run_scene, save};
use crate::SUCCESS;
use crate::arguments::{Arguments, Command, Render};
use crate::report::{Failure, say};
use crate::signals;

/// Draws the scene, run or file of a command line. For a folder of scenes it makes a page, or the pictures
/// that the folder lists.
pub fn render(arguments: &Render) -> Result<u8, Failure> {
    let film = arguments.film.as_deref().map(film_kind).transpose()?;
    if arguments.gallery {
        return renew(&arguments.what);
    }
    let scenes = scenes_in(&arguments.what);
    if scenes.is_empty() { draw(arguments, film) } else { page(arguments, &scenes) }
}

/// The list of pictures in a folder of scenes, and the hashes of their sources.
const LIST: &str = "gallery.txt";
const SUMS: &str = "gallery.sums";

/// A picture that a folder lists.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Entry {
    /// Its file, relative to the folder.
    file: String,
    /// The scene, relative to the folder, and options of `pliant render`.
    words: Vec<String>,
}

/// A line of the list: a file, a scene and options; `None` of a comment.
fn entry(line: &str) -> Option<Entry> {
    let mut words = line.split('#').next()?.split_whitespace().map(str::to_owned);
    Some(Entry { file: words.next()?, words: words.collect() })
}

/// The word before the folder, in the list, of pictures that the renderer is tested by: where these change,
/// it draws otherwise.
const LOOK: &str = "look";

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|error| Failure::plain(format!("`{}`: {error}", path.display()), "check the path"))
}

/// The pictures of the list, and a hash of how the renderer draws.
fn entries(folder: &Path) -> Result<(Vec<Entry>, Sha256), Failure> {
    let list = read(&folder.join(LIST))?;
    let lines = String::from_utf8_lossy(&list).lines().filter_map(entry).collect::<Vec<_>>();
    let (looks, entries): (Vec<_>, Vec<_>) = lines.into_iter().partition(|entry| entry.file == LOOK);
    let mut look = Sha256::new();
    for path in looks.iter().flat_map(|look| &look.words) {
        add_files(&mut look, &folder.join(path), &["md"])?;
    }
    Ok((entries, look))
}

/// Adds the files of a folder to a hash, without files of some endings.
fn add_files(hash: &mut Sha256, folder: &Path, without: &[&str]) -> Result<(), Failure> {
    let listed = fs::read_dir(folder).map_err(|error| {
        Failure::plain(format!("`{}`: {error}", folder.display()), format!("mend the list `{LIST}`"))
    })?;
    let mut files: Vec<PathBuf> =
        listed.flatten().map(|file| file.path()).filter(|path| path.is_file()).collect();
    files.retain(|path| {
        path.extension().and_then(|end| end.to_str()).is_none_or(|end| !without.contains(&end))
    });
    files.sort_unstable();
    for path in files {
        let content = read(&path)?;
        hash.update(format!("{} {}\0", path.file_name().unwrap_or_default().display(), content.len()));
        hash.update(content);
    }
    Ok(())
}

fn hex(hash: Sha256) -> String {
    hash.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

impl Entry {
    /// A hash of all that it is made of: how the renderer draws, options, and files of the scene but pictures
    /// and texts on it.
    fn source(&self, folder: &Path, look: &Sha256) -> Result<String, Failure> {
        let mut hash = look.clone();
        self.words.iter().for_each(|word| hash.update(format!("{word}\0")));
        add_files(&mut hash, &folder.join(self.words.first().map_or("", String::as_str)), &["md", "png"])?;
        Ok(hex(hash))
    }

    /// The command that makes it.
    fn command(&self, folder: &Path, out: &Path) -> Result<Render, Failure> {
        let file = folder.join(&self.file);
        let mut words = vec!["pliant".into(), "render".into(), folder.join(&self.words[0]).into_os_string()];
        for word in &self.words[1..] {
            words.push(word.into());
            if word == "--film" {
                words.push(file.clone().into_os_string());
            }
        }
        words.extend(["--out".into(), out.as_os_str().to_owned()]);
        match Arguments::try_parse_from(words).map(|typed| typed.command) {
            Ok(Command::Render(render)) => Ok(*render),
            Ok(_) => {
                Err(Failure::plain("only `pliant render` makes pictures", format!("mend the list `{LIST}`")))
            }
            Err(error) => {
                Err(Failure::plain(format!("{}: {error}", self.file), format!("mend the list `{LIST}`")))
            }
        }
    }
}

/// Hashes of each picture's sources and of the picture, by its file.
fn sums(folder: &Path) -> BTreeMap<String, [String; 2]> {
    let text = fs::read_to_string(folder.join(SUMS)).unwrap_or_default();
    let line = |line: &str| {
        let mut words = line.split_whitespace().map(str::to_owned);
        let [source, picture, file] = [words.next()?, words.next()?, words.next()?];
        Some((file, [source, picture]))
    };
    text.lines().filter_map(line).collect()
}

fn hash_of(file: &Path) -> Option<String> {
    let mut hash = Sha256::new();
    hash.update(fs::read(file).ok()?);
    Some(hex(hash))
}

/// Returns pictures whose sources have changed, or whose files are not the ones that were made. Each comes
/// with the hash of its sources.
fn outdated(folder: &Path) -> Result<Vec<(Entry, String)>, Failure> {
    let sums = sums(folder);
    let mut old = Vec::new();
    let (entries, look) = entries(folder)?;
    for entry in entries {
        let made = sums.get(&entry.file);
        let source = entry.source(folder, &look)?;
        if made.is_none_or(|made| {
            made[0] != source || hash_of(&folder.join(&entry.file)).as_ref() != Some(&made[1])
        }) {
            old.push((entry, source));
        }
    }
    Ok(old)
}

/// Makes the pictures anew that do not fit their scenes.
fn renew(folder: &Path) -> Result<u8, Failure> {
    let old = outdated(folder)?;
    let space =
        tempfile::tempdir().map_err(|error| Failure::plain(error, "check the free space, or set TMPDIR"))?;
    for (index, (entry, source)) in old.iter().enumerate() {
        let out = space.path().join(index.to_string());
        let command = entry.command(folder, &out)?;
        let code = render(&command)?;
        if code != SUCCESS {
            return Ok(code);
        }
        let file = folder.join(&entry.file);
        let unwritable = |error: std::io::Error| {
            Failure::plain(format!("`{}`: {error}", file.display()), "check the path")
        };
        if command.film.is_none() {
            let taken = fs::read_dir(&out).map_err(unwritable)?.flatten().next();
            taken.map_or(Ok(0), |taken| fs::copy(taken.path(), &file)).map_err(unwritable)?;
        }
        let mut sums = sums(folder);
        sums.insert(entry.file.clone(), [source.clone(), hash_of(&file).unwrap_or_default()]);
        let lines = sums.iter().map(|(file, [source, picture])| format!("{source} {picture} {file}\n"));
        fs::write(folder.join(SUMS), lines.collect::<String>()).map_err(unwritable)?;
        say(format_args!("made {}", file.display()))?;
    }
    say(format_args!("{} pictures were made anew, all others fit their scenes", old.len()))?;
    Ok(SUCCESS)
}

/// Width of a picture in a gallery [pixels].
const GALLERY_WIDTH: u32 = 640;

/// The scenes in a folder that is not a scene itself, in alphabetical order.
fn scenes_in(folder: &Path) -> Vec<PathBuf> {
    if !is_folder_of_run(folder) {
        return Vec::new();
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut scenes: Vec<PathBuf> =
        entries.map(|entry| entry.path()).filter(|path| path.join("scene.toml").is_file()).collect();
    scenes.sort_unstable();
    scenes
}

/// Runs scenes and makes a page with the last picture of each.
fn page(arguments: &Render, scenes: &[PathBuf]) -> Result<u8, Failure> {
    if arguments.film.is_some() || arguments.frames.is_some() || arguments.series.is_some() {
        let message = "a gallery has the last picture of each scene";
        return Err(Failure::plain(message, "omit `--film`, `--frames` and `--series`, or give one scene"));
    }
    let graphics = Graphics::open()?;
    let folder = claim(arguments, |name| name == "README.md" || name.ends_with(".png"))?;
    let until = arguments.overrides.until.map(|until| format!(" --until {until}")).unwrap_or_default();
    let (what, out) = (arguments.what.display(), arguments.out.display());
    let mut page = format!(
        "# Gallery\n\nMade by `pliant render {what} -o {out}{until}`: the final state of each scene.\n"
    );
    let mut failed = false;
    for scene in scenes {
        let Some(mut shown) = run_scene(scene, arguments)? else {
            return Ok(signals::exit_code());
        };
        failed |= shown.failed;
        let name = scene.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let title = if shown.title.is_empty() { name.clone() } else { shown.title };
        let [width, height] = shown.look.size;
        if arguments.size.is_none() {
            shown.look.size = [GALLERY_WIDTH, (GALLERY_WIDTH * height / width).max(1)];
        }
        // The page has the title.
        shown.look.legend.title.clear();
        let file = folder.path().join(format!("{name}.png"));
        let last = shown.series.frames.len() - 1;
        shown.look.pictures(&graphics, &shown.series, &[last], |_, picture| {
            save(&folder, &format!("{name}.png"), &picture)
        })?;
        say(format_args!("wrote {}", file.display()))?;
        page.push_str(&format!(
            "\n## {title}\n\n![{title}]({name}.png)\n\n```sh\npliant render {}{until}\n```\n",
            scene.display()
        ));
    }
    let path = folder.write("README.md", &page).map_err(|error| Failure::plain(&error, error.remedy))?;
    say(format_args!("wrote {} ({})", path.display(), graphics.adapter()))?;
    Ok(u8::from(failed))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn repository() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
    }

    #[test]
    fn lines_name_a_file_a_scene_and_options() {
        let read = entry("../docs/a.png  liver --until 1 # quick").unwrap();
        assert_eq!(
            (read.file.as_str(), &read.words[..]),
            ("../docs/a.png", &["liver", "--until", "1"].map(String::from)[..])
        );
        assert_eq!((entry("# a comment"), entry("")), (None, None));
        let film = Entry { words: ["liver", "--film"].map(String::from).to_vec(), ..read };
        let command = film.command(Path::new("scenes"), Path::new("out")).unwrap();
        assert_eq!(command.film.as_deref(), Some(Path::new("scenes/../docs/a.png")));
    }

    /// After a failure of this test make the pictures anew: `pliant render scenes --gallery`.
    #[test]
    fn pictures_of_this_repository_fit_their_scenes() {
        let old = outdated(&repository().join("scenes")).unwrap();
        let files: Vec<&str> = old.iter().map(|(entry, _)| entry.file.as_str()).collect();
        assert!(
            files.is_empty(),
            "older than their scenes: {files:?}; make them by `pliant render scenes --gallery`"
        );
    }

    #[test]
    fn a_change_of_a_scene_or_of_a_picture_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("ball")).unwrap();
        fs::write(at("ball/scene.toml"), "[scene]").unwrap();
        fs::write(at(LIST), "ball.png ball --until 1").unwrap();
        fs::write(at("ball.png"), "a picture").unwrap();
        let old = || outdated(folder.path()).unwrap().len();
        assert_eq!(old(), 1, "never made");
        let (listed, look) = entries(folder.path()).unwrap();
        let source = listed[0].source(folder.path(), &look).unwrap();
        fs::write(at(SUMS), format!("{source} {} ball.png\n", hash_of(&at("ball.png")).unwrap())).unwrap();
        assert_eq!(old(), 0);
        fs::write(at("ball/README.md"), "a text").unwrap();
        assert_eq!(old(), 0, "texts are not drawn");
        fs::write(at("ball/scene.toml"), "[scene] # other").unwrap();
        assert_eq!(old(), 1);
        fs::write(at("ball/scene.toml"), "[scene]").unwrap();
        fs::write(at("ball.png"), "another").unwrap();
        assert_eq!(old(), 1);
        fs::write(at(LIST), "ball.png ball --until 2").unwrap();
        assert_eq!(old(), 1);
    }

    #[test]
    fn a_renderer_that_draws_otherwise_outdates_all_pictures() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("ball")).unwrap();
        fs::create_dir(at("stored")).unwrap();
        fs::write(at(LIST), "look stored\nball.png ball").unwrap();
        let source = || {
            let (listed, look) = entries(folder.path()).unwrap();
            assert_eq!(listed.len(), 1);
            listed[0].source(folder.path(), &look).unwrap()
        };
        let before = source();
        fs::write(at("stored/bodies.png"), "darker").unwrap();
        assert_ne!(source(), before);
    }

    /// Each scene is listed, and so are the pictures that texts show. Pictures of the window and of missing
    /// data are exceptions.
    #[test]
    fn pictures_in_texts_are_listed() {
        let (listed, _) = entries(&repository().join("scenes")).unwrap();
        let listed_scenes: Vec<String> = listed.iter().map(|entry| entry.words[0].clone()).collect();
        let listed: Vec<PathBuf> = listed
            .iter()
            .filter_map(|entry| repository().join("scenes").join(&entry.file).canonicalize().ok())
            .collect();
        let folder =
            |path: &str| fs::read_dir(repository().join(path)).unwrap().flatten().map(|file| file.path());
        let mut texts: Vec<PathBuf> = ["", "docs", "docs/gallery"].into_iter().flat_map(folder).collect();
        texts.extend(
            folder("scenes")
                .flat_map(|scene| fs::read_dir(scene).into_iter().flatten().flatten())
                .map(|file| file.path()),
        );
        texts.retain(|path| path.extension().is_some_and(|end| end == "md"));
        for scene in scenes_in(&repository().join("scenes")) {
            let name = scene.file_name().unwrap().to_string_lossy().into_owned();
            assert!(listed_scenes.contains(&name), "scenes/{LIST} has no picture of {name}");
        }
        for text in texts {
            let content = fs::read_to_string(&text).unwrap();
            for link in
                content.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link)
            {
                if !link.ends_with(".png") || ELSEWHERE.iter().any(|name| link.ends_with(name)) {
                    continue;
                }
                let picture = text.parent().unwrap().join(link).canonicalize().unwrap();
                assert!(listed.contains(&picture), "{}: {link} is not in scenes/{LIST}", text.display());
            }
        }
    }

    /// Made by `pliant view --screenshot` while the mouse pulls, and of a brain from an image.
    const ELSEWHERE: [&str; 2] = ["window.png", "labels.png"];
}

//! Program that AFL++ runs:
//!
//! ```text
//! cargo afl build --release -p pliant-fuzz --features afl
//! target/release/door scene --seeds in
//! cargo afl fuzz -i in -o found target/release/door scene
//! ```

use std::error::Error;
use std::fs;
use std::path::Path;

use pliant_fuzz::{DOORS, seeds};

fn write_seeds(door: &str, folder: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    for (number, seed) in seeds(door)?.iter().enumerate() {
        fs::write(folder.join(number.to_string()), seed)?;
    }
    Ok(())
}

fn main() {
    let name = std::env::args().nth(1).unwrap_or_default();
    let Some((_, door)) = DOORS.iter().find(|(known, _)| *known == name) else {
        let names: Vec<&str> = DOORS.iter().map(|(name, _)| *name).collect();
        eprintln!("error: `{name}` is no door; these are: {}", names.join(", "));
        std::process::exit(2);
    };
    // `door NAME --seeds DIR` writes the first inputs for AFL++.
    if let Some(folder) = std::env::args().skip_while(|argument| argument != "--seeds").nth(1) {
        write_seeds(&name, folder.as_ref()).unwrap_or_else(|error| panic!("{error}"));
        return;
    }
    afl::fuzz!(|bytes: &[u8]| door(bytes));
}

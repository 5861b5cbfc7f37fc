//! Output of a binary.

use std::process::Output;

use serde_json::Value;

/// The output of a binary.
#[derive(Debug)]
pub struct Said {
    /// The exit code; -1 if a signal ended it.
    pub code: i32,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            out: String::from_utf8(output.stdout).expect("standard output is UTF-8"),
            err: String::from_utf8(output.stderr).expect("standard error is UTF-8"),
        }
    }
}

impl Said {
    /// The one object on standard output.
    ///
    /// # Panics
    /// If there is no single object.
    pub fn json(&self) -> Value {
        let value: Value =
            serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {self:?}"));
        assert!(value.is_object(), "{value}");
        value
    }

    /// The object of a run that went well.
    ///
    /// # Panics
    /// If it failed.
    #[track_caller]
    pub fn done(&self) -> Value {
        assert_eq!(self.code, 0, "{}", self.err);
        let json = self.json();
        assert_eq!(json["status"], "done", "{json}");
        json
    }

    /// Standard error as running text, without the frames that break its lines.
    pub fn words(&self) -> String {
        self.err.replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// True if standard error shows a line of the scene with something underlined in it.
    pub fn underlines(&self, line: &str) -> bool {
        let lines: Vec<&str> = self.err.lines().collect();
        lines.windows(2).any(|pair| {
            pair[0].trim_end().ends_with(&format!("│ {line}")) && pair[1].contains(['─', '┬', '▲'])
        })
    }
}

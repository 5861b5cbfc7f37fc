//! Errors, with a remedy.

use std::io;
use std::net::SocketAddr;

/// Invalid input, or a socket or thread that can't be had.
#[derive(Debug, thiserror::Error)]
pub enum HapticsError {
    /// More planes than a local model holds.
    #[error("a local model has {count} planes, more than {most}; keep the nearest ones")]
    TooManyPlanes {
        /// Planes given.
        count: usize,
        /// Planes that a model holds.
        most: usize,
    },
    /// A number of a local model or of the settings that makes no sense.
    #[error("{what} is {value}; {remedy}")]
    Number {
        /// Description of the invalid number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Advice for a valid number.
        remedy: &'static str,
    },
    /// A compliance that is not symmetric and positive.
    #[error(
        "the compliance of a local model has the eigenvalue {least:.3e} m/N or is not symmetric; give a symmetric matrix with eigenvalues of at least 0"
    )]
    Compliance {
        /// Its smallest eigenvalue [m/N].
        least: f64,
    },
    /// A row of a trace that can't be read.
    #[error(
        "line {line} of the trace: {problem}; give rows `t,x,y,z,qw,qx,qy,qz` in s and m, with increasing times"
    )]
    Trace {
        /// The line, counted from 1.
        line: usize,
        /// Error of the line.
        problem: String,
    },
    /// A file that can't be read.
    #[error("`{path}` cannot be read: {source}; check the path and its permissions")]
    File {
        /// Its path.
        path: String,
        /// Reason.
        source: io::Error,
    },
    /// An address that other machines can reach.
    #[error(
        "{address} is open to other machines; use 127.0.0.1 or [::1], or allow remote devices on a network that you trust"
    )]
    NotLoopback {
        /// The address.
        address: SocketAddr,
    },
    /// A socket that can't be opened.
    #[error("cannot receive datagrams at {address}: {source}; try another port, or 0 for a free one")]
    Socket {
        /// The address.
        address: SocketAddr,
        /// Reason.
        source: io::Error,
    },
    /// A thread that can't be started or has ended early.
    #[error("the haptic thread {problem}; close other programs and start again")]
    Thread {
        /// Description of the failure.
        problem: String,
    },
}

impl HapticsError {
    /// Rejects a number outside of a range, or one that is not finite.
    pub(crate) fn check(
        what: &'static str,
        value: f64,
        fits: bool,
        remedy: &'static str,
    ) -> Result<(), Self> {
        if value.is_finite() && fits { Ok(()) } else { Err(Self::Number { what, value, remedy }) }
    }
}

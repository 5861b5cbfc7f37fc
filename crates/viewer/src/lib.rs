//! The window: a scene played in real time on its own thread, pulled by hand and pinned, looked at from all
//! sides. Everything but the window itself works without a screen. [`Session`] plays, [`pick`] finds the
//! point under a pixel, [`replay()`] repeats the actions of a hand.

mod beside;
mod device;
mod followed;
mod hand;
mod marks;
mod parameters;
mod recording;
mod regions;
mod replay;
mod samples;
mod session;
mod sound;
#[cfg(feature = "window")]
mod window;

pub use followed::FollowedPoint;
pub use hand::{Hand, Hold, Point, Which, pick};
pub use parameters::{Number, Parameter, parameters, with_numbers};
pub use recording::{Break, Done, Move, Recording, Surface};
pub use regions::{coat_of, regions_of};
pub use replay::{Lags, Replayed, replay, replay_in_real_time, replay_until};
pub use samples::{Sample, Samples};
pub use session::{Frame, Order, Session};
#[cfg(feature = "window")]
pub use window::{FinishedRun, Opening, WindowError, open, open_finished};
